"""The page in a real browser: it draws, answers to hands and keys, and talks to nobody."""

import io
import shutil

import pytest

from cdhr_host.pipeline import open_profile, prove
from cdhr_host.report.page import Trail, write_page

playwright = pytest.importorskip("playwright.sync_api", reason="the browser's driver is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
TEXT = (
    b"M83\n;LAYER:0\nG1 Z2 F1200\nG1 X150 E500\nG1 X260 E300\nG1 Y100 E300\nG1 X0 E600\nG1 Y0 E200\n"
    b";LAYER:1\nG1 Z6\nG1 X100 F600 E400\nG1 Y80 F1800 E300\nG1 X0 E300\n"
)


AT_REST = """() => {
  const frames = () => document.documentElement.dataset.frames, was = frames();
  return new Promise((done) => setTimeout(() => done(was !== undefined && frames() === was), 400));
}"""
ON_SCREEN = """(place) => {
  const { matrix } = window.cdhr, { clientWidth, clientHeight } = document.getElementById("scene");
  const row = (k) => [...place, 1].reduce((sum, each, axis) => sum + matrix[4 * axis + k] * each, 0);
  return [(row(0) / row(3) + 1) * clientWidth / 2, (1 - row(1) / row(3)) * clientHeight / 2];
}"""
BLIND = """(() => {
  const prototype = HTMLCanvasElement.prototype, before = prototype.getContext;
  prototype.getContext = function (kind, ...rest) {
    return kind.startsWith("webgl") ? null : before.call(this, kind, ...rest);
  };
})();"""


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "part.html"
    profile = open_profile("paper")
    trail = Trail(profile)
    proof = prove([TEXT], profile, watch=trail.watch)
    assert not proof.ok
    write_page(path, trail, profile, proof, ("part.gcode", "paper"))
    return path.as_uri()


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def opened(browser, address):
    """A function that opens the page; at the end nothing may have been complained of or asked for."""
    said, asked, contexts = [], [], []

    def open_page(width=1280, height=800, scripts="", **settings):
        context = browser.new_context(viewport={"width": width, "height": height}, **settings)
        contexts.append(context)
        page = context.new_page()
        page.add_init_script(scripts)
        page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(address)
        page.wait_for_selector("html[data-ready=yes]")
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert said == []
    assert set(asked) == {address}


def seen(page):
    """Pixels of the view, (H, W, 3), once it has come to rest."""
    page.wait_for_function(AT_REST)
    image = pytest.importorskip("matplotlib.image").imread(
        io.BytesIO(page.locator("#scene").screenshot()), "png"
    )
    return image[..., :3]


def coloured(pixels):
    return int((pixels.max(axis=2) - pixels.min(axis=2) > 0.15).sum())


def test_the_path_is_drawn_and_every_colour_is_another_picture(opened):
    page = opened()
    pictures = {}
    for quantity in ("speed", "margin", "pressure", "layer"):
        page.locator(f"#colours label:has(input[value={quantity}])").click()
        pictures[quantity] = seen(page)
        assert coloured(pictures[quantity]) > 3000
    for name in ("margin", "pressure", "layer"):
        assert (abs(pictures[name] - pictures["speed"]).max(axis=2) > 0.1).sum() > 1000
    page.locator("#colours label:has(input[value=margin])").click()
    assert page.locator("#legend-outside").is_visible()


def test_a_problem_takes_the_camera_there(opened):
    page = opened()
    before = page.evaluate("() => window.cdhr.camera.target")
    page.locator("#problems li button").first.click()
    page.wait_for_function(
        "() => cdhr.camera.target.every((each, k) => Math.abs(each - cdhr.pins[0].at[k]) < 1e-6)"
    )
    assert page.evaluate("() => window.cdhr.camera.target") != before
    box, view = page.locator(".pin.chosen").bounding_box(), page.locator("#scene").bounding_box()
    assert box["x"] + box["width"] / 2 == pytest.approx(view["x"] + view["width"] / 2, abs=3)
    assert box["y"] + box["height"] / 2 == pytest.approx(view["y"] + view["height"] / 2, abs=3)


def test_hands_and_keys_turn_move_and_zoom(opened):
    page = opened()
    state = "() => [window.cdhr.camera.yaw, window.cdhr.camera.distance, window.cdhr.camera.target[0]]"
    yaw, distance, target = page.evaluate(state)
    page.mouse.move(300, 300)
    page.mouse.down()
    page.mouse.move(400, 320, steps=4)
    page.mouse.up()
    page.mouse.wheel(0, -240)
    page.wait_for_function(f"() => window.cdhr.camera.distance < {distance}")
    turned, _, still = page.evaluate(state)
    assert turned != yaw
    assert still == target
    page.locator("#scene").focus()
    page.keyboard.press("Shift+ArrowRight")
    assert page.evaluate(state)[2] != target
    page.keyboard.press("Home")
    assert page.evaluate(state) == [yaw, pytest.approx(distance), pytest.approx(target)]


def test_the_slider_takes_layers_away(opened):
    page = opened()
    whole = coloured(seen(page))
    page.locator("#slider").fill("0")
    assert "layer 1," in page.locator("#slider-text").inner_text()
    assert coloured(seen(page)) < whole
    page.locator("#times tbody tr").last.click()
    assert page.locator("#slider").input_value() == "1"


def test_a_click_on_the_path_reads_its_numbers(opened):
    page = opened()
    page.locator("button[data-view=top]").click()
    seen(page)
    x, y = page.evaluate(ON_SCREEN, [200.0, 0.0, 2.0])
    page.locator("#scene").click(position={"x": x, "y": y})
    words = page.locator("#readout").inner_text()
    assert words.startswith("line 5 ")
    assert float(words.split("x ")[1].split()[0]) == pytest.approx(200, abs=2)
    assert "20.0 mm/s" in words
    page.locator("#scene").click(position={"x": 20, "y": 400})
    assert not page.locator("#readout").is_visible()


def test_a_phone_in_the_dark_shows_it_too(opened):
    page = opened(360, 740, color_scheme="dark", has_touch=True)
    pixels = seen(page)
    assert pixels[5, 5].max() < 0.3
    assert coloured(pixels) > 1000
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 360
    page.locator("#theme").click()
    assert seen(page)[5, 5].min() > 0.7


def test_without_webgl_it_is_drawn_flat_and_says_so(opened):
    page = opened(scripts=BLIND)
    assert "WebGL" in page.locator("#message").inner_text()
    assert coloured(seen(page)) > 500
