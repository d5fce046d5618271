"""The machine, simulated: step(state, input) -> state. Pure and stepwise, no clock."""

from cdhr_host.plant.machine import Disturbance, Machine, MachineState, undisturbed

__all__ = ["Disturbance", "Machine", "MachineState", "undisturbed"]
