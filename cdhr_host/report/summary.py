"""A proof in words and as a record for machines."""

from collections.abc import Iterator, Sequence
from typing import Any

from cdhr_host import __version__
from cdhr_host.errors import CdhrError, Problem
from cdhr_host.pipeline import Proof
from cdhr_host.units import MINUTE, MM, MM3

CM3 = 1e-6
"""m³ in a cubic centimetre"""


def problem_record(problem: Problem) -> dict[str, Any]:
    """``{line, kind, message, value, limit}`` and, where known, column, unit and hint."""
    extra = {name: getattr(problem, name) for name in ("column", "unit", "hint")}
    return {
        "line": problem.line,
        "kind": problem.kind,
        "message": problem.message,
        "value": problem.value,
        "limit": problem.limit,
        **{name: value for name, value in extra.items() if value is not None},
    }


def _head(file: str, profile: str, ok: bool, problems: Sequence[Problem], total: int) -> dict[str, Any]:
    return {
        "file": file,
        "profile": profile,
        "version": __version__,
        "ok": ok,
        "problems": [problem_record(problem) for problem in problems],
        "total_problems": total,
    }


def proof_record(proof: Proof, file: str, profile: str) -> dict[str, Any]:
    """The JSON object of ``cdhr dry-run --json``."""
    return {
        **_head(file, profile, proof.ok, proof.problems, proof.total_problems),
        "lines": proof.lines,
        "moves": proof.moves,
        "duration_s": proof.duration,
        "path_mm": proof.path / MM,
        "extruded_mm3": proof.extruded / MM3,
        "layers": len(proof.layers),
        "layer_times": _layer_times(proof),
        "warnings": [problem_record(warning) for warning in proof.warnings],
        "extremes": {
            column: {"min": low, "min_line": low_line, "max": high, "max_line": high_line}
            for column, (low, low_line, high, high_line) in proof.extremes.items()
        },
    }


def _layer_times(proof: Proof) -> list[dict[str, Any]]:
    """Of each layer that comments announce: its number, first line, beginning and duration."""
    ends = [*proof.layer_times[1:], proof.duration]
    return [
        {"layer": layer, "line": line, "begin_s": begin, "duration_s": end - begin}
        for (line, layer), begin, end in zip(proof.layers, proof.layer_times, ends, strict=False)
    ]


def refused_record(error: CdhrError, file: str, profile: str) -> dict[str, Any]:
    """The same object for a program that was not understood: what could not be known is null."""
    unknown = ("lines", "moves", "duration_s", "path_mm", "extruded_mm3", "layers")
    return {
        **_head(file, profile, False, error.problems, error.total),
        **dict.fromkeys(unknown),
        "layer_times": [],
        "warnings": [],
        "extremes": {},
    }


def duration_text(duration: float) -> str:
    """s -> ``47.3 s``, ``12 min 5 s`` or ``10 h 4 min``."""
    if duration < MINUTE:
        return f"{duration:.1f} s"
    minutes, seconds = divmod(round(duration), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {seconds} s"


def summary_lines(proof: Proof) -> Iterator[str]:
    """What a person wants to know of a program: one line each."""
    return (f"  {name:<10} {text}" for name, text in summary_facts(proof))


def summary_facts(proof: Proof) -> Iterator[tuple[str, str]]:
    """The same as (name, text) pairs."""
    layers = f", {len(proof.layers)} layers" if proof.layers else ""
    yield "program", f"{proof.lines} lines, {proof.moves} moves{layers}"
    yield "time", duration_text(proof.duration)
    yield "path", f"{proof.path:.3f} m"
    yield "clay", f"{proof.extruded / CM3:.1f} cm³"
    for name, columns, unit in (
        ("nozzle x", ["x_mm"], "mm"),
        ("nozzle y", ["y_mm"], "mm"),
        ("nozzle z", ["z_mm"], "mm"),
        ("sliders", [f"slider{i}_mm" for i in range(1, 7)], "mm"),
        ("cables 1-3", [f"tension{i}_n" for i in range(1, 4)], "N"),
        ("cables 4-6", [f"tension{i}_n" for i in range(4, 7)], "N"),
        ("pressure", ["pressure_kpa"], "kPa"),
    ):
        known = [proof.extremes[column] for column in columns if column in proof.extremes]
        if known:
            yield name, _range_text(known, unit)


def _range_text(ranges: Sequence[tuple[float, int, float, int]], unit: str) -> str:
    low = min(ranges, key=lambda extreme: extreme[0])
    high = max(ranges, key=lambda extreme: extreme[2])
    return f"{low[0]:.2f} (line {low[1]}) to {high[2]:.2f} {unit} (line {high[3]})"
