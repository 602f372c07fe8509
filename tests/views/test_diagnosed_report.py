"""The report of a diagnosis tells what the diagnosis says, draws every cause where it lives, and needs nothing else."""

import dataclasses
import html
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from gears3d.cli.diagnose import print_diagnosis as show
from gears3d.diagnosis import BINS, Resonance, Structure, extended_text, gap_deceleration
from gears3d.diagnosis.causes import contribution, fit, table
from gears3d.diagnosis.evidence import FINE, uncut
from gears3d.diagnosis.residual_tests import channel_chi2
from gears3d.diagnosis.search import blind
from gears3d.diagnosis.verdict import classify
from gears3d.effects import catalogue
from gears3d.identify import Parameter
from gears3d.measured.checks import Finding
from gears3d.palette import FLANKS, rgb
from gears3d.scenario import load
from gears3d.verification.challenge import score
from gears3d.views.pages import diagnosed as story
from gears3d.views.pages.diagnosed import CHANNEL_WORDS, SHOWN, STRUCTURES, render, write
from gears3d.views.pages.diagnosed_charts import of_cause, of_remains, samples
from gears3d.views.pages.engine import DOCS
from tests.diagnosis.test_placing import flights_under
from tests.views.test_measured_report import INKED
from tests.views.test_report import Reader

ROOT = Path(__file__).parents[2]
LINES_OF_WORDS = """Math.max(...[...document.querySelectorAll("#wrong tbody th")].map(cell => {
    const word = document.createRange(), end = (cell.firstChild.data + " ").indexOf(" ");
    word.setStart(cell.firstChild, 0);
    word.setEnd(cell.firstChild, end);
    return word.getClientRects().length;
}))"""
"""Lines that the first word of a channel's name is broken into, at most."""
SECTIONS = ("wrong", "causes", "gain", "left", "add", "records")
PLACED = {
    "drag_coulomb": ({"torque": 1e-3}, "flight", "speed of the loose gear [rpm]"),
    "drag_position": ({"amplitude": 1e-3, "order": 2}, "flight", "2 × angle of the loose gear [°]"),
    "drag_drift": ({"relative_change": 0.2, "time_constant": 2.0}, "flight", "time [s]"),
    "mesh_drag": ({"coefficient": 1e-3}, "loss", "speed of the drive gear [rpm]"),
    "transmission_error": ({"amplitude": 2e-5, "order": 3}, "contact", "3 × angle of the drive gear [°]"),
    "backlash_offset": ({"offset": 1e-5}, "contact", "angle of the drive gear [°]"),
    "pitch_error": ({"offset": 1e-5, "tooth": 4}, "contact", "drive gear, teeth after tooth 4 at the pitch point"),
    "restitution_offset": ({"offset": 0.1}, "impact", "approach speed [mm/s]"),
    "drive_motion": ({"amplitude": 0.05, "frequency": 7.0}, "drive", "phase of this motion [°]"),
    "encoder_eccentricity": ({"amplitude": 1e-4, "gear": "drive"}, "contact", "angle of the drive gear [°]"),
    "encoder_skew": ({"delay": 1e-5, "gear": "loose"}, "contact", "speed of the drive gear [rpm]"),
}  # fmt: skip


@pytest.fixture(scope="module")
def page(found):
    return render(found, {"command": "gears3d diagnose record.toml --rig <rig>"}, ("diagnosis.json", "extended.toml"))


def silent(found, **changes):
    """A diagnosis that names nothing."""
    bare = found.found._replace(fit=fit(found.found.records, found.found.base, ()))
    return dataclasses.replace(found, causes=(), held=(), found=bare, **changes)


def shown(effect):
    kind = catalogue()[effect]
    return kind(**PLACED[effect][0])


def test_the_page_needs_nothing_else_and_has_every_section(page):
    reader = Reader(page)
    assert set(SECTIONS) <= set(re.findall(r'<section id="(\w+)"', page))
    outside = rf'(?:src|href)="(?!#|diagnosis\.json|extended\.toml|{re.escape(DOCS)})[^"]*"'
    assert not re.findall(outside, page)
    assert not re.search(r"url\(|@import", "".join(re.findall(r"<style>(.*?)</style>", page, re.S)))
    assert "--rig &lt;rig&gt;" in page
    assert reader is not None
    assert 'data-theme="dark"' in page  # both themes are styled


def test_it_says_what_the_diagnosis_says(found, page):
    text = html.unescape(re.sub(r"<[^>]+>", " ", page))
    cause = found.causes[0]
    assert cause.kind == "drag_viscous"
    assert story.sentence(found, found.to_dict()) in text
    values = [float(value) for value in re.findall(r'<data value="([^"]+)"', page)]
    for number in (cause.parameters["coefficient"].value, *found.power.values(), *(one.gain for one in found.held)):
        assert min(abs(value - number) for value in values) <= 1e-9 * abs(number)
    for channel, (base, _) in found.held[0].sizes.items():
        assert base >= 0.0
        assert CHANNEL_WORDS[channel][1] in text
    held = found.to_dict()["heldout"]
    for row, channel in zip(story.channels(found, found.to_dict()), held["base"], strict=False):
        assert (row.base.value, row.extended.value) == (
            held["base"][channel]["value"],
            held["extended"][channel]["value"],
        )


def test_the_snippet_is_the_effect_of_the_extended_rig(found, page):
    shown = html.unescape(re.search(r'<pre class="snippet" tabindex="0"><code>(.*?)</code>', page, re.S)[1])
    tables = tomllib.loads(shown)["effect"]
    assert tables == [one.table for one in found.causes]
    assert tables == [dict(one) for one in tomllib.loads(found.extended.document)["effect"]][-len(tables) :]


@pytest.mark.parametrize("kind", PLACED)
def test_a_cause_is_drawn_where_it_lives(found, kind):
    _, channel, coordinate = PLACED[kind]
    picture = of_cause(found, shown(kind))
    assert (picture.channel, picture.coordinate) == (channel, coordinate)
    for drawn in (picture.before, picture.after):
        assert sum(len(one["x"]) for one in drawn["sets"] if one["kind"] == "marks") >= 4
        assert drawn["x"] == coordinate
        assert json.dumps(drawn, allow_nan=False)
    kinds = [[one["kind"] for one in drawn["sets"]] for drawn in (picture.before, picture.after)]
    assert ["line" in some for some in kinds] == [True, False]


def test_what_is_drawn_has_the_size_that_the_law_gives(found):
    """A torque T slows every flight by T/J, restitution gives δe·v, flanks of a wider gap stand δ apart."""
    records = found.found.records
    rig = records[0].rig

    def drawn(kind, channel):
        return samples(records, channel, contribution(records, [shown(kind)], (channel,)))

    slowed = drawn("drag_coulomb", "flight").value
    step = 1.0 / (FINE * (BINS - 1))  # predictions are read off straight lines over so much of a flight
    np.testing.assert_allclose(slowed, 1e-3 / rig.inertia, rtol=step**2)
    struck = drawn("restitution_offset", "impact")
    np.testing.assert_allclose(struck.value, 0.1 * struck.speed, rtol=1e-9)
    apart = drawn("backlash_offset", "contact")
    both = [k for k in range(len(records)) if {0, 1} <= set(apart.flank[apart.record == k])]
    assert both
    for k in both:
        sides = [apart.value[(apart.record == k) & (apart.flank == side)].mean() for side in (0, 1)]
        assert sides[1] - sides[0] == pytest.approx(1e-5, rel=1e-9)


def test_before_and_after_differ_by_the_cause(found):
    """What the named cause leaves is noise; before, flights are slowed by C·ω/J."""
    records, search = found.found.records, found.found
    span, cause = search.known.spans["flight"], found.causes[0]
    base, rest = (samples(records, "flight", values[span]) for values in (search.base, search.fit.rest))
    assert np.sqrt(np.mean((rest.value * rest.sure) ** 2)) < 1.5
    law = cause.parameters["coefficient"].value * base.speed / records[0].rig.inertia
    slack = 5.0 / base.sure + 0.02 * np.abs(law)
    assert np.all(np.abs(base.value - law) < slack)


def test_what_remains_is_drawn_and_told(found):
    left = Structure("flight.speed", 1e6, 0.0, 1.0, "rad/s^2", 5.0)
    page = render(silent(found, verdict="unexplained", left=(left,)))
    text = html.unescape(re.sub(r"<[^>]+>", " ", page))
    assert "no effect of the catalogue explains it" in text
    assert STRUCTURES["flight.speed"] in text
    assert 'data-channel="flight"' in page
    assert re.search(r"Root mean square of the residuals: .*flight\s+\d", text)
    assert "No cause was added" in text
    for name in STRUCTURES:
        undrawn = ("flight.gap", "path.all")  # one flank alone is touched here; the film shows the path
        assert (of_remains(found, name, 2.0) is None) == (name in undrawn), name


def test_a_pull_at_a_place_in_the_gap_is_drawn_over_that_place_with_a_line_a_record():
    records, rest = flights_under(3, lambda tau, place, lasts: 30.0 * (place < 0.3))
    whole = np.concatenate(rest)
    seen = SimpleNamespace(records=records, fit=SimpleNamespace(rest=whole), known=SimpleNamespace(
        spans={"flight": slice(0, len(whole))}))  # fmt: skip
    picture = of_remains(SimpleNamespace(found=seen, rings=None), "flight.gap", 0.1)
    lines = picture.before["sets"]
    assert [line["look"] for line in lines] == ["flight"] * len(records) + ["active"]
    told = gap_deceleration(records, rest)
    for line, curve in zip(lines, [*told.own, told.common], strict=True):
        assert line["x"] == pytest.approx(100.0 * told.place, rel=1e-6)
        assert np.corrcoef(line["y"], curve)[0, 1] > 0.99  # ends may be cut off by the frame


def test_a_channel_that_is_off_as_a_whole_remains_with_its_size(found):
    """Noise of ten stated sigmas has no order over anything, and explains nothing."""
    search, wide = found.found, 10.0
    rest = search.fit.rest.copy()
    span = search.known.spans["contact"]
    rest[span] = np.clip(wide * np.random.default_rng(5).standard_normal(span.stop - span.start), -14.0, 14.0)
    left = channel_chi2(search.records, rest)
    assert [one.name for one in left] == ["contact.all"]
    verdict = classify(found.causes, left, found.power)
    told = dataclasses.replace(found, verdict=verdict, left=tuple(left)).to_dict()
    assert told["verdict"] == "partly_explained"
    row = json.loads(json.dumps(told, allow_nan=False))["remaining"]
    sigma = np.concatenate([one.channels.contacts.sigma for one in search.records])
    assert row["structure"] == "contact.all"
    assert (row["channel"], row["unit"], row["where"]) == ("contact", "m", None)
    assert row["record"] in [one.name for one in search.records]
    assert row["size"] == pytest.approx(np.sqrt(np.mean((rest[span] * sigma) ** 2)))
    assert row["significance"] == pytest.approx(np.sqrt(np.sum(rest[span] ** 2) - len(sigma)))
    page = render(dataclasses.replace(found, verdict=verdict, left=tuple(left)))
    assert STRUCTURES["contact.all"] in page
    assert "in the whole channel, largest in record-" in page
    answer = {"effects": [{"kind": "drag_viscous"}], "unknown": [], "visible": True}
    assert score(answer, told)["verdict_right"]


def test_channels_within_their_noise_do_not_remain(found):
    assert channel_chi2(found.found.records, found.found.fit.rest) == []


def test_the_extended_rig_has_no_digits_beyond_its_intervals_and_tells_them(found):
    cause = found.causes[0]
    text = extended_text(found)
    assert tomllib.loads(text) == tomllib.loads(found.extended.document)
    above = text[: text.rindex("[[effect]]")].rstrip().splitlines()[-2:]
    assert above[0] == f"# found by gears3d diagnose: {cause.kind}"
    assert above[1].startswith("# 95 %: coefficient ")
    written = load(text).effects[-1].coefficient
    one = cause.parameters["coefficient"]
    assert 0.0 < abs(written - one.value) < 0.05 * 0.5 * (one.high - one.low)


@pytest.mark.parametrize(("value", "half"), [(0.1 / 3.0, 1e-3), (-2.0 / 3.0, 1e-9), (98765.4321, 3e4), (9.99999, 0.7)])
def test_ratios_are_rounded_within_a_twentieth_of_their_interval(value, half):
    number = Parameter(value, "", value - half, value + half)
    written = table(catalogue()["restitution_offset"](offset=value), {"offset": number})["offset"]
    assert abs(written - value) <= 0.05 * half
    digits = len(f"{abs(written):.15g}".replace(".", "").strip("0"))
    assert digits <= max(np.log10(abs(value) / half) + 3, 3)


def test_a_tooth_of_which_only_the_least_depth_is_known_is_told_so(found):
    effect = catalogue()["pitch_error"](offset=-2e-5, tooth=3)
    known = {"offset": Parameter(-2e-5, "m", -1e-3, -2e-5)}
    deep = dataclasses.replace(found.causes[0], effect=effect, parameters=known, table=table(effect, known))
    for one, told in ((deep, False), (dataclasses.replace(deep, at_least=("offset",)), True)):
        changed = dataclasses.replace(found, causes=(one,))
        assert ("-20 µm or beyond" in story.sentence(changed, changed.to_dict())) is told
        assert (story.numbers(one)[0].value == "-20 µm or beyond") is told


def test_the_terminal_tells_the_story(found, capsys):
    show(found)
    said = capsys.readouterr().out
    cause = found.causes[0]
    for words in (
        found.verdict,
        f"1. {cause.kind} (torque)",
        cause.evidence,
        "error reduction: ",
        "residual: none beyond chance",
    ):
        assert words in said
    assert all(f"excluded: {one['kind']}: fits worse by" in said for one in cause.excluded)
    assert re.search(r"minimum detectable effects, .* flanks and backlash \d+\s%, torques .* restitution \d", said)


def test_more_remains_than_is_drawn(found):
    names = ("flight.speed", "flight.time", "contact.flank", "impact.speed")
    left = tuple(Structure(name, 1e6 / place, 0.0, 1.0, "", 5.0) for place, name in enumerate(names, 1))
    page = render(silent(found, verdict="unexplained", left=left))
    section = page[page.index('id="left"') : page.index('id="add"')]
    assert [name for name in names if f'class="source">{name}<' in section] == list(names)
    assert section.count("<h3>") == SHOWN


def test_a_nominal_model_without_error_beyond_noise_has_no_reduction_to_state(found):
    """Where held-out errors of the nominal model are at the noise, the gain is not defined: the page says so."""
    held = tuple(one._replace(base=0.5 * one.noise) for one in found.held)
    page = render(dataclasses.replace(found, held=held))
    assert "the nominal model has no error beyond noise" in page
    assert 'data-key="gain"' not in page
    assert "the nominal model has no error beyond noise" not in render(found)


@pytest.mark.parametrize(("verdict", "power"), [("not_decidable", float("inf")), ("nothing_to_add", 0.05)])
def test_silence_is_told_with_what_would_have_shown(found, verdict, power):
    page = render(silent(found, verdict=verdict, left=(), power={"geometry": 0.01, "torque": power, "impact": 0.02}))
    text = html.unescape(re.sub(r"<[^>]+>", " ", page))
    assert ("insufficient for a verdict on torques on the loose gear" in text) == (verdict == "not_decidable")
    assert ("Minimum detectable effect: 5\xa0% of backlash" in text) == (verdict == "nothing_to_add")
    assert 'class="snippet"' not in page


@pytest.mark.parametrize("cut", [True, False])
def test_a_resonance_is_drawn_as_spectra_with_a_line_a_record_whether_or_not_records_were_cut(found, cut):
    frequency = np.geomspace(20.0, 400.0, 300)
    peaks = 1e-12 * (1.0 + 1e3 * np.exp(-(((frequency - 90.0) / 4.0) ** 2)))
    structure = Structure("impact.duration", 900.0, 0.0, 3e-5, "m", 90.0)
    rings = Resonance(structure, frequency, np.stack([peaks, 2.0 * peaks, np.where(frequency < 380.0, peaks, np.nan)]))
    bare = silent(found, verdict="unexplained", left=(structure,), power={}, rings=rings)
    if not cut:
        bare = dataclasses.replace(bare, found=blind([uncut(one.scenario, one.name) for one in found.found.records]))
    page = render(bare)
    lines = Reader(page).blocks["charts"]["residual0"]["sets"]
    assert len(lines) == 3
    for line, power in zip(lines, rings.power, strict=True):
        shown = frequency < 3.0 * 90.0
        assert line["x"] == pytest.approx(frequency[shown], rel=1e-6)
        assert np.corrcoef(line["y"], np.log(power[shown]))[0, 1] > 0.9999
        assert abs(frequency[np.argmax(line["y"])] - 90.0) < 1.0
    text = html.unescape(re.sub(r"<[^>]+>", " ", page))
    assert "at one frequency, independent of speed" in text
    assert re.search(r"30\s+µm", text)
    assert "would have been reported" not in text
    assert ("were not segmented into free flights" in text) != cut


def test_findings_of_the_gate_and_foreign_text_are_escaped(found):
    one = Finding("skew", "theta_loose_rad", 2e-4, "s", "read later <b>", correctable=True, corrected=True)
    page = render(dataclasses.replace(found, findings={found.records[0]["name"]: [one.to_dict()]}))
    assert "read later &lt;b&gt;" in page
    assert "✓ skew" in page


@pytest.mark.browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_follows_the_reader_s_theme(chromium, found, tmp_path, scheme):
    path = write(tmp_path / "report.html", found)
    tab = chromium.new_page(viewport={"width": 1100, "height": 900}, color_scheme=scheme)
    said, asked = [], []
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("request", lambda sent: asked.append(sent.url))
    tab.goto(path.as_uri())
    assert tab.evaluate("document.documentElement.dataset.theme") == scheme
    grey = {"light": "107,114,128", "dark": "154,163,175"}[scheme]
    assert grey in tab.evaluate(INKED, "cause0")
    tab.click("#theme")
    assert tab.evaluate("document.documentElement.dataset.theme") != scheme
    for width in (1100, 420):
        tab.set_viewport_size({"width": width, "height": 900})
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        assert tab.evaluate(LINES_OF_WORDS) == 1
    assert said == []
    assert asked == [path.as_uri()]
    tab.close()


@pytest.mark.slow
@pytest.mark.browser
def test_the_readme_s_diagnosis_can_be_made(chromium, tmp_path):
    command = [sys.executable, "tools/diagnosis_picture.py", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    kept = ROOT / "docs/pictures/diagnosis.png"
    with Image.open(tmp_path / "diagnosis.png") as fresh, Image.open(kept) as shown:
        assert fresh.width == shown.width
        seen = np.asarray(fresh.convert("RGB")).astype(int)
    for flank in FLANKS:
        assert np.mean(np.abs(seen - np.array(rgb(flank))).max(axis=-1) < 24) > 5e-4
