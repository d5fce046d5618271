"""The sections that say what the machine is made of: geometry, spring, platforms, cables, sliders."""

from typing import Annotated, Literal

from pydantic import Field

from cdhr_host.profile.fields import IN_DEG, IN_MM, IN_N_MM, Section, key, to_si
from cdhr_host.units import DEG, MM


class Machine(Section):
    """[machine]: what this profile describes."""

    name: Annotated[str, Field(description="short name of the machine", min_length=1, max_length=80)]
    source: Annotated[str, Field(description="where the numbers come from", max_length=400)] = ""


class Geometry(Section):
    """[geometry]: pulleys and platforms, Table A1."""

    pulley_circle_radius: Annotated[
        float,
        key("pulley_circle_radius_mm", "radius of the circle the pulley centres stand on", gt=0, le=1e5),
        IN_MM,
    ]
    pulley_radius: Annotated[
        float, key("pulley_radius_mm", "groove radius of the pulleys", ge=0, le=500), IN_MM
    ]
    lower_pulley_height: Annotated[
        float,
        key("lower_pulley_height_mm", "height of the lower pulley centres in W", ge=-1e5, le=1e5),
        IN_MM,
    ]
    upper_pulley_height: Annotated[
        float,
        key("upper_pulley_height_mm", "height of the upper pulley centres in W", ge=-1e5, le=1e5),
        IN_MM,
    ]
    lower_attachment_radius: Annotated[
        float,
        key(
            "lower_attachment_radius_mm", "radius of the pair mid-points on the lower platform", ge=0, le=1e4
        ),
        IN_MM,
    ]
    upper_attachment_radius: Annotated[
        float,
        key(
            "upper_attachment_radius_mm",
            "radius of the attachment points on the upper platform",
            ge=0,
            le=1e4,
        ),
        IN_MM,
    ]
    reference_height: Annotated[
        float,
        key(
            "reference_height_mm",
            "height of the lower attachment plane in W at the reference pose",
            ge=-1e5,
            le=1e5,
        ),
        IN_MM,
    ]
    reference_separation: Annotated[
        float,
        key(
            "reference_separation_mm",
            "upper attachment plane above the lower one at the reference pose",
            gt=0,
            le=1e4,
        ),
        IN_MM,
    ]
    pair_spacing: Annotated[
        float, key("pair_spacing_mm", "distance between the two cables of a lower pair", gt=0, le=1e4), IN_MM
    ] = 110.0 * MM
    nozzle_length: Annotated[
        float, key("nozzle_length_mm", "lower attachment plane above the nozzle's tip", gt=0, le=1e4), IN_MM
    ] = 200.0 * MM
    wrap_max: Annotated[
        float, key("wrap_max_deg", "greatest wrap of a cable about its pulley", gt=0, le=90), IN_DEG
    ] = 90.0 * DEG
    fleet_max: Annotated[
        float,
        key("fleet_max_deg", "greatest swing of a cable from its pulley's own plane", gt=0, le=90),
        IN_DEG,
    ] = 90.0 * DEG
    pulley_model: Annotated[
        Literal["swivel", "fixed-plane", "caster", "point"],
        Field(
            description="how the pulleys are hung: about the vertical, not at all, about the cable, or none"
        ),
    ] = "swivel"


class Spring(Section):
    """[spring]: between the two platforms, Eq. (11) with the rest length the paper leaves out."""

    stiffness: Annotated[float, key("stiffness_n_mm", "stiffness", gt=0, le=1e4), IN_N_MM]
    rest_length: Annotated[float, key("rest_length_mm", "length without force", ge=0, le=1e4), IN_MM]
    policy: Annotated[
        Literal["fixed", "preload", "vertical", "free"],
        Field(
            description="where the upper platform stands: constant offset, constant force, best height, best place"
        ),
    ] = "free"
    preload: Annotated[
        float, key("preload_n", "spring force that the policy preload holds", gt=0, le=1e5)
    ] = 30.0


class Platforms(Section):
    """[platforms]: what hangs on the cables."""

    lower_mass: Annotated[
        float, key("lower_mass_kg", "mass of the lower platform with nozzle and clay", gt=0, le=1e3)
    ]
    upper_mass: Annotated[float, key("upper_mass_kg", "mass of the upper platform", gt=0, le=1e3)]


class Forces(Section):
    """[forces]: the window each equivalent cable's force must stay in."""

    lower_min: Annotated[float, key("lower_min_n", "least force of cables 1-3", ge=0, le=1e5)]
    lower_max: Annotated[float, key("lower_max_n", "greatest force of cables 1-3", gt=0, le=1e5)]
    upper_min: Annotated[float, key("upper_min_n", "least force of cables 4-6", ge=0, le=1e5)]
    upper_max: Annotated[float, key("upper_max_n", "greatest force of cables 4-6", gt=0, le=1e5)]
    single_min: Annotated[
        float, key("single_min_n", "least force of one cable of a lower pair", ge=0, le=1e5)
    ] = 0.0
    single_max: Annotated[
        float, key("single_max_n", "greatest force of one cable of a lower pair", gt=0, le=1e5)
    ] = 1e5


class Stretch(Section):
    """[stretch]: cables that give under load."""

    compensation: Annotated[
        Literal["off", "on"], Field(description="whether setpoints allow for the cables' stretch")
    ] = "off"
    stiffness: Annotated[
        float, key("stiffness_n", "EA of one cable: force for doubling its length", gt=0, le=1e9)
    ] = 30e3
    stiffness_doubt: Annotated[
        float, key("stiffness_doubt_percent", "how far EA may be off", ge=0, lt=100), to_si(0.01)
    ] = 0.2
    lower_dead_length: Annotated[
        float, key("lower_dead_length_mm", "cable between pulley and slider, cables 1-3", ge=0, le=1e5), IN_MM
    ] = 1.0
    upper_dead_length: Annotated[
        float, key("upper_dead_length_mm", "cable between pulley and slider, cables 4-6", ge=0, le=1e5), IN_MM
    ] = 1.0


class Sliders(Section):
    """[sliders]: six ball screws; travel counts from the reference pose, positive paid out."""

    screw_lead: Annotated[
        float, key("screw_lead_mm", "travel of a slider in one motor turn", gt=0, le=1e3), IN_MM
    ]
    travel_min: Annotated[float, key("travel_min_mm", "end of travel winding in", ge=-1e5, le=0), IN_MM]
    travel_max: Annotated[float, key("travel_max_mm", "end of travel paying out", ge=0, le=1e5), IN_MM]
    speed_max: Annotated[float, key("speed_max_mm_s", "greatest slider speed", gt=0, le=1e5), IN_MM]
    acceleration_max: Annotated[
        float, key("acceleration_max_mm_s2", "greatest slider acceleration", gt=0, le=1e7), IN_MM
    ]
    jerk_max: Annotated[float, key("jerk_max_mm_s3", "greatest slider jerk", gt=0, le=1e9), IN_MM]
