"""The command line: commands, exit codes, and the only printing."""

from cdhr_host.cli.app import main

__all__ = ["main"]
