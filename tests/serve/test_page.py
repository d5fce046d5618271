"""Our own page in a real browser."""

import asyncio
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, Page, opened
from clients import ROOT, served
from doors import Open, with_doors

from cdhr_host.job.surface import JobState

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: apt-get install chromium")
PROGRAM = b"G1 X1 F600\nG1 X2\n" * 40
PICTURES = os.environ.get("CDHR_PICTURES")


def printing(door: Open) -> None:
    """A print half done, one cable outside its window."""
    surface = door.surface
    surface.advance(0)
    surface.advance(33)
    tension = np.array([2.9, 2.0, 1.9, 2.3, 2.3, 0.3, 9.0, 7.6, 9.7])
    window = np.array([[0.5, 10.0]] * 6 + [[5.0, 12.0]] * 3)
    surface._status = replace(
        surface._status,
        tension=tension, window=window, pressure=118e3, pressure_setpoint=131e3, flow=223e-9,
        nozzle_G=np.array([0.08, -0.11, 0.24]), force=np.array([4.9, 4.2, 2.7]),
    )  # fmt: skip


async def start(door: Open, page: Page) -> None:
    await page.until("by('state').textContent === 'idle'")
    form = "new FormData()"
    code = (
        f"(() => {{ const body = {form}; body.append('print', 'true');"
        f"body.append('file', new File([{PROGRAM.decode()!r}], 'vase.gcode'));"
        "return fetch('/server/files/upload', {method: 'POST', body}).then((answer) => answer.status); })()"
    )
    pending = asyncio.ensure_future(page.eval(code))
    while door.surface.status().state is not JobState.PROVING:
        await asyncio.sleep(0.01)
    door.surface.advance(0)
    assert await pending == 201
    printing(door)


@pytest.mark.parametrize(("width", "height"), [(360, 740), (1280, 800)])
def test_a_print_is_shown_and_held(tmp_path: Path, width: int, height: int) -> None:
    async def act(door: Open) -> None:
        async with opened(f"{door.url}/", tmp_path / "browser") as page:
            await page.size(width, height)
            await start(door, page)
            await page.until("by('percent').textContent.startsWith('41')")
            assert await page.eval("by('layer').textContent") == "1 of 2"
            assert await page.eval("document.querySelectorAll('#cables li').length") == 9
            assert await page.eval("document.querySelectorAll('#cables li.out').length") == 1
            assert await page.eval("by('pressure').textContent") == "118.0 kPa"
            assert await page.eval("document.documentElement.scrollWidth") <= width
            door.server.host.say("layer 1 of 2")
            await page.until("by('messages').textContent.includes('layer 1 of 2')")
            bottom = await page.eval("by('line').getBoundingClientRect().bottom")
            assert width < 500 or bottom <= height
            await page.eval("Promise.all(document.getAnimations().map((bar) => bar.finished)).then(() => 1)")
            if PICTURES:
                await page.picture(Path(PICTURES) / f"page-{width}.png", whole=width < 500)
            await page.eval("by('hold').click()")
            await page.until("by('state').textContent.startsWith('held')")
            assert await page.eval("by('hold').disabled && !by('resume').disabled")
            await page.eval("by('resume').click()")
            await page.until("by('state').textContent === 'printing'")
            await page.eval("by('cancel').click()")
            assert door.surface.status().state is JobState.PRINTING
            await page.eval("by('cancel').click()")
            await page.until("by('state').textContent.startsWith('stopped')")
            assert not page.said

    with_doors(act, tmp_path)


def test_the_emergency_stop_is_always_in_sight_and_on_a_key(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        async with opened(f"{door.url}/", tmp_path / "browser") as page:
            await page.size(360, 740)
            await start(door, page)
            await page.eval("window.scrollTo(0, document.body.scrollHeight)")
            box = await page.eval("(({top, bottom}) => [top, bottom])(by('stop').getBoundingClientRect())")
            assert 0 <= box[0] < box[1] <= 740
            await page.press("Escape")
            await page.until("!by('halt').hidden")
            assert door.surface.said[-1][0] == "stop"
            await page.eval("by('acknowledge').click()")
            await page.until("by('halt').hidden")

    with_doors(act, tmp_path)


def test_a_feed_factor_is_set_by_keys(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        async with opened(f"{door.url}/", tmp_path / "browser") as page:
            await page.until("by('state').textContent === 'idle'")
            await page.eval("by('feed').focus()")
            for _ in range(4):
                await page.call(
                    "Input.dispatchKeyEvent",
                    type="keyDown",
                    key="ArrowLeft",
                    code="ArrowLeft",
                    windowsVirtualKeyCode=37,
                )
            await page.until("by('feed-shown').textContent === '80 %'")
            while door.surface.status().feed_override != 0.8:
                await asyncio.sleep(0.01)

    with_doors(act, tmp_path)


def test_everything_has_a_name_for_a_screen_reader(tmp_path: Path) -> None:
    async def act(door: Open) -> None:
        async with opened(f"{door.url}/", tmp_path / "browser") as page:
            await page.until("by('state').textContent === 'idle'")
            await page.call("Accessibility.enable")
            tree = (await page.call("Accessibility.getFullAXTree"))["nodes"]
            controls = {"button", "slider", "textbox", "meter", "progressbar", "log", "list"}
            found = [node for node in tree if node.get("role", {}).get("value") in controls]
            bare = [
                node["role"]["value"]
                for node in found
                if not node.get("name", {}).get("value") and not node["ignored"]
            ]
            assert len(found) > 20
            assert bare == []
            live = "document.querySelectorAll('[aria-live], [role=alert], [role=log]').length"
            assert await page.eval(live) >= 4

    with_doors(act, tmp_path)


def test_the_page_prints_on_the_simulated_machine(tmp_path: Path) -> None:
    program = (ROOT / "gcode" / "paper_ring_double.gcode").read_text()

    async def act(url: str) -> None:
        async with opened(url, tmp_path / "browser") as page:
            await page.until("by('state').textContent === 'idle'")
            code = (
                "const body = new FormData(); body.append('print', 'true');"
                f"body.append('file', new File([{program!r}], 'ring.gcode'));"
                "fetch('/server/files/upload', {method: 'POST', body}); 1"
            )
            assert await page.eval(code) == 1
            await page.until("by('state').textContent.startsWith('printing')", 60.0)
            await page.until("parseFloat(by('percent').textContent) > 20 && seen.air.pressure_kpa > 60", 60.0)
            assert await page.eval("document.querySelectorAll('#cables li.out').length") == 0
            await page.until("by('state').textContent.startsWith('done')", 90.0)
            assert await page.eval("by('percent').textContent") == "100.0 %"
            assert await page.eval("by('taken').hidden") is False

    with served(tmp_path) as doors:
        asyncio.run(act(doors["http"]))
