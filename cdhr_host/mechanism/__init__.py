"""Pose <-> machine: pulley geometry, cable lengths and rates, tensions, and back to the pose.

Displacements q are of the platforms from the reference pose; in program coordinates
q = position_G - cables.reference_G.
"""

from cdhr_host.mechanism import trajectories
from cdhr_host.mechanism.bounds import direction_change_bound
from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.consistency import inconsistencies
from cdhr_host.mechanism.forward import forward, mistaken_error, model_errors, uncompensated_error
from cdhr_host.mechanism.kinematics import jacobian, lengths, reachable, slider, uncompensated_lengths
from cdhr_host.mechanism.state import cable_state
from cdhr_host.mechanism.statics import tensions

__all__ = [
    "Cables",
    "Loads",
    "cable_state",
    "direction_change_bound",
    "forward",
    "inconsistencies",
    "jacobian",
    "lengths",
    "mistaken_error",
    "model_errors",
    "reachable",
    "slider",
    "tensions",
    "trajectories",
    "uncompensated_error",
    "uncompensated_lengths",
]
