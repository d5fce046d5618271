"""The cubes a program goes through, and what is told of a part."""

import numpy as np
import pytest

from cdhr_host.mechanism import Workspace
from cdhr_host.mechanism.margin_map import margin_map
from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.space.footprint import Footprint
from cdhr_host.report.space.pictures import draw_map
from cdhr_host.report.space.sited import sited, sited_lines, sited_record
from cdhr_host.report.space.volume import volume_lines, volume_record
from cdhr_host.units import MM

PART = b"M83\nG1 X150 F3000\nG1 Z2\nG1 X90 E300\nG1 Y40 E200\nG1 X150 E300\nG1 Z40\nG1 X0 Y0\n"


@pytest.fixture(scope="module")
def paper():
    return open_profile("paper")


def walked(text, profile):
    footprint = Footprint()
    prove([text], profile, watch=footprint.watch)
    return (*footprint.places(), footprint.edge)


def test_only_what_lies_between_the_first_and_last_clay_counts(paper):
    places, lines, edge = walked(PART, paper)
    assert set(lines) <= {3, 4, 5, 6, 7}
    assert places[:, 0].min() / MM == pytest.approx(90, abs=2)
    assert places[:, 0].max() / MM == pytest.approx(150, abs=1)
    assert places[:, 2].max() / MM < 10
    cubes = np.floor(places / edge)
    assert len(np.unique(cubes, axis=0)) == len(cubes)


def test_travel_alone_has_no_places(paper):
    assert len(walked(b"G1 X50 F3000\nG1 X0\n", paper)[0]) == 0


def test_a_part_off_the_axis_is_told_where_it_would_be_better(paper):
    space = Workspace.from_profile(paper)
    found = sited(space, margin_map(space), walked(PART, paper), 0.0)
    assert found.outside == 0.0
    assert found.plane.margin > found.margin.min() + 0.05
    assert found.space.margin >= found.plane.margin
    assert found.plane.shift[0] / MM == pytest.approx(-120, abs=25)
    words = "\n".join(sited_lines(found, space, "part.gcode"))
    assert "[bed] origin_x_mm = " in words
    assert "or move it so in the slicer" in words
    record = sited_record(found, space, "part.gcode")
    origin, shift = (record["best"][key] for key in ("bed_origin_mm", "shift_mm"))
    assert origin == pytest.approx(np.add(shift, [0.0, 0.0, 438.5]))


def test_the_best_place_holds_when_it_is_taken(paper):
    """A profile with the bed where it was told to go proves the margin that was told."""
    space = Workspace.from_profile(paper)
    found = sited(space, margin_map(space), walked(PART, paper), 0.0)
    x, y, z = found.space.shift
    bed = paper.bed.model_copy(update={"origin_x": x, "origin_y": y, "origin_z": paper.bed.origin_z + z})
    moved = Workspace.from_profile(paper.model_copy(update={"bed": bed}))
    q = found.places_G - moved.cables.reference_G
    assert moved.margin(q).min() == pytest.approx(found.space.margin, abs=1e-9)


def test_a_machine_that_can_hold_nothing_is_told_and_drawn(paper, tmp_path):
    sliders = paper.sliders.model_copy(update={"travel_min": 0.5, "travel_max": 0.6})
    space = Workspace.from_profile(paper.model_copy(update={"sliders": sliders}))
    chart = margin_map(space)
    assert "no place keeps all its limits" in volume_lines(chart, space)[0]
    assert volume_record(chart, space)["heights_mm"] is None
    draw_map(chart, space, None, "nothing", tmp_path / "nothing.png")
    assert (tmp_path / "nothing.png").stat().st_size > 10_000
