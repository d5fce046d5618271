"""The framed link: frames, garbled lines, and every way a bridge refuses."""

import random
import zlib

import numpy as np
import pytest
from bench import BridgeBench
from golden_frames import PAGE, golden, section
from hypothesis import given, settings
from hypothesis import strategies as st
from trajectories import PAPER, run_of

from cdhr_host.drives import LinkState
from cdhr_host.drives.bridge.frames import Frame, Reader, Type, decoded, encoded, stuffed, unstuffed
from cdhr_host.drives.bridge.messages import NAKS, SETPOINTS, config, tick
from cdhr_host.drives.sim.bridge import Bridge
from cdhr_host.drives.sim.framing import cobs, plain
from cdhr_host.errors import DriveError
from cdhr_host.motion.hold import path_true_stop

ZERO = np.zeros(6)


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=600))
def test_both_ends_stuff_alike_though_they_share_no_code(data):
    assert unstuffed(stuffed(data)) == data == plain(cobs(data))
    assert plain(stuffed(data)) == data == unstuffed(cobs(data))
    assert 0 not in stuffed(data)


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=80))
def test_noise_is_no_frame(data):
    assert decoded(data) is None
    assert plain(data) is None or isinstance(plain(data), bytes)


@given(st.integers(0, 2**32))
@settings(max_examples=200, deadline=None)
def test_changed_bytes_are_noticed(seed):
    chance = random.Random(seed)
    data = bytearray(encoded(Frame(Type.SETPOINTS, 7, 3, 99, chance.randbytes(168)))[:-1])
    for _ in range(chance.randint(1, 5)):
        data[chance.randrange(len(data))] ^= chance.randint(1, 255)
    frame = decoded(bytes(data))
    assert frame is None or frame.payload == b""


def test_reader_finds_frames_after_noise_and_in_halves():
    reader, text = Reader(), encoded(Frame(Type.STOP, 1, 0, 5, b"\0"))
    assert reader.frames(b"\x05abc\0" + text[:4]) == []
    assert reader.frames(text[4:]) == [Frame(Type.STOP, 1, 0, 5, b"\0")]
    assert reader.dropped == 1


def test_golden_frames_of_the_page():
    """docs/link.md shows the bytes of these frames, and nothing else."""
    page = PAGE.read_text(encoding="utf-8")
    assert page[page.index("## 10. Golden frames") :] == section()
    assert {frame.type for frame in golden().values()} >= set(Type) - {
        Type.DISARM,
        Type.HELLO_ACK,
        Type.OD_WRITE_ACK,
    }


def _printed(bench, rows, until=lambda: False):
    link, parts, left = bench.link, [], rows
    link.arm(ZERO)
    while (len(left) or link.buffered) and not until():
        if len(left):
            left = left[link.feed(left) :]
        bench.user.wait_until(bench.clock.now() + 0.02)
        parts.append(link.feedback())
    return parts


@pytest.mark.parametrize("side", ["inbound", "outbound"])
def test_5_garbled_frames_are_dropped_counted_and_sent_again(side):
    bench, chance = BridgeBench(), random.Random(3)

    def garble(data):
        if not data or chance.random() > 0.1:
            return data
        spoilt = bytearray(data)
        spoilt[chance.randrange(len(spoilt))] ^= 0x41
        return bytes(spoilt)

    bench.link.open()
    setattr(bench, side, garble)
    rows = run_of(900)
    feedback = [part for part in _printed(bench, rows) if len(part)]
    setattr(bench, side, lambda data: data)
    assert sum(map(len, feedback)) == 900
    wanted = np.rint(rows.slider / bench.link.resolution).astype(int)
    assert (np.array(bench.far.received)[:, :6] == wanted).all()
    bench.close()


def _sent(bench, start, rows, flags=0, session=None):
    """SETPOINTS straight from the wire, past the host's own checks."""
    body = b"".join(tick(np.array(row), np.zeros(6, dtype=np.int64), 0.0) for row in rows)
    payload = SETPOINTS.pack(start, len(rows), 6, flags, 0) + body
    session = bench.link.session.number if session is None else session
    bench.far.exchange(bench.clock.now(), encoded(Frame(Type.SETPOINTS, 1, 0, session, payload)))


def _armed():
    bench = BridgeBench()
    bench.link.open()
    bench.link.arm(ZERO)
    bench.naks = []
    plain_nak = bench.far._nak
    bench.far._nak = lambda refused: (bench.naks.append(NAKS[refused.reason]), plain_nak(refused))
    _sent(bench, 10, [[0] * 6] * 4)
    assert bench.far.store.expected == 14
    return bench


def test_24_gap_is_refused():
    bench = _armed()
    _sent(bench, 16, [[0] * 6])
    assert bench.naks == ["gap"]
    assert bench.far.store.expected == 14


def test_24_duplicate_is_ignored():
    bench = _armed()
    _sent(bench, 10, [[0] * 6] * 4)
    assert (bench.naks, len(bench.far.store.ticks), bench.far.code) == ([], 4, 0)


def test_24_overlap_with_other_content_is_a_fault():
    bench = _armed()
    _sent(bench, 12, [[1] * 6] * 2)
    assert bench.far.code.name == "OVERLAP"


def test_24_frames_of_another_session_move_nothing():
    bench = _armed()
    _sent(bench, 14, [[0] * 6], session=bench.link.session.number ^ 1)
    assert bench.far.store.expected == 14
    assert bench.far.dropped == 1


def test_24_credit_overrun_is_refused():
    bench = _armed()
    for start in range(14, 1100, 8):
        _sent(bench, start, [[0] * 6] * 8)
        if bench.naks:
            break
    assert bench.naks == ["overflow"]
    assert len(bench.far.store.ticks) <= 1024


@pytest.mark.parametrize(
    ("row", "code"), [([11_000_000, 0, 0, 0, 0, 0], "RANGE"), ([0, 9000, 0, 0, 0, 0], "STEP")]
)
def test_24_violation_is_a_fault_and_never_clipped(row, code):
    bench = _armed()
    _sent(bench, 14, [row])
    assert bench.far.code.name == code
    assert len(bench.far.store.ticks) == 4


def _revised(bench, start, rows, flags, number):
    body = b"".join(tick(np.array(row), np.zeros(6, dtype=np.int64), 0.0) for row in rows)
    payload = SETPOINTS.pack(start, len(rows), 6, flags, number) + body
    bench.far.exchange(
        bench.clock.now(), encoded(Frame(Type.REVISE, 1, 0, bench.link.session.number, payload))
    )


def _stored(bench):
    return [row[0] for row in bench.far.store.ticks]


def test_revision_is_kept_aside_until_its_last_frame():
    bench = _armed()
    _revised(bench, 12, [[3] * 6] * 8, 0, 1)
    _revised(bench, 20, [[3] * 6] * 8, 0, 1)
    _revised(bench, 12, [[4] * 6] * 8, 0, 1)
    assert _stored(bench) == [0] * 4
    _revised(bench, 28, [[3] * 6] * 2, 2, 1)
    assert _stored(bench) == [0] * 2 + [3] * 18
    assert (bench.far.store.expected, bench.far.store.revision) == (30, 1)
    _revised(bench, 28, [[5] * 6] * 2, 2, 1)
    assert (_stored(bench), bench.naks) == ([0] * 2 + [3] * 18, [])


def test_revision_with_a_lost_frame_is_not_carried_out():
    bench = _armed()
    _revised(bench, 12, [[3] * 6] * 8, 0, 1)
    _revised(bench, 28, [[3] * 6] * 2, 2, 1)
    assert (bench.naks, _stored(bench)) == (["gap"], [0] * 4)


@pytest.mark.parametrize(("start", "said"), [(11, "late"), (15, "late")])
def test_revision_of_a_tick_that_is_due_or_behind_a_gap_is_refused(start, said):
    bench = _armed()
    _revised(bench, start, [[0] * 6], 2, 1)
    assert (bench.naks, _stored(bench)) == ([said], [0] * 4)


def test_revision_is_checked_like_other_setpoints():
    bench = _armed()
    _revised(bench, 12, [[9000] * 6], 2, 1)
    assert bench.far.code.name == "STEP"


@pytest.mark.parametrize("side", ["inbound", "outbound"])
def test_revision_over_a_bad_line_is_done_or_refused_but_never_half(side):
    chance, kinds = random.Random(11), set()
    for _ in range(8):
        bench = BridgeBench()
        bench.link.open()
        rows = run_of(900, seed=4)
        bench.link.arm(ZERO)
        fed = bench.link.feed(rows)
        bench.user.wait_until(bench.clock.now() + 0.2)
        setattr(bench, side, lambda data: data if chance.random() > 0.2 else data[:-3])
        first = bench.link.revisable
        hold = path_true_stop(rows[first:fed], PAPER)
        wanted = np.vstack([rows.slider[:first], hold.slider])
        try:
            bench.link.revise(hold)
            rest = rows[:0]
        except DriveError as refused:
            kinds.add(refused.problems[0].kind)
            wanted, rest = rows.slider, rows[fed:]
        setattr(bench, side, lambda data: data)
        while len(rest) or bench.link.buffered:
            rest = rest[bench.link.feed(rest) :]
            bench.user.wait_until(bench.clock.now() + 0.02)
        assert (np.array(bench.far.received)[:, :6] == np.rint(wanted / bench.link.resolution)).all()
    assert kinds <= {"late-revision"}


def test_24_other_config_cannot_arm():
    bench = BridgeBench()
    bench.link.open()
    bench.far._config = config(PAPER)[:-1] + b"\xff"
    with pytest.raises(DriveError, match="the bridge does not arm"):
        bench.link.arm(ZERO)


def test_24_rebooted_bridge_ignores_the_old_session():
    bench = BridgeBench()
    bench.link.open()
    bench.far = Bridge(PAPER, bench.clock.now())
    with pytest.raises(DriveError, match="the bridge does not arm"):
        bench.link.arm(ZERO)


@pytest.mark.parametrize("fed", [330, 340, 352, 500])
def test_24_underrun_at_any_point_stops_on_the_path(fed):
    bench = BridgeBench()
    bench.link.open()
    rows = run_of(900)
    with pytest.raises(DriveError, match="ran out of setpoints"):
        _starved(bench, rows[:fed])
    bench.user.wait_until(bench.clock.now() + 2.0)
    assert bench.link.state is LinkState.FAULT
    first = bench.link.stop_tick
    stop = bench.link.stop_rows(rows[first:fed])
    received = np.array(bench.far.received)
    assert (received[:first, :6] == np.rint(rows.slider[:first] / bench.link.resolution)).all()
    assert (received[first:, :6] == np.rint(stop.slider / bench.link.resolution)).all()
    assert not received[first:, 6].any()


def _starved(bench, rows):
    bench.link.arm(ZERO)
    for _ in range(300):
        if len(rows):
            rows = rows[bench.link.feed(rows) :]
        bench.user.wait_until(bench.clock.now() + 0.02)
        bench.link.feedback()


def test_21_silent_host_is_stopped_by_the_watchdog():
    bench = BridgeBench()
    bench.link.open()
    bench.link.arm(ZERO)
    rows = run_of(900)
    bench.link.feed(rows[: bench.link.free])
    bench.user.wait_until(bench.clock.now() + 0.1)
    assert bench.far.state.name == "RUN"
    bench.clock.stall(0.3)
    assert bench.far.code.name == "LINK_LOST"
    bench.clock.stall(1.0)
    assert bench.far.state.name == "FAULT"
    assert bench.far.received[-1][6] == 0
    bench.user.wait_until(bench.clock.now() + 0.1)
    with pytest.raises(DriveError, match="heard nothing of the host"):
        bench.link.feedback()


def test_26_emergency_stop_is_reported_and_never_resumed():
    bench = BridgeBench()
    bench.link.open()
    with pytest.raises(DriveError, match="emergency stop is pressed"):
        _printed(bench, run_of(900), lambda: setattr(bench.far, "estop", len(bench.far.received) > 100))
    bench.far.estop = False
    bench.user.wait_until(bench.clock.now() + 2.0)
    assert bench.far.state.name == "FAULT"
    assert bench.far.received[-1][6] == 0


def test_crc_is_the_one_of_ieee_802_3():
    assert zlib.crc32(b"123456789") == 0xCBF43926
