"""The command line: commands, exit codes, and the only printing."""

import os

# Matrices here are small: spread over all cores they take twenty times the time, and cores that others need.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Looking for plugins means reading what every installed package says of itself.
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

from cdhr_host.cli.app import main

__all__ = ["main"]
