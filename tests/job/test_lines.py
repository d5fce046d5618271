"""A client's lines printed as they come, on the simulated drives."""

from collections.abc import Callable
from concurrent.futures import Executor, Future

import numpy as np
import pytest
from stepped import Stepped

from cdhr_host.drives import Loopback
from cdhr_host.errors import JobError, MotionError, Problem
from cdhr_host.job.printer import Printer
from cdhr_host.job.surface import Event, JobState
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.arriving import Arriving
from cdhr_host.values import Feedback, Setpoints

PROFILE = open_profile("paper")


class Now(Executor):
    def submit(self, fn: Callable, /, *args: object, **kwargs: object) -> Future:
        future: Future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class Bench:
    def __init__(self) -> None:
        self.clock = Stepped()
        self.link = Loopback(PROFILE, self.clock)
        self.link.open()
        self.printer = Printer(self.link, self.clock, executor=Now())
        self.events: list[Event] = []
        self.rows: list[Setpoints] = []
        self.printer.listen(self.events.append)
        self.printer.observe(self._executed)
        self.feed = self.printer.open_stream("a test")

    def _executed(self, rows: Setpoints, _: Feedback) -> None:
        self.rows.append(rows)

    @property
    def state(self) -> JobState:
        return self.printer.state

    def turns(self, count: int = 1, seconds: float = 0.02) -> None:
        for _ in range(count):
            self.printer.turn()
            self.clock.wait_until(self.clock.now() + seconds)

    def until(self, reached: Callable[[], bool], most: int = 5000) -> None:
        for _ in range(most):
            if reached():
                return
            self.turns()
        raise AssertionError(f"never reached; {self.state}, {[event.text for event in self.events][-5:]}")

    def send(self, *lines: str) -> None:
        for line in lines:
            self.until(lambda text=line: self.feed.offer(text))

    def nozzle(self) -> np.ndarray:
        return np.concatenate([rows.nozzle_G for rows in self.rows])

    def problems(self) -> list[str]:
        return [event.problem.message for event in self.events if event.problem is not None]


def ring(count: int = 60) -> list[str]:
    turns = np.linspace(0.1, 6.2, count)
    return ["G1 X20 F1200", *(f"G1 X{20 * np.cos(a):.3f} Y{20 * np.sin(a):.3f} E{40 * a:.3f}" for a in turns)]


def test_lines_that_keep_coming_print_without_a_stop_between_them() -> None:
    bench = Bench()
    bench.send(*ring())
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    speed = np.linalg.norm(np.diff(bench.nozzle(), axis=0), axis=1) / PROFILE.drives.period
    moving = np.flatnonzero(speed > 1e-4)
    inside = speed[moving[0] + 400 : moving[-1] - 400]
    assert inside.min() > 0.01
    assert bench.feed.pending == 0
    assert bench.problems() == []


def test_a_long_even_bead_has_no_stop_in_it() -> None:
    bench = Bench()
    turns = np.arange(0.05, 18.0, 0.05)
    bench.send(
        "G1 X40 F1200", *(f"G1 X{40 * np.cos(a):.3f} Y{40 * np.sin(a):.3f} E{40 * a:.3f}" for a in turns)
    )
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    speed = np.linalg.norm(np.diff(bench.nozzle(), axis=0), axis=1) / PROFILE.drives.period
    moving = np.flatnonzero(speed > 1e-4)
    assert speed[moving[0] + 600 : moving[-1] - 400].min() > 0.01


def test_a_pause_before_which_all_was_sent_is_resumed_and_held_again() -> None:
    bench = Bench()
    bench.send("G1 X10 F1800", "M0 more clay")
    bench.until(lambda: bench.state is JobState.HELD)
    bench.printer.resume()
    bench.printer.hold()
    for _ in range(2):
        bench.until(lambda: bench.state is JobState.HELD)
        bench.printer.resume()
        bench.until(lambda: bench.state is JobState.PRINTING)
        bench.turns(20)
        bench.printer.hold()
    bench.until(lambda: bench.state is JobState.HELD)
    bench.printer.resume()
    bench.printer.hold()
    bench.until(lambda: bench.state is JobState.HELD)
    bench.printer.resume()
    bench.send("G1 X20")
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    assert bench.nozzle()[-1] == pytest.approx([0.02, 0.0, 0.0], abs=1e-6)


@pytest.mark.parametrize("pauses", [True, False])
def test_a_held_stream_goes_on_where_it_stood_after_a_jog(pauses: bool) -> None:
    bench = Bench()
    bench.send("G1 X10 F1800", *(["M0 more clay"] if pauses else []), "G1 X20")
    if not pauses:
        bench.until(lambda: bool(bench.rows) and bench.nozzle()[-1, 0] > 0.003)
        bench.printer.hold()
    bench.until(lambda: bench.state is JobState.HELD)
    stood = np.array([0.01, 0.0, 0.0]) if pauses else bench.nozzle()[-1]
    jog = bench.printer.run("G91\nG1 Z15 F1800\nG1 Y5")
    bench.until(jog.done)
    assert jog.result().ok
    before = sum(map(len, bench.rows))
    bench.printer.resume()
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    after = bench.nozzle()[before:]
    assert after[-1] == pytest.approx([0.02, 0.0, 0.0], abs=1e-6)
    assert np.abs(np.diff(after, axis=0)).max() < 0.1 * PROFILE.drives.period + 1e-9
    down = after[np.argmax(after[:, 2] < 1e-6)]
    assert down == pytest.approx(stood, abs=1e-5)


@pytest.mark.parametrize("moving", [True, False])
def test_a_line_found_impossible_late_is_named_with_what_to_do(
    monkeypatch: pytest.MonkeyPatch, moving: bool
) -> None:
    bench = Bench()
    bench.send("G1 X10 F600")
    bench.until(lambda: bool(bench.rows) or not moving)
    problem = Problem("force", "cable 3 would carry 0.3 N, less than 0.5 N", 2, value=0.3, limit=0.5)
    told = [problem]

    def rows(first: int, last: int) -> Setpoints:
        if told and first == bench.feed._seen:
            raise MotionError([told.pop()])
        return Arriving.rows(bench.feed.course, first, last)

    monkeypatch.setattr(bench.feed.course, "rows", rows)
    bench.send("G1 X20")
    bench.until(lambda: bench.state is JobState.HELD)
    assert bench.printer.status().message.startswith("line 2 cannot be moved: cable 3 would carry 0.3 N")
    (event,) = [event for event in bench.events if event.problem is not None]
    assert event.problem.line == 2
    assert (event.problem.value, event.problem.limit) == (0.3, 0.5)
    assert "cancel it, then send that line slower" in str(event.problem.hint)
    with pytest.raises(JobError, match="cannot be moved"):
        bench.printer.resume()
    bench.printer.abort()
    bench.until(lambda: bench.state is JobState.STOPPED)


def test_lines_of_a_second_stream_are_pending_until_they_are_executed() -> None:
    bench = Bench()
    bench.send(*(f"G1 X{k} F3000" for k in range(1, 30)))
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    bench.feed = bench.printer.open_stream("a test")
    bench.send("G1 X0 F600")
    bench.until(lambda: not bench.feed.pending)
    assert bench.nozzle()[-1] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)


def test_a_slow_bead_has_no_stop_in_it_and_ends_soon_after_its_client_has() -> None:
    bench = Bench()
    turns = np.arange(1, 110) / 40.0
    bench.send(
        "G1 X40 F6000",
        *(f"G1 X{40 * np.cos(a):.3f} Y{40 * np.sin(a):.3f} E{40 * a:.3f} F300" for a in turns),
    )
    silent = bench.clock.now()
    assert silent > 15.0
    bench.until(lambda: not bench.feed.pending)
    assert bench.clock.now() - silent < 6.0
    speed = np.linalg.norm(np.diff(bench.nozzle(), axis=0), axis=1) / PROFILE.drives.period
    moving = np.flatnonzero(speed > 1e-4)
    assert speed[moving[0] + 600 : moving[-1] - 400].min() > 0.004


def test_the_way_is_that_of_the_whole_file() -> None:
    bench = Bench()
    bench.send(*ring())
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    text = "\n".join(ring()).encode() + b"\n"
    whole = np.concatenate([block.nozzle_G for block in Staircase(PROFILE).setpoints([text], ends=False)])
    found = bench.nozzle()
    gaps = [np.linalg.norm(whole - place, axis=1).min() for place in found[::25]]
    assert max(gaps) < PROFILE.path.tolerance
    assert found[-1] == pytest.approx(whole[-1], abs=1e-6)


def test_when_lines_run_out_it_stands_and_goes_on_with_the_next() -> None:
    bench = Bench()
    bench.send("G1 X30 F1800")
    bench.until(lambda: bench.feed.pending == 0)
    assert bench.state is JobState.PRINTING
    assert bench.nozzle()[-1] == pytest.approx([0.03, 0.0, 0.0], abs=1e-6)
    bench.turns(50)
    bench.send("G91", "G1 Y5")
    bench.until(lambda: bench.feed.pending == 0)
    assert bench.nozzle()[-1] == pytest.approx([0.03, 0.005, 0.0], abs=1e-6)
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)


def test_a_client_gets_room_for_a_few_seconds_of_motion_only() -> None:
    bench = Bench()
    taken = 0
    for turn in range(400):
        taken += bench.feed.offer(f"G1 X{40 if turn % 2 else -40} F1800")
        bench.turns(seconds=0.0)
    assert taken < 20
    bench.until(lambda: bench.feed.offer("G1 X0"))


def test_a_refused_line_stands_before_it_moves_and_can_be_left_out() -> None:
    bench = Bench()
    bench.send("G1 X10 F1800", "G1 X9000", "G1 X20")
    bench.until(lambda: bench.state is JobState.HELD)
    assert bench.nozzle()[-1] == pytest.approx([0.01, 0.0, 0.0], abs=1e-6)
    assert "outside the bed" in bench.problems()[0] or "bed" in bench.problems()[0]
    assert next(event.problem.line for event in bench.events if event.problem) == 2
    bench.printer.resume()
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    assert bench.nozzle()[-1] == pytest.approx([0.02, 0.0, 0.0], abs=1e-6)


def test_a_typed_line_that_is_refused_holds_nothing() -> None:
    bench = Bench()
    assert bench.feed.offer("G1 X9000 F600", typed=True)
    bench.turns(40)
    assert bench.state is JobState.PRINTING
    assert len(bench.problems()) == 1
    bench.send("G1 X5 F600")
    bench.until(lambda: bench.feed.pending == 0)
    assert bench.nozzle()[-1] == pytest.approx([0.005, 0.0, 0.0], abs=1e-6)


def test_hold_and_resume_stay_on_the_path() -> None:
    bench = Bench()
    lines = iter(ring(200))
    for _ in range(120):
        bench.send(next(lines))
    bench.turns(30)
    bench.printer.hold("a test")
    bench.until(lambda: bench.state is JobState.HELD)
    resting = bench.nozzle()[-1]
    bench.turns(20)
    assert bench.nozzle()[-1] == pytest.approx(resting, abs=1e-9)
    bench.printer.resume()
    bench.send(*lines)
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    radius = np.linalg.norm(bench.nozzle()[600:-400, :2], axis=1)
    assert np.abs(radius - 0.02).max() < PROFILE.path.tolerance


def test_abort_lifts_and_ends_the_stream() -> None:
    bench = Bench()
    bench.send(*ring(30))
    bench.turns(40)
    bench.printer.abort("a test")
    bench.until(lambda: bench.state is JobState.STOPPED)
    assert bench.nozzle()[-1][2] > 0.004
    again = bench.printer.open_stream("another")
    assert again.offer("G91")


def test_a_pause_of_the_program_holds() -> None:
    bench = Bench()
    bench.send("G1 X10 F1800", "M0 more clay", "G1 X20")
    bench.until(lambda: bench.state is JobState.HELD)
    assert bench.nozzle()[-1] == pytest.approx([0.01, 0.0, 0.0], abs=1e-6)
    bench.printer.resume()
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)
    assert bench.nozzle()[-1] == pytest.approx([0.02, 0.0, 0.0], abs=1e-6)


def test_a_hold_before_anything_moves_is_held_and_goes_on() -> None:
    bench = Bench()
    bench.printer.hold("at once")
    bench.until(lambda: bench.state is JobState.HELD)
    bench.printer.resume()
    bench.send("G1 X10 F1800")
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)


def test_a_stream_without_motion_ends() -> None:
    bench = Bench()
    bench.send("G90", "M82")
    bench.feed.finish()
    bench.until(lambda: bench.state is JobState.DONE)


def test_one_stream_at_a_time() -> None:
    bench = Bench()
    with pytest.raises(JobError):
        bench.printer.open_stream("another")
