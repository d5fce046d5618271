"""Words that change the modal state: units, distances, offsets, E and the factors."""

from dataclasses import replace

from cdhr_host.program.block import Block
from cdhr_host.program.modal import GRID_DIGITS
from cdhr_host.program.run import Run
from cdhr_host.units import INCH, MM
from cdhr_host.values import Blend, Plane

FACTOR_LIMITS = (1.0, 300.0)
"""percent, what M220 and M221 may be set to"""

TOLERANCE_LIMITS = (0.01, 50.0)
"""mm, what G64 P may be set to"""
PLANES = {"G17": Plane.XY, "G18": Plane.ZX, "G19": Plane.YZ}


def units(run: Run, block: Block) -> None:
    """G20, G21."""
    run.flush()
    if block.code == "G20":
        run.warn("inch", block.line, "G20: the numbers that follow are read as inches")
    run.modal = replace(run.modal, unit=INCH if block.code == "G20" else MM)


def distances(run: Run, block: Block) -> None:
    """G90, G91: X Y Z only."""
    run.flush()
    run.modal = replace(run.modal, absolute=block.code == "G90")


def plane(run: Run, block: Block) -> None:
    """G17, G18, G19."""
    run.flush()
    run.modal = replace(run.modal, plane=PLANES[block.code])


def exact(run: Run, block: Block) -> None:
    """G61, G61.1: both stop at the end of every move."""
    run.emit(Blend(block.line, None, exact=True))


def blend(run: Run, block: Block) -> None:
    """G64: corners are taken within P, or within the profile's tolerance when it is alone."""
    if "P" not in block:
        run.emit(Blend(block.line, None, exact=False))
        return
    tolerance = block.get("P") * run.modal.unit
    least, most = TOLERANCE_LIMITS
    if least <= tolerance / MM <= most:
        run.emit(Blend(block.line, tolerance, exact=False))
        return
    message = f"G64 P{block.get('P'):g} is outside {least:g} to {most:g} mm"
    hint = "P is how far the nozzle may leave the drawn path; G61 stops at the end of every move"
    run.refuse_word(block, "P", message, f"{least:g}..{most:g}", hint)


def e_distances(run: Run, block: Block) -> None:
    """M82, M83."""
    run.flush()
    run.modal = replace(run.modal, absolute_e=block.code == "M82")


def offsets(run: Run, block: Block) -> None:
    """G92: gives the present position these numbers; alone, zeros."""
    run.flush()
    modal = run.modal
    named = [letter for letter in "XYZE" if not block.words or letter in block]
    offset = [
        round(at - block.get(letter) * modal.unit, GRID_DIGITS) if letter in named else before
        for letter, at, before in zip("XYZ", modal.position, modal.offset, strict=True)
    ]
    e = block.get("E") * modal.e_unit if "E" in named else modal.e
    run.modal = replace(modal, offset=(offset[0], offset[1], offset[2]), e=e)


def volumetric(run: Run, block: Block) -> None:
    """M200 as in Marlin: D is the filament's diameter and makes E mm³, D0 makes it mm; S0, S1."""
    run.flush()
    diameter = block.get("D", -1.0)
    if "D" in block and diameter < 0:
        run.refuse_word(block, "D", "M200 D is negative", "0", "give the diameter in mm, or D0")
        return
    modal = run.modal
    if diameter > 0:
        modal = replace(modal, filament_diameter=diameter * modal.unit)
    wanted = block.get("S", 1.0 if diameter > 0 or modal.volumetric else 0.0) != 0
    run.modal = replace(modal, volumetric=wanted and diameter != 0)


def factor(run: Run, block: Block) -> None:
    """M220, M221: percent of speed and of flow."""
    run.flush()
    percent = block.get("S")
    least, most = FACTOR_LIMITS
    if not least <= percent <= most:
        message = f"{block.code} S{percent:g} is outside {least:g} to {most:g} %"
        run.refuse_word(
            block, "S", message, f"{least:g}..{most:g}", "the factor is in percent: 100 is as sliced"
        )
    elif block.code == "M220":
        run.modal = replace(run.modal, speed_factor=percent / 100)
    else:
        run.modal = replace(run.modal, flow_factor=percent / 100)
