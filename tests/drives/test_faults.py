"""The fault list: every row injected, the reaction demanded."""

from pathlib import Path

import numpy as np
import pytest
from bench import Bench
from bridge_cases import BRIDGE_CASES, run_bridge
from fault_cases import CASES
from fault_runs import run
from odd_cases import ODD, tolerate
from refusal_cases import BAD_ROWS, REFUSALS, refuse, reject
from trajectories import PAPER, run_of

from cdhr_host.drives import LinkState
from cdhr_host.drives.canopen.scaling import Scaling
from cdhr_host.drives.reference import ReferenceStore
from cdhr_host.errors import DriveError
from cdhr_host.job import stream
from cdhr_host.plant.disturbances import Stuck

ZERO = np.zeros(6)


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.row} {case.fault}")
def test_fault_while_moving(case):
    run(case)


@pytest.mark.parametrize("case", BRIDGE_CASES, ids=lambda case: f"{case.row} {case.fault}")
def test_fault_of_the_framed_link_while_moving(case):
    run_bridge(case)


@pytest.mark.parametrize("case", REFUSALS, ids=lambda case: f"{case.row} {case.fault}")
def test_fault_before_anything_moves(case):
    refuse(case)


@pytest.mark.parametrize("case", BAD_ROWS, ids=lambda case: case.fault)
def test_22_rows_are_refused_before_the_wire(case):
    reject(case)


def test_page_has_every_row_of_the_fault_list():
    """All 26 have cases, and the page shows these cases."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "faults.md").read_text(encoding="utf-8")
    shown = {line.split("|")[1].strip() for line in page.splitlines() if line.startswith("| ")}
    numbers = {int(row.split()[0]) for row in shown if row[:1].isdigit()}
    assert numbers == set(range(1, 27))
    for case in (*CASES, *BRIDGE_CASES, *REFUSALS, *ODD):
        assert f"| {case.row} | {case.fault} | {case.injected} |" in page


def refused(bench, said):
    """Opening is refused with these words, and the link stays closed."""
    with pytest.raises(DriveError, match=said):
        bench.link.open()
    assert bench.link.state is LinkState.CLOSED
    assert not any(drive.following for drive in bench.far.drives)


def test_12_swapped_node_ids_are_named():
    bench = Bench()
    bench.far.drives[0].dictionary.fixed((0x1018, 4), 102)
    bench.far.drives[1].dictionary.fixed((0x1018, 4), 101)
    with pytest.raises(DriveError, match="Serial number is 102") as caught:
        bench.link.open()
    assert caught.value.problems[0].hint == "that is drive 2: node ids are swapped"


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ((0x6092, 1), 20000, r"drive 3: 0x6092:01 Feed makes 20000 units a motor turn, the profile 40000"),
        ((0x6076, 0), 640, r"drive 3: 0x6076:00 Motor rated torque = 640 mN m"),
    ],
)
def test_11_other_units_or_motors_are_refused(key, value, said):
    bench = Bench()
    bench.far.drives[2].dictionary.fixed(key, value)
    refused(bench, said)


def _writes(node):
    """Every object bring-up writes on a node."""
    bench, keys = Bench(), []
    dictionary = bench.far.nodes[node - 1].dictionary
    plain = dictionary.download
    dictionary.download = lambda key, data: keys.append(key) or plain(key, data)
    bench.opened().close()
    return sorted(set(keys))


@pytest.mark.parametrize("node", [1, 7])
def test_13_every_configuration_write_that_is_refused_is_named(node):
    keys = _writes(node)
    assert len(keys) > (30 if node == 1 else 20)
    for index, sub in keys:
        bench = Bench()
        bench.far.nodes[node - 1].sdo.refused[index, sub] = 0x08000022
        refused(bench, f"0x{index:04X}:{sub:02X} .*refuses.*0x08000022")


@pytest.mark.parametrize("key", [(0x6065, 0), (0x1600, 2), (0x1A00, 0), (0x60C2, 1), (0x1016, 1)])
def test_13_read_back_that_differs(key):
    bench = Bench()
    bench.far.drives[5].sdo.altered[key] = 5
    refused(bench, rf"drive 6: 0x{key[0]:04X}:{key[1]:02X} .* reads back 5, written was")


@pytest.mark.parametrize("case", ODD, ids=lambda case: f"{case.row} {case.fault}")
def test_odd_nodes_are_tolerated_and_noted(case):
    tolerate(case)


def test_18_counter_in_sync_where_all_nodes_accept_it():
    bench = Bench(sync_counter=True).opened()
    assert bench.link.machine.found.sync_counter
    bench.close()


def test_11_reference_of_a_node_that_was_reset_is_gone(tmp_path):
    store = ReferenceStore(tmp_path / "references.json")
    bench = Bench(reference="stored", store=store).opened()
    bench.link.set_reference()
    bench.link.arm(ZERO)
    bench.far.drives[1].reset(bench.clock.now())
    bench.user.wait_until(bench.clock.now() + 0.5)
    bench.close()
    again = Bench(reference="stored", store=store).opened()
    with pytest.raises(DriveError, match="not referenced: drive 2; nothing may move"):
        again.link.arm(ZERO)
    again.close()


@pytest.mark.parametrize("position", [300.0, -215.0])
def test_22_positions_beyond_32_bit_are_refused_before_the_wire(position):
    with pytest.raises(DriveError, match="does not fit 32-bit position units"):
        Scaling(PAPER).counts(np.full((1, 6), position))


@pytest.mark.parametrize("moment", ["held", "homing"])
def test_26_emergency_stop_never_resumes_by_itself(moment):
    bench = Bench(reference="homing" if moment == "homing" else "drive").opened()
    if moment == "homing":
        bench.far.drives[3].home_at = 500_000
        bench.far.press(True)
        with pytest.raises(DriveError):
            bench.link.home()
    else:
        bench.link.arm(ZERO)
        bench.far.press(True)
    bench.user.wait_until(bench.clock.now() + 0.3)
    bench.far.press(False)
    bench.user.wait_until(bench.clock.now() + 1.0)
    assert not any(drive.following for drive in bench.far.drives)
    assert bench.far.coupler.output == 0
    bench.close()


def test_unreferenced_machine_is_not_armed_and_says_what_to_do(tmp_path):
    store = ReferenceStore(tmp_path / "references.json")
    bench = Bench(reference="stored", store=store)
    bench.far.stand(np.full(6, 0.01))
    bench.opened()
    with pytest.raises(DriveError, match="not referenced: drive 1, 2, 3, 4, 5, 6") as caught:
        bench.link.arm(ZERO)
    assert "cdhr drives reference" in caught.value.problems[0].hint
    bench.link.set_reference()
    bench.link.arm(ZERO)
    rows = run_of(200)
    bench.link.feed(rows)
    bench.user.wait_until(bench.clock.now() + 1.2)
    feedback = bench.link.feedback()
    assert np.abs(feedback.setpoint - rows.slider).max() <= bench.link.resolution
    assert bench.far.state.slider[0] == pytest.approx(0.01, abs=1e-4)
    bench.close()
    again = Bench(reference="stored", store=store).opened()
    again.link.machine.watch.unreferenced.add(2)
    again.far.disturb(Stuck(0, 0))
    with pytest.raises(DriveError, match="not referenced: drive 3"):
        again.link.arm(ZERO)
    again.close()


def test_homing_references_one_slider_after_the_other(tmp_path):
    bench = Bench(reference="homing", homing_method=17, store=ReferenceStore(tmp_path / "r.json")).opened()
    for drive in bench.far.drives:
        drive.home_at = 20_000
    with pytest.raises(DriveError, match="not referenced"):
        bench.link.arm(ZERO)
    told = []
    bench.link.home(told.append)
    assert told == [1, 2, 3, 4, 5, 6]
    assert bench.far.state.slider == pytest.approx(np.full(6, 2e-3), abs=5e-5)
    assert all(drive.values[0x6061, 0] == 8 for drive in bench.far.drives)
    bench.link.arm(ZERO)
    bench.close()


def test_homing_can_be_interrupted_and_leaves_the_machine_unreferenced(tmp_path):
    bench = Bench(reference="homing", homing_method=17, store=ReferenceStore(tmp_path / "r.json")).opened()
    for drive in bench.far.drives:
        drive.home_at = 200_000
    work = bench.clock.work

    def watched(now):
        work(now)
        if abs(bench.far.state.slider[0]) > 1e-3:
            bench.link.interrupt()

    bench.clock.work = watched
    with pytest.raises(DriveError, match="homing was stopped at drive 1"):
        bench.link.home()
    assert bench.far.state.slider[0] == pytest.approx(1e-3, abs=2e-4)
    assert bench.far.state.slider[1:] == pytest.approx(np.zeros(5), abs=1e-6)
    assert not bench.link.referenced
    bench.clock.work = work
    bench.user.wait_until(bench.clock.now() + 0.5)
    assert not any(drive.following for drive in bench.far.drives)
    bench.close()


def test_homing_holds_until_the_drives_lose_their_power(tmp_path):
    """A later session finds the marks homing left in the drives; a power cycle takes them away."""
    store = ReferenceStore(tmp_path / "r.json")
    bench = Bench(reference="homing", homing_method=35, store=store).opened()
    assert not bench.link.referenced
    bench.link.home()
    assert bench.link.referenced
    bench.link.close()
    bench.link.open()
    assert bench.link.referenced
    bench.link.arm(ZERO)
    bench.link.close()
    bench.far.drives[2].reset(bench.clock.now())
    bench.link.open()
    assert not bench.link.referenced
    with pytest.raises(DriveError, match="not referenced") as caught:
        bench.link.arm(ZERO)
    assert "cdhr drives home" in caught.value.problems[0].hint
    bench.close()


def test_homing_changes_nothing_where_the_drives_know_their_place():
    bench = Bench(reference="drive").opened()
    bench.link.home()
    assert bench.link.referenced
    assert bench.far.state.slider == pytest.approx(ZERO)
    bench.close()


def test_stored_reference_is_where_the_sliders_are_told_from(tmp_path):
    store = ReferenceStore(tmp_path / "references.json")
    bench = Bench(reference="stored", store=store)
    bench.far.stand(np.full(6, 0.01))
    bench.opened()
    bench.link.set_reference()
    assert bench.link.slider == pytest.approx(ZERO, abs=1e-6)
    bench.link.close()
    bench.link.open()
    assert bench.link.slider == pytest.approx(ZERO, abs=1e-6)
    bench.close()


@pytest.mark.parametrize("soft", [True, False])
def test_4_answers_that_come_40_ms_late_are_no_following_error(soft):
    """Where soft real time is allowed the print goes on; otherwise the silence stops it."""
    bench = Bench(allow_soft_realtime=soft, setpoint_watchdog=0.1).opened()
    late, port = [], bench.wire.port

    def work(now):
        sent, port.sent = port.sent, []
        late.append((now + 0.04 * (now > start + 0.5), bench.far.exchange(now, sent)))
        port.arrived += [frame for when, frames in late if when <= now for frame in frames]
        late[:] = [entry for entry in late if entry[0] > now]

    start = bench.clock.now()
    bench.wire.work = work
    found = None
    try:
        stream(iter([run_of(700, seed=5)]), bench.link, bench.user, start=ZERO)
    except DriveError as error:
        found = error.problems[0].kind
    assert found == (None if soft else "feedback-lost")
    bench.close()
