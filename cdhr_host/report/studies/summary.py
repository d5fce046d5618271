"""Which jobs a study has, and what their answers say together."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from cdhr_host.mechanism import Cables
from cdhr_host.mechanism.calibration_model import NAMES, Doubts
from cdhr_host.profile import Profile
from cdhr_host.report.studies.poses import candidates, planned
from cdhr_host.report.studies.trials import ASIDE, GROUPS, Fault, Slice, Trial, Tried, grid_line
from cdhr_host.units import MM
from cdhr_host.values import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZES: Final = (0.25 * MM, 0.5 * MM, 1.0 * MM, 2.0 * MM)
"""m, standard deviations of a tolerance study"""
SHOWN: Final = 6
"""slices of a workspace that are drawn"""


class Study(Protocol):
    """What came of many jobs."""

    def lines(self) -> Iterator[str]:
        """In words."""
        ...

    def record(self) -> dict[str, Any]:
        """As JSON."""
        ...

    def draw(self, title: str, path: Path) -> None:
        """As a picture; raises ImportError without matplotlib."""
        ...


def calibration_jobs(profile: Profile, machines: int, count: int, noise: float) -> list[Trial]:
    """Machines drawn from the doubts, measured at planned poses; raises MotionError without such poses."""
    doubts, cables = Doubts(), Cables.from_profile(profile)
    poses = planned(profile, doubts, count, noise)
    aside = candidates(profile).slider[:, :3]
    aside = aside[:: max(1, len(aside) // ASIDE)]
    return [Trial(seed, cables, doubts, poses.slider[:, :3], aside, noise) for seed in range(1, machines + 1)]


@dataclass(frozen=True, slots=True)
class CalibrationStudy:
    """Many machines calibrated."""

    names: list[str]
    off: Array
    """(M, P): parameters less the truth in their standard deviations"""
    rms: Array
    """(M, 4) m: of places not measured before and after, the worst of them, its own doubt"""

    def lines(self) -> Iterator[str]:
        """See ``Study``."""
        within = np.mean(np.abs(self.off) < 3.0)
        yield f"  truth within 3 sigma: {within:.2%} of {self.off.size} parameters (99.73 % would be exact)"
        yield f"  spread of (found - truth) / sigma: {np.sqrt(np.mean(self.off**2)):.3f}"
        first, last, worst, doubt = np.mean(self.rms, axis=0) / MM
        yield f"  places not measured, rms: {first:.3f} mm by the drawing, {last:.3f} mm after"
        yield f"  the worst of them: {worst:.3f} mm on average, {self.rms[:, 2].max() / MM:.3f} mm at most"
        yield f"  one sigma that the calibration gives itself there: {doubt:.3f} mm"
        better = int(np.sum(self.rms[:, 1] < self.rms[:, 0]))
        yield f"  better than the drawing: {better} of {len(self.rms)} machines"

    def record(self) -> dict[str, Any]:
        """See ``Study``."""
        keys = ("rms_before_mm", "rms_after_mm", "worst_after_mm", "doubt_mm")
        return {
            "parameters": self.names,
            "off_in_sigma": self.off.tolist(),
            **{key: (column / MM).tolist() for key, column in zip(keys, self.rms.T, strict=True)},
        }

    def draw(self, title: str, path: Path) -> None:
        """See ``Study``."""
        figure = _figure(title)
        left, right = figure.subplots(1, 2)
        bins = np.linspace(-5.0, 5.0, 51)
        left.hist(self.off.ravel(), bins, density=True, label="found")
        left.plot(bins, np.exp(-0.5 * bins**2) / np.sqrt(2.0 * np.pi), "k", lw=1, label="normal")
        left.set(xlabel="(found - truth) / sigma", ylabel="density")
        left.legend()
        edges = np.geomspace(max(self.rms[:, 1].min() / MM, 1e-4), self.rms[:, 0].max() / MM, 40)
        for name, column in (("by the drawing", 0), ("after", 1)):
            right.hist(self.rms[:, column] / MM, edges, alpha=0.7, label=name)
        right.set(xlabel="rms at places not measured, mm", ylabel="machines", xscale="log")
        right.legend()
        figure.savefig(path, dpi=120)


def calibration_study(jobs: Sequence[Trial], found: Sequence[Tried]) -> CalibrationStudy:
    """Answers in the order of the jobs."""
    free = jobs[0].doubts.each() > 0.0
    names = [name for name, kept in zip(NAMES, free, strict=True) if kept]
    rms = np.array([[each.before, each.after, each.worst, each.doubt] for each in found])
    return CalibrationStudy(names, np.array([each.off for each in found]), rms)


def tolerance_jobs(profile: Profile, machines: int, equation: str) -> list[Fault]:
    """Each group of parameters off by each size, in as many machines."""
    cables, seeds = Cables.from_profile(profile), range(1, machines + 1)
    return [
        Fault(seed, cables, group, size, equation) for group in GROUPS for size in SIZES for seed in seeds
    ]


@dataclass(frozen=True, slots=True)
class ToleranceStudy:
    """How far the nozzle strays."""

    off: Array
    """(G, S, M) m: greatest distance, by group, size and machine"""

    def lines(self) -> Iterator[str]:
        """See ``Study``."""
        yield "  greatest distance from the path, mm: median, 95 % of the machines stay below"
        yield f"  {'one sigma':<12}" + "".join(f"{size / MM:>9g} mm   " for size in SIZES)
        middle, most = (np.quantile(self.off, share, axis=2) / MM for share in (0.5, 0.95))
        for name, m, h in zip(GROUPS, middle, most, strict=True):
            yield f"  {name:<12}" + "".join(f"{a:7.3f} {b:7.3f}" for a, b in zip(m, h, strict=True))

    def record(self) -> dict[str, Any]:
        """See ``Study``."""
        return {
            "sizes_mm": [size / MM for size in SIZES],
            "greatest_mm": {name: (part / MM).tolist() for name, part in zip(GROUPS, self.off, strict=True)},
        }

    def draw(self, title: str, path: Path) -> None:
        """See ``Study``."""
        figure = _figure(title)
        axes = figure.subplots()
        for name, part in zip(GROUPS, self.off / MM, strict=True):
            low, middle, high = np.quantile(part, [0.05, 0.5, 0.95], axis=1)
            spread = middle - low, high - middle
            axes.errorbar(np.array(SIZES) / MM, middle, spread, marker="o", capsize=3, label=name)
        axes.set(xlabel="one sigma of the fault, mm", ylabel="greatest distance, mm")
        axes.loglog()
        axes.legend()
        figure.savefig(path, dpi=120)


def tolerance_study(jobs: Sequence[Fault], found: Sequence[float]) -> ToleranceStudy:
    """Answers in the order of the jobs."""
    return ToleranceStudy(
        np.array(found).reshape(len(GROUPS), len(SIZES), len(jobs) // len(GROUPS) // len(SIZES))
    )


def slices(profile: Profile, step: float) -> list[Slice]:
    """Level slices of the bed's cylinder, from the reference pose's height up."""
    bed = profile.bed
    return [Slice(profile, float(z), bed.radius, step) for z in np.arange(0.0, bed.height + 1e-9, step)]


@dataclass(frozen=True, slots=True)
class WorkspaceStudy:
    """Margins over the bed."""

    height: Array
    """(H,) m"""
    line: Array
    """(K,) m along x and y"""
    margin: Array
    """(H, K, K)"""

    @property
    def volume(self) -> float:
        """m³ of the nodes with a margin."""
        step = float(self.line[1] - self.line[0]) if len(self.line) > 1 else 0.0
        return float(np.sum(self.margin >= 0.0)) * step**3

    def rows(self) -> Iterator[str]:
        """CSV of every node inside the cylinder."""
        yield "x_mm,y_mm,z_mm,margin"
        for z, level in zip(self.height / MM, self.margin, strict=True):
            for y, row in zip(self.line / MM, level, strict=True):
                for x, value in zip(self.line / MM, row, strict=True):
                    yield f"{x:g},{y:g},{z:g},{value:.6g}"

    def lines(self) -> Iterator[str]:
        """See ``Study``."""
        yield f"  {self.margin.size} nodes, {self.volume * 1e3:.1f} l inside all limits over the bed"
        best = np.unravel_index(int(self.margin.argmax()), self.margin.shape)
        z, y, x = self.height[best[0]] / MM, self.line[best[1]] / MM, self.line[best[2]] / MM
        yield f"  largest margin {self.margin.max():.3f} at X{x:g} Y{y:g} Z{z:g}"

    def record(self) -> dict[str, Any]:
        """See ``Study``."""
        return {
            "volume_l": self.volume * 1e3,
            "height_mm": (self.height / MM).tolist(),
            "line_mm": (self.line / MM).tolist(),
            "margin": self.margin.tolist(),
        }

    def draw(self, title: str, path: Path) -> None:
        """See ``Study``."""
        figure = _figure(title)
        picked = np.unique(np.linspace(0, len(self.height) - 1, SHOWN).astype(int))
        places = figure.subplots(2, -(-len(picked) // 2), squeeze=False).ravel()
        edge = self.line / MM
        for n, axes in zip(picked, places, strict=False):
            drawn = axes.pcolormesh(edge, edge, self.margin[n], vmin=-1.0, vmax=1.0, cmap="RdYlGn")
            axes.set_aspect("equal")
            axes.set_title(f"z = {self.height[n] / MM:g} mm", fontsize=9)
        for axes in places[len(picked) :]:
            axes.axis("off")
        figure.colorbar(drawn, ax=list(places), label="force margin, half-widths")
        figure.savefig(path, dpi=120)


def workspace_study(jobs: Sequence[Slice], found: Sequence[Array]) -> WorkspaceStudy:
    """Answers in the order of the jobs."""
    height = np.array([job.height for job in jobs])
    return WorkspaceStudy(height, grid_line(jobs[0].radius, jobs[0].step), np.array(found))


def _figure(title: str) -> "Figure":
    from matplotlib.figure import Figure  # noqa: PLC0415 -- may be missing

    figure = Figure(figsize=(10, 5), layout="constrained")
    figure.suptitle(title)
    return figure
