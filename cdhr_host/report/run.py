"""A run in words and as a record for machines."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from cdhr_host import __version__
from cdhr_host.job import RunSummary
from cdhr_host.pipeline import Proof
from cdhr_host.report.summary import CM3, duration_text
from cdhr_host.units import KPA, MM, MM3, MS


def run_record(run: RunSummary, proof: Proof, file: str, profile: str) -> dict[str, Any]:
    """The JSON object of ``cdhr stream --json``."""
    return {
        "file": file,
        "profile": profile,
        "version": __version__,
        "ok": not run.interrupted,
        "interrupted": run.interrupted,
        "lines": proof.lines,
        "moves": proof.moves,
        "path_mm": proof.path / MM,
        "extruded_mm3": proof.extruded / MM3,
        "duration_s": run.duration,
        "planned_s": proof.duration,
        "ticks": run.ticks,
        "last_line": run.last_line,
        "following_max_mm": (run.following_max / MM).tolist(),
        "following_rms_mm": (run.following_rms / MM).tolist(),
        "torque_max_nm": run.torque_max.tolist(),
        "pressure_deviation_max_kpa": run.pressure_deviation_max / KPA,
        "timing": _timing(run),
    }


def run_lines(run: RunSummary, proof: Proof, file: str) -> Iterator[str]:
    """What a person wants to know when a run is over: one line each."""
    if run.interrupted:
        yield f"{file}: stopped on request at line {run.last_line}, at rest, air off"
    else:
        yield f"{file}: printed, at rest, air off"
    clay = f"{proof.extruded / CM3:.1f} cm³"
    yield f"  program    {proof.lines} lines, {proof.moves} moves, {proof.path:.3f} m, {clay}"
    yield f"  time       {duration_text(run.duration)}, {run.ticks} ticks"
    away, torque = run.following_max / MM, run.torque_max
    yield f"  following  {away.max():.3f} mm at most (slider {away.argmax() + 1})"
    yield f"  torque     {torque.max():.3f} N m at most (motor {torque.argmax() + 1})"
    if (timing := run.timing) is not None:
        late = f"p50 {timing.p50 / MS:.3f}, p99 {timing.p99 / MS:.3f}, p99.9 {timing.p999 / MS:.3f} ms"
        yield f"  lateness   {late}, {timing.max / MS:.3f} ms at most; {timing.skipped} cycles skipped"


def _timing(run: RunSummary) -> dict[str, Any] | None:
    if run.timing is None:
        return None
    timing = run.timing
    return {
        "cycles": timing.cycles,
        "p50_ms": timing.p50 / MS,
        "p99_ms": timing.p99 / MS,
        "p999_ms": timing.p999 / MS,
        "max_ms": timing.max / MS,
        "skipped": timing.skipped,
        "late": timing.late,
        "real_time": timing.real_time,
    }


def joined(runs: Sequence[RunSummary]) -> RunSummary:
    """The summary of runs that followed each other, such as those between two pauses."""
    ticks = np.array([run.ticks for run in runs])
    squares = np.array([run.following_rms**2 for run in runs])
    last = next((run for run in reversed(runs) if run.ticks), runs[-1])
    return RunSummary(
        ticks=int(ticks.sum()),
        duration=sum(run.duration for run in runs),
        last_tick=last.last_tick,
        last_line=last.last_line,
        following_max=np.max([run.following_max for run in runs], axis=0),
        following_rms=np.sqrt(ticks @ squares / max(ticks.sum(), 1)),
        torque_max=np.max([run.torque_max for run in runs], axis=0),
        pressure_deviation_max=max(run.pressure_deviation_max for run in runs),
        interrupted=runs[-1].interrupted,
    )
