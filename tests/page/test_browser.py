"""Pages in a browser: opened from disk, without network, looked at by pixels and driven by hand."""

from __future__ import annotations

import base64
import os
import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from oracle.command import run
from page.making import HOSTILE, PATH, page_of, smoothed

pytestmark = pytest.mark.browser

#: without a graphics card
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")

#: milliseconds for one thing to happen on a busy machine
PATIENCE = 60_000

#: a program with two runs, which is filtered
ZIGZAG = (
    "%\nO1\nG21 G17 G40 G49 G80 G90 G94\nT1 M6\nG54\nS9000 M3\nG43.5 H1\n"
    + "".join(
        f"G0 X0. Y{y}. Z20. I0. J0. K1.\nG0 Z1.\nG1 Z0. F2000.\n"
        + "".join(f"G1 X{x}. Y{y + x % 4}.\n" for x in range(2, 40, 2))
        + "G0 Z20.\n"
        for y in (0, 10)
    )
    + "G49\nM5\nM30\n%\n"
)
FILTER = ("--control", "fanuc", "--limits", "table-ac", "-e", "0.02")

#: where pictures are left
ARTEFACTS = Path(os.environ.get("CORNERSMOOTH_ARTEFACTS", Path(__file__).parents[2] / "build" / "pages"))


@pytest.fixture(scope="module")
def browser() -> Iterator[object]:
    driver = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    names = ("chromium", "chromium-browser", "google-chrome")
    program = next((path for name in names if (path := shutil.which(name))), None)
    if program is None:
        pytest.skip("no Chromium (Debian package chromium)")
    with driver.sync_playwright() as driving:
        started = driving.chromium.launch(executable_path=program, args=list(SOFTWARE), timeout=PATIENCE)
        yield started
        started.close()


class Looked:
    """A page that is open."""

    def __init__(self, browser, path, *, width=1000, height=700, scheme="light"):
        self.errors = []
        size = {"width": width, "height": height}
        self.context = browser.new_context(
            viewport=size, color_scheme=scheme, offline=True, reduced_motion="reduce", has_touch=width < 600
        )
        self.context.set_default_timeout(PATIENCE)
        self.page = self.context.new_page()
        self.page.on("console", lambda told: self.errors.append(told.text) if told.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.requests = []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("html[data-ready=true]")
        self.settle()

    def settle(self):
        """Wait until everything is drawn."""
        self.page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        self.page.wait_for_function("() => cornersmooth.view.pace.still")

    def camera(self):
        return np.array(self.page.evaluate("() => cornersmooth.view.eye.camera.position.toArray()"))

    def tool(self):
        return np.array(self.page.evaluate("() => cornersmooth.view.tool.group.position.toArray()"))

    def check(self):
        """Nothing went wrong in it, and nothing came from elsewhere."""
        assert self.errors == []
        assert [url for url in self.requests if not url.startswith(("file:", "data:", "blob:"))] == []

    def canvas(self):
        """Pixels (h, w, 3) of the view, without what lies over it."""
        self.settle()
        shown = self.page.evaluate(
            """() => new Promise(done => { const canvas = document.createElement("canvas");
            const view = document.getElementById("canvas"); canvas.width = view.width; canvas.height = view.height;
            const pen = canvas.getContext("2d", { willReadFrequently: true });
            cornersmooth.view.draw(0, true); pen.drawImage(view, 0, 0);
            const reader = new FileReader(); reader.onload = () => done([canvas.width, canvas.height,
            reader.result.split(",")[1]]);
            reader.readAsDataURL(new Blob([pen.getImageData(0, 0, canvas.width, canvas.height).data])); })"""
        )
        width, height, data = shown
        return np.frombuffer(base64.b64decode(data), np.uint8).reshape(height, width, 4)[..., :3]

    def keep(self, name):
        ARTEFACTS.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=ARTEFACTS / f"{name}.png")


@pytest.fixture
def look(browser, tmp_path):
    opened = []

    def open_page(text, **how):
        path = tmp_path / f"page{len(opened)}.html"
        path.write_text(text, encoding="utf-8")
        opened.append(Looked(browser, path, **how))
        return opened[-1]

    yield open_page
    for looked in opened:
        looked.context.close()
        looked.check()


@pytest.fixture(scope="module")
def text() -> str:
    return page_of(smoothed())


@pytest.fixture(scope="module")
def opened(browser, text, tmp_path_factory) -> Iterator[Looked]:
    """One page for the tests that leave it as a user would: most of the time of a test is that of its loading."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(text, encoding="utf-8")
    looked = Looked(browser, path)
    yield looked
    looked.context.close()
    looked.check()


@pytest.fixture(scope="module")
def phone(browser, text, tmp_path_factory) -> Iterator[Looked]:
    """The same page on a telephone with a dark ground."""
    path = tmp_path_factory.mktemp("phone") / "page.html"
    path.write_text(text, encoding="utf-8")
    looked = Looked(browser, path, width=390, height=844, scheme="dark")
    yield looked
    looked.context.close()
    looked.check()


@pytest.fixture
def looked(opened: Looked) -> Looked:
    """The page that is opened once, looked at as a whole, from its top, no corner chosen."""
    opened.page.evaluate("() => { scrollTo(0, 0); cornersmooth.corners.selected = -1; }")
    opened.page.locator("#fit").click()
    opened.settle()
    return opened


def colours(pixels):
    """How many colours cover more than a few pixels."""
    coarse = (pixels // 16).astype(np.int64).reshape(-1, 3) @ [256, 16, 1]
    return int((np.bincount(coarse) > 20).sum())


def test_a_page_is_drawn_and_can_be_driven(looked):
    page = looked.page
    first = looked.canvas()
    assert colours(first) > 8
    looked.keep("path")
    # word and sentence are those of the terminal, once
    said = f"{page.inner_text('#badge')}: {page.inner_text('#verdict')}"
    assert said == page.evaluate("() => cornersmooth.meta.verdict")
    assert said.startswith("PASSED, 2 to check: within 0.02 mm everywhere; 1 corner stays sharp")
    head = page.inner_text("header .line >> nth=0").split()
    assert {"part.cls", "fanuc", "g1", "0.02", "10"} <= set(head)
    # the first corner of the list is the sharp one: a click goes there and fills the panel
    before = looked.camera()
    row = page.locator("#list .row").first
    assert row.inner_text().startswith("sharp: reversal")
    row.click()
    looked.settle()
    after = looked.camera()
    assert np.linalg.norm(after - before) > 1.0
    target = np.array(page.evaluate("() => cornersmooth.view.eye.controls.target.toArray()"))
    corner = np.array(page.evaluate("() => Array.from(cornersmooth.arrays.c_tip.subarray(0, 3))"))
    assert np.linalg.norm(target - corner) < 1e-6
    panel = page.inner_text("#panel")
    for word in ("worst corner, sharp: reversal", "CL 12, NC ", "turn", "176"):
        assert word in panel
    # the tool is at the corner, too; the slider takes it away
    assert np.linalg.norm(looked.tool() - corner) < 0.2
    looked.keep("corner")
    page.evaluate(
        "() => { const s = document.getElementById('slider'); s.value = 9000; s.dispatchEvent(new Event('input')); }"
    )
    looked.settle()
    assert np.linalg.norm(looked.tool() - corner) > 5.0
    seconds = float(page.inner_text("#clock").split()[0])
    assert seconds == pytest.approx(0.9 * page.evaluate("() => cornersmooth.meta.seconds"), abs=0.02)
    page.locator("#fit").click()
    looked.settle()
    assert np.linalg.norm(looked.camera() - after) > 1.0
    # every choice of colour looks different, and has its legend
    seen = []
    for option in page.locator("#channel option").all_inner_texts():
        page.select_option("#channel", label=option)
        seen.append(looked.canvas())
        assert option in page.inner_text("#legend")
    assert len(seen) >= 6
    different = [(one != other).any() for one, other in pairwise(seen)]
    assert sum(different) >= len(different) - 1


def test_keys_charts_and_switches(looked):
    page = looked.page
    page.locator("#canvas").focus()
    for key in ("ArrowLeft", "ArrowUp", "+", "-", "f"):
        before = looked.camera()
        page.keyboard.press(key)
        looked.settle()
        assert np.linalg.norm(looked.camera() - before) > 1e-3, key
    target = "() => cornersmooth.view.eye.controls.target.toArray()"
    for key, back in (("Shift+ArrowRight", "Shift+ArrowLeft"), ("Shift+ArrowUp", "Shift+ArrowDown")):
        before, arm = np.array(page.evaluate(target)), looked.camera() - page.evaluate(target)
        page.keyboard.press(key)
        looked.settle()
        moved = np.array(page.evaluate(target))
        assert np.linalg.norm(moved - before) > 1e-2, key
        np.testing.assert_allclose(looked.camera() - moved, arm, atol=1e-6)
        page.keyboard.press(back)
        looked.settle()
        np.testing.assert_allclose(page.evaluate(target), before, atol=1e-6)
    page.keyboard.press("n")
    looked.settle()
    assert "sharp: reversal" in page.inner_text("#panel")
    # over a chart the place is marked in the view; a click sends the tool there
    over = page.locator("#plots .u-over").first
    box = over.bounding_box()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 20)
    page.wait_for_function("() => cornersmooth.view.spot.visible")
    page.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + 20)
    looked.settle()
    way = page.evaluate("() => cornersmooth.meta.way")
    where = page.evaluate(
        "() => cornersmooth.arrays.w_way[cornersmooth.arrays.w_time.findIndex(t => t >= cornersmooth.drive.seconds)]"
    )
    assert where == pytest.approx(0.4 * way, rel=0.1)
    page.locator("[data-scale=time]").click()
    assert page.evaluate("() => cornersmooth.charts.plots[0].data[0].at(-1)") == pytest.approx(
        max(page.evaluate("() => cornersmooth.meta.totals").values()), rel=0.01
    )
    # dragging looks closer in all charts
    box = page.locator("#plots .u-over").first.bounding_box()
    page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 20, steps=5)
    page.mouse.up()
    ranges = page.evaluate("() => cornersmooth.charts.plots.map(p => [p.scales.x.min, p.scales.x.max])")
    assert all(found == pytest.approx(ranges[0]) for found in ranges)
    assert ranges[0][1] - ranges[0][0] < 0.6 * page.evaluate("() => cornersmooth.meta.seconds")
    page.locator("[data-scale=way]").click()
    page.locator("#fit").click()
    looked.settle()
    for name in ("show-written", "show-original", "show-rapids", "show-tool", "show-axes"):
        before = looked.canvas()
        page.locator(f"#{name}").click()
        assert (looked.canvas() != before).any(), name
        page.locator(f"#{name}").click()
    page.keyboard.press("f")
    looked.settle()
    # the tool moves by itself
    page.locator("#play").click()
    before = looked.tool()
    page.wait_for_function("() => Math.abs(cornersmooth.drive.seconds) > 0 && cornersmooth.drive.running")
    page.wait_for_timeout(600)
    page.locator("#play").click()
    assert np.linalg.norm(looked.tool() - before) > 0.0


def test_a_click_on_a_marker_chooses_the_corner(looked):
    x, y = looked.page.evaluate(
        """() => { const { view, arrays } = cornersmooth; const p = view.eye.controls.target.clone();
        p.set(arrays.c_tip[0], arrays.c_tip[1], arrays.c_tip[2]).project(view.eye.camera);
        const box = view.canvas.getBoundingClientRect();
        return [box.x + (0.5 + 0.5 * p.x) * box.width, box.y + (0.5 - 0.5 * p.y) * box.height]; }"""
    )
    looked.page.mouse.click(x + 2, y + 1)
    looked.settle()
    assert "sharp: reversal" in looked.page.inner_text("#panel")


def test_deviations_of_an_axis_with_its_own_tolerance_are_no_millimetres_at_a_point(look):
    """They are drawn as a share of ε, and called so wherever they are named."""
    page = look(page_of(smoothed(axis_tolerance=0.5))).page
    page.evaluate("() => { cornersmooth.corners.select(0); cornersmooth.drive.set(0.5 * cornersmooth.meta.seconds); }")
    named = [
        *page.locator("option").all_inner_texts(),
        *(page.inner_text(f"#{name}") for name in ("panel", "place", "charts")),
    ]
    assert sum("tool axis as a share of ε" in text for text in named) == 4, named
    assert not any(
        words in text for text in named for words in ("off at axis point", "mm, axis point", "of the axis point")
    )


def test_narrow_and_dark_are_usable(phone):
    looked, page = phone, phone.page
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
    pixels = looked.canvas()
    assert pixels[5, 5].max() < 60  # a dark ground
    assert colours(pixels) > 8
    assert page.evaluate("() => getComputedStyle(document.body).backgroundColor") == "rgb(20, 23, 27)"
    for name in ("#problems", "#stage", "#drive", "#panel", "#charts", "#corners"):
        page.locator(name).scroll_into_view_if_needed()
        box = page.locator(name).bounding_box()
        assert box["width"] > 350
        assert box["height"] > 35
    page.locator("#list .row").first.tap()
    looked.settle()
    assert "sharp: reversal" in page.inner_text("#panel")
    page.evaluate("() => scrollTo(0, 0)")
    looked.settle()
    # half of the height is left to scroll by, and fingers need 44 pixels
    assert page.locator("#stage").bounding_box()["height"] <= 0.5 * 844
    page.locator("#tools summary").tap()
    page.locator("#list .row.group").first.tap()
    sizes = page.evaluate(
        """() => Array.from(document.querySelectorAll("button, select, summary, #slider, #tools label"), node =>
        [node.outerHTML.slice(0, 60), node.offsetWidth || 99, node.offsetHeight || 99])"""
    )
    assert len(sizes) > 20
    assert [size for size in sizes if min(size[1:]) < 44] == []
    page.locator("#list .row.group").first.tap()
    page.locator("#tools summary").tap()
    looked.settle()
    looked.keep("narrow-dark")
    page.emulate_media(color_scheme="light")
    looked.settle()
    assert looked.canvas()[5, 5].min() > 200


def test_hostile_names_do_nothing(look):
    made = smoothed(
        name=HOSTILE.replace("{", "{{").replace("}", "}}"), comment=HOSTILE, source=HOSTILE.replace("/", "|") + "\n.cls"
    )
    looked = look(page_of(made))
    page = looked.page
    assert page.title() != "taken"
    assert page.locator("img").count() == 0
    assert page.inner_text("#title").startswith("<|script>")
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 1400


def test_surface_on_a_page(look):
    from cornersmooth.geometry.tool import tools_of
    from cornersmooth.page import read_written, verified_page
    from cornersmooth.surface import measure_surface

    result = smoothed()
    nc = read_written(result)
    tool = tools_of(result.program)[0][1]
    surface = measure_surface(result.program, nc, tool, tolerance=0.02, stations=300)
    looked = look(verified_page(result.program, nc, result.verification, result.report(), surface=surface))
    with_surface = looked.canvas()
    looked.keep("surface")
    assert "overcut" in looked.page.inner_text("#legend")
    table = looked.page.inner_text("#metal table")
    for word in ("overcut", "undercut", "rms", f"{len(surface):,}"):
        assert word in table
    counts = surface.histogram()[1]
    tall = looked.page.evaluate(
        "() => Array.from(document.querySelectorAll('.bars span'), bar => parseFloat(bar.style.height))"
    )
    assert [height > 0.0 for height in tall] == (counts > 0).tolist()
    assert tall[int(counts.argmax())] == 100.0
    looked.page.locator("#show-surface").click()
    assert (looked.canvas() != with_surface).any()
    assert "overcut" not in looked.page.inner_text("#legend")


def test_mouse_turns_and_zooms(looked):
    page = looked.page
    box = page.locator("#canvas").bounding_box()
    before = looked.camera()
    page.mouse.move(box["x"] + 200, box["y"] + 150)
    page.mouse.down()
    page.mouse.move(box["x"] + 320, box["y"] + 190, steps=4)
    page.mouse.up()
    looked.settle()
    assert np.linalg.norm(looked.camera() - before) > 0.1
    before = looked.camera()
    page.mouse.wheel(0, -300)
    page.wait_for_timeout(300)
    looked.settle()
    assert np.linalg.norm(looked.camera() - before) > 0.1


def test_less_is_drawn_while_a_slow_view_turns(looked):
    page = looked.page
    drawn = page.evaluate(
        """() => new Promise(done => { const { view } = cornersmooth; const drawn = []; const draw = view.pace.draw;
        view.pace.level = 2;
        view.pace.draw = (level, still) => { draw(level, still);
          const shown = view.paths.filter(paths => paths && paths.group.visible);
          drawn.push([level, still, shown.length, shown[0] === view.paths[level]]);
          if (still) { view.pace.draw = draw; done(drawn); } };
        view.eye.orbit(0.3, 0, 1); })"""
    )
    assert drawn[0] == [2, False, 1, True]
    assert drawn[-1] == [0, True, 1, True]
    # what has the colours of the whole has them in the rough, too
    page.evaluate("() => { cornersmooth.view.draw(2, false); }")
    page.select_option("#channel", label="corner status")
    looked.settle()
    same = page.evaluate(
        """() => { const of = level => new Set(Array.from(
          cornersmooth.view.paths[level].ribs.geometry.getAttribute("color").array, value => value.toFixed(4)));
        const whole = of(0); return [...of(2)].every(value => whole.has(value)); }"""
    )
    assert same


def test_slow_pictures_make_the_view_coarser(looked):
    levels = looked.page.evaluate(
        """() => { const { pace } = cornersmooth.view; const levels = []; pace.level = 0; pace.last = 0; pace.gaps = [];
        let now = 1e6; for (let i = 0; i < 12; i++) { pace.judge(now += 10); levels.push(pace.level); }
        for (let i = 0; i < 24; i++) { pace.judge(now += 100); levels.push(pace.level); } pace.level = 0;
        return levels; }"""
    )
    assert levels[:12] == [0] * 12
    assert levels[-1] == 2
    assert sorted(levels) == levels


def test_lines_near_a_place_of_a_long_path_are_wide(looked):
    page = looked.page
    page.locator("#list .row.group").first.click()
    page.locator("#list .row:not(.group)").last.click()  # a rounded corner: at one that is passed exactly all is seen
    looked.settle()
    page.evaluate("() => cornersmooth.view.lookNear()")
    near, far = page.evaluate(
        """() => { const { view, arrays } = cornersmooth; const tip = arrays.w_tip; const at = view.eye.controls.target;
        const off = i => Math.hypot(tip[3 * i] - at.x, tip[3 * i + 1] - at.y, tip[3 * i + 2] - at.z);
        const near = new Set(view.near.segments); let far = 0;
        for (let i = 0; i < tip.length / 3; i++)
          if (!arrays.w_rapid[i] && off(i) < 2 * view.eye.distance && !near.has(i)) far++;
        return [near.size, far]; }"""
    )
    assert 1 < near < 200
    assert far == 0
    assert page.evaluate("() => cornersmooth.view.near.original.geometry.type") == "LineSegmentsGeometry"


def test_corners_are_grouped_by_kind_and_amount(look):
    """18 right angles that are alike and a reversal: the sharp one first, and one row for the others."""
    points = [(2.0 * k, 2.0 * (k % 2)) for k in range(20)] + [(36.0, 0.1)]
    path = "TOOL PATH/{name},TOOL,T\n$$ {comment}\nFEDRAT/MMPM,1500.0\n"
    path += "".join(f"GOTO/{x},{y},0.0,0.0,0.0,1.0\n" for x, y in points) + "END-OF-PATH\n"
    looked = look(page_of(smoothed(path)))
    page = looked.page
    rows = page.locator("#list .row")
    assert rows.count() == 2
    assert rows.first.inner_text().startswith("sharp: reversal")
    groups = page.locator("#list .row.group")
    name, count, turn, off = groups.first.locator("> span").all_inner_texts()
    assert (name.split(":")[0], count, turn) == ("rounded", "18 ×", "90°")
    largest = page.evaluate(
        "() => Math.max(...cornersmooth.arrays.c_off.slice(1), ...cornersmooth.arrays.c_axis_off.slice(1))"
    )
    assert off == f"≤ {largest:.4f}"
    assert page.inner_text("#corners h2") == "19 corners"
    # an open group has its corners, and keys step through all of them in order
    groups.first.click()
    assert groups.first.get_attribute("aria-expanded") == "true"
    assert page.locator("#list .row:not(.group)").count() == 1 + 18
    groups.first.click()
    assert rows.count() == 2
    chosen = "() => cornersmooth.corners.selected"
    page.locator("#list").focus()
    for key, place in (("ArrowDown", 1), ("ArrowDown", 2), ("ArrowUp", 1), ("n", 2), ("p", 1), ("PageDown", 11)):
        page.keyboard.press(key)
        assert page.evaluate(chosen) == place, key
    assert page.locator("#list .row[aria-pressed=true]").count() == 1
    # settings, versions and notes are behind a fold
    page.locator("#about summary").click()
    assert "cornersmooth" in page.inner_text("#facts")


@pytest.fixture(scope="module")
def wrong(tmp_path_factory) -> tuple[str, int, int]:
    """Page of a program with a vertex moved by 0.3 mm and, later, another feed; the lines of both."""
    folder = tmp_path_factory.mktemp("wrong")
    source, nc, page = folder / "part.cls", folder / "part.nc", folder / "wrong.html"
    source.write_text(PATH.format(name="PART", comment="none"))
    assert run("smooth", source, "-e", "0.02", "-o", nc, "-q").returncode == 0
    lines = nc.read_text().splitlines()
    moved = next(k for k, line in enumerate(lines) if "Y15.0000" in line)
    lines[moved] = lines[moved].replace("Y15.0000", "Y15.3000")
    last = max(k for k, line in enumerate(lines) if line.startswith("G1"))
    lines[last] += " F1900."
    nc.write_text("\n".join(lines) + "\n")
    assert run("verify", source, nc, "-e", "0.02", "--report", page).returncode == 1
    return page.read_text(), moved + 1, last + 1


def test_the_first_problem_is_open_and_looked_at(look, wrong):
    text, moved, last = wrong
    looked = look(text, width=1400, height=900)
    page = looked.page
    assert page.inner_text("#badge") == "FAILED"
    assert page.inner_text("#title") == "part.nc"
    problems = page.evaluate("() => cornersmooth.meta.problems")
    wrong_ones = [problem["nc_line"] for problem in problems if problem["severity"] == "error"]
    assert wrong_ones[0] == moved
    assert last in wrong_ones
    assert wrong_ones == sorted(wrong_ones)
    assert [problem["severity"] for problem in problems] == ["error"] * len(wrong_ones) + ["warning"] * (
        len(problems) - len(wrong_ones)
    )
    # they are in sight, above the corners, and the first is chosen
    buttons = page.locator("#problems button")
    assert f"NC line {moved}" in buttons.first.inner_text()
    assert [node.get_attribute("aria-pressed") for node in buttons.all()] == ["true"] + ["false"] * (len(problems) - 1)
    first, corners = page.locator("#problems").bounding_box(), page.locator("#corners").bounding_box()
    assert 0 <= first["y"] < corners["y"]
    assert (
        page.evaluate(
            "() => { const box = document.getElementById('problems'); return box.scrollHeight - box.clientHeight; }"
        )
        <= 0
    )
    # the view is there, so is the tool; both paths are drawn enlarged, what is off in its own colour
    target = np.array(page.evaluate("() => cornersmooth.view.eye.controls.target.toArray()"))
    centre = np.array(page.evaluate("() => cornersmooth.meta.centre"))
    assert abs((target + centre)[1] - 15.3) < 0.02
    assert np.linalg.norm(looked.tool() - target) < 1e-3
    assert np.linalg.norm(looked.camera() - target) < 5.0
    assert "L" in page.get_attribute("#panel .out", "d")
    assert page.locator("#chart option:checked").inner_text() == "deviation"
    looked.keep("wrong")
    # another one is a click away
    buttons.nth(wrong_ones.index(last)).click()
    looked.settle()
    assert f"NC line {last}" in page.inner_text("#panel h2")
    assert np.linalg.norm(page.evaluate("() => cornersmooth.view.eye.controls.target.toArray()") - target) > 1.0


def test_the_view_is_most_of_a_wide_window_and_the_part_fills_it(look, text):
    looked = look(text, width=1400, height=900)
    box = looked.page.locator("#stage").bounding_box()
    assert box["width"] * box["height"] > 0.4 * 1400 * 900
    assert looked.page.evaluate("() => document.documentElement.scrollHeight") <= 900
    pixels = looked.canvas().astype(int)
    drawn = np.abs(pixels - pixels[-3, -3]).max(axis=2) > 24
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    shares = (np.ptp(rows) / pixels.shape[0], np.ptp(columns) / pixels.shape[1])
    assert max(shares) > 0.75
    # nothing is wrong: the worst corner is marked in the whole and enlarged beside it
    corner = np.array(looked.page.evaluate("() => Array.from(cornersmooth.arrays.c_tip.subarray(0, 3))"))
    ring = "() => Array.from(cornersmooth.view.ring.geometry.getAttribute('position').array)"
    np.testing.assert_allclose(looked.page.evaluate(ring), corner, atol=1e-6)
    assert "worst corner" in looked.page.inner_text("#panel")
    assert looked.page.get_attribute("#panel .before", "d").count("L") >= 1


def test_charts_before_and_after_are_beside_each_other_with_the_time_saved(look, text):
    page = look(text, width=1400, height=900).page
    plots = page.evaluate(
        """() => cornersmooth.charts.plots.map(plot => { const box = plot.root.getBoundingClientRect();
        const title = plot.root.querySelector(".u-title").textContent;
        return [title, box.left, box.top, box.bottom, plot.scales.y.max]; })"""
    )
    assert [title.split(",")[0] for title, *_ in plots] == [
        "speed of the tip before",
        "speed of the tip after",
        "seconds saved so far",
    ]
    assert plots[0][1] < plots[1][1] < plots[2][1]
    assert plots[0][2] == plots[1][2] == plots[2][2]
    assert plots[0][4] == plots[1][4]  # one scale
    assert all(180 < bottom - top < 300 and bottom <= 900 for _, _, top, bottom, _ in plots)


def test_a_filtered_program_shows_its_runs(look, tmp_path):
    source, page = tmp_path / "old.nc", tmp_path / "runs.html"
    source.write_text(ZIGZAG)
    done = run("filter", source, "-o", tmp_path / "new.nc", *FILTER, "--report", page)
    assert done.returncode == 0, done.stderr
    looked = look(page.read_text(encoding="utf-8"))
    rows = looked.page.locator("#list .row")
    runs = looked.page.evaluate("() => cornersmooth.meta.runs")
    assert looked.page.inner_text("#corners h2").startswith("2 runs smoothed")
    assert rows.count() == len(runs) == 2
    assert runs[0]["first"] < runs[0]["last"] < runs[1]["first"]
    for row, own in zip(rows.all(), runs, strict=True):
        assert f"{own['first']}–{own['last']}" in row.inner_text()
        assert own["before"] > own["after"] > 0.0
        assert 0.0 < own["off"] <= 0.02
    assert " s instead of " in looked.page.inner_text("#verdict")
    # a click goes there, with both paths in one picture, and the charts look at the run
    rows.nth(1).click()
    looked.settle()
    assert "run 2" in looked.page.inner_text("#panel")
    assert looked.page.get_attribute("#panel .before", "d").count("L") >= 1
    low, high = looked.page.evaluate(
        "() => { const { min, max } = cornersmooth.charts.plots[0].scales.x; return [min, max]; }"
    )
    assert (low, high) == pytest.approx(tuple(runs[1]["way"]))
    looked.keep("runs")


def test_paper_has_everything_in_sight_and_a_photograph_of_the_view(look, wrong):
    looked = look(wrong[0], scheme="dark")
    page = looked.page
    looked.settle()
    printed = page.pdf(format="A4")
    assert 1 <= printed.count(b"/Type /Page\n") + printed.count(b"/Type /Page ") + printed.count(b"/Type /Page/") <= 4
    photo = page.evaluate(
        """() => { const photo = document.getElementById("photo"); const { width, height } = photo;
        const pixels = photo.getContext("2d").getImageData(0, 0, width, height).data;
        return [width, height, pixels[0], new Set(pixels).size]; }"""
    )
    assert photo[0] > 300
    assert photo[2] > 200  # paper is white, though the screen is dark
    assert photo[3] > 20
    assert page.evaluate("() => document.documentElement.className") == ""
    page.emulate_media(media="print")
    shown = page.evaluate(
        """() => Object.fromEntries(["problems", "photo", "panel", "list", "tools", "drive", "canvas"].map(id =>
        [id, document.getElementById(id).offsetHeight > 0]))"""
    )
    assert [name for name, there in shown.items() if there] == ["problems", "photo", "panel", "list"]
    page.evaluate("() => dispatchEvent(new Event('beforeprint'))")
    charts = page.evaluate("() => cornersmooth.charts.plots.map(plot => plot.root.offsetHeight)")
    assert len(charts) == 4  # the deviation, the tip's speed before and after, the time saved
    assert min(charts) > 80
    page.evaluate("() => dispatchEvent(new Event('afterprint'))")
    assert page.evaluate("() => getComputedStyle(document.querySelector('.problem')).breakInside") == "avoid"


def test_pace_of_the_drive(looked):
    page = looked.page
    gone = []
    for pace in ("0.1", "5"):
        page.select_option("#pace", pace)
        gone.append(
            page.evaluate(
                """() => new Promise(done => { const { drive } = cornersmooth; drive.set(0, "test"); drive.play(true);
                const began = performance.now();
                const look = () => { const passed = (performance.now() - began) / 1000;
                if (passed < 0.3) return requestAnimationFrame(look);
                const ratio = drive.seconds / passed; drive.play(false); done(ratio); };
                requestAnimationFrame(look); })"""
            )
        )
    assert gone[0] < 0.3 < 1.0 < gone[1]


def test_two_fingers_zoom_and_move(phone):
    page, before = phone.page, phone.camera()
    page.evaluate(
        """() => { const canvas = document.getElementById("canvas"); const box = canvas.getBoundingClientRect();
        canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
        const tell = (type, id, x, y) => canvas.dispatchEvent(new PointerEvent(type, { pointerId: id, bubbles: true,
          pointerType: "touch", clientX: box.x + x, clientY: box.y + y, isPrimary: id === 1 }));
        tell("pointerdown", 1, 100, 100); tell("pointerdown", 2, 160, 100);
        for (let k = 1; k < 6; k++) {
          tell("pointermove", 1, 100 - 8 * k, 100); tell("pointermove", 2, 160 + 8 * k, 100); }
        tell("pointerup", 1, 60, 100); tell("pointerup", 2, 200, 100); }"""
    )
    phone.settle()
    assert np.linalg.norm(phone.camera() - before) > 0.1


def test_numbers_are_written_for_people(looked):
    page = looked.page
    told = page.evaluate(
        """() => { const { drive, meta, arrays } = cornersmooth; const whole = meta.seconds; const said = [];
        for (const seconds of [59.994, 599.99, 600, 20495.23]) { meta.seconds = seconds; drive.set(seconds, "test");
          said.push(document.getElementById("clock").textContent); } meta.seconds = whole; drive.set(0, "test");
        return said; }"""
    )
    assert told == [
        "59.99 s of 59.99 s",
        "599.99 s of 599.99 s",
        "0:10:00 h of 0:10:00 h",
        "5:41:35 h of 5:41:35 h",
    ]
    assert "e-" not in page.inner_text("#plots")
