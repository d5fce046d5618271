"""Controllers on the simulated rig, from G-code to sliders."""

from collections.abc import Iterator

import numpy as np
import pytest
from trajectories import ManualClock

from cdhr_host.control import Mode, OuterSettings
from cdhr_host.control.funnel import Funnel
from cdhr_host.drives import open_link
from cdhr_host.errors import JobError
from cdhr_host.job import stream
from cdhr_host.job.closed_loop import ForceLoop, OuterLoop, Setup, Truth, closed_loop, simulated
from cdhr_host.mechanism import Cables
from cdhr_host.motion.hold import ends_at_rest
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.plant.capture import Camera, SimulatedCapture
from cdhr_host.plant.faults import PAPER, Faults
from cdhr_host.values import Setpoints

PROGRAM = b"G1 X20 Y0 F900\nG3 X-20 Y0 I-20 J0\nG1 X0 Y0\n"
PROFILE = open_profile("paper")
FAULTS = Faults.drawn(1, PAPER)


def planned() -> Iterator[Setpoints]:
    return Staircase(PROFILE).setpoints([PROGRAM])


def watching(camera: Camera) -> object:
    return lambda truth: SimulatedCapture(camera, truth)


def errors(loop: OuterLoop | ForceLoop, rows: list[Setpoints]) -> np.ndarray:
    """(N, 3) m: true place minus plan."""
    q = np.vstack([batch.nozzle_G for batch in rows]) - Cables.from_profile(PROFILE).reference_G
    return np.array(loop.truth.positions[1:]) - q


def test_outer_loop_takes_the_faults_of_the_machine_away() -> None:
    off = []
    for gain in (0.0, 1.5):
        setup = Setup(FAULTS, rigid=True, outer=OuterSettings(gain=gain))
        loop = OuterLoop(PROFILE, setup, watching(Camera(noise=1e-5)))
        rows = list(closed_loop(planned(), loop, PROFILE, str))
        off.append(np.linalg.norm(errors(loop, rows), axis=1)[-500:].mean())
    assert off[1] < 0.6 * off[0]


def test_rows_keep_their_ticks_and_end_at_rest() -> None:
    said: list[str] = []
    loop = OuterLoop(PROFILE, Setup(FAULTS), watching(Camera(gaps=((2.0, 3.0),))))
    rows = list(closed_loop(planned(), loop, PROFILE, said.append))
    plain = list(planned())
    assert np.concatenate([r.tick for r in rows]).tolist() == np.concatenate([r.tick for r in plain]).tolist()
    assert ends_at_rest(np.vstack([r.slider for r in rows]), PROFILE)
    assert [text.split(" from")[0] for text in said] == ["closed loop", "open loop", "closed loop"]
    assert loop.state.mode is Mode.CLOSED


def test_an_error_beyond_the_funnel_stops_on_the_path() -> None:
    setup = Setup(FAULTS, rigid=True, outer=OuterSettings(gain=0.01, funnel=Funnel(1e-3, 2e-5, 0.3)))
    loop = OuterLoop(PROFILE, setup, watching(Camera(noise=0.0)))
    rows: list[Setpoints] = []
    with pytest.raises(JobError, match="away from the path") as refused:
        rows.extend(closed_loop(planned(), loop, PROFILE, str))
    assert refused.value.problems[0].line is not None
    sliders = np.vstack([batch.slider for batch in rows])
    assert ends_at_rest(sliders, PROFILE)
    assert rows[-1].pressure.max() == 0.0
    assert np.abs(np.diff(sliders, n=2, axis=0)).max() < 1e-4
    whole = sum(len(batch) for batch in planned())
    assert sum(len(batch) for batch in rows) < whole


def test_force_control_follows_by_encoders_alone() -> None:
    loop = ForceLoop(PROFILE, Setup(), watching(Camera()))
    rows = list(closed_loop(planned(), loop, PROFILE, str))
    assert np.abs(errors(loop, rows)).max() < 1e-4
    assert np.abs(loop.state.lag).max() < 1e-9
    plain = np.vstack([batch.slider for batch in planned()])
    assert np.abs(np.vstack([batch.slider for batch in rows]) - plain).max() < 3e-4


def test_truth_is_linear_between_ticks() -> None:
    truth = Truth(0.01)
    assert (truth(5.0) == 0.0).all()
    truth.add(1.0, (1.0, 0.0, 0.0))
    truth.add(1.01, (3.0, 0.0, 0.0))
    assert truth(0.0)[0] == 0.0
    assert truth(1.0)[0] == pytest.approx(1.0)
    assert truth(1.005)[0] == pytest.approx(2.0)
    assert truth(9.0)[0] == 3.0


def test_loops_by_their_names() -> None:
    assert isinstance(simulated("outer", PROFILE), OuterLoop)
    assert isinstance(simulated("ppc", PROFILE), ForceLoop)
    with pytest.raises(JobError, match="no control 'pid'"):
        simulated("pid", PROFILE)


@pytest.mark.parametrize("control", ["outer", "ppc"])
def test_a_controlled_print_runs_on_the_simulated_drives(control: str) -> None:
    clock = ManualClock()
    link = open_link("loopback:", PROFILE, clock)
    loop, sent = simulated(control, PROFILE), []
    summary = stream(
        closed_loop(planned(), loop, PROFILE, str),
        link,
        clock,
        start=np.zeros(6),
        on_rows=lambda rows, feedback: sent.append(rows),
    )
    assert summary.ticks == sum(len(batch) for batch in planned())
    assert not summary.interrupted
    assert np.linalg.norm(errors(loop, sent), axis=1).max() < 1e-3
