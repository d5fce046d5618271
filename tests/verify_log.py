"""Checks a setpoint log against its program and its profile, with numpy and nothing of cdhr_host.

    python tests/verify_log.py LOG FILE PROFILE

Everything is worked out anew: the G-code is read by a parser of its own, speeds come from
finite differences, slider positions from the closed form l = r theta + L. All in mm, s, N.
"""

import gzip
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

if __package__ in (None, ""):
    sys.path.insert(0, str(Path(__file__).parent))
from plain_gcode import Drawing, draw

ROUNDING_MM = 1e-9
SLACK = 1e-3
"""relative excess that finite differences may show: 0.1 %"""
NEIGHBOURS = 4
"""moves before and after the one named in a row that a sample may belong to"""


@dataclass
class Log:
    """Columns by name, and those that belong together as arrays."""

    table: dict[str, np.ndarray]

    def __post_init__(self) -> None:
        self.t, self.line = self["t_s"], self["line"].astype(int)
        self.nozzle = np.stack([self[f"{axis}_mm"] for axis in "xyz"], axis=1)
        self.upper = np.stack([self[f"{axis}_mm"] for axis in "uvw"], axis=1)
        self.slider = np.stack([self[f"slider{i}_mm"] for i in range(1, 7)], axis=1)
        self.tension = np.stack([self[f"tension{i}_n"] for i in range(1, 7)], axis=1)
        self.dt = (self.t[-1] - self.t[0]) / (len(self.t) - 1)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.table[name]


def read_log(path: Path) -> Log:
    if path.suffix == ".parquet":
        import pyarrow.parquet as pq

        table = pq.read_table(path)
        return Log({name: table[name].to_numpy() for name in table.column_names})
    with path.open() as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    return Log(dict(zip(names, rows.T, strict=True)))


def read_program(path: Path) -> str:
    data = path.read_bytes()
    return (gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data).decode("latin-1")


def difference(values: np.ndarray, order: int, dt: float) -> np.ndarray:
    """(N, k) -> (N - order, k) divided difference."""
    return np.diff(values, n=order, axis=0) / dt**order


def check_time(log: Log, rate: float) -> list[str]:
    found = []
    if abs(log.t[0]) > 1e-12:
        found.append(f"t begins at {log.t[0]} s")
    drift = np.abs(log.t - np.arange(len(log.t)) / rate).max()
    if drift > 1e-9:
        found.append(f"t is not uniform at {rate:g} Hz: {drift:.3g} s off")
    return found


def check_rest(log: Log, profile: dict) -> list[str]:
    found = []
    creep = profile["limits"]["jerk_max_mm_s3"] * log.dt**2
    speed = np.linalg.norm(difference(log.nozzle, 1, log.dt), axis=1)
    for name, value in (("start", speed[0]), ("end", speed[-1])):
        if value > creep:
            found.append(f"not at rest at the {name}: {value:.4f} mm/s")
    air = {name: log[name][-1] for name in ("flow_mm3_s", "pressure_kpa")}
    return found + [f"{name} is {value:g} at the end" for name, value in air.items() if value != 0]


def over(name: str, values: np.ndarray, limit: np.ndarray | float, log: Log) -> list[str]:
    """One finding when a value exceeds its limit by more than rounding."""
    excess = values / (np.asarray(limit) + 1e-12)
    worst = int(np.argmax(excess))
    if excess[worst] <= 1 + SLACK:
        return []
    allowed = float(np.broadcast_to(limit, values.shape)[worst])
    where = f"t = {log.t[worst]:.3f} s, line {log.line[worst]}"
    rows = int((excess > 1 + SLACK).sum())
    return [f"{name}: {values[worst]:.4f} at {where}, limit {allowed:.4f} ({rows} rows)"]


def check_limits(log: Log, profile: dict) -> list[str]:
    found = []
    for order, quantity, unit in ((1, "speed", "mm_s"), (2, "acceleration", "mm_s2"), (3, "jerk", "mm_s3")):
        nozzle = np.linalg.norm(difference(log.nozzle, order, log.dt), axis=1)
        slider = np.abs(difference(log.slider, order, log.dt)).max(axis=1)
        found += over(f"nozzle {quantity}", nozzle, profile["limits"][f"{quantity}_max_{unit}"], log)
        found += over(f"slider {quantity}", slider, profile["sliders"][f"{quantity}_max_{unit}"], log)
    return found


def check_feed(log: Log, drawing: Drawing) -> list[str]:
    """Never faster than F: between two rows, the greatest F of the moves passed."""
    first, last = drawing.move_at(log.line[:-1]), drawing.move_at(log.line[1:])
    known = (first >= 0) & (last >= first)
    passed = np.where(known, last - first, 0)
    allowed = np.where(known, drawing.feed[first], np.inf)
    for step in range(1, int(passed.max(initial=0)) + 1):
        further = np.where(passed >= step, drawing.feed[np.minimum(first + step, last)], 0.0)
        allowed = np.maximum(allowed, further)
    speed = np.linalg.norm(difference(log.nozzle, 1, log.dt), axis=1)
    free = np.isin(log.line[:-1], drawing.free_lines) | np.isin(log.line[1:], drawing.free_lines)
    allowed[free] = np.inf
    return over("speed above F", speed, allowed, log)


def check_path(log: Log, drawing: Drawing) -> list[str]:
    """Every row lies on the programmed path, near the move it names, within that move's tolerance."""
    move = drawing.move_at(log.line)
    rows = np.flatnonzero((move >= 0) & ~np.isin(log.line, drawing.free_lines))
    away, beyond = np.full(len(rows), np.inf), np.full(len(rows), np.inf)
    for step in range(-NEIGHBOURS, NEIGHBOURS + 1):
        near = np.clip(move[rows] + step, 0, len(drawing.feed) - 1)
        distance = drawing.distance(near, log.nozzle[rows])
        away = np.minimum(away, distance)
        beyond = np.minimum(beyond, distance - drawing.tolerance[near])
    if not len(rows) or beyond.max() <= ROUNDING_MM:
        return []
    worst = int(beyond.argmax())
    where = f"t = {log.t[rows[worst]]:.3f} s, line {log.line[rows[worst]]}"
    return [f"off the path: {away[worst]:.4f} mm at {where} ({(beyond > ROUNDING_MM).sum()} rows)"]


def check_covered(log: Log, drawing: Drawing) -> list[str]:
    """Every extruding move is drawn along its whole length, in order."""
    missed = []
    reach = max(200, int(0.5 / log.dt))
    for move in np.flatnonzero(drawing.extrudes):
        line = drawing.line[move]
        low = max(0, int(np.searchsorted(log.line, line, "left")) - reach)
        high = min(len(log.t), int(np.searchsorted(log.line, line, "right")) + reach)
        for point in drawing.places(move):
            if polyline_distance(log.nozzle[low:high], point) > drawing.tolerance[move] + ROUNDING_MM:
                missed.append(line)
    return [f"{len(set(missed))} extruding moves not covered, first line {missed[0]}"] if missed else []


def check_stops(log: Log, drawing: Drawing, jerk: float) -> list[str]:
    """In G61 the nozzle comes to rest at the end of every move, on its end."""
    speed = np.linalg.norm(difference(log.nozzle, 1, log.dt), axis=1)
    missed = []
    for move in np.flatnonzero(drawing.exact):
        line = drawing.line[move]
        low = max(0, int(np.searchsorted(log.line, line, "left")) - 2)
        high = int(np.searchsorted(log.line, line, "right")) + 2
        away = np.linalg.norm(log.nozzle[low:high] - drawing.end[move], axis=1)
        at = low + int(away.argmin())
        slowest = speed[max(at - 1, 0) : at + 1].min(initial=np.inf)
        if away.min() > jerk * log.dt**3 + ROUNDING_MM or slowest > jerk * log.dt**2:
            missed.append(line)
    return [f"{len(missed)} moves do not end in an exact stop, first line {missed[0]}"] if missed else []


def polyline_distance(points: np.ndarray, to: np.ndarray) -> float:
    """(N, 3), (3,) -> least distance from the polyline through the points."""
    a, d = points[:-1], np.diff(points, axis=0)
    along = np.einsum("ij,ij->i", to - a, d) / np.maximum(np.einsum("ij,ij->i", d, d), 1e-300)
    nearest = a + np.clip(along, 0, 1)[:, None] * d
    return float(np.sqrt(((nearest - to) ** 2).sum(axis=1).min()))


def check_air(log: Log, drawing: Drawing) -> list[str]:
    """Clay flows on extruding moves, and on no travel."""
    move = drawing.move_at(log.line)
    named = (move >= 0) & (drawing.line[move] == log.line)
    travel = named & ~drawing.extrudes[move] & ~np.isin(log.line, drawing.priming_lines)
    found = []
    if (wrong := travel & (log["flow_mm3_s"] != 0)).any():
        found.append(f"clay flows on travel, line {log.line[wrong.argmax()]} ({wrong.sum()} rows)")
    laid = float(log["flow_mm3_s"].sum() * log.dt)
    if abs(laid - drawing.clay_mm3) > 0.01 * drawing.clay_mm3 + 1.0:
        found.append(f"{laid:.1f} mm3 of clay laid, {drawing.clay_mm3:.1f} programmed")
    return found


def cable_lengths(arm: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """BA (N, 3) -> length over a pulley of that radius, and the unit vector of the cable: l = r theta + L."""
    rho, drop = np.hypot(arm[:, 0], arm[:, 1]), np.abs(arm[:, 2])
    reach = np.hypot(rho, drop)
    theta = np.arcsin(radius / reach) + np.arctan2(drop, rho)
    length = radius * theta + np.sqrt(reach**2 - radius**2)
    swivel = np.arctan2(arm[:, 1], arm[:, 0])
    out = np.cos(theta)
    unit = [out * np.cos(swivel), out * np.sin(swivel), np.sign(arm[:, 2]) * np.sin(theta)]
    return length, np.stack(unit, axis=1)


def closed_form(lower: np.ndarray, upper: np.ndarray, g: dict) -> tuple[np.ndarray, np.ndarray]:
    """Displacements of both platforms (N, 3) -> six cable lengths (N, 6), unit vectors (N, 6, 3)."""
    lengths, units = [], []
    low, high = g["reference_height_mm"], g["reference_height_mm"] + g["reference_separation_mm"]
    for q, ring, height, pulley in (
        (lower, g["lower_attachment_radius_mm"], low, g["lower_pulley_height_mm"]),
        (upper, g["upper_attachment_radius_mm"], high, g["upper_pulley_height_mm"]),
    ):
        for k in range(3):
            out = np.array([np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3), 0.0])
            anchor = g["pulley_circle_radius_mm"] * out + [0, 0, pulley]
            length, unit = cable_lengths(anchor - (ring * out + [0, 0, height] + q), g["pulley_radius_mm"])
            lengths.append(length)
            units.append(unit)
    return np.stack(lengths, axis=1), np.stack(units, axis=1)


def displacements(log: Log, profile: dict) -> tuple[np.ndarray, np.ndarray]:
    """Of the lower and the upper platform from the reference pose."""
    bed = profile["bed"]
    height = profile["geometry"]["reference_height_mm"]
    shift = np.array([bed["origin_x_mm"], bed["origin_y_mm"], bed["origin_z_mm"] - height])
    return log.nozzle + shift, log.upper


def check_sliders(log: Log, profile: dict) -> list[str]:
    lower, upper = displacements(log, profile)
    length, _ = closed_form(lower, upper, profile["geometry"])
    rest, _ = closed_form(np.zeros((1, 3)), np.zeros((1, 3)), profile["geometry"])
    off = np.abs(log.slider - (length - rest)).max()
    return [f"sliders differ from the closed form by {off:.3g} mm"] if off > ROUNDING_MM else []


def check_forces(log: Log, profile: dict) -> list[str]:
    """In the window, and in balance with weight, spring and acceleration (Eq. 10-12)."""
    window, found = profile["forces"], []
    for name, forces in (("lower", log.tension[:, :3]), ("upper", log.tension[:, 3:])):
        low, high = window[f"{name}_min_n"], window[f"{name}_max_n"]
        if forces.min() < low or forces.max() > high:
            seen = f"{forces.min():.3f} to {forces.max():.3f} N"
            found.append(f"{name} cables {seen}, window {low:g} to {high:g} N")
    lower, upper = displacements(log, profile)
    _, unit = closed_form(lower, upper, profile["geometry"])
    pull = unit * log.tension[:, :, None]
    between = upper - lower + [0, 0, profile["geometry"]["reference_separation_mm"]]
    apart = np.linalg.norm(between, axis=1, keepdims=True)
    stretch = apart - profile["spring"]["rest_length_mm"]
    spring = profile["spring"]["stiffness_n_mm"] * stretch * between / apart
    for name, cables, mass, push, q in (
        ("lower", pull[:, :3], profile["platforms"]["lower_mass_kg"], spring, lower),
        ("upper", pull[:, 3:], profile["platforms"]["upper_mass_kg"], -spring, upper),
    ):
        force = (cables.sum(axis=1) + push + [0, 0, -9.81 * mass])[1:-1]
        left = force - mass * difference(q, 2, log.dt) * 1e-3
        slack = 1e-6 + mass * profile["limits"]["jerk_max_mm_s3"] * log.dt * 1e-3
        if np.abs(left).max() > slack:
            found.append(f"forces on the {name} platform are out of balance by {np.abs(left).max():.4f} N")
    return found


def verify(log_path: Path, program: Path, profile_path: Path, rate: float | None = None) -> list[str]:
    """Everything wrong with a log, one sentence each."""
    profile = tomllib.loads(profile_path.read_text(encoding="utf-8"))
    log = read_log(log_path)
    drawing = draw(read_program(program), profile, log.line, log.nozzle)
    return [
        *check_time(log, rate or 1e3 / profile["drives"]["period_ms"]),
        *check_rest(log, profile),
        *check_limits(log, profile),
        *check_feed(log, drawing),
        *check_path(log, drawing),
        *check_covered(log, drawing),
        *check_stops(log, drawing, profile["limits"]["jerk_max_mm_s3"]),
        *check_air(log, drawing),
        *check_sliders(log, profile),
        *check_forces(log, profile),
    ]


if __name__ == "__main__":
    findings = verify(*(Path(argument) for argument in sys.argv[1:4]))
    print("\n".join(findings) or "all checks passed")
    sys.exit(bool(findings))
