"""Where turning holds the nozzle up, the fastest law there is, in place of one cell after the other.

Cells keep the bounds of their worst place, count turning and changing speed as if both were at their worst
together, and begin and end with s'' = 0. That is quickly planned, and enough wherever the programmed speed is
reached. Where it is not, the nodes of a row of cells are optimised at once (``motion.steps``,
``motion.interior``), between the speeds at both its ends. What comes out is bounded before it is used
(``motion.closely``); where it exceeds a limit, it is planned again with less of that, or else not used.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from cdhr_host.motion.cells import Cells
from cdhr_host.motion.closely import close_bounds, overlapped
from cdhr_host.motion.interior import fastest
from cdhr_host.motion.nodes import Road, Row, least, row
from cdhr_host.motion.steps import Steps
from cdhr_host.motion.time_law import TimeLaw
from cdhr_host.motion.worth import worthwhile
from cdhr_host.values import Array, Flags

STRICTER = 0.998, 1.5
"""A limit that is exceeded is less when planned again: by this, and this power of what is reached of it,"""
BESIDE = 2
"""in as many steps before and after it, too;"""
LITTLE = 1.001
"""the speed everywhere, if it is exceeded by no more: else it is, beside the place, the next time."""
ROUNDING = 1e-12
"""Part of a limit."""
MOST = 1500
"""steps planned with one leg: a tenth of a second of computing, while drives wait for what comes next"""
TRIES = 3
"""times that a row is planned, each stricter than the one before."""


def hastened(law: TimeLaw, cells: Cells, borders: Array, road: Road) -> TimeLaw:
    """The same law, faster where turning holds the nozzle up.

    It passes ``borders`` (K+1,) m/s of the nozzle at the borders of K cells, as before at the ends of rows.
    """
    rows = _affordable([row(law, stretch, road) for stretch in worthwhile(law, cells, borders, road)])
    done: list[Row] = []
    for _ in range(TRIES):
        if not rows:
            break
        looked = [(each, better, _reached(better, road)) for each, better in _solved(rows)]
        done += [better for _, better, reached in looked if reached.max() <= 1.0 + ROUNDING]
        rows = [_stricter(each, reached) for each, _, reached in looked if reached.max() > 1.0 + ROUNDING]
    return _replaced(law, sorted(done, key=lambda each: each.pieces.start))


def _affordable(rows: list[Row]) -> list[Row]:
    """Those that gain most for each step, up to MOST of these."""
    best = sorted(rows, key=lambda each: each.gained / len(each.s), reverse=True)
    steps = np.cumsum([len(each.s) for each in best])
    return best[: int(np.searchsorted(steps, MOST, side="right"))]


def _solved(rows: Sequence[Row]) -> Iterator[tuple[Row, Row]]:
    """Those of the rows that become faster, and what they become."""
    count = np.array([len(each.s) for each in rows])
    first = np.cumsum(count) - count
    steps = [each.steps for each in rows]
    whole = Steps(
        np.concatenate([each.node + shift for each, shift in zip(steps, first, strict=True)]),
        np.repeat(np.arange(len(rows)), count - 1),
        np.concatenate([each.length for each in steps]),
        np.concatenate([each.turning for each in steps], axis=-1),
        np.concatenate([each.speed for each in steps], axis=-1),
        np.concatenate([each.acceleration for each in steps], axis=-1),
        np.concatenate([each.jerk for each in steps], axis=-1),
    )
    found = fastest(
        whole, np.concatenate([each.b for each in rows]), np.concatenate([each.a for each in rows])
    )
    for each, begin, solved in zip(rows, first.tolist(), found.solved, strict=True):
        part = slice(begin, begin + len(each.s))
        better = replace(each, b=found.b[part], a=found.a[part])
        law = better.law()
        if solved and law.onward and law.lasting.sum() < each.time:
            yield each, better


def _reached(found: Row, road: Road) -> Array:
    """(3, N) of speed, acceleration and jerk, what the steps reach at most, over their limits."""
    law = found.law()
    acceleration, jerk = close_bounds(road.path, law)
    met = overlapped(road.path.start, found.s[:-1], found.s[1:])
    speed, room = (least(each, met) for each in (road.speed, road.room))
    reached = np.stack((law.fastest(), acceleration, jerk)).reshape(3, -1, 2).max(axis=2)
    allowed = np.stack((speed, room * road.limits.acceleration, np.full_like(speed, road.limits.jerk)))
    return np.asarray(reached / allowed)


def _stricter(found: Row, reached: Array) -> Row:
    """With less of the limits that steps exceed."""
    steps = found.steps
    beside = np.pad(reached, ((0, 0), (BESIDE, BESIDE)), mode="edge")
    most = np.max([beside[:, k : k + reached.shape[1]] for k in range(2 * BESIDE + 1)], axis=0)
    less = np.where(most > 1.0, STRICTER[0] * most ** -STRICTER[1], 1.0)
    if 1.0 < reached[0].max() <= LITTLE:
        less[0] = float(reached[0].max()) ** -STRICTER[1]
    speed, acceleration, jerk = less[:, None] * np.stack((steps.speed, steps.acceleration, steps.jerk))
    return replace(found, steps=replace(steps, speed=speed, acceleration=acceleration, jerk=jerk))


def _replaced(law: TimeLaw, rows: Sequence[Row]) -> TimeLaw:
    """A law with rows in place of some of its pieces."""
    if not rows:
        return law
    lasting = law.pieces.lasting
    parts: list[tuple[Array, Array, Array, Flags]] = []
    at = 0
    for each in [*rows, None]:
        kept = slice(at, each.pieces.start if each else len(law.t))
        parts.append((law.state[:, kept], lasting[kept], law.within[:, kept], law.close[kept]))
        if each:
            found = each.law()
            within = found.reached.copy()
            within[0, 0], within[1, -1] = each.within
            within[0, 1::2], within[1, 0::2] = each.s[:-1], each.s[1:]
            close = np.ones(len(found.lasting), dtype=np.bool_)
            parts.append((found.state, found.lasting, within, close))
            at = each.pieces.stop
    state, lasting, within, close = (np.concatenate(column, axis=-1) for column in zip(*parts, strict=True))
    end = np.cumsum(lasting)
    return TimeLaw(np.concatenate(([0.0], end[:-1])), float(end[-1]), law.end, state, within, close)
