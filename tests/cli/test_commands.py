"""The commands as a user meets them: results on standard output, words on standard error, exit codes."""

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from cdhr_host import __version__
from cdhr_host.cli.app import app
from cdhr_host.profile import read_table, validate

GCODE = Path(__file__).resolve().parents[2] / "gcode"
RING = str(GCODE / "paper_ring_double.gcode")
COMMANDS = [
    [],
    ["stream"],
    ["dry-run"],
    ["jog"],
    ["compensation"],
    ["profile"],
    ["profile", "list"],
    ["profile", "show"],
    ["profile", "check"],
    ["generate"],
    *(["generate", name] for name in ("ring", "eq15", "eq35", "eq36")),
]


def cdhr(*arguments: str, stdin: str | None = None) -> Result:
    return CliRunner().invoke(app, list(arguments), input=stdin)


def written(tmp_path: Path, text: str) -> str:
    path = tmp_path / "part.gcode"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_every_command_has_help_with_worked_examples(command: list[str], flag: str) -> None:
    result = cdhr(*command, flag)
    assert result.exit_code == 0
    assert re.search(r"Examples:\n +(cdhr|printf) ", result.stdout)
    assert "\x1b" not in result.stdout


def test_version() -> None:
    assert cdhr("--version").stdout == f"cdhr {__version__}\n"


@pytest.mark.parametrize(
    "arguments", [["strem"], ["dry-run"], ["dry-run", RING, "--rate", "1"], ["jog", "--spede"]]
)
def test_wrong_usage_is_exit_code_2(arguments: list[str]) -> None:
    result = cdhr(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "Traceback" not in result.stderr


def test_a_dry_run_sums_up_what_a_person_wants_to_know() -> None:
    result = cdhr("dry-run", RING)
    assert result.exit_code == 0
    assert f"{RING}: can be printed on paper\n  program    26 lines, 15 moves, 2 layers\n" in result.stdout
    assert "cables 4-6" in result.stdout


def test_a_dry_run_as_json_has_the_keys_of_the_contract() -> None:
    record = json.loads(cdhr("dry-run", RING, "--json").stdout)
    assert record["file"] == RING
    assert (record["lines"], record["moves"], record["ok"], record["problems"]) == (26, 15, True, [])
    assert (record["profile"], record["version"]) == ("paper", __version__)
    assert record["path_mm"] == pytest.approx(1132, abs=1)
    assert record["extruded_mm3"] == pytest.approx(10516.86, abs=0.01)
    assert 50 < record["duration_s"] < 55
    assert record["extremes"]["x_mm"]["max"] == pytest.approx(75, abs=0.25)
    z = record["extremes"]["z_mm"]
    assert (z["min"], z["min_line"], z["max_line"]) == (0, 8, 25)
    assert z["max"] == pytest.approx(25, abs=0.25)


def test_a_program_from_standard_input() -> None:
    record = json.loads(cdhr("dry-run", "-", "--json", stdin="G1 X10 F600\n").stdout)
    assert (record["file"], record["lines"], record["ok"]) == ("<stdin>", 1, True)


def test_what_is_not_understood_is_listed_with_place_and_hint(tmp_path: Path) -> None:
    file = written(tmp_path, "G1 X10 F600\nG1 X1,5\nG1 X2 X3\nG99\n")
    result = cdhr("dry-run", file)
    assert result.exit_code == 4
    assert f"{file}:2:4: error: " in result.stderr
    assert f"{file}:3:7: error: X is given twice" in result.stderr
    assert f"{file}:4:1: error: " in result.stderr
    assert "\nhint: " in result.stderr
    assert result.stdout == ""


def test_what_is_not_understood_as_json(tmp_path: Path) -> None:
    result = cdhr("dry-run", written(tmp_path, "G1 X10 F600\nG99\n"), "--json")
    record = json.loads(result.stdout)
    assert result.exit_code == 4
    assert (record["ok"], record["moves"], record["total_problems"]) == (False, None, 1)
    assert (record["problems"][0]["line"], record["problems"][0]["column"]) == (2, 1)


@pytest.mark.parametrize("command", ["dry-run", "stream"])
def test_what_the_machine_cannot_do_is_refused_before_it_moves(tmp_path: Path, command: str) -> None:
    file = written(tmp_path, "G1 X10 F6000\nG1 X280\n")
    log = tmp_path / "run.csv"
    result = cdhr(command, file, "--log", str(log))
    assert result.exit_code == 5
    assert f"{file}:2: error: cable 4 would carry 13.0" in result.stderr
    assert "more than 12 N\n" in result.stderr
    assert "\nhint: move the part nearer to the axis" in result.stderr
    assert not log.exists()


def test_the_same_program_on_the_wider_machine(tmp_path: Path) -> None:
    result = cdhr("dry-run", written(tmp_path, "G1 X280 F6000\n"), "--profile", "paper-wide")
    assert result.exit_code == 0


def test_motion_problems_as_json(tmp_path: Path) -> None:
    record = json.loads(cdhr("dry-run", written(tmp_path, "G1 X280 F6000\n"), "--json").stdout)
    problem = record["problems"][0]
    assert (problem["line"], problem["kind"], problem["limit"], problem["unit"]) == (1, "force", 12, "N")
    assert problem["value"] > 12


@pytest.mark.parametrize(
    ("log", "words"),
    [("a.txt", ".csv or .parquet"), ("none/a.csv", "no folder"), ("/dev/full", ".csv or .parquet")],
)
def test_a_log_that_cannot_be_written_is_refused_first(tmp_path: Path, log: str, words: str) -> None:
    result = cdhr("dry-run", RING, "--log", str(tmp_path / log))
    assert result.exit_code == 2
    assert words in result.stderr


@pytest.mark.parametrize(("file", "words"), [("none.gcode", "no such file"), (".", "a folder")])
def test_a_file_that_is_none_is_exit_code_2(tmp_path: Path, file: str, words: str) -> None:
    result = cdhr("dry-run", str(tmp_path / file))
    assert result.exit_code == 2
    assert words in result.stderr


CLAYS = ["earthenware", "porcelain", "stoneware"]


def test_profiles_are_listed() -> None:
    assert [line.split()[0] for line in cdhr("profile", "list").stdout.splitlines()[::2]] == [
        "paper",
        "paper-simulation",
        "paper-wide",
        *CLAYS,
    ]
    found = json.loads(cdhr("profile", "list", "--json").stdout)
    assert [row["name"] for row in found["profiles"]] == ["paper", "paper-simulation", "paper-wide"]
    assert [row["name"] for row in found["materials"] if row["example"]] == CLAYS


def test_a_shown_material_is_a_material(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(cdhr("profile", "show", "stoneware").stdout)
    assert cdhr("profile", "check", str(mine)).stdout.startswith(f"{mine}: ok: stoneware")
    shown = json.loads(cdhr("profile", "show", "paper", "--material", str(mine), "--json").stdout)
    assert shown["clay"]["yield_stress_pa"] == 2000
    assert cdhr("profile", "show", "paper", "--material", "stonewear").exit_code == 3


def test_a_shown_profile_is_a_profile(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(cdhr("profile", "show", "paper").stdout)
    profile, problems = validate(read_table(mine))
    original, _ = validate(read_table(GCODE.parent / "profiles" / "paper.toml"))
    assert problems == []
    assert profile == original
    assert cdhr("profile", "check", str(mine)).exit_code == 0


def test_a_shown_profile_as_json() -> None:
    shown = json.loads(cdhr("profile", "show", "paper-wide", "--json").stdout)
    assert shown["forces"]["upper_max_n"] == 60


def test_everything_wrong_with_a_profile_is_told_at_once(tmp_path: Path) -> None:
    text = cdhr("profile", "show", "paper").stdout
    text = text.replace("stiffness_n_mm", "stifness_n_mm").replace(
        "pulley_radius_mm = 11.0", "pulley_radius_mm = -1.0"
    )
    mine = tmp_path / "mine.toml"
    mine.write_text(text)
    result = cdhr("profile", "check", str(mine), "paper")
    assert result.exit_code == 3
    assert "did you mean 'stiffness_n_mm'?" in result.stderr
    assert "geometry.pulley_radius_mm = -1.0" in result.stderr
    assert "paper: ok" in result.stdout


@pytest.mark.parametrize("command", [["dry-run", RING], ["stream", RING], ["jog"], ["profile", "show"]])
def test_an_unknown_profile_is_exit_code_3(command: list[str]) -> None:
    named = ["--profile", "papr"] if command[0] != "profile" else ["papr"]
    result = cdhr(*command, *named)
    assert result.exit_code == 3
    assert "did you mean 'paper'?" in result.stderr


def test_all_installed_profiles_are_sound() -> None:
    result = cdhr("profile", "check")
    assert result.exit_code == 0
    assert result.stdout.count(": ok") == 3 + len(CLAYS)


def test_compensation_shows_what_the_paper_is_about() -> None:
    """physics.md section 9, row 5: Eq. (15) on the simulation column."""
    record = json.loads(cdhr("compensation", "--json").stdout)
    assert record["uncompensated_mm"] == pytest.approx([0.97296, 0.89166, 1.18217], abs=5e-4)
    assert max(record["compensated_mm"]) < 1e-9


def test_compensation_in_words() -> None:
    result = cdhr("compensation", "-t", "36", "-p", "paper", "--step", "0.5")
    assert result.exit_code == 0
    assert "Eq. (36) on paper: flat spiral, 0 <= t < 150 s by 0.5 s" in result.stdout


def test_a_bead_higher_than_wide_is_refused() -> None:
    assert cdhr("generate", "ring", "--bead", "2", "--layer-height", "3").exit_code == 2


def test_a_program_can_go_to_standard_output() -> None:
    assert cdhr("generate", "ring").stdout == Path(RING).read_text()
