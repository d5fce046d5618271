"""A command as a whole process: CPU seconds and peak memory, as the system accounts for them."""

import os
import resource
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Cost:
    """What one run took."""

    cpu_s: float
    peak_mb: float
    output: str


def cost(command: Sequence[str]) -> Cost:
    """Run a command to its end; raises CalledProcessError when it fails."""
    read, write = os.pipe()
    pid = os.posix_spawnp(
        command[0], list(command), os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, write, 1)]
    )
    os.close(write)
    chunks: list[bytes] = []
    with os.fdopen(read, "rb") as pipe:
        reader = threading.Thread(target=lambda: chunks.append(pipe.read()))
        reader.start()
        _, status, usage = os.wait4(pid, 0)
        reader.join()
    if code := os.waitstatus_to_exitcode(status):
        raise subprocess.CalledProcessError(code, list(command))
    return Cost(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, b"".join(chunks).decode())


def median_cost(command: Sequence[str], runs: int) -> Cost:
    """The run with the median CPU time."""
    return sorted((cost(command) for _ in range(runs)), key=lambda each: each.cpu_s)[runs // 2]


def cdhr(*arguments: str) -> list[str]:
    """The command line under this interpreter."""
    return [sys.executable, "-m", "cdhr_host", *arguments]


def own_cpu_s() -> float:
    """CPU seconds of this process so far."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime
