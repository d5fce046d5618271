"""The black box: the last minute of a run, kept in memory, written when it ends other than planned.

The file is a NumPy archive (.npz): one array for each column of a run's log, and ``meta``, a JSON
text with what happened, the events on the way, the last lines of G-code, the program, the profile
and the versions. It needs nothing but numpy to read, and no pickles.
"""

import json
import platform
from collections import deque
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np

from cdhr_host import __version__
from cdhr_host.drives.rows import joined
from cdhr_host.errors import JobError, Problem
from cdhr_host.pipeline.columns import Column, run_columns
from cdhr_host.profile import described
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Feedback, Setpoints

KEPT: Final = 60.0
"""s of rows"""
EVENTS: Final = 1000
LINES: Final = 50
SUFFIX: Final = ".npz"


class BlackBox:
    """The last minute; its size does not grow with the run."""

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        self._most = round(KEPT / profile.drives.period)
        self._batches: deque[tuple[Setpoints, Feedback]] = deque()
        self._rows = 0
        self._events: deque[dict[str, Any]] = deque(maxlen=EVENTS)
        self._tick = -1
        self.line = 0
        """of the program, executed last; lifts and typed moves have none"""

    def executed(self, rows: Setpoints, feedback: Feedback) -> None:
        """N >= 1 executed rows, and what was measured at each."""
        self._batches.append((rows, feedback))
        self._rows += len(rows)
        self._tick = int(rows.tick[-1])
        while self._rows - len(self._batches[0][0]) >= self._most:
            self._rows -= len(self._batches.popleft()[0])

    def event(self, kind: str, text: str) -> None:
        """Something happened: a state, a word of the operator, a message of the bus."""
        self._events.append({"tick": self._tick, "kind": kind, "text": text})

    @property
    def lines(self) -> range:
        """Numbers of the last lines of G-code up to the one being executed."""
        return range(max(self.line - LINES + 1, 1), self.line + 1)

    def write(self, path: Path, why: Problem, program: str, lines: Iterable[str]) -> None:
        """Keep it all; ``lines`` are the texts of ``self.lines``. Raises JobError when it cannot."""
        meta = {
            "version": __version__,
            "python": platform.python_version(),
            "program": program,
            "why": asdict(why),
            "events": list(self._events),
            "lines": [
                {"line": number, "text": text} for number, text in zip(self.lines, lines, strict=False)
            ],
            "profile": {f"{section}.{key}": value for section, key, value, _ in described(self._profile)},
        }
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._save(path, json.dumps(meta))
        except OSError as error:
            raise JobError(Problem("black-box", f"cannot write {path}: {error.strerror}")) from error

    def _save(self, path: Path, meta: str) -> None:
        """Beside its place first, so that a file of this name is always whole."""
        beside = path.with_name(f".{path.name}")
        arrays: dict[str, Any] = {"meta": np.array(meta), **self._columns()}
        try:
            with beside.open("wb") as file:
                np.savez_compressed(file, **arrays)
            beside.replace(path)
        except OSError:
            beside.unlink(missing_ok=True)
            raise

    def _columns(self) -> dict[str, Column]:
        if not self._batches:
            return {}
        rows, feedback = zip(*self._batches, strict=True)
        return run_columns(joined(rows), joined(feedback))


def read_black_box(path: Path) -> tuple[dict[str, Column], dict[str, Any]]:
    """The columns, (N,) each, and ``meta``; raises JobError for a file that is no black box."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            columns = {name: archive[name] for name in archive.files}
        meta = json.loads(str(columns.pop("meta")))
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile) as error:
        raise JobError(Problem("black-box", f"{path} is not a black box: {error}")) from error
    return columns, meta
