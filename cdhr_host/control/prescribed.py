"""The paper's prescribed-performance controller, Eq. (22)-(34), in a form that can be implemented.

With q of both platforms (6,), errors against the plan q_d, and saturation F_u = sat(F_v):

    l1' = -c1 l1 + l2,   l2' = -c2 l2 + B1 (F_o - F_v),   B1 = M^-1 J
    e = q - q_d - l1,    s = c e + e' + ci int(e)
    F_v = J^-1 [M (q_d'' - c e' - ci e - c1 l1' - c2 l2 - eta sat(s / phi)) - F_k - G]

gives s' = -eta sat(s / phi) exactly, saturated or not (F_o is the force really commanded).

As printed it cannot be built: Eq. (26) has a diagonal B with b_i = J[2i, 2i-1], indices that
leave the 6 x 6 Jacobian or fall on its zero blocks, so that B1 is singular; the stability proof
needs B1 = M^-1 J in full. Eq. (28) means q_o', not q_r'; Eq. (30) drops M^-1 J F_v in its last
line, which is right only with that B1. The printed eta without a unit can only be mm/s²: at
10 m/s² sgn(s) alone shakes each cable by 18 N inside a window of 2 N, hence the boundary layer
phi. And nothing printed prescribes a performance: there is no function rho(t). The loop with a
real one is ``outer``. Eq. (24)-(25) leave open which pose is "o"; ``weight`` is one reading.

The integral is frozen while any cable is at its bound.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdhr_host.control.allocation import nearest
from cdhr_host.control.platforms import Equations, Platforms
from cdhr_host.control.protocol import Action, Mode, Plan, Seen
from cdhr_host.profile import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array

UPRIGHT: Final = np.array([False, False, True] * 2)
"""the vertical ones of six coordinates"""


@dataclass(frozen=True, slots=True)
class Gains:
    """What the designer chooses."""

    slope: float = 10.0
    """1/s: c of the sliding surface"""
    reach: float = 100.0 * MM
    """m/s²: eta; must exceed every disturbance over its mass"""
    layer: float = 10.0 * MM
    """m/s: phi; 0 switches hard"""
    lag: float = 10.0
    """1/s: c1 of the auxiliary system"""
    lag_rate: float = 10.0
    """1/s: c2"""
    integral: float = 0.0
    """1/s²: ci"""
    weight: float | None = None
    """of the vertical when forces are optimised inside their windows; None clips each cable"""
    vertical: bool = False
    """Eq. (24)-(25) as one may read them: the vertical acceleration of F_v restored after clipping,
    whatever that does to the windows"""
    auxiliary: bool = True
    """feed l1 and l2 back; without them nothing is left of the windup protection"""
    at_plan: bool = False
    """take J and F_k at the planned pose: less delay margin, several times less noise"""


@dataclass(frozen=True, slots=True)
class PrescribedState:
    """The auxiliary system and the integral."""

    lag: Array
    """(6,) m: l1"""
    lag_rate: Array
    """(6,) m/s: l2"""
    total: Array
    """(6,) m s: integral of e"""


@dataclass(frozen=True, slots=True)
class Law:
    """One evaluation of the law."""

    error: Array
    """(6,) m: e"""
    surface: Array
    """(6,) m/s: s"""
    wanted: Array
    """(6,) N: F_v"""
    given: Array
    """(6,) N: F_o, inside the windows"""
    lag_slope: Array
    """(6,) m/s: l1'"""
    lag_rate_slope: Array
    """(6,) m/s²: l2'"""

    @property
    def saturated(self) -> bool:
        """Whether a cable is at its bound."""
        return bool((self.given != self.wanted).any())


class Prescribed:
    """Force control of both platforms; see the module for the law and what it replaces."""

    def __init__(self, profile: Profile, gains: Gains | None = None) -> None:
        self.gains = Gains() if gains is None else gains
        self._platforms = Platforms(profile)
        window = profile.forces
        self._low = np.repeat([window.lower_min, window.upper_min], 3)
        self._high = np.repeat([window.lower_max, window.upper_max], 3)

    def start(self) -> PrescribedState:
        """At rest, nothing integrated."""
        return PrescribedState(np.zeros(6), np.zeros(6), np.zeros(6))

    def step(
        self, state: PrescribedState, plan: Plan, seen: Seen, dt: float
    ) -> tuple[PrescribedState, Action]:
        """Forces for the next ``dt`` s; raises MotionError out of reach."""
        law = self.law(state, plan, seen)
        if not self.gains.auxiliary:
            total = state.total if law.saturated else state.total + dt * law.error
            return replace(state, total=total), Action(Mode.CLOSED, tension=law.given)
        lag_rate = state.lag_rate + dt * law.lag_rate_slope
        lag = state.lag + dt * (lag_rate - self.gains.lag * state.lag)
        total = state.total if law.saturated else state.total + dt * law.error
        return PrescribedState(lag, lag_rate, total), Action(Mode.CLOSED, tension=law.given)

    def law(self, state: PrescribedState, plan: Plan, seen: Seen) -> Law:
        """Everything the law says about one moment."""
        g = self.gains
        equations = self._platforms.at(plan.position if g.at_plan else seen.position)
        lag_slope = state.lag_rate - g.lag * state.lag
        error = seen.position - plan.position - state.lag
        rate = seen.velocity - plan.velocity - lag_slope
        surface = g.slope * error + rate + g.integral * state.total
        wanted = equations.tension(
            plan.acceleration
            - g.slope * rate
            - g.integral * error
            - g.lag * lag_slope
            - g.lag_rate * state.lag_rate
            - g.reach * self._switched(surface)
        )
        given = self._inside(equations, wanted)
        short = equations.pull @ (given - wanted) / equations.mass
        return Law(error, surface, wanted, given, lag_slope, short - g.lag_rate * state.lag_rate)

    def at_bound(self, tension: Array) -> bool:
        """(6,) N -> whether a cable is at or beyond its window."""
        return bool(((tension <= self._low) | (tension >= self._high)).any())

    def _switched(self, surface: Array) -> Array:
        if self.gains.layer == 0.0:
            return np.sign(surface)
        return np.clip(surface / self.gains.layer, -1.0, 1.0)

    def _inside(self, equations: Equations, wanted: Array) -> Array:
        clipped = np.clip(wanted, self._low, self._high)
        if (clipped == wanted).all():
            return clipped
        if self.gains.vertical:
            kept, asked = equations.acceleration(clipped), equations.acceleration(wanted)
            return equations.tension(np.where(UPRIGHT, asked, kept))
        weight = self.gains.weight
        if weight is None:
            return clipped
        parts = slice(0, 3), slice(3, 6)
        return np.concatenate(
            [
                nearest(equations.pull[part, part], wanted[part], self._low[part], self._high[part], weight)
                for part in parts
            ]
        )
