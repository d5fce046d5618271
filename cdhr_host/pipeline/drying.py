"""Pauses between layers, and the time a layer takes at least: how clay gets its time to dry."""

from collections.abc import Iterator

import numpy as np

from cdhr_host.profile import Profile
from cdhr_host.values import Array, Command, Moves, Notice, Pause


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


def lifted(at_G: Array, profile: Profile, line: int) -> tuple[Moves, Moves] | None:
    """The way up from (3,) m and back, for a pause; None where the profile wants none."""
    if not (profile.job.pauses_lift and profile.job.lift):
        return None
    up = at_G + np.array([0.0, 0.0, profile.job.lift])
    return _travel(at_G, up, profile, line), _travel(up, at_G, profile, line)


def _travel(start_G: Array, end_G: Array, profile: Profile, line: int) -> Moves:
    speed = np.array([profile.limits.speed_max / 2])
    return Moves(np.array([line]), start_G.copy(), end_G[None].copy(), speed, np.zeros(1), np.zeros(1))
