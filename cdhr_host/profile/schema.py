"""The profile's sections and keys: bounds in the file's unit, values in SI.

Each field is declared once, as ``name: Annotated[float, key("name_unit", text, bounds), UNIT]``:
``key`` gives the name in the file, its bounds there and its one-line description; the unit
marker after it turns the validated number into SI.
"""

from typing import Annotated, Literal

from pydantic import Field

from cdhr_host.profile.body import Forces, Geometry, Machine, Platforms, Sliders, Spring, Stretch
from cdhr_host.profile.calibration import Calibration
from cdhr_host.profile.clay import Clay
from cdhr_host.profile.fields import (
    IN_DEG,
    IN_KPA,
    IN_KPA_S_MM3,
    IN_MM,
    IN_MS,
    Section,
    key,
    to_si,
)
from cdhr_host.profile.serving import Serve
from cdhr_host.profile.watch import Watch
from cdhr_host.units import MM


class Limits(Section):
    """[limits]: of the nozzle."""

    speed_max: Annotated[
        float, key("speed_max_mm_s", "greatest nozzle speed, whatever F says", gt=0, le=1e5), IN_MM
    ]
    acceleration_max: Annotated[
        float, key("acceleration_max_mm_s2", "greatest nozzle acceleration", gt=0, le=1e7), IN_MM
    ]
    jerk_max: Annotated[float, key("jerk_max_mm_s3", "greatest nozzle jerk", gt=0, le=1e9), IN_MM]


class PathRules(Section):
    """[path]: how exactly the nozzle follows the drawn path."""

    tolerance: Annotated[
        float, key("tolerance_mm", "greatest deviation from the programmed path", ge=1e-3, le=50), IN_MM
    ]
    stop_angle: Annotated[
        float, key("stop_angle_deg", "corners sharper than this are exact stops", gt=0, le=180), IN_DEG
    ]
    shaper: Annotated[
        Literal["none", "zv", "mzv", "ei"],
        Field(description="input shaper against ringing; none leaves the motion as planned"),
    ] = "none"
    shaper_frequency: Annotated[
        float, key("shaper_frequency_hz", "frequency of the mode the shaper cancels", ge=0.5, le=500)
    ] = 14.0
    shaper_damping: Annotated[float, Field(description="damping ratio of that mode", ge=0, le=0.9)] = 0.02


class Bed(Section):
    """[bed]: where programs live in W, and the volume they may use."""

    origin_x: Annotated[
        float,
        key("origin_x_mm", "lower platform's x in W when the nozzle is at program 0", ge=-1e5, le=1e5),
        IN_MM,
    ]
    origin_y: Annotated[
        float,
        key("origin_y_mm", "lower platform's y in W when the nozzle is at program 0", ge=-1e5, le=1e5),
        IN_MM,
    ]
    origin_z: Annotated[
        float,
        key("origin_z_mm", "lower platform's z in W when the nozzle is at program 0", ge=-1e5, le=1e5),
        IN_MM,
    ]
    radius: Annotated[
        float,
        key("radius_mm", "radius of the printable cylinder about the program origin", gt=0, le=1e5),
        IN_MM,
    ]
    height: Annotated[
        float,
        key("height_mm", "height of the printable cylinder above the program origin", gt=0, le=1e5),
        IN_MM,
    ]
    clear_height: Annotated[
        float, key("clear_height_mm", "how far above the print G28 travels", gt=0, le=1e4), IN_MM
    ]
    clear_radius: Annotated[
        float,
        key(
            "clear_radius_mm",
            "clay nearer to the reference axis than this keeps G28 from descending",
            ge=0,
            le=1e5,
        ),
        IN_MM,
    ]
    clearance: Annotated[
        Literal["refuse", "warn"],
        Field(description="what a cable running into the bed or the print does to a program"),
    ] = "refuse"


class Extruder(Section):
    """[extruder]: E to clay, clay to air."""

    nozzle_diameter: Annotated[float, key("nozzle_diameter_mm", "bore of the nozzle", gt=0, le=100), IN_MM]
    e_unit: Annotated[
        Literal["mm", "mm3"], Field(description="E counts millimetres of filament or mm³ (M200 overrides)")
    ]
    filament_diameter: Annotated[
        float,
        key("filament_diameter_mm", "diameter of the filament the slicer was told", gt=0, le=100),
        IN_MM,
    ]
    pressure_threshold: Annotated[
        float, key("pressure_threshold_kpa", "pressure below which no clay flows", ge=0, le=2000), IN_KPA
    ]
    pressure_slope: Annotated[
        float,
        key("pressure_slope_kpa_s_mm3", "pressure for each mm³/s above the threshold", gt=0, le=1e3),
        IN_KPA_S_MM3,
    ]
    pressure_max: Annotated[
        float, key("pressure_max_kpa", "greatest pressure of the air supply", gt=0, le=2000), IN_KPA
    ]
    material: Annotated[
        str,
        Field(description="name or path of a material profile; empty takes [clay]", max_length=400),
    ] = ""
    lead: Annotated[
        Literal["off", "identified", "on"],
        Field(
            description="air acts early by dead times and lags: always, or once [clay] has a dead time or lag"
        ),
    ] = "identified"
    coast: Annotated[
        float,
        key("coast_mm", "end of every bead that is left to the clay still running out", ge=0, le=100),
        IN_MM,
    ] = 0.0
    nozzle_bore_length: Annotated[
        float, key("nozzle_bore_length_mm", "length of the nozzle's cylindrical bore", gt=0, le=1e3), IN_MM
    ] = 20.0 * MM
    hose_diameter: Annotated[
        float,
        key("hose_diameter_mm", "bore of the hose or cartridge the clay comes through", gt=0, le=1e3),
        IN_MM,
    ] = 40.0 * MM
    hose_length: Annotated[
        float, key("hose_length_mm", "length of clay in it; 0 is none", ge=0, le=1e5), IN_MM
    ] = 150.0 * MM


class Job(Section):
    """[job]: how a print is held, paused and given up."""

    hold: Annotated[
        Literal["clean", "prompt"],
        Field(
            description="clean: a change of pace waits until the air can follow it; prompt: at once, the clay late"
        ),
    ] = "clean"
    resume_prime: Annotated[
        float,
        key(
            "resume_prime_ms",
            "clay pushed while standing before a held bead goes on, and after a pause",
            ge=0,
            le=6e4,
        ),
        IN_MS,
    ] = 0.0
    lift: Annotated[
        float,
        key("lift_mm", "how far the nozzle goes up after an abort, and for pauses with a lift", ge=0, le=500),
        IN_MM,
    ] = 20.0 * MM
    pauses_lift: Annotated[
        bool, Field(description="the nozzle goes up by lift_mm for pauses and between layers that dry")
    ] = False
    pauses_park: Annotated[
        bool,
        Field(description="with pauses_lift: it goes to the park place too, lift_mm above all clay"),
    ] = False
    park_x: Annotated[float, key("park_x_mm", "where it waits, program x", ge=-1e5, le=1e5), IN_MM] = 0.0
    park_y: Annotated[float, key("park_y_mm", "where it waits, program y", ge=-1e5, le=1e5), IN_MM] = 0.0
    pause_every_layers: Annotated[
        int,
        Field(description="layers after which a print pauses for an operator; 0 is never", ge=0, le=10_000),
    ] = 0
    layer_time_min: Annotated[
        float, key("layer_time_min_s", "time a layer takes at least, so that it can dry", ge=0, le=86_400)
    ] = 0.0


class Bead(Section):
    """[bead]: what is laid where a program says where, but not how much."""

    width: Annotated[float, key("width_mm", "width of the bead", gt=0, le=200), IN_MM] = 5.0 * MM
    layer_height: Annotated[float, key("layer_height_mm", "height of a layer", gt=0, le=200), IN_MM] = (
        2.5 * MM
    )
    first_layer: Annotated[
        float,
        key("first_layer_percent", "clay on the first layer, of what is written or laid", gt=0, le=300),
        to_si(0.01),
    ] = 1.0


class Air(Section):
    """[air]: which words open and close the air besides E; each is ``ignore`` or ``air``."""

    lays: Annotated[
        Literal["pressure", "bead"],
        Field(description="what open air does: hold a pressure along the moves, or lay the bead of [bead]"),
    ] = "pressure"
    comments: Annotated[
        Literal["ignore", "type", "path"],
        Field(
            description="comments that lay a bead on G1 to G5 without E: ;TYPE: features, or ;Start path to ;End path"
        ),
    ] = "ignore"
    fan_words: Annotated[Literal["ignore", "air"], Field(description="M106 S0-255 / M107")]
    spindle_words: Annotated[Literal["ignore", "air"], Field(description="M3 S0-255 / M5")]
    valve_words: Annotated[Literal["ignore", "air"], Field(description="M126 / M127")]
    solenoid_words: Annotated[Literal["ignore", "air"], Field(description="M380 / M381")]
    pin_words: Annotated[Literal["ignore", "air"], Field(description="M42 P<pin> S0-255")]
    pin: Annotated[int, Field(description="pin number that is the air when pin_words is air", ge=0, le=1000)]


class Drives(Section):
    """[drives]: six servo axes and the pressure regulator."""

    period: Annotated[float, key("period_ms", "time between two setpoints", ge=0.25, le=50), IN_MS]
    encoder: Annotated[int, key("encoder_counts", "encoder counts in one motor turn", ge=16, le=2**26)]
    servo_bandwidth: Annotated[
        float, key("servo_bandwidth_hz", "bandwidth of the simulated position loop", gt=0, le=1e3)
    ]
    servo_damping: Annotated[
        float, Field(description="damping ratio of the simulated position loop", gt=0, le=5)
    ]
    following_error_max: Annotated[
        float,
        key("following_error_max_mm", "slider away from its setpoint that stops the run", gt=0, le=1e3),
        IN_MM,
    ]
    screw_efficiency: Annotated[
        float, key("screw_efficiency_percent", "efficiency of the ball screws", gt=0, le=100), to_si(0.01)
    ]
    torque_max: Annotated[float, key("torque_max_nm", "greatest motor torque", gt=0, le=1e3)]
    regulator_lag: Annotated[
        float, key("regulator_lag_ms", "time constant of the pressure regulator", ge=0, le=1e4), IN_MS
    ]


class CanOpen(Section):
    """[canopen]: six CiA 402 drives on nodes 1-6 and one CiA 401 coupler on node 7."""

    mode: Annotated[Literal["csp", "ip"], Field(description="cyclic position mode: 8 (csp) or 7 (ip)")]
    position_unit: Annotated[
        float, key("position_unit_mm", "slider travel in one position unit of the drives", gt=0, le=1), IN_MM
    ]
    drive_vendor: Annotated[int, Field(description="0x1018:1 of the drives", ge=0, lt=2**32)]
    drive_product: Annotated[int, Field(description="0x1018:2 of the drives", ge=0, lt=2**32)]
    drive_serials: Annotated[
        list[int], Field(description="0x1018:4 of nodes 1-6; empty takes any", max_length=6)
    ]
    io_vendor: Annotated[int, Field(description="0x1018:1 of the coupler", ge=0, lt=2**32)]
    io_product: Annotated[int, Field(description="0x1018:2 of the coupler", ge=0, lt=2**32)]
    sync_counter: Annotated[bool, Field(description="SYNC carries a counter where every node accepts 0x1019")]
    feedback_every: Annotated[int, Field(description="drives answer every n-th SYNC", ge=1, le=8)]
    heartbeat: Annotated[
        float,
        key("heartbeat_ms", "silence after which host and nodes give each other up", ge=20, le=5e3),
        IN_MS,
    ]
    setpoint_watchdog: Annotated[
        float,
        key("setpoint_watchdog_ms", "silence after which a drive stops by itself; 0 has none", ge=0, le=1e3),
        IN_MS,
    ]
    quick_stop: Annotated[
        float, key("quick_stop_mm_s2", "deceleration of a drive's own quick stop", gt=0, le=1e7), IN_MM
    ]
    rated_torque: Annotated[float, key("rated_torque_nm", "rated motor torque, 0x6076", gt=0, le=1e3)]
    brake_release: Annotated[
        float, key("brake_release_ms", "time a brake takes to open after enabling", ge=0, le=5e3), IN_MS
    ]
    reference: Annotated[
        Literal["drive", "stored", "homing"],
        Field(description="what knows the reference pose: the drive, a stored offset, or homing (mode 6)"),
    ]
    homing_method: Annotated[int, Field(description="0x6098 of homing", ge=-128, le=127)]
    homing_speed: Annotated[float, key("homing_speed_mm_s", "speed of homing, 0x6099", gt=0, le=1e3), IN_MM]
    homing_torque: Annotated[
        float, key("homing_torque_percent", "torque limit while homing", gt=0, le=300), to_si(0.01)
    ]
    link_loss_tested: Annotated[
        bool, Field(description="bench test passed: drives without 0x6007 stop when the host falls silent")
    ]
    pressure_full_scale: Annotated[
        float,
        key("pressure_full_scale_kpa", "pressure at raw 32767 of output 1 and input 1", gt=0, le=1e4),
        IN_KPA,
    ]
    pressure_deviation: Annotated[
        float,
        key("pressure_deviation_kpa", "pressure away from its command that stops", gt=0, le=1e4),
        IN_KPA,
    ]
    pressure_settling: Annotated[
        float, key("pressure_settling_ms", "time such a deviation may last", ge=0, le=6e4), IN_MS
    ]
    force_full_scale: Annotated[
        float, key("force_full_scale_n", "cable force at raw 32767 of inputs 2-4", gt=0, le=1e6)
    ]
    jitter_test: Annotated[
        float, key("jitter_test_ms", "length of the sender's timing test before arming", ge=0, le=6e4), IN_MS
    ]
    allow_soft_realtime: Annotated[
        bool, Field(description="arm although the timing test failed, with a warning")
    ]


class Link(Section):
    """[link]: the framed serial link to a motion bridge."""

    watchdog: Annotated[
        float, key("watchdog_ms", "silence after which the bridge stops by itself", ge=20, le=5e3), IN_MS
    ]
    ramp: Annotated[float, key("ramp_ms", "length of the bridge's time-scaled stop", ge=10, le=5e3), IN_MS]
    pressure_hold: Annotated[
        float, key("pressure_hold_ms", "longest time air outlives its setpoint", ge=1, le=5e3), IN_MS
    ]


class Profile(Section):
    """One machine, frozen, in SI."""

    machine: Machine
    geometry: Geometry
    spring: Spring
    platforms: Platforms
    forces: Forces
    stretch: Stretch = Stretch()
    calibration: Calibration = Calibration()
    sliders: Sliders
    limits: Limits
    path: PathRules
    bed: Bed
    extruder: Extruder
    bead: Bead = Bead()
    clay: Clay = Clay()
    job: Job = Job()
    air: Air
    drives: Drives
    canopen: CanOpen
    link: Link
    watch: Watch = Watch()
    serve: Serve
