"""The report in a real browser, opened as a file: it draws, answers, prints, and asks for nothing."""

from pathlib import Path

import pytest

from gears3d.runs import summarise
from gears3d.scenario import load
from gears3d.simulation import simulate
from gears3d.views.camera import camera
from gears3d.views.pages.engine import Picture
from gears3d.views.pages.run import write

pytestmark = pytest.mark.browser

SCENARIO = Path(__file__).resolve().parents[2] / "scenarios/rigaud-2020/fig5-20rpm.toml"
PLOTS = ("displacement", "velocity", "speed", "section", "histogram", "errors")
INKED = """(id) => {
  const canvas = document.querySelector(`#plot-${id} canvas`), c = canvas.getContext("2d");
  const d = c.getImageData(0, 0, canvas.width, canvas.height).data, seen = new Set();
  for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 200) seen.add(d[i] + "," + d[i + 1] + "," + d[i + 2]);
  return [...seen];
}"""


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    scenario = load(SCENARIO).with_({"run.duration": "2 s"})
    recording = simulate(scenario.with_({"impact.restitution": 0.301}), "rigid")
    twin = simulate(scenario, "rigid")
    summary = summarise(scenario, recording, {"mode": "trajectory", "flight_height_min_m": 5e-8})
    return write(
        tmp_path_factory.mktemp("report") / "report.html",
        scenario=scenario,
        recording=recording,
        twin=twin,
        summary=summary,
        strip=Picture(camera(recording, scenario).svg(), "the teeth in mesh", "over a period"),
    )


@pytest.fixture
def page(request, chromium, report):
    scheme = getattr(request, "param", "light")
    page = chromium.new_page(viewport={"width": 1100, "height": 900}, color_scheme=scheme)
    page.said, page.asked, page.scheme = [], [], scheme
    page.on("console", lambda message: page.said.append(message.text))
    page.on("pageerror", lambda error: page.said.append(str(error)))
    page.on("request", lambda sent: page.asked.append(sent.url))
    page.goto(report.as_uri())
    yield page
    assert page.said == []
    assert page.asked == [report.as_uri()]
    page.close()


@pytest.mark.parametrize("page", ["light", "dark"], indirect=True)
def test_pictures_of_the_mesh_are_seen(page):
    image = page.get_by_alt_text("the teeth in mesh")
    image.scroll_into_view_if_needed()
    width, height = image.evaluate("image => [image.naturalWidth, image.naturalHeight]")
    box = image.bounding_box()
    assert width > 1000
    assert box["width"] / box["height"] == pytest.approx(width / height, rel=0.01)
    assert box["width"] > 700


def area(page, name):
    """Where the plot's field is on the screen."""
    field = page.locator(f"#plot-{name} .u-over")
    field.scroll_into_view_if_needed()
    return field.bounding_box()


def window(page):
    return page.evaluate("time.plots.map((p) => [p.scales.x.min, p.scales.x.max])")


@pytest.mark.parametrize("page", ["light", "dark"], indirect=True)
def test_every_plot_is_drawn_in_the_reader_s_theme(page):
    assert page.evaluate("document.documentElement.dataset.theme") == page.scheme
    light = page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert light == (page.scheme == "light")
    for name in PLOTS:
        colours = page.evaluate(INKED, name)
        assert len(colours) > 20, name
        if name != "speed":
            assert {"0,114,178", "213,94,0"} <= set(colours), name


def test_the_theme_can_be_switched(page):
    before = page.evaluate(INKED, "displacement")
    page.click("#theme")
    assert page.evaluate("document.documentElement.dataset.theme") != page.scheme
    assert page.evaluate(INKED, "displacement") != before


def test_zoom_is_shared_and_taken_back(page):
    whole = window(page)
    assert whole == [[0, 2]] * 3
    box = area(page, "velocity")
    page.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 52, steps=4)
    page.mouse.up()
    zoomed = window(page)
    assert zoomed[0] == zoomed[1] == zoomed[2] == pytest.approx([0.5, 1.0], abs=0.01)
    page.mouse.dblclick(box["x"] + 0.5 * box["width"], box["y"] + 50)
    assert window(page) == whole


def test_the_cursor_is_shared_and_reads_values(page):
    box = area(page, "displacement")
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 60)
    values = page.locator("#plot-velocity .u-value").all_inner_texts()
    assert float(values[0].split()[0]) == pytest.approx(1.2, abs=0.003)
    assert values[1].endswith("mm/s")


def test_impacts_can_be_walked_through(page):
    times = page.evaluate("DATA.impacts.time")
    page.click("[data-zoom=next]")
    page.click("[data-zoom=next]")
    (low, high), *_ = window(page)
    assert (low + high) / 2 == pytest.approx(times[1], abs=1e-9)
    page.click("[data-zoom=previous]")
    (low, high), *_ = window(page)
    assert (low + high) / 2 == pytest.approx(times[0], abs=1e-9)
    page.locator("#plot-speed").press("0")
    assert window(page)[0] == [0, 2]


def test_impacts_can_be_saved(page, report):
    with page.expect_download() as waiting:
        page.click("#csv")
    page.asked[:] = [report.as_uri()]  # the blob that the page itself made
    lines = Path(waiting.value.path()).read_text().splitlines()
    assert lines[0].startswith("time_s,flank,velocity_m_s,rebound_m_s")
    assert len(lines) == 1 + len(page.evaluate("DATA.impacts.time"))
