"""Bring-up of the seven nodes, up to the point where the cycle can begin."""

from dataclasses import dataclass, field
from typing import Final

from cdhr_host.drives.canopen.bus import COUPLER, HOST, NODES, Bus, node_name
from cdhr_host.drives.canopen.pdo import all_maps, write_map
from cdhr_host.drives.canopen.verified import optional, read, refused, verified
from cdhr_host.errors import DriveError, Problem
from cdhr_host.profile.schema import Profile
from cdhr_host.units import MS

BOOT: Final = 5.0
"""s a node may take to boot"""
MODE: Final = 0.5
"""s a mode may take to be adopted"""
RESET_COMMUNICATION, PRE_OPERATIONAL, START = 0x82, 0x80, 0x01
CSP, IP, HOMING = 8, 7, 6
DRIVES: Final = NODES[:6]
HEARTBEAT_MS: Final = 100
OFF_VALUES: Final = (0, 0xFFFFFFFF)


@dataclass(slots=True)
class Found:
    """What bring-up learnt."""

    serials: list[int] = field(default_factory=list)
    """of nodes 1-6"""
    notes: list[str] = field(default_factory=list)
    """optional objects that are absent, emergencies at boot"""
    sync_counter: bool = False


def bring_up(bus: Bus, profile: Profile) -> Found:
    """Reset, identify, configure; every node finishes a letter before the next begins.

    drives.md 3.5 a-d: on return all nodes are PRE-OPERATIONAL and configured, no frame is
    cyclic yet. Raises DriveError that names node and object.
    """
    found = Found()
    _boot(bus)
    for node in NODES:
        _identify(bus, node, profile, found)
    for node in NODES:
        for pdo in all_maps(profile.canopen)[node]:
            found.notes += write_map(bus, node, pdo)
    for node in DRIVES:
        _limits(bus, node, profile)
    _coupler(bus)
    for node in NODES:
        found.notes += _supervision(bus, node, profile)
    found.sync_counter = profile.canopen.sync_counter and _counter(bus, found)
    for node in DRIVES:
        set_mode(bus, node, CSP if profile.canopen.mode == "csp" else IP)
    found.notes += [f"{node_name(n)} sent EMCY 0x{code:04X} at boot" for n, code, _ in bus.emergencies]
    bus.emergencies.clear()
    return found


def set_mode(bus: Bus, node: int, mode: int) -> None:
    """0x6060, polled until 0x6061 shows it; raises DriveError."""
    verified(bus, node, 0x6060, 0, mode)
    if not bus.until(lambda: read(bus, node, 0x6061) == mode, MODE):
        shown = read(bus, node, 0x6061)
        raise refused(node, 0x6061, 0, f"stays at {shown}: mode {mode} was not adopted in {MODE:g} s")


def _boot(bus: Bus) -> None:
    bus.pump()
    bus.boots.clear()
    bus.heard.clear()
    bus.command(RESET_COMMUNICATION)
    bus.until(lambda: bus.boots.keys() >= set(NODES), BOOT)
    if absent := [node for node in NODES if not bus.boots[node]]:
        names = ", ".join(map(node_name, absent))
        hint = "check power, node ids and bit rate"
        raise DriveError(Problem("missing", f"no answer from {names} in {BOOT:g} s", hint=hint))
    bus.command(PRE_OPERATIONAL)


def _identify(bus: Bus, node: int, profile: Profile, found: Found) -> None:
    settings = profile.canopen
    _expect_type(bus, node)
    coupler = node == COUPLER
    wanted = (settings.io_vendor, settings.io_product) if coupler else _drive_identity(profile)
    for sub, value in enumerate(wanted, start=1):
        _expect(bus, node, sub, value)
    if coupler:
        return
    serial = read(bus, node, 0x1018, 4)
    found.serials.append(serial)
    if settings.drive_serials and serial != settings.drive_serials[node - 1]:
        hint = None
        if serial in settings.drive_serials:
            hint = f"that is drive {settings.drive_serials.index(serial) + 1}: node ids are swapped"
        wanted_serial = settings.drive_serials[node - 1]
        raise refused(node, 0x1018, 4, f"is {serial}, the profile says {wanted_serial}", hint)
    modes = read(bus, node, 0x6502)
    mode = CSP if settings.mode == "csp" else IP
    if not modes >> (mode - 1) & 1:
        raise refused(node, 0x6502, 0, f"= 0x{modes:X}: mode {mode} ({settings.mode}) is not supported")
    _check_units(bus, node, profile)


def _drive_identity(profile: Profile) -> tuple[int, int]:
    return profile.canopen.drive_vendor, profile.canopen.drive_product


def _expect_type(bus: Bus, node: int) -> None:
    value = read(bus, node, 0x1000)
    if bus.another_answer(node):
        message = f"node id {node} answers twice: two nodes have it"
        raise DriveError(Problem("duplicate", message, hint="give every node an id of its own"))
    wanted = 401 if node == COUPLER else 402
    if value & 0xFFFF != wanted:
        raise refused(node, 0x1000, 0, f"= 0x{value:08X} is not a CiA {wanted} device")
    if node == COUPLER and value >> 16 & 0x0C != 0x0C:
        raise refused(node, 0x1000, 0, f"= 0x{value:08X} has no analogue inputs and outputs")


def _expect(bus: Bus, node: int, sub: int, wanted: int) -> None:
    value = read(bus, node, 0x1018, sub)
    if value != wanted:
        raise refused(node, 0x1018, sub, f"is 0x{value:X}, the profile says 0x{wanted:X}")


def _check_units(bus: Bus, node: int, profile: Profile) -> None:
    """0x6092 feed constant by 0x6091 gear: position units in a turn of the motor."""
    feed = read(bus, node, 0x6092, 1) / max(read(bus, node, 0x6092, 2), 1)
    gear = read(bus, node, 0x6091, 1) / max(read(bus, node, 0x6091, 2), 1)
    turn = profile.sliders.screw_lead / profile.canopen.position_unit
    if abs(feed / gear - turn) > 1e-6 * turn:
        raise refused(
            node, 0x6092, 1, f"makes {feed / gear:g} units a motor turn, the profile {turn:g} (lead / unit)"
        )
    rated = read(bus, node, 0x6076)
    if abs(rated - profile.canopen.rated_torque * 1e3) > 1.0:
        raise refused(
            node, 0x6076, 0, f"= {rated} mN m, the profile says {profile.canopen.rated_torque * 1e3:g}"
        )


def _limits(bus: Bus, node: int, profile: Profile) -> None:
    """Limits, supervision and options; read back, because some drives ship with them off."""
    unit = profile.canopen.position_unit
    window = round(profile.drives.following_error_max / unit)
    torque = round(profile.drives.torque_max / profile.canopen.rated_torque * 1e3)
    if window in OFF_VALUES:
        raise refused(node, 0x6065, 0, f"would be {window}: that switches supervision off")
    writes: tuple[tuple[int, int, int], ...] = (
        (0x6065, 0, window),
        (0x6066, 0, 20),
        (0x6085, 0, round(profile.canopen.quick_stop / unit)),
        (0x605A, 0, 2),
        (0x605E, 0, 2),
        (0x6072, 0, torque),
        (0x60C2, 1, round(profile.drives.period / MS)),
        (0x60C2, 2, -3),
    )
    for index, sub, value in writes:
        verified(bus, node, index, sub, value)


def _coupler(bus: Bus) -> None:
    """Outputs go to 0 when the link is lost; the size of 0x6444 differs between makers."""
    for k in range(1, 5):
        verified(bus, COUPLER, 0x6443, k, 1)
        size = len(bus.upload(COUPLER, 0x6444, k))
        verified(bus, COUPLER, 0x6444, k, 0, size=size)


def _supervision(bus: Bus, node: int, profile: Profile) -> list[str]:
    """Heartbeats both ways, and what a node does when the host falls silent."""
    settings = profile.canopen
    verified(bus, node, 0x1017, 0, HEARTBEAT_MS)
    notes = optional(bus, node, 0x1016, 1, HOST << 16 | round(settings.heartbeat / MS))
    if node != COUPLER:
        notes += optional(bus, node, 0x6007, 0, 3)
    if notes and not settings.link_loss_tested:
        raise DriveError(
            Problem(
                "configuration",
                f"{notes[0]}: nothing is known about what it does when the host falls silent",
                key="canopen.link_loss_tested",
                hint="pull the plug of the bus on the bench; if all axes stop, set link_loss_tested = true",
            )
        )
    return notes + optional(bus, node, 0x1029, 1, 0)


def _counter(bus: Bus, found: Found) -> bool:
    """A counter in SYNC only where every node accepts 0x1019; otherwise no node keeps it."""
    absent = [note for node in NODES for note in optional(bus, node, 0x1019, 0, 240)]
    if not absent:
        return True
    found.notes += [f"{note}: SYNC carries no counter" for note in absent]
    _write_no_counter(bus)
    return False


def drop_counter(bus: Bus, found: Found) -> None:
    """No counter after all: a node answered it with EMCY 0x8240. All nodes PRE-OPERATIONAL."""
    found.sync_counter = False
    found.notes.append("a node sent EMCY 0x8240 for SYNC with a counter: SYNC carries none")
    _write_no_counter(bus)


def _write_no_counter(bus: Bus) -> None:
    for node in NODES:
        optional(bus, node, 0x1019, 0, 0)
