"""Profiles: found, validated, every problem at once, units worn."""

import math
import re
from pathlib import Path

import pytest

from cdhr_host.errors import ProfileError
from cdhr_host.pipeline import check_profile, open_profile
from cdhr_host.profile import described, find, profile_names, read_table, validate

NAMES = ["paper", "paper-simulation", "paper-wide"]


@pytest.fixture
def broken(tmp_path):
    """The paper's profile with lines replaced -> a path."""

    def write(**lines):
        text = find("paper").read_text()
        for key, line in lines.items():
            text, count = re.subn(rf"^{key} = .*$", line, text, flags=re.M)
            assert count
        path = tmp_path / "broken.toml"
        path.write_text(text)
        return str(path)

    return write


@pytest.mark.parametrize("name", NAMES)
def test_installed_profiles_are_sound(name):
    assert name in profile_names()
    assert open_profile(name).machine.name


def test_values_are_si():
    paper = open_profile("paper")
    assert paper.geometry.pulley_radius == pytest.approx(0.011)
    assert paper.spring.stiffness == pytest.approx(1000.0)
    assert paper.extruder.pressure_max == pytest.approx(200e3)
    assert paper.path.stop_angle == pytest.approx(math.pi)


def test_columns_differ_as_the_paper_says():
    paper, simulation, wide = (open_profile(name) for name in NAMES)
    assert simulation.geometry.reference_height == pytest.approx(0.868)
    assert simulation.platforms.lower_mass == 1.0
    assert wide.geometry.model_copy(update={"nozzle_length": paper.geometry.nozzle_length}) == paper.geometry
    assert wide.spring.stiffness * (0.055 - wide.spring.rest_length) == pytest.approx(40.0)
    assert (wide.forces.lower_min, wide.forces.upper_max) == (3.0, 60.0)


def test_described_shows_the_file_again():
    for name in NAMES:
        table = read_table(find(name))
        for section, key, value, text in described(open_profile(name)):
            assert value == pytest.approx(table.get(section, {}).get(key, value))
            assert text


def test_every_problem_at_once_with_place_value_bound_and_hint(broken):
    path = broken(
        pulley_radius_mm="pully_radius_mm = 11.0",
        stiffness_n_mm='stiffness_n_mm = "1"',
        jerk_max_mm_s3="jerk_max_mm_s3 = -1.0",
        e_unit='e_unit = "inch"',
        height_mm="height_mm = 5000.0",
    )
    with pytest.raises(ProfileError) as caught:
        open_profile(path)
    by_key = {problem.key: problem for problem in caught.value.problems}
    assert by_key["geometry.pully_radius_mm"].hint == "did you mean 'pulley_radius_mm'?"
    assert by_key["geometry.pulley_radius_mm"].kind == "missing"
    assert by_key["spring.stiffness_n_mm"].kind == "type"
    assert by_key["limits.jerk_max_mm_s3"].limit == 0
    assert "mm3" in by_key["extruder.e_unit"].message
    assert all(problem.hint for problem in caught.value.problems)


def test_contradictions_are_found_beside_bad_keys(broken):
    path = broken(rest_length_mm="rest_length_mm = 25.0", e_unit='e_unit = "inch"')
    _, problems = check_profile(path)
    kinds = {problem.kind for problem in problems}
    assert "inconsistent" in kinds
    assert any(problem.key == "extruder.e_unit" for problem in problems)


def test_contradictions_that_rely_on_a_bad_key_are_not_guessed(broken):
    _, problems = check_profile(broken(rest_length_mm='rest_length_mm = "long"'))
    assert [problem.key for problem in problems] == ["spring.rest_length_mm"]


def test_sliders_too_slow_for_the_nozzle_are_a_contradiction(broken):
    _, problems = check_profile(broken(acceleration_max_mm_s2="acceleration_max_mm_s2 = 1.0"))
    assert any("sliders" in problem.message for problem in problems)


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"\xff\xfe", "UTF-8"), (b"[machine", "TOML"), (b"#" * 1_100_000, "larger than"), (None, "cannot read")],
)
def test_files_that_are_no_profile(tmp_path, content, says):
    path = tmp_path / "bad.toml"
    if content is None:
        path.touch()
        with pytest.raises(ProfileError, match=says):
            read_table(Path(tmp_path / "absent.toml"))
        return
    path.write_bytes(content)
    with pytest.raises(ProfileError, match=says):
        open_profile(str(path))


def test_unknown_name_gets_the_nearest():
    with pytest.raises(ProfileError) as caught:
        open_profile("papper")
    assert caught.value.problems[0].hint == "did you mean 'paper'?"


def test_missing_and_unknown_sections_are_told():
    table = read_table(find("paper"))
    del table["bed"]
    table["beds"] = {}
    _, problems = validate(table)
    assert {problem.key: problem.hint for problem in problems}["beds"] == "did you mean 'bed'?"
    assert "bed" in {problem.key for problem in problems}


def test_where_the_upper_platform_stands_unless_the_profile_says(broken):
    """Free for a machine that prints; the columns of the paper stay what they are."""
    assert open_profile(broken(policy="")).spring.policy == "free"
    told = {name: open_profile(name).spring.policy for name in NAMES}
    assert told == {"paper": "fixed", "paper-simulation": "fixed", "paper-wide": "free"}
