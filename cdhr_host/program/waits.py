"""Words that stand still, talk to the operator, end the program or do nothing here."""

import re
from dataclasses import replace
from typing import Final

from cdhr_host.errors import Problem
from cdhr_host.program.block import Block
from cdhr_host.program.run import Run
from cdhr_host.units import MS
from cdhr_host.values import Dwell, Notice, Pause, Stop

_M118_OPTIONS: Final = re.compile(r"(?:[AEP]\d+\s+)*", re.IGNORECASE)


def dwell(run: Run, block: Block) -> None:
    """G4: P in ms, S in s; S counts when both are there, as in Marlin."""
    for word in block.words:
        if (word.value or 0.0) < 0:
            message = f"G4 {word.letter}{word.value:g} is a negative time"
            run.refuse_word(block, word.letter, message, "0", "P is in ms, S in s")
            return
    p = block.get("P")
    if "P" in block and "S" in block:
        run.warn("G4 PS", block.line, f"G4 has both P and S: S{block.get('S'):g} seconds count")
    elif 0 < p < 1:
        run.warn("G4 P", block.line, f"G4 P{p:g} is {p:g} ms; if seconds are meant write S{p:g}")
    duration = block.get("S") if "S" in block else p * MS
    run.emit(Dwell(block.line, duration) if duration else Stop(block.line))


def stop(run: Run, block: Block) -> None:
    """M400."""
    run.emit(Stop(block.line))


def hold(run: Run, block: Block) -> None:
    """M84, M18: a cable machine that lets go drops the nozzle."""
    run.emit(Stop(block.line))
    run.warn("hold", block.line, f"{block.code}: motors stay on, they hold the cables' tension")


def pause(run: Run, block: Block) -> None:
    """M0, M1."""
    run.emit(Pause(block.line, block.text or block.code))


def change(run: Run, block: Block) -> None:
    """M600, M601: where the nozzle waits, and how, is the profile's."""
    if block.words:
        letters = " ".join(word.letter for word in block.words)
        text = f"{block.code}: {letters} ignored, where the nozzle waits comes from [job] of the profile"
        run.warn(block.code, block.line, text)
    run.emit(Pause(block.line, "M600: change the clay" if block.code == "M600" else block.code))


def end(run: Run, block: Block) -> None:
    """M2, M30."""
    if block.text:
        run.refuse(
            Problem(
                "word",
                f"{block.code} '{block.text}': this machine has no files to delete",
                block.line,
                block.column,
                hint=f"{block.code} alone ends the program",
            )
        )
        return
    run.emit(Stop(block.line))
    run.modal = replace(run.modal, ended=True)


def display(run: Run, block: Block) -> None:
    """M117, M118."""
    skip = _M118_OPTIONS.match(block.text) if block.code == "M118" else None
    run.emit(Notice(block.line, "display", block.text[skip.end() if skip else 0 :]))


def heater(run: Run, block: Block) -> None:
    """M104, M109, M140, M190: there is nothing to heat and nothing to wait for."""
    if block.get("S") > 0 or block.get("R") > 0:
        run.warn("heater", block.line, f"{block.code}: this machine has no heater, temperatures are ignored")


def limits(run: Run, block: Block) -> None:
    """M92, M201, M203, M204, M205: the machine's limits come from the profile only."""
    run.warn(block.code, block.line, f"{block.code} is ignored: the machine's limits come from the profile")


def nothing(run: Run, block: Block) -> None:
    """Words that other machines need."""
