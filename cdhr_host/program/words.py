"""The table of known words: what each may be followed by, what it means here, what it does.

The dialect is RepRap's as Marlin speaks it, with these choices:

* A program starts as G21 G90 M82, E 0, with no F. G0 before any F goes at the machine's
  greatest speed; G1 before any F is refused. F is shared by G0 and G1 and may exceed the
  machine's speed: the planner is slower then, and one warning says so.
* G90 and G91 are for X Y Z; E follows M82 and M83 only.
* Arcs lie in the plane of G17, G18 or G19 and go clockwise as seen from its normal's positive
  end; I J K count from the start. Curves (G5, G5.1) are LinuxCNC's, with E and F.
* G61 and G61.1 are the same, an exact stop at the end of every move; a program starts in G64.
* Clay never goes back: negative E is a debt that later E pays first; the excess is clay.
* G4 P is in ms and S in s; G92 never moves the machine's limits; G28 is the machine as a whole.
* Air words hold a pressure along the moves that follow, whatever the speed, or lay the profile's bead;
  [air] says which words and what.
* There is no heater, no second nozzle, no file store, and motors never let go.
* What is not in the table is refused, and so is a letter that its row does not list.
"""

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from cdhr_host.errors import Problem
from cdhr_host.program import air, settings, waits
from cdhr_host.program.arc import arc
from cdhr_host.program.block import Block
from cdhr_host.program.reference import reference
from cdhr_host.program.run import Run
from cdhr_host.program.spline import cubic, quadratic
from cdhr_host.program.straight import row_of


@dataclass(frozen=True, slots=True)
class KnownWord:
    """One row of the table."""

    code: str
    letters: str
    """letters that may follow"""
    meaning: str
    act: Callable[[Run, Block], None]
    needs: str = ""
    """letters that must follow"""
    bare: bool = False
    """letters may stand without a number"""
    text: bool = False
    """what follows is free text"""


def straight(run: Run, block: Block) -> None:
    """G0, G1: the row of the line, beside those of the fast reader."""
    digits = {word.letter: word.digits for word in block.words}
    run.straight([row_of(block.code, digits)], [block.line], block.column)


_TABLE: Final = (
    KnownWord(
        "G0",
        "XYZEF",
        "straight move, like G1; before the first F at the greatest speed, and without E",
        straight,
    ),
    KnownWord(
        "G1", "XYZEF", "straight move; with E alone clay is pushed at rest, F being its rate", straight
    ),
    KnownWord("G2", "XYZIJKREF", "clockwise arc or helix by centre (I J K from the start) or radius R", arc),
    KnownWord("G3", "XYZIJKREF", "counter-clockwise arc or helix", arc),
    KnownWord("G4", "PS", "stand still, air off: P in ms, S in s; without a time an exact stop", waits.dwell),
    KnownWord(
        "G5",
        "XYZIJPQEF",
        "cubic curve in XY: I J from the start to the first control point, P Q from the end to the second",
        cubic,
        needs="PQ",
    ),
    KnownWord("G5.1", "XYZIJEF", "quadratic curve in XY: I J from the start to the control point", quadratic),
    KnownWord("G10", "", "firmware retraction: no motion here", waits.nothing),
    KnownWord("G11", "", "end of firmware retraction: no motion here", waits.nothing),
    KnownWord("G17", "", "arcs lie in the XY plane (default), Z is the helix", settings.plane),
    KnownWord("G18", "", "arcs lie in the ZX plane (I K), Y is the helix", settings.plane),
    KnownWord("G19", "", "arcs lie in the YZ plane (J K), X is the helix", settings.plane),
    KnownWord("G20", "", "numbers are inches (E cubic inches when it is a volume)", settings.units),
    KnownWord("G21", "", "numbers are millimetres (default)", settings.units),
    KnownWord("G28", "XYZWO", "to the reference pose as a whole, above the print", reference, bare=True),
    KnownWord("G61", "", "exact stop at the end of every move, until G64", settings.exact),
    KnownWord("G61.1", "", "like G61", settings.exact),
    KnownWord(
        "G64",
        "P",
        "corners within P (0.01 to 50 mm) of the path; alone the profile's (default)",
        settings.blend,
    ),
    KnownWord("G90", "", "X Y Z are absolute (default); E follows M82 and M83 only", settings.distances),
    KnownWord("G91", "", "X Y Z are relative", settings.distances),
    KnownWord("G92", "XYZE", "the present position gets these numbers; alone, zeros", settings.offsets),
    KnownWord("M0", "", "pause until the operator goes on, with a message", waits.pause, text=True),
    KnownWord("M1", "", "pause like M0", waits.pause, text=True),
    KnownWord("M2", "", "end of the program; text after it is ignored", waits.end),
    KnownWord("M3", "S", "air as [air] spindle_words says: S0-255, alone fully open", air.output),
    KnownWord("M5", "", "closes what M3 opened", air.output),
    KnownWord("M17", "XYZE", "motors on: they always are", waits.nothing, bare=True),
    KnownWord("M18", "SXYZE", "like M84", waits.hold, bare=True),
    KnownWord("M30", "", "end of the program; with a file name refused", waits.end, text=True),
    KnownWord("M42", "PS", "air as [air] pin_words says: P pin, S0-255", air.output, needs="PS"),
    KnownWord("M73", "PRQSCD", "the slicer's own progress: accepted", waits.nothing),
    KnownWord("M82", "", "E is absolute (default)", settings.e_distances),
    KnownWord("M83", "", "E is relative", settings.e_distances),
    KnownWord("M84", "SXYZE", "exact stop; motors stay on and hold the cables", waits.hold, bare=True),
    KnownWord("M92", "XYZE", "steps per unit: ignored with a warning", waits.limits),
    KnownWord("M104", "STRPI", "heater: ignored, one warning when not 0", waits.heater),
    KnownWord("M105", "T", "temperature report: accepted", waits.nothing),
    KnownWord("M106", "PS", "air as [air] fan_words says: S0-255, alone fully open", air.output),
    KnownWord("M107", "P", "closes what M106 opened", air.output),
    KnownWord("M109", "STRPI", "like M104, without waiting", waits.heater),
    KnownWord("M110", "N", "line number: accepted", waits.nothing),
    KnownWord("M117", "", "text for the display", waits.display, text=True),
    KnownWord("M118", "", "text for the display", waits.display, text=True),
    KnownWord("M126", "PS", "air as [air] valve_words says: S0-255, alone fully open", air.output),
    KnownWord("M127", "P", "closes what M126 opened", air.output),
    KnownWord("M140", "STRPI", "like M104", waits.heater),
    KnownWord("M163", "SP", "mixing: accepted", waits.nothing),
    KnownWord("M164", "S", "mixing: accepted", waits.nothing),
    KnownWord("M190", "STRPI", "like M104, without waiting", waits.heater),
    KnownWord("M200", "DST", "D: E is mm³; D0 or S0: E is mm of filament", settings.volumetric),
    KnownWord("M201", "XYZEFTS", "acceleration limits: ignored with a notice", waits.limits),
    KnownWord("M203", "XYZETS", "speed limits: ignored with a notice", waits.limits),
    KnownWord("M204", "PRTS", "accelerations: ignored with a notice", waits.limits),
    KnownWord("M205", "XYZESTBJ", "corner limits: ignored with a notice", waits.limits),
    KnownWord("M220", "S", "speed factor, 1 to 300 percent", settings.factor, needs="S"),
    KnownWord("M221", "ST", "flow factor, 1 to 300 percent", settings.factor, needs="S"),
    KnownWord("M302", "PST", "cold extrusion: clay always is", waits.nothing),
    KnownWord("M380", "S", "opens the air as [air] solenoid_words says", air.output),
    KnownWord("M381", "S", "closes what M380 opened", air.output),
    KnownWord("M400", "", "exact stop", waits.stop),
    KnownWord(
        "M600", "BELRTUXYZ", "pause to change the clay; the nozzle waits where [job] says", waits.change
    ),
    KnownWord("M601", "XYZ", "pause; the nozzle waits where [job] says", waits.change),
    KnownWord("T0", "", "the only nozzle", waits.nothing),
)

WORDS: Final[dict[str, KnownWord]] = {row.code: row for row in _TABLE}

REASONS: Final = {
    "G5.2": "of the curves only G5 and G5.1 are there: write NURBS as cubics (G5)",
    "G5.3": "of the curves only G5 and G5.1 are there: write NURBS as cubics (G5)",
    "G41": "there is no cutter to compensate: let the slicer offset the path",
    "G42": "there is no cutter to compensate: let the slicer offset the path",
    "G43": "there is one nozzle and no tool length: use G92 Z",
    "G95": "F is in units per minute",
    "G96": "F is in units per minute",
    "M4": "the air has one direction: use M3",
    "M6": "there is one nozzle and no tool to change",
}
"""why some words are not there, and what to write instead"""


def unknown(code: str, line: int, column: int) -> Problem:
    """The problem of a word that is not in the table, with the nearest that is."""
    hint = REASONS.get(code)
    if hint is None and code[0] == "T":
        hint = "this machine has one nozzle: only T0"
    if hint is None:
        hint = f"did you mean {nearest(code)}?"
    kind = "unknown" if code not in REASONS else "unsupported"
    return Problem("word", f"{kind} word {code}", line, column, value=code, hint=hint)


def _edits(one: str, other: str) -> int:
    """Letters to be put in, taken out or replaced."""
    steps = difflib.SequenceMatcher(None, one, other).get_opcodes()
    return sum(max(i1 - i0, j1 - j0) for what, i0, i1, j0, j1 in steps if what != "equal")


def nearest(code: str) -> str:
    """The known word most like this one, by letter, then by spelling, then by number."""
    number = float(code[1:] or 0)

    def unlike(known: str) -> tuple[bool, float, int, float]:
        alike = difflib.SequenceMatcher(None, known[1:].zfill(4), code[1:].zfill(4)).ratio()
        return known[0] != code[0], -alike, _edits(known, code), abs(float(known[1:]) - number)

    return min(WORDS, key=unlike)
