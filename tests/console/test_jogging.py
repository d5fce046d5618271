"""Continuous jogging under an operator's fingers: what keeps it going, and what ends it in time.

The machine's time is stepped between two key presses, and all that was executed is looked at.
"""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import numpy as np
import pytest
from hands import Hands, run
from stepped import Stepped
from textual.events import AppBlur, Key

from cdhr_host.console.desk import Desk
from cdhr_host.drives import Loopback
from cdhr_host.drives.rows import joined
from cdhr_host.job.jogging import LEASE
from cdhr_host.job.printer import Printer
from cdhr_host.pipeline import open_profile
from cdhr_host.units import MM
from cdhr_host.values import Setpoints

PAPER = open_profile("paper")
PERIOD = PAPER.drives.period
TURN = 0.02
"""s of machine time between two turns of the printer"""
REPEAT = 0.04
"""s between two repeats of a held key"""
CLOSE = 1e-9
STILL = 1e-4
"""m/s, of the last tick of a way, which ends between two ticks"""


class Bench(Hands):
    """A desk whose machine moves only while the test lets time pass."""

    rows: list[Setpoints]
    clock: Stepped
    renewed: float
    """s of the clock, of the last press"""
    jogs: int = 0
    """times the printer was told to jog"""

    def go(self, duration: float) -> None:
        end = self.clock.now() + duration
        while self.clock.now() < end - CLOSE:
            self.printer.turn()
            self.clock.wait_until(self.clock.now() + TURN)
        self.printer.turn()

    async def held(self, key: str, duration: float) -> None:
        """A key is held: it repeats itself.

        A pilot's key press takes until the whole process idles; here it takes until the printer was told.
        """
        end = self.clock.now() + duration
        while self.clock.now() < end - CLOSE:
            before = self.jogs
            self.desk.post_message(Key(key, None))
            await self.until(lambda before=before: self.jogs > before, every=0.0)
            self.renewed = self.clock.now()
            self.go(REPEAT)

    def count(self) -> None:
        """Count what the printer is told."""
        jog = self.printer.jog

        def counted(velocity: np.ndarray) -> None:
            self.jogs += 1
            jog(velocity)

        self.printer.jog = counted

    @property
    def done(self) -> Setpoints:
        return joined(self.rows)

    @property
    def speed(self) -> np.ndarray:
        """(N,) m/s of the nozzle, from one executed row to the next."""
        way = np.diff(self.done.nozzle_G, axis=0, prepend=self.done.nozzle_G[:1])
        return np.linalg.norm(way, axis=1) / PERIOD

    def checked(self) -> None:
        """No executed row broke a limit of the nozzle's motion."""
        jerk = np.linalg.norm(np.diff(self.done.nozzle_G, 3, axis=0), axis=1).max() / PERIOD**3
        assert jerk <= PAPER.limits.jerk_max * 1.006

    def stops(self, latest: float) -> None:
        """The stop begins by ``latest``, s of the clock, and is one jerk-limited ramp down to rest."""
        at, speed = self.done.tick * PERIOD, self.speed
        fast = float(speed.max())
        begun = at[speed > fast * (1 - CLOSE)][-1]
        rest = at[speed > STILL][-1]
        assert begun <= latest
        assert rest - begun <= 1.3 * ramp(fast) + 2 * PERIOD
        assert np.ptp(self.done.nozzle_G[at >= begun], axis=0).max() <= fast * ramp(fast)
        self.checked()


def ramp(speed: float) -> float:
    """s: the shortest from this speed, m/s, to rest: the greatest jerk, then its opposite."""
    return 2 * float(np.sqrt(speed / PAPER.limits.jerk_max))


def bench(body: Callable[[Bench], Awaitable[None]]) -> Callable[[Path], None]:
    """A test that is given such a desk, jogging continuously at 20 mm/s."""

    def test(tmp_path: Path) -> None:
        async def whole() -> None:
            clock = Stepped()
            link = Loopback(PAPER, clock)
            link.open()
            printer = Printer(link, clock)
            desk = Desk(printer, history=tmp_path / "history")
            rows: list[Setpoints] = []
            printer.observe(lambda batch, _: rows.append(batch))
            try:
                async with desk.run_test(size=(80, 24)) as pilot:
                    hand = Bench(pilot, printer)
                    hand.rows, hand.clock = rows, clock
                    hand.count()
                    await pilot.press("c", "plus")
                    await body(hand)
            finally:
                printer.close()
                link.close()

        run(whole())

    test.__doc__ = body.__doc__
    return test


@bench
async def test_a_held_key_moves_until_it_is_let_go(hand: Bench) -> None:
    await hand.held("right", 1.0)
    assert hand.speed[-1] == pytest.approx(20 * MM, rel=1e-6)
    hand.go(1.0)
    hand.stops(hand.renewed + LEASE)
    assert np.abs(hand.done.nozzle_G[:, 1:]).max() < 1e-9


@bench
async def test_a_single_press_moves_for_one_lease_only(hand: Bench) -> None:
    await hand.press("up")
    hand.go(1.5)
    assert hand.printer.status().velocity == 0.0
    assert 0.0 < hand.done.nozzle_G[-1, 1] < 20 * MM * (LEASE + ramp(20 * MM))
    hand.checked()


@bench
async def test_lost_focus_ends_it_before_the_lease_does(hand: Bench) -> None:
    await hand.held("right", 1.0)
    let_go = hand.clock.now()
    hand.desk.post_message(AppBlur())
    await hand.pilot.pause()
    hand.go(1.0)
    hand.stops(let_go + TURN)


@bench
async def test_leaving_ends_it_before_the_lease_does(hand: Bench) -> None:
    await hand.held("right", 1.0)
    let_go = hand.clock.now()
    await hand.press("q")
    await hand.pilot.pause()
    assert not hand.desk.is_running
    hand.go(1.0)
    hand.stops(let_go + TURN)


@bench
async def test_another_key_turns_round_through_rest(hand: Bench) -> None:
    await hand.held("right", 0.8)
    await hand.held("left", 1.2)
    x = hand.done.nozzle_G[:, 0]
    assert x[-1] < x.max() - 5 * MM
    assert hand.speed[int(np.argmax(x))] < 0.5 * MM
    hand.checked()


@bench
async def test_down_to_the_bed(hand: Bench) -> None:
    await hand.held("pageup", 1.0)
    await hand.held("pagedown", 3.0)
    hand.go(1.0)
    z = hand.done.nozzle_G[:, 2]
    assert z.min() >= -1e-9
    assert z[-1] < 2.1 * MM
    assert hand.speed[-1] < STILL
    assert "the jog ends here: the nozzle would be at z = -" in hand.messages
    assert "below the bed at 0 mm" in " ".join(hand.messages.split())
    hand.checked()


@bench
async def test_out_to_a_force_window(hand: Bench) -> None:
    await hand.press("plus")
    await hand.held("right", 7.0)
    hand.go(1.0)
    assert hand.speed[-1] < STILL
    assert "would carry" in hand.messages
    forces = PAPER.forces
    assert hand.done.tension[:, 3:].max() <= forces.upper_max * (1 + 1e-6)
    assert hand.done.tension[:, :3].min() >= forces.lower_min * (1 - 1e-6)
    assert hand.done.nozzle_G[-1, 0] > 100 * MM
    hand.checked()


def test_out_to_the_rim_of_the_bed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small = PAPER.model_copy(update={"bed": PAPER.bed.model_copy(update={"radius": 30 * MM})})
    monkeypatch.setitem(globals(), "PAPER", small)

    async def rim(hand: Bench) -> None:
        await hand.held("right", 2.5)
        hand.go(1.0)
        assert 27.9 * MM < hand.done.nozzle_G[-1, 0] <= 30 * MM
        assert hand.speed[-1] < STILL
        assert "the bed ends at 30 mm" in " ".join(hand.messages.split())
        hand.checked()

    bench(rim)(tmp_path)


@bench
async def test_sliders_alone(hand: Bench) -> None:
    await hand.press("c", "minus", "s", "1")
    assert hand.desk._jogging.label == "SLIDER 1 alone: step 1 mm"
    await hand.press("up")
    hand.go(1.0)
    await hand.pilot.pause()
    assert hand.done.slider[-1] / MM == pytest.approx([1, 0, 0, 0, 0, 0], abs=1e-6)
    assert "slider 1 pays out 1 mm: the nozzle goes X-0.757" in hand.messages
    await hand.press("minus", "left")
    hand.go(1.0)
    assert hand.done.slider[-1, 0] / MM == pytest.approx(0.9, abs=1e-6)
    await hand.press("plus", "plus", "up")
    hand.go(0.5)
    assert "a single slider is not moved by 10 mm at a time" in hand.messages
    await hand.press("minus", "escape", "up")
    hand.go(2.0)
    await asyncio.sleep(0)
    assert hand.done.nozzle_G[-1, 1] / MM == pytest.approx(1.0, abs=1e-6)
