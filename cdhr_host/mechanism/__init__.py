"""Pose <-> machine: pulley geometry, cable lengths and rates, tensions, and back to the pose.

Displacements q are of the platforms from the reference pose; in program coordinates
q = position_G - cables.reference_G.
"""

from cdhr_host.mechanism import trajectories
from cdhr_host.mechanism.bounds import UpperBounds, direction_change_bound, upper_bounds
from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.clearance import Clearance, clear_radius
from cdhr_host.mechanism.consistency import inconsistencies
from cdhr_host.mechanism.dynamics import (
    AffineTensions,
    accelerations,
    affine_nine_tensions,
    affine_tensions,
    tension_slopes,
    tension_stiffness,
)
from cdhr_host.mechanism.force_room import Swings, swings
from cdhr_host.mechanism.forward import forward, mistaken_error, model_errors, uncompensated_error
from cdhr_host.mechanism.frequencies import elastic_frequencies, swinging_frequencies
from cdhr_host.mechanism.kinematics import (
    jacobian,
    lengths,
    lengths_and_rates,
    reachable,
    slider,
    uncompensated_lengths,
)
from cdhr_host.mechanism.pairs import (
    Pairs,
    Shares,
    bounded_shares,
    condition,
    moment_matrix,
    nine_tensions,
    shares,
)
from cdhr_host.mechanism.policy import POLICIES, Policy, PolicyName, UpperMotion
from cdhr_host.mechanism.response import Response, Windows, response
from cdhr_host.mechanism.state import cable_state
from cdhr_host.mechanism.statics import tensions
from cdhr_host.mechanism.stretch import Give, stretch_doubt, stretched_forward
from cdhr_host.mechanism.transition import transition
from cdhr_host.mechanism.turning import wrap_rates
from cdhr_host.mechanism.workspace import Angles, Printable, Workspace, angles, printable

__all__ = [
    "POLICIES",
    "AffineTensions",
    "Angles",
    "Cables",
    "Clearance",
    "Give",
    "Loads",
    "Pairs",
    "Policy",
    "PolicyName",
    "Printable",
    "Response",
    "Shares",
    "Swings",
    "UpperBounds",
    "UpperMotion",
    "Windows",
    "Workspace",
    "accelerations",
    "affine_nine_tensions",
    "affine_tensions",
    "angles",
    "bounded_shares",
    "cable_state",
    "clear_radius",
    "condition",
    "direction_change_bound",
    "elastic_frequencies",
    "forward",
    "inconsistencies",
    "jacobian",
    "lengths",
    "lengths_and_rates",
    "mistaken_error",
    "model_errors",
    "moment_matrix",
    "nine_tensions",
    "printable",
    "reachable",
    "response",
    "shares",
    "slider",
    "stretch_doubt",
    "stretched_forward",
    "swinging_frequencies",
    "swings",
    "tension_slopes",
    "tension_stiffness",
    "tensions",
    "trajectories",
    "transition",
    "uncompensated_error",
    "uncompensated_lengths",
    "upper_bounds",
    "wrap_rates",
]
