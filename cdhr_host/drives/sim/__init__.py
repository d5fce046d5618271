"""The far side, simulated: what real drives, a real coupler or a real bridge would answer.

It shares nothing with the master but the object-dictionary data in ``drives/eds``: a mistake
made on one side must not cancel out on the other. All of it is stepwise, told the time by
its caller; only ``serve`` knows terminals and clocks.
"""
