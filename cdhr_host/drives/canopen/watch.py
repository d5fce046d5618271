"""What the master looks at in every cycle; each finding stops the machine."""

from collections.abc import Iterator
from typing import Final

from cdhr_host.drives.canopen.axis import Axis
from cdhr_host.drives.canopen.bus import COUPLER, NODES, Bus, node_name
from cdhr_host.drives.canopen.cia402 import (
    DISABLE_VOLTAGE,
    FOLLOWING_ERROR,
    FOLLOWS_TARGET,
    INTERNAL_LIMIT,
    State,
)
from cdhr_host.drives.canopen.emergencies import meaning
from cdhr_host.drives.faults import fault
from cdhr_host.errors import DriveError
from cdhr_host.profile.schema import Profile
from cdhr_host.units import KPA, MM

FEEDBACK_LOST: Final = 3
"""answers in a row that may be missing less one"""
SOFT_SILENCE: Final = 0.1
"""s without answers that pass where soft real time is allowed, or as long as the drives wait for setpoints
where that is longer: serial lines deliver late too"""
UNFOLLOWING: Final = 2
WATCHDOG: Final = 0x8250
"""EMCY code of a drive whose receive PDO came too late"""
ENCODER_LOST: Final = (0x7300, 0x7320)


class Watch:
    """Findings of one cycle; ``unreferenced`` gathers axes whose position cannot be trusted,
    ``codes`` the emergency codes seen. Answers may be ``stale`` cycles old without a finding."""

    def __init__(self, profile: Profile, bus: Bus, axes: list[Axis]) -> None:
        settings = profile.canopen
        self._bus = bus
        self._axes = axes
        self._heartbeat = settings.heartbeat
        silence = max(SOFT_SILENCE, settings.setpoint_watchdog) if settings.allow_soft_realtime else 0.0
        soft = round(silence / profile.drives.period)
        self._strict = not settings.allow_soft_realtime
        watchdog = 0 if self._strict else round(settings.setpoint_watchdog / profile.drives.period)
        self._unfollowing = max(UNFOLLOWING, watchdog)
        self._patience = max(FEEDBACK_LOST * settings.feedback_every, soft)
        self.stale = max(settings.feedback_every, soft)
        reach = profile.sliders.speed_max * profile.drives.period * settings.feedback_every
        self._jump = (3.0 * reach + profile.drives.following_error_max) / settings.position_unit
        self._unit = settings.position_unit
        self._deviation = settings.pressure_deviation
        self._settling = settings.pressure_settling
        self._away_since: float | None = None
        self.unreferenced: set[int] = set()
        self.codes: set[int] = set()
        self.warnings: list[str] = []
        self.enabled = False

    def findings(self, now: float, *, streaming: bool = False) -> Iterator[DriveError]:
        """Everything wrong in this cycle."""
        yield from self._nodes(now)
        yield from self._emergencies()
        if streaming and self.enabled and self._strict and all(map(self._starved, self._axes)):
            yield fault("setpoint-late", "the drives did not get two setpoints in a row")
        for axis in self._axes:
            yield from self._feedback(axis)
            if self.enabled:
                yield from self._enabled(axis)

    def pressure(self, now: float, wanted: float, measured: float, raw: int) -> Iterator[DriveError]:
        """Pa commanded and measured, and the raw input."""
        if raw <= -1000 or raw >= 32767:
            yield fault("pressure-sensor", f"the pressure sensor reads {raw}: open circuit or overload")
        if abs(wanted - measured) <= self._deviation:
            self._away_since = None
            return
        self._away_since = now if self._away_since is None else self._away_since
        if now - self._away_since > self._settling:
            yield fault(
                "pressure-deviation",
                f"the pressure is {measured / KPA:.1f} kPa, commanded {wanted / KPA:.1f} kPa "
                f"(limit {self._deviation / KPA:g} kPa for {self._settling:g} s)",
                value=measured / KPA,
                limit=self._deviation / KPA,
                unit="kPa",
            )

    def _nodes(self, now: float) -> Iterator[DriveError]:
        for node in NODES:
            if self._bus.boots[node]:
                if node != COUPLER:
                    self.unreferenced.add(node - 1)
                yield fault("node-reset", f"{node_name(node)} started anew while the drives were open")
            elif now - self._bus.heard.get(node, now) > self._heartbeat:
                self._bus.heard[node] = now
                yield fault(
                    "heartbeat", f"no heartbeat of {node_name(node)} for {self._heartbeat * 1e3:g} ms"
                )
        self._bus.boots.clear()

    def _emergencies(self) -> Iterator[DriveError]:
        found, self._bus.emergencies = self._bus.emergencies, []
        for node, code, register in found:
            if code & 0xFF00 == 0:
                continue
            if code in ENCODER_LOST and node != COUPLER:
                self.unreferenced.add(node - 1)
            self.codes.add(code)
            kind = "setpoint-late" if code == WATCHDOG else "emergency"
            yield fault(kind, f"{node_name(node)}: {meaning(code)} (error register 0x{register:02X})")

    def _starved(self, axis: Axis) -> bool:
        """Enabled as it was, and not following a target any more."""
        return axis.state is State.ENABLED and not axis.status & FOLLOWS_TARGET

    def _feedback(self, axis: Axis) -> Iterator[DriveError]:
        name = node_name(axis.node)
        if axis.misfit is not None:
            yield fault("feedback-length", f"{name} sent feedback of {axis.misfit} bytes instead of 8")
            axis.misfit = None
        if axis.missed >= self._patience:
            axis.missed = 0
            yield fault("feedback-lost", f"no feedback from {name} in {self._patience} cycles")
        if axis.jump > self._jump:
            self.unreferenced.add(axis.node - 1)
            yield fault(
                "encoder-jump",
                f"the position of {name} jumped by {axis.jump * self._unit / MM:.3f} mm in a cycle",
            )
        axis.jump = 0.0

    def _enabled(self, axis: Axis) -> Iterator[DriveError]:
        name, state = node_name(axis.node), axis.state
        if axis.word == DISABLE_VOLTAGE:
            return
        if state in (State.FAULT, State.FAULT_REACTION):
            axis.word = DISABLE_VOLTAGE
            kind = "following-error" if axis.status & FOLLOWING_ERROR else "drive-fault"
            yield fault(kind, f"{name} is in fault: {meaning(axis.error)}")
        elif state is not State.ENABLED:
            axis.word = DISABLE_VOLTAGE
            yield fault("axis-lost-enable", f"{name} is {state.value} although it was enabled")
        else:
            yield from self._following(axis, name)

    def _following(self, axis: Axis, name: str) -> Iterator[DriveError]:
        if axis.status & INTERNAL_LIMIT and not any(name in text for text in self.warnings):
            self.warnings.append(f"{name} works at an internal limit")
        if axis.status & FOLLOWING_ERROR:
            axis.word = DISABLE_VOLTAGE
            yield fault("following-error", f"{name} reports a following error")
        axis.unfollowing = 0 if axis.status & FOLLOWS_TARGET else axis.unfollowing + 1
        if axis.unfollowing == self._unfollowing:
            yield fault("not-following", f"{name} does not follow its target (status word bit 12)")
