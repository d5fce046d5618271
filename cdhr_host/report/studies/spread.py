"""Many independent jobs: on all cores, or on a Dask cluster; the same answers, in the order of the jobs.

A job is a value and the work a function of a module: what comes out depends on neither how many
processes there are nor which of them does what.
"""

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Final, TypeVar

from cdhr_host import __version__

J = TypeVar("J")
R = TypeVar("R")
PATIENCE: Final = 10
"""s to find a scheduler"""


class ClusterError(Exception):
    """The cluster cannot be used; the message says why and what would do."""


def cores() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0))


def spread(
    work: Callable[[J], R], jobs: Sequence[J], *, workers: int | None = None, scheduler: str | None = None
) -> Iterator[R]:
    """The work's answer to each job, in order, as they come.

    ``workers`` processes, all cores by default; with ``scheduler`` (``tcp://host:port``) the workers
    of a Dask cluster instead. Raises ClusterError where that cannot be used.
    """
    count = min(workers or cores(), len(jobs))
    if scheduler is not None:
        yield from _on_cluster(work, jobs, scheduler)
    elif count < 2:
        yield from map(work, jobs)
    else:
        with ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn")) as pool:
            yield from pool.map(work, jobs)


def _on_cluster(work: Callable[[J], R], jobs: Sequence[J], scheduler: str) -> Iterator[R]:
    try:
        from distributed import Client  # noqa: PLC0415 -- the extra dask
    except ImportError as error:
        raise ClusterError("--scheduler needs Dask: pip install 'cdhr-host[dask]'") from error
    try:
        client = Client(scheduler, timeout=PATIENCE)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        hint = "hint: dask scheduler starts one; without --scheduler all cores of this machine work"
        raise ClusterError(f"no Dask scheduler answers at {scheduler}: {error}\n{hint}") from error
    with client:
        versions = client.run(_version)
        if not versions:
            raise ClusterError(f"the scheduler at {scheduler} has no workers: start dask worker {scheduler}")
        if set(versions.values()) != {__version__}:
            found = ", ".join(sorted(set(versions.values())))
            raise ClusterError(f"workers have cdhr-host {found}, this is {__version__}: install the same")
        futures = client.map(work, jobs, pure=False)
        yield from (future.result() for future in futures)


def _version() -> str:
    return __version__
