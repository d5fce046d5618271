"""Profile values that contradict each other: order, preload at the reference pose, the bed's volume."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from cdhr_host.mechanism.bed import bed_findings
from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.findings import GEOMETRY, Finding, finding, worn
from cdhr_host.mechanism.statics import tensions
from cdhr_host.profile import Profile
from cdhr_host.units import MM

RISING: Final = (
    ("forces.lower_min_n", "forces.lower_max_n", "no force would be inside the window"),
    ("forces.upper_min_n", "forces.upper_max_n", "no force would be inside the window"),
    ("forces.single_min_n", "forces.single_max_n", "no force would be inside the window"),
    ("sliders.travel_min_mm", "sliders.travel_max_mm", "the sliders could not move"),
    ("extruder.pressure_threshold_kpa", "extruder.pressure_max_kpa", "no clay would ever flow"),
    ("spring.rest_length_mm", "geometry.reference_separation_mm", "the spring would push, not pull"),
    (
        "geometry.lower_pulley_height_mm",
        "geometry.reference_height_mm",
        "the lower platform must be above its pulleys",
    ),
)
"""lesser key, greater key, what goes wrong otherwise"""
SPRING: Final = frozenset({"spring.stiffness_n_mm", "spring.rest_length_mm"})
GROUPS: Final = {"lower": (0, "1, 2 and 3"), "upper": (3, "4, 5 and 6")}


def inconsistencies(profile: Profile) -> list[Finding]:
    """Every contradiction of a profile, with the "section.key" names it relies on.

    Preload and bed are looked at when geometry, spring and windows are in order.
    """
    found = [*_out_of_order(profile), *_out_of_room(profile)]
    sections = {str(problem.key).split(".")[0] for _, problem in found}
    if not sections & {"geometry", "spring", "forces"}:
        found += _preload(profile)
    if "geometry" not in sections:
        found += bed_findings(
            profile, Cables.from_profile(profile), sound=not sections & {"spring", "forces"}
        )
    return found


def _out_of_order(profile: Profile) -> Iterator[Finding]:
    for low, high, wrong in RISING:
        value, limit = worn(profile, low), worn(profile, high)
        if not value < limit:
            yield finding(
                {low, high},
                low,
                f"= {value:.6g} must be below {high} = {limit:.6g}: {wrong}",
                value=value,
                limit=limit,
                hint=f"lower {low} or raise {high}",
            )


def _out_of_room(profile: Profile) -> Iterator[Finding]:
    """Platforms and pulleys that do not fit into each other at the reference pose."""
    shape = profile.geometry
    tops = {
        "geometry.reference_height_mm",
        "geometry.reference_separation_mm",
        "geometry.upper_pulley_height_mm",
    }
    top, ceiling = shape.reference_height + shape.reference_separation, shape.upper_pulley_height
    if not top < ceiling:
        yield finding(
            tops,
            "geometry.upper_pulley_height_mm",
            f"= {ceiling / MM:.6g} must be above the upper platform at the reference pose, {top / MM:.6g} mm",
            value=ceiling / MM,
            limit=top / MM,
            hint="raise it, or lower geometry.reference_height_mm or geometry.reference_separation_mm",
        )
    for key in ("geometry.lower_attachment_radius_mm", "geometry.upper_attachment_radius_mm"):
        room = (shape.pulley_circle_radius - worn(profile, key) * MM) / MM
        radius = shape.pulley_radius / MM
        if not radius < room:
            yield finding(
                {key, "geometry.pulley_radius_mm", "geometry.pulley_circle_radius_mm"},
                "geometry.pulley_radius_mm",
                f"= {radius:.6g} must be below the {room:.6g} mm "
                f"from the attachments ({key}) to the pulley centres",
                value=radius,
                limit=room,
                hint=f"lower it, or {key}, or raise geometry.pulley_circle_radius_mm",
            )


def _preload(profile: Profile) -> Iterator[Finding]:
    """Tensions of the resting machine at the reference pose against the force windows."""
    cables, loads = Cables.from_profile(profile), Loads.from_profile(profile)
    at_reference = np.zeros((1, 3))
    force = tensions(cables, loads, at_reference, at_reference)[0]
    for group, (first, names) in GROUPS.items():
        value = float(force[first])
        low, high = f"forces.{group}_min_n", f"forces.{group}_max_n"
        for key, outside in (
            (low, value < worn(profile, low)),
            (high, value > worn(profile, high)),
        ):
            if outside:
                limit = worn(profile, key)
                yield finding(
                    GEOMETRY | SPRING | {key, f"platforms.{group}_mass_kg"},
                    key,
                    f"= {limit:.6g} leaves the reference pose out of the window: "
                    f"cables {names} carry {value:.5g} N each, "
                    f"{'below' if key == low else 'above'} it",
                    value=value,
                    limit=limit,
                    hint=_feasible_rest(profile, cables, loads),
                )


def _feasible_rest(profile: Profile, cables: Cables, loads: Loads) -> str:
    """What rest length would bring all six cables into their windows: tension is affine in spring force."""
    at_reference = np.zeros((2, 3))
    slack = replace(loads, rest_length=loads.separation)
    taut = replace(loads, rest_length=0.0)
    greatest = loads.stiffness * loads.separation
    none = tensions(cables, slack, at_reference, at_reference)[0, ::3]
    slope = (tensions(cables, taut, at_reference, at_reference)[0, ::3] - none) / greatest
    lows = [worn(profile, f"forces.{group}_min_n") for group in GROUPS]
    highs = [worn(profile, f"forces.{group}_max_n") for group in GROUPS]
    least = max(0.0, *((np.array(lows) - none) / slope))
    most = min(greatest, *((np.array(highs) - none) / slope))
    if not least < most:
        return "no spring.rest_length_mm brings all six cables inside: widen the windows in [forces]"
    shortest, longest = ((loads.separation - force / loads.stiffness) / MM for force in (most, least))
    return (
        f"a spring.rest_length_mm from {shortest:.6g} to {longest:.6g} "
        f"(spring force {least:.4g} to {most:.4g} N) brings all six cables inside; or change the window"
    )
