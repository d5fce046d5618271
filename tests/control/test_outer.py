"""The outer loop: convergence, latency, funnel, silence, tension."""

import math

import numpy as np
import pytest
from plant_machines import profile_of

from cdhr_host.control import EncoderPose, Funnel, Mode, Outer, OuterSettings, Plan, PoseSample, Seen
from cdhr_host.mechanism import Cables, lengths, slider, tensions
from cdhr_host.mechanism.cables import Loads

PAPER = profile_of("paper")
DT = 0.004


class Rehearsal:
    """A nozzle that goes where it is told, plus an offset; a camera that is late."""

    def __init__(self, settings: OuterSettings, *, delay: float = 0.0, speed: float = 0.0) -> None:
        self.outer, self.delay, self.speed = Outer(PAPER, settings), delay, speed
        self.state, self.n, self.notices = self.outer.start(), 0, []
        self.past: list[np.ndarray] = []
        self.shift = np.zeros(6)
        self.mode = Mode.OPEN

    def run(self, seconds: float, offset: np.ndarray, *, seeing: bool = True) -> np.ndarray:
        """(3,) m: error in the end."""
        for _ in range(round(seconds / DT)):
            t = self.n * DT
            planned = np.array([self.speed * t, 0.0, 0.0] * 2)
            self.past.append(planned[:3] + offset + self.shift[:3])
            taken = self.n - round(self.delay / DT)
            sample = PoseSample(taken * DT, self.past[taken], taken) if seeing and taken >= 0 else None
            plan = Plan(t, planned, np.zeros(6), np.zeros(6))
            self.state, action = self.outer.step(
                self.state, plan, Seen(planned, np.zeros(6), None, sample), DT
            )
            self.shift, self.mode = action.shift, action.mode
            self.notices += [action.notice] if action.notice else []
            self.n += 1
        return self.past[-1] - planned[:3]


OFFSET = np.array([4e-4, -3e-4, 2e-4])


def test_a_constant_error_is_integrated_away() -> None:
    machine = Rehearsal(OuterSettings())
    assert np.abs(machine.run(6.0, OFFSET)).max() < 1e-6
    assert machine.notices == ["closed loop from 0.000 s on"]


def test_latency_costs_no_accuracy_on_a_moving_nozzle() -> None:
    machine = Rehearsal(OuterSettings(), delay=0.048, speed=0.02)
    assert np.abs(machine.run(8.0, OFFSET)).max() < 2e-6


@pytest.mark.parametrize(("gain", "stable"), [(2.0, True), (8.0, True), (60.0, False)])
def test_what_gain_latency_allows(gain: float, stable: bool) -> None:
    """Ki times latency below pi/2: 31 1/s at 50 ms."""
    settings = OuterSettings(gain=gain, rate=1.0, range=10.0, funnel=Funnel(50.0, 50.0))
    machine = Rehearsal(settings, delay=0.048)
    left = float(np.abs(machine.run(6.0, OFFSET)).max())
    assert (left < 1e-5) == stable


def test_the_shift_is_rate_limited() -> None:
    machine = Rehearsal(OuterSettings(rate=1e-3, funnel=Funnel(0.01, 0.01)))
    machine.run(0.4, np.array([8e-3, 0.0, 0.0]))
    assert 3.5e-4 < np.linalg.norm(machine.shift[:3]) <= 4.1e-4


def test_an_error_outside_the_funnel_stops_and_stays_stopped() -> None:
    machine = Rehearsal(OuterSettings(funnel=Funnel(5e-3, 1e-3, 0.5)))
    machine.run(4.0, OFFSET)
    machine.run(0.1, OFFSET + 1.3e-3)
    held = machine.shift.copy()
    assert machine.mode is Mode.STOP
    assert "more than 1.0" in machine.notices[-1]
    machine.run(1.0, OFFSET)
    assert machine.mode is Mode.STOP
    assert (machine.shift == held).all()


def test_one_wild_sample_is_no_reason_to_stop() -> None:
    machine = Rehearsal(OuterSettings())
    machine.run(2.0, OFFSET)
    machine.run(2 * DT, OFFSET + 0.1)
    machine.run(1.0, OFFSET)
    assert machine.mode is Mode.CLOSED


def test_a_correction_beyond_its_range_stops() -> None:
    machine = Rehearsal(OuterSettings(range=2e-4))
    machine.run(4.0, OFFSET)
    assert machine.mode is Mode.STOP
    assert "would exceed 0.2 mm for the nozzle" in machine.notices[-1]


def test_a_silent_source_opens_the_loop_and_says_so() -> None:
    machine = Rehearsal(OuterSettings(timeout=0.2))
    machine.run(4.0, OFFSET)
    held = machine.shift.copy()
    machine.run(1.0, OFFSET, seeing=False)
    assert machine.mode is Mode.OPEN
    assert machine.notices[-1].startswith("open loop from 4.")
    assert np.abs(machine.shift - held).max() < 1e-6
    machine.run(1.0, OFFSET)
    assert machine.mode is Mode.CLOSED
    assert machine.notices[-1].startswith("closed loop from 5.0")


def test_a_sample_older_than_the_memory_is_not_used() -> None:
    machine = Rehearsal(OuterSettings(memory=0.05), delay=0.1)
    machine.run(1.0, OFFSET)
    assert machine.mode is Mode.OPEN
    assert not machine.shift.any()


def test_upper_platform_rises_until_its_cables_pull_as_planned() -> None:
    """A spring 1 N too weak is 1 mm of height."""
    outer, state = Outer(PAPER), Outer(PAPER).start()
    cables, loads = Cables.from_profile(PAPER), Loads.from_profile(PAPER)
    weak = Loads(
        loads.lower_mass, loads.upper_mass, loads.stiffness, loads.rest_length + 1e-3, loads.separation
    )
    nothing, rise = np.zeros(6), 0.0
    for n in range(4000):
        felt = tensions(cables, weak, np.zeros((1, 3)), np.array([[0.0, 0.0, rise]]))[0]
        state, action = outer.step(
            state, Plan(n * DT, nothing, nothing, nothing), Seen(nothing, nothing, felt), DT
        )
        rise = float(action.shift[5])
    assert rise == pytest.approx(1e-3, abs=3e-5)
    assert not action.shift[:5].any()


def test_funnel_narrows_and_presses_harder_at_its_wall() -> None:
    funnel = Funnel(5e-3, 1e-3, 2.0)
    assert funnel.radius(0.0) == pytest.approx(5e-3)
    assert funnel.radius(1e3) == pytest.approx(1e-3)
    assert funnel.pressing(1e-5, 1e3) == pytest.approx(1e-5, rel=1e-4)
    assert funnel.pressing(0.999e-3, 1e3) > 3e-3
    assert funnel.pressing(1e-3, 1e3) == math.inf


def test_encoders_are_a_pose_source() -> None:
    cables = Cables.from_profile(PAPER)
    q = np.array([[0.05, -0.02, 0.03]])
    run = slider(cables, lengths(cables, q, q))[0]
    sample = EncoderPose(cables, lambda t: run * (t > 0.01), DT).latest(0.0205)
    assert sample.frame == 5
    assert sample.t == pytest.approx(0.02)
    assert np.abs(sample.position - q[0]).max() < 1e-12


def test_a_force_correction_beyond_its_range_stops() -> None:
    outer, state = Outer(PAPER, OuterSettings(tension_range=2e-4)), Outer(PAPER).start()
    nothing, mode = np.zeros(6), Mode.OPEN
    for n in range(4000):
        plan = Plan(n * DT, nothing, nothing, nothing)
        state, action = outer.step(state, plan, Seen(nothing, nothing, np.zeros(6)), DT)
        if action.mode is Mode.STOP:
            mode = action.mode
            break
    assert mode is Mode.STOP
    assert "for the force" in action.notice
    assert abs(float(action.shift[5])) <= 2e-4


def test_both_corrections_together_keep_the_rate() -> None:
    """A nozzle too low and cables 4-6 too slack: the upper platform still moves at 2 mm/s at most."""
    outer, nothing = Outer(PAPER), np.zeros(6)
    state, before, fastest, used = outer.start(), np.zeros(6), 0.0, 0.0
    for n in range(500):
        sample = PoseSample(n * DT, np.array([-1e-3, 5e-4, -2e-3]) + before[:3], n)
        seen = Seen(nothing, nothing, np.zeros(6), sample)
        state, action = outer.step(state, Plan(n * DT, nothing, nothing, nothing), seen, DT)
        assert action.mode is Mode.CLOSED
        speed = (action.shift - before) / DT
        fastest = max(fastest, float(np.linalg.norm(speed[3:])), float(np.linalg.norm(speed[:3])))
        used, before = max(used, float(action.shift[5] - action.shift[2])), action.shift
    assert fastest == pytest.approx(2e-3, rel=1e-9)
    assert used > 1e-3
