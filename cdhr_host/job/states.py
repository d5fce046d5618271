"""The states of a job and what leads from one to another: one table, printed in docs/job.md."""

from enum import Enum
from typing import Final

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.surface import JobState as S


class Word(Enum):
    """What is asked of a job, or happens to it."""

    LOAD = "load"
    PROVEN = "proven"
    REFUSED = "refused"
    UNLOAD = "unload"
    START = "start"
    RECOVER = "recover"
    OPEN = "lines"
    HOLD = "hold"
    PAUSED = "pause"
    RESTED = "at rest"
    RESUME = "resume"
    UP = "up to speed"
    ABORT = "abort"
    LIFTED = "lifted"
    FINISHED = "end of program"
    FAIL = "fault"
    ACKNOWLEDGE = "acknowledge"


ASKED: Final = frozenset(
    {
        Word.LOAD,
        Word.UNLOAD,
        Word.START,
        Word.RECOVER,
        Word.OPEN,
        Word.HOLD,
        Word.RESUME,
        Word.ABORT,
        Word.ACKNOWLEDGE,
    }
)
"""words of an operator; the others happen"""

TABLE: Final[dict[tuple[S, Word], S]] = {
    **{(state, Word.LOAD): S.PROVING for state in (S.IDLE, S.READY, S.DONE, S.STOPPED)},
    **{(state, Word.UNLOAD): S.IDLE for state in (S.IDLE, S.READY, S.DONE, S.STOPPED)},
    **{(state, Word.OPEN): S.PRINTING for state in (S.IDLE, S.READY, S.DONE, S.STOPPED)},
    (S.PROVING, Word.PROVEN): S.READY,
    (S.PROVING, Word.REFUSED): S.IDLE,
    (S.PROVING, Word.ABORT): S.IDLE,
    (S.READY, Word.START): S.PRINTING,
    (S.READY, Word.RECOVER): S.HELD,
    (S.DONE, Word.START): S.PRINTING,
    (S.PRINTING, Word.HOLD): S.HOLDING,
    (S.PRINTING, Word.PAUSED): S.HELD,
    (S.PRINTING, Word.ABORT): S.STOPPING,
    (S.PRINTING, Word.FINISHED): S.DONE,
    (S.HOLDING, Word.HOLD): S.HOLDING,
    (S.HOLDING, Word.RESTED): S.HELD,
    (S.HOLDING, Word.PAUSED): S.HELD,
    (S.HOLDING, Word.ABORT): S.STOPPING,
    (S.HOLDING, Word.FINISHED): S.DONE,
    (S.HELD, Word.HOLD): S.HELD,
    (S.HELD, Word.RESUME): S.RESUMING,
    (S.HELD, Word.ABORT): S.STOPPING,
    (S.RESUMING, Word.HOLD): S.HOLDING,
    (S.RESUMING, Word.UP): S.PRINTING,
    (S.RESUMING, Word.PAUSED): S.HELD,
    (S.RESUMING, Word.ABORT): S.STOPPING,
    (S.RESUMING, Word.FINISHED): S.DONE,
    (S.STOPPING, Word.ABORT): S.STOPPING,
    (S.STOPPING, Word.LIFTED): S.STOPPED,
    **{(state, Word.FAIL): S.FAULT for state in S},
    (S.FAULT, Word.ACKNOWLEDGE): S.IDLE,
}

QUIET: Final = frozenset({S.IDLE, S.READY, S.HELD, S.STOPPED, S.DONE})
"""no program moves the machine: it may be jogged, and typed G-code run"""
MOVING: Final = frozenset({S.PRINTING, S.HOLDING, S.RESUMING, S.STOPPING})
"""a program moves it"""


def after(state: S, word: Word) -> S:
    """The state a word leads to; raises JobError where it is not allowed."""
    if (state, word) in TABLE:
        return TABLE[state, word]
    allowed = [each.value for at, each in TABLE if at is state and each in ASKED]
    raise JobError(
        Problem(
            "state",
            f"'{word.value}' is not possible while the printer is {state.value}",
            hint=f"possible now: {', '.join(allowed)}" if allowed else "wait until it is done",
        )
    )


def can(state: S, word: Word) -> bool:
    """Whether a word is allowed."""
    return (state, word) in TABLE


def drawn() -> str:
    """The table in Markdown, for docs/job.md; words that lead to the same state share an arrow."""
    arrows: dict[S, dict[S, list[str]]] = {state: {} for state in S}
    for (state, word), target in TABLE.items():
        if word is not Word.FAIL and state is not target:
            arrows[state].setdefault(target, []).append(word.value)
    ways = (
        [f"{', '.join(words)} → **{target.value}**" for target, words in each.items()]
        for each in arrows.values()
    )
    rows = (f"| {state.value} | {' · '.join(way)} |" for state, way in zip(arrows, ways, strict=True))
    return "\n".join(["| state | what leads from it |", "|---|---|", *rows])
