"""[watch]: what the host looks at while it prints, beside what the drives watch by themselves."""

from typing import Annotated

from pydantic import Field

from cdhr_host.profile.fields import IN_KPA, IN_MM, IN_MS, Section, key, to_si


class Watch(Section):
    """[watch]: how far the machine may be from the plan before the host stops it."""

    slack_force: Annotated[
        float, key("slack_force_n", "measured cable force below which a cable is slack", ge=0, le=1e4)
    ] = 0.5
    force_deviation: Annotated[
        float, key("force_deviation_n", "measured cable force away from the planned one", gt=0, le=1e5)
    ] = 8.0
    torque_deviation: Annotated[
        float, key("torque_deviation_nm", "motor torque away from the planned one", gt=0, le=1e3)
    ] = 0.6
    force_settling: Annotated[
        float, key("force_settling_ms", "time such a force or torque may last", ge=0, le=6e4), IN_MS
    ] = 0.1
    following_floor: Annotated[
        float, key("following_floor_mm", "following error allowed at rest", gt=0, le=100), IN_MM
    ] = 0.3e-3
    following_lag: Annotated[
        float, key("following_lag_ms", "following error allowed per slider speed", ge=0, le=1e3), IN_MS
    ] = 0.03
    following_settling: Annotated[
        float, key("following_settling_ms", "time a greater following error may last", ge=0, le=6e4), IN_MS
    ] = 0.04
    pressure_deviation: Annotated[
        float, key("pressure_deviation_kpa", "pressure away from its command", gt=0, le=1e4), IN_KPA
    ] = 40e3
    pressure_settling: Annotated[
        float, key("pressure_settling_ms", "time such a pressure may last", ge=0, le=6e4), IN_MS
    ] = 0.6
    late_share: Annotated[
        float,
        key("late_share_percent", "cycles of the sender late in ten seconds, of all", gt=0, le=100),
        to_si(0.01),
    ] = 0.02
    disk_free: Annotated[
        int, Field(alias="disk_free_mb", description="space the journal's disk must have, 1e6 bytes", ge=0)
    ] = 100
    feeder_silence: Annotated[
        float, key("feeder_silence_s", "time without a new setpoint that holds the print", gt=0, le=600)
    ] = 5.0
