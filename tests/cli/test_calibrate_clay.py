"""``cdhr calibrate clay``: what a potter types, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner, Result

from cdhr_host.cli.app import app
from cdhr_host.cli.measurements import read_measurements
from cdhr_host.errors import ProfileError
from cdhr_host.extrusion import flow_law
from cdhr_host.extrusion.identify import bead_section
from cdhr_host.pipeline import open_profile
from cdhr_host.profile import Clay, read_material

TRUE = Clay(model="herschel-bulkley", yield_stress_pa=1700.0, consistency_pa_s_n=1000.0, index=0.35)
LAW = flow_law(open_profile("paper").extruder, TRUE)
PRESSURES = np.array([64.0, 72, 80, 90, 100, 110, 120, 130, 145])
GCODE = Path(__file__).parents[2] / "gcode"


def cdhr(*words: object) -> Result:
    return CliRunner().invoke(app, ["calibrate", "clay", *map(str, words)])


@pytest.fixture
def cups(tmp_path: Path) -> Path:
    """Weighings of a clay of 1900 kg/m³, read to 0.01 g, with 2 % of noise."""
    noise = 1 + 0.02 * np.random.default_rng(4).standard_normal(len(PRESSURES))
    grams = LAW.flow(PRESSURES * 1e3) * noise * 1900 * 1e3 * 30
    path = tmp_path / "cups.csv"
    rows = [f"{p:g},{g:.2f},30" for p, g in zip(PRESSURES, grams, strict=True)]
    path.write_text("# Tuesday\npressure_kpa,mass_g,time_s\n" + "\n".join(rows) + "\n")
    return path


def test_weighings_become_a_material(cups: Path, tmp_path: Path) -> None:
    target, picture = tmp_path / "mine.toml", tmp_path / "fit.png"
    result = cdhr(cups, "--plot", picture, "--write", target)
    assert result.exit_code == 0, result.output
    assert "yield_stress_pa" in result.stdout
    assert "95 %" in result.stdout
    assert f"print with --material {target}" in result.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
    clay = read_material(str(target)).clay
    assert (clay.name, clay.example, clay.model) == ("mine", False, "herschel-bulkley")
    assert [clay.yield_stress, clay.consistency, clay.index] == pytest.approx([1700, 1000, 0.35], rel=0.2)
    assert open_profile("paper", str(target)).clay == clay
    again = cdhr(cups, "--write", target)
    assert again.exit_code == 2
    assert "--force replaces it" in again.stderr
    assert cdhr(cups, "--write", target, "--force").exit_code == 0


def test_intervals_hold_the_truth(cups: Path) -> None:
    record = json.loads(cdhr(cups, "--json").stdout)
    for key, truth in (("yield_stress_pa", 1700), ("consistency_pa_s_n", 1000), ("index", 0.35)):
        estimate = record["estimates"][key]
        assert abs(estimate["value"] - truth) < 3 * estimate["sigma"]
        low, high = estimate["interval_95"]
        assert low < estimate["value"] < high
    assert record["threshold_kpa"] == pytest.approx(LAW.threshold / 1e3, rel=0.1)
    assert len(record["weighings"]["flow_mm3_s"]) == len(PRESSURES)
    assert record["written"] is None


def test_lines_under_a_calliper_say_the_same(tmp_path: Path) -> None:
    """Widths of beads 2.5 mm high, to 0.01 mm, whose sections carry the clay's flow."""
    flow, height = LAW.flow(PRESSURES * 1e3), 2.5e-3
    speed = np.round(flow / bead_section(np.array(6e-3), np.array(height)) * 1e3, 1) / 1e3
    width = (flow / speed - np.pi * height**2 / 4) / height + height
    rows = [
        f"{p:g};{v * 1e3:g};{w * 1e3:.2f};2,5".replace(".", ",")
        for p, v, w in zip(PRESSURES, speed, width, strict=True)
        if v > 0
    ]
    path = tmp_path / "lines.csv"
    path.write_text("pressure_kpa;speed_mm_s;width_mm;height_mm\n" + "\n".join(rows))
    record = json.loads(cdhr(path, "--json").stdout)
    found = [record["estimates"][key]["value"] for key in ("yield_stress_pa", "consistency_pa_s_n", "index")]
    assert found == pytest.approx([1700, 1000, 0.35], rel=0.03)


def test_steps_alone_keep_the_clays_curve(tmp_path: Path) -> None:
    from cdhr_host.plant.clay import Clay as Simulated
    from cdhr_host.plant.clay import Paste

    period = 4e-3
    spans = [s for k in range(6) for s in ((0.0, 1.0), ((100e3, 150e3)[k % 2], 2.0))]
    command = np.concatenate([np.full(round(t / period), p) for p, t in [*spans, (0.0, 1.5)]])
    stoneware = open_profile("paper", "stoneware")
    plant = Simulated(Paste(flow_law(stoneware.extruder, stoneware.clay), 0.08, 0.06, 0.2, 0.12), period)
    _, _, flow = plant.step(plant.standing(), np.arange(len(command)), command)
    grams = 1950e3 * period * np.concatenate(([0.0], np.cumsum(flow)[:-1]))
    rows = zip((period * np.arange(len(command)))[::10], command[::10] / 1e3, grams[::10], strict=True)
    path, target = tmp_path / "steps.csv", tmp_path / "mine.toml"
    path.write_text("t_s,pressure_kpa,mass_g\n" + "".join(f"{t:g},{p:g},{g:.4f}\n" for t, p, g in rows))
    result = cdhr(path, "--material", "stoneware", "--write", target, "--plot", tmp_path / "steps.svg")
    assert result.exit_code == 0, result.output
    clay = read_material(str(target)).clay
    assert [clay.open_dead, clay.close_dead, clay.line_lag] == pytest.approx([0.2, 0.12, 0.06], abs=0.01)
    assert clay.yield_stress == stoneware.clay.yield_stress


@pytest.mark.parametrize("by", ["cups", "lines"])
def test_pattern_can_be_printed_and_its_table_wants_filling_in(by: str, tmp_path: Path) -> None:
    pattern, options = tmp_path / "try.gcode", ("--profile", "paper-wide", "--material", "stoneware")
    result = cdhr("--pattern", pattern, "--by", by, *options)
    assert result.exit_code == 0, result.output
    assert "--profile paper-wide --material stoneware" in result.stderr
    proof = CliRunner().invoke(app, ["dry-run", str(pattern), *options])
    assert "can be printed" in proof.stdout, proof.output
    assert "slowed down" not in proof.output
    unfilled = cdhr(pattern.with_suffix(".csv"))
    assert unfilled.exit_code == 3
    assert f"{pattern.with_suffix('.csv')}:2: error: " in unfilled.stderr
    assert "is empty: fill it in" in unfilled.stderr
    again = cdhr("--pattern", pattern, *options)
    assert again.exit_code == 2
    assert "may hold your measurements" in again.stderr


@pytest.mark.parametrize("by", ["cups", "lines"])
def test_shipped_patterns_are_what_the_command_writes(by: str, tmp_path: Path) -> None:
    pattern = tmp_path / f"clay_{by}.gcode"
    assert (
        cdhr("--pattern", pattern, "--by", by, "-p", "paper-wide", "--material", "stoneware").exit_code == 0
    )
    assert pattern.read_text() == (GCODE / pattern.name).read_text()


def test_pressures_of_the_pattern(tmp_path: Path) -> None:
    asked = cdhr("--pattern", tmp_path / "a.gcode", "--pressures", "80,120", "--material", "stoneware")
    assert asked.exit_code == 0
    assert (tmp_path / "a.csv").read_text().splitlines()[1:] == ["80,,60", "120,,60"]
    for pressures, wrong in (
        ("20", "moves above 62 kPa"),
        ("250", "gives 200 kPa"),
        ("a,b", "numbers in kPa"),
    ):
        result = cdhr("--pattern", tmp_path / "b.gcode", "--pressures", pressures, "--material", "stoneware")
        assert result.exit_code == 2
        assert wrong in result.stderr


def test_neither_measurements_nor_pattern(tmp_path: Path) -> None:
    result = cdhr()
    assert result.exit_code == 2
    assert "hint: cdhr calibrate clay --pattern" in result.stderr
    assert cdhr(tmp_path / "no.csv").exit_code == 3


@pytest.mark.parametrize(
    ("text", "wrong", "hint"),
    [
        (
            "presure_kpa,mass_g,time_s\n1,2,3\n",
            "unknown column 'presure_kpa'",
            "did you mean 'pressure_kpa'?",
        ),
        ("pressure_kpa,mass_g\n1,2\n", "are no measurement", "weighings: pressure_kpa, mass_g, time_s"),
        ("", "has no rows", "column names"),
        ("pressure_kpa,mass_g,time_s\n", "no measurements below", None),
    ],
)
def test_tables_that_are_none(text: str, wrong: str, hint: str | None, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text)
    with pytest.raises(ProfileError, match=wrong) as caught:
        read_measurements(path)
    assert hint is None or hint in str(caught.value.problems[0].hint)


def test_every_bad_row_at_once(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("pressure_kpa,mass_g,time_s\n90,x,20\n# noise\n95,3\n100,4,0\n110,-2,20\n120,inf,20\n")
    with pytest.raises(ProfileError) as caught:
        read_measurements(path)
    assert [(problem.line, problem.message.split(" ")[0]) for problem in caught.value.problems] == [
        (2, "mass_g"),
        (4, "2"),
        (5, "time_s"),
        (6, "mass_g"),
        (7, "mass_g"),
    ]


def test_time_must_not_run_back(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("t_s,pressure_kpa,mass_g\n0,0,0\n2,100,0\n1,0,3\n")
    result = cdhr(path, "--material", "stoneware")
    assert result.exit_code == 3
    assert "t_s = 1 comes after 2" in result.stderr


def printed(pattern: Path, profile: str, log: Path) -> tuple[np.ndarray, ...]:
    """Run a pattern on the simulated machine -> t, line, command in kPa, g of clay so far."""
    words = ["stream", str(pattern), "-p", profile, "--yes", "--speed", "1000", "--log", str(log)]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    names = ("t_s", "line", "pressure_kpa", "deposited_mm3_s")
    t, line, command, deposited = (pq.read_table(log)[name].to_numpy() for name in names)
    laid = np.concatenate(([0.0], np.cumsum(deposited)[:-1])) * 1.95e-3 * np.diff(t[:2])
    return t, line, command, laid


@pytest.fixture
def unled(tmp_path: Path) -> str:
    """paper-wide with stoneware, the air not led: its commands step."""
    path = tmp_path / "unled.toml"
    shown = CliRunner().invoke(app, ["profile", "show", "paper-wide", "--material", "stoneware"]).stdout
    path.write_text(shown.replace('lead = "identified"', 'lead = "off"'))
    return str(path)


def test_cups_of_the_simulated_machine_tell_its_clay(unled: str, tmp_path: Path) -> None:
    """Pattern, print, scale, fit: the whole way, each piece of it the user's."""
    pattern = tmp_path / "cups.gcode"
    assert cdhr("--pattern", pattern, "-p", unled, "--pressures", "85,105,120,135,150").exit_code == 0
    _, line, _, laid = printed(pattern, unled, tmp_path / "run.parquet")
    text = pattern.read_text().splitlines()
    pushes = [number for number, said in enumerate(text, 1) if said.startswith("G1 E")]
    ends = [laid[line < later][-1] for later in [*pushes[1:], len(text)]]
    rows = pattern.with_suffix(".csv").read_text().splitlines()
    filled = [row.replace(",,", f",{g:.3f},") for row, g in zip(rows[1:], np.diff([0.0, *ends]), strict=True)]
    pattern.with_suffix(".csv").write_text("\n".join([rows[0], *filled]))
    record = json.loads(cdhr(pattern.with_suffix(".csv"), "-p", unled, "--json").stdout)
    found = [record["estimates"][key]["value"] for key in ("yield_stress_pa", "consistency_pa_s_n", "index")]
    assert found == pytest.approx([2000, 1200, 0.3], rel=0.05)


def test_steps_of_the_simulated_machine_tell_its_delays(unled: str, tmp_path: Path) -> None:
    pattern = tmp_path / "steps.gcode"
    led = cdhr("--pattern", pattern, "--by", "steps", "-p", "paper-wide", "--material", "stoneware")
    assert led.exit_code == 2
    assert 'lead = "off"' in led.stderr
    assert cdhr("--pattern", pattern, "--by", "steps", "-p", unled).exit_code == 0
    t, _, command, laid = printed(pattern, unled, tmp_path / "run.parquet")
    rows = zip(t[::10], command[::10], laid[::10], strict=True)
    table = tmp_path / "steps.csv"
    table.write_text("t_s,pressure_kpa,mass_g\n" + "".join(f"{a:.3f},{p:.2f},{g:.3f}\n" for a, p, g in rows))
    record = json.loads(cdhr(table, "-p", unled, "--json").stdout)
    keys = ("open_dead_ms", "close_dead_ms", "line_lag_ms")
    assert [record["estimates"][key]["value"] for key in keys] == pytest.approx([110, 110, 60], abs=25)
    assert record["steps"]["gain"] == pytest.approx([1, 1, 1], abs=0.02)
    assert record["doubts"] == []


def test_air_that_does_not_step_is_refused(tmp_path: Path) -> None:
    t = np.arange(0, 10, 0.05)
    ramp = np.where(t < 8, np.round(80 + 10 * t, 1), 0.0)
    path = tmp_path / "t.csv"
    rows = zip(t, ramp, t, strict=True)
    path.write_text("t_s,pressure_kpa,mass_g\n" + "".join(f"{a:.2f},{p},{g}\n" for a, p, g in rows))
    result = cdhr(path, "--material", "stoneware")
    assert result.exit_code == 3
    assert "different pressures" in result.stderr
