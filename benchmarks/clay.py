"""Clay laid by the simulated machine: the air led, and not, in corners, at ends and under holds.

python benchmarks/clay.py
"""

import argparse
import math
from dataclasses import replace

import numpy as np

from cdhr_host.extrusion import AirStage, flow_law, ticks
from cdhr_host.extrusion.bead import beads
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.course import joined
from cdhr_host.plant import Clay, Paste
from cdhr_host.units import MM, MM3

CLAYS = ("earthenware", "porcelain", "stoneware")
AREA = 11.16
"""mm² of a bead 5 mm wide and 2.5 mm high"""
SPEED = 30.0
"""mm/s"""
BUFFERED = 125
"""ticks on their way to the drives when a hold is wished"""
INNER = 12.0 * MM
"""m left out at both ends of a bead, so that corners are seen alone"""


def square(sides: int) -> bytes:
    """A square spiral of beads, every corner a right angle; then a bead of 20 mm, apart."""
    x, y, lines = 0.0, 0.0, ["M83", "G0 Z2.5 F3000"]
    for n in range(sides):
        way = 20.0 + 5.0 * n
        x, y = x + way * round(math.cos(n * math.pi / 2)), y + way * round(math.sin(n * math.pi / 2))
        lines.append(f"G1 X{x:g} Y{y:g} E{way * AREA:.3f} F{60 * SPEED:g}")
    lines += [f"G0 X{x + 30:g} F3000", f"G1 X{x + 50:g} E{20 * AREA:.3f} F{60 * SPEED:g}", "G0 Z9 F3000"]
    return "\n".join(lines).encode() + b"\n"


def rows_of(profile, text, *, led):
    """Rows of a program, the air led or by the clay's law alone."""
    extruder = profile.extruder.model_copy(update={"lead": "on" if led else "off"})
    machine = profile.model_copy(update={"extruder": extruder})
    return joined(list(Staircase(machine).setpoints([text])))


def laid(profile, tick, command):
    """m³/s that the simulated clay of a profile lays."""
    clay = Clay(Paste.from_profile(profile), profile.drives.period)
    return clay.step(clay.standing(), tick, command)[2]


def measured(profile, rows, command):
    """Beads, as the simulated clay lays them; and the least and most on a millimetre away from their ends."""
    deposited, period = laid(profile, rows.tick, command), profile.drives.period
    found = beads(rows.line, rows.nozzle_G, rows.flow, deposited, period)
    way = np.cumsum(np.linalg.norm(np.diff(rows.nozzle_G, axis=0, prepend=rows.nozzle_G[:1]), axis=1))
    flowing = np.flatnonzero(rows.flow > 0.0)
    start, end = way[flowing[0]] + INNER, way[flowing[0]] + found[0].length - INNER
    inner = (way >= start) & (way < start + math.floor((end - start) / MM) * MM)
    place = ((way[inner] - start) / MM).astype(int)
    planned, came = (np.bincount(place, each[inner]) for each in (rows.flow, deposited))
    return found, came / planned


def corners(sides: int) -> None:
    """The first table: evenness, starts and ends."""
    print("| clay | air | in corners, on 1 mm | anywhere, on 1 mm | starts late | ends late |")
    print("|---|---|---|---|---|---|")
    for name in CLAYS:
        profile, text = open_profile("paper-wide", name), square(sides)
        law = flow_law(profile.extruder, profile.clay)
        plain, ready = (rows_of(profile, text, led=led) for led in (False, True))
        pressure = float(law.pressure(np.array(AREA * SPEED * MM3)))
        ways = {
            "one pressure, by the valve": (plain, np.where(plain.flow > 0.0, pressure, 0.0)),
            "pressure by the law, no lead": (plain, plain.pressure),
            "led": (ready, ready.pressure),
        }
        for way, (rows, command) in ways.items():
            found, inner = measured(profile, rows, command)
            least, most = min(each.least for each in found), max(each.most for each in found)
            start, end = (max(values, key=abs) / MM for values in _ends(found))
            shares = f"{_percent(inner.min(), inner.max())} | {_percent(least, most)}"
            print(f"| {name} | {way} | {shares} | {start:+.2f} mm | {end:+.2f} mm |")


def _percent(least, most):
    return f"{100 * (least - 1):+.1f} to {100 * (most - 1):+.1f} %"


def _ends(found):
    return [each.start_late for each in found], [each.end_late for each in found]


def ring() -> None:
    """The second table: the paper's double-layer ring."""
    print("\n| clay | layer | on 1 mm | starts late | ends late | seam |")
    print("|---|---|---|---|---|---|")
    with open("gcode/paper_ring_double.gcode", "rb") as file:
        text = file.read()
    for name in CLAYS:
        profile = open_profile("paper", name)
        rows = rows_of(profile, text, led=True)
        for layer, each in enumerate(measured(profile, rows, rows.pressure)[0], start=1):
            ends = f"{each.start_late / MM:+.2f} mm | {each.end_late / MM:+.2f} mm"
            even = _percent(each.least, each.most)
            print(f"| {name} | {layer} | {even} | {ends} | {100 * each.seam:.1f} % |")


def holds() -> None:
    """The third table: what a hold at once costs, beside one that waits for the air."""
    print("\n| clay | hold | begins after | clay too much where it rests |")
    print("|---|---|---|---|")
    for name in CLAYS:
        profile = open_profile("paper-wide", name)
        text = f"M83\nG0 Z2.5 F3000\nG1 X150 E{150 * AREA:.3f} F{60 * SPEED:g}\n".encode()
        rows = rows_of(profile, text, led=True)
        air = Staircase(profile).rig.air
        for hold, awaited in (("clean", ticks(air.change_lead, profile.drives.period)), ("prompt", 0)):
            excess = _held(profile, air, rows, awaited)
            wait = (2 + awaited) * profile.drives.period
            print(f"| {name} | {hold} | {1e3 * wait:.0f} ms | {excess:.2f} mm of bead |")


def _held(profile, air, rows, awaited):
    """mm of bead too much when the flow of a steady bead is slowed to nothing from a tick on."""
    period, known = profile.drives.period, int(np.flatnonzero(rows.flow >= 0.999 * rows.flow.max())[200])
    stage = AirStage(air, period)
    sent = stage.push(rows[: known + BUFFERED + stage.lead])
    stage.restart(known)
    ramp = np.linspace(0.0, 1.0, 60)
    slower = 1.0 - ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
    rate = np.concatenate((np.ones(2 + awaited), slower, np.zeros(400)))
    count = len(rate)
    after = replace(rows[known : known + count], flow=rows.flow[known] * rate)
    parts = [sent[sent.tick < known], stage.push(after), stage.flush()]
    command = joined([part for part in parts if part is not None])
    deposited = laid(profile, command.tick, command.pressure)
    planned = np.concatenate((rows.flow[:known], after.flow))
    excess = (deposited - planned)[known:].sum() * period
    return excess / MM3 / AREA


if __name__ == "__main__":
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("--smoke", action="store_true", help="little of it")
    options = parser.parse_args()
    corners(3 if options.smoke else 10)
    ring()
    holds()
