"""A machine that nobody has referenced: motion is refused, and G28 finds the reference pose."""

from collections.abc import Callable

import numpy as np
import pytest
from stepped import Stepped

from cdhr_host.drives import Loopback
from cdhr_host.drives.link import Told, untold
from cdhr_host.errors import JobError
from cdhr_host.job.printer import Printer
from cdhr_host.job.surface import JobState, Reply
from cdhr_host.pipeline import open_profile
from cdhr_host.profile import Profile
from cdhr_host.units import MM


def with_reference(kind: str) -> Profile:
    profile = open_profile("paper")
    return profile.model_copy(update={"canopen": profile.canopen.model_copy(update={"reference": kind})})


class Lost(Loopback):
    """Drives that know where they are once they were homed; ``asked`` counts that and interruptions."""

    known = False
    homed = interrupted = 0
    meanwhile: Callable[[], object] = staticmethod(lambda: None)

    @property
    def referenced(self) -> bool:
        return self.known

    def home(self, told: Told = untold) -> None:
        self.homed += 1
        for drive in range(1, 7):
            told(drive)
        self.meanwhile()
        self.known = not self.interrupted

    def interrupt(self) -> None:
        self.interrupted += 1


class Bench:
    def __init__(self, kind: str) -> None:
        self.clock = Stepped()
        self.link = Lost(with_reference(kind), self.clock)
        self.link.open()
        self.printer = Printer(self.link, self.clock)

    def run(self, text: str) -> Reply:
        answer = self.printer.run(text)
        for _ in range(2000):
            self.printer.turn()
            if answer.done():
                return answer.result()
            self.clock.wait_until(self.clock.now() + 0.02)
        raise AssertionError(self.printer.status())


@pytest.mark.parametrize(
    ("kind", "step"), [("homing", "G28"), ("stored", "cdhr drives reference"), ("drive", "the encoder")]
)
def test_nothing_moves_before_and_the_next_step_is_named(kind: str, step: str) -> None:
    bench = Bench(kind)
    assert not bench.printer.status().referenced
    reply = bench.run("G1 X5 F600")
    assert not reply.ok
    assert "not referenced" in reply.lines[0]
    assert step in reply.lines[1]
    for ask in (
        lambda: bench.printer.jog(np.array([0.01, 0.0, 0.0])),
        lambda: bench.printer.open_stream("a client"),
    ):
        with pytest.raises(JobError, match="not referenced"):
            ask()
    assert bench.printer.state is JobState.IDLE
    assert not bench.link.homed


def test_g28_homes_the_drives_and_then_the_machine_moves() -> None:
    bench = Bench("homing")
    told: list[str] = []
    bench.printer.listen(lambda event: told.append(event.text))
    bench.link.meanwhile = lambda: told.append("found")
    assert bench.run(" n1 g28 ; all of it").ok
    assert told[:7] == [*(f"homing drive {drive} of 6" for drive in range(1, 7)), "found"]
    assert bench.link.homed == 1
    assert bench.printer.status().referenced
    assert bench.run("G1 X5 F600").ok
    np.testing.assert_allclose(bench.printer.status().nozzle_G, [5 * MM, 0.0, 0.0], atol=1e-9)
    assert bench.run("G28").ok
    assert bench.link.homed == 1
    assert bench.printer.status().homed


@pytest.mark.parametrize("kind", ["stored", "drive"])
def test_g28_homes_nothing_where_the_profile_has_no_homing(kind: str) -> None:
    bench = Bench(kind)
    bench.run("G28")
    assert not bench.link.homed


def test_an_emergency_stop_reaches_drives_that_are_homing() -> None:
    """The printer's own thread waits for them meanwhile."""
    bench = Bench("homing")
    bench.link.meanwhile = lambda: bench.printer.emergency_stop("pressed")
    reply = bench.run("G28")
    assert bench.link.interrupted == 1
    assert bench.printer.state is JobState.FAULT
    assert not bench.printer.status().referenced
    assert not reply.ok
