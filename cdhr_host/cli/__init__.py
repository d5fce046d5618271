"""The command line: commands, exit codes, and the only printing."""

import os

# Matrices here are small: spread over all cores they take twenty times the time, and cores that others need.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from cdhr_host.cli.app import main

__all__ = ["main"]
