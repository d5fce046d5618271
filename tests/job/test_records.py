"""What is kept of a print, and what its watchdogs make of a machine that is not where the plan has it."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from stepped import Stepped

from cdhr_host.drives import Loopback
from cdhr_host.job.black_box import read_black_box
from cdhr_host.job.journal import read_journal
from cdhr_host.job.printer import Printer
from cdhr_host.job.program import Program, ProgramFile, proven
from cdhr_host.job.recorder import Names, Recorder, digest_of, digest_of_profile
from cdhr_host.job.surface import Event, JobState
from cdhr_host.pipeline import open_profile
from cdhr_host.plant import Disturbance, undisturbed
from cdhr_host.plant.disturbances import Stuck
from cdhr_host.units import MM

RING = Path(__file__).parents[2] / "gcode" / "paper_ring_double.gcode"
PAPER = open_profile("paper")
PATIENT = PAPER.model_copy(
    update={"drives": PAPER.drives.model_copy(update={"following_error_max": 0.5, "torque_max": 100.0})}
)
"""drives that look away"""


@pytest.fixture(scope="module")
def program() -> Program:
    return proven(ProgramFile(RING), PAPER)


class Bench:
    def __init__(self, folder: Path, program: Program, disturbance: Disturbance = undisturbed) -> None:
        self.clock = Stepped()
        self.link = Loopback(PATIENT, self.clock, disturbance=disturbance)
        self.link.open()
        self.folder = folder
        self.printer = Printer(self.link, self.clock, recorder=Recorder(self.link, Names("paper"), folder))
        self.events: list[Event] = []
        self.printer.listen(self.events.append)
        self.printer.adopt(program)
        self.printer.start()

    def run(self, until: Callable[[], bool], most: float = 200.0) -> None:
        while not until():
            assert self.clock.now() < most, self.printer.status()
            self.printer.turn()
            self.clock.wait_until(self.clock.now() + 0.05)

    def rest(self) -> None:
        """What follows a stop."""
        for _ in range(40):
            self.printer.turn()
            self.clock.wait_until(self.clock.now() + 0.05)

    def is_(self, state: JobState) -> Callable[[], bool]:
        return lambda: self.printer.state is state

    @property
    def journal(self) -> Path:
        return max(self.folder.glob("*.journal"))


def test_a_print_leaves_a_finished_journal(tmp_path: Path, program: Program) -> None:
    bench = Bench(tmp_path, program)
    bench.run(bench.is_(JobState.DONE))
    bench.rest()
    journal = read_journal(bench.journal)
    assert journal.finished
    assert journal.damage is None
    assert journal.opened.file == str(RING)
    assert journal.opened.sha256 == digest_of(RING)
    assert journal.opened.profile_sha256 == digest_of_profile(PATIENT)
    assert journal.executed is not None
    assert journal.executed.extruded_mm3 == pytest.approx(program.proof.extruded / MM**3, rel=1e-3)
    assert journal.executed.plan_tick * PAPER.drives.period == pytest.approx(program.proof.duration, abs=0.1)
    assert not list(tmp_path.glob("*.npz"))


def test_executed_is_never_beyond_what_was_said_to_be_fed(tmp_path: Path, program: Program) -> None:
    bench = Bench(tmp_path, program)
    before = None
    for _ in range(200):
        bench.run(lambda: True)
        bench.printer.turn()
        bench.clock.wait_until(bench.clock.now() + 0.05)
        now = read_journal(bench.journal)
        if before is not None and before.fed is not None and now.executed is not None:
            assert now.executed.plan_tick <= before.fed.plan_tick
        before = now
    assert before is not None
    assert before.executed is not None


def test_a_stuck_slider_stops_the_print_and_leaves_a_black_box(tmp_path: Path, program: Program) -> None:
    bench = Bench(tmp_path, program, Stuck(2, 3000))
    bench.run(bench.is_(JobState.FAULT))
    bench.rest()
    problems = [event.problem for event in bench.events if event.problem is not None]
    assert "following-error" in {problem.kind for problem in problems}
    (path,) = tmp_path.glob("*.npz")
    columns, meta = read_black_box(path)
    assert meta["why"]["kind"] == "following-error"
    assert np.abs(columns["slider3_error_mm"]).max() > 0.3
    assert columns["pressure_kpa"][-1] == 0.0
    assert meta["lines"][-1]["text"] == RING.read_text().splitlines()[meta["lines"][-1]["line"] - 1]
    assert any(each["kind"] == "state" and each["text"] == "printing" for each in meta["events"])
    assert read_journal(bench.journal).state == "fault"
    bench.printer.acknowledge()
    bench.rest()
    assert bench.printer.state is JobState.IDLE


def test_a_disk_that_runs_full_holds_the_print(
    tmp_path: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    free = [10**9]
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=free[0]))
    bench = Bench(tmp_path, program)
    bench.run(lambda: bench.clock.now() > 8.0)
    free[0] = 10**6
    bench.run(bench.is_(JobState.HELD))
    assert "1 MB are free" in bench.printer.status().message
    free[0] = 10**9
    bench.printer.resume()
    bench.run(bench.is_(JobState.DONE))


def test_an_emergency_stop_leaves_a_black_box(tmp_path: Path, program: Program) -> None:
    bench = Bench(tmp_path, program)
    bench.run(lambda: bench.clock.now() > 8.0)
    bench.printer.emergency_stop("the operator")
    bench.rest()
    (path,) = tmp_path.glob("*.npz")
    columns, meta = read_black_box(path)
    assert "the operator" in meta["why"]["message"]
    assert columns["pressure_kpa"][-1] == 0.0
    steps = np.abs(np.diff(columns["slider1_mm"][-2:]))
    assert steps.max() < 1e-3


def test_an_aborted_print_leaves_its_last_minute(tmp_path: Path, program: Program) -> None:
    bench = Bench(tmp_path, program)
    bench.run(lambda: bench.clock.now() > 3.0)
    bench.printer.abort("enough")
    bench.run(bench.is_(JobState.STOPPED))
    columns, meta = read_black_box(next(tmp_path.glob("*.npz")))
    assert meta["why"]["kind"] == "abort"
    assert len(columns["t_s"]) > 500
    assert meta["lines"][-1] == {"line": 13, "text": "G3 X0 Y75 I-75 J0 E1314.60791 F1200"}


def test_a_print_that_its_host_leaves_has_its_last_minute(tmp_path: Path, program: Program) -> None:
    bench = Bench(tmp_path, program)
    bench.run(lambda: bench.clock.now() > 3.0)
    bench.printer.close()
    _, meta = read_black_box(next(tmp_path.glob("*.npz")))
    assert meta["why"]["kind"] == "interrupted"


def test_typed_moves_are_watched_too(tmp_path: Path) -> None:
    clock = Stepped()
    link = Loopback(PATIENT, clock, disturbance=Stuck(2, 100))
    link.open()
    printer = Printer(link, clock, recorder=Recorder(link, Names("paper"), tmp_path))
    answer = printer.run("G1 X40 F1800")
    while not answer.done() and printer.state is not JobState.FAULT:
        printer.turn()
        clock.wait_until(clock.now() + 0.05)
    assert printer.state is JobState.FAULT
    assert printer.fault is not None
    assert printer.fault.problems[0].kind == "following-error"
    printer.close()
    assert next(tmp_path.glob("*.npz"))
