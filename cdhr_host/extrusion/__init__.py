"""Flow -> air: the pressure that pushes the planned flow of clay."""

from cdhr_host.extrusion.lead import AirStage
from cdhr_host.extrusion.material import bores, clay_findings, flow_law
from cdhr_host.extrusion.model import AirModel, ticks
from cdhr_host.extrusion.pressure import AirCommand, air_command
from cdhr_host.extrusion.rheology import Channel, ChannelFlow, LinearFlow, Material, PressureFlow

__all__ = [
    "AirCommand",
    "AirModel",
    "AirStage",
    "Channel",
    "ChannelFlow",
    "LinearFlow",
    "Material",
    "PressureFlow",
    "air_command",
    "bores",
    "clay_findings",
    "flow_law",
    "ticks",
]
