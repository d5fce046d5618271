"""The printer under its words, on simulated drives with a clock that goes when the test says so."""

from concurrent.futures import Executor, Future

import numpy as np
import pytest
from stepped import Stepped

from cdhr_host.drives import LinkState, PacedClock
from cdhr_host.drives.loopback import Loopback
from cdhr_host.drives.rows import joined
from cdhr_host.errors import JobError
from cdhr_host.job.printer import Printer
from cdhr_host.job.surface import JobState
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.plant.disturbances import Stuck

PAPER = open_profile("paper")
LINE = "G1 X40 F1200\nG1 X40 Y20 E60\nG1 X0 Y0\n"
TURN = 0.02


class AtOnce(Executor):
    def submit(self, task, /, *arguments, **named):
        done = Future()
        try:
            done.set_result(task(*arguments, **named))
        except Exception as error:
            done.set_exception(error)
        return done


class Desk:
    """A printer, and everything that was told and executed."""

    def __init__(self, tmp_path, profile=PAPER, **link):
        self.folder, self.clock = tmp_path, Stepped()
        self.link = Loopback(profile, self.clock, **link)
        self.link.open()
        self.printer = Printer(self.link, self.clock, executor=AtOnce())
        self.events, self.rows = [], []
        self.printer.listen(self.events.append)
        self.printer.observe(lambda rows, _: self.rows.append(rows))

    def go(self, *states, most=200.0):
        """Until a state is reached, or for a time."""
        end = self.clock.now() + most
        while self.printer.state not in states and self.clock.now() < end:
            self.printer.turn()
            self.clock.wait_until(self.clock.now() + TURN)
        assert not states or self.printer.state in states, [event.text for event in self.events][-3:]

    def load(self, text):
        path = self.folder / "part.gcode"
        path.write_text(text)
        self.printer.load(path)
        self.go(JobState.READY, JobState.IDLE, most=1.0)

    def print(self, text, most=0.0):
        self.load(text)
        self.printer.start()
        self.go(most=most)

    def run(self, text):
        answer = self.printer.run(text)
        while not answer.done():
            self.go(most=TURN)
        return answer.result()

    def done(self):
        return joined(self.rows)

    def told(self, kind):
        return [event.text for event in self.events if event.kind == kind]


@pytest.fixture
def desk(tmp_path):
    return Desk(tmp_path)


def dry(text, profile=PAPER):
    return joined([rows for rows in Staircase(profile).setpoints([text.encode()]) if len(rows)])


def test_a_print_is_the_dry_run_and_is_told(desk):
    desk.print(LINE)
    desk.go(JobState.DONE)
    plan = dry(LINE)
    for name in ("tick", "t", "line", "nozzle_G", "slider", "flow", "pressure"):
        assert (getattr(desk.done(), name) == getattr(plan, name)).all()
    progress = desk.printer.status().progress
    assert (progress.fraction, progress.left, progress.file) == (1.0, 0.0, "part.gcode")
    assert progress.extruded == pytest.approx(plan.flow.sum() * 0.004)
    states = [event.status.state for event in desk.events if event.kind == "state"]
    assert states[-1] is JobState.DONE
    assert desk.link.state is LinkState.STOPPED


def test_what_cannot_be_printed_is_told_and_nothing_moves(desk):
    desk.load("G1 X2000 F600\n")
    assert desk.printer.state is JobState.IDLE
    assert desk.told("problem")
    desk.load("G1 X oops\n")
    assert desk.printer.state is JobState.IDLE
    with pytest.raises(JobError, match=r"nothing\.gcode cannot be read"):
        desk.printer.load(desk.folder / "nothing.gcode")
    with pytest.raises(JobError, match="'start' is not possible while the printer is idle"):
        desk.printer.start()
    assert not desk.rows


def test_a_hold_slows_down_within_two_cycles_of_what_may_still_be_revised(desk):
    desk.print(LINE, most=1.5)
    first, before = desk.link.revisable, sum(map(len, desk.rows))
    assert first - before < 200
    desk.printer.hold("look")
    desk.go(JobState.HELD)
    done, plan = desk.done(), dry(LINE)
    slower = next(k for k in range(len(done)) if (done.slider[k] != plan.slider[k]).any())
    assert slower <= first + 2
    assert (done.slider[-1] == done.slider[-2]).all()
    assert done.pressure[-1] == 0.0
    assert desk.printer.status().message == "look"
    away = np.linalg.norm(plan.nozzle_G - done.nozzle_G[-1], axis=1).min()
    assert away < 0.02 * 0.004
    desk.printer.resume()
    desk.go(JobState.PRINTING)
    desk.go(JobState.DONE)
    tail = desk.done().slider[-100:]
    assert (tail == plan.slider[-100:]).all()


def test_holding_twice_is_harmless_and_words_out_of_place_are_refused(desk):
    desk.print(LINE, most=1.0)
    desk.printer.hold()
    desk.printer.hold()
    with pytest.raises(JobError, match="'resume' is not possible while the printer is holding"):
        desk.printer.resume()
    desk.go(JobState.HELD)
    desk.printer.hold()
    assert desk.printer.state is JobState.HELD


@pytest.mark.parametrize(("feed", "ratio"), [(0.5, 2.0), (2.0, 0.62), (1.0, 1.0)])
def test_an_override_changes_the_time_and_not_the_clay(desk, feed, ratio):
    desk.printer.override(feed=feed)
    desk.go(most=TURN)
    desk.print(LINE)
    desk.go(JobState.DONE)
    plan = dry(LINE)
    assert len(desk.done()) == pytest.approx(ratio * len(plan), rel=0.1)
    assert desk.done().flow.sum() == pytest.approx(plan.flow.sum(), rel=2e-3)
    assert desk.printer.status().feed_override == feed


def test_an_override_acts_within_200_ms(desk):
    desk.print("G1 X100 F600\n", most=2.0)
    desk.printer.override(feed=0.5)
    desk.go(most=0.2)
    assert desk.printer.status().velocity < 0.0095
    desk.go(most=0.5)
    assert desk.printer.status().velocity == pytest.approx(0.005, rel=1e-3)
    desk.printer.override(feed=3.0)
    desk.go(most=0.2)
    assert desk.printer.status().velocity > 0.0055
    desk.go(most=1.0)
    assert desk.printer.status().velocity == pytest.approx(0.030, rel=1e-3)


def test_more_flow_is_more_clay_where_the_air_can_push_it(desk):
    desk.printer.override(flow=1.5)
    desk.go(most=TURN)
    desk.print("G1 X40 E60 F600\nG1 X0\n")
    desk.go(JobState.DONE)
    plan = dry("G1 X40 E60 F600\nG1 X0\n")
    assert desk.done().flow.sum() == pytest.approx(1.5 * plan.flow.sum(), rel=0.05)
    assert desk.done().pressure.max() <= PAPER.extruder.pressure_max


@pytest.mark.parametrize("words", [{"feed": 0.0}, {"feed": 3.01}, {"flow": 0.001}, {"flow": float("nan")}])
def test_an_override_out_of_range_is_refused(desk, words):
    with pytest.raises(JobError, match="outside 1 % to 300 %"):
        desk.printer.override(**words)


def test_a_pause_holds_and_goes_on_without_a_lost_tick(desk):
    text = "G1 X10 F1200\nM0 wet the clay\nG1 X0\n"
    desk.print(text)
    desk.go(JobState.HELD)
    assert desk.told("pause") == ["line 2: wet the clay"]
    assert desk.printer.pause.line == 2
    desk.printer.resume()
    desk.go(JobState.DONE)
    assert (desk.done().slider == dry(text).slider).all()


def test_an_abort_rests_on_the_path_vents_and_lifts(desk):
    desk.print(LINE, most=2.5)
    desk.printer.abort("enough")
    desk.go(JobState.STOPPED)
    done = desk.done()
    top, rest = done.nozzle_G[-1], done.nozzle_G[np.argmax(done.nozzle_G[:, 2] > 1e-9) - 1]
    assert top[2] == pytest.approx(PAPER.job.lift)
    assert top[:2] == pytest.approx(rest[:2], abs=1e-12)
    assert not done.pressure[-1]
    assert "enough" in desk.told("state")[-1]


def test_an_abort_that_cannot_lift_says_so(tmp_path):
    low = PAPER.model_copy(update={"bed": PAPER.bed.model_copy(update={"height": 0.001})})
    desk = Desk(tmp_path, low)
    desk.print("G1 X30 F600\n", most=1.0)
    desk.printer.abort()
    desk.go(JobState.STOPPED)
    assert any("no way straight up is free" in text for text in desk.told("message"))
    assert not desk.done().nozzle_G[:, 2].any()


def test_an_emergency_stop_is_a_fault_until_it_is_acknowledged(desk):
    desk.print(LINE, most=2.0)
    desk.printer.emergency_stop("red button")
    assert desk.printer.state is JobState.FAULT
    desk.go(most=2.0)
    assert desk.link.state is LinkState.STOPPED
    with pytest.raises(JobError, match="'load' is not possible"):
        desk.printer.load(desk.folder / "part.gcode")
    desk.printer.acknowledge()
    assert desk.run("G1 Z10 F600").ok
    assert desk.printer.state is JobState.IDLE


def test_a_fault_of_the_drives_ends_the_print_and_is_told(tmp_path):
    desk = Desk(tmp_path, disturbance=Stuck(3, 300))
    desk.print(LINE)
    desk.go(JobState.FAULT)
    assert any("mm away from its setpoint" in text for text in desk.told("problem"))
    assert "slider 4" in desk.printer.status().message
    assert desk.printer.fault is not None


def test_a_program_begins_at_the_reference_pose_only(desk):
    assert desk.run("G1 X20 F1200").lines == ("X:20.000 Y:0.000 Z:0.000",)
    desk.load(LINE)
    with pytest.raises(JobError, match="reference pose") as refused:
        desk.printer.start()
    assert refused.value.problems[0].hint == "send G28 first"
    assert desk.run("G28").ok
    assert desk.printer.status().homed
    desk.printer.start()
    desk.go(JobState.DONE)


def test_typed_text_is_refused_with_its_hint_and_leaves_everything_as_it_was(desk):
    assert desk.run("G91\nG1 X5 F600").ok
    reply = desk.run("G1 X900")
    assert not reply.ok
    assert reply.lines[0].startswith("error: the nozzle would be")
    assert reply.lines[1].startswith("hint: ")
    assert desk.run("G1 X5").lines == ("X:10.000 Y:0.000 Z:0.000",)
    assert desk.printer.state is JobState.IDLE


def test_typed_motion_ends_on_a_hold(desk):
    answer = desk.printer.run("G1 X80 F600")
    desk.go(most=2.0)
    desk.printer.hold()
    desk.go(most=2.0)
    assert not answer.result().ok
    assert answer.result().lines[0].startswith("stopped on the path: X:")
    assert desk.run("G1 X0").ok


def test_a_held_print_is_left_alone_by_typed_moves_and_returned_to(desk):
    desk.print(LINE, most=3.0)
    desk.printer.hold()
    desk.go(JobState.HELD)
    held = desk.done().nozzle_G[-1]
    assert desk.run("G91\nG1 Z15 F3000\nG1 X-5").ok
    assert desk.printer.state is JobState.HELD
    away = sum(map(len, desk.rows))
    desk.printer.resume()
    desk.go(JobState.PRINTING)
    desk.go(JobState.DONE)
    after = desk.done().nozzle_G[away:]
    assert np.linalg.norm(after - held, axis=1).min() < 1e-9
    plan = dry(LINE)
    assert (desk.done().slider[-50:] == plan.slider[-50:]).all()
    assert desk.done().flow.sum() == pytest.approx(plan.flow.sum(), rel=2e-3)


def jogged(desk, velocity, duration):
    end = desk.clock.now() + duration
    while desk.clock.now() < end:
        desk.printer.jog(np.array(velocity))
        desk.go(most=0.05)


def test_a_jog_goes_on_while_it_is_renewed_and_ends_with_its_lease(desk):
    jogged(desk, [0.0, 0.02, 0.0], 1.0)
    assert desk.printer.status().velocity == pytest.approx(0.02, rel=1e-6)
    desk.go(most=1.0)
    status = desk.printer.status()
    assert status.velocity == 0.0
    assert 0.018 < status.nozzle_G[1] < 0.026
    period = PAPER.drives.period
    jerk = np.linalg.norm(np.diff(desk.done().nozzle_G, 3, axis=0), axis=1).max() / period**3
    assert jerk <= PAPER.limits.jerk_max * 1.006


def test_a_jog_ends_at_rest_before_a_limit_and_says_which(desk):
    jogged(desk, [0.0, 0.0, -0.01], 0.5)
    assert desk.told("message") == [
        "the jog ends here: the nozzle would be at z = -2.000 mm, below the bed at 0 mm"
    ]
    jogged(desk, [0.1, 0.0, 0.0], 6.0)
    assert len(desk.told("message")) == 2
    assert desk.printer.status().velocity == pytest.approx(0.0, abs=1e-4)


def test_no_jog_while_a_program_moves_the_machine(desk):
    desk.print(LINE, most=1.0)
    with pytest.raises(JobError, match="no jogging while the printer is printing"):
        desk.printer.jog(np.array([0.01, 0.0, 0.0]))


def test_a_listener_that_fails_does_not_stop_the_machine(desk):
    def bad(event):
        raise RuntimeError("broken pipe")

    desk.printer.listen(bad)
    desk.print("G1 X5 F600\n")
    desk.go(JobState.DONE)
    assert sum("broken pipe" in text for text in desk.told("message")) == 1


def test_pauses_between_layers_and_their_least_time_are_in_the_plan(tmp_path):
    layers = "".join(f";LAYER:{k}\nG1 Z{k} F600\nG1 X{10 * (k % 2)} E5\n" for k in range(4))
    plain = dry(layers)
    rules = {"pause_every_layers": 2, "layer_time_min": 6.0, "pauses_lift": True}
    profile = PAPER.model_copy(update={"job": PAPER.job.model_copy(update=rules)})
    desk = Desk(tmp_path, profile)
    desk.print(layers)
    desk.go(JobState.HELD)
    assert desk.told("pause") == ["line 7: 2 layers done"]
    desk.printer.resume()
    desk.go(JobState.DONE)
    plan = dry(layers, profile)
    assert (desk.done().slider == plan.slider).all()
    assert plan.t[-1] > 3 * 6.0 > plain.t[-1]
    assert plan.nozzle_G[:, 2].max() == pytest.approx(0.003 + 0.02 - 0.001, abs=2e-3)


def test_a_thread_of_its_own_runs_a_print_and_ends():
    clock = PacedClock(1000.0)
    link = Loopback(PAPER, clock)
    link.open()
    printer = Printer(link, clock, executor=AtOnce())
    printer.begin()
    try:
        assert printer.run("G1 X20 F3000").result(timeout=60).ok
    finally:
        printer.close()
    assert link.state is LinkState.STOPPED
