"""A print that was cut off goes on: everything once, the seam within what is stated, or a reason why not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree
from stepped import Stepped

from cdhr_host.drives import LinkState, Loopback
from cdhr_host.drives.rows import joined
from cdhr_host.errors import JobError
from cdhr_host.job.journal import Journal, read_journal
from cdhr_host.job.printer import Printer
from cdhr_host.job.program import Program, ProgramFile, proven
from cdhr_host.job.recorder import Names, Recorder
from cdhr_host.job.recovery import NEAR, Recovery, Resuming, _rested
from cdhr_host.job.surface import JobState
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.rig import Rig
from cdhr_host.units import MM
from cdhr_host.values import Setpoints

PROFILE = open_profile("paper")
RING = Path(__file__).parents[2] / "gcode" / "paper_ring_double.gcode"
RIG = Rig.from_profile(PROFILE)
OVERLAP = 2.0 * MM


@pytest.fixture(scope="module")
def program() -> Program:
    return proven(ProgramFile(RING), PROFILE)


@pytest.fixture(scope="module")
def whole() -> Setpoints:
    with RING.open("rb") as text:
        parts = list(Staircase(PROFILE).setpoints(iter(lambda: text.read(1 << 16), b"")))
    return Setpoints(
        *(np.concatenate([getattr(p, n) for p in parts]) for n in Setpoints.__dataclass_fields__)
    )


class Far(Loopback):
    """A machine that knows what it laid, whether anybody listened or not."""

    def __init__(self, clock: Stepped) -> None:
        super().__init__(PROFILE, clock)
        self.laid: list[Setpoints] = []

    def _play(self, rows: Setpoints) -> None:
        if (rows.flow > 0).any():
            self.laid.append(rows[rows.flow > 0])
        super()._play(rows)


class Machine:
    """One simulated machine, and the printers that come and go before it."""

    def __init__(self, folder: Path) -> None:
        self.clock = Stepped()
        self.link = Far(self.clock)
        self.folder, self.laid = folder, self.link.laid

    def printer(self) -> Printer:
        """A host process that has just begun."""
        self.link.open()
        return Printer(self.link, self.clock, recorder=Recorder(self.link, Names("paper"), self.folder))

    def run(self, printer: Printer, until: float = 1e9) -> JobState:
        """Go on until a time of the clock, or the end."""
        while self.clock.now() < until and printer.state not in (JobState.DONE, JobState.FAULT):
            printer.turn()
            self.clock.wait_until(self.clock.now() + 0.05)
        return printer.state

    def killed(self) -> None:
        """The host is gone: the far side plays what it has, comes to rest by itself, and waits."""
        self.link.stop()
        for _ in range(200):
            self.clock.wait_until(self.clock.now() + 0.05)
            if self.link.state is not LinkState.STOPPING:
                break
            self.link.feedback()
        self.link.close()

    @property
    def journal(self) -> Journal:
        return read_journal(max(self.folder.glob("*.journal")))


def printing(tmp_path: Path, program: Program, at: float, *, feed: float = 1.0) -> tuple[Machine, Printer]:
    """A print that has come to a time of the clock."""
    machine = Machine(tmp_path)
    printer = machine.printer()
    printer.override(feed=feed)
    printer.adopt(program)
    printer.start()
    machine.run(printer, at)
    return machine, printer


def interrupted(tmp_path: Path, program: Program, at: float, *, hold: bool = False) -> Machine:
    machine, printer = printing(tmp_path, program, at)
    if hold:
        printer.hold()
        while printer.state is not JobState.HELD:
            machine.run(printer, machine.clock.now() + 0.1)
        printer.close()
        machine.link.close()
    else:
        machine.killed()
    return machine


def resumed(machine: Machine, program: Program) -> Recovery:
    printer = machine.printer()
    journal = machine.journal
    recovery = Resuming(program, RIG).found(
        journal, printer.status().nozzle_G, machine.link.stop_rows, OVERLAP
    )
    printer.adopt(program)
    printer.recover(recovery, goes_on=str(journal.path))
    printer.turn()
    assert printer.state is JobState.HELD
    printer.resume()
    assert machine.run(printer) is JobState.DONE, printer.status()
    printer.close()
    machine.link.close()
    return recovery


def checked(machine: Machine, whole: Setpoints, recovery: Recovery) -> None:
    """All that the program lays is laid, and no more than the stated overlap twice."""
    laid = np.concatenate([rows.nozzle_G for rows in machine.laid])
    wanted = whole.nozzle_G[whole.flow > 0]
    away, _ = KDTree(laid).query(wanted)
    assert away.max() < 0.4 * MM
    period = PROFILE.drives.period
    volume = sum(float(rows.flow.sum()) for rows in machine.laid) * period
    asked = float(whole.flow.sum()) * period
    per_metre = asked / program_length(whole)
    assert volume - asked < (recovery.overlap + 1.0 * MM) * per_metre
    assert volume - asked > -0.1 * MM * per_metre


def program_length(rows: Setpoints) -> float:
    steps = np.linalg.norm(np.diff(rows.nozzle_G, axis=0), axis=1)
    return float(steps[rows.flow[1:] > 0].sum())


@pytest.mark.parametrize("at", [3.0, 11.3, 20.02, 27.7, 40.0])
def test_a_killed_print_goes_on(tmp_path: Path, program: Program, whole: Setpoints, at: float) -> None:
    machine = interrupted(tmp_path, program, at)
    recovery = resumed(machine, program)
    assert recovery.sure
    assert recovery.overlap < 6.0 * MM
    checked(machine, whole, recovery)
    assert machine.journal.finished


@pytest.mark.parametrize(("feed", "at"), [(0.7, 6.0), (1.3, 16.9), (2.0, 12.0), (2.0, 8.55)])
def test_a_print_killed_at_another_feed_goes_on_as_exactly(
    tmp_path: Path, program: Program, whole: Setpoints, feed: float, at: float
) -> None:
    """A faster plan stops in another way than the plan at 100 % played as fast would."""
    machine, _ = printing(tmp_path, program, at, feed=feed)
    machine.killed()
    recovery = resumed(machine, program)
    assert recovery.sure
    assert recovery.overlap < OVERLAP + 0.3 * MM
    checked(machine, whole, recovery)


@pytest.mark.parametrize(
    ("feed", "at", "later"), [(0.3, 15.0, 0.3), (1.0, 15.0, 0.3), (2.0, 15.0, 0.3), (2.0, 6.2907, 0.0)]
)
def test_a_print_killed_while_it_gains_speed_skips_nothing(
    tmp_path: Path, program: Program, whole: Setpoints, feed: float, at: float, later: float
) -> None:
    """The journal's last pace is not the one that the drives had when they stopped."""
    machine, printer = printing(tmp_path, program, at, feed=feed)
    printer.hold()
    while printer.state is not JobState.HELD:
        machine.run(printer, machine.clock.now() + 0.1)
    printer.resume()
    machine.run(printer, machine.clock.now() + 0.06)
    machine.clock.wait_until(machine.clock.now() + later)
    machine.killed()
    recovery = resumed(machine, program)
    assert not recovery.sure
    checked(machine, whole, recovery)


def test_a_stop_begun_on_a_slow_move_before_a_fast_one_leaves_no_gap(
    tmp_path: Path, program: Program, whole: Setpoints
) -> None:
    """It ends where another would that began 20 mm later: what lies ahead makes it longer."""
    machine, printer = printing(tmp_path, program, 14.3127, feed=2.0)
    printer.hold()
    while printer.state is not JobState.HELD:
        machine.run(printer, machine.clock.now() + 0.1)
    printer.resume()
    machine.run(printer, machine.clock.now() + 1.0)
    machine.clock.wait_until(machine.clock.now() + 0.37)
    machine.killed()
    recovery = resumed(machine, program)
    assert not recovery.sure
    checked(machine, whole, recovery)


def test_a_print_killed_soon_after_a_pause_goes_on(tmp_path: Path) -> None:
    file = tmp_path / "paused.gcode"
    file.write_text("G1 X40 F1200\nG1 X40 Y20 E60\nM0\nG1 X40 Y-30 E160\nG1 X0 Y0\n")
    program, machine = proven(ProgramFile(file), PROFILE), Machine(tmp_path)
    printer = machine.printer()
    printer.adopt(program)
    printer.start()
    while printer.state is not JobState.HELD:
        machine.run(printer, machine.clock.now() + 0.1)
    printer.resume()
    machine.run(printer, machine.clock.now() + 1.5)
    machine.killed()
    recovery = resumed(machine, program)
    assert recovery.line == 4
    with file.open("rb") as text:
        rows = list(Staircase(PROFILE).setpoints(iter(lambda: text.read(1 << 16), b"")))
    checked(machine, joined(rows), recovery)


def test_a_held_print_goes_on(tmp_path: Path, program: Program, whole: Setpoints) -> None:
    machine = interrupted(tmp_path, program, 15.0, hold=True)
    recovery = resumed(machine, program)
    assert recovery.sure
    assert recovery.overlap <= OVERLAP + 0.2 * MM
    checked(machine, whole, recovery)


def test_after_a_power_cut_the_disk_may_lack_a_second_and_the_drives_stopped_otherwise(
    tmp_path: Path, program: Program
) -> None:
    machine = interrupted(tmp_path, program, 20.0)
    machine.link.open()
    way, measured = Resuming(program, RIG), RIG.standing(machine.link.slider)[0]
    path, lines = machine.journal.path, machine.journal.path.read_bytes().splitlines(keepends=True)
    true = way.found(machine.journal, measured, machine.link.stop_rows, OVERLAP)
    lost = [k for k, line in enumerate(lines) if b'["X"' in line][-15]
    path.write_bytes(b"".join(lines[:lost]))
    kept = read_journal(path)
    assert kept.executed is not None
    assert true.bead - kept.executed.plan_tick > 100
    again = replace(kept, opened=replace(kept.opened, boot="another start"))
    found = way.found(again, measured, machine.link.stop_rows, OVERLAP)
    assert found.bead == pytest.approx(true.bead, abs=2.0)
    assert not found.sure
    assert found.overlap >= way.length(found.tick, true.rested) - 1e-9
    assert way.moved(again, OVERLAP).overlap >= way.length(way.moved(again, OVERLAP).tick, true.rested)


def test_a_path_that_comes_by_twice_goes_on_where_it_came_by_first() -> None:
    away = np.array([9.0, 0.2, 0.1, 0.25, 5.0, 5.0, 0.28, 0.05, 0.2, 7.0]) * MM
    assert _rested(away, NEAR) == (2, 7)


def test_a_machine_that_was_moved_is_refused(tmp_path: Path, program: Program) -> None:
    machine = interrupted(tmp_path, program, 15.0)
    machine.link.open()
    measured = RIG.standing(machine.link.slider)[0] + np.array([0.0, 0.0, 5.0]) * MM
    with pytest.raises(JobError, match=r"stands 5\.0"):
        Resuming(program, RIG).found(machine.journal, measured, machine.link.stop_rows, OVERLAP)


def test_after_a_fault_the_nozzle_may_stand_off_its_path_by_the_way_of_a_stop(
    tmp_path: Path, program: Program, whole: Setpoints
) -> None:
    """The drive that tripped held its cable while the others went on to rest."""
    machine = interrupted(tmp_path, program, 15.0)
    machine.link.open()
    way, stops = Resuming(program, RIG), machine.link.stop_rows
    journal = replace(machine.journal, state="fault")
    assert journal.executed is not None
    begin, slider = journal.executed.plan_tick, machine.link.slider.copy()
    slider[2] = whole.slider[int(begin), 2]
    measured = RIG.standing(slider)[0]
    found = way.found(journal, measured, stops, OVERLAP)
    assert NEAR < found.away < 3.0 * MM
    assert not found.sure
    assert found.tick < begin
    assert found.overlap > OVERLAP + found.away
    with pytest.raises(JobError, match=r"limit 0\.3 mm"):
        way.found(machine.journal, measured, stops, OVERLAP)
    with pytest.raises(JobError, match=r"stands 10"):
        way.found(journal, measured + np.array([0.0, 0.0, 9.0]) * MM, stops, OVERLAP)


def test_another_plan_is_refused(tmp_path: Path, program: Program) -> None:
    machine = interrupted(tmp_path, program, 15.0)
    machine.link.open()
    slower = PROFILE.model_copy(
        update={"limits": PROFILE.limits.model_copy(update={"acceleration_max": 0.2})}
    )
    other = Resuming(proven(ProgramFile(RING), slower), Rig.from_profile(slower))
    with pytest.raises(JobError, match="from the plan's"):
        other.found(machine.journal, RIG.standing(machine.link.slider)[0], machine.link.stop_rows, OVERLAP)


def test_a_print_goes_on_at_a_line(tmp_path: Path, program: Program, whole: Setpoints) -> None:
    machine = interrupted(tmp_path, program, 15.0)
    printer = machine.printer()
    recovery = Resuming(program, RIG).at_line(20)
    first = int(np.argmax(whole.line >= 20))
    assert recovery.line == 20
    assert recovery.tick == pytest.approx(float(whole.tick[first]))
    machine.laid.clear()
    printer.adopt(program)
    printer.recover(recovery)
    printer.turn()
    printer.resume()
    assert machine.run(printer) is JobState.DONE
    assert min(int(rows.line.min()) for rows in machine.laid) == 20
    printer.close()


def test_a_journal_cut_anywhere_resumes_rightly_or_says_why_not(tmp_path: Path, program: Program) -> None:
    """Never a millimetre skipped, never one laid twice beyond the overlap that is stated."""
    machine = interrupted(tmp_path, program, 3.4)
    machine.link.open()
    way, slider = Resuming(program, RIG), machine.link.slider
    measured = RIG.standing(slider)[0]
    path = machine.journal.path
    whole = path.read_bytes()
    true = way.found(read_journal(path), measured, machine.link.stop_rows, OVERLAP)
    ends = [at + 1 for at, byte in enumerate(whole) if byte == 0x0A]
    random = np.random.default_rng(5).integers(0, len(whole), 1000).tolist()
    known: dict[tuple[object, ...], tuple[Recovery, float] | None] = {}
    for size in {*ends, *random}:
        path.write_bytes(whole[:size])
        try:
            cut = read_journal(path)
        except JobError:
            assert size < ends[0]
            continue
        what = cut.executed, cut.fed, cut.state
        if what not in known:
            found = _tried(way, cut, measured, machine)
            known[what] = found and (found, way.length(found.tick, true.bead))
        if (told := known[what]) is not None:
            found, laid_twice = told
            assert found.tick <= true.bead
            assert laid_twice <= found.overlap + 0.05 * MM
    assert sum(found is not None for found in known.values()) > 10


def _tried(way: Resuming, journal: Journal, measured: np.ndarray, machine: Machine) -> Recovery | None:
    try:
        return way.found(journal, measured, machine.link.stop_rows, OVERLAP)
    except JobError as error:
        if not error.problems[0].hint:
            raise
        return None
