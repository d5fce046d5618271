"""Pictures of a log on disk: one file each, or one PDF with a page each."""

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cdhr_host.report.files import put
from cdhr_host.report.plot.panels import PICTURES, panels_of
from cdhr_host.report.plot.passing import Drawn
from cdhr_host.report.plot.path import colouring, draw_path
from cdhr_host.report.plot.series import draw_series
from cdhr_host.report.plot.style import SETTINGS
from cdhr_host.report.reading import LogFileError
from cdhr_host.report.summary import duration_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAMES: Final = ("path", *PICTURES)
PIXELS_AN_INCH: Final = 130


def available() -> bool:
    """Whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def shown_in(drawn: Drawn, what: str, colour: str) -> list[str]:
    """Names of the pictures to draw: the one asked for, or all that a log has anything for.

    Raises LogFileError for a picture or a colour that it has nothing for.
    """
    if colouring(drawn, colour) is None:
        raise LogFileError("it has no cable forces to colour the path with; --colour speed would do")
    found = ["path", *(name for name in PICTURES if panels_of(drawn, name))]
    if what == "all":
        return found
    if what not in found:
        raise LogFileError(f"it has nothing for --what {what}; it has {', '.join(found)}")
    return [what]


def write_pictures(drawn: Drawn, names: Sequence[str], colour: str, out: Path) -> list[Path]:
    """Draw them all; raises OSError when the disk refuses, leaving what was there."""
    import matplotlib as mpl  # noqa: PLC0415 -- may be missing

    with mpl.rc_context(SETTINGS):
        if out.suffix == ".pdf":
            _write_pages(drawn, names, colour, out)
            return [out]
        return list(_write_each(drawn, names, colour, out))


def _write_pages(drawn: Drawn, names: Sequence[str], colour: str, out: Path) -> None:
    from matplotlib.backends.backend_pdf import PdfPages  # noqa: PLC0415 -- may be missing

    with put(out) as part, PdfPages(part) as pages:
        for name in names:
            pages.savefig(_figure(drawn, name, colour))


def _write_each(drawn: Drawn, names: Sequence[str], colour: str, out: Path) -> Iterator[Path]:
    for name in names:
        path = out if len(names) == 1 else out.with_name(f"{out.stem}-{name}{out.suffix}")
        with put(path) as part:
            _figure(drawn, name, colour).savefig(part, dpi=PIXELS_AN_INCH)
        yield path


def _figure(drawn: Drawn, name: str, colour: str) -> "Figure":
    from matplotlib.figure import Figure  # noqa: PLC0415 -- may be missing

    figure = Figure(figsize=(12.0, 7.2), layout="constrained")
    if name == "path":
        chosen = colouring(drawn, colour)
        assert chosen is not None
        draw_path(figure, drawn, chosen)
    else:
        rows = panels_of(drawn, name)
        figure.set_size_inches(12.0 if len(rows[0]) == 1 else 14.0, 2.1 * len(rows) + 1.2)
        draw_series(figure, drawn, rows)
    figure.suptitle(f"{_title(drawn, name)}\n{_facts(drawn, name)}", fontsize=11, x=0.01, ha="left")
    return figure


def _title(drawn: Drawn, name: str) -> str:
    source = drawn.program or drawn.path.name
    return f"{'Path' if name == 'path' else PICTURES[name][0]}: {source}"


def _facts(drawn: Drawn, name: str) -> str:
    begin, end = drawn.times
    period = drawn.stencil.step / drawn.stencil.reach
    facts = [
        duration_text(end - begin),
        f"{drawn.rows} rows at {1 / period:g} Hz",
        drawn.profile.machine.name if drawn.profile is not None else "machine not known: no windows drawn",
    ]
    if name in {"path", "sliders"}:
        facts.append(f"differences over ±{1e3 * drawn.stencil.step:g} ms")
    if drawn.span > 1:
        facts.append(f"each point spans {drawn.span} rows, least to greatest")
    return "  ·  ".join(facts)
