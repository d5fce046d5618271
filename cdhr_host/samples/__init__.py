"""Programs made by a formula: the paper's ring and trajectories as G-code text."""

from cdhr_host.samples.laws import LAWS, Law
from cdhr_host.samples.ring import Ring, ring
from cdhr_host.samples.traced import traced

__all__ = ["LAWS", "Law", "Ring", "ring", "traced"]
