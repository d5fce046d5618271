"""The machine made ready for the formulas: six equivalent cables, and what they carry."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdhr_host.mechanism.pulley import PULLEYS, Pulley
from cdhr_host.profile import Profile
from cdhr_host.values import Array

GRAVITY: Final = 9.81
"""m/s²; the paper gives none"""
AZIMUTHS: Final = (0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0)
"""rad: beta of cables 1-3, and again of 4-6"""
LOWER: Final = (0, 1, 2)
UPPER: Final = (3, 4, 5)


@dataclass(frozen=True, slots=True)
class Cables:
    """Six equivalent cables: rows 0-2 hold the lower (nozzle) platform, 3-5 the upper."""

    anchors: Array
    """(6, 3) m: pulley centres A in W"""
    attachments: Array
    """(6, 3) m: attachment points B in W at the reference pose"""
    signs: Array
    """(6,): +1 where the pulley is above its platform, -1 below"""
    pulley_radius: float
    reference_lengths: Array
    """(6,) m: cable lengths at the reference pose"""
    reference_G: Array
    """(3,) m: the reference pose in program coordinates; q = position_G - reference_G"""
    azimuths: Array
    """(6,) rad: in which each cable leaves its pulley for the slider"""
    pulley: Pulley

    @classmethod
    def from_profile(cls, profile: Profile) -> "Cables":
        """Table A1 as the profile gives it; the profile must be free of inconsistencies."""
        shape, bed, found = profile.geometry, profile.bed, profile.calibration
        pulley = PULLEYS[shape.pulley_model]
        top = shape.reference_height + shape.reference_separation
        anchors = [
            *_ring(shape.pulley_circle_radius, shape.lower_pulley_height),
            *_ring(shape.pulley_circle_radius, shape.upper_pulley_height),
        ]
        attachments = [
            *_ring(shape.lower_attachment_radius, shape.reference_height),
            *_ring(shape.upper_attachment_radius, top),
        ]
        return cls(
            anchors=_fixed(np.array(anchors) + found.pulleys()),
            attachments=_fixed(np.array(attachments) + found.attachments()),
            signs=_fixed([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0]),
            pulley_radius=shape.pulley_radius,
            reference_lengths=_fixed([0.0] * 6),
            reference_G=_fixed(
                np.array([-bed.origin_x, -bed.origin_y, shape.reference_height - bed.origin_z])
                + found.reference()
            ),
            azimuths=_fixed(AZIMUTHS + AZIMUTHS),
            pulley=pulley,
        ).with_pulley(pulley)

    def with_pulley(self, pulley: Pulley) -> "Cables":
        """The same machine seen through another pulley model."""
        x, y, z = (self.anchors - self.attachments).T
        wrap = pulley(x, y, z, self.signs, self.pulley_radius, self.azimuths)
        return replace(self, pulley=pulley, reference_lengths=_fixed(wrap.length()))


@dataclass(frozen=True, slots=True)
class Loads:
    """What the cables carry: two platforms and the spring between them."""

    lower_mass: float
    upper_mass: float
    stiffness: float
    """N/m"""
    rest_length: float
    separation: float
    """m: the upper attachment point above the lower one at the reference pose"""
    aside: tuple[float, float] = (0.0, 0.0)
    """m: and beside it in x and y, where calibration found that"""

    @classmethod
    def from_profile(cls, profile: Profile) -> "Loads":
        """[platforms], [spring] and the reference separation."""
        x, y, z = profile.calibration.reference().tolist()
        return cls(
            lower_mass=profile.platforms.lower_mass,
            upper_mass=profile.platforms.upper_mass,
            stiffness=profile.spring.stiffness,
            rest_length=profile.spring.rest_length,
            separation=profile.geometry.reference_separation - z,
            aside=(-x, -y),
        )


def _ring(radius: float, height: float) -> list[list[float]]:
    return [[radius * np.cos(beta), radius * np.sin(beta), height] for beta in AZIMUTHS]


def _fixed(values: object) -> Array:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array
