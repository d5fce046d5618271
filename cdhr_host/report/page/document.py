"""Vertices, times, problems and extremes -> one HTML file that needs nothing else."""

import base64
import json
import zlib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any, Final

import numpy as np

from cdhr_host import __version__
from cdhr_host.errors import CdhrError, Problem
from cdhr_host.pipeline import Proof
from cdhr_host.profile import Profile
from cdhr_host.report.files import put
from cdhr_host.report.page.layers import layers_of
from cdhr_host.report.page.trail import COLUMNS, Trail
from cdhr_host.report.summary import duration_text, problem_record, summary_facts
from cdhr_host.units import KPA, MM, MS
from cdhr_host.values import Array

STEPS: Final = 65535
"""of a number that is told as a share of its range"""
SCALES: Final = {
    "speed": ("speed", "mm/s", MM),
    "margin": ("force margin", "", 1.0),
    "pressure": ("pressure", "kPa", KPA),
}
"""what colours can show besides layer times: words, unit and the unit in SI"""
SCRIPTS: Final = ("colours.js", "camera.js", "scene.js", "panel.js", "page.js")


def write_page(
    path: Path, trail: Trail, profile: Profile, found: Proof | CdhrError, names: tuple[str, str]
) -> None:
    """Write the page of a proof, or of a program that was refused; ``names`` of its file and profile.

    Raises OSError when the disk refuses; the file is then as it was.
    """
    rows = trail.vertices()
    low, high = _box(rows)
    facts = {
        **_about(found, names),
        "layers": _layers(rows, found),
        "problems": _placed(trail, rows, found.problems),
        "warnings": _placed(trail, rows, found.warnings if isinstance(found, Proof) else ()),
        "bed": {"radius": profile.bed.radius / MM, "height": profile.bed.height / MM},
        "bead": profile.extruder.nozzle_diameter / MM,
        "box": {"low": (low / MM).tolist(), "high": (high / MM).tolist()},
        "tolerance": trail.tolerance / MM,
        "count": len(rows),
        "scales": {name: _scale(rows, name) for name in SCALES},
    }
    text = _page(facts, _packed(rows, low, high))
    with put(path) as part:
        part.write_text(text, encoding="utf-8")


def _about(found: Proof | CdhrError, names: tuple[str, str]) -> dict[str, Any]:
    file, profile = names
    about = {"file": file, "profile": profile, "version": __version__}
    if isinstance(found, CdhrError):
        return {**about, "verdict": "refused", "facts": [], "extremes": [], "total": found.total}
    verdict = "can be printed" if found.ok else "cannot be printed"
    extremes = [[name, *extreme] for name, extreme in found.extremes.items()]
    return {
        **about,
        "verdict": verdict,
        "facts": list(summary_facts(found)),
        "extremes": extremes,
        "total": found.total_problems,
    }


def _layers(rows: Array, found: Proof | CdhrError) -> list[dict[str, Any]]:
    if isinstance(found, CdhrError):
        return []
    return [
        {
            "name": layer.name,
            "line": layer.line,
            "first": layer.first,
            "begin": duration_text(layer.begin),
            "seconds": layer.duration,
            "text": duration_text(layer.duration),
            "height": None if layer.height is None else layer.height / MM,
        }
        for layer in layers_of(rows, found)
    ]


def _placed(trail: Trail, rows: Array, problems: Sequence[Problem]) -> list[dict[str, Any]]:
    placed = []
    for problem in problems:
        place = trail.place(problem, rows)
        at = None if place is None else (place / MM).tolist()
        placed.append({**problem_record(problem), "at": at})
    return placed


def _box(rows: Array) -> tuple[Array, Array]:
    """(3,), (3,) m: a box about all vertices that is nowhere flat."""
    if not len(rows):
        return np.zeros(3), np.full(3, MM)
    low, high = rows[:, :3].min(axis=0).astype(float), rows[:, :3].max(axis=0).astype(float)
    return low, np.maximum(high, low + MM)


def _scale(rows: Array, name: str) -> dict[str, Any]:
    """Range of a quantity over the path, and where clay is laid, in the unit people read."""
    words, unit, si = SCALES[name]
    low, high = _range(rows, name)
    laid = rows[rows[:, COLUMNS.index("flow")] > 0.0]
    least, most = _range(laid, name) if len(laid) else (low, high)
    return {
        "words": words,
        "unit": unit,
        "low": low / si,
        "high": high / si,
        "laid": [least / si, most / si],
    }


def _range(rows: Array, name: str) -> tuple[float, float]:
    if not len(rows):
        return 0.0, 1.0
    values = rows[:, COLUMNS.index(name)]
    low, high = float(values.min()), float(values.max())
    return low, high if high > low else low + 1.0


def _packed(rows: Array, low: Array, high: Array) -> bytes:
    """Columns one after another, each as differences of whole numbers: t, line, x, y, z, quantities, clay."""
    clock, line, flow = (rows[:, COLUMNS.index(name)] for name in ("t", "line", "flow"))
    places = [_share(rows[:, axis], low[axis], high[axis]) for axis in range(3)]
    shown = [_share(rows[:, COLUMNS.index(name)], *_range(rows, name)) for name in SCALES]
    columns: list[np.ndarray] = [
        np.rint(clock / MS).astype(np.uint32),
        line.astype(np.uint32),
        *(values.astype(np.uint16) for values in (*places, *shown)),
        (flow > 0.0).astype(np.uint8),
    ]
    return b"".join(np.diff(column, prepend=column.dtype.type(0)).tobytes() for column in columns)


def _share(values: Array, low: float, high: float) -> Array:
    return np.asarray(np.rint((values.astype(float) - low) * (STEPS / (high - low))))


def _page(facts: dict[str, Any], vertices: bytes) -> str:
    """No ``<`` of the data can end the script that carries it."""
    source = files("cdhr_host.report.page")

    def text(name: str) -> str:
        return source.joinpath(name).read_text(encoding="utf-8")

    return Template(text("page.html")).substitute(
        style=text("page.css"),
        facts=json.dumps(facts, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c"),
        vertices=base64.b64encode(zlib.compress(vertices, 6)).decode(),
        script="\n".join(text(name) for name in SCRIPTS),
        title=Template("$file on $profile").substitute(facts).replace("&", "&amp;").replace("<", "&lt;"),
    )
