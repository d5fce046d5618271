"""What is wrong with one machine: where its pulleys really are, how its cables run, how it measures."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sin
from typing import Final

import numpy as np

from cdhr_host.plant.noise import normal, uniform
from cdhr_host.units import MM
from cdhr_host.values import Array

PULLEYS, PHASES, ENCODERS, FORCES, CAMERA, DROPPED = range(6)
"""streams of random numbers"""


@dataclass(frozen=True, slots=True)
class Budget:
    """How large the faults of such machines are; standard deviations unless it says greatest."""

    pulley_position: float = 0.0
    """m, each coordinate of each pulley"""
    run_out: float = 0.0
    """m, greatest error of a cable over a turn of its pulley"""
    play: float = 0.0
    """m, greatest: a cable follows its slider with this much lost motion on either side"""
    encoder: float = 0.0
    """m at the slider"""
    force: float = 0.0
    """N, tension sensors"""
    sensor_delay: int = 0
    """ticks until encoders and tension sensors are heard"""
    camera: float = 0.0
    """m, each coordinate of the nozzle"""


PAPER: Final = Budget(pulley_position=1.0 * MM, run_out=0.1 * MM, play=0.05 * MM, camera=0.08 * MM)
"""stated once, for every table: what explains the paper's residuals of compensated motion"""


@dataclass(frozen=True, slots=True)
class Faults:
    """One machine drawn from a budget."""

    seed: int
    budget: Budget
    moved: Array
    """(6, 3) m: pulleys away from where they should be"""
    phase: tuple[float, ...]
    """(6,) rad of the run-out at the reference pose"""

    @classmethod
    def drawn(cls, seed: int, budget: Budget) -> "Faults":
        """The machine of this seed."""
        moved = budget.pulley_position * normal(seed, PULLEYS, 0, 18).reshape(6, 3)
        phase = 2.0 * np.pi * uniform(seed, PHASES, 0, 6)
        return cls(seed, budget, moved, tuple(phase.tolist()))

    def lagging(self, before: Sequence[float], slider: Sequence[float]) -> tuple[float, ...]:
        """(6,) m where the cables were, where the sliders are -> where the cables are: lost motion."""
        play = self.budget.play
        if not play:
            return tuple(slider)
        return tuple(
            [
                own - play if was < own - play else own + play if was > own + play else was
                for was, own in zip(before, slider, strict=True)
            ]
        )

    def run_out(self, cable: Sequence[float], radius: float) -> tuple[float, ...]:
        """(6,) m the cables have run -> what they really paid out, nothing at 0."""
        most = self.budget.run_out
        if not most:
            return tuple(cable)
        per = 1.0 / radius
        return tuple(
            [
                ran + most * (sin(per * ran + phase) - sin(phase))
                for ran, phase in zip(cable, self.phase, strict=True)
            ]
        )


FAULTLESS: Final = Faults.drawn(0, Budget())
