"""The black box holds the last minute, and no more, and gives it back."""

from pathlib import Path

import numpy as np
import pytest

from cdhr_host.errors import JobError, Problem
from cdhr_host.job.black_box import KEPT, LINES, BlackBox, read_black_box
from cdhr_host.pipeline import open_profile
from cdhr_host.pipeline.columns import run_columns
from cdhr_host.plant import Machine
from cdhr_host.values import Feedback, Setpoints

PROFILE = open_profile("paper")
PERIOD = PROFILE.drives.period
WHY = Problem("slack", "cable 2 carries 0.2 N", line=77, hint="look at it")


def batch(first: int, count: int) -> tuple[Setpoints, Feedback]:
    tick = np.arange(first, first + count)
    still, air = np.zeros((count, 3)), np.full(count, 1e-9 * first)
    slider = np.repeat(1e-6 * tick[:, None], 6, axis=1)
    rows = Setpoints(
        tick, tick * PERIOD, tick // 5, still, still.copy(), slider, slider + 5.0, air, 1e5 * air
    )
    machine = Machine(PROFILE)
    return rows, machine.step(machine.standing(slider[0]), rows)[1]


def filled(seconds: float) -> tuple[BlackBox, list[tuple[Setpoints, Feedback]]]:
    box, kept = BlackBox(PROFILE), []
    for first in range(0, round(seconds / PERIOD), 50):
        kept.append(batch(first, 50))
        box.executed(*kept[-1])
        box.line = int(kept[-1][0].line[-1])
    return box, kept


def test_it_gives_back_the_last_minute(tmp_path: Path) -> None:
    box, kept = filled(90.0)
    box.event("state", "printing")
    box.event("emergency", "drive 3: 0x8611")
    box.write(tmp_path / "sub" / "b.npz", WHY, "vase.gcode", (f"G1 X{n}" for n in box.lines))
    columns, meta = read_black_box(tmp_path / "sub" / "b.npz")
    assert KEPT <= len(columns["t_s"]) * PERIOD < KEPT + 50 * PERIOD
    last = run_columns(*kept[-1])
    for name, values in last.items():
        assert np.array_equal(columns[name][-50:], values, equal_nan=True), name
    assert meta["why"]["message"] == WHY.message
    assert [each["kind"] for each in meta["events"]] == ["state", "emergency"]
    assert meta["lines"][-1] == {"line": int(kept[-1][0].line[-1]), "text": f"G1 X{kept[-1][0].line[-1]}"}
    assert len(meta["lines"]) == LINES
    assert meta["profile"]["sliders.screw_lead_mm"] == 4.0


def test_it_does_not_grow(tmp_path: Path) -> None:
    box, _ = filled(70.0)
    box.write(tmp_path / "a.npz", WHY, "f", ())
    rows, feedback = batch(10**6, 50)
    for _ in range(3000):
        box.executed(rows, feedback)
        box.event("message", "x")
    box.write(tmp_path / "b.npz", WHY, "f", ())
    short, _ = read_black_box(tmp_path / "a.npz")
    long, meta = read_black_box(tmp_path / "b.npz")
    assert len(long["t_s"]) <= len(short["t_s"]) + 50
    assert len(meta["events"]) == 1000


def test_a_run_that_never_moved_has_a_box_too(tmp_path: Path) -> None:
    box = BlackBox(PROFILE)
    box.event("state", "fault")
    box.write(tmp_path / "b.npz", WHY, "f", ())
    columns, meta = read_black_box(tmp_path / "b.npz")
    assert columns == {}
    assert (meta["lines"], meta["events"][0]["tick"]) == ([], -1)


def test_what_cannot_be_written_or_read_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(JobError, match="cannot write"):
        BlackBox(PROFILE).write(tmp_path / "file" / "b.npz", WHY, "f", ())
    for content in (b"", b"PK\3\4 no zip", b"\x93NUMPY"):
        (tmp_path / "c.npz").write_bytes(content)
        with pytest.raises(JobError, match="not a black box"):
            read_black_box(tmp_path / "c.npz")
    with pytest.raises(JobError, match="not a black box"):
        read_black_box(tmp_path / "none.npz")
