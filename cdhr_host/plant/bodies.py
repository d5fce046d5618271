"""Both platforms as rigid bodies on nine cables: Eq. (11) and (14) with everything the paper leaves out.

The lower platform has six degrees of freedom, the upper one is a point: its cables meet in it.
Each step is position Verlet: half a step of drift, the loads of that moment, half a step of
drift; second order, and it keeps the energy of an undamped machine. Plain numbers rather than
arrays: nine cables are too few to vectorise. Stable while dt < 2/omega of the fastest mode.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt, tanh
from typing import NamedTuple

import numpy as np

from cdhr_host.mechanism.cables import GRAVITY, Cables, Loads
from cdhr_host.mechanism.statics import tensions
from cdhr_host.plant.strands import SLIDER, Point, Strands
from cdhr_host.plant.turning import Turn, rotation, turned
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array

UNTURNED: Turn = (1.0, 0.0, 0.0, 0.0)
AT_REST: Point = (0.0, 0.0, 0.0)
Tension = Callable[[int, float, float], float]
"""number of the cable, its length m, its rate m/s -> N"""


@dataclass(frozen=True, slots=True)
class Build:
    """What no profile and no paper says about the machine: guesses, to be varied."""

    inertia_across: float = 1.6e-3
    """kg m², about a horizontal axis through the centre of mass: a plate of 80 mm radius, 1 kg"""
    inertia_about: float = 3.2e-3
    """kg m², about the vertical"""
    mass_height: float = 0.0
    """m: centre of mass above the plane of the attachments, where the spring ends too"""
    damping: float = 5e-4
    """s: a cable's force for its rate, over its stiffness"""
    friction: float = 0.0
    """of a cable's force that its pulley keeps while it runs"""
    creep: float = 1e-3
    """m/s at which most of the friction is there"""


class BodiesState(NamedTuple):
    """Displacements from the reference pose, m, and rates; the turn as a quaternion (w, x, y, z)."""

    lower: Point = AT_REST
    """centre of mass"""
    turn: Turn = UNTURNED
    velocity: Point = AT_REST
    spin: Point = AT_REST
    """rad/s, in W"""
    upper: Point = AT_REST
    upper_velocity: Point = AT_REST


class Forces(NamedTuple):
    """Nine cable forces at the drives, N: left of pairs 1-3, right of pairs 1-3, upper 4-6."""

    force: Sequence[float]


class Wound(NamedTuple):
    """Nine unloaded cable lengths, m, and their rates, m/s: sliders that hold their position."""

    length: Sequence[float]
    rate: Sequence[float]


class _Sum(NamedTuple):
    """Force and moment on the lower platform, force on the upper one; what each cable gives."""

    force: Point
    moment: Point
    upper: Point
    felt: Sequence[float]
    axis: Point
    """the lower platform's own z"""


class Bodies:
    """The equations of motion of one machine."""

    def __init__(self, profile: Profile, strands: Strands, build: Build | None = None) -> None:
        self.build = Build() if build is None else build
        self._strands = strands
        self._loads = Loads.from_profile(profile)
        arm = -self.build.mass_height
        self._arms = tuple((x, y, z + arm) for x, y, z in strands.arms)
        self._centre = strands.lower[0], strands.lower[1], strands.lower[2] - arm
        self._gap = strands.upper[2] - strands.lower[2]
        rest = self._rest = _at_reference(strands)
        dead = (profile.stretch.lower_dead_length,) * 6 + (profile.stretch.upper_dead_length,) * 3
        self.stiffness = tuple(
            profile.stretch.stiffness / (span + more) for span, more in zip(rest, dead, strict=True)
        )
        force = _reference_forces(profile, self._loads)
        self._natural = tuple(
            span - pull / k for span, pull, k in zip(rest, force, self.stiffness, strict=True)
        )

    def wound(self, slider: Sequence[float], rate: Sequence[float]) -> Wound:
        """(6,) m and m/s of the sliders -> cables that hold the reference pose at slider 0."""
        return Wound(
            [natural + slider[i] for natural, i in zip(self._natural, SLIDER, strict=True)],
            [rate[i] for i in SLIDER],
        )

    def run(self, state: BodiesState) -> tuple[float, ...]:
        """(6,) m the cables are longer than at the reference pose; of a pair their mean."""
        nine: list[float] = []

        def noted(i: int, length: float, rate: float) -> float:  # noqa: ARG001
            nine.append(length - self._rest[i])
            return 0.0

        self._total(state, noted)
        return (*(0.5 * (a + b) for a, b in zip(nine[:3], nine[3:6], strict=True)), *nine[6:])

    def step(self, state: BodiesState, command: Forces | Wound, dt: float) -> BodiesState:
        """The state ``dt`` s later under a command held during the step."""
        return self.stepped(state, command, dt)[0]

    def stepped(
        self, state: BodiesState, command: Forces | Wound, dt: float
    ) -> tuple[BodiesState, Sequence[float]]:
        """As ``step``, and the nine forces on the platforms in the middle of the step, N."""
        middle = _drifted(state, 0.5 * dt)
        load = self._total(middle, self._law(command))
        return _drifted(self._kicked(middle, load, dt), 0.5 * dt), load.felt

    def tensions(self, state: BodiesState, command: Forces | Wound) -> Sequence[float]:
        """Nine forces on the platforms, N, in a state."""
        return self._total(state, self._law(command)).felt

    def energy(self, state: BodiesState, command: Wound) -> float:
        """J: of motion, height, spring and stretched cables, up to a constant."""
        across, about = self.build.inertia_across, self.build.inertia_about
        axis = rotation(state.turn)[2]
        along = sum(a * b for a, b in zip(axis, state.spin, strict=True))
        turning = across * sum(w * w for w in state.spin) + (about - across) * along * along
        moving = self._loads.lower_mass * sum(v * v for v in state.velocity)
        moving += self._loads.upper_mass * sum(v * v for v in state.upper_velocity)
        lifted = self._loads.lower_mass * state.lower[2] + self._loads.upper_mass * state.upper[2]
        stretch = sqrt(sum(part * part for part in self._span(state, axis))) - self._loads.rest_length
        pulled = self.tensions(state, command)
        cables = sum(pull * pull / k for pull, k in zip(pulled, self.stiffness, strict=True))
        return 0.5 * (turning + moving + self._loads.stiffness * stretch**2 + cables) + GRAVITY * lifted

    def _law(self, command: Forces | Wound) -> Tension:
        """A cable that runs out over its pulley pulls more than its drive, one that runs in less."""
        kept, creep = self.build.friction, self.build.creep
        if isinstance(command, Wound):
            return self._stretched(command, kept, creep)
        force = command.force

        def forced(i: int, length: float, rate: float) -> float:  # noqa: ARG001
            return force[i] * (1.0 + kept * tanh(rate / creep))

        return forced

    def _stretched(self, command: Wound, kept: float, creep: float) -> Tension:
        stiffness, damping = self.stiffness, self.build.damping
        length_of, rate_of = command.length, command.rate

        def stretched(i: int, length: float, rate: float) -> float:
            longer = length - length_of[i]
            pull = stiffness[i] * (longer + damping * (rate - rate_of[i]))
            if pull <= 0.0 or longer <= 0.0:
                return 0.0
            return pull * (1.0 + kept * tanh(rate / creep)) if kept else pull

        return stretched

    def _span(self, state: BodiesState, axis: Point) -> Point:
        """Between the ends of the spring, m, upwards; ``axis`` is the lower platform's own z."""
        (x, y, z), (ux, uy, uz), h = state.lower, state.upper, self.build.mass_height
        ex, ey, ez = axis
        return ux - x + h * ex, uy - y + h * ey, uz - z + h * ez + self._gap - h

    def _total(self, state: BodiesState, law: Tension) -> _Sum:
        """All loads but weight."""
        turn = rotation(state.turn)
        felt: list[float] = []
        fx, fy, fz, mx, my, mz = self._pulled(state, turn, law, felt)
        gx, gy, gz = self._lifted(state, law, felt)
        sx, sy, sz = self._span(state, turn[2])
        factor = self._loads.stiffness * (1.0 - self._loads.rest_length / sqrt(sx * sx + sy * sy + sz * sz))
        sx, sy, sz = factor * sx, factor * sy, factor * sz
        if self.build.mass_height:
            ax, ay, az = (-self.build.mass_height * part for part in turn[2])
            mx, my, mz = mx + ay * sz - az * sy, my + az * sx - ax * sz, mz + ax * sy - ay * sx
        return _Sum((fx + sx, fy + sy, fz + sz), (mx, my, mz), (gx - sx, gy - sy, gz - sz), felt, turn[2])

    def _pulled(
        self, state: BodiesState, turn: tuple[Point, Point, Point], law: Tension, felt: list[float]
    ) -> tuple[float, float, float, float, float, float]:
        """Force and moment of the six lower cables."""
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = turn
        (vx, vy, vz), (wx, wy, wz) = state.velocity, state.spin
        (cx, cy, cz), (qx, qy, qz) = self._centre, state.lower
        cx, cy, cz = cx + qx, cy + qy, cz + qz
        fx = fy = fz = mx = my = mz = 0.0
        for i, (wrapped, (a, b, c)) in enumerate(zip(self._strands.wrapped, self._arms, strict=False)):
            rx, ry, rz = xx * a + yx * b + zx * c, xy * a + yy * b + zy * c, xz * a + yz * b + zz * c
            length, ex, ey, ez = wrapped(cx + rx, cy + ry, cz + rz)
            turned_in = (ry * ez - rz * ey) * wx + (rz * ex - rx * ez) * wy + (rx * ey - ry * ex) * wz
            pull = law(i, length, -(ex * vx + ey * vy + ez * vz + turned_in))
            felt.append(pull)
            ex, ey, ez = pull * ex, pull * ey, pull * ez
            fx, fy, fz = fx + ex, fy + ey, fz + ez
            mx, my, mz = mx + ry * ez - rz * ey, my + rz * ex - rx * ez, mz + rx * ey - ry * ex
        return fx, fy, fz, mx, my, mz

    def _lifted(self, state: BodiesState, law: Tension, felt: list[float]) -> Point:
        """Force of the three upper cables."""
        vx, vy, vz = state.upper_velocity
        (x, y, z), (qx, qy, qz) = self._strands.upper, state.upper
        x, y, z = x + qx, y + qy, z + qz
        gx = gy = gz = 0.0
        for i in (6, 7, 8):
            length, ex, ey, ez = self._strands.wrapped[i](x, y, z)
            pull = law(i, length, -(ex * vx + ey * vy + ez * vz))
            felt.append(pull)
            gx, gy, gz = gx + pull * ex, gy + pull * ey, gz + pull * ez
        return gx, gy, gz

    def _kicked(self, state: BodiesState, load: _Sum, dt: float) -> BodiesState:
        per, above, fall = dt / self._loads.lower_mass, dt / self._loads.upper_mass, GRAVITY * dt
        (fx, fy, fz), (gx, gy, gz) = load.force, load.upper
        (vx, vy, vz), (ux, uy, uz) = state.velocity, state.upper_velocity
        return BodiesState(
            state.lower,
            state.turn,
            (vx + per * fx, vy + per * fy, vz + per * fz - fall),
            self._spun(state, load, dt),
            state.upper,
            (ux + above * gx, uy + above * gy, uz + above * gz - fall),
        )

    def _spun(self, state: BodiesState, load: _Sum, dt: float) -> Point:
        """Euler's equation of a body that is round about its axis n: I w' + (Ia - It)(n·w) w x n = m."""
        across, excess = self.build.inertia_across, self.build.inertia_about - self.build.inertia_across
        (nx, ny, nz), (wx, wy, wz), (mx, my, mz) = load.axis, state.spin, load.moment
        gyro = excess * (nx * wx + ny * wy + nz * wz)
        mx, my, mz = (
            mx - gyro * (wy * nz - wz * ny),
            my - gyro * (wz * nx - wx * nz),
            mz - gyro * (wx * ny - wy * nx),
        )
        along = (nx * mx + ny * my + nz * mz) * (1.0 / self.build.inertia_about - 1.0 / across)
        return (
            wx + dt * (mx / across + along * nx),
            wy + dt * (my / across + along * ny),
            wz + dt * (mz / across + along * nz),
        )


def _drifted(state: BodiesState, dt: float) -> BodiesState:
    (x, y, z), (vx, vy, vz) = state.lower, state.velocity
    (ux, uy, uz), (wx, wy, wz) = state.upper, state.upper_velocity
    return BodiesState(
        (x + dt * vx, y + dt * vy, z + dt * vz),
        turned(state.turn, state.spin, dt),
        state.velocity,
        state.spin,
        (ux + dt * wx, uy + dt * wy, uz + dt * wz),
        state.upper_velocity,
    )


def _at_reference(strands: Strands) -> list[float]:
    """Nine lengths from D to B at the reference pose, m."""
    x, y, z = strands.lower
    lower = [
        wrapped(x + a, y + b, z + c)[0]
        for wrapped, (a, b, c) in zip(strands.wrapped, strands.arms, strict=False)
    ]
    return lower + [wrapped(*strands.upper)[0] for wrapped in strands.wrapped[6:]]


def _reference_forces(profile: Profile, loads: Loads) -> list[float]:
    """Nine forces that hold the undisturbed machine at the reference pose; a pair shares alike."""
    home: Array = np.zeros((1, 3))
    six: list[float] = tensions(Cables.from_profile(profile), loads, home, home)[0].tolist()
    return [0.5 * pull for pull in six[:3]] * 2 + six[3:]
