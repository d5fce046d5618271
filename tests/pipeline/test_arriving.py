"""A plan whose commands come while it is played, against the plan of the whole text."""

import numpy as np
import pytest

from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.arriving import Arriving
from cdhr_host.pipeline.course import Course
from cdhr_host.pipeline.tape import Tape

PROFILE = open_profile("paper")
RING = "G1 X20 F1200\n" + "".join(
    f"G1 X{20 * np.cos(a):.4f} Y{20 * np.sin(a):.4f} E{40 * a:.4f}\n" for a in np.linspace(0.05, 6.2, 120)
)


def played(course: Course) -> np.ndarray:
    """Nozzle of every tick up to the first stop."""
    while course.stop() is None:
        course.plan(course.staircase.tick + 50)
    return course.rows(course.first, course.stop().tick).nozzle_G


def whole(text: str) -> np.ndarray:
    machine = Staircase(PROFILE)
    return played(Course(machine.fork(), Tape(machine.commands([text.encode()])), ends=False))


@pytest.mark.parametrize("batch", [1, 7, 200])
def test_lines_that_come_in_time_move_as_the_whole_file(batch: int) -> None:
    machine = Staircase(PROFILE)
    course = Arriving(machine.fork())
    lines = RING.splitlines(keepends=True)
    for first in range(0, len(lines), batch):
        course.add(list(machine.commands(["".join(lines[first : first + batch]).encode()])))
        course.advance()
    found, expected = played(course), whole(RING)
    assert len(found) == pytest.approx(len(expected), abs=len(expected) * 0.02)
    assert found[-1] == pytest.approx(expected[-1], abs=1e-9)
    radius = np.linalg.norm(found[:, :2], axis=1)
    assert radius.max() <= 0.020 + PROFILE.path.tolerance


def test_without_further_lines_it_comes_to_rest_and_goes_on_later() -> None:
    machine = Staircase(PROFILE)
    course = Arriving(machine.fork())
    course.add(list(machine.commands([b"G1 X30 F1800\n"])))
    course.plan(10**6)
    stop = course.stop()
    assert stop is not None
    assert stop.waits
    assert course.rests
    rows = course.rows(course.first, stop.tick)
    assert rows.nozzle_G[-1] == pytest.approx([0.03, 0.0, 0.0])
    assert rows.nozzle_G[-2] == pytest.approx([0.03, 0.0, 0.0], abs=1e-6)
    course.add(list(machine.commands([b"G1 X0\n"])))
    assert not course.rests
    course.passed()
    course.plan(10**6)
    further = course.rows(stop.tick - 1, course.stop().tick)
    assert further.nozzle_G[0] == pytest.approx(rows.nozzle_G[-1], abs=1e-9)
    assert further.nozzle_G[-1] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_what_has_come_is_planned_without_rest_as_far_as_it_settles() -> None:
    machine = Staircase(PROFILE)
    course = Arriving(machine.fork())
    course.add(list(machine.commands([b"G1 X100 F3000\nG1 X100 Y100\nG1 X0\n"])))
    course.advance()
    assert course.stop() is None
    assert 0 < course.staircase.tick * PROFILE.drives.period < 300 / 50


def test_memory_stays_flat_in_the_lines() -> None:
    machine = Staircase(PROFILE)
    course = Arriving(machine.fork())
    at = 0
    for k in range(300):
        course.add(list(machine.commands([f"G1 X{10 + k % 7} Y{k % 5} F3000\n".encode()])))
        course.plan(course.staircase.tick)
        if course.stop() is not None:
            course.rows(at, course.stop().tick)
            at = course.stop().tick
            course.passed()
            course.drop(at)
    assert len(list(course.placed())) < 20
    assert len(course._marks) < 20
    assert len(course._arrived._kept) < 20


def test_a_long_bead_settles_while_it_is_drawn() -> None:
    machine = Staircase(PROFILE)
    course = Arriving(machine.fork())
    for k in range(200):
        a = k * 0.05
        line = f"G1 X{40 * np.cos(a):.4f} Y{40 * np.sin(a):.4f} E{40 * a:.4f} F1200\n"
        course.add(list(machine.commands([line.encode()])))
        course.advance()
    unsettled = (course.ahead - course.staircase.tick) * PROFILE.drives.period
    assert unsettled < 3.0  # s
    assert course.stop() is None
