"""The sender's process: rings, commands, and what happens when a process dies. Real terminals."""

import json
import multiprocessing
import os
import select
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

import numpy as np
import pytest
from trajectories import PAPER, changed, run_of

from cdhr_host.drives import LinkState, MonotonicClock
from cdhr_host.drives.rows import joined
from cdhr_host.drives.sender import SenderLink
from cdhr_host.drives.sender.far import CAPACITY, RESULTS, REVISION, Sender, Spec, Word, timing_told
from cdhr_host.drives.sender.ring import FEEDBACK, SETPOINTS, Ring, feedback, packed, setpoints, width
from cdhr_host.drives.timing import CycleTiming
from cdhr_host.errors import DriveError, Problem
from cdhr_host.job import stream
from cdhr_host.motion.hold import path_true_stop
from cdhr_host.plant import Machine
from cdhr_host.values import Feedback, Setpoints

ROOT = Path(__file__).resolve().parents[2]
ZERO = np.zeros(6)
PATIENT = PAPER.model_copy(
    update={
        "canopen": PAPER.canopen.model_copy(
            update={"jitter_test": 0.1, "setpoint_watchdog": 0.1, "heartbeat": 2.0}
        )
    }
)
"""a machine for a computer that runs tests besides: whole processes may stand still for moments"""


class Far:
    """``cdhr sim`` in its own process."""

    def __init__(self, folder):
        self.record = folder / "received.csv"
        arguments = [sys.executable, "-m", "cdhr_host", "sim", "--record", str(self.record)]
        self.process = subprocess.Popen(arguments, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        assert select.select([self.process.stdout], [], [], 90.0)[0]
        self.url = self.process.stdout.readline().strip()

    def end(self, how=signal.SIGTERM):
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.process.wait(60.0)
        self.process.stdout.close()
        path = self.record.with_suffix(".json")
        return json.loads(path.read_text()) if path.exists() else {}


@contextmanager
def running(tmp_path):
    """A machine in the middle of a long run."""
    far = Far(tmp_path)
    link = SenderLink(far.url, PATIENT, tmp_path / "references.json")
    try:
        link.open()
        link.arm(ZERO)
        rows = run_of(3000, seed=5)
        link.feed(rows[: link.free])
        _until(lambda: len(link.feedback()) > 0)
        yield far, link, rows
    finally:
        link.close()
        far.end()


def _until(done, patience=60.0):
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if done():
            return
        select.select([], [], [], 0.02)
    raise AssertionError("it never came")


def timing(worst, *, real_time=True):
    return CycleTiming(500, 1e-4, 2e-4, worst, worst, 0, 0, real_time)


@pytest.mark.parametrize(
    ("soft", "worst", "said"),
    [
        (False, 1.9e-3, "timing test: p99.9 1.900 ms, worst 1.900 ms late"),
        (False, 2.1e-3, "failed (limit 2 ms), nothing is armed"),
        (True, 2.1e-3, "failed (limit 2 ms), the drives may stand still for moments"),
    ],
)
def test_timing_test_is_told(soft, worst, said):
    profile = PAPER.model_copy(
        update={"canopen": PAPER.canopen.model_copy(update={"allow_soft_realtime": soft})}
    )
    assert timing_told(timing(worst), profile).endswith(said)
    assert "without real-time priority" in timing_told(timing(worst, real_time=False), profile)


@pytest.mark.parametrize("soft", [False, True])
def test_sender_that_failed_its_timing_test_arms_only_where_that_is_allowed(tmp_path, soft):
    settings = PAPER.canopen.model_copy(update={"allow_soft_realtime": soft})
    profile = PAPER.model_copy(update={"canopen": settings})
    sizes = (
        (SETPOINTS, Setpoints, CAPACITY),
        (FEEDBACK, Feedback, RESULTS),
        (SETPOINTS, Setpoints, REVISION),
    )
    rings = [Ring(width(columns, kind), capacity) for columns, kind, capacity in sizes]
    memory = SharedMemory(create=True, size=8 * len(Word))
    commands, far = multiprocessing.Pipe()
    spec = Spec(
        "virtual:cdhr-test", profile, tmp_path / "r.json", *(ring.name for ring in rings), memory.name
    )
    sender = Sender(spec, far)
    sender._punctual = False
    with pytest.raises(DriveError) as caught:
        sender._do_arm([0.0] * 6)
    assert caught.value.problems[0].kind == ("state" if soft else "jitter")
    sender.end()
    memory.unlink()
    for each in (*rings, commands, far, memory):
        each.close()


def test_rows_survive_the_ring():
    rows = run_of(300)
    _, executed = Machine(PAPER).step(Machine(PAPER).standing(ZERO), rows)
    ring = Ring(width(SETPOINTS, Setpoints), 128)
    back = []
    for k in range(0, 300, 50):
        ring.write(packed(rows[k : k + 50], SETPOINTS))
        assert ring.space == 78
        back.append(setpoints(ring.take(30)))
        back.append(setpoints(ring.take(100)))
        assert ring.space == 128
    got = joined(back)
    for name in ("tick", "t", "line", "nozzle_G", "upper", "slider", "tension", "flow", "pressure"):
        assert (getattr(got, name) == getattr(rows, name)).all()
    assert len(ring.take(10)) == 0
    ring.close()
    again = feedback(packed(executed, FEEDBACK))
    assert (again.counts == executed.counts).all()
    assert again.counts.dtype == np.int64


def test_run_through_the_sender_is_received_tick_by_tick(tmp_path):
    far = Far(tmp_path)
    link = SenderLink(far.url, PATIENT, tmp_path / "references.json")
    rows = run_of(500)
    try:
        link.open()
        assert any("timing test" in note for note in link.notes)
        summary = stream(iter([rows[:300], rows[300:]]), link, MonotonicClock(), start=ZERO)
        assert summary.ticks == 500
        assert summary.timing.cycles >= 500
        assert summary.timing.p50 < PAPER.drives.period
        assert link.state is LinkState.STOPPED
    finally:
        link.close()
        report = far.end()
    assert report["at_rest"]
    assert report["pressure_raw"] == 0
    received = np.loadtxt(far.record, delimiter=",", skiprows=1)[:, :6]
    wanted = np.rint(rows.slider / link.resolution)
    assert any((received[k : k + 500] == wanted).all() for k in range(len(received) - 499))


@pytest.mark.parametrize("later", [0, 400], ids=["in the sender", "in the ring"])
def test_revision_is_carried_out_by_the_sender(tmp_path, later):
    """The rows of the sender's own buffer, or those still in the ring, are replaced at one tick."""
    with running(tmp_path) as (far, link, rows):
        _until(lambda: link.feedback() is not None and link.buffered < 800)
        first, hold = _held(link, rows, later)
        with pytest.raises(DriveError, match="can no longer be replaced"):
            link.revise(rows[10:500])
        _until(lambda: len(link.feedback()) >= 0 and link.buffered == 0)
        link.stop()
        report = far.end()
        received = np.loadtxt(far.record, delimiter=",", skiprows=1)[:, :6]
    assert report["at_rest"]
    wanted = np.rint(np.vstack([rows.slider[:first], hold.slider]) / link.resolution)
    begin = _where(received, wanted[:50])
    assert (received[begin : begin + len(wanted)] == wanted).all()


def test_all_that_is_buffered_can_be_replaced_at_once(tmp_path):
    """The ring's rows and those of the sender's own buffer: more than the ring alone holds."""
    with running(tmp_path) as (_, link, rows):
        fed = CAPACITY
        for _ in range(50):
            fed += link.feed(rows[fed : fed + link.free])
            first = link.revisable
            with suppress(DriveError):
                link.revise(rows[first:fed])
                break
        assert fed - first > CAPACITY
        _until(lambda: link.feedback() is not None and link.buffered < CAPACITY)


def test_rows_of_a_stopped_run_are_not_played_in_the_next(tmp_path):
    with running(tmp_path) as (far, link, _):
        _until(lambda: link.feedback() is not None and link.buffered < 900)
        link.stop()
        parts = []
        _until(lambda: parts.append(link.feedback()) or link.state is LinkState.STOPPED)
        stands = link.slider
        again = run_of(200)
        link.arm(stands)
        link.feed(changed(again, slider=again.slider + stands))
        got = []
        _until(lambda: got.append(link.feedback()) or link.buffered == 0)
        assert (joined(got).tick == again.tick).all()
        link.stop()
        assert far.end()["at_rest"]


def _held(link, rows, later):
    """Revise as a job does: plan anew where the computer was too slow for the tick it had chosen."""
    for _ in range(50):
        first = link.revisable + later
        hold = path_true_stop(rows[first:1024], PATIENT)
        with suppress(DriveError):
            link.revise(hold)
            return first, hold
    raise AssertionError("always too late")


def _where(received, wanted):
    """The index from which ``received`` has the rows ``wanted``."""
    count = len(wanted)
    return next(k for k in range(len(received) - count + 1) if (received[k : k + count] == wanted).all())


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_drives_stop_by_themselves_when_the_sender_dies(tmp_path, how):
    with running(tmp_path) as (far, link, _):
        pid = link.pid
        os.kill(pid, how)
        with pytest.raises(DriveError, match="the sending process"):
            _until(lambda: len(link.feedback()) < 0)
        assert link.state is LinkState.FAULT
        with pytest.raises(DriveError, match="the sending process"):
            link.arm(ZERO)
        time.sleep(0.4)
        os.kill(pid, signal.SIGKILL)
        report = far.end()
    assert report["at_rest"]
    assert report["pressure_raw"] == 0
    assert set(report["states"]) == {"switch_on_disabled"}


def test_sender_asked_to_end_stops_on_the_path_and_leaves_nothing_behind(tmp_path):
    """SIGTERM, as when a computer is shut down; no shared memory has a name by then."""
    with running(tmp_path) as (far, link, rows):
        rings = (link._rows, link._results, link._revisions)
        assert not [ring.name for ring in rings if (Path("/dev/shm") / ring.name).exists()]
        pid = link.pid
        os.kill(pid, signal.SIGTERM)
        _until(lambda: _zombie(pid))
        with pytest.raises(DriveError, match="the sending process"):
            link.feedback()
        report = far.end()
        received = np.loadtxt(far.record, delimiter=",", skiprows=1)[:, :6]
    assert report["at_rest"]
    assert report["lost_ticks"] == 0
    assert set(report["states"]) == {"switch_on_disabled"}
    moved = received[np.abs(np.diff(received, axis=0, prepend=received[:1])).max(axis=1) > 0]
    path = rows.slider / link.resolution
    beside = np.array([_beside(point, path) for point in moved[-100:]])
    assert beside.max() < 10.0  # units of 0.1 µm: the chords of the path explain them


def _beside(point, path):
    """Distance of a point from the chords of a path."""
    begin, along = path[:-1], np.diff(path, axis=0)
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip(((point - begin) * along).sum(axis=1) / square, 0.0, 1.0)
    return np.linalg.norm(begin + share[:, None] * along - point, axis=1).min()


def test_unplugged_far_side_is_a_fault_of_the_next_cycle(tmp_path):
    with running(tmp_path) as (far, link, _):
        far.end(signal.SIGKILL)
        with pytest.raises(DriveError, match="is gone"):
            _until(lambda: len(link.feedback()) < 0)
        assert link.state is LinkState.FAULT


def test_machine_stops_on_its_path_when_the_feeder_starves(tmp_path):
    with running(tmp_path) as (far, link, _):
        parts = []
        with pytest.raises(DriveError, match="the buffer ran dry"):
            _until(lambda: parts.append(link.feedback()) or False)
        _until(lambda: parts.append(link.feedback()) or link.state is LinkState.FAULT)
        feedback_ = joined([part for part in parts if len(part)])
        assert (np.diff(feedback_.tick) == 1).all()
        assert np.abs(np.diff(feedback_.setpoint[-2:], axis=0)).max() <= link.resolution
        report = far.end()
    assert report["pressure_raw"] == 0


def test_host_that_dies_leaves_the_machine_at_rest(tmp_path):
    """SIGKILL of the feeding process: its sender stops on the path and ends by itself."""
    far = Far(tmp_path)
    script = (
        "import sys, time, numpy as np\n"
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from pathlib import Path\n"
        "from trajectories import run_of\n"
        "from test_sender import PATIENT\n"
        "from cdhr_host.drives.sender import SenderLink\n"
        "if __name__ == '__main__':\n"
        f"    link = SenderLink({far.url!r}, PATIENT, Path({str(tmp_path / 'r.json')!r}))\n"
        "    link.open(); link.arm(np.zeros(6)); rows = run_of(3000, seed=5)\n"
        "    link.feed(rows[: link.free])\n"
        "    print(link.pid, flush=True)\n"
        "    time.sleep(60)\n"
    )
    path = tmp_path / "feeder.py"
    path.write_text(script)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    host = subprocess.Popen([sys.executable, str(path)], stdout=subprocess.PIPE, env=environment)
    assert select.select([host.stdout], [], [], 90.0)[0]
    sender = int(host.stdout.readline())
    time.sleep(0.5)
    host.kill()
    host.wait()
    host.stdout.close()
    _until(lambda: not Path(f"/proc/{sender}").exists() or _zombie(sender))
    report = far.end()
    assert report["at_rest"]
    assert report["pressure_raw"] == 0
    assert set(report["states"]) == {"switch_on_disabled"}


def _zombie(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(") ", 1)[1].startswith("Z")
    except FileNotFoundError:
        return True


class Pipe:
    """A sender that trips just when it is asked something."""

    def __init__(self, *messages):
        self.messages = list(messages)

    def send(self, _):
        pass

    def poll(self, _=0.0):
        return bool(self.messages)

    def recv(self):
        return self.messages.pop(0)


def test_a_fault_that_comes_before_an_answer_is_told_once(tmp_path):
    link = SenderLink("slcan:nowhere@1000000", PATIENT, tmp_path / "references.json")
    link._process, link._status = object(), np.zeros(16, dtype=np.int64)
    link._results, link._progress = Ring(width(FEEDBACK, Feedback), 16), time.monotonic()
    link._pipe = Pipe(("fault", (Problem("underrun", "ran dry"),)), ("done", None))
    assert link._ask("revise") is None
    with pytest.raises(DriveError, match="ran dry"):
        link.feedback()
    assert len(link.feedback()) == 0
    link._results.close()
