"""One slider alone: where it goes, what is refused, what ends it."""

from dataclasses import replace

import numpy as np
import pytest
from test_printer import PAPER, Desk

from cdhr_host.errors import JobError
from cdhr_host.job.surface import JobState
from cdhr_host.job.tension_guard import TensionGuard
from cdhr_host.mechanism import Cables, lengths
from cdhr_host.plant.disturbances import Stuck
from cdhr_host.units import MM


@pytest.fixture
def desk(tmp_path):
    return Desk(tmp_path)


def stepped(desk, axis, distance_mm):
    answer = desk.printer.step_slider(axis, distance_mm * MM)
    while not answer.done():
        desk.go(most=0.02)
    return answer.result()


@pytest.mark.parametrize("axis", range(6))
def test_one_slider_moves_and_the_others_stay(desk, axis):
    assert stepped(desk, axis, 1.0).ok
    rows = desk.done()
    others = np.delete(rows.slider, axis, axis=1)
    assert np.abs(others).max() < 1e-12
    assert rows.slider[-1, axis] == pytest.approx(1 * MM, abs=1e-12)
    speed = np.diff(rows.slider[:, axis]) / PAPER.drives.period
    assert 0.0 <= speed.min() < speed.max() <= 5 * MM
    assert speed[[0, -1]] == pytest.approx([0, 0], abs=1e-4)


def test_the_nozzle_is_where_the_cables_have_it_and_that_is_told(desk):
    for axis, distance in ((0, 1.0), (1, 0.1), (4, -1.0)):
        assert stepped(desk, axis, distance).ok
    status, cables = desk.printer.status(), Cables.from_profile(PAPER)
    here = (status.nozzle_G - cables.reference_G)[None], status.upper[None]
    length = lengths(cables, *here)[0] - cables.reference_lengths
    assert length == pytest.approx(np.array([1.0, 0.1, 0, 0, -1.0, 0]) * MM, abs=1e-10)
    assert desk.told("message")[0] == ("slider 1 pays out 1 mm: the nozzle goes X-0.757 Y+0.000 Z+0.703")
    assert np.linalg.norm(status.upper - here[0][0]) > 0.1 * MM


def test_g_code_goes_on_from_there(desk):
    stepped(desk, 0, 1.0)
    x = desk.printer.status().nozzle_G[0] / MM
    assert desk.run("G91\nG1 X5 F600\nG90").lines[0].startswith(f"X:{x + 5:.3f}")
    assert desk.run("G28").ok
    assert desk.printer.status().homed


def test_a_step_that_leaves_the_bed_is_refused(desk):
    reply = stepped(desk, 0, -1.0)
    assert not reply.ok
    assert reply.lines[0] == "error: the nozzle would be at z = -0.704 mm, below the bed at 0 mm"
    assert "nothing moved" in reply.lines[1]
    assert not desk.rows


def test_a_step_that_leaves_a_force_window_is_refused(desk):
    stepped(desk, 3, -1.0)
    force = desk.done().tension[:, 3]
    assert force[-1] > force[0]
    forces = PAPER.forces.model_copy(update={"upper_max": float(force[[0, -1]].mean())})
    tight = Desk(desk.folder, PAPER.model_copy(update={"forces": forces}))
    reply = stepped(tight, 3, -1.0)
    assert reply.lines[0].startswith("error: cable 4 would carry")
    assert reply.problems[0].value == pytest.approx(force.max(), abs=5e-4)
    assert not tight.rows
    assert stepped(tight, 3, 1.0).ok


def test_only_small_steps_of_sliders_there_are(desk):
    with pytest.raises(JobError, match="up to 1 mm at a time, not by 10 mm"):
        desk.printer.step_slider(0, 10 * MM)
    with pytest.raises(JobError, match="no slider 7"):
        desk.printer.step_slider(6, 1 * MM)
    with pytest.raises(JobError, match="not by nan mm"):
        desk.printer.step_slider(0, float("nan"))


def test_not_under_a_program(desk):
    desk.load("G1 X10 F600\n")
    assert desk.printer.state is JobState.READY
    with pytest.raises(JobError, match="while the printer is ready"):
        desk.printer.step_slider(0, 1 * MM)


def test_a_hold_ends_it_on_its_way(desk):
    answer = desk.printer.step_slider(0, 1 * MM)
    desk.go(most=0.2)
    desk.printer.hold()
    desk.go(most=1.0)
    assert answer.result().lines[0].startswith("stopped on the path")
    rows = desk.done()
    assert 0.05 * MM < rows.slider[-1, 0] < 0.9 * MM
    assert np.abs(rows.slider[:, 1:]).max() < 1e-9
    assert desk.printer.run("G28") is not None
    desk.go(most=5.0)
    assert desk.printer.status().homed


@pytest.mark.parametrize(("amiss", "side"), [(1.0, "more than"), (-1.0, "less than")])
def test_measured_forces_end_it(desk, monkeypatch, amiss, side):
    forces = PAPER.forces
    limit = forces.lower_max if amiss > 0.0 else forces.lower_min
    seen = TensionGuard.found

    def spoilt(self, rows, feedback):
        force = rows.tension[:, :3].copy()
        force[:, 1] = limit + amiss
        return seen(self, rows, replace(feedback, force=force))

    monkeypatch.setattr(TensionGuard, "found", spoilt)
    reply = stepped(desk, 0, 1.0)
    assert not reply.ok
    assert reply.lines[0].startswith("stopped on the path")
    assert reply.lines[1].startswith(f"error: the sensor of cable 2 shows {limit + amiss:g} N")
    assert f"{side} {limit:g} N" in reply.lines[1]
    assert 0.0 < desk.done().slider[-1, 0] < 0.9 * MM


def test_a_slider_that_does_not_follow_ends_it(tmp_path):
    desk = Desk(tmp_path, disturbance=Stuck(0, 20))
    reply = stepped(desk, 0, 1.0)
    assert not reply.ok
    assert reply.lines[1].startswith("error: slider 1 is ")
    assert desk.done().slider[-1, 0] < 1.0 * MM
