"""The whole simulated machine: six sliders, the air and the clay."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cdhr_host.plant.clay import Clay, ClayState, Paste
from cdhr_host.plant.servo import Servo, ServoState, counts, measured, torque
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array, Feedback, Ints, Setpoints


class Disturbance(Protocol):
    """What comes between a slider's free motion and where it really is; pure."""

    def __call__(self, tick: Ints, slider: Array, last: Array) -> Array:
        """(N,) ticks, (N, 6) m free motion, (6,) m real position before -> (N, 6) m real positions."""
        ...


def undisturbed(tick: Ints, slider: Array, last: Array) -> Array:  # noqa: ARG001
    """Sliders go where their loops drive them."""
    return slider


@dataclass(frozen=True, slots=True)
class MachineState:
    """The machine between two batches of ticks."""

    servo: ServoState
    slider: Array
    """(6,) m, real positions"""
    clay: ClayState

    @property
    def pressure(self) -> float:
        """Pa, gauge, behind the regulator."""
        return self.clay.pressure


class Machine:
    """Steps a state through batches of setpoints; the result does not depend on the batching."""

    def __init__(
        self, profile: Profile, disturbance: Disturbance = undisturbed, paste: Paste | None = None
    ) -> None:
        """``paste`` is the simulated clay, the profile's own if None."""
        self._servo = Servo(profile.drives)
        self._clay = Clay(Paste.from_profile(profile) if paste is None else paste, profile.drives.period)
        self._lead = profile.sliders.screw_lead
        self._per_turn = profile.drives.encoder
        self._efficiency = profile.drives.screw_efficiency
        self._disturbance = disturbance

    def standing(
        self, slider: Array, *, setpoint: Array | None = None, pressure: float = 0.0, rested: float = 0.0
    ) -> MachineState:
        """(6,) m -> at rest there, told ``setpoint``; ``pressure`` has vented for ``rested`` s."""
        at = np.array(slider, dtype=np.float64)
        told = at if setpoint is None else setpoint
        return MachineState(self._servo.standing(told, at), at, self._clay.standing(pressure, rested))

    def step(self, state: MachineState, rows: Setpoints) -> tuple[MachineState, Feedback]:
        """N >= 1 ticks of setpoints -> the state after them, and what was measured at each."""
        servo, free, acceleration = self._servo.step(state.servo, rows.slider)
        slider = self._disturbance(rows.tick, free, state.slider)
        clay, pressure, deposited = self._clay.step(state.clay, rows.tick, rows.pressure)
        encoder = counts(slider, self._lead, self._per_turn)
        feedback = Feedback(
            tick=rows.tick,
            setpoint=rows.slider,
            slider=measured(encoder, self._lead, self._per_turn),
            counts=encoder,
            torque=torque(rows.tension, acceleration, self._lead, self._efficiency),
            pressure=pressure,
            deposited=deposited,
        )
        return MachineState(servo, slider[-1], clay), feedback
