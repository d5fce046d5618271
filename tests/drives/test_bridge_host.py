"""What the host asks of a bridge besides setpoints: time, rate, objects, a fault's end."""

import math

import numpy as np
import pytest
from bench import BridgeBench, MemoryLine
from hypothesis import given, settings
from hypothesis import strategies as st
from trajectories import PAPER, PERIOD, run_of

from cdhr_host.drives import LinkState, commission
from cdhr_host.drives.bridge.clock_sync import ClockSync
from cdhr_host.drives.bridge.frames import Frame, Type, encoded
from cdhr_host.drives.bridge.messages import SETPOINTS, tick
from cdhr_host.drives.bridge.objects import BridgeObjects
from cdhr_host.drives.canopen.bus import Abort
from cdhr_host.drives.sim.bridge import Bridge
from cdhr_host.drives.sim.pace import ONE, Pace
from cdhr_host.errors import DriveError

ZERO = np.zeros(6)


@pytest.fixture
def bench():
    bench = BridgeBench()
    bench.link.open()
    yield bench
    bench.close()


def _running(bench, rows):
    bench.link.arm(ZERO)
    fed = bench.link.feed(rows)
    bench.user.wait_until(bench.clock.now() + 0.2)
    return rows[fed:]


def _seen(bench, rest):
    """Feed and wait until all of it was played."""
    while len(rest) or bench.link.buffered:
        rest = rest[bench.link.feed(rest) :]
        bench.user.wait_until(bench.clock.now() + 0.02)
    return np.array(bench.far.received)


@given(st.floats(-500e-6, 500e-6), st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
def test_drift_and_round_trip_are_found_through_a_jittery_line(drift, seed):
    chance, sync = np.random.default_rng(seed), ClockSync()
    now = 10.0
    for _ in range(60):
        there = 0.002 + chance.exponential(0.002)
        back = 0.002 + chance.exponential(0.002)
        far = (now + there) * (1.0 + drift) + 77.0
        sync.add(now, now + there + back, far, round(far / PERIOD))
        now += 0.25
    assert 0.004 <= sync.round_trip < 0.006
    assert sync.drift == pytest.approx(drift, abs=150e-6)
    real = (now * (1.0 + drift) + 77.0) / PERIOD
    assert abs(sync.playing(now, PERIOD) - real) <= 3.0


def test_host_knows_the_round_trip_and_asks_again_by_it(bench):
    before = bench.link.retry
    bench.user.wait_until(bench.clock.now() + 2.0)
    assert bench.link.sync.exchanges >= 4
    assert 0.0 < bench.link.sync.round_trip <= 0.02
    assert bench.link.retry == pytest.approx(max(0.02, 2 * bench.link.sync.round_trip) + 0.03)
    assert abs(bench.link.sync.drift) < 1e-3
    assert before <= bench.link.retry


@pytest.mark.parametrize("ramp", [1, 7, 100, 333])
@pytest.mark.parametrize("fraction", [0, 1, 40_000])
def test_ramp_back_to_full_rate_ends_on_a_stored_tick(ramp, fraction):
    pace = Pace()
    pace.change(0, ramp, fraction)
    time = fraction + sum(pace.step() for _ in range(ramp))
    assert (pace.rate, pace.steady) == (0, True)
    pace.change(1000, ramp, time % ONE)
    steps = [pace.step() for _ in range(ramp)]
    assert (time + sum(steps)) % ONE == 0
    assert max(steps) <= ONE + math.ceil(ONE / ramp)
    assert pace.step() == ONE


def test_hold_at_the_bridge_stays_on_the_path_without_air_and_goes_on_as_planned(bench):
    rows = run_of(1500, seed=4)
    rest = _running(bench, rows)
    bench.link.set_rate(0.0, 0.4)
    bench.user.wait_until(bench.clock.now() + 1.0)
    assert bench.link.held
    assert bench.far.state.name == "HELD"
    assert bench.far.air == 0
    standing = len(bench.far.received)
    bench.user.wait_until(bench.clock.now() + 1.0)
    assert len(bench.far.received) == standing
    rest = rest[bench.link.feed(rest) :]
    bench.user.wait_until(bench.clock.now() + 0.1)
    bench.link.set_rate(1.0, 0.4)
    received = _seen(bench, rest)
    planned = np.rint(rows.slider / bench.link.resolution).astype(int)
    first = next(k for k, row in enumerate(received[:, :6]) if (row != planned[k]).any())
    assert standing - 110 < first < standing
    assert not received[first:standing, 6].any()
    after = len(planned) - 300
    assert (received[-300:, :6] == planned[after:]).all()
    step = np.abs(np.diff(received[:, :6], axis=0)).max()
    assert step <= 1.02 * np.abs(np.diff(planned, axis=0)).max() + 1
    for row in received[first : standing + 100, :6]:
        assert np.abs(row - _nearest(planned, row)).max() <= 2
    bench.link.stop()
    assert bench.link.state is LinkState.STOPPED


def _nearest(planned, row):
    """The nearest point of the chords of the plan."""
    begin, along = planned[:-1].astype(float), np.diff(planned, axis=0).astype(float)
    length = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip(((row - begin) * along).sum(axis=1) / length, 0.0, 1.0)
    points = begin + share[:, None] * along
    return points[((points - row) ** 2).sum(axis=1).argmin()]


def test_half_rate_takes_twice_as_long(bench):
    rows = run_of(1000, seed=4)
    rest = _running(bench, rows)
    bench.link.set_rate(0.5, 0.1)
    received = _seen(bench, rest)
    assert len(received) == pytest.approx(2000 - 60, abs=40)
    assert np.abs(received[-1, :6] - np.rint(rows.slider[-1] / bench.link.resolution)).max() <= 1


def test_stop_from_a_hold_is_the_end(bench):
    _running(bench, run_of(1500, seed=4))
    bench.link.set_rate(0.0, 0.1)
    bench.user.wait_until(bench.clock.now() + 0.5)
    assert bench.link.held
    bench.link.stop()
    assert bench.link.state is LinkState.STOPPED
    with pytest.raises(DriveError, match="the drives are stopped"):
        bench.link.set_rate(1.0, 0.1)


def test_watchdog_works_in_a_hold_too(bench):
    _running(bench, run_of(1500, seed=4))
    bench.link.set_rate(0.0, 0.1)
    bench.user.wait_until(bench.clock.now() + 0.5)
    bench.clock.stall(0.3)
    assert (bench.far.state.name, bench.far.code.name) == ("FAULT", "LINK_LOST")


def _straight(bench, start, rows, pressure, flags):
    body = b"".join(tick(np.array(row), np.zeros(6, dtype=np.int64), pressure) for row in rows)
    payload = SETPOINTS.pack(start, len(rows), 6, flags, 0) + body
    number = bench.link.session.number
    bench.far.exchange(bench.clock.now(), encoded(Frame(Type.SETPOINTS, 1, 0, number, payload)))


def test_air_never_outlives_its_output(bench):
    """A host that flags rest but leaves the air on: the bridge vents by itself."""
    bench.link.arm(ZERO)
    _straight(bench, 0, [[0] * 6] * 8, 50e3, 1)
    bench.user.wait_until(bench.clock.now() + 8 * PERIOD)
    assert bench.far.air == 500
    bench.user.wait_until(bench.clock.now() + PAPER.link.pressure_hold + 2 * PERIOD)
    assert bench.far.air == 0
    assert bench.far.state.name == "RUN"


def test_bridge_that_is_late_itself_stops_and_says_so(bench):
    _running(bench, run_of(1500, seed=4))
    work, bench.clock.work = bench.clock.work, lambda now: None
    bench.clock.wait_until(bench.clock.now() + 0.05)
    bench.clock.work = work
    played = len(bench.far.received)
    bench.user.wait_until(bench.clock.now() + 0.02)
    assert len(bench.far.received) - played < 10
    bench.user.wait_until(bench.clock.now() + 0.2)
    with pytest.raises(DriveError, match="the bridge itself was late") as caught:
        bench.link.feedback()
    assert caught.value.problems[0].kind == "setpoint-late"
    bench.user.wait_until(bench.clock.now() + 1.0)
    assert bench.link.state is LinkState.FAULT


def test_fault_of_the_machine_waits_for_an_operator():
    bench = BridgeBench()
    bench.link.open()
    _running(bench, run_of(900))
    bench.far.estop = True
    bench.user.wait_until(bench.clock.now() + 1.5)
    bench.link.close()
    bench.link.open()
    with pytest.raises(DriveError, match="the emergency stop is pressed; nothing may move"):
        bench.link.arm(bench.link.slider)
    with pytest.raises(DriveError, match="the bridge stays in fault"):
        bench.link.fault_reset()
    bench.far.estop = False
    bench.link.fault_reset()
    bench.user.wait_until(bench.clock.now() + 0.1)
    assert bench.far.state.name == "IDLE"
    bench.link.arm(bench.link.slider)
    bench.close()


def test_fault_of_the_link_ends_when_it_is_opened_anew():
    bench = BridgeBench()
    bench.link.open()
    _running(bench, run_of(900))
    bench.clock.stall(2.0)
    assert bench.far.code.name == "LINK_LOST"
    bench.link.close()
    bench.link.open()
    bench.link.arm(bench.link.slider)
    bench.close()


@pytest.fixture
def objects():
    bench = BridgeBench()
    bench.line = MemoryLine()
    found = BridgeObjects(bench.clock, lambda: bench.line)
    found.bench = bench
    yield found
    found.close()


def test_objects_of_the_drives_are_read_and_written_through_the_bridge(objects):
    nodes = commission.scan(objects)
    assert [node.id for node in nodes] == [1, 2, 3, 4, 5, 6, 7]
    assert [node.serial for node in nodes[:6]] == PAPER.canopen.drive_serials
    said = commission.write_object(objects, 2, 0x6065, 0, 5000)
    assert said == "0x6065:00 Following error window = 5000 (0x1388)"
    with pytest.raises(DriveError, match=r"0x6041:00 Statusword refuses 1: .*read only"):
        commission.write_object(objects, 2, 0x6041, 0, 1)
    with pytest.raises(DriveError, match=r"0x5FFF:00 cannot be read: .*Object does not exist"):
        commission.read_object(objects, 2, 0x5FFF, 0)
    with pytest.raises(Abort, match="0x05040000"):
        objects.read(9, 0x1000)


def test_operator_ends_a_fault_through_the_objects(objects):
    objects.bench.far._trip(objects.bench.far.code.__class__.FOLLOWING, 2)
    assert objects.bench.far.state.name == "FAULT"
    commission.reset(objects, 3)
    assert objects.bench.far.state.name == "IDLE"


def test_nothing_is_written_while_the_machine_moves(bench):
    _running(bench, run_of(900))
    payload = Bridge(PAPER, 0.0)._objects.write(b"\x02\x65\x60\x00\x04\x00\x88\x13\x00\x00", standing=False)
    assert int.from_bytes(payload[4:8], "little") == 0x08000022
