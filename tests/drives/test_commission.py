"""Commissioning without a cycle, and how full the bus is."""

import pytest
from bench import Bench
from trajectories import PAPER

from cdhr_host.drives import commission
from cdhr_host.drives.canopen.bus import Bus, object_place
from cdhr_host.drives.canopen.cia402 import State
from cdhr_host.drives.canopen.load import bus_load, bus_share, frame_bits
from cdhr_host.drives.timing import Lateness
from cdhr_host.errors import DriveError, ProfileError


@pytest.fixture
def bench():
    bench = Bench()
    bench.clock.stall(0.01)
    bench.bus = Bus(bench.wire.port, bench.clock)
    return bench


def test_scan_finds_seven_nodes(bench):
    nodes = commission.scan(bench.bus)
    assert [node.id for node in nodes] == [1, 2, 3, 4, 5, 6, 7]
    assert [node.serial for node in nodes[:6]] == PAPER.canopen.drive_serials
    assert nodes[0].kind == "servo drive (CiA 402)"
    assert nodes[6].kind == "coupler (CiA 401)"


def test_objects_are_read_and_written_with_their_names(bench):
    assert commission.read_object(bench.bus, 2, 0x1018, 4) == "0x1018:04 Serial number = 102 (0x66)"
    assert commission.read_object(bench.bus, 2, 0x1008, 0).endswith("= Simulated servo drive")
    written = commission.write_object(bench.bus, 2, 0x6065, 0, 5000)
    assert written == "0x6065:00 Following error window = 5000 (0x1388)"
    with pytest.raises(DriveError, match=r"0x6041:00 Statusword refuses 1: .*read only"):
        commission.write_object(bench.bus, 2, 0x6041, 0, 1)
    with pytest.raises(DriveError, match=r"0x5FFF:00 cannot be read: .*Object does not exist"):
        commission.read_object(bench.bus, 2, 0x5FFF, 0)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("0x6065", (0x6065, 0)),
        ("1018:4", (0x1018, 4)),
        ("0x1018:0x0A", (0x1018, 10)),
        ("Following  Error Window", (0x6065, 0)),
        ("serial number", (0x1018, 4)),
        ("identity object: vendor-id", (0x1018, 1)),
    ],
)
def test_objects_have_numbers_and_names(text, place):
    assert object_place(3, text) == place


@pytest.mark.parametrize(
    ("text", "near"),
    [("folowing eror window", "did you mean 'following error window'"), ("0x6065:-1", ""), ("0x1FFFFF", "")],
)
def test_objects_that_are_none_are_refused_with_the_nearest_name(text, near):
    with pytest.raises(DriveError, match="is no object of drive 3") as caught:
        object_place(3, text)
    assert near in caught.value.problems[0].hint


@pytest.mark.parametrize(
    ("index", "value", "limits"),
    [
        (0x6065, 1 << 32, "0 to 4294967295"),
        (0x6065, -1, "0 to 4294967295"),
        (0x6060, 128, "-128 to 127"),
        (0x607A, -(1 << 31) - 1, "-2147483648 to 2147483647"),
    ],
)
def test_numbers_that_do_not_fit_are_refused_and_not_cut(bench, index, value, limits):
    before = bench.far.drives[2].values[index, 0]
    with pytest.raises(DriveError, match=f"{value} does not fit .*: {limits}"):
        commission.write_object(bench.bus, 3, index, 0, value)
    assert bench.far.drives[2].values[index, 0] == before


def test_status_and_reset_of_a_drive_in_fault(bench):
    bench.far.drives[2].fault(0x2310)
    third = list(commission.status(bench.bus, PAPER.canopen))[2]
    assert (third.state, third.error) == (State.FAULT, "0x2310 continuous over-current")
    assert commission.reset(bench.bus, 3) is State.SWITCH_ON_DISABLED
    assert list(commission.status(bench.bus, PAPER.canopen))[2].error == "none"
    bench.far.drives[3].fault(0x3210)
    bench.far.drives[3].stubborn.add(bench.far.drives[3].drive_state)
    with pytest.raises(DriveError, match="drive 4 stays in fault: 0x3210"):
        commission.reset(bench.bus, 4)
    with pytest.raises(DriveError, match="the coupler is no drive"):
        commission.reset(bench.bus, 7)


def _with(period, **settings):
    return PAPER.model_copy(
        update={
            "drives": PAPER.drives.model_copy(update={"period": period}),
            "canopen": PAPER.canopen.model_copy(update=settings),
        }
    )


def test_worst_case_bits_are_those_of_the_standard():
    assert [frame_bits(length) for length in (0, 1, 8)] == [55, 65, 135]


def test_bus_load_of_periods_and_its_limit():
    assert bus_load(PAPER).share == pytest.approx(0.50, abs=0.02)
    assert bus_share(_with(0.002, feedback_every=4)) < 0.70
    with pytest.raises(ProfileError, match=r"the CAN bus would be \d+% full in the worst case \(limit 70%\)"):
        bus_share(_with(0.002))


def test_budget_of_late_cycles():
    strict, soft = Lateness(), Lateness(4)
    for lateness in (strict, soft):
        lateness.woke(1e-4)
    assert not strict.missed(1)
    assert strict.missed(1)
    assert not soft.missed(4)
    assert soft.missed(1)
    spread = Lateness()
    found = []
    for _ in range(5):
        for _ in range(20):
            spread.woke(1e-4)
        found.append(spread.missed(1))
    assert found == [False, False, False, True, True]
    assert spread.summary().skipped == 5
    assert spread.summary().p50 == pytest.approx(1e-4, abs=2e-6)
