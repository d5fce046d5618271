"""Programs made by a formula, as G-code text: the paper's ring and trajectories, clay to measure."""

from cdhr_host.samples.clay import Bead, Push, cups, lines, steps
from cdhr_host.samples.laws import LAWS, Law
from cdhr_host.samples.ring import Ring, ring
from cdhr_host.samples.traced import traced

__all__ = ["LAWS", "Bead", "Law", "Push", "Ring", "cups", "lines", "ring", "steps", "traced"]
