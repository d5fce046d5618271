"""The words of an inconsistency: numbers as the profile's file wears them."""

from collections.abc import Set as AbstractSet
from typing import Final

from cdhr_host.errors import Problem
from cdhr_host.profile import Profile
from cdhr_host.units import split_unit

Finding = tuple[frozenset[str], Problem]
"""the "section.key" names a problem relies on, and the problem"""

GEOMETRY: Final = frozenset(
    f"geometry.{key}_mm"
    for key in (
        "pulley_circle_radius",
        "pulley_radius",
        "lower_pulley_height",
        "upper_pulley_height",
        "lower_attachment_radius",
        "upper_attachment_radius",
        "reference_height",
        "reference_separation",
    )
)


def worn(profile: Profile, key: str) -> float:
    """The value of "section.key_unit" in that unit, as the file has it."""
    section, name = key.split(".")
    bare, factor = split_unit(name)
    return float(getattr(getattr(profile, section), bare)) / factor


def finding(
    relies_on: AbstractSet[str], key: str, wrong: str, *, value: float, limit: float, hint: str
) -> Finding:
    """``key`` is what the author is asked to look at first; value and limit are in its unit."""
    bare, _ = split_unit(key)
    unit = key.removeprefix(bare).strip("_")
    return frozenset(relies_on), Problem(
        "inconsistent", f"{key} {wrong}", key=key, value=value, limit=limit, unit=unit, hint=hint
    )
