"""A jog session: lines are proven first, refusals leave no trace, a stopped machine goes on."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from cdhr_host.console import Session, from_lines
from cdhr_host.drives import Loopback, PacedClock
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.units import MM

PAPER = open_profile("paper")


class Stops:
    """Asks for a stop at the given look; looks are counted anew for each move."""

    def __init__(self, at: float) -> None:
        self.at = at

    @contextmanager
    def __call__(self) -> Iterator[Callable[[], bool]]:
        looks = 0

        def asked() -> bool:
            nonlocal looks
            looks += 1
            return looks > self.at

        yield asked


def session(speed: float = math.inf, at: float = math.inf) -> Session:
    clock = PacedClock(speed)
    link = Loopback(PAPER, clock)
    link.open()
    return Session(Staircase(PAPER), link, clock, stops=Stops(at))


def place(text: str) -> tuple[float, ...]:
    nozzle = text.removeprefix("stopped on the path: ").split(" | ")[0]
    return tuple(float(word[1:]) for word in nozzle.split())


def test_it_begins_at_the_reference_pose() -> None:
    assert session().where() == "X0 Y0 Z0, the reference pose"


def test_a_line_moves_and_says_where_the_machine_stands() -> None:
    reply = session().run("G1 X10 Y-5 Z2.5 F6000")
    assert reply.ok
    assert reply.text.startswith("X10.000 Y-5.000 Z2.500 | sliders -")
    assert reply.text.endswith(" N")


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("G1 X280 F6000", 5, "error: cable 4 would carry 13.0"),
        ("G1 Z-1 F600", 5, "below the bed"),
        ("G1O", 4, "G1 has no word O"),
        ("G1 X5", 4, "no speed has been given yet"),
    ],
)
def test_a_refused_line_leaves_the_machine_as_it_was(line: str, code: int, words: str) -> None:
    machine = session()
    for _ in range(3):
        reply = machine.run(line)
        assert (reply.ok, reply.exit_code) == (False, code)
        assert words in reply.text
    assert machine.where() == "X0 Y0 Z0, the reference pose"
    assert place(machine.run("G1 X10 F6000").text) == (10, 0, 0)


def test_a_line_without_motion_is_fine() -> None:
    assert session().run("M117 hello").ok


def test_jogging_adds_up_and_keeps_the_modes() -> None:
    machine = session()
    machine.run("G91\nG1 X5 F6000")
    assert place(machine.jog("Z", 10).text) == (5, 0, 10)
    assert place(machine.jog("X", -0.1).text) == (4.9, 0, 10)
    assert place(machine.run("G1 Y3").text) == (4.9, 3, 10)
    machine.run("G90")
    assert place(machine.jog("Y", 1).text) == (4.9, 4, 10)
    assert place(machine.run("G1 X0").text) == (0, 4, 10)


def test_jogging_is_in_millimetres_in_inch_mode_too() -> None:
    machine = session()
    machine.run("G20\nG1 X1 F100")
    assert place(machine.jog("X", 1).text) == (26.4, 0, 0)
    assert place(machine.run("G1 X1").text) == (25.4, 0, 0)


def test_a_jog_out_of_reach_is_refused() -> None:
    machine = session()
    assert not machine.jog("Z", -0.1).ok
    assert place(machine.jog("Z", 0.1).text) == (0, 0, 0.1)


def test_a_stopped_machine_goes_on_from_where_it_stands() -> None:
    machine = session(speed=200, at=2)
    reply = machine.run("G1 X100 F100")
    assert reply.text.startswith("stopped on the path: X")
    stood = place(reply.text)
    assert 0 < stood[0] < 100
    machine._stops = Stops(math.inf)
    assert place(machine.jog("Y", 1).text) == pytest.approx((stood[0], 1, 0), abs=2e-3)
    assert place(machine.run("G1 X0 Y0 F6000").text) == (0, 0, 0)


def test_lines_from_a_pipe_are_answered_one_by_one() -> None:
    answers: list[str] = []
    code = from_lines(
        session(), ["G1 X10 F6000\n", "\n", "G1 X280\n", "G28\n", "?\n", "q\n", "G1 X5\n"], answers.append
    )
    assert code == 5
    assert answers[0].startswith("ok X10.000")
    assert answers[1].startswith("error: cable 4")
    assert answers[2].startswith("ok X0.000 Y0.000 Z0.000")
    assert "arrows" in answers[3]
    assert len(answers) == 4


def test_position_is_that_of_the_last_executed_row() -> None:
    machine = session()
    machine.run("G1 X10 F6000")
    assert machine._standing is not None
    np.testing.assert_allclose(machine._standing.nozzle_G[-1] / MM, [10, 0, 0], atol=1e-9)
