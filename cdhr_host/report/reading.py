"""Logs of every kind read back, a block at a time: CSV, Parquet, compact Parquet and black boxes."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from cdhr_host.errors import CdhrError
from cdhr_host.job.black_box import SUFFIX as BLACK_BOX
from cdhr_host.job.black_box import read_black_box
from cdhr_host.profile import Profile, validate
from cdhr_host.report.compact import COMPACT_COLUMNS, TENTH_UM
from cdhr_host.units import KPA, MM
from cdhr_host.values import Array

BLOCK: Final = 1 << 14
"""rows read at a time"""
KINDS: Final = (".csv", ".parquet", BLACK_BOX)


class LogFileError(ValueError):
    """A file that is not a log; the message says why."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened on the way."""

    t: float
    """s"""
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class LogFile:
    """A log on disk: what it says of itself, and its rows whenever they are asked for."""

    path: Path
    names: tuple[str, ...]
    """of the columns, in the log's units; those of compact logs as if they were not"""
    rows: int | None
    """None where only reading them all would tell"""
    resolution: float = 0.0
    """m: lengths are rounded to this; 0 for logs in full"""
    profile: Profile | None = None
    """the machine, where the log describes it in a way this version understands"""
    program: str = ""
    events: tuple[Event, ...] = field(default=())
    kept: Mapping[str, Array] | None = None
    """the rows of a log that is whole in memory"""

    @classmethod
    def opened(cls, path: Path) -> Self:
        """Raises LogFileError for what is not a log, OSError where it cannot be read."""
        if path.suffix not in KINDS:
            raise LogFileError(f"'{path.name}' does not end in {', '.join(KINDS)}")
        try:
            found = {".csv": _csv, ".parquet": _parquet, BLACK_BOX: _black_box}[path.suffix](path)
        except (pa.ArrowInvalid, CdhrError) as error:
            raise LogFileError(str(error)) from error
        log = cls(path, **found)
        missing = {"t_s", "line"} - set(log.names)
        if missing:
            raise LogFileError(f"it has no column {' and no column '.join(sorted(missing))}")
        return log

    def blocks(self) -> Iterator[Array]:
        """(N, len(names)) float64, in order; memory does not grow with the log."""
        if self.kept is not None:
            yield np.column_stack([self.kept[name] for name in self.names]).astype(np.float64)
        elif self.path.suffix == ".csv":
            with pa_csv.open_csv(self.path) as reader:
                for batch in reader:
                    yield _stacked(batch)
        else:
            yield from self._row_groups()

    def _row_groups(self) -> Iterator[Array]:
        with pq.ParquetFile(self.path, pre_buffer=False) as file:
            period, first = _period(file.schema_arrow), 0
            for batch in file.iter_batches(BLOCK):
                rows = _stacked(batch)
                yield rows if period is None else _unpacked(rows, first, period)
                first += len(rows)


def _stacked(batch: pa.RecordBatch) -> Array:
    columns = [column.to_numpy(zero_copy_only=False) for column in batch.columns]
    return np.column_stack(columns).astype(np.float64)


def _csv(path: Path) -> dict[str, Any]:
    with pa_csv.open_csv(path) as reader:
        return {"names": tuple(reader.schema.names), "rows": None}


def _parquet(path: Path) -> dict[str, Any]:
    with pq.ParquetFile(path) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
    known = {key.decode(): value.decode() for key, value in (schema.metadata or {}).items()}
    compact = _period(schema) is not None
    return {
        "names": _compact_names() if compact else tuple(schema.names),
        "rows": rows,
        "resolution": TENTH_UM if compact else 0.0,
        "profile": _profile(json.loads(known["profile"])) if "profile" in known else None,
        "program": known.get("program", ""),
    }


def _black_box(path: Path) -> dict[str, Any]:
    columns, meta = read_black_box(path)
    if not columns:
        why = meta["why"]["message"]
        raise LogFileError(f"nothing was executed before this black box was written: {why}")
    t = np.asarray(columns.get("t_s", np.zeros(0)), dtype=np.float64)
    return {
        "names": tuple(columns),
        "rows": len(t),
        "profile": _profile(meta["profile"]),
        "program": f"{meta['program']}: {meta['why']['message']}",
        "events": tuple(_events(meta["events"], t, float(meta["profile"]["drives.period_ms"]) * 1e-3)),
        "kept": columns,
    }


def _events(events: list[dict[str, Any]], t: Array, period: float) -> Iterator[Event]:
    for event in events:
        if len(t) and (at := event["tick"] * period) >= t[0]:
            yield Event(at, event["kind"], event["text"])


def _profile(values: Mapping[str, Any]) -> Profile | None:
    """``{"section.key": value}`` -> the profile; None for one that this version does not understand."""
    table: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        section, key = name.split(".", 1)
        table.setdefault(section, {})[key] = value
    profile, problems = validate(table)
    return None if problems else profile


def _period(schema: pa.Schema) -> float | None:
    """s of a compact log, None of others."""
    if COMPACT_COLUMNS[-1] not in schema.names:
        return None
    return float(schema.metadata[b"period_s"])


def _compact_names() -> tuple[str, ...]:
    lengths = [name.replace("_tenth_um", "_mm") for name in COMPACT_COLUMNS[1:-1]]
    return ("t_s", "line", *lengths, "pressure_kpa")


def _unpacked(rows: Array, first: int, period: float) -> Array:
    """Integers of a compact log -> columns in the log's units."""
    t = (first + np.arange(len(rows))) * period
    return np.column_stack([t, rows[:, 0], rows[:, 1:-1] * (TENTH_UM / MM), rows[:, -1] / KPA])
