"""Payloads of the link's frames; docs/link.md has every byte."""

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from cdhr_host.motion.hold import rows_needed
from cdhr_host.profile.schema import Profile
from cdhr_host.units import KPA, MS
from cdhr_host.values import Ints

HELLO: Final = struct.Struct("<BBBBIIII8s")
HELLO_ACK: Final = struct.Struct("<BBBBIIII8sHHIII")
CONFIG: Final = struct.Struct("<Ii")
AXIS: Final = struct.Struct("<iiIIHbx")
CONFIG_END: Final = struct.Struct("<HHHHH")
ARM: Final = struct.Struct("<I6i")
SETPOINTS: Final = struct.Struct("<IBBBB")
TICK: Final = struct.Struct("<6i6hHH")
STATUS: Final = struct.Struct("<IIIIHHBBHBx")
STATUS_AXIS: Final = struct.Struct("<ihhH")
STATUS_END: Final = struct.Struct("<H4hHHH")
FAULT: Final = struct.Struct("<HBBII6i")
NAK: Final = struct.Struct("<IBBH")
CLOCK_REQ: Final = struct.Struct("<Q")
CLOCK: Final = struct.Struct("<QQI")
RATE: Final = struct.Struct("<HH")
OD_READ: Final = struct.Struct("<BHB")
OD_WRITE: Final = struct.Struct("<BHBH")
OD_ACK: Final = struct.Struct("<BHBIH")
KEEPALIVE: Final = struct.Struct("<II")
EXECUTED: Final = struct.Struct("<IB3x")
EXECUTED_TICK: Final = struct.Struct("<6i6i6hH")
NO_TICK: Final = 0xFFFFFFFF
PER_FRAME: Final = 8
PER_TICK: Final = 43
"""bytes on the wire for a tick in a frame of eight"""
ENDS_AT_REST: Final = 1
LAST_OF_REVISION: Final = 2
ROLE_HOST: Final = 1
PRESSURE_UNIT: Final = 0.1 * KPA
PICOMETRE: Final = 1e-12


class State(IntEnum):
    """Of the bridge."""

    BOOT = 0
    IDLE = 1
    PRIMING = 2
    RUN = 3
    HOLDING = 4
    HELD = 5
    STOPPING = 6
    FAULT = 7


FAULTS: Final = {
    1: ("link-lost", "the bridge heard nothing of the host and stopped"),
    2: ("underrun", "the bridge ran out of setpoints while the machine was at work"),
    3: ("range", "a setpoint is beyond the limits the bridge was told"),
    4: ("step", "a setpoint is too far from the one before"),
    5: ("overlap", "a tick came twice with different setpoints"),
    6: ("following-error", "a slider is too far from its setpoint"),
    7: ("torque", "a motor needs too much torque"),
    8: ("pressure", "a pressure is beyond what the bridge was told"),
    9: ("emergency-stop", "the emergency stop is pressed"),
    10: ("setpoint-late", "the bridge itself was late with a setpoint"),
}
OF_THE_MACHINE: Final = (6, 7, 9)
"""faults that an operator must look at before FAULT_RESET"""
NAKS: Final = {
    1: "crc",
    2: "gap",
    3: "order",
    4: "range",
    5: "overflow",
    6: "session",
    7: "state",
    8: "late",
}
LATE: Final = 8


@dataclass(frozen=True, slots=True)
class Status:
    """What a bridge says every 20 ms."""

    tick: int
    """next one to be played"""
    expected: int
    """next tick it would accept"""
    stop_output: int | None
    """number of the first output of the stop"""
    output: int
    """number of the next output"""
    buffered: int
    capacity: int
    state: State
    position: tuple[int, ...]
    dropped: int
    revision: int
    released: bool
    """whether the emergency stop is released"""


def status(payload: bytes) -> Status:
    """STATUS; raises struct.error for another length."""
    tick, expected, stop, output, buffered, capacity, state, inputs, _, revision = STATUS.unpack_from(payload)
    axes = [STATUS_AXIS.unpack_from(payload, STATUS.size + k * STATUS_AXIS.size)[0] for k in range(6)]
    end = STATUS_END.unpack_from(payload, STATUS.size + 6 * STATUS_AXIS.size)
    ticks = (tick, expected, None if stop == NO_TICK else stop, output)
    return Status(*ticks, buffered, capacity, State(state), tuple(axes), end[5], revision, bool(inputs & 1))


def ramp_ticks(profile: Profile) -> int:
    """Ticks of the time-scaled stop."""
    return round(profile.link.ramp / profile.drives.period)


def low_water(profile: Profile) -> int:
    """Ticks a bridge must keep back for its stop."""
    return max(rows_needed(profile), ramp_ticks(profile) // 2 + 2)


def config(profile: Profile) -> bytes:
    """CONFIG of this machine."""
    sliders, unit, period = profile.sliders, profile.canopen.position_unit, profile.drives.period
    low, high = round(sliders.travel_min / unit), round(sliders.travel_max / unit)
    step = round(sliders.speed_max * period / unit) + 2
    change = round(4.0 * sliders.acceleration_max * period**2 / unit) + 4
    torque = round(profile.drives.torque_max / profile.canopen.rated_torque * 1e3)
    axes = AXIS.pack(low, high, step, change, torque, 1) * 6
    end = CONFIG_END.pack(
        round(profile.link.watchdog / MS),
        low_water(profile),
        ramp_ticks(profile),
        round(profile.extruder.pressure_max / PRESSURE_UNIT),
        round(profile.link.pressure_hold / MS),
    )
    return CONFIG.pack(round(period * 1e6), round(unit / PICOMETRE)) + axes + end


def config_crc(payload: bytes) -> int:
    """What a bridge echoes."""
    return zlib.crc32(payload)


def tick(counts: Ints, torque: Ints, pressure: float) -> bytes:
    """One setpoint: (6,) position units, (6,) thousandths of rated torque, Pa."""
    return TICK.pack(*counts.tolist(), *torque.tolist(), round(pressure / PRESSURE_UNIT), int(pressure > 0))
