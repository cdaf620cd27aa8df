"""The pages as a browser shows them: on a telephone and a desk, light and dark, on paper, and by keyboard.

Needs Playwright for Python and a Chromium, at `CHROMIUM` or where the system has one; what axe-core says is asked where
`AXE` is the path of its axe.min.js.
"""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_reporting import diagnosis

import jfsm
from jfsm.reporting import render_page

pytestmark = pytest.mark.slow
sync_api = pytest.importorskip("playwright.sync_api", reason="needs pip install playwright")

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
AXE = os.environ.get("AXE")
OPTIONS = (
    "--no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync"
).split()
SCROLLS = ".scroll, .drawing, pre"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("there is no Chromium; say where one is by the variable CHROMIUM")
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield started
        started.close()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    made = {verdict: folder / f"{verdict}.html" for verdict in ("cause", "undecided")}
    for verdict, path in made.items():
        path.write_text(render_page(diagnosis(verdict)), encoding="utf-8")
    t, rng = np.arange(3000) / 100, np.random.default_rng(0)
    x = np.sin(9 * t) + 0.01 * rng.standard_normal(t.size)
    jfsm.Record(time=t, force=np.sin(3 * t), displacement=x).inspect().report(folder / "inspection.html")
    return {**made, "inspection": folder / "inspection.html"}


@pytest.fixture(params=[(390, "light"), (390, "dark"), (1280, "light"), (1280, "dark")], ids=lambda given: str(given))
def window(request: pytest.FixtureRequest, browser: Any) -> Iterator[tuple[Any, list[str]]]:
    """A window, and what its console says."""
    width, scheme = request.param
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("requestfailed", lambda request: said.append(request.url))
    yield page, said
    page.close()


def opened(window: tuple[Any, list[str]], path: Path) -> Any:
    page, _ = window
    page.goto(path.as_uri())
    page.evaluate("document.querySelectorAll('details').forEach(each => each.open = true)")
    return page


@pytest.mark.parametrize("name", ["cause", "undecided", "inspection"])
def test_a_page_says_nothing_on_the_console_and_is_as_wide_as_the_window(window, pages, name):
    page = opened(window, pages[name])
    assert page.evaluate("document.documentElement.scrollWidth") == page.viewport_size["width"]
    assert window[1] == []


@pytest.mark.parametrize("name", ["cause", "undecided", "inspection"])
def test_what_scrolls_is_reached_and_moved_by_the_keyboard(window, pages, name):
    page = opened(window, pages[name])
    wide = f"[...document.querySelectorAll('{SCROLLS}')].filter(each => each.scrollWidth > each.clientWidth + 1)"
    count, reached = page.evaluate(f"{wide}.length"), 0
    for _ in range(100):
        page.keyboard.press("Tab")
        if page.evaluate(f"{wide}.includes(document.activeElement) && document.activeElement.tabIndex === 0"):
            reached += 1
            page.keyboard.press("ArrowRight")
        if page.evaluate("document.activeElement === document.body"):
            break
    assert reached == count
    page.wait_for_function(f"{wide}.every(each => each.scrollLeft > 0)", timeout=5000)


@pytest.mark.skipif(AXE is None, reason="axe-core is not here; say where its axe.min.js is by the variable AXE")
@pytest.mark.parametrize("name", ["cause", "undecided", "inspection"])
def test_axe_finds_nothing_serious(window, pages, name):
    page = opened(window, pages[name])
    page.evaluate(Path(str(AXE)).read_text(encoding="utf-8"))
    found = page.evaluate("axe.run()")["violations"]
    assert [(each["id"], each["nodes"][0]["html"]) for each in found if each["impact"] in ("serious", "critical")] == []


def test_on_paper_nothing_is_cut_off(browser, pages, tmp_path):
    page = browser.new_page(viewport={"width": 688, "height": 970})  # of A4 within its margins
    page.goto(pages["cause"].as_uri())
    page.emulate_media(media="print")
    assert page.evaluate("document.documentElement.scrollWidth") == 688
    assert page.evaluate(f"[...document.querySelectorAll('{SCROLLS}')].every(e => e.scrollWidth <= e.clientWidth + 1)")
    page.pdf(path=tmp_path / "page.pdf", format="A4")
    assert (tmp_path / "page.pdf").stat().st_size > 50_000
    page.close()
