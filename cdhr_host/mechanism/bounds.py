"""Bounds that hold over the whole bed."""

import math

from cdhr_host.profile import Profile


def direction_change_bound(profile: Profile) -> float:
    """1/m: most a cable's direction turns for each metre of nozzle travel, anywhere on the bed.

    The second derivative of the length has the terms (n·v)²/L + cos(theta)/rho (h·v)², so
    1/L + 1/rho bounds it, with rho at least the pulley circle less the platform and the bed,
    and L² = rho² + w² - r² at least rho² - r².
    """
    shape, bed = profile.geometry, profile.bed
    platform = max(shape.lower_attachment_radius, shape.upper_attachment_radius)
    rho = shape.pulley_circle_radius - platform - bed.radius - math.hypot(bed.origin_x, bed.origin_y)
    return 1.0 / rho + 1.0 / math.sqrt(rho**2 - shape.pulley_radius**2)
