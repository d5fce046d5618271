"""Rows of straight moves (G0, G1) -> commands, a whole batch at once.

A row is the numbers of one line as written, ``(g, F, Z, X, Y, Z, E, F, "")``: ``g`` is ``"0"``
or ``"1"``, a word that is not there is ``""``, and F and Z stand in one of their two places.
The fast reader and the general parser both make such rows, so both mean the same.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdhr_host.program.modal import CLAY_LEAST, GRID_DIGITS, Modal
from cdhr_host.units import MINUTE
from cdhr_host.values import Array, Command, Ints, Moves, Prime

BATCH: Final = 1024
"""Greatest number of rows taken together."""
LONGEST: Final = 100.0
"""m of arc or curve; nothing that long is meant."""

Row = tuple[str, ...]


def row_of(code: str, digits: Mapping[str, str]) -> Row:
    """The row of a line's command and the numbers after its letters."""
    f, x, y, z, e = (digits.get(letter, "") for letter in "FXYZE")
    return (code[1], f, z, x, y, "", e, "", "")


def has_feed(row: Row) -> bool:
    """Whether F is in the line."""
    return bool(row[1] or row[7])


def has_travel(row: Row) -> bool:
    """Whether X, Y or Z is in the line."""
    return any(row[2:6])


@dataclass(frozen=True, slots=True)
class Steps:
    """N rows resolved against the modal state before them."""

    modal: Modal
    """after the last row; ``top`` and ``near`` are still those from before"""
    points: Array
    """(N + 1, 3) m, from the start of the first row through the end of each"""
    feed: Array
    """(N,) m/s as programmed, NaN before the first F"""
    clay: Array
    """(N,) m³"""


def resolve(modal: Modal, rows: Sequence[Row]) -> Steps:
    """Absolute positions, feeds and clay of rows. Pure: same modal and rows, same result."""
    _, early_f, early_z, x, y, z, e, f, _ = zip(*rows, strict=True)
    count = len(rows)
    feeds, heights = _numbers(_either(early_f, f)), _numbers(_either(early_z, z))
    before = math.nan if modal.feed is None else modal.feed
    feed = np.full(count, before) if feeds is None else _held(feeds * modal.unit / MINUTE, before)
    points = np.empty((count + 1, 3))
    points[0] = modal.position
    for axis, values in enumerate((_numbers(x), _numbers(y), heights)):
        points[1:, axis] = _axis(modal, axis, values)
    push, e_after = _pushed(modal, _numbers(e), count)
    clay, debt = _excess(push, modal.debt)
    last = float(feed[-1])
    after = replace(
        modal,
        position=tuple(points[-1].tolist()),
        onward=None,
        feed=None if math.isnan(last) else last,
        e=e_after,
        debt=debt,
    )
    return Steps(after, points, feed, clay * modal.flow_factor)


def interpret(
    modal: Modal, rows: Sequence[Row], lines: Sequence[int], speed_max: float
) -> tuple[Modal, list[Command]]:
    """Commands of rows, and the modal state after them.

    A row that moves becomes a row of ``Moves``; one that stands still and lays clay a
    ``Prime``; one that does neither vanishes. Speed is ``speed_max`` (m/s) before the first F.
    """
    steps = _laying(modal, resolve(modal, rows), rows)
    speed = np.where(np.isnan(steps.feed), speed_max, steps.feed * modal.speed_factor)
    moved = (steps.points[1:] != steps.points[:-1]).any(axis=1)
    still = np.flatnonzero(~moved & (steps.clay > 0.0))
    line = np.array(lines, dtype=np.int64)
    commands: list[Command] = []
    start, first = steps.points[0], 0
    for at in [*still.tolist(), len(rows)]:
        keep = first + np.flatnonzero(moved[first:at])
        if keep.size:
            commands.append(_moves(keep, line, steps, speed, start=start, air=modal.air))
            start = steps.points[keep[-1] + 1]
        if at < len(rows):
            flow = modal.flow(float(steps.feed[at]))
            commands.append(Prime(int(line[at]), float(steps.clay[at]), flow))
        first = at + 1
    return _printed(steps, modal.air), commands


def _laying(modal: Modal, steps: Steps, rows: Sequence[Row]) -> Steps:
    """With the bead where a row has no E, and the first layer's share."""
    points, clay = steps.points, steps.clay
    if modal.open or modal.marked:
        bead = np.array([0.0 if row[6] else modal.bead(travels=row[0] == "0") for row in rows])
        clay = clay + bead * np.linalg.norm(np.diff(points, axis=0), axis=1)
    if modal.laying.first_factor != 1.0:
        high = np.maximum(points[:-1, 2], points[1:, 2])
        clay = np.where(high <= modal.laying.first_height, modal.laying.first_factor, 1.0) * clay
    return steps if clay is steps.clay else replace(steps, clay=clay)


def laid(modal: Modal, clay: float, has_e: bool, length: float, heights: tuple[float, float]) -> float:
    """m³ of an arc or a curve: what its E says, or the bead along its length (m)."""
    bead = 0.0 if has_e else modal.bead(travels=False) * length
    return modal.laying.share(*heights) * (clay + bead)


def _moves(
    keep: NDArray[np.intp], line: Ints, steps: Steps, speed: Array, *, start: Array, air: float
) -> Moves:
    return Moves(
        line[keep],
        np.array(start),
        steps.points[keep + 1],
        speed[keep],
        steps.clay[keep],
        np.full(keep.size, air),
    )


def _either(early: Sequence[str], late: Sequence[str]) -> Sequence[str]:
    """Each word where it stands, in one of its two places."""
    if not any(early):
        return late
    return [first or second for first, second in zip(early, late, strict=True)]


def _numbers(texts: Sequence[str]) -> Array | None:
    """(N,) numbers with NaN where there is none; None when there is none at all."""
    if not any(texts):
        return None
    if all(texts):
        return np.array(list(map(float, texts)))
    return np.array([float(text) if text else math.nan for text in texts])


def _held(values: Array, before: float) -> Array:
    """NaN -> the last number before it."""
    known = ~np.isnan(values)
    if known.all():
        return values
    source = np.maximum.accumulate(np.where(known, np.arange(1, len(values) + 1), 0))
    return np.concatenate(([before], values))[source]


def _axis(modal: Modal, axis: int, values: Array | None) -> Array | float:
    """(N,) m, where each row ends on one axis; one number when it does not move."""
    before = modal.position[axis]
    if values is None:
        return before
    if modal.absolute:
        return _held(np.round(values * modal.unit + modal.offset[axis], GRID_DIGITS), before)
    return np.round(before + np.cumsum(np.nan_to_num(values * modal.unit)), GRID_DIGITS)


def _pushed(modal: Modal, values: Array | None, count: int) -> tuple[Array, float]:
    """((N,) m³ that each row's E asks for, E after the last row)."""
    if values is None:
        return np.zeros(count), modal.e
    if modal.absolute_e:
        programmed = np.empty(count + 1)
        programmed[0] = modal.e
        programmed[1:] = _held(values * modal.e_unit, modal.e)
        return (programmed[1:] - programmed[:-1]) * modal.clay_per_e, float(programmed[-1])
    steps = np.nan_to_num(values * modal.e_unit)
    return steps * modal.clay_per_e, modal.e + float(steps.sum())


def _excess(push: Array, debt: float) -> tuple[Array, float]:
    """((N,) m³ of clay, debt after): clay never goes back, a retraction is paid off first."""
    if debt == 0.0 and push.min() >= 0.0:
        return np.where(push > CLAY_LEAST, push, 0.0), 0.0
    clay = []
    for step in push.tolist():
        debt -= step
        clay.append(-debt if debt < -CLAY_LEAST else 0.0)
        debt = debt if debt > CLAY_LEAST else 0.0
    return np.array(clay), debt


def _printed(steps: Steps, air: float) -> Modal:
    """The modal state with the height and the nearness of what these rows lay."""
    laid = np.ones(len(steps.clay), dtype=np.bool_) if air > 0.0 else steps.clay > 0.0
    if not laid.any():
        return steps.modal
    starts, ends = steps.points[:-1][laid], steps.points[1:][laid]
    top = max(starts[:, 2].max(), ends[:, 2].max())
    near = axis_distance(starts[:, :2], ends[:, :2]).min()
    return replace(steps.modal, top=max(steps.modal.top, float(top)), near=min(steps.modal.near, float(near)))


def axis_distance(starts: Array, ends: Array) -> Array:
    """(N, 2), (N, 2) -> (N,): m from the reference axis (x = y = 0) to each segment."""
    along = ends - starts
    square = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
    share = np.clip(-(starts * along).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.hypot(*(starts + share[:, None] * along).T))


def reach(points: Array, above: float, beside: float) -> tuple[float, float]:
    """(M + 1, 3) m of a curve's chords -> m: its top, and its distance to the reference axis.

    The curve may be ``above`` its chords by so many metres, and ``beside`` them by so many.
    """
    near = float(axis_distance(points[:-1, :2], points[1:, :2]).min())
    return float(points[:, 2].max()) + above, max(near - beside, 0.0)
