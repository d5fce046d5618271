"""A slicer's file, from its text to what six drives received: the dry run's rows, rounded, tick by tick."""

from pathlib import Path

import numpy as np
import pytest
from bench import Bench, BridgeBench, PtyWire
from trajectories import PAPER

from cdhr_host.drives.rows import joined
from cdhr_host.job import stream
from cdhr_host.pipeline import Staircase

GCODE = Path(__file__).resolve().parents[2] / "gcode"
PROGRAMS = {"cura_ring.gcode": 50, "arcwelder_ring_absE.gcode": 60}
"""file -> its first lines that are printed here"""


def setpoints(name):
    text = b"".join((GCODE / name).read_bytes().splitlines(keepends=True)[: PROGRAMS[name]])
    return [rows for rows in Staircase(PAPER).setpoints([text]) if len(rows)]


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("way", ["slcan", "link"])
def test_slicer_file_arrives_tick_by_tick(name, way):
    batches = setpoints(name)
    dry = joined(batches)
    assert dry.pressure.max() > 100e3
    bench = Bench(wire=PtyWire) if way == "slcan" else BridgeBench()
    bench.link.open()
    summary = stream(iter(batches), bench.link, bench.user, start=np.zeros(6))
    assert summary.ticks == len(dry)
    received = np.array(bench.far.received)
    report = bench.far.lost if way == "slcan" else bench.far.gaps + bench.far.late
    bench.close()
    assert report == 0
    wanted = np.rint(dry.slider / bench.link.resolution).astype(int)
    first = _first_motion(received[:, :6]) - _first_motion(wanted)
    assert (received[first : first + len(wanted), :6] == wanted).all()
    full = PAPER.canopen.pressure_full_scale / 32767 if way == "slcan" else 100.0
    air = received[first : first + len(wanted), 6]
    assert (air == np.rint(dry.pressure / full)).all()


def _first_motion(counts):
    return int(np.flatnonzero((counts != counts[0]).any(axis=1))[0])
