"""The machine, simulated: step(state, input) -> state. Pure and stepwise, no clock."""

from cdhr_host.plant.clay import Clay, ClayState, Paste
from cdhr_host.plant.machine import Disturbance, Machine, MachineState, undisturbed

__all__ = ["Clay", "ClayState", "Disturbance", "Machine", "MachineState", "Paste", "undisturbed"]
