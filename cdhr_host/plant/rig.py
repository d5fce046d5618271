"""The whole rig: setpoints -> servo loops -> cables with their faults -> platforms -> sensors.

``step`` takes the state through one drive tick. What the sensors say is ``sensed``; where the
platforms really are is in the state.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from cdhr_host.plant.bodies import Bodies, BodiesState, Build, Wound
from cdhr_host.plant.faults import ENCODERS, FAULTLESS, FORCES, Faults
from cdhr_host.plant.held import Held
from cdhr_host.plant.noise import normal
from cdhr_host.plant.servo import Servo
from cdhr_host.plant.strands import Point, Strands
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array

Six = tuple[float, ...]
ZERO: Final[Six] = (0.0,) * 6
LONGEST_STEP: Final = 2e-3
"""s the platforms are stepped by at most"""


class RigState(NamedTuple):
    """The rig between two ticks; tuples of six are by slider."""

    tick: int = 0
    setpoint: Six = ZERO
    rate: Six = ZERO
    error: Six = ZERO
    """m, slider minus setpoint"""
    error_before: Six = ZERO
    cable: Six = ZERO
    """m, sliders after lost motion"""
    bodies: BodiesState = BodiesState()
    readings: tuple[tuple[Six, Six], ...] = ()
    """sliders and tensions of the last ticks, newest last, as the sensors take them"""


class Sensed(NamedTuple):
    """What the drives report at a tick."""

    slider: Array
    """(6,) m, from the encoders"""
    tension: Array
    """(6,) N, of a whole pair for 1-3"""


class Rig:
    """One machine with its faults; ``rigid`` holds the platforms where the sliders put them."""

    def __init__(
        self,
        profile: Profile,
        faults: Faults = FAULTLESS,
        *,
        build: Build | None = None,
        pulley: str | None = None,
        rigid: bool = False,
    ) -> None:
        self.faults = faults
        strands = Strands.from_profile(profile, pulley, faults.moved)
        self._bodies = Bodies(profile, strands, build)
        self._held = Held(strands) if rigid else None
        self._radius = profile.geometry.pulley_radius
        self._period = profile.drives.period
        self._trace, self._determinant, self._kick = Servo(profile.drives).recurrence
        self._counts = profile.drives.encoder / profile.sliders.screw_lead
        self._per = 1.0 / self._period
        steps = int(np.ceil(self._period / LONGEST_STEP))
        self._inner = self._period / steps
        self._middles = [(n + 0.5) * self._inner for n in range(steps)]

    def step(self, state: RigState, setpoint: Sequence[float]) -> RigState:
        """(6,) m of slider setpoints, reached linearly during the tick -> the state after it."""
        per, trace, determinant, kick = self._per, self._trace, self._determinant, self._kick
        rate = [per * (new - old) for new, old in zip(setpoint, state.setpoint, strict=True)]
        error = [
            trace * e1 - determinant * e2 - kick * (new - old)
            for e1, e2, new, old in zip(state.error, state.error_before, rate, state.rate, strict=True)
        ]
        slider = tuple([told + off for told, off in zip(setpoint, error, strict=True)])
        cable = self.faults.lagging(state.cable, slider)
        bodies, tension = self._moved(state, cable)
        return RigState(
            state.tick + 1,
            tuple(setpoint),
            tuple(rate),
            tuple(error),
            state.error,
            cable,
            bodies,
            (*state.readings, (slider, tension))[-1 - self.faults.budget.sensor_delay :],
        )

    def sensed(self, state: RigState) -> Sensed:
        """What is heard at a tick: delayed, counted, noisy. The rig must have been stepped."""
        budget, seed = self.faults.budget, self.faults.seed
        slider, tension = (np.array(reading) for reading in state.readings[0])
        if budget.encoder:
            slider += budget.encoder * normal(seed, ENCODERS, state.tick, 6)
        if budget.force:
            tension += budget.force * normal(seed, FORCES, state.tick, 6)
        return Sensed(np.rint(slider * self._counts) / self._counts, tension)

    def _moved(self, state: RigState, cable: Six) -> tuple[BodiesState, Six]:
        """Platforms at the end of a tick in which the cables run to ``cable``, and the six forces."""
        end = self.faults.run_out(cable, self._radius)
        if self._held is not None:
            return self._placed(self._held, state.bodies, end)
        start = self.faults.run_out(state.cable, self._radius)
        rate_of = [self._per * (b - a) for a, b in zip(start, end, strict=True)]
        length, rate = self._bodies.wound(start, rate_of)
        commands = [
            Wound([at + part * v for at, v in zip(length, rate, strict=True)], rate) for part in self._middles
        ]
        bodies, felt = self._bodies.through(state.bodies, commands, self._inner)
        return bodies, paired(felt)

    def _placed(self, held: Held, before: BodiesState, cable: Six) -> tuple[BodiesState, Six]:
        lower = held.lower(cable[:3], before.lower)
        upper = held.upper(cable[3:], before.upper)
        return before._replace(
            lower=lower,
            upper=upper,
            velocity=self._speed(before.lower, lower),
            upper_velocity=self._speed(before.upper, upper),
        ), ZERO

    def _speed(self, was: Point, now: Point) -> Point:
        return self._per * (now[0] - was[0]), self._per * (now[1] - was[1]), self._per * (now[2] - was[2])


def paired(nine: Sequence[float]) -> Six:
    """Nine forces -> six: what the sensor of each slider feels."""
    a, b, c, d, e, f, *upper = nine
    return (a + d, b + e, c + f, *upper)
