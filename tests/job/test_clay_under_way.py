"""A print of led clay on the simulated machine, held, resumed and overridden: the bead stays as drawn."""

import numpy as np
import pytest
from test_printer import Desk

from cdhr_host.drives.rows import joined
from cdhr_host.extrusion.bead import beads
from cdhr_host.job.surface import JobState
from cdhr_host.pipeline import open_profile
from cdhr_host.units import MM

AREA = 11.16
CORNERS = [(40, 10), (40, 45), (5, 45), (5, 10)]
TEXT = (
    "M83\nG0 Z2.5 X5 Y10 F3000\n"
    + "".join(f"G1 X{x} Y{y} E{35 * AREA} F900\n" for x, y in CORNERS)
    + "G0 X60 F3000\n"
    + f"G1 X80 E{20 * AREA} F900\nG0 Z12\n"
)


class ClayDesk(Desk):
    """With what was laid."""

    def __init__(self, folder, profile):
        super().__init__(folder, profile)
        self.laid = []
        self.printer.observe(lambda _, feedback: self.laid.append(feedback))

    def beads(self):
        rows, laid = self.done(), joined(self.laid)
        assert (rows.tick == laid.tick).all()
        return beads(rows.line, rows.nozzle_G, rows.flow, laid.deposited, self.link.profile.drives.period)


def hold(desk):
    desk.printer.hold()
    desk.go(JobState.HELD, most=20.0)
    desk.go(most=1.0)
    desk.printer.resume()
    desk.go(JobState.PRINTING, most=20.0)


ACTS = {
    "nothing": [],
    "hold": [hold],
    "slower": [lambda desk: desk.printer.override(feed=0.4)],
    "faster": [lambda desk: desk.printer.override(feed=1.8)],
    "all": [
        lambda desk: desk.printer.override(feed=0.6),
        hold,
        lambda desk: desk.printer.override(feed=1.5),
        hold,
        lambda desk: desk.printer.override(feed=1.0),
    ],
}


@pytest.mark.parametrize("acts", ACTS)
@pytest.mark.parametrize("clay", ["earthenware", "stoneware"])
def test_beads_stay_even_and_where_they_were_drawn(tmp_path, clay, acts):
    desk = ClayDesk(tmp_path, open_profile("paper-wide", clay))
    desk.print(TEXT, most=4.0)
    for act in ACTS[acts]:
        act(desk)
        desk.go(most=1.5)
    desk.go(JobState.DONE)
    found = desk.beads()
    assert [bead.line for bead in found] == [3, 8]
    for bead in found:
        assert 0.95 <= bead.least <= bead.most <= 1.05
        assert abs(bead.start_late) < 1.0 * MM
        assert abs(bead.end_late) < 1.0 * MM
        assert bead.laid == pytest.approx(bead.planned, rel=0.01)
    rows, laid = desk.done(), joined(desk.laid)
    stands = np.linalg.norm(np.diff(rows.nozzle_G, axis=0, prepend=rows.nozzle_G[:1]), axis=1) < 1e-10
    assert laid.deposited[stands].sum() * 0.004 < 0.1 * AREA * 1e-9
    assert rows.pressure[-1] == 0.0
