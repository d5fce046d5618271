"""Wider kernels where chords stand for a curve, and their corners would hold up the nozzle.

Chords at small angles do not use the tolerance up: the usual kernel leaves each corner's curvature
standing, and the jerk of that grows as the cube of the speed. A kernel of half-width h leaves
|turn| h/6 (1 - u/h)³ of a corner at a distance u. Let the widest of the kernels that reach a place have the
half-width h, and T be the most that is turned over any length of h within 2 h of its corner. Of the corners
that reach the place those nearer than h/2 turn by T at most, those before and after them by T each, and these
leave an eighth or less. So q leaves p by no more than

    h/6 (T + 2 T/8).

Kernels are widened as long as that is no more than the third of the usual half-width that all are
allowed. While widths differ by no more than the corners are apart, q' stays an average of
unit vectors (``smooth_path``), and no wider kernel reaches where a corner stands alone, nor over points that
were moved (``approach``) or at which the feed changes.
"""

import math
from dataclasses import dataclass

import numpy as np

from cdhr_host.motion.beside import SHARP, Allowance
from cdhr_host.values import Array, Flags, Ints

HELD_UP = 1.5
"""A corner holds the nozzle up whose kernel is narrower than this many times the half-width at which
it would take the whole of acceleration or jerk by itself,"""
WISH = 3.0
"""and is widened to no more than this many times that: enough for changing speed as well."""
WIDEST = 4.0
"""Usual half-widths, the widest kernel,"""
PARTS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.42, 0.35, 0.3)
"""and parts of it that are tried."""
FARTHER = 1.25
"""What all turns that reach a place leave there, for one that leaves most of them: 1 + 2/8."""
ALMOST = 0.99
"""Of the usual half-width: no kernel away from the path's ends is narrower."""
TOUCHING = 1e-9
"""m and parts: equal but for rounding, which must not decide how wide a kernel is."""


@dataclass(frozen=True, slots=True)
class Turns:
    """K corners of a polyline, as their kernels are found without what lies around them."""

    at: Array
    """(K,) m of the polyline"""
    turn: Array
    """(K,) length of the change of direction"""
    half: Array
    """(K,) m"""
    alone: Flags
    """(K,) whether no kernel but its own reaches into its room"""
    room: Array
    """(2, K) m of the straights before and after it"""
    ends: Array
    """(2, K) m to both ends of the path"""
    borders: Array
    """(N,) m of the polyline over which no wider kernel reaches, ascending"""

    @property
    def fences(self) -> Array:
        """(L,) m: corners that divide chords into those before and those after, whatever their widths."""
        return self.at[self.alone & (self.turn >= SHARP)]


def widened(turns: Turns, feed: Array, h: float, allowed: Allowance) -> tuple[Array, Flags]:
    """(K,) m half-widths, and which of them are of chords that are smoothed together.

    ``feed`` (K,) m/s is wanted at each, ``h`` m the usual half-width.
    """
    need = _needed(turns.turn, feed, allowed)
    wish = np.where(HELD_UP * need > turns.half, WISH * need, 0.0)
    wish = np.minimum(np.minimum(wish, WIDEST * h), _clear(turns))
    which = np.flatnonzero((turns.turn < SHARP) & (wish > turns.half * (1 + TOUCHING)))
    size = _allowed(turns, wish, which, h)
    chords = np.zeros(len(wish), dtype=np.bool_)
    chords[which] = size > turns.half[which] * (1 + TOUCHING)
    if not chords.any():
        return turns.half, chords
    half = turns.half.copy()
    half[which] = np.maximum(half[which], size)
    return np.where(chords, np.maximum(_even(turns, half, chords), turns.half), turns.half), chords


def firm(turns: Turns, known: float, edge: float, widest: float) -> float:
    """m of the polyline up to which no further drawing changes the path.

    Up to ``known`` m it does not for what single corners need, and up to ``edge`` m the turns stay. A kernel
    reaches one width, ``widest`` (m) at most, is evened with those a width further, and limited by the turns
    three widths beyond.
    """
    fences = turns.fences
    last = int(np.searchsorted(fences, known, "right"))
    divided = float(fences[last - 1]) if last else -math.inf
    return max(divided, min(known - 2 * widest, edge - 5 * widest))


def reach(h: float) -> float:
    """m of path drawn before a place on which it depends, and after it."""
    return 5 * WIDEST * h


def widest(feed: float, h: float, allowed: Allowance) -> float:
    """m/s, m -> m: the widest kernel where no feed is higher; 0 if all keep to ``h``."""
    need = float(_needed(np.array(SHARP), np.array(feed), allowed))
    return min(WISH * need, WIDEST * h) if HELD_UP * need > ALMOST * h else 0.0


def _needed(turn: Array, feed: Array, allowed: Allowance) -> Array:
    """m: the half-width at which a corner by itself takes the whole of acceleration or jerk."""
    by_jerk = np.sqrt(turn * feed**3 / allowed.jerk)
    return np.asarray(np.maximum(by_jerk, turn * feed**2 / allowed.acceleration), dtype=np.float64)


def _clear(turns: Turns) -> Array:
    """(K,) m to borders and fences, or half of that to the path's end if it is nearer."""
    fence = np.concatenate(([-np.inf], np.sort(np.concatenate((turns.borders, turns.fences))), [np.inf]))
    before = turns.at - fence[np.searchsorted(fence, turns.at + TOUCHING) - 1]
    after = fence[np.searchsorted(fence, turns.at - TOUCHING)] - turns.at
    clear = np.stack((before, after))
    return np.asarray(np.where(clear < turns.ends, clear, turns.ends / 2).min(axis=0), dtype=np.float64)


def _allowed(turns: Turns, wish: Array, which: Ints, h: float) -> Array:
    """(L,) m: the widest kernels that the tolerance allows at some corners, as far as wished for; or 0."""
    fence = np.concatenate(([-np.inf], turns.fences, [np.inf]))
    at, size = turns.at[which], np.zeros(len(which))
    first = fence[np.searchsorted(fence, at) - 1] + TOUCHING
    last = fence[np.searchsorted(fence, at, "right")] - TOUCHING
    for part in PARTS:
        width = part * WIDEST * h
        some = np.flatnonzero((size == 0.0) & (width <= wish[which]))
        around = np.stack((at[some] - 2 * width - TOUCHING, at[some] + 2 * width + TOUCHING))
        around = np.clip(around, first[some], last[some])
        good = FARTHER * width * _turned(turns, width, around) <= 2 * h * (1 + TOUCHING)
        size[some[good]] = width
    return size


def _turned(turns: Turns, width: float, around: Array) -> Array:
    """(L,) the most that corners around (2, L) m turn over any width."""
    if not around.size:
        return np.zeros(0)
    fence, total = np.append(turns.fences, np.inf), np.concatenate(([0.0], np.cumsum(turns.turn)))
    last = np.minimum(turns.at + width, fence[np.searchsorted(fence, turns.at, "right")] - 2 * TOUCHING)
    onwards = np.append(total[np.searchsorted(turns.at, last + TOUCHING)] - total[:-1], 0.0)
    spans = np.searchsorted(turns.at, around).T.ravel()
    return np.asarray(np.maximum.reduceat(onwards, spans)[::2], dtype=np.float64)


def _even(turns: Turns, half: Array, chords: Flags) -> Array:
    """(K,) m: widths that differ by no more than the corners are apart, and leave room to those alone."""
    at, kept = turns.at, turns.alone & ~chords
    before = np.where(kept, -turns.room[1], half)
    after = np.where(kept, -turns.room[0], half)
    ahead = np.minimum.accumulate(before - at) + at
    behind = np.minimum.accumulate((after + at)[::-1])[::-1] - at
    return np.asarray(np.minimum(ahead, behind), dtype=np.float64)
