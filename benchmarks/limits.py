"""Every limit on the 1 kHz log of every file: worst shares by finite differences, deviation, what is covered.

    python benchmarks/limits.py [FILE ...] [--profile paper-wide]

Without files, those of gcode/; in either case the stress set besides. Nothing is taken from the
planner but the places in the log: programs are read again by tests/plain_gcode.py, speed,
acceleration and jerk are first to third differences, and distances are to the drawn lines and arcs.
"""

import argparse
import gzip
import math
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from plain_gcode import Drawing, draw  # noqa: E402 -- it lies among the tests

from cdhr_host.cli.source import Source  # noqa: E402
from cdhr_host.pipeline import open_profile, prove  # noqa: E402
from cdhr_host.values import Setpoints  # noqa: E402

RATE_HZ = 1000.0
CHUNK = 1 << 18
"""rows looked at together"""
ROWS = np.dtype([("line", "i4"), ("nozzle", "f8", 3), ("slider", "f8", 6), ("tension", "f8", 6)])
"""of what is kept of the log, mm and N"""
NEIGHBOURS = 3
"""moves before and after the one a row names that it may belong to"""
MICRON = 1e-3
"""mm: less is rounding, of coordinates and of chords that stand for curves"""
HEAD = (
    "| file | rows | v of F | v | a | j | slider v | slider a | slider j | force window "
    "| off the path mm (of) | places missed |"
)


def stress() -> dict[str, np.ndarray]:
    """Corner points (N, 3), mm."""
    chance, t = np.random.default_rng(3), np.linspace(0.0, 1.0, 1500)[:, None]
    zigzag = np.cumsum(chance.uniform(-12, 12, (400, 3)) * [1, 1, 0.01], axis=0) % [120, 120, 3]
    noise = np.hstack((200 * t - 100, chance.uniform(-0.05, 0.05, t.shape), 0 * t))
    spiral = np.hstack((80 * t * np.cos(60 * t), 80 * t * np.sin(60 * t), 5 * t))
    there = [[0, 0, 0], [60, 0, 0], [0, 60 * math.tan(math.radians(1)), 0], [60, 1, 0]]
    tiny = np.hstack((1e-3 * np.arange(2000)[:, None], np.zeros((2000, 2))))
    corner = np.array([[0, 0, 0], [30, 0, 0], [30, 30, 0], [0, 30, 5]])
    return {
        "random zigzags": zigzag,
        "0.05 mm noise": noise,
        "spiral": spiral,
        "Hilbert curve": hilbert(5, 2.0),
        "179° reversals": np.array(there),
        "1 µm moves": np.concatenate((tiny, corner)),
        "duplicates": np.repeat(corner, 3, axis=0),
    }


def hilbert(order: int, step: float) -> np.ndarray:
    """(4**order, 3) mm."""
    x = y = np.zeros(1)
    for side in (2**k for k in range(order)):
        x, y = (
            np.concatenate((y, x, x + side, 2 * side - 1 - y)),
            np.concatenate((x, y + side, y + side, side - 1 - x)),
        )
    return step * np.column_stack((x, y, 0 * x))


def written(folder: Path, name: str, points: np.ndarray) -> Path:
    """A program that extrudes along points at 100 mm/s."""
    path = folder / f"{name}.gcode"
    lines = [f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} E1" for x, y, z in points[1:]]
    start = "G1 X{:.4f} Y{:.4f} Z{:.4f} F3000".format(*points[0])
    path.write_text("\n".join(["M83", start, "G1 F6000", *lines]) + "\n")
    return path


def logged(program: Path, name: str, into: BinaryIO) -> bool:
    """Write ROWS of a program; False where the machine refuses it."""

    def keep(setpoints: Setpoints) -> None:
        rows = np.empty(len(setpoints), ROWS)
        rows["line"], rows["tension"] = setpoints.line, setpoints.tension
        rows["nozzle"], rows["slider"] = setpoints.nozzle_G * 1e3, setpoints.slider * 1e3
        into.write(rows.tobytes())

    proof = prove(Source(str(program)).chunks(), open_profile(name), rate_hz=RATE_HZ, sink=keep)
    return proof.ok


def drawing_of(program: Path, profile: dict[str, Any], rows: np.ndarray) -> Drawing:
    """The program's moves; the log only tells where its G28 end."""
    data = program.read_bytes()
    text = (gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data).decode("latin-1")
    line = np.arange(text.count("\n") + 2)
    last = np.maximum(np.searchsorted(rows["line"], line, side="right") - 1, 0)
    return draw(text, profile, line, rows["nozzle"][last])


class Worst:
    """Greatest shares of the limits over chunks of rows that overlap by three."""

    def __init__(self, profile: dict[str, Any], drawing: Drawing) -> None:
        self._profile, self._drawing = profile, drawing
        self.shares = np.zeros(8)
        self.away = self.beyond = 0.0
        self.tolerance = float(drawing.tolerance.max())
        self._missing = np.full((len(drawing.line), 5), np.inf)
        self._places = np.array([drawing.places(move) for move in range(len(drawing.line))])

    def take(self, rows: np.ndarray) -> None:
        """Look at a chunk."""
        shares = [self._fed(rows)]
        for part, limits in (("nozzle", "limits"), ("slider", "sliders")):
            names = ("speed_max_mm_s", "acceleration_max_mm_s2", "jerk_max_mm_s3")
            for order, what in enumerate(names, 1):
                change = np.diff(rows[part], order, axis=0) * RATE_HZ**order
                size = np.linalg.norm(change, axis=1) if part == "nozzle" else np.abs(change)
                shares.append(size.max(initial=0.0) / self._profile[limits][what])
        self.shares = np.maximum(self.shares, [*shares, self._loaded(rows["tension"])])
        self._near(rows)

    def _moves(self, line: np.ndarray) -> np.ndarray:
        return np.clip(self._drawing.move_at(line), 0, None)

    def _fed(self, rows: np.ndarray) -> float:
        """Speed over the greatest F of the moves passed between two rows."""
        first, last = self._moves(rows["line"][:-1]), self._moves(rows["line"][1:])
        allowed = np.maximum(self._drawing.feed[first], self._drawing.feed[last])
        for step in range(1, int((last - first).max(initial=0))):
            allowed = np.maximum(allowed, self._drawing.feed[np.minimum(first + step, last)])
        speed = np.linalg.norm(np.diff(rows["nozzle"], axis=0), axis=1) * RATE_HZ
        return float((speed / np.where(allowed > 0, allowed, np.inf)).max(initial=0.0))

    def _loaded(self, tension: np.ndarray) -> float:
        """How far from the middle of its window any force is, the ends at 1."""
        window = self._profile["forces"]
        low = np.repeat([window["lower_min_n"], window["upper_min_n"]], 3)
        high = np.repeat([window["lower_max_n"], window["upper_max_n"]], 3)
        return float((np.abs(tension - (low + high) / 2) / ((high - low) / 2)).max())

    def _near(self, rows: np.ndarray) -> None:
        """Distances of rows from moves, and of places on moves from rows."""
        drawing, move = self._drawing, self._moves(rows["line"])
        away = np.full(len(rows), np.inf)
        steps = range(-NEIGHBOURS, NEIGHBOURS + 1)
        for step in steps:
            near = np.clip(move + step, 0, len(drawing.line) - 1)
            away = np.minimum(away, drawing.distance(near, rows["nozzle"]))
            self._cover(near, rows["nozzle"])
        # What lines do that draw nothing, as a pause that lifts, is the machine's own.
        free = np.isin(rows["line"], drawing.free_lines) | ~np.isin(rows["line"], drawing.line)
        away[free] = 0.0
        around = [drawing.tolerance[np.clip(move + step, 0, len(drawing.line) - 1)] for step in steps]
        over = away - np.max(around, axis=0)
        self.away, self.beyond = max(self.away, float(away.max())), max(self.beyond, float(over.max()))

    def _cover(self, move: np.ndarray, nozzle: np.ndarray) -> None:
        """Five places of each extruding move: how near the way between two rows comes to them."""
        move = move[:-1]
        start, way = nozzle[:-1, None], np.diff(nozzle, axis=0)[:, None]
        places = self._places[move]
        part = ((places - start) * way).sum(axis=2) / np.maximum((way**2).sum(axis=2), 1e-300)
        apart = np.linalg.norm(start + np.clip(part, 0, 1)[:, :, None] * way - places, axis=2)
        heads = np.flatnonzero(np.diff(move, prepend=-1))
        least = np.minimum.reduceat(apart, heads, axis=0)
        np.minimum.at(self._missing, move[heads], least)

    @property
    def missed(self) -> int:
        """Places on extruding moves that the way passes further off than the tolerance."""
        off = self._missing - self._drawing.tolerance[:, None]
        return int((off[self._drawing.extrudes] > MICRON).sum())

    @property
    def kept(self) -> bool:
        """No limit exceeded by more than 0.1 %, no deviation beyond the tolerance, everything covered."""
        return bool((self.shares <= 1.001).all()) and self.beyond <= MICRON and not self.missed


def row(program: Path, name: str, folder: Path) -> tuple[str, bool]:
    """One line of the table, and whether all limits are kept."""
    raw = folder / "rows"
    with raw.open("wb") as into:
        accepted = logged(program, name, into)
    if not accepted:
        return f"| {program.name} | refused on {name} |" + " |" * 10, True
    rows = np.memmap(raw, ROWS, "r")
    profile = tomllib.loads((ROOT / "profiles" / f"{name}.toml").read_text(encoding="utf-8"))
    worst = Worst(profile, drawing_of(program, profile, rows))
    for first in range(0, len(rows), CHUNK):
        worst.take(np.array(rows[max(first - 3, 0) : first + CHUNK]))
    shares = " | ".join(f"{share:.5f}" for share in worst.shares)
    tail = f"{worst.away:.4f} ({worst.tolerance:g}) | {worst.missed} |"
    return f"| {program.stem.removesuffix('.gcode')} | {len(rows)} | {shares} | {tail}", worst.kept


def programs(options: argparse.Namespace, folder: Path) -> Iterator[Path]:
    """Those to look at."""
    pattern = "paper_ring_double.gcode" if options.smoke else "*.gcode*"
    yield from options.files or sorted((ROOT / "gcode").glob(pattern))
    for name, points in list(stress().items())[: 1 if options.smoke else None]:
        yield written(folder, name, points)


def main() -> None:
    """Print the table; exit 1 where a limit is exceeded, the path left or a place missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--profile", default="paper-wide")
    parser.add_argument("--smoke", action="store_true", help="one file and one path")
    options = parser.parse_args()
    print(HEAD)
    print("|" + "---|" * (HEAD.count("|") - 1))
    broken = []
    with tempfile.TemporaryDirectory() as folder:
        for program in programs(options, Path(folder)):
            line, kept = row(program, options.profile, Path(folder))
            print(line, flush=True)
            broken += [] if kept else [program.name]
    if broken:
        sys.exit(f"not kept: {', '.join(broken)}")


if __name__ == "__main__":
    main()
