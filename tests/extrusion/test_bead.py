"""Beads measured from planned and laid flow."""

import numpy as np
import pytest

from cdhr_host.extrusion.bead import beads

T = 0.004
STEP = 80e-6
"""m a tick: 20 mm/s"""
FLOW = 200e-9


def path(*runs):
    """Runs of (ticks, whether clay flows) along x -> lines, places and flow."""
    flow = np.concatenate([np.full(count, FLOW * clay) for count, clay in runs])
    line = np.concatenate([np.full(count, n) for n, (count, _) in enumerate(runs, start=1)])
    nozzle = np.zeros((len(flow), 3))
    nozzle[:, 0] = STEP * np.arange(len(flow))
    return line, nozzle, flow


def test_beads_are_told_apart_by_travel_and_measured():
    line, nozzle, flow = path((100, 0), (500, 1), (100, 0), (250, 1), (100, 0))
    found = beads(line, nozzle, flow, flow, T)
    assert [bead.line for bead in found] == [2, 4]
    assert [bead.length for bead in found] == pytest.approx([500 * STEP, 250 * STEP])
    assert [bead.planned for bead in found] == pytest.approx([500 * T * FLOW, 250 * T * FLOW])
    assert [share for bead in found for share in (bead.least, bead.most)] == pytest.approx([1.0] * 4)
    assert all(bead.seam is None for bead in found)


@pytest.mark.parametrize("late", [-20, 15, 30])
def test_late_clay_is_late_at_start_and_end(late):
    line, nozzle, flow = path((100, 0), (500, 1), (100, 0))
    (bead,) = beads(line, nozzle, flow, np.roll(flow, late), T)
    if late > 0:
        assert (bead.start_late, bead.end_late) == pytest.approx((late * STEP, late * STEP))
        assert bead.least < 0.1
    else:
        assert bead.end_late == pytest.approx(late * STEP)
    assert bead.laid == pytest.approx(bead.planned)


def test_a_rest_does_not_end_a_bead_and_a_thin_place_is_found():
    line, nozzle, flow = path((100, 0), (200, 1), (200, 1), (100, 0))
    rest = np.repeat(nozzle[300:301], 50, axis=0)
    nozzle = np.vstack([nozzle[:300], rest, nozzle[300:]])
    flow = np.concatenate([flow[:300], np.zeros(50), flow[300:]])
    line = np.concatenate([line[:300], np.full(50, 2), line[300:]])
    laid = flow.copy()
    laid[200:240] *= 0.5
    (bead,) = beads(line, nozzle, flow, laid, T)
    assert bead.least == pytest.approx(0.5, abs=0.05)
    assert bead.length == pytest.approx(400 * STEP)


def test_a_ring_has_a_seam():
    angle = np.linspace(0.0, 2 * np.pi, 1001)
    nozzle = 0.0127 * np.stack((np.cos(angle), np.sin(angle), 0 * angle), axis=1)
    flow = np.full(1001, FLOW)
    flow[0] = 0.0
    laid = flow.copy()
    laid[-12:] = 0.0
    (bead,) = beads(np.ones(1001, int), nozzle, flow, laid, T)
    assert bead.seam == pytest.approx(0.5, abs=0.05)


def test_no_clay_is_no_bead():
    assert beads(*path((50, 0)), np.zeros(50), T) == []
