"""The operator's consoles: a screen of the terminal, and lines from a pipe."""

from cdhr_host.console.lines import from_lines

__all__ = ["from_lines"]
