"""Where the machine can print: radius by height for each spring policy, and the paper's trajectories."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdhr_host.mechanism import POLICIES, PolicyName, Printable, Workspace, printable
from cdhr_host.profile import Profile
from cdhr_host.report.files import put
from cdhr_host.samples import LAWS
from cdhr_host.units import MM
from cdhr_host.values import Array

STEP = 25.0 * MM
"""m between two heights"""
SPOTS = 2000
"""places looked at along a trajectory"""
COLOURS = {"fixed": "tab:gray", "preload": "tab:olive", "vertical": "tab:blue", "free": "tab:red"}


@dataclass(frozen=True, slots=True)
class Reach:
    """What a profile can reach."""

    printable: Printable
    margin: dict[tuple[str, PolicyName], float]
    """(equation, policy) -> smallest normalised force margin along it; negative is infeasible"""


def reach(profile: Profile, acceleration: float = 0.0) -> Reach:
    """Radii over the whole height between the pulleys, with an acceleration (m/s²) to spare."""
    shape = profile.geometry
    top = shape.upper_pulley_height - shape.lower_pulley_height - shape.reference_separation
    height = np.arange(STEP, top, STEP)
    margin = {
        (name, policy): _least(Workspace.from_profile(profile, policy), _along(name), acceleration)
        for name in LAWS
        for policy in POLICIES
    }
    return Reach(printable(profile, height, acceleration=acceleration), margin)


def _along(name: str) -> Array:
    law = LAWS[name]
    return law.position(law.times(law.duration / SPOTS))


def _least(space: Workspace, q: Array, acceleration: float) -> float:
    return float(np.min(space.margin(q, acceleration)))


def workspace_lines(found: Reach, profile: str) -> list[str]:
    """What a person wants to know of it."""
    radii = found.printable.radius
    yes = [
        f"  {name:<9} {float(radii[name].max()) / MM:7.0f} mm {found.printable.volume(name) * 1e3:8.1f} l"
        for name in POLICIES
    ]
    rows = [
        f"  Eq. ({name:<2})  " + "  ".join(f"{found.margin[name, policy]:8.3f}" for policy in POLICIES)
        for name in LAWS
    ]
    return [
        f"printable on {profile}, all nine cables inside their windows",
        "  policy    greatest radius, volume",
        *yes,
        "smallest force margin along the paper's trajectories, 1 is the middle of a window, below 0 outside",
        "           " + "  ".join(f"{policy:>8}" for policy in POLICIES),
        *rows,
    ]


def draw(found: Reach, title: str, path: Path) -> None:
    """Radius by height for the four policies; PNG, SVG or PDF by suffix."""
    from matplotlib.figure import Figure  # noqa: PLC0415 -- may be missing

    figure = Figure(figsize=(7, 6), layout="constrained")
    axes = figure.add_subplot()
    height = found.printable.height / MM
    for name in POLICIES:
        label = f"{name}, {found.printable.volume(name) * 1e3:.0f} l"
        axes.plot(found.printable.radius[name] / MM, height, color=COLOURS[name], label=label)
    clear = np.minimum(found.printable.clear / MM, axes.get_xlim()[1])
    axes.plot(clear, height, "k:", label="lower cables clear of a flat part")
    axes.set(
        xlabel="radius, mm", ylabel="height of the lower platform over the lower pulleys, mm", title=title
    )
    axes.legend()
    axes.grid(alpha=0.3)
    with put(path) as part:
        figure.savefig(part, dpi=120)
