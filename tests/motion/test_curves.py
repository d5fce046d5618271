"""Arcs and Béziers: the smoothed chords are the true curve."""

import math

import numpy as np
import pytest
from motion_tracks import PERIOD, differences, distance_to, norm

from cdhr_host.motion.arc import arc_length, chords
from cdhr_host.motion.curves import bezier, points_on, spline_length
from cdhr_host.motion.limits import CHORD_ERROR
from cdhr_host.motion.smooth_path import smooth
from cdhr_host.values import Arc, Plane, Spline

H = 0.747e-3
CURVES = {
    "S": [[0, 0], [30, 0], [0, 30], [30, 30]],
    "bow": [[0, 0], [10, 20], [30, 20], [40, 0]],
    "loop": [[0, 0], [60, 30], [-30, 30], [30, 0]],
    "sharp": [[0, 0], [30, 29], [0, 29], [30, 0]],
    "cusp": [[0, 0], [30, 30], [0, 30], [30, 0]],
    "line": [[0, 0], [10, 0], [20, 0], [30, 0]],
    "line that turns back": [[0, 0], [40, 0], [-10, 0], [30, 0]],
    "small arch": [[0, 0], [2, 8], [6, 8], [8, 0]],
    "from rest": [[0, 0], [0, 0], [30, 20], [30, 20]],
    "small": [[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]],
}


def arc_of(radius, degrees, *, rise=0.0, plane=Plane.XY, speed=0.03, clay=0.0):
    first, second, along = plane.value
    start, end = np.zeros(3), np.zeros(3)
    sweep = math.radians(degrees)
    start[first] = radius
    end[first], end[second], end[along] = radius * math.cos(sweep), radius * math.sin(sweep), rise
    return Arc(7, start, end, np.zeros(2), sweep, speed, clay, 0.0, plane)


def spline_of(points_mm, speed=0.03, clay=0.0):
    control = np.zeros((4, 3))
    control[:, :2] = np.array(points_mm) * 1e-3
    return Spline(3, control, speed, clay, 0.0)


@pytest.mark.parametrize("radius", [4e-3, 7e-3, 17.3e-3, 0.05, 0.31, 4.0])
@pytest.mark.parametrize("degrees", [33.3, -90, 360])
@pytest.mark.parametrize("half_width", [2.7e-5, H, 1.5e-3])
def test_a_smoothed_arc_has_the_arcs_own_curvature(radius, degrees, half_width):
    """Ripple of q'' below 1 %; the radius is the arc's less h²/(12 R), to the chords' micrometre."""
    degrees *= min(1.0, 0.1 / radius) * max(1.0, 0.006 / radius)
    points = chords(arc_of(radius, degrees), half_width)
    path = smooth(points, half_width)
    length = radius * abs(math.radians(degrees))
    places = np.linspace(half_width, length - half_width * (1 + 1e-6), 4001)
    assert places[-1] > places[0]
    _, position, _, bend = path.at(places)
    shrunk = radius * (math.sin(half_width / 2 / radius) / (half_width / 2 / radius)) ** 2
    known = radius - half_width**2 / (12 * radius)
    assert shrunk == pytest.approx(known, abs=half_width**4 / radius**3 / 300 + 1e-14)
    assert np.abs(norm(position) - shrunk).max() < CHORD_ERROR
    curvature = norm(bend)
    assert np.abs(curvature / curvature.mean() - 1).max() < 0.01
    assert curvature.mean() == pytest.approx(shrunk / radius**2, rel=0.01)


def test_two_chords_in_the_kernel_would_ripple_where_they_do_not_fit():
    """What the whole number of chords in the kernel is for: 2.5 of them ripple by 3 %."""
    angle = np.arange(0, 200) * (H / 2.5 / 0.05)
    path = smooth(0.05 * np.column_stack((np.cos(angle), np.sin(angle), 0 * angle)), H)
    curvature = norm(path.at(np.linspace(3 * H, path.end - 3 * H, 4001))[3])
    assert np.abs(curvature / curvature.mean() - 1).max() > 0.025


@pytest.mark.parametrize("radius", [1e-6, 1e-4, 0.02, 1.0])
def test_chords_of_an_arc_stay_within_a_micrometre(radius):
    arc = arc_of(radius, 200, rise=radius / 3)
    points = chords(arc, H)
    middles = (points[1:] + points[:-1]) / 2
    assert (radius - np.hypot(middles[:, 0], middles[:, 1])).max() <= CHORD_ERROR
    assert norm(np.diff(points, axis=0)).max() <= H / 2
    assert len(points) > 16
    assert np.array_equal(points[[0, -1]], [arc.start_G, arc.end_G])
    assert norm(np.diff(points, axis=0)).sum() == pytest.approx(arc_length(arc), rel=5e-3)


@pytest.mark.parametrize("plane", Plane)
def test_helices_of_all_planes_are_one_helix_turned(plane, run):
    flat, turned = arc_of(0.02, 300, rise=0.01), arc_of(0.02, 300, rise=0.01, plane=plane)
    assert arc_length(flat) == arc_length(turned)
    expected, found = run([flat], start=flat.start_G), run([turned], start=turned.start_G)
    assert np.allclose(found.position_G[:, list(plane.value)], expected.position_G, atol=1e-12)


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("half_width", [2.7e-5, H, 0.03])
def test_points_are_on_the_curve_even_and_within_a_micrometre(name, half_width):
    spline = spline_of(CURVES[name])
    points = points_on(spline, half_width)
    dense = bezier(spline.control_G, np.linspace(0, 1, 6001))
    step = len(points) // 3000 + 1
    assert distance_to(dense[:: 1 if step == 1 else 7], points).max() < CHORD_ERROR
    steps = norm(np.diff(points, axis=0))
    assert steps.max() <= 0.505 * half_width
    assert len(points) > 16
    assert np.array_equal(points[[0, -1]], spline.control_G[[0, 3]])
    assert steps.sum() == pytest.approx(spline_length(spline), rel=2e-3)


@pytest.mark.parametrize("name", ["S", "bow", "loop", "small arch"])
def test_a_smoothed_bezier_has_the_curves_own_curvature(name):
    """Against the same smoothing of chords twenty times as fine."""
    spline = spline_of(CURVES[name])
    control = spline.control_G
    fine = smooth(bezier(control, np.linspace(0, 1, 20001)), H)
    path = smooth(points_on(spline, H), H)
    share = np.linspace(0.05, 0.95, 2001)
    (_, here, _, bend), (_, there, _, wanted) = (q.at(share * q.end) for q in (path, fine))
    assert np.abs(here - there).max() < 3e-6
    assert np.abs(bend - wanted).max() < 0.015 * norm(wanted).max()


@pytest.mark.parametrize("name", CURVES)
def test_a_bezier_is_planned_within_limits_from_end_to_end(name, run, limits):
    spline = spline_of(CURVES[name], speed=0.04)
    track = run([spline])
    _, acceleration, jerk = differences(track)
    assert acceleration <= limits.acceleration * 1.001
    assert jerk <= limits.jerk * 1.001
    assert np.allclose(track.position_G[-1], spline.control_G[3], atol=1e-11)
    dense = bezier(spline.control_G, np.linspace(0, 1, 3001))
    assert distance_to(track.position_G, dense).max() <= limits.half_width / 3 + CHORD_ERROR
    assert set(track.line) <= {0, 3}


@pytest.mark.parametrize("command", [arc_of(0.02, 250, clay=2e-6), spline_of(CURVES["loop"], clay=2e-6)])
def test_clay_is_even_along_a_curve(command, run):
    track = run([command], start=command.start_G if isinstance(command, Arc) else None)
    speed = norm(track.velocity)
    length = arc_length(command) if isinstance(command, Arc) else spline_length(command)
    moving = speed > 1e-4
    assert track.flow[moving] / speed[moving] == pytest.approx(2e-6 / length, rel=1e-3)
    assert track.flow.sum() * PERIOD == pytest.approx(2e-6, rel=0.01)


def test_a_wide_arc_runs_at_its_speed_between_its_ends(run):
    arc = arc_of(0.05, 270, speed=0.04)
    track = run([arc], start=arc.start_G)
    inside = (norm(track.position_G - arc.start_G) > 8e-3) & (norm(track.position_G - arc.end_G) > 8e-3)
    assert norm(track.velocity)[inside].min() > 0.04 * 0.999


def test_curves_of_no_length_vanish(run):
    still = Spline(1, np.zeros((4, 3)), 0.02, 0.0, 0.0)
    assert spline_length(still) == 0.0
    assert run([still]).tick.tolist() == [0]
