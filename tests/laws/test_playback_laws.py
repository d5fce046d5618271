"""Laws of held, resumed and overridden prints: limits, path, clay and the dry run, at every tick."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from chaos import AtOnce, Clock, chaotic, drawing

from cdhr_host.drives.loopback import Loopback
from cdhr_host.job.printer import Printer
from cdhr_host.job.program import ProgramFile, proven
from cdhr_host.job.surface import JobState
from cdhr_host.pipeline import Staircase, open_profile
from cdhr_host.pipeline.course import joined

COLUMNS = ("line", "nozzle_G", "upper", "slider", "tension", "flow", "pressure")
PROFILE = open_profile("paper-wide")
RING = Path(__file__).parents[2] / "gcode" / "paper_ring_double.gcode"
TURN = 0.1
"""s of machine time between two turns, less than the drives' buffer"""


# No shrinking: a smaller seed draws another program, not a simpler one.
@settings(max_examples=2, deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(st.integers(0, 10**9), st.booleans())
def test_whatever_is_said_the_limits_hold_and_nothing_is_laid_twice(tmp_path_factory, seed, flows):
    rng = np.random.default_rng(seed)
    path = tmp_path_factory.mktemp("chaos") / "drawing.gcode"
    path.write_text(drawing(rng))
    figures, _ = chaotic(PROFILE, path, rng, flows=flows)
    assert figures.worst.max() <= 1.006
    assert figures.away < 2e-6
    assert figures.margin > 0.0
    assert figures.monotone
    assert figures.clay <= 2.0


class Stepping:
    """A printer on simulated drives whose time passes here only."""

    def __init__(self, path, profile=PROFILE):
        self.clock = Clock()
        self.link = Loopback(profile, self.clock)
        self.link.open()
        self.printer = Printer(self.link, self.clock, executor=AtOnce())
        self.rows, self.events = [], []
        self.printer.observe(lambda batch, _: self.rows.append(batch))
        self.printer.listen(self.events.append)
        self.printer.adopt(proven(ProgramFile(path), profile))
        self.printer.start()

    def go(self, *states, most=1e9):
        end = self.clock.now() + most
        while self.printer.state not in states and self.clock.now() < end:
            self.printer.turn()
            self.clock.wait_until(min(self.clock.now() + TURN, end))

    def executed(self):
        return joined(self.rows)


@cache
def dry_run(material):
    """The profile with a material, and the ring's rows on it."""
    profile = open_profile("paper-wide", material)
    return profile, joined([rows for rows in Staircase(profile).setpoints([RING.read_bytes()]) if len(rows)])


@pytest.mark.parametrize("material", [None, "stoneware"])
@settings(max_examples=3, deadline=None)
@given(when=st.floats(0.5, 12.0), slower=st.sampled_from([0.3, 0.7, 1.0]))
def test_after_a_hold_and_back_at_100_percent_every_row_is_the_dry_runs(material, when, slower):
    profile, dry = dry_run(material)
    run = Stepping(RING, profile)
    run.go(most=when)
    run.printer.hold()
    run.go(JobState.HELD)
    held = sum(map(len, run.rows))
    run.printer.override(feed=slower)
    run.printer.resume()
    run.go(most=1.0)
    run.printer.override(feed=1.0)
    run.go(JobState.DONE, JobState.FAULT)
    assert run.printer.state is JobState.DONE
    done = run.executed()
    first = next(k for k in range(len(done)) if not (done.slider[k] == dry.slider[k]).all())
    last = next(k for k in range(1, len(done)) if not (done.slider[-k] == dry.slider[-k]).all())
    assert first < held
    assert len(done) - last < held + 1000
    for name in COLUMNS:
        before, after = getattr(done, name)[:first], getattr(done, name)[len(done) - last + 1 :]
        if name != "pressure" or material is None:
            assert (before == getattr(dry, name)[:first]).all()
        assert len(after) > 100
        settled = after[600:]
        expected = getattr(dry, name)[len(dry) - len(settled) :]
        if name == "pressure" and material is not None:
            # A lag's state comes near to what it would have been, it does not meet it to the bit.
            assert np.abs(settled - expected).max() < 1.0
        else:
            assert (settled == expected).all(), name
    assert (np.diff(done.tick) == 1).all()
