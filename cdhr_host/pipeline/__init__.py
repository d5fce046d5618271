"""The staircase itself: the only room that knows the order of the floors."""

from cdhr_host.pipeline.opening import check_profile, open_profile
from cdhr_host.pipeline.proof import Proof, prove
from cdhr_host.pipeline.staircase import Checked, Staircase

__all__ = ["Checked", "Proof", "Staircase", "check_profile", "open_profile", "prove"]
