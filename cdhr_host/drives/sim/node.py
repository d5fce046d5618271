"""A simulated CANopen node: NMT, heartbeats, EMCY, SDO, SYNC and PDOs of CiA 301."""

import struct
from enum import IntEnum
from typing import Final

from cdhr_host.drives.sim.dictionary import Dictionary
from cdhr_host.drives.sim.pdo import Pdo
from cdhr_host.drives.sim.sdo import SdoServer

Frame = tuple[int, bytes]

APPLICATION: Final = 0x2000
"""index from which objects are the application's, not those of communication"""
NEVER: Final = float("inf")


class Nmt(IntEnum):
    """NMT states as a heartbeat tells them."""

    BOOT = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


COMMANDS: Final = {1: Nmt.OPERATIONAL, 2: Nmt.STOPPED, 128: Nmt.PRE_OPERATIONAL}


class Node:
    """One node; frames to send gather in ``outbox``.

    ``boot_delay`` s pass between a reset and the boot-up message; ``autostart`` goes
    OPERATIONAL by itself; ``mute`` names frames never sent: ``heartbeat``, ``tpdo``.
    """

    def __init__(self, eds: str, node_id: int) -> None:
        self.id = node_id
        self.dictionary = Dictionary(eds, node_id)
        self.values = self.dictionary.values
        self.sdo = SdoServer(self.dictionary)
        self.rpdos = [Pdo(self.dictionary, 0x1400 + k, 0x1600 + k) for k in range(2)]
        self.tpdos = [Pdo(self.dictionary, 0x1800 + k, 0x1A00 + k) for k in range(2)]
        self.outbox: list[Frame] = []
        self.state = Nmt.BOOT
        self.boot_delay = 0.0
        self.autostart = False
        self.powered = True
        self.mute: set[str] = set()
        self._boots_at = NEVER
        self._beat_at = NEVER
        self._host_heard: float | None = None

    def reset(self, now: float, *, communication: bool = False) -> None:
        """Begin to boot; where only communication is reset the application keeps its objects."""
        self.dictionary.restore(APPLICATION if communication else 0x10000)
        for pdo in (*self.rpdos, *self.tpdos):
            pdo.rebuild()
        self.state, self._boots_at, self._host_heard = Nmt.BOOT, now + self.boot_delay, None

    def receive(self, now: float, cob: int, data: bytes) -> None:
        """One frame from the bus."""
        if not self.powered:
            return
        if cob == 0:
            self._command(now, data)
        elif self.state is Nmt.BOOT:
            return
        elif cob == 0x600 + self.id:
            if self.state is not Nmt.STOPPED and (answer := self.sdo.answer(data)) is not None:
                self.outbox.append((0x580 + self.id, answer))
        elif cob == 0x700 + (self.values[0x1016, 1] >> 16 & 0x7F):
            self._host_heard = now
        elif self.state is Nmt.OPERATIONAL:
            self._process_data(now, cob, data)

    def tick(self, now: float) -> None:
        """Whatever time alone makes happen."""
        if not self.powered:
            return
        if self.state is Nmt.BOOT:
            if now >= self._boots_at:
                self._booted(now)
            return
        self._beat(now)
        consumer = self.values[0x1016, 1] & 0xFFFF
        if consumer and self._host_heard is not None and now - self._host_heard > consumer * 1e-3 + 1e-9:
            self._host_heard = None
            self.emergency(0x8130)
            self.host_lost()
        if self.state is Nmt.OPERATIONAL:
            self._timers(now)

    def sync_accepted(self, data: bytes) -> bool:
        """Whether a SYNC has the length this node was configured for."""
        if len(data) == (1 if self.values.get((0x1019, 0), 0) else 0):
            return True
        self.emergency(0x8240)
        return False

    def answer_sync(self) -> None:
        """Send the synchronous TPDOs, sampled now."""
        for pdo in self.tpdos:
            if pdo.cob and 1 <= pdo.type <= 240:
                pdo.cycles += 1
                if pdo.cycles >= pdo.type:
                    pdo.cycles = 0
                    self._send(pdo)

    def apply_sync(self) -> bool:
        """Apply what synchronous RPDOs brought since the last SYNC; whether RPDO 1 was among it."""
        fresh = self.rpdos[0].latched is not None
        for pdo in self.rpdos:
            if pdo.latched is not None:
                pdo.apply(pdo.latched)
                pdo.latched = None
        return fresh

    def emergency(self, code: int, register: int = 0x11) -> None:
        """Send an EMCY and remember it."""
        self.values[0x1001, 0] = register if code else 0
        self.values[0x1003, 0] = min(self.values[0x1003, 0] + 1, 1)
        self.values[0x1003, 1] = code
        self.outbox.append((0x80 + self.id, struct.pack("<HB5x", code, self.values[0x1001, 0])))

    def host_lost(self) -> None:
        """The host's heartbeat stopped: error behaviour 0x1029:1."""
        if self.values[0x1029, 1] == 0 and self.state is Nmt.OPERATIONAL:
            self.enter(Nmt.PRE_OPERATIONAL)

    def setpoints_lost(self) -> None:
        """The event timer of a receive PDO ran out."""

    def enter(self, state: Nmt) -> None:
        """Change the NMT state."""
        self.state = state
        for pdo in self.rpdos:
            pdo.latched = pdo.heard = None

    def _booted(self, now: float) -> None:
        self.outbox.append((0x700 + self.id, b"\0"))
        self._beat_at = now
        self.enter(Nmt.OPERATIONAL if self.autostart else Nmt.PRE_OPERATIONAL)

    def _command(self, now: float, data: bytes) -> None:
        if len(data) != 2 or data[1] not in (0, self.id):
            return
        if data[0] in (129, 130):
            self.reset(now, communication=data[0] == 130)
        elif self.state is not Nmt.BOOT and data[0] in COMMANDS:
            self.enter(COMMANDS[data[0]])

    def _beat(self, now: float) -> None:
        period = self.values[0x1017, 0] * 1e-3
        if period and now >= self._beat_at - 1e-9:
            self._beat_at = max(self._beat_at + period, now)
            if "heartbeat" not in self.mute:
                self.outbox.append((0x700 + self.id, bytes([self.state])))

    def _process_data(self, now: float, cob: int, data: bytes) -> None:
        for pdo in self.rpdos:
            if pdo.cob != cob or not cob:
                continue
            if len(data) < pdo.length:
                self.emergency(0x8210)
                return
            pdo.heard = now
            values = struct.unpack(pdo.format, data[: pdo.length])
            if pdo.type <= 240:
                pdo.latched = values
            else:
                pdo.apply(values)

    def _timers(self, now: float) -> None:
        for pdo in self.rpdos:
            if pdo.heard is not None and (event := pdo.event) and now - pdo.heard > event + 1e-9:
                pdo.heard = None
                self.emergency(0x8250)
                self.setpoints_lost()
        for pdo in self.tpdos:
            if pdo.type >= 254 and pdo.cob and (event := pdo.event) and now - pdo.sent >= event:
                pdo.sent = now
                self._send(pdo)

    def _send(self, pdo: Pdo) -> None:
        if "tpdo" not in self.mute:
            self.outbox.append((pdo.cob, pdo.packed()))
