"""One self-contained page about a program: the path in three dimensions, times, problems, extremes."""

from cdhr_host.report.page.document import write_page
from cdhr_host.report.page.trail import Trail

__all__ = ["Trail", "write_page"]
