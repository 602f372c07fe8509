"""The report of a measured record tells what was measured, follows the readings, and needs nothing else."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from gears3d.measured import segmentation
from gears3d.measured.checks import Finding
from gears3d.scenario import load
from gears3d.signals.orders import each_alone
from gears3d.simulation import record
from gears3d.views.camera import camera
from gears3d.views.pages.engine import DOCS, Picture
from gears3d.views.pages.measured import (
    DEVIATIONS,
    FINE,
    RIDGE,
    close_up,
    duration_lines,
    durations,
    orders_told,
    path_lines,
    render,
    write,
)
from tests.views.test_report import SCENARIO, Reader

FOUND = (
    Finding("skew", "theta_loose_rad", 2e-4, "s", "the loose gear is read later", correctable=True, corrected=True),
    Finding("wave", "theta_drive_rad", 1.8e-5, "m", "the flank waves <b>", "turn an encoder on its shaft"),
)
WAVE = {"kind": "transmission_error", "order": 1, "amplitude": "20 um", "phase": "30 deg"}
SECTIONS = ("trust", "motion", "impacts", "flights", "flanks", "limits", "data")
PLOTS = ("displacement", "close", "speed", "section", "rebound", "height", "deceleration", "chi", "orders-drive")


def measured(changes, findings=()):
    rig = load(SCENARIO, changes)
    found = segmentation.measure(record(rig), rig, "bench.parquet")
    found.summary["quality"]["findings"] = [one.to_dict() for one in findings]
    found.summary.update(file="bench.parquet", durations=durations(found), contact_orders=orders_told(found))
    return found


@pytest.fixture(scope="module")
def found():
    changes = {"run.duration": "4 s", "effect": [WAVE], "sensors.loose.noise": "2e-6 rad", "impact.restitution": 0.4}
    return measured({**changes, "sensors.sample_rate": "20 kHz"}, FOUND)


@pytest.fixture(scope="module")
def page(found):
    return render(found, ("impacts.parquet", "signals.parquet"))


def test_pictures_of_the_mesh_come_with_words(found):
    taken = camera(found, load(SCENARIO))
    text = render(found, (), Picture(taken.svg(), taken.words(), "a period"))
    (image,) = [tag for tag in Reader(text).tags if tag["tag"] == "img"]
    assert image["src"].startswith("data:image/svg+xml;base64,")
    assert image["alt"] == taken.words()
    assert {"active", "reverse"} <= set(re.findall(r"active|reverse|flight", image["alt"]))


def test_page_loads_nothing_and_links_to_its_sections_and_the_files_beside(page):
    read = Reader(page)
    names = [tag["id"] for tag in read.tags if "id" in tag]
    assert len(names) == len(set(names))
    assert {*SECTIONS, *(f"plot-{name}" for name in PLOTS)} <= set(names)
    targets = [tag["href"] for tag in read.tags if "href" in tag]
    inside = {target.removeprefix("#") for target in targets if target.startswith("#")}
    assert {*SECTIONS, "meaning", "repeat"} <= inside <= set(names)
    assert [one for one in targets if not one.startswith(("#", DOCS))] == ["impacts.parquet", "signals.parquet"]
    for tag in read.tags:
        assert not {"src", "srcset", "poster", "background"} & tag.keys(), tag
        assert tag["tag"] not in ("link", "iframe", "object", "embed", "base"), tag
    assert "default-src 'none'" in page
    assert not re.search(r"@import|url\(", "".join(re.findall(r"<style>(.*?)</style>", page, re.S)))
    assert len(page.encode()) < 1_500_000


def test_every_finding_is_told_with_size_evidence_and_remedy(page):
    text = Reader(page).text
    assert re.search(r"✓ skew\s*loose gear\s*200\xa0µs\s*the loose gear is read later\s*corrected on request", text)
    assert re.search(r"! wave\s*drive gear\s*18\xa0µm\s*the flank waves <b>\s*turn an encoder on its shaft", text)
    assert "faults that were not corrected affect all results: wave; 1 fault was corrected" in text
    assert "waves <b>" not in page


def test_numbers_shown_are_those_of_the_summary(found, page):
    shown, summary = Reader(page).numbers, found.summary
    assert shown["backlash_m"] == summary["flanks"]["backlash_m"]["value"] == pytest.approx(250e-6, rel=1e-3)
    for key in ("noise_m", "noise_in_contact_m", "sample_rate_Hz", "jitter"):
        assert shown[key] == summary["quality"][key], key
    for key in ("whole_flights", "testifying", "chi2_median"):
        assert shown[key] == summary["cut"][key], key
    assert shown["active_velocity_mean_m_s"] == summary["active_velocity_mean_m_s"]
    first = summary["contact_orders"]["active"][0]
    assert shown["contact_orders.active.0"] == first["amplitude_m"] == pytest.approx(20e-6, rel=0.01)
    assert (first["gear"], first["order"]) == ("drive", 1)
    ratio = {flank: shown[f"{flank}_ratio"] for flank in ("active", "reverse")}
    assert ratio == pytest.approx({"active": 0.4, "reverse": 0.4}, rel=0.03)


def test_drawn_path_follows_the_means_and_is_coloured_as_cut(found):
    cut = found.segments
    block = path_lines(cut)
    time = np.cumsum(block["time"]) * block["tick"]
    place = np.cumsum(block["run"]["displacement_m"]["steps"]) * block["run"]["displacement_m"]["quantum"]
    touched = np.concatenate([cut.impacts["time_s"], cut.flights["start_s"], cut.flights["end_s"]])
    apart = np.min(np.abs(cut.path.time[:, None] - touched), axis=1) > 2 * cut.path.width
    off = np.abs(np.interp(cut.path.time, time, place) - (cut.path.place - cut.flanks.active[0]))
    assert off[apart].max() < (DEVIATIONS + 0.1) * max(cut.path.noise, 1e-4 * np.ptp(place)) + 2e-9
    assert len(time) < len(cut.path.time) / 4
    middles = 0.5 * (time[1:] + time[:-1])
    assert [int(one) for one in block["states"][:-1]] == cut.states(middles).tolist()
    assert {"0", "1", "2"} == set(block["states"])


def test_magnified_period_shows_the_readings_themselves(found):
    close, known = close_up(found), found.segments.track
    assert close["end"] - close["start"] == pytest.approx(1.05 / 3.0, rel=1e-6)
    at = np.searchsorted(known.time, close["start"] + np.array(close["time"]) - 1e-7)
    shift = found.segments.flanks.active[0]
    np.testing.assert_allclose(close["place"], 1e6 * (known.place[at] - shift), atol=1e-3)
    assert np.subtract(close["high"], close["low"]).mean() == pytest.approx(250.0, rel=1e-3)


def test_impacts_and_flights_are_carried_whole(found, page):
    blocks = Reader(page).blocks
    for name, table in (("impacts", found.recording.impacts), ("flights", found.segments.flights)):
        columns = blocks[name]["columns"] if name == "impacts" else blocks[name]
        for key, column in columns.items():
            values = np.array(column["values"], float) * column["quantum"]
            np.testing.assert_allclose(values, table[key], atol=column["quantum"], err_msg=key)
    assert "velocity_sigma_m_s" in blocks["impacts"]["columns"]


def test_noise_floor_is_that_of_least_squares_over_gaps():
    draw = np.random.default_rng(5)
    angle = np.sort(draw.uniform(0.0, 40.0, 30_000))
    angle = angle[np.mod(angle, 2 * np.pi) < 4.5]
    rest = 3e-6 * np.cos(7 * angle + 1.0) + draw.normal(0.0, 1e-7, len(angle))
    exact = []
    for order in range(1, 41):
        columns = np.stack([np.cos(order * angle), np.sin(order * angle)], axis=1)
        exact.append(np.hypot(*np.linalg.lstsq(columns, rest, rcond=None)[0]))
    alone = np.abs(each_alone(angle, rest, 40, RIDGE, FINE)[0])
    np.testing.assert_allclose(alone[1:], exact, rtol=0.02, atol=3e-9)


def test_a_record_without_rattle_says_so(tmp_path):
    quiet = measured(
        {"run.duration": "1 s", "run.settle": "0 s", "motion.harmonics": [], "sensors.sample_rate": "5 kHz"}
    )
    text = Reader(write(tmp_path / "report.html", quiet).read_text(encoding="utf-8")).text
    assert "No impact was found." in text
    assert "no fault was found" in text
    assert "no impact on the reverse flank" in text
    assert "Excluded, of all" not in text
    assert "Single readings over a part of the record" in text
    assert "The period of the drive's fluctuation is unknown" in text


def test_durations_tell_what_is_resolved_and_bound_the_rest(found):
    hits, told = found.segments.impacts, found.summary["durations"]
    for code, flank in enumerate(("active", "reverse")):
        mine = hits["flank"] == code
        assert told[flank]["impacts"] == mine.sum()
        assert told[flank]["resolved"] == np.isfinite(hits["duration_s"][mine]).sum()
        assert told[flank]["max_median_s"] < 1e-3
    json.dumps(found.summary, allow_nan=False)


def test_durations_are_shown_resolved_bounded_or_not_at_all():
    one = {"impacts": 9, "resolved": 4, "median_s": 8e-5, "quartiles_s": [7e-5, 9e-5], "max_median_s": 1e-4}
    bound = {**one, "resolved": 0, "median_s": None, "quartiles_s": None}
    told = {"durations": {"active": one, "reverse": bound}}
    assert [line.figure.text for line in duration_lines(told)] == ["80\xa0µs", "< 100\xa0µs"]
    assert duration_lines({"durations": {"active": {**bound, "impacts": 0, "max_median_s": None}}}) == []


INKED = """(id) => {
  const canvas = document.querySelector(`#plot-${id} canvas`), c = canvas.getContext("2d");
  const d = c.getImageData(0, 0, canvas.width, canvas.height).data, seen = new Set();
  for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 200) seen.add(d[i] + "," + d[i + 1] + "," + d[i + 2]);
  return [...seen];
}"""


@pytest.mark.browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_plot_is_drawn_in_the_reader_s_theme(chromium, found, tmp_path, scheme):
    path = write(tmp_path / "report.html", found, ("impacts.parquet",))
    tab = chromium.new_page(viewport={"width": 1100, "height": 900}, color_scheme=scheme)
    said, asked = [], []
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("request", lambda sent: asked.append(sent.url))
    tab.goto(path.as_uri())
    assert tab.evaluate("document.documentElement.dataset.theme") == scheme
    grey = {"light": "107,114,128", "dark": "154,163,175"}[scheme]
    for name in PLOTS:
        colours = set(tab.evaluate(INKED, name))
        assert len(colours) > 10, name
        wanted = {"speed": {grey}}.get(name, {"0,114,178", "213,94,0"} | ({grey} if name == "close" else set()))
        assert wanted <= colours, name
    times = tab.evaluate("DATA.impacts.time")
    tab.click("[data-zoom=next]")
    low, high = tab.evaluate("[time.plots[0].scales.x.min, time.plots[0].scales.x.max]")
    assert (low + high) / 2 == pytest.approx(times[0], abs=1e-6)
    tab.click("#theme")
    assert tab.evaluate("document.documentElement.dataset.theme") != scheme
    assert tab.evaluate("document.documentElement.scrollWidth") <= 1100
    assert said == []
    assert asked == [path.as_uri()]
    with tab.expect_download() as waiting:
        tab.click("#csv-flights")
    head, *lines = Path(waiting.value.path()).read_text(encoding="utf-8").splitlines()
    told = dict(zip(head.split(","), lines[0].split(","), strict=True))
    assert len(lines) == len(found.segments.flights["start_s"])
    assert told["struck"] == ("active", "reverse")[int(found.segments.flights["struck"][0])]
    assert float(told["end_s"]) == pytest.approx(found.segments.flights["end_s"][0], abs=2e-7)
    tab.close()
