"""What makes simulated nodes those of a machine: identity, units, rated torque."""

from cdhr_host.drives.sim.dictionary import Dictionary
from cdhr_host.profile.schema import Profile

COUPLER = 7


def identify(dictionary: Dictionary, node: int, profile: Profile) -> Dictionary:
    """The dictionary, with what survives a reset."""
    settings = profile.canopen
    if node == COUPLER:
        identity: tuple[int, ...] = (settings.io_vendor, settings.io_product)
    else:
        serials = settings.drive_serials or [0] * 6
        identity = (settings.drive_vendor, settings.drive_product, 0x10000, serials[node - 1])
        dictionary.fixed((0x6092, 1), round(profile.sliders.screw_lead / settings.position_unit))
        dictionary.fixed((0x6076, 0), round(settings.rated_torque * 1e3))
    for sub, value in enumerate(identity, start=1):
        dictionary.fixed((0x1018, sub), value)
    return dictionary
