"""A journal gives back what was written, whatever is cut off or changed."""

import os
import random
import resource
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdhr_host.errors import JobError
from cdhr_host.job.journal import (
    Executed,
    Fed,
    JournalWriter,
    Opened,
    Turned,
    latest_unfinished,
    prune,
    read_journal,
)
from cdhr_host.job.journal.records import decoded, encoded

OPENED = Opened(
    1,
    "/tmp/väse.gcode",
    "ab" * 32,
    "paper",
    None,
    "cd" * 32,
    "loopback:",
    0.004,
    "2026-11-22T06:00:00",
    "",
    0.0,
)


def executed(i: int, *, air: bool = True) -> Executed:
    return Executed(i, i // 3, 1.5 * i, (0.1 * i, -i, 0.0), (i, -i, 0, 2**30, 1, 2), air, 0.25 * i)


def written(path: Path, count: int = 40, end: str = "held") -> bytes:
    with JournalWriter(path, OPENED) as journal:
        for i in range(count):
            journal.add(Fed(i // 3 + 1, 1.5 * i + 100))
            journal.add(executed(i, air=i % 2 == 0))
        journal.add(Turned(end, "because"))
    return path.read_bytes()


def test_it_gives_back_the_last_of_each_kind(tmp_path: Path) -> None:
    written(tmp_path / "a.journal")
    journal = read_journal(tmp_path / "a.journal")
    assert journal.opened == OPENED
    assert journal.executed == executed(39, air=False)
    assert journal.bead == executed(38)
    assert journal.fed == Fed(14, 1.5 * 39 + 100)
    assert (journal.state, journal.reason, journal.damage) == ("held", "because", None)


def test_cut_at_every_byte_it_keeps_the_whole_records_before(tmp_path: Path) -> None:
    whole = written(tmp_path / "a.journal", 12)
    ends = [i + 1 for i, byte in enumerate(whole) if byte == 0x0A]
    cut = tmp_path / "cut.journal"
    for size in range(len(whole)):
        cut.write_bytes(whole[:size])
        kept = sum(end <= size for end in ends)
        if kept == 0:
            with pytest.raises(JobError, match="not the journal of a print"):
                read_journal(cut)
            continue
        journal = read_journal(cut)
        left = size - ends[kept - 1]
        assert (journal.damage is None) == (left == 0)
        if journal.damage is not None:
            assert (journal.damage.record, journal.damage.dropped) == (kept + 1, left)
            assert journal.damage.why == "it is not complete"
        assert journal.executed == (
            executed((kept - 3) // 2, air=(kept - 3) // 2 % 2 == 0) if kept > 2 else None
        )


def test_a_changed_byte_is_never_believed(tmp_path: Path) -> None:
    whole = written(tmp_path / "a.journal", 12)
    rng = random.Random(7)
    bad = tmp_path / "bad.journal"
    first = whole.index(b"\n") + 1
    for _ in range(300):
        at, flip = rng.randrange(len(whole)), rng.randrange(1, 256)
        bad.write_bytes(whole[:at] + bytes([whole[at] ^ flip]) + whole[at + 1 :])
        if at < first:
            with pytest.raises(JobError):
                read_journal(bad)
        else:
            journal = read_journal(bad)
            assert journal.damage is not None
            assert journal.damage.offset <= at < journal.damage.offset + journal.damage.dropped


def test_records_in_another_order_are_not_believed(tmp_path: Path) -> None:
    lines = written(tmp_path / "a.journal", 12).splitlines(keepends=True)
    lines[5], lines[7] = lines[7], lines[5]
    path = tmp_path / "swapped.journal"
    path.write_bytes(b"".join(lines))
    journal = read_journal(path)
    assert journal.damage is not None
    assert (journal.damage.record, journal.damage.why) == (6, "its checksum is wrong")


@given(
    st.builds(
        Executed,
        st.integers(0, 2**40),
        st.integers(0, 10**7),
        st.floats(0, 1e9),
        st.tuples(*[st.floats(-1e4, 1e4)] * 3),
        st.tuples(*[st.integers(-(2**31), 2**31 - 1)] * 6),
        st.booleans(),
        st.floats(0, 1e12),
    )
    | st.builds(Turned, st.text(), st.text())
    | st.builds(Fed, st.integers(0, 10**7), st.floats(0, 1e9)),
    st.integers(0, 2**32 - 1),
)
def test_every_record_comes_back(record: Executed | Turned | Fed, crc: int) -> None:
    line, after = encoded(record, crc)
    assert line.count(b"\n") == 1
    assert decoded(line, crc) == (record, after)


def test_a_journal_of_another_version_is_refused(tmp_path: Path) -> None:
    line, _ = encoded(Opened(2, *[getattr(OPENED, name) for name in OPENED.__slots__[1:]]), 0)
    (tmp_path / "a.journal").write_bytes(line)
    with pytest.raises(JobError, match="version 2, not 1"):
        read_journal(tmp_path / "a.journal")


def test_the_youngest_that_did_not_end_is_found(tmp_path: Path) -> None:
    written(tmp_path / "2026-01-01.journal")
    written(tmp_path / "2026-01-02.journal")
    written(tmp_path / "2026-01-03.journal", end="done")
    (tmp_path / "2026-01-04.journal").write_bytes(b"")
    assert latest_unfinished(tmp_path) == tmp_path / "2026-01-02.journal"
    with pytest.raises(JobError, match="no interrupted print"):
        latest_unfinished(tmp_path / "none")


def test_one_that_was_gone_on_from_is_not_found_again(tmp_path: Path) -> None:
    first = tmp_path / "2026-01-01.journal"
    written(first)
    with JournalWriter(tmp_path / "2026-01-02.journal", replace(OPENED, goes_on=str(first))) as journal:
        journal.add(Turned("done", ""))
    with pytest.raises(JobError, match="no interrupted print"):
        latest_unfinished(tmp_path)


def test_old_ones_are_removed(tmp_path: Path) -> None:
    for day in range(1, 8):
        written(tmp_path / f"2026-01-0{day}.journal", 1)
        (tmp_path / f"2026-01-0{day}.npz").touch()
    prune(tmp_path, keep=3)
    assert sorted(path.name[8:10] for path in tmp_path.iterdir()) == ["05", "05", "06", "06", "07", "07"]


def test_one_is_never_written_over(tmp_path: Path) -> None:
    written(tmp_path / "a.journal")
    with pytest.raises(JobError, match="File exists"):
        JournalWriter(tmp_path / "a.journal", OPENED)


def test_a_full_disk_is_told(tmp_path: Path) -> None:
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        code = 1
        try:
            with JournalWriter(tmp_path / "a.journal", OPENED) as journal:
                for i in range(1000):
                    journal.add(executed(i))
        except JobError as error:
            code = 0 if "cannot write journal" in str(error) else 2
        os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert read_journal(tmp_path / "a.journal").executed is not None
