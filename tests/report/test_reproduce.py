"""The paper by one command: acceptance rows 13, 14, 15, 18, and what the page says."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cdhr_host.mechanism import Cables, jacobian, tensions, trajectories
from cdhr_host.mechanism.cables import Loads
from cdhr_host.mechanism.pairs import Pairs, shares
from cdhr_host.mechanism.pulley import PULLEYS
from cdhr_host.plant.bodies import Build
from cdhr_host.report.paper import FIGURES, ITEMS, TABLES, Cell, Item, Study, experiment, item_name, reproduce
from cdhr_host.report.paper.driven import Drive, driven
from cdhr_host.report.paper.page import number, page, totals
from cdhr_host.report.paper.spools import worst_with_spools
from cdhr_host.report.reproduce import PAGE, names_of, study, write

QUICK = study(seeds=2, thorough=False)
SIMULATION = QUICK.profiles["paper-simulation"]


def disagreeing(item: Item) -> list[str]:
    return [f"{cell.reading}: {cell.name} {cell.ours}" for cell in item.cells if cell.holds is False]


def test_forces_held_a_millisecond() -> None:
    """Row 13."""
    run = driven(SIMULATION, Drive(PULLEYS["swivel"], held=1e-3))
    assert_allclose(run.worst, [0.0044, 0.0046, 0.0008], rtol=0.1)


def test_forces_without_compensation() -> None:
    """Row 13."""
    run = driven(SIMULATION, Drive(PULLEYS["point"]))
    assert_allclose(run.worst, [1.554, 1.239, 13.12], rtol=0.01)


def test_pairs_that_pull_alike() -> None:
    """Row 14."""
    run = driven(SIMULATION, Drive(PULLEYS["swivel"], build=Build(), alike=True))
    assert_allclose(run.worst, [1.736, 1.561, 0.561], rtol=0.01)
    assert_allclose(run.most_turned, [0.271, 0.268, 0.020], rtol=0.015)


def test_shared_forces_do_not_turn_the_platform() -> None:
    """Row 15."""
    run = driven(SIMULATION, Drive(PULLEYS["swivel"], build=Build()))
    assert run.most_turned.max() < 1e-6
    q = trajectories.eq15(np.arange(0.0, 200.0, 0.5))
    cables, pairs = Cables.from_profile(SIMULATION), Pairs.from_profile(SIMULATION)
    force = tensions(cables, Loads.from_profile(SIMULATION), q, q)[:, :3]
    shared, pulls = shares(cables, pairs, q, force), -jacobian(cables, q, q)[:, :3]
    moment = (shared.left[:, :, None] * np.cross(pairs.left, pulls)).sum(axis=1)
    moment += (shared.right[:, :, None] * np.cross(pairs.right, pulls)).sum(axis=1)
    assert np.abs(moment).max() < 1e-12


def test_the_loop_is_better_than_compensation_alone() -> None:
    """Row 18, second half: the loop leaves less than half of what compensation leaves."""
    profile = QUICK.profiles["paper"]
    path = experiment.track(profile, experiment.LAWS["36"], 60.0)
    machine = experiment.Faults.drawn(1, experiment.PAPER)
    reached = experiment.open_loop(profile, path, machine, compensated=True, pulley="swivel")
    looped = experiment.closed_loop(profile, path, machine, experiment.PAPER.camera)
    alone, better = (experiment.seen(path, one) for one in (reached, looped))
    assert better.distance() < 0.5 * alone.distance()
    assert better.greatest()[0] < alone.greatest()[0]
    assert better.greatest()[1] < alone.greatest()[1]


def taken_away(equation: str) -> tuple[float, list[float]]:
    """mm: greatest distance without compensation and faults; with both, of two machines."""
    profile = QUICK.profiles["paper"]
    path = experiment.track(profile, experiment.LAWS[equation])
    bare = experiment.open_loop(profile, path, experiment.FAULTLESS, compensated=False, pulley="swivel")
    machines = [experiment.Faults.drawn(seed, experiment.PAPER) for seed in (1, 2)]
    reached = [
        experiment.open_loop(profile, path, machine, compensated=True, pulley="swivel")
        for machine in machines
    ]
    return experiment.seen(path, bare).distance(), [experiment.seen(path, one).distance() for one in reached]


def test_compensation_takes_three_quarters_of_the_error_away_along_15() -> None:
    """Row 18, first half, where it holds: each machine."""
    bare, left = taken_away("15")
    assert bare == pytest.approx(2.600, abs=2e-3)
    assert max(left) < 0.25 * bare


def test_along_36_less_is_there_to_take_away() -> None:
    """Row 18 cannot hold there: three quarters of 1.27 mm would leave less than the faults alone make."""
    bare, left = taken_away("36")
    assert bare == pytest.approx(1.274, abs=2e-3)
    assert 0.25 * bare < np.mean(left) < 0.4 * bare


@cache
def quick(name: str) -> Item:
    """Worked out once, whoever looks at it."""
    return ITEMS[name](QUICK)


ALL_QUICK = [name for name in ITEMS if not name.startswith("table")]


@pytest.mark.parametrize("name", ALL_QUICK)
def test_quick_items_find_what_the_study_found(name: str) -> None:
    item = quick(name)
    assert disagreeing(item) == []
    assert sum(cell.holds is True for cell in item.cells) >= 2
    assert len(item.why) > 20


def test_one_lead_for_all_screws_only_scales_the_displacement() -> None:
    """0.1 % of 98 mm and a little for curvature: why the study's 0.19 mm are screws that differ."""
    common, own = (
        {cell.name: cell.ours for cell in quick("sensitivity").cells if cell.reading.startswith(name)}
        for name in ("lead of all screws", "lead of each screw")
    )
    assert 0.095 < common["plane"] < 0.110
    assert own["plane"] > 1.5 * common["plane"]


@pytest.mark.parametrize("name", ["table-1", "table-2"])
def test_tables_are_whole_even_when_short(name: str) -> None:
    item = ITEMS[name](study(seeds=1, thorough=False))
    assert disagreeing(item) == []
    assert {panel.title.split()[2].strip(",") for panel in item.panels} == {"plane", "height"}
    printed = [cell for cell in item.cells if cell.ratio is not None]
    assert len(printed) >= 10
    assert all(np.isfinite(cell.ours) for cell in item.cells)


def test_scatter_between_machines_is_what_the_tolerances_take_it_for() -> None:
    """Of 30 machines over the whole run; here of seven others over its first part, by a factor of two."""
    profile = QUICK.profiles["paper"]
    path = experiment.track(profile, experiment.LAWS["36"], 30.0)
    greatest = []
    for seed in range(101, 108):
        machine = experiment.Faults.drawn(seed, experiment.PAPER)
        reached = experiment.open_loop(profile, path, machine, compensated=True, pulley="swivel")
        greatest.append(experiment.seen(path, reached, experiment.PAPER.camera, seed).greatest())
    told = [float(word) for word in experiment.SCATTER["Table 2, greatest"].split()]
    ratio = np.std(greatest, axis=0, ddof=1) / told
    assert (ratio > 0.4).all()
    assert (ratio < 2.0).all()


def test_spools_slow_the_swing() -> None:
    """Eq. (16) fed forward: between 1.25 and 1.54 mm in x for spools of 0.01 to 10 kg."""
    light, heavy = (worst_with_spools(SIMULATION, spool, 60.0) for spool in (0.0, 1.0))
    assert heavy[0] < light[0]
    run = driven(SIMULATION, Drive(PULLEYS["point"], seconds=60.0))
    assert_allclose(light, run.worst, rtol=2e-3)


def test_figures_and_tables_are_all_there() -> None:
    names = {item_name("figure", n) for n in FIGURES} | {item_name("table", n) for n in TABLES}
    assert names | {"sensitivity"} == set(ITEMS)
    assert names_of(15, 1) == ["table-1"]
    assert names_of(None, None) == list(ITEMS)
    with pytest.raises(KeyError, match="figure-9"):
        names_of(9, None)


def test_page_has_every_number_and_picture(tmp_path: Path) -> None:
    told: list[str] = []
    found = write(["figure-6", "figure-8"], QUICK, tmp_path, lambda name, item: told.append(name), workers=1)
    text = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert told == ["figure-6", "figure-8"]
    assert text.count("| yes |") == sum(len(item.cells) for item in found.values())
    assert "![" in text
    assert (tmp_path / "figure-6.png").stat().st_size > 5000
    assert totals(found.values()) == (6, 6)


def test_several_processes_find_the_same() -> None:
    names = ["figure-6", "figure-8"]
    one, two = (dict(reproduce(names, QUICK, workers=workers)) for workers in (1, 2))
    assert [cell.ours for name in names for cell in one[name].cells] == [
        cell.ours for name in names for cell in two[name].cells
    ]


def test_a_number_beside_the_paper_s() -> None:
    cell = Cell("x", "0.5", 0.6, "mm", "as read", 0.58, 0.01)
    assert cell.ratio == pytest.approx(1.2)
    assert cell.holds is False
    assert Cell("x", "", 0.6, "mm", "as read").ratio is None
    assert Cell("x", "0", 0.6, "mm", "as read").ratio is None
    text = page({"a": Item("A", (cell,), "Because.")}, {}, 5)
    assert "| x, mm | 0.5 | 0.6 | 1.2 | 0.58 | **no** | as read |" in text
    assert number(1e-13) == "0"


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from cdhr_host.cli.app import app

    app(["reproduce", "--figure", "6", "--out", str(tmp_path), "--json"], standalone_mode=False)
    record = json.loads(capsys.readouterr().out)
    assert (record["compared"], record["agree"]) == (4, 4)
    assert Path(record["page"]).exists()


def test_the_command_refuses_a_figure_the_paper_has_not(capsys: pytest.CaptureFixture[str]) -> None:
    from cdhr_host.cli.app import app

    with pytest.raises(SystemExit) as ended:
        app(["reproduce", "--figure", "99"])
    assert ended.value.code == 2
    assert "no figure-99" in capsys.readouterr().err


def test_study_is_of_both_columns() -> None:
    assert set(Study(QUICK.profiles).profiles) == {"paper", "paper-simulation"}
