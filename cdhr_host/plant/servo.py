"""Six servo axes: position loops, encoders, motor torques."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from cdhr_host.profile.schema import Drives
from cdhr_host.values import Array, Ints

MOVING_MASS: Final = 75.0
"""kg a slider's motor moves: a 400 W rotor, 0.3 kg cm², seen through a 4 mm screw, and the carriage"""


@dataclass(frozen=True, slots=True)
class ServoState:
    """The loops between two batches of ticks."""

    setpoint: Array
    """(6,) m, the last setpoint"""
    rate: Array
    """(6,) m/s, the setpoint's rate in the last tick"""
    memory: Array
    """(2, 6) m, what the error filter carries over"""


class Servo:
    """Second-order position loops with velocity feed-forward.

    x'' = w² (r - x) + 2 zeta w (r' - x'), with r interpolated linearly between two ticks as
    a CiA 402 drive does in cyclic synchronous position mode. The error e = x - r then obeys
    e'' + 2 zeta w e' + w² e = -r'': free within a tick, kicked by -(change of r') at its
    start. With phi the exact transition over a tick this is the recurrence
    e[k] = tr(phi) e[k-1] - det(phi) e[k-2] - phi[0, 1] (r'[k] - r'[k-1]),
    so that a batch is one linear filter and its result does not depend on how ticks are batched.
    """

    def __init__(self, drives: Drives) -> None:
        w = 2.0 * math.pi * drives.servo_bandwidth
        self._period = drives.period
        loop = np.array([[0.0, 1.0], [-w * w, -2.0 * drives.servo_damping * w]])
        self._phi: Array = np.asarray(expm(loop * drives.period))
        self._determinant = math.exp(-2.0 * drives.servo_damping * w * drives.period)
        self._poles = np.array([1.0, -float(np.trace(self._phi)), self._determinant])

    @property
    def recurrence(self) -> tuple[float, float, float]:
        """tr(phi), det(phi) and phi[0, 1]: of the error e[k] on e[k-1], e[k-2] and the kick."""
        return float(np.trace(self._phi)), self._determinant, float(self._phi[0, 1])

    def standing(self, setpoint: Array, slider: Array) -> ServoState:
        """(6,), (6,) -> the loops with the sliders at rest at ``slider`` and told ``setpoint``."""
        error = slider - setpoint
        memory = np.stack([self._phi[0, 0] * error, -self._determinant * error])
        return ServoState(np.array(setpoint), np.zeros(6), memory)

    def step(self, state: ServoState, setpoint: Array) -> tuple[ServoState, Array, Array]:
        """(N, 6) setpoints, N >= 1 -> next state, (N, 6) slider m, (N, 6) planned acceleration m/s²."""
        rate = np.diff(setpoint, axis=0, prepend=state.setpoint[None]) / self._period
        kick = np.diff(rate, axis=0, prepend=state.rate[None])
        error, memory = lfilter([self._phi[0, 1]], self._poles, -kick, axis=0, zi=state.memory)
        return ServoState(setpoint[-1], rate[-1], memory), setpoint + error, kick / self._period


def counts(slider: Array, lead: float, per_turn: int) -> Ints:
    """(N, 6) m -> (N, 6) encoder counts, the nearest ones."""
    return np.asarray(np.rint(slider * (per_turn / lead)), dtype=np.int64)


def measured(encoder: Ints, lead: float, per_turn: int) -> Array:
    """(N, 6) encoder counts -> (N, 6) m."""
    return np.asarray(encoder * (lead / per_turn), dtype=np.float64)


def torque(tension: Array, acceleration: Array, lead: float, efficiency: float) -> Array:
    """(N, 6) N, (N, 6) m/s² -> (N, 6) N m at the motor, positive winding in.

    A screw turns the force F into F lead / (2 pi efficiency). The cable pulls its slider
    out, so that paying out faster takes force off the motor.
    """
    force = tension - MOVING_MASS * acceleration
    return np.asarray(force * (lead / (2.0 * math.pi * efficiency)), dtype=np.float64)
