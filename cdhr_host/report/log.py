"""Logs on disk: CSV or Parquet by suffix, written as the rows come, visible only when complete."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import BinaryIO, Protocol, Self

import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from cdhr_host import __version__
from cdhr_host.pipeline.columns import (
    FEEDBACK_COLUMNS,
    SETPOINT_COLUMNS,
    Column,
    run_columns,
    setpoint_columns,
)
from cdhr_host.profile import Profile, described
from cdhr_host.report.files import check_place
from cdhr_host.values import Feedback, Setpoints

ROW_GROUP = 50_000
"""Rows held before they are written: 200 s at 250 Hz, some 10 MB."""


def about(profile: Profile, program: str) -> dict[str, str]:
    """What a Parquet log says of itself besides its rows: program, version and the profile in full."""
    values = {f"{section}.{key}": value for section, key, value, _ in described(profile)}
    return {"program": program, "version": __version__, "profile": json.dumps(values)}


def _schema(names: Sequence[str], metadata: Mapping[str, str]) -> pa.Schema:
    whole = {name for name in names if name == "line" or name.endswith("_counts")}
    fields = [(name, pa.int64() if name in whole else pa.float64()) for name in names]
    known: dict[bytes | str, bytes | str] = {}
    known.update(metadata.items())
    return pa.schema(fields, metadata=known)


class Writer(Protocol):
    """One kind of file."""

    def write(self, table: pa.Table) -> None:
        """Append rows."""

    def close(self) -> None:
        """Write what ends the file."""


class _Csv:
    """Shortest decimals that read back to the same bits; names without quotes."""

    def __init__(self, file: BinaryIO, schema: pa.Schema) -> None:
        self._file = file
        file.write((",".join(schema.names) + "\n").encode())

    def write(self, table: pa.Table) -> None:
        pa_csv.write_csv(table, self._file, pa_csv.WriteOptions(include_header=False))

    def close(self) -> None:
        """The file is the log's to close."""


class _Parquet:
    """Split into byte streams before compression: doubles pack well so."""

    def __init__(self, file: BinaryIO, schema: pa.Schema) -> None:
        doubles = [field.name for field in schema if pa.types.is_float64(field.type)]
        self._writer = pq.ParquetWriter(
            file, schema, compression="zstd", use_dictionary=False, use_byte_stream_split=doubles
        )

    def write(self, table: pa.Table) -> None:
        self._writer.write_table(table)

    def close(self) -> None:
        self._writer.close()


WRITERS: dict[str, Callable[[BinaryIO, pa.Schema], Writer]] = {".csv": _Csv, ".parquet": _Parquet}


class Log:
    """A log being written beside its target; ``keep`` puts it in place, leaving without it drops it.

    A context manager. Rows are columns of equal length, of the names and types of the schema.
    Memory is bounded by ROW_GROUP rows. Raises TargetError at construction, OSError when the disk
    refuses.
    """

    def __init__(
        self,
        path: Path,
        schema: pa.Schema,
        writers: Mapping[str, Callable[[BinaryIO, pa.Schema], Writer]] = WRITERS,
    ) -> None:
        check_place(path, writers)
        self._path = path
        self._part = path.with_name(f".{path.name}.{os.getpid()}.part")
        self._schema = schema
        self._held: list[pa.RecordBatch] = []
        self._rows = 0
        self._file: BinaryIO = self._part.open("wb")
        self._writer: Writer = writers[path.suffix](self._file, self._schema)

    def add(self, columns: dict[str, Column]) -> None:
        """Append rows: {column: (N,)}."""
        batch = pa.record_batch([columns[name] for name in self._schema.names], schema=self._schema)
        self._held.append(batch)
        self._rows += batch.num_rows
        if self._rows >= ROW_GROUP:
            self.flush()

    def flush(self) -> None:
        """Write the rows that are held."""
        if self._rows:
            self._writer.write(pa.Table.from_batches(self._held, self._schema).combine_chunks())
        self._held, self._rows = [], 0

    def keep(self) -> None:
        """Write what is held, and put the log in its place."""
        self.flush()
        self._writer.close()
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        self._part.replace(self._path)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._file.close()
        finally:
            self._part.unlink(missing_ok=True)


class SetpointLog(Log):
    """The setpoints of a dry run, one row a tick; ``metadata`` as of ``about``, which CSV cannot hold."""

    def __init__(self, path: Path, metadata: Mapping[str, str] = MappingProxyType({})) -> None:
        super().__init__(path, _schema(SETPOINT_COLUMNS, metadata))

    def add_setpoints(self, setpoints: Setpoints) -> None:
        """Append N ticks."""
        self.add(setpoint_columns(setpoints))


class RunLog(Log):
    """What was sent and what came back, one row an executed tick."""

    def __init__(self, path: Path, metadata: Mapping[str, str] = MappingProxyType({})) -> None:
        super().__init__(path, _schema(SETPOINT_COLUMNS + FEEDBACK_COLUMNS, metadata))

    def add_run(self, setpoints: Setpoints, feedback: Feedback) -> None:
        """Append N executed ticks."""
        self.add(run_columns(setpoints, feedback))
