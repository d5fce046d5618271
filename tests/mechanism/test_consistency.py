"""Profile values that contradict each other: found, explained, and gone when the hint is followed."""

import re
from typing import Any

import pytest
from mechanism_oracle import machine

from cdhr_host.errors import Problem
from cdhr_host.mechanism import inconsistencies
from cdhr_host.profile import Profile, find, profile_names, read_table, validate

NAMES = ["paper", "paper-simulation", "paper-wide"]


def changed(name: str = "paper-wide", **values: float) -> Profile:
    """A shipped profile with ``section__key`` values replaced."""
    table: dict[str, Any] = read_table(find(name))
    table["spring"]["policy"] = "fixed"
    for place, value in values.items():
        section, key = place.split("__")
        assert key in table[section]
        table[section][key] = value
    profile, problems = validate(table)
    assert problems == []
    return profile


def problems(**values: float) -> dict[str, Problem]:
    """key -> problem of a changed profile."""
    found = inconsistencies(changed(**values))
    known = {f"{section}.{key}" for section, keys in read_table(find("paper")).items() for key in keys}
    for relies_on, problem in found:
        assert relies_on <= known
        assert problem.key in relies_on
        assert problem.kind == "inconsistent"
        assert problem.hint
        assert problem.unit in {"mm", "n", "kpa"}
        assert str(problem.key) in problem.message
    return {str(problem.key): problem for _, problem in found}


def test_the_shipped_profiles_are_these() -> None:
    assert set(NAMES) <= set(profile_names())


@pytest.mark.parametrize("name", NAMES)
def test_shipped_profiles_are_consistent(name: str) -> None:
    assert inconsistencies(machine(name).profile) == []


@pytest.mark.parametrize(
    ("values", "key", "value", "limit"),
    [
        ({"forces__lower_min_n": 60.0}, "forces.lower_min_n", 60.0, 60.0),
        ({"forces__upper_min_n": 61.0}, "forces.upper_min_n", 61.0, 60.0),
        ({"forces__single_min_n": 60.0}, "forces.single_min_n", 60.0, 60.0),
        ({"sliders__travel_min_mm": 0.0, "sliders__travel_max_mm": 0.0}, "sliders.travel_min_mm", 0.0, 0.0),
        ({"extruder__pressure_threshold_kpa": 200.0}, "extruder.pressure_threshold_kpa", 200.0, 200.0),
        ({"spring__rest_length_mm": 55.5}, "spring.rest_length_mm", 55.5, 55.0),
        (
            {"geometry__lower_pulley_height_mm": 438.5},
            "geometry.lower_pulley_height_mm",
            438.5,
            438.5,
        ),
        ({"geometry__upper_pulley_height_mm": 493.0}, "geometry.upper_pulley_height_mm", 493.0, 493.5),
        ({"geometry__lower_attachment_radius_mm": 890.0}, "geometry.pulley_radius_mm", 11.0, 8.62),
        ({"geometry__upper_attachment_radius_mm": 890.0}, "geometry.pulley_radius_mm", 11.0, 8.62),
    ],
)
def test_values_in_the_wrong_order(values: dict[str, float], key: str, value: float, limit: float) -> None:
    found = problems(**values)
    assert found[key].value == pytest.approx(value)
    assert found[key].limit == pytest.approx(limit)


def test_a_nozzle_limit_above_the_sliders_is_no_contradiction() -> None:
    assert problems(limits__speed_max_mm_s=500.0) == {}


def test_the_printed_spring_overloads_the_experiment() -> None:
    """30 N: f = 15.86 / 15.10 N over the windows' 10 / 12 N; the hint's rest lengths are right."""
    found = problems(name="paper", spring__rest_length_mm=25.0)
    assert set(found) == {"forces.lower_max_n", "forces.upper_max_n"}
    assert found["forces.lower_max_n"].value == pytest.approx(15.857, abs=1e-3)
    assert found["forces.upper_max_n"].value == pytest.approx(15.096, abs=1e-3)
    assert found["forces.lower_max_n"].limit == 10.0
    assert "cables 1, 2 and 3 carry 15.857 N" in found["forces.lower_max_n"].message
    shortest, longest = map(
        float, re.findall(r"from ([\d.]+) to ([\d.]+) \(", str(found["forces.lower_max_n"].hint))[0]
    )
    for rest, inside in [
        (shortest - 0.01, False),
        (shortest + 0.01, True),
        (longest - 0.01, True),
        (longest + 0.01, False),
    ]:
        assert (problems(name="paper", spring__rest_length_mm=rest) == {}) is inside


def test_a_slack_reference_pose() -> None:
    found = problems(name="paper", spring__rest_length_mm=50.0)
    assert found["forces.lower_min_n"].value == pytest.approx(-1.72, abs=0.01)
    assert "below it" in found["forces.lower_min_n"].message


def test_windows_no_spring_can_serve() -> None:
    found = problems(name="paper", forces__lower_min_n=9.0, forces__upper_max_n=6.0)
    assert set(found) == {"forces.lower_min_n", "forces.upper_max_n"}
    assert "widen the windows" in str(found["forces.upper_max_n"].hint)


def test_a_finding_relies_on_what_it_is_computed_from() -> None:
    found = {
        problem.key: relies
        for relies, problem in inconsistencies(changed("paper", spring__rest_length_mm=25.0))
    }
    relied = found["forces.lower_max_n"]
    assert {"spring.stiffness_n_mm", "platforms.lower_mass_kg", "geometry.pulley_radius_mm"} <= relied
    assert not {"forces.upper_max_n", "platforms.upper_mass_kg", "bed.radius_mm"} & relied


@pytest.mark.parametrize("z", [0.0, -5.0])
def test_a_bed_on_the_lower_pulleys(z: float) -> None:
    found = problems(bed__origin_z_mm=z)
    assert found["bed.origin_z_mm"].value == pytest.approx(z)
    assert found["bed.origin_z_mm"].limit == 0.0


def test_a_bed_through_the_upper_pulleys() -> None:
    found = problems(bed__height_mm=1303.0)
    assert found["bed.height_mm"].limit == pytest.approx(1302.5)
    assert "below 1302.5" in str(found["bed.height_mm"].hint)
    travel = {"sliders__travel_min_mm": -2000.0, "sliders__travel_max_mm": 2000.0}
    assert problems(bed__height_mm=1302.4, **travel) == {}


def test_a_bed_so_high_that_the_policy_leaves_the_pulleys() -> None:
    table = read_table(find("paper-wide"))
    table["bed"]["height_mm"] = 1295.0
    found = [problem for _, problem in inconsistencies(validate(table)[0])]
    assert [problem.key for problem in found] == ["bed.height_mm"]
    assert "policy free" in found[0].message
    assert 800.0 < float(found[0].limit or 0.0) < 1295.0


def test_a_bed_above_the_upper_pulleys() -> None:
    found = problems(bed__origin_z_mm=1800.0)
    assert "lower bed.origin_z_mm" in str(found["bed.height_mm"].hint)


def test_a_bed_too_wide_and_too_high_is_told_both() -> None:
    assert set(problems(bed__height_mm=1400.0, bed__radius_mm=600.0)) == {"bed.height_mm", "bed.radius_mm"}


def test_a_bed_wider_than_the_pulleys() -> None:
    """The lower attachments leave the triangle of the pulleys at 838 / 2 mm."""
    found = problems(bed__radius_mm=500.0)
    assert found["bed.radius_mm"].limit == pytest.approx(419.0, abs=0.5)
    hint = re.search(r"up to ([\d.]+) would", str(found["bed.radius_mm"].hint))
    assert hint
    assert problems(bed__radius_mm=float(hint[1])) == {}


def test_a_bed_as_wide_as_the_hall() -> None:
    """Its grid meets a pulley's axis on the way."""
    found = problems(bed__radius_mm=4 * 838.0)
    assert found["bed.radius_mm"].limit == pytest.approx(419.0, abs=0.5)


def test_a_bed_beside_the_machine() -> None:
    found = problems(bed__origin_x_mm=2000.0, bed__radius_mm=50.0)
    assert "towards the axis" in str(found["bed.radius_mm"].hint)


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"sliders__travel_max_mm": 500.0}, "travel_max_mm"),
        ({"sliders__travel_min_mm": -600.0}, "travel_min_mm"),
    ],
)
def test_a_bed_beyond_the_sliders(values: dict[str, float], key: str) -> None:
    problem = problems(**values)[f"sliders.{key}"]
    assert abs(float(problem.value or 0)) > abs(float(problem.limit or 0))
    assert re.search(r"slider [1-6] goes to", problem.message)
    for bed, size in re.findall(r"a bed\.(\w+) up to ([\d.]+) would do", str(problem.hint)):
        assert problems(**values, **{f"bed__{bed}": float(size)}) == {}
        assert problems(**values, **{f"bed__{bed}": float(size) + 2.0}) != {}


def test_a_travel_no_smaller_bed_helps() -> None:
    found = problems(bed__origin_z_mm=1000.0, bed__height_mm=200.0, sliders__travel_max_mm=100.0)
    assert "does not help" in str(found["sliders.travel_max_mm"].hint)


def test_the_policy_moves_the_upper_sliders() -> None:
    """A travel that does with a constant offset, and not with the upper platform where it is best."""
    shut = {"sliders__travel_min_mm": -375.0}
    values = {"bed__radius_mm": 150.0, "bed__height_mm": 350.0}
    fixed = problems(**shut, **values)
    assert fixed == {}
    table = read_table(find("paper-wide"))
    for place, value in {**shut, **values}.items():
        section, key = place.split("__")
        table[section][key] = value
    table["spring"]["policy"] = "free"
    profile, found = validate(table)
    assert found == []
    told = inconsistencies(profile)
    assert [problem.key for _, problem in told] == ["sliders.travel_min_mm"]
    assert "spring.policy" in told[0][0]
