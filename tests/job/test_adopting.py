"""A printer takes a machine as it stands: what its drives say is where it is."""

from concurrent.futures import Future

import numpy as np
import pytest
from stepped import Stepped

from cdhr_host.drives import Loopback
from cdhr_host.errors import MotionError
from cdhr_host.job.printer import Printer
from cdhr_host.job.surface import Reply
from cdhr_host.mechanism import lengths, slider, tensions
from cdhr_host.pipeline import open_profile
from cdhr_host.pipeline.rig import Rig
from cdhr_host.profile import Profile
from cdhr_host.units import MM

PROFILE = open_profile("paper")
NOZZLE = np.array([60.0, -25.0, 40.0]) * MM


def standing(profile: Profile, nozzle: np.ndarray) -> np.ndarray:
    """(6,) m, by the inverse kinematics of the machine at rest."""
    rig = Rig.from_profile(profile)
    q = (nozzle - rig.cables.reference_G)[None]
    still = np.zeros((1, 3))
    motion = rig.policy.follow(q, still, still)
    length = lengths(rig.cables, q, motion.place)
    if rig.give is None:
        return slider(rig.cables, length)[0]
    return rig.sliders(length, tensions(rig.cables, rig.loads, q, motion.place, still, still))[0]


def printer_at(profile: Profile, slider: np.ndarray) -> tuple[Printer, Stepped]:
    clock = Stepped()
    link = Loopback(profile, clock, standing=slider)
    link.open()
    return Printer(link, clock), clock


def settled(printer: Printer, clock: Stepped, answer: "Future[Reply]") -> Reply:
    for _ in range(2000):
        printer.turn()
        if answer.done():
            return answer.result()
        clock.wait_until(clock.now() + 0.02)
    raise AssertionError(printer.status())


@pytest.mark.parametrize("stretch", ["off", "on"])
def test_it_stands_where_its_drives_say(stretch: str) -> None:
    soft = PROFILE.stretch.model_copy(update={"compensation": stretch})
    profile = PROFILE.model_copy(update={"stretch": soft})
    printer, clock = printer_at(profile, standing(profile, NOZZLE))
    status = printer.status()
    np.testing.assert_allclose(status.nozzle_G, NOZZLE, atol=2e-9)
    assert not status.homed
    reply = settled(printer, clock, printer.run("G28"))
    assert reply.ok, reply.lines
    status = printer.status()
    assert status.homed
    np.testing.assert_allclose(status.nozzle_G, 0.0, atol=1e-9)


def test_a_step_begins_where_it_stands() -> None:
    printer, clock = printer_at(PROFILE, standing(PROFILE, NOZZLE))
    settled(printer, clock, printer.step(np.array([0.0, 0.0, 5.0]) * MM))
    np.testing.assert_allclose(printer.status().nozzle_G, NOZZLE + np.array([0, 0, 5 * MM]), atol=1e-8)


def test_places_that_are_no_pose_are_refused() -> None:
    with pytest.raises(MotionError):
        printer_at(PROFILE, np.full(6, -0.5))
