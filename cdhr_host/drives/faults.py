"""What stops a machine, in one list: kinds of problems with sentences and hints."""

from typing import Final

from cdhr_host.errors import DriveError, Problem

HINTS: Final = {
    "setpoint-late": "the computer was too busy: close other programs, allow real-time priority",
    "feedback-lost": "check the bus: cable, termination, power of the drive",
    "feedback-length": "the drive was configured by someone else: open the drives again",
    "heartbeat": "check power and cable of the node; then open the drives again",
    "node-reset": "check the node's power; reference the axis again",
    "emergency": "look the code up in the drive's manual; then: cdhr drives reset",
    "drive-fault": "look the code up in the drive's manual; then: cdhr drives reset",
    "axis-lost-enable": "check emergency stop, STO and enable contactor; then arm again",
    "not-following": "check mode and limits of the drive: cdhr drives status",
    "encoder-jump": "check the encoder's cable; reference the axis again",
    "axis-hangs": "check enable inputs and STO of the drive: cdhr drives status",
    "pressure-deviation": "check air supply, regulator and hose",
    "pressure-sensor": "check the sensor's cable; prefer 4-20 mA",
    "air-lost": "check the air supply",
    "emergency-stop": "release the emergency stop, look at the machine, then arm again",
    "jitter": "allow real-time priority, or set [canopen] allow_soft_realtime = true",
    "ring": "the computer's memory is not to be trusted: test it before the next print",
    "sender": "the sending process ended; the drives stopped by their own watchdogs",
}


def fault(kind: str, message: str, **details: float | str | None) -> DriveError:
    """A DriveError of this kind with its hint."""
    return DriveError(Problem(kind, message, hint=HINTS.get(kind), **details))  # type: ignore[arg-type]
