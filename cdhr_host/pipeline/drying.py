"""Pauses between layers, and the time a layer takes at least: how clay gets its time to dry."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from cdhr_host.pipeline.pushing import lays
from cdhr_host.profile import Profile
from cdhr_host.values import Arc, Array, Command, Moves, Notice, Pause, Plane, Spline


def paused(commands: Iterator[Command], every: int) -> Iterator[Command]:
    """Commands with a pause after every so many layers; 0 is never."""
    layers = 0
    for command in commands:
        if isinstance(command, Notice) and command.kind == "layer":
            if every and layers and layers % every == 0:
                yield Pause(command.line, f"{layers} layers done")
            layers += 1
        yield command


class Layers:
    """How long the present layer has lasted, in s of the plan."""

    def __init__(self, least: float) -> None:
        self._least = least
        self._began: float | None = None

    def ends(self, command: Command) -> bool:
        """Whether a command ends a layer that must have taken its time."""
        return bool(self._least) and isinstance(command, Notice) and command.kind == "layer"

    def missing(self, now: float) -> float:
        """s that the layer which ends now has been too short; another one begins."""
        began, self._began = self._began, now
        return 0.0 if began is None else max(self._least - (now - began), 0.0)

    def waited(self, now: float) -> None:
        """The next layer begins only now."""
        self._began = now


class Parking:
    """Where the nozzle waits while the print pauses or dries: up, and to the park place above all clay."""

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        self.top = -math.inf
        """m, of the clay laid so far"""
        self._back: Moves | None = None

    @property
    def away(self) -> bool:
        """Whether the nozzle was taken away."""
        return self._back is not None

    def note(self, command: Command) -> None:
        """What a command lays is what must be cleared from now on."""
        if lays(command):
            self.top = max(self.top, _highest(command))

    def leave(self, at_G: Array, line: int) -> Moves | None:
        """The way there from (3,) m; None where the profile wants none, or the nozzle is away already."""
        job = self._profile.job
        if self.away or not (job.pauses_lift and job.lift):
            return None
        x, y, z = at_G.tolist()
        places = [at_G, np.array([x, y, z + job.lift])]
        if job.pauses_park:
            top = max(z, self.top) + job.lift
            places = [at_G, np.array([x, y, top]), np.array([job.park_x, job.park_y, top])]
        self._back = _travel(places[::-1], self._profile, line)
        return _travel(places, self._profile, line)

    def come_back(self) -> Moves | None:
        """The same way back; None where the nozzle is not away."""
        back, self._back = self._back, None
        return back


def _highest(command: Command) -> float:
    """m, the top of the clay that a command lays."""
    match command:
        case Moves():
            clay = (command.clay > 0.0) | (command.air > 0.0)
            before = np.concatenate((command.start_G[None], command.end_G[:-1]))
            return float(np.maximum(before[clay, 2], command.end_G[clay, 2]).max())
        case Arc():
            radius = math.dist(command.start_G[list(command.plane.value[:2])], command.centre_G)
            flat = command.plane is Plane.XY
            return float(max(command.start_G[2], command.end_G[2]) + (0.0 if flat else 2.0 * radius))
        case Spline():
            return float(command.control_G[:, 2].max())
    return -math.inf


def _travel(places: Sequence[Array], profile: Profile, line: int) -> Moves:
    """From the first of the places to the last."""
    count = len(places) - 1
    speed, nothing = np.full(count, profile.limits.speed_max / 2), np.zeros(count)
    lines = np.full(count, line)
    return Moves(lines, places[0].copy(), np.array(places[1:]), speed, nothing, nothing.copy())
