"""Homing, mode 6: one slider at a time, because cables couple the axes."""

import secrets
from collections.abc import Callable
from typing import Final

from cdhr_host.drives.canopen.axis import Axis
from cdhr_host.drives.canopen.cia402 import (
    FOLLOWING_ERROR,
    FOLLOWS_TARGET,
    START_HOMING,
    STEPS_UP,
    SWITCH_ON,
    TARGET_REACHED,
)
from cdhr_host.drives.canopen.machine import CanopenMachine
from cdhr_host.drives.canopen.setup import CSP, HOMING, IP, set_mode
from cdhr_host.drives.canopen.verified import read, verified
from cdhr_host.drives.faults import fault
from cdhr_host.drives.link import Told

MARK: Final = 0x6081
"""profile velocity: cyclic modes do not use it, and it is lost with the drive's power"""
DONE: Final = FOLLOWS_TARGET | TARGET_REACHED
PATIENCE: Final = 120.0
"""s homing of an axis may take"""


def home(machine: CanopenMachine, should_stop: Callable[[], bool], told: Told) -> None:
    """Home all axes in turn with little torque; raises DriveError, with the axis at rest.

    ``should_stop`` is asked in every cycle, ``told`` hears each drive's number as its turn comes.
    """
    for number, axis in enumerate(machine.axes, start=1):
        told(number)
        _prepare(machine, axis)
        try:
            _home(machine, axis, should_stop)
        finally:
            axis.word = SWITCH_ON
            _leave(machine, axis)


def mark(machine: CanopenMachine) -> list[int]:
    """Leave a number in each drive that only its power keeps; raises DriveError."""
    marks = [secrets.randbelow(2**31 - 1) + 1 for _ in machine.axes]
    for axis, value in zip(machine.axes, marks, strict=True):
        verified(machine.bus, axis.node, MARK, 0, value)
    return marks


def marks(machine: CanopenMachine) -> list[int]:
    """The numbers the drives have now; raises DriveError."""
    return [read(machine.bus, axis.node, MARK) for axis in machine.axes]


def _prepare(machine: CanopenMachine, axis: Axis) -> None:
    settings = machine.profile.canopen
    speed = round(settings.homing_speed / settings.position_unit)
    verified(machine.bus, axis.node, 0x6072, 0, round(settings.homing_torque * 1e3))
    verified(machine.bus, axis.node, 0x6098, 0, settings.homing_method)
    verified(machine.bus, axis.node, 0x6099, 1, speed)
    verified(machine.bus, axis.node, 0x607C, 0, 0)
    set_mode(machine.bus, axis.node, HOMING)


def _home(machine: CanopenMachine, axis: Axis, should_stop: Callable[[], bool]) -> None:
    for word, state in STEPS_UP:
        axis.word = word
        machine.run_until(_is(axis, state), f"become {state.value}", _this(axis))
    axis.word = START_HOMING
    deadline = machine.bus.clock.now() + PATIENCE
    while axis.status & DONE != DONE:
        axis.jump = 0.0
        findings = [f for f in machine.listen() if f.problems[0].kind != "encoder-jump"]
        if findings:
            raise findings[0]
        machine.hold()
        if should_stop():
            raise fault("homing", f"homing was stopped at drive {axis.node}: nothing may move")
        if axis.status & FOLLOWING_ERROR or machine.bus.clock.now() > deadline:
            raise fault("homing", f"drive {axis.node} did not find its home")


def _leave(machine: CanopenMachine, axis: Axis) -> None:
    """Back to normal torque and the cyclic mode, brake closed."""
    settings = machine.profile.canopen
    torque = round(machine.profile.drives.torque_max / settings.rated_torque * 1e3)
    for _ in range(3):
        if findings := [f for f in machine.listen() if f.problems[0].kind != "encoder-jump"]:
            raise findings[0]
        machine.hold()
    verified(machine.bus, axis.node, 0x6072, 0, torque)
    set_mode(machine.bus, axis.node, CSP if settings.mode == "csp" else IP)
    machine.watch.unreferenced.discard(axis.node - 1)


def _is(axis: Axis, state: object) -> Callable[[], bool]:
    return lambda: axis.state is state


def _this(axis: Axis) -> Callable[[Axis], bool]:
    return lambda other: other is axis
