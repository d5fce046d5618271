"""Near the ends of the force windows the nozzle accelerates less, and stays inside them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdhr_host.mechanism import nine_tensions
from cdhr_host.motion.leg import Segments
from cdhr_host.motion.room import ALL, LEVELS
from cdhr_host.pipeline import open_profile, prove
from cdhr_host.pipeline.rig import Rig

PAPER = open_profile("paper")
RIG = Rig.from_profile(PAPER)
RATE = 1000.0
NEAR = b"G1 X170 Z100 F6000\nG1 X184\nG1 Y15\nG1 X170\nG1 Y-15\nG1 X184\n"
"""corners and ends where some 0.2 m/s² are left of 0.5"""
OUTSIDE = b"G1 X170 Z100 F6000\nG1 X230\n"


def windows(profile=PAPER):
    forces = profile.forces
    low = np.repeat([forces.lower_min, forces.single_min, forces.upper_min], [3, 6, 3])
    high = np.repeat([forces.lower_max, forces.single_max, forces.upper_max], [3, 6, 3])
    return low, high


def logged(program, profile=PAPER):
    """Proof, places of the nozzle and of the upper platform, at RATE."""
    rows = []
    proof = prove([program], profile, rate_hz=RATE, sink=rows.append)
    return proof, *(np.concatenate([getattr(each, name) for each in rows]) for name in ("nozzle_G", "upper"))


def forces(nozzle, upper, rig=RIG):
    """(N - 2, 12) N by Eq. (11)-(14) from second differences of places alone."""
    accelerations = [np.diff(each, 2, axis=0) * RATE**2 for each in (nozzle, upper)]
    q = nozzle[1:-1] - rig.cables.reference_G
    nine = nine_tensions(rig.cables, rig.loads, rig.pairs, q, upper[1:-1], *accelerations)
    return np.hstack((nine[:, :3] + nine[:, 3:6], nine))


def unbounded(monkeypatch):
    usual = Rig.limits
    monkeypatch.setattr(Rig, "limits", lambda rig: replace(usual(rig), room=ALL))


def test_slower_where_full_acceleration_would_leave_a_window(monkeypatch):
    proof, nozzle, upper = logged(NEAR)
    assert proof.ok
    low, high = windows()
    found = forces(nozzle, upper)
    assert (found >= low).all()
    assert (found <= high).all()
    unbounded(monkeypatch)
    refused = prove([NEAR], PAPER, rate_hz=RATE)
    assert {problem.kind for problem in refused.problems} == {"force"}
    assert refused.duration < proof.duration


def test_what_is_outside_at_rest_is_refused_with_line_cable_number_and_limit():
    proof = prove([OUTSIDE], PAPER)
    assert not proof.ok
    (problem, *_) = proof.problems
    assert (problem.kind, problem.line, problem.unit) == ("force", 2, "N")
    assert problem.key.startswith("force ")
    assert "cable" in problem.message
    assert problem.hint


def test_far_from_the_windows_nothing_changes(monkeypatch):
    program = b"G1 X40 Y0 Z10 F6000\nG1 X-40\nG1 Y40\nG2 X40 I40 J0\n"
    here = prove([program], PAPER)
    unbounded(monkeypatch)
    assert prove([program], PAPER).duration == here.duration


@settings(max_examples=8, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-150, 150), st.integers(-150, 150)), min_size=1, max_size=3),
    st.integers(0, 120),
)
def test_forces_stay_inside_or_the_program_is_refused(points, height):
    lines = [f"G1 X{x} Y{y} Z{height} F6000" for x, y in points]
    rows = []
    proof = prove([("\n".join(lines) + "\n").encode()], PAPER, rate_hz=RATE, sink=rows.append)
    if any(problem.kind == "force" for problem in proof.problems):
        at_rest = RIG.room.measure(drawn(points, height)).min(axis=1)
        assert at_rest.min() <= LEVELS[0] * PAPER.limits.acceleration_max + SPARE
    if not proof.ok:
        return
    nozzle, upper = (np.concatenate([getattr(each, name) for each in rows]) for name in ("nozzle_G", "upper"))
    low, high = windows()
    found = forces(nozzle, upper)
    assert (found >= low - 1e-4).all()
    assert (found <= high + 1e-4).all()


SPARE = 0.05
"""m/s², that is kept for where smoothing takes the nozzle beside what is drawn"""


def drawn(points, height):
    """(N, 3) m along the program, a millimetre apart or nearer."""
    corners = np.array([[0, 0, 0], *((x, y, height) for x, y in points)]) * 1e-3
    way = np.linspace(0.0, 1.0, 500)[:, None]
    return np.concatenate([a + (b - a) * way for a, b in pairwise(corners)])


@pytest.mark.parametrize("name", ["paper", "paper-simulation"])
def test_the_table_never_promises_more_than_there_is(name):
    profile = open_profile(name)
    room, bed = Rig.from_profile(profile).room, profile.bed
    chance = np.random.default_rng(5)
    turn, r = chance.uniform(0, 2 * np.pi, 2000), bed.radius * np.sqrt(chance.uniform(0, 1, 2000))
    places = np.column_stack((r * np.cos(turn), r * np.sin(turn), chance.uniform(0, bed.height, 2000)))
    assert (room.measure(places).min(axis=1) >= room._table.least[room._boxes(places)]).all()
    sideways = 1e-5 * chance.normal(size=places.shape)
    changed = np.abs(room.measure(places + sideways) - room.measure(places)).max(axis=1)
    assert (changed <= room._table.slope * np.linalg.norm(sideways, axis=1)).all()


def test_a_divided_segment_is_the_same_line():
    points = np.array([[0.0, 0.0, 0.1], [0.19, 0.0, 0.1]])
    count, share = RIG.room.along(points, 0.5, 0.25e-3)
    assert len(share) == count.sum() > 1
    assert share[0] == 1.0
    assert share[-1] < 1.0
    assert set(share) <= set(LEVELS)
    assert (np.diff(share) <= 0).all()
    drawn = Segments(points, *np.ones((5, 1)))
    parts = replace(drawn, line=drawn.line.astype(int)).divided(count, share)
    assert len(parts) == len(share)
    assert np.allclose(np.diff(parts.points, axis=0), np.diff(points, axis=0) / len(share), atol=1e-15)
