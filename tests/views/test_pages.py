"""Every kind of page in a browser: readable, reachable by keyboard, without messages, and small."""

import re
from pathlib import Path

import pytest

from tests.views import audit, pages
from tests.views.test_report import Reader

pytestmark = pytest.mark.browser
MOST = 2_000_000
"""Bytes of a page."""
SLOW = ("diagnose", "diagnose-nothing", "plan", "reveal", "papers", "run-bodies", "run-lubricated", "sweep-grid")
"""Pages whose results take more than a few seconds."""
NAMES = [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in pages.PAGES]
WINDOWS = [(1400, "light"), (400, "dark")]
WINDOWS += [
    pytest.param(width, scheme, marks=pytest.mark.slow)
    for width in (1400, 800, 400)
    for scheme in ("light", "dark")
    if (width, scheme) not in WINDOWS
]
"""Widths of the window and themes."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pages")


@pytest.fixture
def page(folder, request):
    return pages.make(folder, request.param)


@pytest.mark.parametrize("page", NAMES, indirect=True)
def test_a_page_has_question_answer_provenance_and_terms(page):
    text = page.read_text(encoding="utf-8")
    assert len(text.encode()) <= MOST
    question, answer = (re.search(rf'<p class="{name}">([^<]+)</p>', text)[1] for name in ("question", "verdict"))
    assert question.endswith("?")
    assert answer.rstrip().endswith(".")
    ids = {tag["id"] for tag in Reader(text).tags if "id" in tag}
    links = [tag["href"] for tag in Reader(text).tags if "href" in tag]
    assert {"main", "meaning", "repeat"} <= ids
    assert {link[1:] for link in links if link.startswith("#")} <= ids
    files = [link for link in links if not link.startswith(("#", "https:"))]
    assert all((page.parent / name).exists() for name in files), files
    assert "gears3d 0." in text


@pytest.mark.parametrize("page", NAMES, indirect=True)
@pytest.mark.parametrize(("width", "scheme"), WINDOWS)
def test_a_page_is_readable(chromium, page, width, scheme):
    tab = audit.opened(chromium, page, width, scheme)
    found = audit.faults(tab, width)
    tab.close()
    assert not found, "\n".join(found)


@pytest.mark.parametrize("page", NAMES, indirect=True)
def test_a_page_fits_on_paper(chromium, page):
    """A4 with margins of 10 mm: 718 px; dark pages print light."""
    tab = audit.opened(chromium, page, 718, "dark")
    tab.emulate_media(media="print")
    tab.evaluate("dispatchEvent(new Event('beforeprint'))")
    tab.set_viewport_size({"width": 718, "height": 1000})
    assert tab.evaluate("document.documentElement.scrollWidth") <= 718
    assert tab.evaluate("document.documentElement.dataset.theme") == "light"
    assert tab.locator("nav").is_hidden()
    tab.close()


@pytest.mark.skipif(not audit.axe(), reason="no axe-core (MPL 2.0): npm install axe-core, tools/test does it")
@pytest.mark.parametrize("page", NAMES, indirect=True)
@pytest.mark.parametrize("scheme", ["dark", pytest.param("light", marks=pytest.mark.slow)])
def test_a_page_has_no_serious_barrier(chromium, page, scheme):
    tab = audit.opened(chromium, page, 800, scheme)
    found = [one for one in audit.violations(tab) if one.startswith(("critical", "serious"))]
    tab.close()
    assert not found, "\n".join(found)


@pytest.mark.parametrize("page", ["coastdown"], indirect=True)
def test_a_chart_of_a_result_has_the_points_of_its_picture(chromium, page):
    tab = audit.opened(chromium, page, 1100, "light")
    charts = tab.evaluate("block('charts')")
    sets = [one for chart in charts.values() for one in chart["sets"]]
    assert {one["kind"] for one in sets} == {"band", "line", "dots"}
    band = next(one for one in sets if one["kind"] == "band")
    assert all(low < high for low, high in zip(band["low"], band["y"], strict=True))
    assert tab.locator("canvas").count() == len(charts) == 2
    tab.close()


@pytest.mark.parametrize("page", ["segment"], indirect=True)
def test_terms_are_explained_at_the_keyboard(chromium, page):
    tab = audit.opened(chromium, page, 1100, "light")
    tab.keyboard.press("Tab")
    assert tab.evaluate("document.activeElement.className") == "skip"
    link = tab.locator("a.term").first
    link.focus()
    shown = tab.evaluate("getComputedStyle(document.activeElement, '::after').content")
    assert len(shown) > 20
    tab.keyboard.press("Enter")
    assert tab.evaluate("location.hash").startswith("#term-")
    tab.close()


@pytest.mark.parametrize("page", ["coastdown"], indirect=True)
def test_every_plot_zooms_by_keys_and_its_data_can_be_saved(chromium, page):
    tab = audit.opened(chromium, page, 1100, "light")
    window = "[alone[0].scales.x.min, alone[0].scales.x.max]"
    whole = tab.evaluate(window)
    plot = tab.locator(".plot").first
    plot.press("+")
    zoomed = tab.evaluate(window)
    assert zoomed[1] - zoomed[0] == pytest.approx(0.5 * (whole[1] - whole[0]))
    plot.press("ArrowRight")
    assert tab.evaluate(window)[0] > zoomed[0]
    plot.press("0")
    assert tab.evaluate(window) == pytest.approx(whole)
    with tab.expect_download() as waiting:
        tab.click("#csv-charts")
    lines = Path(waiting.value.path()).read_text(encoding="utf-8").splitlines()
    points = tab.evaluate("Object.values(block('charts')).flatMap((chart) => chart.sets).map((set) => set.x.length)")
    assert len(lines) == 1 + sum(points)
    tab.close()
