"""The machine as named objects of plain numbers, mm and percent: what every protocol shows.

Names and keys of the first group are Klipper's (docs/Status_Reference.md of that project), so
that its clients understand them; ``cables``, ``sliders``, ``air`` and ``workspace`` are ours.
Numbers that do not exist are None, never NaN.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from cdhr_host.job.surface import JobState, Status
from cdhr_host.profile.schema import Profile
from cdhr_host.units import KPA, MINUTE, MM, MM3

Object = dict[str, Any]

CABLES: Final = ("1L", "1R", "2L", "2R", "3L", "3R", "4", "5", "6")
PRINT_STATES: Final = {
    JobState.IDLE: "standby",
    JobState.PROVING: "standby",
    JobState.READY: "standby",
    JobState.PRINTING: "printing",
    JobState.HOLDING: "paused",
    JobState.HELD: "paused",
    JobState.RESUMING: "printing",
    JobState.STOPPING: "cancelled",
    JobState.STOPPED: "cancelled",
    JobState.FAULT: "error",
    JobState.DONE: "complete",
}
ACTIVE: Final = frozenset({JobState.PRINTING, JobState.HOLDING, JobState.HELD, JobState.RESUMING})
"""a program is under way"""
PAUSED: Final = frozenset({JobState.HOLDING, JobState.HELD})


@dataclass(frozen=True, slots=True)
class View:
    """What the objects are computed from."""

    status: Status
    profile: Profile
    folder: Path
    absolute: bool
    """X Y Z of scripts (G90)"""
    absolute_e: bool
    """E of scripts (M82)"""
    feed: float
    """m/s, F of scripts"""
    display: str
    """text of M117"""
    uptime: float
    """s"""


def objects(view: View, names: Iterable[str] | None = None) -> dict[str, Object]:
    """The objects of these names, or all; names that are not known are left out."""
    wanted = _known(view) if names is None else names
    found = ((name, _one(view, name)) for name in wanted)
    return {name: each for name, each in found if each is not None}


def chosen(found: dict[str, Object], wanted: dict[str, list[str] | None]) -> dict[str, Object]:
    """Of each object the fields that are wanted; None wants all."""
    return {
        name: {key: value for key, value in each.items() if (keys := wanted.get(name)) is None or key in keys}
        for name, each in found.items()
    }


def changes(before: dict[str, Object], after: dict[str, Object]) -> dict[str, Object]:
    """Only what differs."""
    pairs = (
        (name, {key: value for key, value in each.items() if before.get(name, {}).get(key, ...) != value})
        for name, each in after.items()
    )
    return {name: each for name, each in pairs if each}


def object_names(profile: Profile) -> list[str]:
    """Every object there is."""
    return [*_OBJECTS, *(f"gcode_macro {name}" for name in macro_names(profile))]


def macro_names(profile: Profile) -> list[str]:
    """Scripts of the profile, and the three that clients look for."""
    return ["PAUSE", "RESUME", "CANCEL_PRINT", *profile.serve.macros]


def halted(status: Status) -> bool:
    """Whether nothing moves before it is acknowledged."""
    return status.state is JobState.FAULT


def host_state(status: Status) -> str:
    """``ready`` or ``shutdown``."""
    return "shutdown" if halted(status) else "ready"


def _known(view: View) -> list[str]:
    return object_names(view.profile)


def _one(view: View, name: str) -> Object | None:
    if name.startswith("gcode_macro ") and name.removeprefix("gcode_macro ") in macro_names(view.profile):
        return {}
    make = _OBJECTS.get(name)
    return make(view) if make else None


def number(value: float, digits: int = 4) -> float | None:
    """Rounded for the wire; None for what is not a number."""
    return round(float(value), digits) + 0.0 if math.isfinite(value) else None


def numbers(values: Iterable[float], scale: float = 1.0, digits: int = 4) -> list[float | None]:
    """Several, each divided by ``scale``."""
    return [number(float(value) / scale, digits) for value in values]


def filament_mm(view: View) -> float:
    """E of what has been laid: mm of filament, as the profile's slicer counts it."""
    progress = view.status.progress
    area = math.pi / 4 * (view.profile.extruder.filament_diameter / MM) ** 2
    return progress.extruded / MM3 / area if progress else 0.0


def _position(view: View) -> list[float | None]:
    return [*numbers(view.status.nozzle_G, MM), number(filament_mm(view))]


def _webhooks(view: View) -> Object:
    state = host_state(view.status)
    return {
        "state": state,
        "state_message": view.status.message if state == "shutdown" else "Printer is ready",
    }


def _print_stats(view: View) -> Object:
    status, progress = view.status, view.status.progress
    return {
        "filename": progress.file if progress else "",
        "total_duration": number(progress.elapsed, 2) if progress else 0.0,
        "print_duration": number(progress.printing, 2) if progress else 0.0,
        "filament_used": number(filament_mm(view), 2),
        "state": PRINT_STATES[status.state],
        "message": status.message,
        "info": {
            "total_layer": progress.layers if progress and progress.layers else None,
            "current_layer": progress.layer if progress and progress.layers else None,
        },
    }


def _virtual_sdcard(view: View) -> Object:
    progress = view.status.progress
    return {
        "file_path": str(view.folder / progress.file) if progress else None,
        "progress": number(progress.fraction) if progress else 0.0,
        "is_active": view.status.state in ACTIVE - PAUSED,
        "file_position": progress.position if progress else 0,
        "file_size": progress.size if progress else 0,
    }


def _toolhead(view: View) -> Object:
    bed, limits = view.profile.bed, view.profile.limits
    reach, height = bed.radius / MM, bed.height / MM
    return {
        "position": _position(view),
        "homed_axes": "xyz" if view.status.referenced else "",
        "print_time": number(view.status.tick * view.profile.drives.period, 3),
        "estimated_print_time": number(view.uptime, 3),
        "extruder": "",
        "stalls": 0,
        "max_velocity": number(limits.speed_max / MM),
        "max_accel": number(limits.acceleration_max / MM),
        "minimum_cruise_ratio": 0.0,
        "square_corner_velocity": 5.0,
        "axis_minimum": numbers((-reach, -reach, 0.0, 0.0)),
        "axis_maximum": numbers((reach, reach, height, 0.0)),
        "cone_start_z": number(height),
    }


def _gcode_move(view: View) -> Object:
    position = _position(view)
    return {
        "speed_factor": number(view.status.feed_override),
        "extrude_factor": number(view.status.flow_override),
        "speed": number(view.feed / MM * MINUTE),
        "absolute_coordinates": view.absolute,
        "absolute_extrude": view.absolute_e,
        "homing_origin": [0.0, 0.0, 0.0, 0.0],
        "position": position,
        "gcode_position": position,
    }


def _motion_report(view: View) -> Object:
    area = math.pi / 4 * (view.profile.extruder.filament_diameter / MM) ** 2
    return {
        "live_position": _position(view),
        "live_velocity": number(view.status.velocity / MM) if view.status.buffered else 0.0,
        "live_extruder_velocity": number(view.status.flow / MM3 / area),
        "steppers": [],
        "trapq": [],
    }


def _display_status(view: View) -> Object:
    progress = view.status.progress
    return {"progress": number(progress.fraction) if progress else 0.0, "message": view.display or None}


def _pause_resume(view: View) -> Object:
    return {"is_paused": view.status.state in PAUSED}


def _idle_timeout(view: View) -> Object:
    active = view.status.state in ACTIVE
    progress = view.status.progress
    return {
        "state": "Printing" if active else "Ready",
        "printing_time": number(progress.elapsed, 2) if active and progress else 0.0,
    }


def _configfile(view: View) -> Object:
    settings = settings_of(view.profile, view.folder)
    config = {name: {key: str(value) for key, value in each.items()} for name, each in settings.items()}
    return {
        "config": config,
        "settings": settings,
        "warnings": [],
        "save_config_pending": False,
        "save_config_pending_items": {},
    }


def settings_of(profile: Profile, folder: Path) -> dict[str, Object]:
    """The profile in the words of Klipper's configuration: a round bed, no heater, no extruder."""
    limits = profile.limits
    macros = {f"gcode_macro {name.lower()}": {"gcode": text} for name, text in profile.serve.macros.items()}
    return {
        "printer": {
            "kinematics": "delta",
            "max_velocity": limits.speed_max / MM,
            "max_accel": limits.acceleration_max / MM,
            "print_radius": profile.bed.radius / MM,
            "delta_radius": profile.bed.radius / MM,
        },
        "virtual_sdcard": {"path": str(folder)},
        "pause_resume": {},
        "display_status": {},
        **{f"gcode_macro {name}": {"gcode": ""} for name in ("pause", "resume", "cancel_print")},
        **macros,
    }


def _heaters(_: View) -> Object:
    return {"available_heaters": [], "available_sensors": [], "available_monitors": []}


def _gcode(view: View) -> Object:
    return {"commands": {name: {} for name in macro_names(view.profile)}}


def _mcu(_: View) -> Object:
    return {"mcu_version": "cdhr_host", "mcu_build_versions": "", "mcu_constants": {}, "last_stats": {}}


def _system_stats(view: View) -> Object:
    return {"sysload": 0.0, "cputime": 0.0, "memavail": 0, "uptime": number(view.uptime, 1)}


def _cables(view: View) -> Object:
    status = view.status
    return {
        "names": list(CABLES),
        "tension_n": numbers(status.tension),
        "window_n": [numbers(window) for window in status.window],
        "force_n": numbers(status.force),
    }


def _sliders(view: View) -> Object:
    status = view.status
    return {
        "position_mm": numbers(status.slider, MM),
        "setpoint_mm": numbers(status.slider_setpoint, MM),
        "torque_nm": numbers(status.torque),
    }


def _air(view: View) -> Object:
    status = view.status
    return {
        "pressure_kpa": number(status.pressure / KPA),
        "command_kpa": number(status.pressure_setpoint / KPA),
        "max_kpa": number(view.profile.extruder.pressure_max / KPA),
        "flow_mm3_s": number(status.flow / MM3),
    }


def _workspace(view: View) -> Object:
    status, bed = view.status, view.profile.bed
    return {
        "nozzle_mm": numbers(status.nozzle_G, MM),
        "upper_mm": numbers(status.upper, MM),
        "radius_mm": number(bed.radius / MM),
        "height_mm": number(bed.height / MM),
        "referenced": status.referenced,
        "at_reference": status.homed,
        "job": status.state.value,
        "left_s": number(status.progress.left, 1) if status.progress else None,
        "buffered_s": number(status.buffered * view.profile.drives.period, 3),
    }


_OBJECTS: Final[dict[str, Callable[[View], Object]]] = {
    "webhooks": _webhooks,
    "print_stats": _print_stats,
    "virtual_sdcard": _virtual_sdcard,
    "toolhead": _toolhead,
    "gcode_move": _gcode_move,
    "motion_report": _motion_report,
    "display_status": _display_status,
    "pause_resume": _pause_resume,
    "idle_timeout": _idle_timeout,
    "configfile": _configfile,
    "heaters": _heaters,
    "gcode": _gcode,
    "mcu": _mcu,
    "system_stats": _system_stats,
    "cables": _cables,
    "sliders": _sliders,
    "air": _air,
    "workspace": _workspace,
}
