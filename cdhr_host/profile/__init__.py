"""TOML -> Profile: what one machine is, in SI, with every key of the file wearing its unit."""

from cdhr_host.profile.body import Forces, Geometry, Machine, Platforms, Sliders, Spring, Stretch
from cdhr_host.profile.load import described, find, profile_names, read_table, validate
from cdhr_host.profile.schema import Air, Bed, Drives, Extruder, Limits, PathRules, Profile

__all__ = [
    "Air",
    "Bed",
    "Drives",
    "Extruder",
    "Forces",
    "Geometry",
    "Limits",
    "Machine",
    "PathRules",
    "Platforms",
    "Profile",
    "Sliders",
    "Spring",
    "Stretch",
    "described",
    "find",
    "profile_names",
    "read_table",
    "validate",
]
