"""The cyclic sender: a process of its own between a ring of setpoints and the bus.

Measured on a busy two-core machine, 15 % of ordinary Python work in a second thread made a
250 Hz cycle late by a whole period 150 times in 2000; a process of its own under SCHED_FIFO
was never late. So the planner fills a ring in shared memory, and this process alone talks
to the drives.
"""

from cdhr_host.drives.sender.near import SenderLink

__all__ = ["SenderLink"]
