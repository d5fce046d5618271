"""Rows of straight moves (G0, G1) -> commands, a whole batch at once.

A row is the numbers of one line as written, ``(g, F, X, Y, Z, E, F)``: ``g`` is ``"0"`` or
``"1"``, a word that is not there is ``""``, and F stands before or after the others. The fast
reader and the general parser both make such rows, so both mean the same.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdhr_host.program.modal import CLAY_LEAST, GRID_DIGITS, Modal
from cdhr_host.units import MINUTE
from cdhr_host.values import Array, Command, Ints, Moves, Prime

BATCH: Final = 1024
"""Greatest number of rows taken together."""

Row = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Steps:
    """N rows resolved against the modal state before them."""

    modal: Modal
    """after the last row; ``top`` and ``near`` are still those from before"""
    ends: Array
    """(N, 3) m"""
    feed: Array
    """(N,) m/s as programmed, NaN before the first F"""
    clay: Array
    """(N,) m³"""


def resolve(modal: Modal, rows: Sequence[Row]) -> Steps:
    """Absolute positions, feeds and clay of rows. Pure: same modal and rows, same result."""
    columns = list(zip(*rows, strict=True))
    feeds = _numbers([early or late for early, late in zip(columns[1], columns[6], strict=True)])
    feed_before = math.nan if modal.feed is None else modal.feed
    count = len(rows)
    feed = np.full(count, feed_before) if feeds is None else _held(feeds * modal.unit / MINUTE, feed_before)
    ends = np.stack([_axis(modal, axis, _numbers(columns[2 + axis]), count) for axis in range(3)], axis=1)
    push, e = _pushed(modal, _numbers(columns[5]), count)
    clay, debt = _excess(push, modal.debt)
    last = float(feed[-1])
    after = replace(
        modal,
        position=tuple(ends[-1].tolist()),
        feed=None if math.isnan(last) else last,
        e=e,
        debt=debt,
    )
    return Steps(after, ends, feed, clay * modal.flow_factor)


def interpret(
    modal: Modal, rows: Sequence[Row], lines: Sequence[int], speed_max: float
) -> tuple[Modal, list[Command]]:
    """Commands of rows, and the modal state after them.

    A row that moves becomes a row of ``Moves``; one that stands still and lays clay a
    ``Prime``; one that does neither vanishes. Speed is ``speed_max`` (m/s) before the first F.
    """
    steps = resolve(modal, rows)
    speed = np.where(np.isnan(steps.feed), speed_max, steps.feed * modal.speed_factor)
    before = np.array(modal.position)
    moved = (np.diff(steps.ends, axis=0, prepend=before[None]) != 0.0).any(axis=1)
    still = np.flatnonzero(~moved & (steps.clay > 0.0))
    line = np.array(lines, dtype=np.int64)
    commands: list[Command] = []
    start, first = before, 0
    for at in [*still.tolist(), len(rows)]:
        keep = first + np.flatnonzero(moved[first:at])
        if keep.size:
            commands.append(_moves(keep, line, steps, speed, start=start, air=modal.air))
            start = steps.ends[keep[-1]]
        if at < len(rows):
            flow = modal.flow(float(steps.feed[at]))
            commands.append(Prime(int(line[at]), float(steps.clay[at]), flow))
        first = at + 1
    return _printed(steps, before, modal.air), commands


def _moves(
    keep: NDArray[np.intp], line: Ints, steps: Steps, speed: Array, *, start: Array, air: float
) -> Moves:
    return Moves(
        line[keep],
        np.array(start),
        steps.ends[keep],
        speed[keep],
        steps.clay[keep],
        np.full(keep.size, air),
    )


def _numbers(texts: Sequence[str]) -> Array | None:
    """(N,) numbers with NaN where there is none; None when there is none at all."""
    if not any(texts):
        return None
    return np.array([float(text) if text else math.nan for text in texts])


def _held(values: Array, before: float) -> Array:
    """NaN -> the last number before it."""
    known = ~np.isnan(values)
    if known.all():
        return values
    source = np.maximum.accumulate(np.where(known, np.arange(1, len(values) + 1), 0))
    return np.concatenate(([before], values))[source]


def _axis(modal: Modal, axis: int, values: Array | None, count: int) -> Array:
    """(N,) m, where each row ends on one axis."""
    before = modal.position[axis]
    if values is None:
        return np.full(count, before)
    if modal.absolute:
        return _held(np.round(values * modal.unit + modal.offset[axis], GRID_DIGITS), before)
    return np.round(before + np.cumsum(np.nan_to_num(values * modal.unit)), GRID_DIGITS)


def _pushed(modal: Modal, values: Array | None, count: int) -> tuple[Array, float]:
    """((N,) m³ that each row's E asks for, E after the last row)."""
    if values is None:
        return np.zeros(count), modal.e
    if modal.absolute_e:
        programmed = _held(values * modal.e_unit, modal.e)
        return np.diff(programmed, prepend=modal.e) * modal.clay_per_e, float(programmed[-1])
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


def _printed(steps: Steps, before: Array, air: float) -> Modal:
    """The modal state with the height and the nearness of what these rows lay."""
    laid = np.ones(len(steps.clay), dtype=np.bool_) if air > 0.0 else steps.clay > 0.0
    if not laid.any():
        return steps.modal
    starts = np.concatenate((before[None], steps.ends[:-1]))[laid]
    ends = steps.ends[laid]
    top = max(starts[:, 2].max(), ends[:, 2].max())
    near = axis_distance(starts[:, :2], ends[:, :2]).min()
    return replace(steps.modal, top=max(steps.modal.top, float(top)), near=min(steps.modal.near, float(near)))


def axis_distance(starts: Array, ends: Array) -> Array:
    """(N, 2), (N, 2) -> (N,): m from the reference axis (x = y = 0) to each segment."""
    along = ends - starts
    square = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
    share = np.clip(-(starts * along).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.hypot(*(starts + share[:, None] * along).T))
