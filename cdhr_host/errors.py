"""Everything the package refuses, as one tree.

CdhrError                 exit code
├── ProfileError          3   a profile is missing, malformed or inconsistent
├── ProgramError          4   G-code that is not understood
├── MotionError           5   out of reach, cable slack or overloaded, not plannable
├── DriveError            6   timeout, fault, following error
└── JobError              7   cannot resume, journal damaged

An error carries problems: one sentence each, with the place, the number, the limit and a
hint. Only the command line prints them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

MAX_LISTED = 100
"""Problems an error lists; further ones are only counted."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One reason to refuse.

    ``place`` says where inside the source: a G-code ``line`` (with ``column``), or a
    profile's ``section.key``. ``value`` and ``limit`` are numbers with their unit already
    in ``message``; they are repeated bare for machine readers, in the unit of ``unit``.
    """

    kind: str
    message: str
    line: int | None = None
    column: int | None = None
    key: str | None = None
    value: float | str | None = None
    limit: float | str | None = None
    unit: str | None = None
    hint: str | None = None


class CdhrError(Exception):
    """Base of all refusals: one or more problems, and how many more were only counted."""

    exit_code: ClassVar[int] = 1

    def __init__(self, problems: Problem | Sequence[Problem] | str, *, total: int | None = None) -> None:
        if isinstance(problems, str):
            problems = Problem("error", problems)
        listed = (problems,) if isinstance(problems, Problem) else tuple(problems)
        self.problems: tuple[Problem, ...] = listed[:MAX_LISTED]
        self.total: int = max(len(listed), total or 0)
        super().__init__(self.problems[0].message)


class ProfileError(CdhrError):
    """A profile that cannot be used: unknown key, wrong type, out of range, inconsistent."""

    exit_code = 3


class ProgramError(CdhrError):
    """G-code that is not understood; every problem of the file at once."""

    exit_code = 4


class MotionError(CdhrError):
    """Motion the machine cannot do: out of reach, force window, not plannable."""

    exit_code = 5


class DriveError(CdhrError):
    """A drive or its link failed: timeout, fault, following error."""

    exit_code = 6


class JobError(CdhrError):
    """A print cannot start or go on."""

    exit_code = 7
