"""The staircase as a whole: what comes out, what is refused, and the proof's numbers."""

import math

import numpy as np
import pytest

from cdhr_host.errors import MotionError, ProgramError
from cdhr_host.mechanism import Cables, lengths
from cdhr_host.pipeline import Checked, Staircase, open_profile, prove
from cdhr_host.pipeline.columns import SETPOINT_COLUMNS, setpoint_columns
from cdhr_host.units import MM, MM3
from cdhr_host.values import Pause, Setpoints


@pytest.fixture(scope="module")
def paper():
    return open_profile("paper")


@pytest.fixture(scope="module")
def wide():
    return open_profile("paper-wide")


def joined(blocks):
    blocks = list(blocks)
    return {name: np.concatenate([getattr(block, name) for block in blocks]) for name in Setpoints.__slots__}


SQUARE = b"G21\nG90\nM83\nG1 Z5 F1200\nG1 X30 E100\nG1 Y30 E100\nG4 P100\nG1 X0 Y0 F3000\n"


def test_sliders_are_the_mechanisms_lengths_less_the_reference(paper):
    rows = joined(Staircase(paper).setpoints([SQUARE]))
    cables = Cables.from_profile(paper)
    q = rows["nozzle_G"] - cables.reference_G
    assert np.array_equal(rows["slider"], lengths(cables, q, q) - cables.reference_lengths)
    assert np.array_equal(rows["upper"], q)
    assert not rows["slider"][0].any()


def test_time_is_tick_times_period_and_rate_only_resamples(paper):
    coarse = joined(Staircase(paper).setpoints([SQUARE]))
    fine = joined(Staircase(paper, rate_hz=1000.0).setpoints([SQUARE]))
    assert np.array_equal(coarse["tick"], np.arange(len(coarse["tick"])))
    assert np.array_equal(coarse["t"], coarse["tick"] * 0.004)
    assert np.abs(fine["nozzle_G"][::4][: len(coarse["tick"]) - 1] - coarse["nozzle_G"][:-1]).max() < 1e-12


def test_air_is_off_on_travel_dwell_and_at_both_ends(paper):
    rows = joined(Staircase(paper).setpoints([SQUARE]))
    printing = np.isin(rows["line"], [5, 6])
    moving = np.linalg.norm(np.diff(rows["nozzle_G"], axis=0, prepend=rows["nozzle_G"][:1]), axis=1) > 1e-9
    assert (rows["pressure"][printing & moving] > 0).all()
    assert not rows["pressure"][~printing].any()
    assert rows["pressure"][0] == rows["pressure"][-1] == 0.0


def test_programs_follow_each_other_from_rest_to_rest(paper):
    machine = Staircase(paper)
    first = machine.prepare([b"G1 X10 F1200\n"])
    second = machine.prepare([b"G91\nG1 X5\n"])
    assert second[0].tick[0] == first[-1].tick[-1] + 1
    assert second[-1].nozzle_G[-1] / MM == pytest.approx([15, 0, 0], abs=1e-9)


def test_refused_text_leaves_the_machine_as_it_was(paper):
    machine = Staircase(paper)
    machine.prepare([b"G91\nG1 X10 F1200\n"])
    with pytest.raises(MotionError, match="bed"):
        machine.prepare([b"G90\nG1 X5000\n"])
    with pytest.raises(ProgramError):
        machine.prepare([b"G6\n"])
    rows = machine.prepare([b"G1 X5\n"])
    assert rows[0].nozzle_G[0] / MM == pytest.approx([10, 0, 0], abs=1e-3)
    assert rows[-1].nozzle_G[-1] / MM == pytest.approx([15, 0, 0], abs=1e-9)


def test_pause_comes_after_everything_up_to_rest(paper):
    steps = list(Staircase(paper).walk([b"G1 X5 F600\nM0 look\nG1 X0\n"]))
    at = next(i for i, step in enumerate(steps) if isinstance(step, Pause))
    before = joined(step.setpoints for step in steps[:at] if isinstance(step, Checked))
    assert before["nozzle_G"][-1] / MM == pytest.approx([5, 0, 0], abs=1e-9)
    assert np.allclose(before["slider"][-1], before["slider"][-2], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "kind", "limit", "line"),
    [
        (b"G1 Z5 F1200\nG1 X400\n", "bed", 320.0, 2),
        (b"G1 Z-1 F1200\n", "bed", 0.0, 1),
        (b"G1 Z900 F1200\n", "bed", 800.0, 1),
        (b"G1 X300 F1200\n", "force", 12.0, 1),
    ],
)
def test_what_the_machine_cannot_do_is_named_with_line_number_and_limit(paper, text, kind, limit, line):
    proof = prove([text], paper)
    assert not proof.ok
    problem = next(problem for problem in proof.problems if problem.kind == kind)
    assert problem.line == line
    assert problem.limit == pytest.approx(limit)
    assert problem.hint
    with pytest.raises(MotionError):
        list(Staircase(paper).setpoints([text]))


def test_force_refusals_name_cable_and_worst_force(paper, wide):
    text = b"G1 X180 Y180 F3000\nG1 X0 Y0\n"
    problems = [problem for problem in prove([text], paper).problems if problem.kind == "force"]
    assert {problem.line for problem in problems} == {1, 2}
    assert len({(problem.line, problem.message.split(" would")[0]) for problem in problems}) == len(problems)
    assert prove([text], wide).ok


def test_problems_are_counted_beyond_the_hundred_listed(paper):
    text = b"".join(b"G1 X%d Y300 F3000\n" % (n % 2) for n in range(300))
    proof = prove([text], paper)
    assert len(proof.problems) == 100
    assert proof.total_problems > 200


def test_each_limit_of_the_sliders_is_audited(paper):
    slow = paper.sliders.model_copy(update={"travel_max": 0.01, "travel_min": -0.005, "speed_max": 0.001})
    machine = Staircase(paper)
    machine.profile = paper.model_copy(update={"sliders": slow})
    kinds = set()
    for step in machine.walk([b"G1 X50 F3000\n"]):
        if isinstance(step, Checked):
            kinds |= {problem.kind for problem in step.problems}
    assert kinds == {"travel", "slider speed"}


def test_slower_sliders_slow_the_nozzle_down(paper):
    sliders = paper.sliders.model_copy(update={"speed_max": 0.02, "acceleration_max": 0.1, "jerk_max": 1.0})
    careful = paper.model_copy(update={"sliders": sliders})
    proof = prove([b"G1 X100 F6000\nG1 Y50\nG1 X0 Y0 Z40\n"], careful, rate_hz=1000.0)
    assert proof.ok
    rows = joined(Staircase(careful, rate_hz=1000.0).setpoints([b"G1 X100 F6000\nG1 Y50\nG1 X0 Y0 Z40\n"]))
    for order, limit in ((1, 0.02), (2, 0.1), (3, 1.0)):
        assert np.abs(np.diff(rows["slider"], order, axis=0)).max() / 0.001**order <= limit * 1.001


def test_proof_counts_what_was_drawn(paper):
    text = b"M83\n;LAYER:0\nG1 X30 F1200 E60\n;LAYER:1\nG1 Y40 E80\nG2 X30 Y0 I0 J-20 E10\nG1 E5\nM0\n"
    proof = prove([text], paper)
    assert proof.ok
    assert proof.lines == 8
    assert proof.moves == 4
    assert proof.path / MM == pytest.approx(30 + 40 + math.pi * 20)
    assert proof.extruded / MM3 == pytest.approx(155, rel=1e-9)
    assert proof.layers == ((2, 1), (4, 2))
    assert proof.pauses == 1
    assert proof.extremes["x_mm"][2] == pytest.approx(50, abs=0.1)
    assert set(proof.extremes) == set(SETPOINT_COLUMNS) - {"t_s", "line"}


def test_layers_begin_with_the_first_tick_of_their_lines(paper):
    text = b"M83\n;LAYER:0\nG1 X30 F1200 E60\n;LAYER:1\nG1 Y40 E80\n;LAYER:2\nM117 done\n"
    blocks = []
    proof = prove([text], paper, sink=lambda rows: blocks.append((rows.t, rows.line)))
    t, line = (np.concatenate(part) for part in zip(*blocks, strict=True))
    assert proof.layer_times == (t[line >= 2][0], t[line >= 4][0], proof.duration)
    surveyed = prove([text], paper)
    assert surveyed.layer_times == pytest.approx(proof.layer_times, abs=2e-3 / 0.02 + 0.004)


def test_what_is_watched_says_where_and_how_hard(paper):
    blocks = []
    prove([b"G1 X30 F1200\nG1 X400\n"], paper, watch=blocks.append)
    for block in blocks:
        assert block.nine.shape == (len(block.setpoints), 9)
        assert np.isin(block.setpoints.tick, block.track.tick).all()
        assert np.allclose(block.nine[:, :3] + block.nine[:, 3:6], block.setpoints.tension[:, :3])
    assert max(block.track.position_G[:, 0].max() for block in blocks) == pytest.approx(0.4)


def test_extremes_are_those_of_all_rows(paper):
    collected = []
    proof = prove([SQUARE], paper, sink=lambda rows: collected.append(setpoint_columns(rows)))
    for name, (low, low_line, high, high_line) in proof.extremes.items():
        values = np.concatenate([block[name] for block in collected])
        lines = np.concatenate([block["line"] for block in collected])
        assert (low, high) == (values.min(), values.max())
        assert low in values[lines == low_line]
        assert high in values[lines == high_line]


def test_sink_gets_nothing_from_the_first_problem_on(paper):
    collected = []
    prove([b"G1 X10 F1200\nG4 P100\nG1 X400\n"], paper, sink=collected.append)
    assert all((rows.nozzle_G[:, 0] <= 0.3201).all() for rows in collected)


def test_text_that_is_not_understood_is_refused_whole(paper):
    with pytest.raises(ProgramError) as caught:
        prove([b"G1 X10 F1200\nG6\nG1 Xa\n"], paper)
    assert {problem.line for problem in caught.value.problems} == {2, 3}


@pytest.mark.parametrize("kind", ["zv", "mzv", "ei"])
def test_shaping_keeps_every_promise_of_the_plain_motion(paper, kind):
    rules = paper.path.model_copy(update={"shaper": kind, "shaper_frequency": 20.0})
    shaped = paper.model_copy(update={"path": rules})
    text = b"M83\nG1 Z5 F2400\nG1 X60 E100\nG1 Y60 E100\nG4 P50\nG1 X0 Y0 F6000\n"
    proof = prove([text], shaped)
    assert proof.ok
    rows = joined(Staircase(shaped, rate_hz=1000.0).setpoints([text]))
    corner = np.array([60, 0, 5]) * MM
    assert np.linalg.norm(rows["nozzle_G"] - corner, axis=1).min() <= paper.path.tolerance
    for order, limit in ((1, 0.1), (2, 0.5), (3, 5.0)):
        change = np.linalg.norm(np.diff(rows["nozzle_G"], order, axis=0), axis=1).max() / 0.001**order
        assert change <= limit * 1.001
    laid = (rows["flow"] * 0.001).sum() / MM3
    assert laid == pytest.approx(200, rel=0.01)
    assert rows["nozzle_G"][-1] / MM == pytest.approx([0, 0, 5], abs=1e-9)
    plain = prove([text], paper)
    assert 0 < proof.duration - plain.duration < 1.0


def test_a_mode_too_slow_to_shape_within_the_tolerance_is_refused(tmp_path):
    from cdhr_host.errors import ProfileError
    from cdhr_host.profile import find

    text = find("paper").read_text().replace('shaper = "none"', 'shaper = "ei"')
    path = tmp_path / "slow.toml"
    path.write_text(text.replace("shaper_frequency_hz = 14.0", "shaper_frequency_hz = 1.0"))
    with pytest.raises(ProfileError, match="1 Hz"):
        open_profile(str(path))


def test_cable_that_would_run_into_the_bed_is_named(paper):
    proof = prove([b"G1 Y225 F3000\n"], paper)
    found = [problem for problem in proof.problems if problem.kind == "clearance"]
    assert found
    assert found[0].line == 1
    assert "cable" in found[0].message
    assert "nozzle_length_mm" in found[0].hint


def test_collision_is_only_a_warning_where_the_profile_says_so(paper):
    bed = paper.bed.model_copy(update={"clearance": "warn"})
    wide = open_profile("paper-wide").model_copy(update={"bed": bed, "geometry": paper.geometry})
    proof = prove([b"G1 Y225 F3000\n"], wide)
    assert proof.ok
    assert any(warning.kind == "clearance" for warning in proof.warnings)


def test_upper_platform_goes_to_where_the_policy_wants_it_and_back(wide):
    assert wide.spring.policy == "free"
    text = b"G1 X50 Y20 F3000\nG28\n"
    assert prove([text], wide).ok
    rows = joined(Staircase(wide).setpoints([text]))
    assert not rows["slider"][0].any()
    assert np.abs(rows["slider"][-1]).max() < 1e-12
    standing = np.flatnonzero(np.linalg.norm(rows["nozzle_G"], axis=1) == 0.0)
    assert np.ptp(rows["upper"][standing], axis=0).max() > 1e-3
    for order, limit in ((1, wide.sliders.speed_max), (2, wide.sliders.acceleration_max)):
        assert np.abs(np.diff(rows["slider"], order, axis=0)).max() / 0.004**order <= limit * 1.001
    assert np.abs(np.diff(rows["slider"], 3, axis=0)).max() / 0.004**3 <= wide.sliders.jerk_max * 1.001
    assert rows["tick"].tolist() == list(range(len(rows["tick"])))


def test_jogging_does_not_take_the_upper_platform_back_between_lines(wide):
    machine = Staircase(wide)
    machine.prepare([b"G1 X10 F3000\n"])
    rows = joined(machine.prepare([b"G1 X0\n"]))
    assert np.linalg.norm(rows["upper"][-1]) > 1e-3
    again = joined(machine.prepare([b"G1 X10\n"]))
    assert np.linalg.norm(np.diff(again["upper"], axis=0), axis=1).max() < 1e-3


def test_single_cables_are_audited(paper):
    forces = paper.forces.model_copy(update={"single_min": 2.0})
    strict = paper.model_copy(update={"forces": forces})
    proof = prove([b"G1 X120 F3000\n"], strict)
    assert any("left" in problem.message or "right" in problem.message for problem in proof.problems)


def test_stretch_is_allowed_for_in_sliders_where_the_profile_says_so(paper):
    soft = paper.model_copy(update={"stretch": paper.stretch.model_copy(update={"compensation": "on"})})
    text = b"G1 X60 Z30 F3000\n"
    rigid, given = (joined(Staircase(profile).setpoints([text])) for profile in (paper, soft))
    assert not given["slider"][0].any()
    assert len(given["slider"]) == len(rigid["slider"]) + 1
    assert 1e-6 < np.abs(given["slider"][:-1] - rigid["slider"]).max() < 1e-3
    assert np.array_equal(given["nozzle_G"][-1], given["nozzle_G"][-2])
    traces = []
    prove([text], soft, trace=traces.append)
    assert np.array_equal(np.concatenate([trace.slider for trace in traces]), given["slider"])
