"""Flow -> air: the pressure that pushes the planned flow of clay."""

from cdhr_host.extrusion.pressure import AirCommand, air_command

__all__ = ["AirCommand", "air_command"]
