"""The jog console: keys and typed G-code through the same staircase as a print."""

from cdhr_host.console.session import Reply, Session
from cdhr_host.console.terminal import from_keys, from_lines

__all__ = ["Reply", "Session", "from_keys", "from_lines"]
