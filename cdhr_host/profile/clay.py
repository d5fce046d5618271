"""The clay: how it flows and how late it starts. A section of a machine, or a file of its own."""

from typing import Annotated, Literal

from pydantic import Field

from cdhr_host.profile.fields import IN_MM3_KPA, IN_MS, Section, key


class Clay(Section):
    """[clay]: the paste in the extruder. A material profile is this section alone, complete."""

    name: Annotated[str, Field(description="short name of the clay", max_length=80)] = ""
    source: Annotated[str, Field(description="where the numbers come from", max_length=400)] = ""
    example: Annotated[
        bool, Field(description="true for numbers from the literature, not measured on this clay")
    ] = False
    model: Annotated[
        Literal["line", "herschel-bulkley"],
        Field(description="the straight line of [extruder], or a paste through nozzle and hose"),
    ] = "line"
    yield_stress: Annotated[
        float, key("yield_stress_pa", "shear stress below which the clay stands", ge=0, le=1e6)
    ] = 600.0
    consistency: Annotated[
        float, key("consistency_pa_s_n", "shear stress above yield at a rate of 1/s", gt=0, le=1e6)
    ] = 300.0
    index: Annotated[
        float, Field(description="exponent of the shear rate; below 1 thins when sheared", ge=0.05, le=2)
    ] = 0.4
    density: Annotated[
        float, key("density_kg_m3", "density of the wet clay, for weighings", ge=500, le=5000)
    ] = 1900.0
    open_dead: Annotated[
        float,
        key("open_dead_ms", "from raising the pressure to the first change at the nozzle", ge=0, le=1e4),
        IN_MS,
    ] = 0.0
    close_dead: Annotated[
        float,
        key("close_dead_ms", "from dropping the pressure to the first change at the nozzle", ge=0, le=1e4),
        IN_MS,
    ] = 0.0
    line_lag: Annotated[
        float,
        key("line_lag_ms", "time constant from the regulator's pressure to the clay's", ge=0, le=1e4),
        IN_MS,
    ] = 0.0
    compliance: Annotated[
        float,
        key("compliance_mm3_kpa", "clay stored in reservoir and hose for each kPa", ge=0, le=1e4),
        IN_MM3_KPA,
    ] = 0.0
