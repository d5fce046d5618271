"""Material profiles: complete, strict, and put into a machine by name."""

import json

import numpy as np
import pytest

from cdhr_host.errors import ProfileError
from cdhr_host.extrusion import flow_law
from cdhr_host.pipeline import check_profile, open_profile
from cdhr_host.profile import (
    Clay,
    described,
    find,
    find_material,
    material_names,
    read_material,
    read_table,
    with_material,
)

KEYS = [info.alias or name for name, info in Clay.model_fields.items()]
SOFT = {
    "name": "soft",
    "source": "made up",
    "example": True,
    "model": "herschel-bulkley",
    "yield_stress_pa": 500.0,
    "consistency_pa_s_n": 250.0,
    "index": 0.5,
    "density_kg_m3": 1850.0,
    "open_dead_ms": 120.0,
    "close_dead_ms": 80.0,
    "line_lag_ms": 60.0,
    "compliance_mm3_kpa": 4.0,
}


@pytest.fixture
def material(tmp_path):
    """A material file of SOFT with changes (None leaves a key out) -> a path."""

    def write(**changes):
        rows = [
            f"{key} = {json.dumps(value)}" for key, value in (SOFT | changes).items() if value is not None
        ]
        path = tmp_path / "soft.toml"
        path.write_text("[clay]\n" + "\n".join(rows) + "\n")
        return str(path)

    return write


def test_soft_has_every_key():
    assert list(SOFT) == KEYS


def test_named_material_becomes_the_section_clay(material):
    profile = open_profile("paper", material())
    assert profile.clay.yield_stress == 500.0
    assert profile.clay.open_dead == pytest.approx(0.12)
    assert profile.clay.compliance == pytest.approx(4e-12)
    assert open_profile("paper").clay == Clay()


def test_machine_may_name_its_material(material, tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(find("paper").read_text().replace('material = ""', f'material = "{material()}"'))
    assert open_profile(str(path)).clay.name == "soft"
    assert open_profile(str(path), material(name="other")).clay.name == "other"


def test_opened_profile_is_complete_in_itself(material):
    rows = {(section, key): value for section, key, value, _ in described(open_profile("paper", material()))}
    assert {key: rows["clay", key] for key in KEYS} == pytest.approx(SOFT)
    assert rows["extruder", "material"] == ""


def test_every_problem_of_a_material_at_once(material):
    path = material(index=9.0, yield_stress_pa="soft", density_kg_m3=None, yeild_stress_pa=1.0)
    with pytest.raises(ProfileError) as caught:
        open_profile("paper", path)
    found = {problem.key: problem for problem in caught.value.problems}
    assert set(found) == {
        "clay.index",
        "clay.yield_stress_pa",
        "clay.density_kg_m3",
        "clay.yeild_stress_pa",
    }
    assert all(problem.message.startswith(f"material {path}: ") for problem in found.values())
    assert found["clay.yeild_stress_pa"].hint == "did you mean 'yield_stress_pa'?"
    assert found["clay.index"].limit == 2
    assert "density" in found["clay.density_kg_m3"].hint


def test_material_file_alone_is_read_as_strictly(material):
    assert read_material(material()).clay.name == "soft"
    with pytest.raises(ProfileError, match=r"clay\.index = 9\.0"):
        read_material(material(index=9.0))


def test_other_sections_are_refused(material):
    path = material()
    with open(path, "a") as file:
        file.write("[extruder]\nnozzle_diameter_mm = 2.0\n")
    with pytest.raises(ProfileError, match="unknown key extruder") as caught:
        read_material(path)
    assert caught.value.problems[0].hint == "known here: clay"


def test_unknown_material_names_the_nearest(monkeypatch, tmp_path, material):
    material()
    monkeypatch.setattr("cdhr_host.profile.materials.material_folder", lambda: tmp_path)
    assert find_material("soft") == tmp_path / "soft.toml"
    with pytest.raises(ProfileError, match="no material 'sfot'") as caught:
        open_profile("paper", "sfot")
    assert caught.value.problems[0].hint == "did you mean 'soft'?"


def test_two_sources_of_the_clay_are_refused(material):
    table = read_table(find("paper"))
    table["extruder"]["material"] = material()
    table["clay"] = {"index": 0.3}
    _, problems = with_material(table)
    assert [problem.key for problem in problems] == ["extruder.material"]


def test_clay_that_the_air_cannot_push_is_refused(material):
    _, problems = check_profile("paper", material(yield_stress_pa=8000.0))
    (problem,) = problems
    threshold = 4 * 8000 * (20 / 5 + 150 / 40) / 1000
    assert f"above {threshold:g} kPa" in problem.message
    assert problem.limit == pytest.approx(8000 * 200 / threshold)


@pytest.mark.parametrize("name", material_names())
def test_installed_materials_are_sound_and_can_be_pushed(name):
    """A 5 mm bead at 20 mm/s, 250 mm³/s, within the 0.2 MPa of the paper."""
    profile = open_profile("paper", name)
    law = flow_law(profile.extruder, profile.clay)
    assert law.threshold < law.pressure(np.array(250e-9)) < 0.85 * profile.extruder.pressure_max
    assert profile.clay.source


def test_examples_say_so():
    assert set(material_names()) >= {"earthenware", "porcelain", "stoneware"}
    for path in material_names().values():
        clay = read_material(str(path)).clay
        assert clay.example == path.read_text().startswith("# An example, not your clay")


def test_earthenware_follows_its_published_viscosities():
    clay = read_material("earthenware").clay
    for rpm, viscosity in ((1, 828.0), (5, 202.4), (50, 40.4)):
        rate = 0.25 * rpm
        stress = clay.yield_stress + clay.consistency * rate**clay.index
        assert stress / rate == pytest.approx(viscosity, rel=0.01)
