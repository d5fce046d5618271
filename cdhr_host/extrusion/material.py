"""The clay of a profile as a law of flow."""

from typing import Final

from cdhr_host.extrusion.rheology import Channel, ChannelFlow, LinearFlow, Material, PressureFlow
from cdhr_host.mechanism.findings import Finding, finding
from cdhr_host.profile import Clay, Extruder, Profile
from cdhr_host.units import KPA

PUSHED_BY: Final = frozenset(
    f"extruder.{key}"
    for key in (
        "nozzle_diameter_mm",
        "nozzle_bore_length_mm",
        "hose_diameter_mm",
        "hose_length_mm",
        "pressure_max_kpa",
    )
)


def flow_law(extruder: Extruder, clay: Clay) -> PressureFlow:
    """Pressure and flow of this clay in this extruder: the straight line, or nozzle and hose."""
    if clay.model == "line":
        return LinearFlow(extruder.pressure_threshold, extruder.pressure_slope)
    return ChannelFlow(Material(clay.yield_stress, clay.consistency, clay.index), bores(extruder))


def bores(extruder: Extruder) -> tuple[Channel, ...]:
    """What the clay is pushed through: the nozzle, and the hose if there is one."""
    nozzle = Channel(extruder.nozzle_diameter, extruder.nozzle_bore_length)
    if extruder.hose_length == 0.0:
        return (nozzle,)
    return nozzle, Channel(extruder.hose_diameter, extruder.hose_length)


def clay_findings(profile: Profile) -> list[Finding]:
    """A clay that the machine's air can never push."""
    extruder, clay = profile.extruder, profile.clay
    threshold, most = flow_law(extruder, clay).threshold / KPA, extruder.pressure_max / KPA
    if clay.model == "line" or threshold < most:
        return []
    softer = clay.yield_stress * most / threshold
    return [
        finding(
            {*PUSHED_BY, "clay.model", "clay.yield_stress_pa"},
            "clay.yield_stress_pa",
            f"= {clay.yield_stress:.6g} moves above {threshold:.6g} kPa only, "
            f"and extruder.pressure_max_kpa = {most:.6g}: no clay would ever flow",
            value=clay.yield_stress,
            limit=softer,
            hint=f"soften the clay below {softer:.4g} Pa, or take a wider or shorter nozzle and hose",
        )
    ]
