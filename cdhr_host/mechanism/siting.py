"""Where a part sits best: the shift of its places that leaves the weakest cable the most room."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import minimize

from cdhr_host.mechanism.margin_map import MarginMap, limited_margin
from cdhr_host.mechanism.workspace import Workspace
from cdhr_host.units import MM
from cdhr_host.values import Array

FEW: Final = 300
"""places looked at for every shift of the coarse search"""
MANY: Final = 800
"""places looked at while refining"""
STEPS: Final = 11
"""shifts of the coarse search along each axis"""
STARTS: Final = 2
"""of the best of them, refined"""
REFINED: Final = 0.05 * MM


@dataclass(frozen=True, slots=True)
class Site:
    """A part's places moved by a shift."""

    shift: Array
    """(3,) m"""
    margin: float
    """the least of all places; WORST where a limit is broken"""


def best_site(
    space: Workspace,
    chart: MarginMap,
    places: Array,
    bounds: tuple[Array, Array],
    *,
    acceleration: float = 0.0,
    told: Callable[[float], None] = lambda _: None,
) -> Site:
    """(N, 3) m from the reference pose, least and greatest shift (3,) m -> the best Site.

    Looked for on a grid of shifts in the chart, then refined with the formulas themselves (Nelder
    and Mead 1965). Never worse than no shift. An axis whose bounds are equal is not searched.
    """
    low, high = bounds
    free = np.flatnonzero(high > low)
    some = sparse(places, MANY)
    starts = [np.zeros(3), *_coarse(chart, sparse(places, FEW), bounds, told)]

    def worse(values: Array, shift: Array) -> float:
        moved = shift.copy()
        moved[free] = values
        beyond = np.maximum(np.maximum(low - moved, moved - high), 0.0).sum()
        return float(beyond / MM - limited_margin(space, some + moved, acceleration).min())

    found = [np.zeros(3)]
    for k, start in enumerate(starts):
        told(0.5 + 0.5 * k / len(starts))
        refined = start.copy()
        refined[free] = minimize(
            worse,
            start[free],
            args=(start,),
            method="Nelder-Mead",
            options={"xatol": REFINED, "fatol": 1e-4, "initial_simplex": _simplex(start[free])},
        ).x
        found.append(np.clip(refined, low, high))
    sites = [Site(each, float(limited_margin(space, places + each, acceleration).min())) for each in found]
    return max(sites, key=lambda site: site.margin)


def sparse(places: Array, most: int) -> Array:
    """(N, 3) -> (M, 3), M at most ``most``: the extremes, and the others evenly thinned out in space."""
    edge = 1.0 * MM
    kept = places
    while len(kept) > most:
        _, first = np.unique(np.floor(places / edge), axis=0, return_index=True)
        kept = places[first]
        edge *= 1.3
    around = [places[:, :2] @ np.array([np.cos(a), np.sin(a)]) for a in np.arange(0.0, np.pi, np.pi / 12)]
    rim = {int(way.argmin()) for way in (*around, places[:, 2])}
    rim |= {int(way.argmax()) for way in (*around, places[:, 2])}
    return np.concatenate([kept[: most - len(rim)], places[sorted(rim)]])


def _coarse(
    chart: MarginMap, places: Array, bounds: tuple[Array, Array], told: Callable[[float], None]
) -> list[Array]:
    """The best shifts of a grid, by the chart, best first."""
    axes = [np.unique(np.linspace(low, high, STEPS)) for low, high in zip(*bounds, strict=True)]
    shifts = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    look_up, least = chart.look_up(), np.empty(len(shifts))
    for k, (dx, dy, dz) in enumerate(shifts):
        x, y, z = places[:, 0] + dx, places[:, 1] + dy, places[:, 2] + dz
        least[k] = look_up(np.column_stack([np.hypot(x, y), chart.folded(np.arctan2(y, x)), z])).min()
        told(0.5 * (k + 1) / len(shifts))
    return [shifts[k] for k in np.argsort(-least, kind="stable")[:STARTS]]


def _simplex(start: Array) -> Array:
    """(k + 1, k): a start and one step of 20 mm along each axis."""
    return np.vstack([start, start + 20.0 * MM * np.eye(len(start))])
