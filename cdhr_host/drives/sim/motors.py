"""The simulated machine behind a bridge: six axes and a regulator, one output at a time."""

import math

import numpy as np

from cdhr_host.drives.sim.store import Tick
from cdhr_host.plant import Disturbance, Machine
from cdhr_host.profile.schema import Profile
from cdhr_host.units import KPA, MM3
from cdhr_host.values import Setpoints


class Motors:
    """Where the axes are, in the units of the wire, after the last output."""

    def __init__(self, profile: Profile, disturbance: Disturbance) -> None:
        self._unit = profile.canopen.position_unit
        self._rated = profile.canopen.rated_torque
        turn = 2.0 * math.pi * profile.drives.screw_efficiency / profile.sliders.screw_lead
        self._newtons = 1e-3 * self._rated * turn
        self._window = profile.drives.following_error_max / self._unit
        self._machine = Machine(profile, disturbance)
        self._plant = self._machine.standing(np.zeros(6))
        self._outputs = 0
        self.position: Tick = (0,) * 6
        self.torque: Tick = (0,) * 6
        self.pressure = 0
        self.deposited = 0.0
        """mm³/s that left the nozzle"""

    def stand(self, start: Tick) -> None:
        """Held at ``start``, at rest."""
        self._plant = self._machine.standing(self._plant.slider, setpoint=np.array(start) * self._unit)

    def execute(self, tick: Tick) -> int | None:
        """One period; the axis that is beyond its following-error window, if any."""
        self._outputs += 1
        self._plant, feedback = self._machine.step(self._plant, self._row(tick))
        self.position = tuple(int(v) for v in np.rint(feedback.slider[0] / self._unit))
        self.torque = tuple(int(v) for v in np.rint(feedback.torque[0] / self._rated * 1e3))
        self.pressure = round(feedback.pressure[0] / (0.1 * KPA))
        self.deposited = float(feedback.deposited[0]) / MM3
        away = [abs(a - b) for a, b in zip(self.position, tick[:6], strict=True)]
        return away.index(max(away)) if max(away) > self._window else None

    def _row(self, tick: Tick) -> Setpoints:
        zero = np.zeros((1, 3))
        at = np.array([self._outputs])
        return Setpoints(
            tick=at,
            t=at * 1.0,
            line=at * 0,
            nozzle_G=zero,
            upper=zero.copy(),
            slider=np.array([tick[:6]]) * self._unit,
            tension=np.array([tick[6:12]]) * self._newtons,
            flow=np.zeros(1),
            pressure=np.array([tick[12] * 0.1 * KPA]),
        )
