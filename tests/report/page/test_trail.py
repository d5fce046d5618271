"""The drawn path against every tick of the planned one; places of problems; layers."""

import numpy as np
import pytest

from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.page.layers import layers_of
from cdhr_host.report.page.trail import COLUMNS, Trail
from cdhr_host.units import MM

TILE = (
    b"M83\n;LAYER:0\nG1 Z2 F1200\nG1 X40 E90\nG1 Y30 E70\nG1 X0 E90\nG1 Y0 E70\n"
    b";LAYER:1\nG1 Z4\nG2 X0 Y0 I20 J0 E250\nG1 Z20 F3000\n"
)


@pytest.fixture(scope="module")
def paper():
    return open_profile("paper")


def drawn(text, profile, **settings):
    trail = Trail(profile, **settings)
    proof = prove([text], profile, watch=trail.watch)
    return trail, proof, trail.vertices()


def every_tick(text, profile):
    blocks = []
    prove([text], profile, sink=blocks.append)
    return np.concatenate([block.nozzle_G for block in blocks])


def away(places, line):
    start, way = line[:-1], np.diff(line, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((places[:, None] - start) * way).sum(axis=2) / square, 0.0, 1.0)
    return np.linalg.norm(places[:, None] - start - share[..., None] * way, axis=2).min(axis=1).max()


def test_every_planned_tick_is_on_the_drawn_path(paper):
    trail, _, rows = drawn(TILE, paper)
    ticks = every_tick(TILE, paper)
    assert away(ticks[::7], rows[:, :3].astype(float)) <= 2 * trail.tolerance
    assert len(rows) < len(ticks) / 2


def test_a_small_budget_is_kept_and_the_tolerance_says_what_it_costs(paper):
    trail, _, rows = drawn(TILE, paper, budget=40)
    assert len(rows) <= 40
    assert trail.tolerance > 0.02 * MM
    assert away(every_tick(TILE, paper)[::7], rows[:, :3].astype(float)) <= 3 * trail.tolerance


def test_extremes_of_what_is_shown_are_the_proofs(paper):
    _, proof, rows = drawn(TILE, paper)
    column = dict(zip(COLUMNS, rows.T, strict=True))
    assert column["pressure"].max() / 1e3 == pytest.approx(proof.extremes["pressure_kpa"][2], rel=0.02)
    assert column["speed"].max() == pytest.approx(0.05, rel=0.03)
    assert column["t"][-1] == pytest.approx(proof.duration, abs=0.01)
    assert (np.diff(column["t"]) >= 0).all()
    assert 0 < column["margin"].min() < column["margin"].max() <= 1


def test_problems_are_where_their_number_is_met(paper):
    text = b"M83\nG1 Z5 F1200\nG1 X340 E600\nG1 X0\n"
    trail, proof, rows = drawn(text, paper)
    places = {
        (each.kind, each.line): trail.place(each, rows)[0] / MM
        for each in proof.problems
        if each.kind in {"bed", "force"}
    }
    assert places["bed", 3] == pytest.approx(340, abs=0.3)  # a corner is cut by the tolerance
    worst = next(each for each in proof.problems if each.kind == "force" and each.line == 3)
    assert worst.value == pytest.approx(13.6, abs=0.2)
    assert places["force", 3] == pytest.approx(320, abs=1)
    assert rows[:, 0].max() / MM == pytest.approx(340, abs=0.3)
    assert rows[:, COLUMNS.index("margin")].min() < 0


def test_layers_take_the_whole_time(paper):
    _, proof, rows = drawn(TILE, paper)
    layers = layers_of(rows, proof)
    assert [layer.name for layer in layers] == ["1", "2"]
    assert sum(layer.duration for layer in layers) == pytest.approx(proof.duration)
    assert [layer.height / MM for layer in layers] == pytest.approx([2, 4])
    assert [rows[layer.first, -1] for layer in layers] == [3, 9]


def test_heights_make_layers_where_comments_do_not(paper):
    plain = b"\n".join(line for line in TILE.splitlines() if not line.startswith(b";")) + b"\n"
    _, proof, rows = drawn(plain, paper)
    layers = layers_of(rows, proof)
    assert [layer.name for layer in layers] == ["before", "1", "2"]
    assert [layer.height / MM for layer in layers[1:]] == pytest.approx([2, 4])


def test_a_spiral_has_no_layers(paper):
    turns = b"\n".join(b"G2 X0 Y0 Z%d I20 J0 E250" % height for height in range(2, 8))
    _, proof, rows = drawn(b"M83\nG1 F1200\n" + turns + b"\n", paper)
    assert layers_of(rows, proof) == []


def test_a_program_that_does_not_move_has_no_path(paper):
    trail = Trail(paper)
    assert trail.vertices().shape == (0, len(COLUMNS))
