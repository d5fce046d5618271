"""A whole slicer's file as a user prints it: are the setpoints that arrive those of the dry run?

    python benchmarks/slicer_print.py gcode/prusa_tile_infill_volE.gcode
    python benchmarks/slicer_print.py gcode/prusa_tile_infill_volE.gcode --bus link
    python benchmarks/slicer_print.py gcode/prusa_tile_infill_volE.gcode --mode ip
    python benchmarks/slicer_print.py --smoke      its first moves only

``cdhr dry-run``, ``cdhr sim`` and ``cdhr stream`` as processes, in real time, with the profile's own
watchdog; then the dry run's log, rounded to the drives' units, is compared with what the far side
received, tick by tick, positions and air.
"""

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from itertools import islice
from pathlib import Path

import numpy as np

from cdhr_host.profile import find, read_table, validate

REPOSITORY = Path(__file__).resolve().parents[1]
CDHR = [sys.executable, "-m", "cdhr_host"]
FILE = REPOSITORY / "gcode" / "prusa_tile_infill_volE.gcode"
FULL = {"slcan": 32767.0, "link": 10_000.0}
"""raw pressure at full scale: 0x6411, and a bridge's tenths of a kPa (of 1000 kPa)"""


def machine(mode, folder):
    """The paper's profile with its drives in this mode: path, and validated."""
    path = folder / "machine.toml"
    text = find("paper").read_text(encoding="utf-8")
    path.write_text(text.replace('mode = "csp"', f'mode = "{mode}"'), encoding="utf-8")
    return path, validate(read_table(path))[0]


def planned(path, profile, full):
    """(N, 7) raw positions and air of a dry run's log."""
    with path.open(encoding="ascii") as file:
        names = next(csv.reader(file))
    wanted = [*(f"slider{k + 1}_mm" for k in range(6)), "pressure_kpa"]
    table = np.loadtxt(path, delimiter=",", skiprows=1, usecols=[names.index(name) for name in wanted])
    unit = profile.canopen.position_unit * 1e3
    air = table[:, 6] * 1e3 / profile.canopen.pressure_full_scale * full
    return np.rint(np.column_stack([table[:, :6] / unit, air])).astype(np.int64)


def begun(file, lines, folder):
    """Path of a program of the file's first lines; of the file itself if all are wanted."""
    if lines is None:
        return str(file)
    part = folder / file.name
    with file.open("rb") as text:
        part.write_bytes(b"".join(islice(text, lines)))
    return str(part)


def first_motion(counts):
    """Index of the first row that is not where it began."""
    return int(np.flatnonzero((counts[:, :6] != counts[0, :6]).any(axis=1))[0])


def printed(file, bus, mode, lines):
    """One print of a file's first lines, None for all; a record."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path, profile = machine(mode, folder)
        file = begun(file, lines, folder)
        log, record = folder / "dry.csv", folder / "received.csv"
        profiled = ["--profile", str(path)]
        command = [*CDHR, "dry-run", file, *profiled, "--log", str(log)]
        subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True)
        command = [*CDHR, "sim", *profiled, "--bus", bus, "--record", str(record)]
        far = subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)
        try:
            url = far.stdout.readline().strip()
            command = [*CDHR, "stream", file, *profiled, "--drives", url, "--yes", "--json"]
            run = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False)
        finally:
            far.terminate()
            far.wait()
        if run.returncode:
            raise SystemExit(run.stderr)
        return compared(planned(log, profile, FULL[bus]), record, run.stdout) | {"bus": bus, "mode": mode}


def compared(wanted, record, said):
    """What arrived against what was planned, and the run's own summary."""
    received = np.loadtxt(record, delimiter=",", skiprows=1).astype(np.int64)
    begin = first_motion(received) - first_motion(wanted)
    part = received[begin : begin + len(wanted)]
    report = json.loads(record.with_suffix(".json").read_text())
    return {
        "ticks": len(wanted),
        "other_positions": int((part[:, :6] != wanted[:, :6]).any(axis=1).sum()),
        "other_air": int((part[:, 6] != wanted[:, 6]).sum()),
        "lost_ticks": report["lost_ticks"],
        "summary": json.loads(said),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("file", nargs="?", type=Path, default=FILE)
    parser.add_argument("--bus", choices=FULL, default="slcan")
    parser.add_argument("--mode", choices=("csp", "ip"), default="csp")
    parser.add_argument("--lines", type=int, help="of the file, from its first; all without")
    parser.add_argument("--smoke", action="store_true", help="30 lines")
    arguments = parser.parse_args()
    lines = 30 if arguments.smoke else arguments.lines
    print(json.dumps(printed(arguments.file.resolve(), arguments.bus, arguments.mode, lines)))


if __name__ == "__main__":
    main()
