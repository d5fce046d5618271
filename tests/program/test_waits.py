"""Dwell, pause, end, messages, layers, and words that do nothing here."""

import pytest
from program_reading import PAPER_WIDE, only_problem, raw, read, shown, warnings

from cdhr_host.program import WORDS, Interpreter


@pytest.mark.parametrize(
    ("line", "expected", "warned"),
    [
        ("G4 P450", "1 dwell 0.45 s", 0),
        ("G04 P2000", "1 dwell 2 s", 0),
        ("G4 S1.5", "1 dwell 1.5 s", 0),
        ("G4", "1 stop", 0),
        ("G4 P0", "1 stop", 0),
        ("G4 P0.15", "1 dwell 0.00015 s", 1),
        ("G4 P500 S2", "1 dwell 2 s", 1),
    ],
)
def test_dwell(line: str, expected: str, warned: int) -> None:
    commands = read(line + "\n")
    assert shown(commands)[-1] == expected
    assert len(warnings(commands)) == warned


def test_where_a_pause_waits_is_the_profiles() -> None:
    commands = read("M600 X10 Y-5 Z20\n")
    assert shown(commands)[-1] == "1 pause 'M600: change the clay'"
    (warning,) = warnings(commands)
    assert "X Y Z ignored" in str(warning)


@pytest.mark.parametrize("line", ["G4 P-5", "G4 S-0.1"])
def test_dwell_is_not_negative(line: str) -> None:
    assert "negative" in only_problem(line + "\n").message


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("M0", "1 pause 'M0'"),
        ("M1 change the clay (slowly) ; comment", "1 pause 'change the clay (slowly)'"),
        ("N3 M0 wait*11", "1 pause 'wait'"),
        ("M600", "1 pause 'M600: change the clay'"),
        ("M601", "1 pause 'M601'"),
        ("M117 Layer 3", "1 display 'Layer 3'"),
        ("M117", "1 display ''"),
        ("m117 voil\u00e0", "1 display 'voil\u00e0'"),
        ("M118 A1 P0 action:pause", "1 display 'action:pause'"),
        ("M400", "1 stop"),
        ("M2", "1 stop"),
        ("M30 ; done", "1 stop"),
    ],
)
def test_words_for_the_operator(line: str, expected: str) -> None:
    assert shown(read(line + "\n")) == [expected]


def test_latin_1_text_is_kept() -> None:
    assert shown(read("M117 voil\u00e0\n".encode("latin-1"))) == ["1 display 'voil\u00e0'"]


def test_m84_holds_the_tension() -> None:
    commands = read("M84\nM84 X Y Z E\nM18 S0\n")
    assert [line for line in shown(commands) if line.endswith("stop")] == ["1 stop", "2 stop", "3 stop"]
    assert warnings(commands) == ["M84: motors stay on, they hold the cables' tension"]


def test_heaters() -> None:
    silent = "M104 S0\nM104 S0 T0\nM109 S0\nM140 S0\nM190 S0\nM105\n"
    assert read("G21\n" + silent) == []
    commands = read("M104 S200\nM109 R180\nM190 S60\n")
    assert warnings(commands) == ["M104: this machine has no heater, temperatures are ignored"]


def test_limits_in_the_file_are_ignored_with_one_notice_each() -> None:
    text = (
        "M201 X9000 Y9000 Z500 E10000\nM203 X500\nM204 P1500 R1500 T1500\nM205 S0 T0\nM204 S800\nM92 E400\n"
    )
    assert [text.split()[0] for text in warnings(read(text))] == ["M201", "M203", "M204", "M205", "M92"]


def test_words_that_do_nothing() -> None:
    text = "M302 P1\nM302\nM17\nM17 X\nT0\nt0\nM73 P10 R5\n"
    text += "M163 S0 P1\nM164 S0\nM110 N0\nN0 M110\nG10\nG11\nG17\n"
    assert read(text) == []


def test_the_file_ends_with_m2_or_m30() -> None:
    commands = read("G1 X1 F600\nM30\n; comment\n\nG1 X2\nG6 what?\n;LAYER:1\nG1 X3")
    assert shown(commands)[:2] == ["1 move to 1 0 0 at 10", "2 stop"]
    assert warnings(commands) == ["the program has ended: line 5 and what follows is ignored"]
    assert warnings(read("M2\n(x) oops\n")) == ["the program has ended: line 2 and what follows is ignored"]
    assert len(shown(read("M2\n; only a comment\n"))) == 1


def test_m30_with_a_name_is_refused() -> None:
    problem = only_problem("M30 model.gco\n")
    assert "model.gco" in problem.message


@pytest.mark.parametrize(
    "marks",
    [
        [";LAYER:0", ";LAYER:1", ";LAYER:2"],
        [";LAYER_CHANGE", ";LAYER_CHANGE", "  ; LAYER_CHANGE"],
        [";LAYER_CHANGE\n;LAYER:0", ";LAYER_CHANGE\n;LAYER:1", ";LAYER_CHANGE"],
        [";LAYER:-2", ";LAYER:-1", ";LAYER:0"],
    ],
)
def test_layers_are_counted_from_one(marks: list[str]) -> None:
    text = "".join(f"{mark}\nG1 X{at} F600\n" for at, mark in enumerate(marks, 1))
    assert [line.split()[1] + line.split()[2] for line in shown(read(text))] == [
        "layer'1'",
        "moveto",
        "layer'2'",
        "moveto",
        "layer'3'",
        "moveto",
    ]


def test_metadata() -> None:
    text = (
        ";FLAVOR:Marlin(Volumetric)\n;LAYER_COUNT:12\n;LAYER_COUNT:many\n;TYPE:Skirt/Brim\n;WIDTH:5.2\n"
        ";HEIGHT:2.5\n;Z:7.5\n;WIDTH:wide\n;Z:nan\n; key = value\n;Z\nG21\nG1 X1 F600 ;TYPE:not alone\n"
    )
    interpreter = Interpreter(PAPER_WIDE)
    list(interpreter.commands([raw(text)]))
    data = interpreter.metadata
    assert (data.flavour, data.layers, data.feature) == ("Marlin(Volumetric)", 12, "Skirt/Brim")
    assert (data.width, data.height, data.z) == pytest.approx((0.0052, 0.0025, 0.0075))


def test_every_row_of_the_table_explains_itself() -> None:
    assert len(WORDS) == 63
    for row in WORDS.values():
        assert row.meaning
        assert row.act.__doc__
        assert set(row.needs) <= set(row.letters)
