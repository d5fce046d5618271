"""The map against the formulas themselves, its volume against random places, the best place of a part."""

import numpy as np
import pytest

from cdhr_host.mechanism import Workspace
from cdhr_host.mechanism.margin_map import WORST, MarginMap, limited_margin, margin_map
from cdhr_host.mechanism.siting import best_site, sparse
from cdhr_host.profile import find, read_table, validate
from cdhr_host.units import DEG


@pytest.fixture(scope="module")
def space() -> Workspace:
    profile, problems = validate(read_table(find("paper")))
    assert not problems
    return Workspace.from_profile(profile)


@pytest.fixture(scope="module")
def chart(space: Workspace) -> MarginMap:
    return margin_map(space)


def around(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform([-0.3, -0.3, -0.3], [0.3, 0.3, 0.6], size=(count, 3))


def test_the_sector_speaks_for_the_whole_circle(space: Workspace, chart: MarginMap) -> None:
    places = around(2000, 1)
    r, turn = np.hypot(places[:, 0], places[:, 1]), chart.folded(np.arctan2(places[:, 1], places[:, 0]))
    mirrored = np.column_stack([r * np.cos(turn), r * np.sin(turn), places[:, 2]])
    assert (turn <= 60.0 * DEG + 1e-12).all()
    assert limited_margin(space, mirrored) == pytest.approx(limited_margin(space, places), abs=1e-9)


def test_between_nodes_the_map_is_near_the_formulas(space: Workspace, chart: MarginMap) -> None:
    places = around(3000, 2)
    exact, read = limited_margin(space, places), chart.at(places)
    inside = exact > 0.05
    assert inside.sum() > 300
    off = np.abs(read[inside] - exact[inside])
    assert np.quantile(off, 0.97) < 0.02
    assert off.max() < 0.08


def test_nodes_are_the_formulas(space: Workspace, chart: MarginMap) -> None:
    r, turn, z = chart.radius[[0, 10, 20]], chart.azimuth[[0, 10, 24]], chart.height[[10, 20, 30]]
    places = np.column_stack([r * np.cos(turn), r * np.sin(turn), z])
    assert chart.margin[[0, 10, 20], [0, 10, 24], [10, 20, 30]] == pytest.approx(
        limited_margin(space, places)
    )


def test_volume_is_that_of_random_places(space: Workspace, chart: MarginMap) -> None:
    box = np.array([0.6, 0.6, 0.9])
    share = (limited_margin(space, around(200_000, 3)) >= 0.0).mean()
    assert chart.volume() == pytest.approx(share * box.prod(), rel=0.015)
    assert chart.doubt < 0.02 * chart.volume()


def test_an_acceleration_to_spare_costs_volume(space: Workspace, chart: MarginMap) -> None:
    assert 0.0 < margin_map(space, 0.5).volume() < chart.volume()


def test_sliders_and_angles_bound_it_too(space: Workspace) -> None:
    sliders = space.profile.sliders.model_copy(update={"travel_min": -0.05, "travel_max": 0.05})
    narrow = Workspace.from_profile(space.profile.model_copy(update={"sliders": sliders}))
    places = np.array([[0.0, 0.0, 0.0], [0.15, 0.0, 0.0]])
    assert limited_margin(space, places).min() > 0.0
    assert limited_margin(narrow, places)[0] > 0.0
    assert limited_margin(narrow, places)[1] == WORST


def test_a_part_off_the_axis_goes_back_to_it(space: Workspace, chart: MarginMap) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    ring = np.column_stack([0.06 * np.cos(turn) + 0.08, 0.06 * np.sin(turn) - 0.05, np.zeros(200)])
    bounds = np.array([-0.2, -0.2, 0.0]), np.array([0.2, 0.2, 0.0])
    site = best_site(space, chart, ring, bounds)
    centred = limited_margin(space, ring - [0.08, -0.05, 0.0]).min()
    assert site.margin >= centred - 1e-3
    assert site.shift[2] == 0.0
    assert np.hypot(site.shift[0] + 0.08, site.shift[1] - 0.05) < 0.02
    assert site.margin == pytest.approx(limited_margin(space, ring + site.shift).min())


def test_no_place_of_a_fine_grid_is_better(space: Workspace, chart: MarginMap) -> None:
    corner = np.array([[x, y, z] for x in (-0.05, 0.09) for y in (-0.02, 0.06) for z in (0.0, 0.08)])
    bounds = np.array([-0.1, -0.1, -0.2]), np.array([0.1, 0.1, 0.2])
    site = best_site(space, chart, corner, bounds)
    axes = [np.linspace(low, high, 21) for low, high in zip(*bounds, strict=True)]
    shifts = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 1, 3)
    every = limited_margin(space, (corner + shifts).reshape(-1, 3)).reshape(len(shifts), -1).min(axis=1)
    assert site.margin >= every.max() - 1e-3
    assert (site.shift >= bounds[0]).all()
    assert (site.shift <= bounds[1]).all()


def test_thinning_keeps_the_rim() -> None:
    places = np.random.default_rng(4).normal(size=(5000, 3))
    some = sparse(places, 300)
    assert len(some) <= 300
    assert (some.min(axis=0) == places.min(axis=0)).all()
    assert (some.max(axis=0) == places.max(axis=0)).all()


def test_a_machine_unlike_its_drawing_is_mapped_all_around(space: Workspace) -> None:
    shifted = [[20.0, 0.0, 0.0], *[[0.0, 0.0, 0.0]] * 5]
    found = space.profile.calibration.model_copy(update={"pulley_shift_mm": shifted})
    askew = Workspace.from_profile(space.profile.model_copy(update={"calibration": found}))
    assert not askew.symmetric
    whole = margin_map(askew)
    assert whole.azimuth[-1] == pytest.approx(2.0 * np.pi)
    places = around(2000, 4)
    exact, read = limited_margin(askew, places), whole.at(places)
    inside = exact > 0.05
    assert np.quantile(np.abs(read[inside] - exact[inside]), 0.97) < 0.04
