"""A block of setpoints that was checked."""

from dataclasses import dataclass

from cdhr_host.errors import Problem
from cdhr_host.values import Array, Setpoints, ToolTrack


@dataclass(frozen=True, slots=True)
class Checked:
    """A block of setpoints, each checked; only those on the bed are there."""

    setpoints: Setpoints
    problems: tuple[Problem, ...]
    """what the machine cannot do of it, one for each line, limit and cable"""
    track: ToolTrack
    """the nozzle at every sample of the block, those off the bed too"""
    nine: Array
    """(N, 9) N at each setpoint: left and right cables of the pairs, then the upper ones"""
