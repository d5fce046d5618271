"""One print: setpoints to the drives, feedback to the log."""

from cdhr_host.job.stream import Streamer, stream
from cdhr_host.job.tally import RunSummary, Tally

__all__ = ["RunSummary", "Streamer", "Tally", "stream"]
