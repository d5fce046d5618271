"""Numbers as bars of characters, legible without colour."""

import math
from typing import Final

TRACK: Final = "·"
MARK: Final = "█"
EDGES: Final = ("├", "┤")
BELOW, ABOVE = "◄", "►"


def gauge(value: float, least: float, greatest: float, width: int) -> str:
    """A value inside its window as a bar of ``width`` characters, ends included.

    A mark stands where the value is; outside the window an arrow stands at that end instead.
    ``width`` >= 3. A value that is not a number leaves the track empty.
    """
    inner = width - 2
    track = [TRACK] * inner
    left, right = EDGES
    share = (value - least) / (greatest - least) if greatest > least else math.nan
    if share < 0.0:
        left = BELOW
    elif share > 1.0:
        right = ABOVE
    elif not math.isnan(share):
        track[min(int(share * inner), inner - 1)] = MARK
    return f"{left}{''.join(track)}{right}"


def outside(value: float, least: float, greatest: float) -> str:
    """``LOW``, ``HIGH`` or nothing."""
    return "LOW" if value < least else "HIGH" if value > greatest else ""


def progress_bar(fraction: float, width: int) -> str:
    """0 ... 1 as a bar of ``width`` characters."""
    done = round(min(max(fraction, 0.0), 1.0) * width)
    return MARK * done + TRACK * (width - done)


def span(seconds: float) -> str:
    """A length of time as a person says it: ``1:02:03`` or ``2:03``."""
    whole = round(max(seconds, 0.0))
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"
