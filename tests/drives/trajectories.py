"""Smooth setpoints with closed forms, from rest to rest, without the mechanism."""

import dataclasses

import numpy as np

from cdhr_host.drives import Loopback
from cdhr_host.plant import undisturbed
from cdhr_host.profile import find, read_table, validate
from cdhr_host.values import Setpoints

PAPER, _ = validate(read_table(find("paper")))
PERIOD = PAPER.drives.period
DIRECTIONS = np.array(
    [
        [1.0, 0.2, 0.1],
        [-0.5, 0.8, 0.1],
        [-0.5, -0.8, 0.2],
        [0.7, 0, -0.6],
        [-0.3, 0.6, -0.7],
        [-0.4, -0.6, -0.7],
    ]
)


def sliders(nozzle):
    """A smooth, slightly curved stand-in for the mechanism."""
    return nozzle @ DIRECTIONS.T + 0.5 * np.sum(nozzle**2, axis=1)[:, None]


def wave(t, duration, seed=0, size=0.1):
    """(N,) s -> (N, 3) m: from 0 at rest back to 0 at rest."""
    rng = np.random.default_rng(seed)
    z = np.clip(np.asarray(t, dtype=float) / duration, 0.0, 1.0)
    s = z - np.sin(2 * np.pi * z) / (2 * np.pi)
    turns = rng.integers(1, 3, size=3)
    return size * rng.uniform(0.5, 1.0, size=3) * np.sin(2 * np.pi * turns * s[:, None])


def setpoints(nozzle, *, first_tick=0, pressure=80e3):
    """(N, 3) m -> N rows, the air on but for the first and the last ten."""
    count = len(nozzle)
    tick = first_tick + np.arange(count)
    air = np.full(count, pressure)
    air[:10] = air[-10:] = 0.0
    return Setpoints(
        tick=tick,
        t=tick * PERIOD,
        line=1 + np.arange(count) // 20,
        nozzle_G=nozzle,
        upper=0.9 * nozzle,
        slider=sliders(nozzle),
        tension=np.full((count, 6), 6.0),
        flow=air * 1e-12,
        pressure=air,
    )


def within_limits(nozzle, profile=PAPER, share=0.9):
    """The same curve, made smaller until it keeps ``share`` of the nozzle's limits."""
    limits = profile.limits
    bounds = (limits.speed_max, limits.acceleration_max, limits.jerk_max)
    peaks = [np.linalg.norm(np.diff(nozzle, k, axis=0), axis=1).max() / PERIOD**k for k in (1, 2, 3)]
    return nozzle * min(1.0, *(share * b / max(p, 1e-12) for b, p in zip(bounds, peaks, strict=True)))


def run_of(count, *, seed=0, first_tick=0, size=0.1):
    """A whole run of ``count`` rows within the limits, the last two equal."""
    t = np.arange(count) * PERIOD
    nozzle = within_limits(wave(t, (count - 2) * PERIOD, seed, size))
    return setpoints(nozzle, first_tick=first_tick)


def cut(rows, sizes):
    """Rows in batches of the given sizes, again and again."""
    at, k = 0, 0
    while at < len(rows):
        yield rows[at : at + sizes[k % len(sizes)]]
        at += sizes[k % len(sizes)]
        k += 1


def changed(rows, **columns):
    return dataclasses.replace(rows, **columns)


class ManualClock:
    """Time passes by waiting only, and waiting takes no time."""

    def __init__(self, speed=1.0):
        self.speed = speed
        self._now = 0.0

    def now(self):
        return self._now

    def wait_until(self, when):
        self._now = max(self._now, when)


def loopback(speed=1.0, disturbance=undisturbed, profile=PAPER):
    clock = ManualClock(speed)
    link = Loopback(profile, clock, disturbance=disturbance)
    link.open()
    return link, clock


def distance_from_curve(points, curve):
    """(M, k) points, (N, k) dense samples of a curve -> (M,) distance from its chords."""
    begin, along = curve[:-1], np.diff(curve, axis=0)
    square = np.maximum(np.sum(along**2, axis=1), 1e-300)
    found = np.empty(len(points))
    for m, point in enumerate(points):
        share = np.clip(np.sum((point - begin) * along, axis=1) / square, 0.0, 1.0)
        found[m] = np.linalg.norm(begin + share[:, None] * along - point, axis=1).min()
    return found
