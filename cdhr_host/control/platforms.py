"""Both platforms as one system of six equations: M q'' = J F + load. Eq. (11), (12)."""

from dataclasses import dataclass

import numpy as np

from cdhr_host.mechanism import Cables, Loads, jacobian
from cdhr_host.mechanism.cables import GRAVITY
from cdhr_host.mechanism.kinematics import components
from cdhr_host.mechanism.statics import spring_force
from cdhr_host.profile import Profile
from cdhr_host.values import Array

ONE = slice(0, 1)


@dataclass(frozen=True, slots=True)
class Equations:
    """The system at one pose."""

    mass: Array
    """(6,) kg"""
    pull: Array
    """(6, 6) J: forces of the cables, in columns, lower and upper blocks"""
    load: Array
    """(6,) N: spring and weight"""

    def acceleration(self, tension: Array) -> Array:
        """(6,) N -> (6,) m/s²."""
        return np.asarray((self.pull @ tension + self.load) / self.mass)

    def tension(self, acceleration: Array) -> Array:
        """(6,) m/s² -> (6,) N. Eq. (12)."""
        return np.asarray(np.linalg.solve(self.pull, self.mass * acceleration - self.load))


class Platforms:
    """The equations of one machine, as the profile knows it."""

    def __init__(self, profile: Profile) -> None:
        self._cables = Cables.from_profile(profile)
        self._loads = Loads.from_profile(profile)
        self._mass = np.repeat([self._loads.lower_mass, self._loads.upper_mass], 3)

    def at(self, position: Array) -> Equations:
        """(6,) m of displacement -> the equations there; raises MotionError out of reach."""
        lower, upper = position[None, :3], position[None, 3:]
        slopes = jacobian(self._cables, lower, upper)[0]
        pull = np.zeros((6, 6))
        pull[:3, :3], pull[3:, 3:] = -slopes[:3].T, -slopes[3:].T
        spring = np.array(spring_force(self._loads, components(lower, ONE), components(upper, ONE)))[:, 0]
        load = np.concatenate([spring, -spring])
        load[[2, 5]] -= self._mass[[0, 3]] * GRAVITY
        return Equations(self._mass, pull, load)
