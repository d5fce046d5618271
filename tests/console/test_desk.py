"""The desk under an operator's fingers, over a real printer on simulated drives."""

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, chdir
from pathlib import Path

import pytest
from hands import Hands, run
from textual.widgets import Static

from cdhr_host.console.desk import Desk
from cdhr_host.drives import Loopback, PacedClock
from cdhr_host.job.printer import Printer
from cdhr_host.job.surface import JobState
from cdhr_host.pipeline import open_profile
from cdhr_host.units import MM

RING = Path("r")
"""what is typed for it: after each letter a pilot waits until the process idles, up to a second"""
FILE = Path(__file__).parents[2] / "gcode" / "paper_ring_double.gcode"
SPEED = 10.0
"""times real time: slow enough for a hand to come in between"""


@asynccontextmanager
async def hands(
    tmp_path: Path, speed: float = 100.0, size: tuple[int, int] = (80, 24)
) -> AsyncIterator[Hands]:
    clock = PacedClock(SPEED)
    link = Loopback(open_profile("paper"), clock)
    link.open()
    printer = Printer(link, clock)
    printer.begin()
    try:
        desk = Desk(printer, history=tmp_path / "history")
        async with desk.run_test(size=size) as pilot:
            yield Hands(pilot, printer)
    finally:
        printer.close()
        link.close()


def place(hand: Hands) -> list[float]:
    return [round(float(each / MM), 3) for each in hand.printer.status().nozzle_G]


def scenario(body: Callable[[Hands], Awaitable[None]]) -> Callable[[Path], None]:
    """A test that is given an operator's hands."""

    def test(tmp_path: Path) -> None:
        async def whole() -> None:
            async with hands(tmp_path) as hand:
                await body(hand)

        (tmp_path / RING).symlink_to(FILE)
        with chdir(tmp_path):
            run(whole())

    test.__doc__ = body.__doc__
    return test


@scenario
async def test_forces_are_shown_before_anything_moves(hand: Hands) -> None:
    await hand.until(lambda: "1L├··█·······┤  2.41  0.5–10.0" in hand.text("cables"))
    assert " 8.77  5.0–12.0" in hand.text("cables")


@scenario
async def test_typed_code_moves_the_machine(hand: Hands) -> None:
    await hand.type("G1 X10 Y-5 F6000")
    await hand.until(lambda: "ok X:10.000 Y:-5.000 Z:0.000" in hand.messages)
    await hand.until(lambda: "X   10.000 Y   -5.000 Z    0.000" in hand.text("positions"))


@scenario
async def test_refused_code_is_told_with_its_hint(hand: Hands) -> None:
    await hand.type("G1 X280 F6000")
    await hand.until(lambda: "hint: move the part nearer to the axis" in hand.messages)
    assert "error: cable 4 would carry 13.0" in hand.messages
    assert place(hand) == [0, 0, 0]


@scenario
async def test_arrows_step_and_modes_stay(hand: Hands) -> None:
    await hand.type("G20")
    await hand.press("right", "pageup", "minus", "up")
    await hand.until(lambda: place(hand) == [1.0, 0.1, 1.0])
    assert "step 0.1 mm" in hand.text("air")
    await hand.type("G1 X1 F100")
    await hand.until(lambda: place(hand) == [25.4, 0.1, 1.0])


@scenario
async def test_a_step_out_of_reach_is_refused(hand: Hands) -> None:
    await hand.press("pagedown")
    await hand.until(lambda: "below the bed" in hand.messages)


@scenario
async def test_history_comes_back(hand: Hands) -> None:
    await hand.type("G1 X3 F6000")
    await hand.until(lambda: place(hand) == [3, 0, 0])
    await hand.type("G1 X1")
    await hand.until(lambda: place(hand) == [1, 0, 0])
    await hand.press("colon", "up", "up", "enter")
    await hand.until(lambda: place(hand) == [3, 0, 0])


@scenario
async def test_a_word_completes(hand: Hands) -> None:
    await hand.press("colon", *"g2")
    entry = hand.desk.query_one("#entry")
    await hand.until(lambda: entry._suggestion == "G2")
    await hand.press("right")
    await hand.until(lambda: entry.value == "G2")
    await hand.press("escape", "right")
    await hand.until(lambda: place(hand) == [1, 0, 0])


@scenario
async def test_a_print_is_held_resumed_and_done(hand: Hands) -> None:
    await hand.print(RING)
    await hand.press("space")
    await hand.until(lambda: hand.printer.state is JobState.HELD)
    await hand.until(lambda: "space resumes" in hand.text("job"))
    await hand.press("left_square_bracket", "left_curly_bracket")
    await hand.until(lambda: "feed  90%  flow  90%" in hand.text("air"))
    await hand.press("0", "space")
    await hand.until(lambda: hand.printer.state is JobState.DONE)
    await hand.until(lambda: "100%" in hand.text("job"))


@scenario
async def test_a_print_is_aborted(hand: Hands) -> None:
    await hand.print(RING)
    await hand.press("f8")
    await hand.until(lambda: hand.printer.state is JobState.STOPPED)


@scenario
async def test_an_emergency_stop_waits_for_the_operator(hand: Hands) -> None:
    await hand.print(RING)
    await hand.press("exclamation_mark")
    await hand.until(lambda: hand.printer.state is JobState.FAULT)
    await hand.press("space")
    await hand.until(lambda: "'hold' is not possible" in hand.messages)
    await hand.press("f9")
    await hand.until(lambda: hand.printer.state is JobState.IDLE)


@scenario
async def test_quitting_while_printing_holds_first(hand: Hands) -> None:
    await hand.print(RING)
    await hand.press("q")
    await hand.until(lambda: "q again leaves it so" in hand.messages)
    assert hand.desk.is_running
    await hand.until(lambda: hand.printer.state is JobState.HELD)


@scenario
async def test_a_file_that_cannot_be_printed_says_why(hand: Hands) -> None:
    await hand.press("f3", *"/nowhere.gcode", "enter")
    await hand.until(lambda: "/nowhere.gcode" in hand.messages and "error" in hand.messages)
    assert hand.printer.state is JobState.IDLE


@scenario
async def test_the_keys_are_shown_and_hidden(hand: Hands) -> None:
    await hand.press("question_mark")
    await hand.until(lambda: len(hand.desk.screen_stack) == 2)
    await hand.pilot.pause()
    table = hand.desk.screen.query_one(Static).region
    assert table.right <= 80
    assert table.bottom <= 24
    await hand.press("right")
    await hand.until(lambda: len(hand.desk.screen_stack) == 1)
    assert place(hand) == [0, 0, 0]


@pytest.mark.parametrize("size", [(80, 24), (160, 50)])
def test_everything_is_on_the_screen(tmp_path: Path, size: tuple[int, int]) -> None:
    async def whole() -> None:
        async with hands(tmp_path, size=size) as hand:
            await hand.until(lambda: len(hand.text("sliders").splitlines()) == 7)
            for name in ("job", "positions", "sliders", "cables", "air", "messages", "typing"):
                area = hand.desk.query_one(f"#{name}").region
                assert area.height > 0
                assert area.bottom <= size[1]
                assert area.right <= size[0]
            for name, lines in (("sliders", 7), ("cables", 10)):
                text = hand.text(name).splitlines()
                assert len(text) == lines
                assert max(map(len, text)) <= hand.desk.query_one(f"#{name}").region.width

    run(whole())


def test_the_clock_and_the_printer_may_outlive_the_screen(tmp_path: Path) -> None:
    """Textual takes the screens away before it stops the timers."""

    async def whole() -> None:
        async with hands(tmp_path) as hand:
            desk = hand.desk
        assert not desk.screen_stack
        desk.say("late")
        desk._refresh()

    run(whole())
