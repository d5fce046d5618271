"""Error -> force or shift: controllers, pure and stepwise, and where the pose comes from."""

from cdhr_host.control.funnel import Funnel
from cdhr_host.control.outer import Outer, OuterSettings, OuterState
from cdhr_host.control.pose import EncoderPose, PoseSample, PoseSource
from cdhr_host.control.prescribed import Gains, Law, Prescribed, PrescribedState
from cdhr_host.control.protocol import Action, Controller, Mode, Plan, Seen

__all__ = [
    "Action",
    "Controller",
    "EncoderPose",
    "Funnel",
    "Gains",
    "Law",
    "Mode",
    "Outer",
    "OuterSettings",
    "OuterState",
    "Plan",
    "PoseSample",
    "PoseSource",
    "Prescribed",
    "PrescribedState",
    "Seen",
]
