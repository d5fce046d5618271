"""E: volumes, retraction debt, priming, M200, M221; air words."""

import math

import pytest
from program_reading import ALL_AIR, column, only_problem, profile, read, shown, warnings

from cdhr_host.values import Moves, Prime

AREA_175 = math.pi / 4 * 1.75**2


def test_e_is_filament_times_its_cross_section() -> None:
    thick = profile(extruder={"filament_diameter_mm": 1.75})
    assert column(read("G1 X1 E2 F600\n", thick), "clay", 1e-9) == [pytest.approx(2 * AREA_175)]


def test_profile_may_say_cubic_millimetres() -> None:
    volume = profile(extruder={"e_unit": "mm3", "filament_diameter_mm": 1.75})
    commands = read("G1 X1 E2 F600\nM200 D0\nG1 X2 E3\n", volume)
    assert column(commands, "clay", 1e-9) == [2, pytest.approx(AREA_175)]


def test_m200_as_in_marlin() -> None:
    thick = profile(extruder={"filament_diameter_mm": 1.75})
    area_3 = math.pi / 4 * 9
    text = (
        "M83\nG1 F600\nG1 X1 E1\nM200 S1\nG1 X2 E1\nM200 S0\nG1 X3 E1\nM200 D3\nG1 X4 E1\nM200\nG1 X5 E1\n"
        "M200 S0\nG1 X6 E1\nM200 D1.75 S0\nG1 X7 E1\nM200 D0 S1\nG1 X8 E1\nM200 T0 D2\nG1 X9 E1\n"
    )
    expected = [AREA_175, 1, AREA_175, 1, 1, area_3, AREA_175, AREA_175, 1]
    assert column(read(text, thick), "clay", 1e-9) == pytest.approx(expected, abs=1e-8)


def test_m200_diameter_is_not_negative() -> None:
    problem = only_problem("M200 D-1.75\n")
    assert (problem.kind, problem.column) == ("range", 6)


def test_inch_e_is_cubic_when_it_is_a_volume() -> None:
    commands = read("G20\nG1 X1 E1 F60\nM200 D1\nG92 E0\nG1 X2 E1\n")
    assert column(commands, "clay", 1e-9) == pytest.approx([25.4, 25.4**3], rel=1e-9)


def test_travel_with_unchanged_e_lays_nothing() -> None:
    assert column(read("G1 X1 E5 F600\nG1 X2 E5\nG0 X3 E5\nM83\nG1 X4 E0\n"), "clay", 1e-9) == [5, 0, 0, 0]


def test_g0_lays_clay_too() -> None:
    assert column(read("G0 X1 E5 F600\n"), "clay", 1e-9) == [5]


@pytest.mark.parametrize(
    "text",
    [
        "G1 X1 E10 F600\nG1 E4\nG1 X2\nG1 E10\nG1 X3 E12\n",
        "M83\nG1 X1 E10 F600\nG1 E-6\nG1 X2\nG1 E6\nG1 X3 E2\n",
        "G1 X1 E10 F600\nG1 X2 E4\nG1 X3 E12\n",
        "G1 X1 E10 F600\nG92 E0\nG1 X2 E-3\nG91\nG92 E0\nG1 E-3\nG90\nG1 X3 E5\n",
    ],
)
def test_retraction_is_paid_back_first(text: str) -> None:
    commands = read(text)
    assert column(commands, "clay", 1e-9) == [10, 0, 2]
    assert not [item for item in commands if isinstance(item, Prime)]


def test_wipe_leaves_no_crumb_of_clay() -> None:
    text = "G1 X1 E16800.12345 F600\nG1 X2 E16799.1\nG1 X3 E16798.33333\nG1 E16800.12345\nG1 X4 E16801\n"
    assert column(read(text), "clay", 1e-9) == pytest.approx([16800.12345, 0, 0, 0.87655])


def test_priming_pays_the_debt_and_lays_the_rest_at_its_rate() -> None:
    assert shown(read("M83\nG1 E-2 F120\nG1 E5\nM221 S200\nG1 E1\n")) == [
        "3 prime clay 3 at 2",
        "5 prime clay 2 at 2",
    ]


def test_priming_keeps_its_place_between_moves() -> None:
    commands = read("G1 X1 F600\nG1 E5\nG1 X2 E6\nG1 E7\nG1 E8\nG1 X3\n")
    assert shown(commands) == [
        "1 move to 1 0 0 at 10",
        "2 prime clay 5 at 10",
        "3 move to 2 0 0 at 10 clay 1",
        "4 prime clay 1 at 10",
        "5 prime clay 1 at 10",
        "6 move to 3 0 0 at 10",
    ]
    last = commands[-1]
    assert isinstance(last, Moves)
    assert last.start_G.tolist() == [0.002, 0, 0]


def test_volumetric_priming_rate() -> None:
    assert shown(read("M200 D1.75\nG1 E300 F120\n")) == ["2 prime clay 300 at 2"]


def test_flow_factor_scales_clay_not_debt() -> None:
    text = "M83\nM221 S150\nG1 X1 E2 F600\nG1 E-4\nM221 S50\nG1 X2 E6\n"
    assert column(read(text), "clay", 1e-9) == [3, 1]


def test_firmware_retraction_is_no_motion() -> None:
    assert shown(read("G1 X1 E1 F600\nG10\nG0 X2\nG11\nG1 X3 E2\n")) == [
        "1 move to 1 0 0 at 10 clay 1",
        "3 move to 2 0 0 at 10",
        "5 move to 3 0 0 at 10 clay 1",
    ]
    assert "has no word P" in only_problem("G10 P0\n").message


@pytest.mark.parametrize(
    ("opens", "closes", "pressure_kpa"),
    [
        ("M106", "M107", 200),
        ("M106 S127.5", "M106 S0", 100),
        ("M106 P0 S51", "M107 P0", 40),
        ("M3 S255", "M5", 200),
        ("M3", "M5", 200),
        ("M126", "M127", 200),
        ("M126 P0 S51", "M127", 40),
        ("M380", "M381", 200),
        ("M380 S0", "M381 S0", 200),
        ("M42 P4 S255", "M42 P4 S0", 200),
    ],
)
def test_air_words(opens: str, closes: str, pressure_kpa: float) -> None:
    commands = read(f"G1 X1 F600\n{opens}\nG1 X2\nG2 X3 I.5\n{closes}\nG1 X4\n", ALL_AIR)
    air = [line.partition(" air ")[2] for line in shown(commands)]
    assert air == ["", f"{pressure_kpa}", f"{pressure_kpa}", ""]


def test_air_words_of_other_outputs() -> None:
    assert column(read("M106\nM42 P4 S255\nG0 X1\n"), "air") == [0]
    commands = read("M42 P5 S255\nM106 P1\nG0 X1\nM42 P5 S0\n", ALL_AIR)
    assert column(commands, "air") == [0]
    assert warnings(commands) == [
        "M42 P5 is not the air (P4): ignored",
        "M106 P1 is not the air (P0): ignored",
    ]


@pytest.mark.parametrize("line", ["M106 S256", "M3 S-1", "M126 S300", "M42 P4 S400"])
def test_air_level_range(line: str) -> None:
    assert only_problem(line + "\n").limit == "0..255"


def test_pin_needs_both_words() -> None:
    assert "M42 needs S" in only_problem("M42 P4\n").message


def test_rounding_of_e_on_a_travel_is_not_clay() -> None:
    """Absolute E written once with four decimals and once with six, as FullControl does."""
    commands = read("G92 E0\nG1 F120 E39.7473\nG1 F250 Z100 E39.747332\nG1 F1200 X5 E40\n")
    assert column(commands, "clay", 1e-9)[0] == 0
    assert column(commands, "clay", 1e-9)[1] == pytest.approx(0.252668, abs=1e-3)
