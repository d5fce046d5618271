"""The bed's cylinder against the volume the machine reaches."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from cdhr_host.mechanism.cables import Cables, Loads
from cdhr_host.mechanism.findings import GEOMETRY, Finding, finding
from cdhr_host.mechanism.kinematics import lengths, reachable, slider
from cdhr_host.mechanism.policy import Policy
from cdhr_host.mechanism.statics import tensions
from cdhr_host.profile import Profile
from cdhr_host.units import MM
from cdhr_host.values import Array

BED: Final = frozenset(f"bed.{key}_mm" for key in ("origin_x", "origin_y", "origin_z", "radius", "height"))
AZIMUTH_STEPS: Final = 72
RADIUS_STEPS: Final = 5
HEIGHT_STEPS: Final = 9
NEARLY: Final = 0.999
"""of the room below the upper pulleys that a bed too high is looked at in"""
HALVINGS: Final = 20
"""of the bed's size when looking for the largest that would do"""


def bed_findings(profile: Profile, cables: Cables, *, sound: bool) -> Iterator[Finding]:
    """Where the cylinder leaves the reachable volume, and the largest one that would not.

    Looked at on a grid of radii, azimuths and heights with rim and corners: between the pulley
    planes, all cables taut under a vertical load, sliders within travel. The upper platform goes
    where the policy puts it where spring and windows are ``sound``, and with the lower one otherwise.
    """
    shape, bed = profile.geometry, profile.bed
    room = shape.upper_pulley_height - shape.reference_separation - bed.origin_z
    yield from _planes(profile, room)
    if bed.origin_z > shape.lower_pulley_height and room > 0.0:
        within = min(bed.height, NEARLY * room)
        slack = [*_slack(profile, cables, within)]
        yield from slack
        if not slack and profile.sliders.travel_min < profile.sliders.travel_max:
            policy = Policy.from_profile(profile, None if sound else "fixed")
            lost = [*_lost(profile, cables, policy, within)]
            yield from lost or _travel(profile, cables, policy, within)


def _planes(profile: Profile, room: float) -> Iterator[Finding]:
    shape, bed = profile.geometry, profile.bed
    floor = shape.lower_pulley_height
    if not bed.origin_z > floor:
        yield finding(
            {"bed.origin_z_mm", "geometry.lower_pulley_height_mm"},
            "bed.origin_z_mm",
            f"= {bed.origin_z / MM:.6g} puts the lower platform "
            f"at or below the plane of the lower pulleys, {floor / MM:.6g} mm",
            value=bed.origin_z / MM,
            limit=floor / MM,
            hint="raise it above that plane",
        )
    if not bed.height < room:
        yield finding(
            {
                "bed.origin_z_mm",
                "bed.height_mm",
                "geometry.upper_pulley_height_mm",
                "geometry.reference_separation_mm",
            },
            "bed.height_mm",
            f"= {bed.height / MM:.6g} takes the upper platform to or above the plane of the upper pulleys",
            value=bed.height / MM,
            limit=room / MM,
            hint=f"a bed.height_mm below {room / MM:.6g} would do" if room > 0 else "lower bed.origin_z_mm",
        )


def _slack(profile: Profile, cables: Cables, height: float) -> Iterator[Finding]:
    bed = profile.bed

    def fits(radius: float) -> bool:
        return _held(profile, cables, _displacements(cables, radius, height))

    if fits(bed.radius):
        return
    radius = _largest(bed.radius, fits)
    yield finding(
        GEOMETRY | BED,
        "bed.radius_mm",
        f"= {bed.radius / MM:.6g} leaves the volume between the pulleys: "
        "there three cables cannot all be taut under a platform's load",
        value=bed.radius / MM,
        limit=radius / MM,
        hint=_advice(radius, "bed.radius_mm", "move bed.origin_x_mm and bed.origin_y_mm towards the axis"),
    )


def _lost(profile: Profile, cables: Cables, policy: Policy, height: float) -> Iterator[Finding]:
    """Whether the policy takes the upper platform out of the pulleys' reach."""

    def fits(rise: float) -> bool:
        q = _displacements(cables, profile.bed.radius, rise)
        return bool(reachable(cables, q, policy.upper(q)).all())

    if fits(height):
        return
    rise = _largest(height, fits)
    yield finding(
        GEOMETRY | BED | {"spring.policy"},
        "bed.height_mm",
        f"= {profile.bed.height / MM:.6g} lets the policy {profile.spring.policy} "
        "take the upper platform out of its cables' reach",
        value=profile.bed.height / MM,
        limit=rise / MM,
        hint=_advice(rise, "bed.height_mm", "take another spring.policy"),
    )


def _travel(profile: Profile, cables: Cables, policy: Policy, height: float) -> Iterator[Finding]:
    bed, sliders = profile.bed, profile.sliders

    def fits(size: float, rise: float) -> bool:
        travel = _sliders(cables, policy, size, rise)
        return bool(travel.min() >= sliders.travel_min and travel.max() <= sliders.travel_max)

    travel = _sliders(cables, policy, bed.radius, height)
    for key, limit, extreme, sign in (
        ("travel_min", sliders.travel_min, travel.min(axis=0), -1.0),
        ("travel_max", sliders.travel_max, travel.max(axis=0), 1.0),
    ):
        cable = int((sign * extreme).argmax())
        if sign * extreme[cable] > sign * limit:
            radius = _largest(bed.radius, lambda size: fits(size, height))
            rise = _largest(height, lambda size: fits(bed.radius, size))
            yield finding(
                GEOMETRY | BED | {f"sliders.{key}_mm", "spring.policy"},
                f"sliders.{key}_mm",
                f"= {limit / MM:.6g} is exceeded in the bed: "
                f"slider {cable + 1} goes to {extreme[cable] / MM:.6g} mm",
                value=float(extreme[cable]) / MM,
                limit=limit / MM,
                hint=f"{_advice(radius, 'bed.radius_mm', 'a smaller radius alone does not help')}; "
                f"{_advice(rise, 'bed.height_mm', 'a lower height alone does not help')}; "
                "or allow the travel",
            )


def _displacements(cables: Cables, radius: float, height: float) -> Array:
    """(N, 3) m: a grid over the cylinder, from the reference pose."""
    azimuth = 2.0 * np.pi * np.arange(AZIMUTH_STEPS) / AZIMUTH_STEPS
    r, turn, z = np.meshgrid(
        np.linspace(0.0, radius, RADIUS_STEPS), azimuth, np.linspace(0.0, height, HEIGHT_STEPS)
    )
    points_G = np.column_stack([(r * np.cos(turn)).ravel(), (r * np.sin(turn)).ravel(), z.ravel()])
    return points_G - cables.reference_G


def _held(profile: Profile, cables: Cables, q: Array) -> bool:
    """Whether a vertical pull between the platforms keeps all six cables taut at every pose."""
    if not reachable(cables, q, q).all():
        return False
    weightless = replace(Loads.from_profile(profile), lower_mass=0.0, upper_mass=0.0, rest_length=0.0)
    return bool((tensions(cables, weightless, q, q) > 0.0).all())


def _sliders(cables: Cables, policy: Policy, radius: float, height: float) -> Array:
    q = _displacements(cables, radius, height)
    return slider(cables, lengths(cables, q, policy.upper(q)))


def _largest(size: float, fits: Callable[[float], bool]) -> float:
    """The largest part of ``size`` that fits, rounded down by halving; 0 if none does."""
    low, high = 0.0, size
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _advice(size: float, key: str, otherwise: str) -> str:
    return f"a {key} up to {np.floor(size / MM * 10) / 10:.6g} would do" if size > MM else otherwise
