"""TOML -> Profile: what one machine is, in SI, with every key of the file wearing its unit."""

from cdhr_host.profile.body import Forces, Geometry, Machine, Platforms, Sliders, Spring, Stretch
from cdhr_host.profile.clay import Clay
from cdhr_host.profile.load import described, find, profile_names, read_table, validate
from cdhr_host.profile.materials import (
    MaterialFile,
    find_material,
    is_material,
    material_folder,
    material_names,
    read_material,
    with_material,
)
from cdhr_host.profile.schema import Air, Bed, Drives, Extruder, Limits, PathRules, Profile

__all__ = [
    "Air",
    "Bed",
    "Clay",
    "Drives",
    "Extruder",
    "Forces",
    "Geometry",
    "Limits",
    "Machine",
    "MaterialFile",
    "PathRules",
    "Platforms",
    "Profile",
    "Sliders",
    "Spring",
    "Stretch",
    "described",
    "find",
    "find_material",
    "is_material",
    "material_folder",
    "material_names",
    "profile_names",
    "read_material",
    "read_table",
    "validate",
    "with_material",
]
