"""Six simulated drives and a coupler on one bus, in front of the simulated machine."""

import math
from collections.abc import Callable, Iterable
from itertools import chain

import numpy as np

from cdhr_host.drives.sim.coupler import RAW, Coupler
from cdhr_host.drives.sim.drive import Drive, State
from cdhr_host.drives.sim.identity import identify
from cdhr_host.drives.sim.node import Frame, Nmt, Node
from cdhr_host.plant import Disturbance, Machine, undisturbed
from cdhr_host.profile.schema import Profile
from cdhr_host.units import MM3
from cdhr_host.values import Array, Feedback, Setpoints

SYNC = 0x80
LIMIT = 4_000_000
"""cycles that are remembered"""

Filter = Callable[[Frame], Iterable[Frame]]


def untouched(frame: Frame) -> Iterable[Frame]:
    """A wire without faults."""
    return (frame,)


class Station:
    """The far side of the bus.

    ``received`` has six position units and the raw pressure of each cycle in which all six
    axes followed a fresh setpoint, ``trace`` has time, six real positions, the raw pressure, whether
    the setpoints were fresh, and the clay that left the nozzle, mm³/s, for every cycle. ``lost`` counts
    cycles in which an axis had to guess.
    Silence is judged ``grace`` s late, for wires that deliver late themselves.
    ``inbound`` and ``outbound`` stand for the wire: each frame becomes none, one or more.
    """

    def __init__(
        self, profile: Profile, disturbance: Disturbance = undisturbed, *, grace: float = 0.0
    ) -> None:
        self.profile = profile
        self._grace = grace
        self.period = profile.drives.period
        self.drives = [Drive(k + 1, self.period) for k in range(6)]
        self.coupler = Coupler(7)
        self.received: list[tuple[int, ...]] = []
        self.trace: list[tuple[float, ...]] = []
        self.syncs = 0
        self.inbound: Filter = untouched
        self.outbound: Filter = untouched
        self.air = True
        self.estop = False
        self._unit = profile.canopen.position_unit
        self._rated = profile.canopen.rated_torque
        self._stepped = -math.inf
        self._ticks = 0
        self.disturb(disturbance)
        self.state = self._plant.standing(np.zeros(6))
        for node in self.nodes:
            identify(node.dictionary, node.id, profile)

    @property
    def nodes(self) -> list[Node]:
        """All seven."""
        return [*self.drives, self.coupler]

    @property
    def lost(self) -> int:
        """Cycles in which an axis had no setpoint of its own."""
        return max(drive.lost for drive in self.drives)

    @property
    def resting(self) -> bool:
        """Whether no axis is told to move."""
        return not any(drive.moving for drive in self.drives)

    def disturb(self, disturbance: Disturbance) -> None:
        """From now on this comes between the loops and the sliders."""
        self._plant = Machine(self.profile, disturbance)

    def stand(self, slider: Array) -> None:
        """(6,) m: put the sliders there, at rest."""
        self.state = self._plant.standing(slider)
        for drive, at in zip(self.drives, slider, strict=True):
            drive.moved(round(at / self._unit), 0)

    def start(self, now: float) -> None:
        """Power on."""
        for node in self.nodes:
            node.reset(now)

    def press(self, pressed: bool) -> None:
        """The emergency stop: torque off by hardware, air dumped."""
        self.estop = pressed
        self.coupler.values[0x6000, 1] = 2 if pressed else 3
        for drive in self.drives:
            if pressed:
                drive.drop(State.SWITCH_ON_DISABLED)
                drive.stubborn.add(State.SWITCH_ON_DISABLED)
            else:
                drive.stubborn.discard(State.SWITCH_ON_DISABLED)

    def exchange(self, now: float, frames: Iterable[Frame]) -> list[Frame]:
        """Frames from the host -> frames to it, by the time ``now``."""
        nodes = self.nodes
        for cob, data in chain.from_iterable(map(self.inbound, frames)):
            if cob == SYNC:
                self._sync(now, data)
            else:
                for node in nodes:
                    node.receive(now, cob, data)
        judged = now - self._grace
        for node in nodes:
            node.tick(judged)
        while judged - self._stepped > 2.5 * self.period:
            self._coast(judged)
        sent: list[Frame] = []
        for node in nodes:
            if node.outbox:
                sent += node.outbox
                node.outbox.clear()
        return list(chain.from_iterable(map(self.outbound, sent)))

    def _sync(self, now: float, data: bytes) -> None:
        fresh = any(drive.rpdos[0].latched is not None for drive in self.drives)
        if now - self._stepped < 0.5 * self.period and not fresh:
            return
        self.syncs += 1
        listening = {
            node.id
            for node in self.nodes
            if node.powered and node.state is Nmt.OPERATIONAL and node.sync_accepted(data)
        }
        for node in self.nodes:
            if node.id in listening:
                node.answer_sync()
        for drive in self.drives:
            if drive.id in listening:
                drive.synchronise(now)
            else:
                drive.coast(now)
        if self.coupler.id in listening:
            self.coupler.synchronise()
        if all(drive.following and drive.fresh for drive in self.drives) and len(self.received) < LIMIT:
            self.received.append((*(drive.commanded for drive in self.drives), self.coupler.output))
        self._step(now)

    def _coast(self, now: float) -> None:
        """A cycle that no SYNC began."""
        if now - self._stepped > 1.0:
            self._stepped = now - 1.0
        for drive in self.drives:
            drive.coast(now)
        self._step(self._stepped + self.period)

    def _step(self, now: float) -> None:
        """The machine turns for one period."""
        self._stepped = now
        self._ticks += 1
        self.state, feedback = self._plant.step(self.state, self._row())
        positions = np.rint(feedback.slider[0] / self._unit)
        torques = np.rint(feedback.torque[0] / self._rated * 1e3)
        for drive, position, torque in zip(self.drives, positions, torques, strict=True):
            drive.moved(int(position), int(torque))
        self.coupler.measured(self._raw(feedback))
        if len(self.trace) < LIMIT:
            fresh = all(drive.following and drive.fresh for drive in self.drives)
            laid = float(feedback.deposited[0]) / MM3
            self.trace.append((now, *positions.tolist(), self.coupler.output, fresh, laid))

    def _row(self) -> Setpoints:
        slider = np.array([[(drive.commanded + drive.shift) * self._unit for drive in self.drives]])
        supply = self.air and not self.estop
        raw = self.coupler.output if supply else 0
        zero = np.zeros((1, 3))
        return Setpoints(
            tick=np.array([self._ticks]),
            t=np.array([self._ticks * self.period]),
            line=np.zeros(1, dtype=np.int64),
            nozzle_G=zero,
            upper=zero.copy(),
            slider=slider,
            tension=self._tension()[None],
            flow=np.zeros(1),
            pressure=np.array([raw / RAW * self.profile.canopen.pressure_full_scale]),
        )

    def _tension(self) -> Array:
        """(6,) N the torque feed-forward stands for."""
        offsets = np.array([drive.values[0x60B2, 0] for drive in self.drives])
        turned = 2.0 * math.pi * self.profile.drives.screw_efficiency / self.profile.sliders.screw_lead
        return np.asarray(offsets * 1e-3 * self._rated * turned, dtype=np.float64)

    def _raw(self, feedback: Feedback) -> tuple[int, ...]:
        pressure = feedback.pressure[0] / self.profile.canopen.pressure_full_scale * RAW
        forces = self._tension()[:3] / self.profile.canopen.force_full_scale * RAW
        return tuple(round(value) for value in (pressure, *forces))
