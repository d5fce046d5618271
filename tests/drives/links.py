"""Every link there is, to run one suite over."""

import numpy as np
from bench import Bench, BridgeBench, PtyWire
from durand_far import DurandStation
from trajectories import loopback

from cdhr_host.drives.rows import joined

LINKS = {
    "loopback": loopback,
    "slcan": lambda: over(Bench(wire=PtyWire)),
    "slcan, mode 7": lambda: over(Bench(mode="ip")),
    "link": lambda: over(BridgeBench()),
    "durand": lambda: over(Bench(far=DurandStation, link_loss_tested=True)),
}


def over(bench):
    bench.link.open()
    bench.link.bench = bench
    return bench.link, bench.user


def same(received, sent, link):
    """Equal up to rounding to the link's resolution."""
    return bool((np.abs(received - sent) <= link.resolution * 0.5001).all())


def drained(link, clock, until):
    parts = []
    for _ in range(2000):
        parts.append(link.feedback())
        if until():
            return joined(parts)
        clock.wait_until(clock.now() + 0.1)
    raise AssertionError("the link did not come to its end")


def fed_all(link, clock, rows):
    parts = []
    while len(rows):
        rows = rows[link.feed(rows) :]
        parts.append(link.feedback())
        clock.wait_until(clock.now() + 0.1)
    return parts
