"""What slicers say in comments: layers become notices, the rest becomes ``Metadata``."""

import math
from dataclasses import replace
from typing import Final

from cdhr_host.program.run import Run
from cdhr_host.program.text import readable
from cdhr_host.units import MM
from cdhr_host.values import Notice

_LAYER_MARKS: Final = frozenset({"LAYER", "LAYER_CHANGE"})
_TEXTS: Final = {"TYPE": "feature", "FLAVOR": "flavour"}
_NO_FEATURES: Final = frozenset({"travel", "custom", "wipe", "none"})
"""features of ;TYPE: that lay nothing"""
_PATHS: Final = {"start path": True, "end path": False}
_LENGTHS: Final = {"WIDTH": "width", "HEIGHT": "height", "Z": "z"}


def comment(run: Run, text: str, line: int) -> None:
    """A line that is a comment; ``text`` follows its semicolon."""
    name, _, value = text.partition(":")
    name, value = name.strip(" \t"), value.strip(" \t")
    _mark(run, name, value)
    if name in _LAYER_MARKS:
        _layer(run, name, line)
    elif name in _TEXTS:
        _note(run, **{_TEXTS[name]: readable(value)})
    elif name in _LENGTHS:
        length = _number(value)
        if length is not None:
            _note(run, **{_LENGTHS[name]: length * MM})
    elif name == "LAYER_COUNT" and value.isdecimal():
        _note(run, layers=int(value))


def _mark(run: Run, name: str, value: str) -> None:
    """What a comment says about laying the bead, where the profile listens to comments."""
    rule = run.profile.air.comments
    if rule == "type" and name == "TYPE":
        marked = value.casefold() not in _NO_FEATURES
    elif rule == "path" and name.casefold() in _PATHS:
        marked = _PATHS[name.casefold()]
    else:
        return
    if marked != run.modal.marked:
        run.flush()
        run.modal = replace(run.modal, marked=marked)


def _layer(run: Run, mark: str, line: int) -> None:
    """Layers are counted from 1; of two kinds of mark in one program the first one counts."""
    known = run.modal.layer_mark or mark
    if mark == known:
        run.flush()
        run.modal = replace(run.modal, layer=run.modal.layer + 1, layer_mark=mark)
        run.emit(Notice(line, "layer", str(run.modal.layer)))


def _note(run: Run, **changes: str | float | int) -> None:
    run.modal = replace(run.modal, metadata=replace(run.modal.metadata, **changes))  # type: ignore[arg-type]


def _number(text: str) -> float | None:
    """A comment's number; comments are never refused, so anything else is None."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
