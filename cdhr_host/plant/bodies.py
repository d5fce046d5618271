"""Both platforms as rigid bodies on nine cables: Eq. (11) and (14) with everything the paper leaves out.

The lower platform has six degrees of freedom, the upper one is a point: its cables meet in it.
Each step is a drift of half a step, the kick of that moment's loads, and another drift of half
a step. A drift is the exact free motion, turning included; so without damping and friction the
step is symplectic and of second order: the error of the energy shrinks with the square of the
step. Stable while dt < 2/omega of the fastest mode. Plain numbers rather than arrays: nine
cables are too few to vectorise.

Friction is a pulley that holds its cable elastically until it slips (Dahl): the force it keeps
grows with the way the cable has run, up to a share of the cable's own force. It depends on
positions, not on rates, so it does not chatter however long the step, and it holds at rest.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Final, NamedTuple

import numpy as np

from cdhr_host.mechanism.cables import GRAVITY, Cables, Loads
from cdhr_host.mechanism.statics import tensions
from cdhr_host.plant.strands import SLIDER, Point, Strands
from cdhr_host.plant.turning import Turn, Vector, rotation, spun, turned
from cdhr_host.profile.schema import Profile
from cdhr_host.values import Array

UNTURNED: Turn = (1.0, 0.0, 0.0, 0.0)
AT_REST: Point = (0.0, 0.0, 0.0)
HOLD: Final = 0.25
"""stiffness with which a pulley holds its cable before it slips, in stiffnesses of the cable"""
Tension = Callable[[int, float, float], float]
"""number of the cable, its length m, its rate m/s -> N"""
Motion = tuple[Point, Turn, Point, Vector, Point, Point]
"""``BodiesState`` but for its grip: plain, for what is done twice a tick"""


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
    """of a cable's force that its pulley keeps while it slips"""


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
    grip: tuple[float, ...] = ()
    """(9,) m: length of each cable at which its pulley keeps nothing; empty without friction or so far"""


class Forces(NamedTuple):
    """Nine cable forces at the drives, N: left of pairs 1-3, right of pairs 1-3, upper 4-6."""

    force: Sequence[float]


class Wound(NamedTuple):
    """Nine unloaded cable lengths, m, and their rates, m/s: sliders that hold their position."""

    length: Sequence[float]
    rate: Sequence[float]


class Work(NamedTuple):
    """Of a step, J."""

    supplied: float
    """by the sliders"""
    lost: float
    """in dampers and slipping pulleys"""


class Bodies:
    """The equations of motion of one machine."""

    def __init__(self, profile: Profile, strands: Strands, build: Build | None = None) -> None:
        self.build = Build() if build is None else build
        self._strands = strands
        self._loads = Loads.from_profile(profile)
        self._inertia = self.build.inertia_across, self.build.inertia_about
        arm = -self.build.mass_height
        arms = [(x, y, z + arm) for x, y, z in strands.arms]
        self._lower_cables = tuple(zip(range(6), strands.wrapped, arms, strict=False))
        self._upper_cables = tuple(enumerate(strands.wrapped))[6:]
        self._centre = strands.lower[0], strands.lower[1], strands.lower[2] - arm
        (lx, ly, lz), (tx, ty, tz) = strands.lower, strands.upper
        self._gap = tx - lx, ty - ly, tz - lz
        rest = self._rest = _at_reference(strands)
        dead = (profile.stretch.lower_dead_length,) * 6 + (profile.stretch.upper_dead_length,) * 3
        self.stiffness = tuple(
            profile.stretch.stiffness / (span + more) for span, more in zip(rest, dead, strict=True)
        )
        self._hold = tuple(HOLD * k for k in self.stiffness)
        force = _reference_forces(profile, self._loads)
        self._natural = tuple(
            span - pull / k for span, pull, k in zip(rest, force, self.stiffness, strict=True)
        )
        self._cable_of_slider = tuple(zip(self._natural, SLIDER, strict=True))

    def wound(self, slider: Sequence[float], rate: Sequence[float]) -> Wound:
        """(6,) m and m/s of the sliders -> cables that hold the reference pose at slider 0."""
        return Wound([natural + slider[i] for natural, i in self._cable_of_slider], [rate[i] for i in SLIDER])

    def run(self, state: BodiesState) -> tuple[float, ...]:
        """(6,) m the cables are longer than at the reference pose; of a pair their mean."""
        length, _ = self._cables(state)
        nine = [now - rest for now, rest in zip(length, self._rest, strict=True)]
        return (*(0.5 * (a + b) for a, b in zip(nine[:3], nine[3:6], strict=True)), *nine[6:])

    def step(self, state: BodiesState, command: Forces | Wound, dt: float) -> BodiesState:
        """The state ``dt`` s later under a command held during the step."""
        return self.stepped(state, command, dt)[0]

    def stepped(
        self, state: BodiesState, command: Forces | Wound, dt: float
    ) -> tuple[BodiesState, Sequence[float]]:
        """As ``step``, and the nine forces on the platforms in the middle of the step, N."""
        return self.through(state, (command,), dt)

    def through(
        self, state: BodiesState, commands: Sequence[Forces | Wound], dt: float
    ) -> tuple[BodiesState, Sequence[float]]:
        """As many steps as there are commands, one or more, and the nine forces in the last one, N.

        The drifts of two steps that meet are one.
        """
        motion, grip, felt, drift = state[:6], list(state.grip), list[float](), 0.5 * dt
        for command in commands:
            motion, felt = self._drifted(motion, drift), []
            load = self._total(motion, self._law(command, grip), felt)
            motion, drift = self._kicked(motion, load, dt), dt
        return BodiesState(*self._drifted(motion, 0.5 * dt), tuple(grip)), felt

    def tensions(self, state: BodiesState, command: Forces | Wound) -> Sequence[float]:
        """Nine forces on the platforms, N, in a state."""
        felt: list[float] = []
        self._total(state[:6], self._law(command, list(state.grip)), felt)
        return felt

    def energy(self, state: BodiesState, command: Wound) -> float:
        """J: of motion, height, spring, stretched and held cables, up to a constant."""
        across, about = self._inertia
        axis = rotation(state.turn)[2]
        along = sum(a * b for a, b in zip(axis, state.spin, strict=True))
        turning = across * sum(w * w for w in state.spin) + (about - across) * along * along
        moving = self._loads.lower_mass * sum(v * v for v in state.velocity)
        moving += self._loads.upper_mass * sum(v * v for v in state.upper_velocity)
        lifted = self._loads.lower_mass * state.lower[2] + self._loads.upper_mass * state.upper[2]
        span = self._span(state.lower, state.upper, axis)
        stretch = sqrt(sum(part * part for part in span)) - self._loads.rest_length
        length, _ = self._cables(state)
        longer = (max(now - free, 0.0) for now, free in zip(length, command.length, strict=True))
        cables = sum(k * more * more for k, more in zip(self.stiffness, longer, strict=True))
        held = zip(self._hold, length, state.grip or length, strict=True)
        cables += sum(k * (now - root) ** 2 for k, now, root in held)
        return 0.5 * (turning + moving + self._loads.stiffness * stretch**2 + cables) + GRAVITY * lifted

    def work(self, before: BodiesState, after: BodiesState, command: Wound, dt: float) -> Work:
        """What sliders gave and dampers and pulleys took in the step from ``before`` to ``after``.

        By forces and mean rates in its middle: to the second order, like the step itself.
        """
        middle = BodiesState(*self._drifted(before[:6], 0.5 * dt), before.grip)
        mean = [[0.5 * (a + b) for a, b in zip(before[i], after[i], strict=True)] for i in (2, 3, 5)]
        length, rate = self._cables(
            middle._replace(velocity=_point(mean[0]), spin=_point(mean[1]), upper_velocity=_point(mean[2]))
        )
        felt, supplied, lost = self.tensions(middle, command), 0.0, 0.0
        for i, (k, now, moving) in enumerate(zip(self.stiffness, length, rate, strict=True)):
            root, was = (after.grip[i], before.grip[i]) if before.grip else (now, now)
            kept = self._hold[i] * (now - root)
            driven = felt[i] - kept
            damped = driven - k * max(now - command.length[i], 0.0)
            supplied -= driven * command.rate[i] * dt
            lost += damped * (moving - command.rate[i]) * dt + kept * (root - was)
        return Work(supplied, lost)

    def _cables(self, state: BodiesState) -> tuple[list[float], list[float]]:
        """Nine lengths, m, and their rates, m/s."""
        lengths: list[float] = []
        rates: list[float] = []

        def noted(i: int, length: float, rate: float) -> float:  # noqa: ARG001
            lengths.append(length)
            rates.append(rate)
            return 0.0

        self._total(state[:6], noted, [])
        return lengths, rates

    def _law(self, command: Forces | Wound, grip: list[float]) -> Tension:
        """What a cable pulls; with friction ``grip`` is moved along with the pulleys that slip."""
        law = _forced(command) if isinstance(command, Forces) else self._stretched(command)
        return self._rubbed(law, grip) if self.build.friction else law

    def _stretched(self, command: Wound) -> Tension:
        stiffness, damping = self.stiffness, self.build.damping
        length_of, rate_of = command

        def stretched(i: int, length: float, rate: float) -> float:
            longer = length - length_of[i]
            if longer <= 0.0:
                return 0.0
            pull = stiffness[i] * (longer + damping * (rate - rate_of[i]))
            return pull if pull > 0.0 else 0.0

        return stretched

    def _rubbed(self, law: Tension, grip: list[float]) -> Tension:
        """A cable that runs out over its pulley pulls more than its drive, one that runs in less."""
        share, hold, first = self.build.friction, self._hold, not grip

        def rubbed(i: int, length: float, rate: float) -> float:
            pull = law(i, length, rate)
            if first:
                grip.append(length)
                return pull
            most, kept = share * pull, hold[i] * (length - grip[i])
            if kept > most:
                grip[i] = length - most / hold[i]
                return pull + most
            if kept < -most:
                grip[i] = length + most / hold[i]
                return pull - most
            return pull + kept

        return rubbed

    def _span(self, lower: Point, upper: Point, axis: Point) -> Point:
        """Between the ends of the spring, m, upwards; ``axis`` is the lower platform's own z."""
        (x, y, z), (ux, uy, uz), h = lower, upper, self.build.mass_height
        (ex, ey, ez), (gx, gy, gz) = axis, self._gap
        return ux - x + h * ex + gx, uy - y + h * ey + gy, uz - z + h * ez + gz - h

    def _total(self, motion: Motion, law: Tension, felt: list[float]) -> tuple[Point, Point, Point]:
        """All loads but weight: force and moment on the lower platform, force on the upper one."""
        lower, turn, velocity, spin, upper, upper_velocity = motion
        axes = rotation(turn)
        fx, fy, fz, mx, my, mz = self._pulled(lower, axes, velocity, spin, law, felt)
        gx, gy, gz = self._lifted(upper, upper_velocity, law, felt)
        sx, sy, sz = self._span(lower, upper, axes[2])
        factor = self._loads.stiffness * (1.0 - self._loads.rest_length / sqrt(sx * sx + sy * sy + sz * sz))
        sx, sy, sz = factor * sx, factor * sy, factor * sz
        if self.build.mass_height:
            ax, ay, az = (-self.build.mass_height * part for part in axes[2])
            mx, my, mz = mx + ay * sz - az * sy, my + az * sx - ax * sz, mz + ax * sy - ay * sx
        return (fx + sx, fy + sy, fz + sz), (mx, my, mz), (gx - sx, gy - sy, gz - sz)

    def _pulled(  # noqa: PLR0917 -- a state, taken apart once
        self,
        lower: Point,
        axes: tuple[Point, Point, Point],
        velocity: Point,
        spin: Vector,
        law: Tension,
        felt: list[float],
    ) -> tuple[float, float, float, float, float, float]:
        """Force and moment of the six lower cables."""
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = axes
        (vx, vy, vz), (wx, wy, wz) = velocity, spin
        (cx, cy, cz), (qx, qy, qz) = self._centre, lower
        cx, cy, cz = cx + qx, cy + qy, cz + qz
        fx = fy = fz = mx = my = mz = 0.0
        for i, wrapped, (a, b, c) in self._lower_cables:
            rx, ry, rz = xx * a + yx * b + zx * c, xy * a + yy * b + zy * c, xz * a + yz * b + zz * c
            length, ex, ey, ez = wrapped(cx + rx, cy + ry, cz + rz)
            ux, uy, uz = ry * ez - rz * ey, rz * ex - rx * ez, rx * ey - ry * ex
            pull = law(i, length, -(ex * vx + ey * vy + ez * vz + ux * wx + uy * wy + uz * wz))
            felt.append(pull)
            fx, fy, fz = fx + pull * ex, fy + pull * ey, fz + pull * ez
            mx, my, mz = mx + pull * ux, my + pull * uy, mz + pull * uz
        return fx, fy, fz, mx, my, mz

    def _lifted(self, upper: Point, velocity: Point, law: Tension, felt: list[float]) -> Point:
        """Force of the three upper cables."""
        vx, vy, vz = velocity
        (x, y, z), (qx, qy, qz) = self._strands.upper, upper
        x, y, z = x + qx, y + qy, z + qz
        gx = gy = gz = 0.0
        for i, wrapped in self._upper_cables:
            length, ex, ey, ez = wrapped(x, y, z)
            pull = law(i, length, -(ex * vx + ey * vy + ez * vz))
            felt.append(pull)
            gx, gy, gz = gx + pull * ex, gy + pull * ey, gz + pull * ez
        return gx, gy, gz

    def _drifted(self, motion: Motion, dt: float) -> Motion:
        """Exact motion without loads."""
        (x, y, z), turn, velocity, spin, (ux, uy, uz), upper_velocity = motion
        (vx, vy, vz), (wx, wy, wz) = velocity, upper_velocity
        turn, spin = turned(turn, spin, self._inertia, dt)
        lower, upper = (x + dt * vx, y + dt * vy, z + dt * vz), (ux + dt * wx, uy + dt * wy, uz + dt * wz)
        return lower, turn, velocity, spin, upper, upper_velocity

    def _kicked(self, motion: Motion, load: tuple[Point, Point, Point], dt: float) -> Motion:
        """What loads and weight do to the rates."""
        per, above, fall = dt / self._loads.lower_mass, dt / self._loads.upper_mass, GRAVITY * dt
        (fx, fy, fz), moment, (gx, gy, gz) = load
        lower, turn, (vx, vy, vz), spin, upper, (ux, uy, uz) = motion
        velocity = vx + per * fx, vy + per * fy, vz + per * fz - fall
        upper_velocity = ux + above * gx, uy + above * gy, uz + above * gz - fall
        return lower, turn, velocity, spun(turn, spin, moment, self._inertia, dt), upper, upper_velocity


def _forced(command: Forces) -> Tension:
    force = command.force

    def forced(i: int, length: float, rate: float) -> float:  # noqa: ARG001
        return force[i]

    return forced


def _point(values: Sequence[float]) -> Point:
    x, y, z = values
    return x, y, z


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
