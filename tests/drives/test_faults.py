"""The fault list: every row injected, the reaction demanded."""

from functools import partial

import numpy as np
import pytest
from bench import Bench
from fault_cases import CASES
from fault_runs import run
from trajectories import PAPER, run_of

from cdhr_host.drives import LinkState
from cdhr_host.drives.canopen.scaling import Scaling
from cdhr_host.drives.reference import ReferenceStore
from cdhr_host.drives.sim.drive import Drive, State
from cdhr_host.drives.sim.station import Station
from cdhr_host.errors import DriveError
from cdhr_host.plant.disturbances import Stuck

ZERO = np.zeros(6)


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.row} {case.fault}")
def test_fault_while_moving(case):
    run(case)


def refused(bench, said):
    """Opening is refused with these words, and the link stays closed."""
    with pytest.raises(DriveError, match=said):
        bench.link.open()
    assert bench.link.state is LinkState.CLOSED
    assert not any(drive.following for drive in bench.far.drives)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ((0x1018, 1), 0xDEAD, r"drive 3: 0x1018:01 Vendor-ID is 0xDEAD, the profile says 0x4C1"),
        ((0x1018, 2), 7, r"drive 3: 0x1018:02 Product code is 0x7"),
        ((0x1018, 4), 9, r"drive 3: 0x1018:04 Serial number is 9, the profile says 103"),
        ((0x1000, 0), 0x191, r"drive 3: 0x1000:00 Device type = 0x00000191 is not a CiA 402 device"),
        (
            (0x6502, 0),
            0x60,
            r"drive 3: 0x6502:00 Supported drive modes = 0x60: mode 8 \(csp\) is not supported",
        ),
        ((0x6092, 1), 20000, r"drive 3: 0x6092:01 Feed makes 20000 units a motor turn, the profile 40000"),
        ((0x6076, 0), 640, r"drive 3: 0x6076:00 Motor rated torque = 640 mN m"),
    ],
)
def test_12_wrong_drive(key, value, said):
    bench = Bench()
    bench.far.drives[2].dictionary.fixed(key, value)
    refused(bench, said)


def test_12_swapped_node_ids_are_named():
    bench = Bench()
    bench.far.drives[0].dictionary.fixed((0x1018, 4), 102)
    bench.far.drives[1].dictionary.fixed((0x1018, 4), 101)
    with pytest.raises(DriveError, match="Serial number is 102") as caught:
        bench.link.open()
    assert caught.value.problems[0].hint == "that is drive 2: node ids are swapped"


def test_12_two_nodes_with_one_id():
    class Twins(Station):
        @property
        def nodes(self):
            return [*super().nodes, self.__dict__.setdefault("twin", Drive(4, self.period))]

    refused(Bench(far=Twins), "node id 4 answers twice")


def test_12_missing_node():
    bench = Bench()
    bench.far.drives[4].powered = False
    refused(bench, "no answer from drive 5 in 5 s")


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


def test_13_silent_sdo_server():
    bench = Bench()
    bench.far.drives[1].sdo.silent = True
    refused(bench, "drive 2 does not answer: 0x1000:00 Device type")


def test_14_mode_not_adopted():
    bench = Bench()
    bench.far.drives[3].ignored_modes.add(8)
    refused(
        bench, "drive 4: 0x6061:00 Modes of operation display stays at 0: mode 8 was not adopted in 0.5 s"
    )


@pytest.mark.parametrize("state", [State.SWITCH_ON_DISABLED, State.READY, State.SWITCHED_ON])
def test_15_transition_that_hangs(state):
    bench = Bench().opened()
    bench.far.drives[5].stubborn.add(state)
    with pytest.raises(DriveError, match=r"drive 6 did not become .* in 1 s"):
        bench.link.arm(ZERO)
    assert bench.link.state is LinkState.OPEN
    bench.user.wait_until(bench.clock.now() + 0.2)
    assert not any(drive.following for drive in bench.far.drives)
    bench.close()


def test_19_brake_that_does_not_open():
    bench = Bench().opened()
    bench.far.drives[1].status_mask = 0xEFFF
    with pytest.raises(DriveError, match="drive 2 did not follow its target"):
        bench.link.arm(ZERO)
    bench.close()


def _spoilt(name, value):
    bench = Bench()
    setattr(bench.far.drives[0], name, value)
    return bench


@pytest.mark.parametrize(
    "bench",
    [partial(_spoilt, "autostart", True), partial(_spoilt, "boot_delay", 4.0)],
    ids=["16 starts by itself", "16 boots after 4 s"],
)
def test_16_odd_starters_are_tolerated(bench):
    far = bench().opened()
    far.link.arm(ZERO)
    far.close()


def test_16_emergency_at_boot_is_noted():
    bench = Bench()
    plain = bench.far.drives[2]._booted
    bench.far.drives[2]._booted = lambda now: (plain(now), bench.far.drives[2].emergency(0x8140))
    bench.opened()
    assert bench.link.notes == ["drive 3 sent EMCY 0x8140 at boot"]
    bench.close()


def test_8_drive_that_is_in_fault_is_not_armed():
    bench = Bench().opened()
    bench.far.drives[2].fault(0x2310)
    with pytest.raises(DriveError, match=r"0x2310"):
        bench.link.arm(ZERO)
    assert not any(drive.following for drive in bench.far.drives)
    bench.close()


def test_18_counter_in_sync_only_where_all_nodes_accept_it():
    bench = Bench(sync_counter=True).opened()
    assert bench.link.machine.found.sync_counter
    bench.close()
    bench = Bench(sync_counter=True)
    del bench.far.drives[3].dictionary.entries[0x1019, 0]
    bench.opened()
    assert not bench.link.machine.found.sync_counter
    assert bench.link.notes[0].startswith("drive 4 has no 0x1019:00")
    bench.close()


def test_18_absent_0x6007_needs_a_bench_test():
    bench = Bench()
    del bench.far.drives[3].dictionary.entries[0x6007, 0]
    refused(bench, "drive 4 has no 0x6007:00 Abort connection option code: nothing is known")
    bench = Bench(link_loss_tested=True)
    del bench.far.drives[3].dictionary.entries[0x6007, 0]
    bench.opened()
    assert bench.link.notes == ["drive 4 has no 0x6007:00 Abort connection option code"]
    bench.close()


@pytest.mark.parametrize("position", [300.0, -215.0])
def test_22_positions_beyond_32_bit_are_refused_before_the_wire(position):
    with pytest.raises(DriveError, match="does not fit 32-bit position units"):
        Scaling(PAPER).counts(np.full((1, 6), position))


def test_25_error_value_not_kept():
    bench = Bench()
    bench.far.coupler.sdo.altered[0x6443, 1] = 0
    refused(bench, "the coupler: 0x6443:01 .* reads back 0, written was 1")


def test_25_wrong_modules():
    bench = Bench()
    bench.far.coupler.dictionary.fixed((0x1000, 0), 0x30191)
    refused(bench, "has no analogue inputs and outputs")


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
    bench.link.home()
    assert bench.far.state.slider == pytest.approx(np.full(6, 2e-3), abs=5e-5)
    assert all(drive.values[0x6061, 0] == 8 for drive in bench.far.drives)
    bench.link.arm(ZERO)
    bench.close()
