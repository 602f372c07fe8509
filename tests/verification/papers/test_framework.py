"""Claims, verdicts and the command: nothing about physics."""

import importlib
import json
import math
from dataclasses import replace
from itertools import pairwise

import pytest

from gears3d import cli
from gears3d.errors import UsageError
from gears3d.verification.papers import PAPERS, Bench, Claim, Figure, Paper, Result, paper, papers, verdict
from gears3d.verification.papers.page import markdown, number, tally

FIG10 = "rigaud-2020/fig10.toml"


def claim(published=2.0, computed=2.05, tolerance=0.1, **more):
    return Claim(
        paper="a", figure="fig. 1", quantity="q", published=published, tolerance=tolerance, compute=lambda _: computed,
        **more,
    )  # fmt: skip


@pytest.fixture
def gears3d(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(arguments)
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run


@pytest.fixture
def only(monkeypatch):
    """Put claims in the place of all papers."""

    def put(*claims, figures=()):
        made = Paper("a", "A. Author", ("fig. 1", "fig. 2"), claims, figures, {"fig. 2": "a photograph"})
        monkeypatch.setattr(importlib.import_module("gears3d.verification.papers"), "papers", lambda only="": [made])

    return put


@pytest.mark.parametrize(
    ("published", "computed", "tolerance", "expected"),
    [
        (2.0, 2.1, 0.125, "agrees"),
        (2.0, 1.9, 0.125, "agrees"),
        (2.0, 2.125, 0.125, "agrees"),
        (2.0, 2.126, 0.125, "disagrees"),
        (2.0, math.nan, 0.1, "disagrees"),
        (2.0, math.inf, 0.1, "disagrees"),
        ("rises", "rises", 0.0, "agrees"),
        ("rises", "rises ", 0.0, "disagrees"),
    ],
)
def test_numbers_agree_within_their_tolerance_and_words_when_equal(published, computed, tolerance, expected):
    assert verdict(published, computed, tolerance) == expected


def test_words_and_numbers_do_not_mix():
    with pytest.raises(TypeError, match="both words or both numbers"):
        verdict(1.0, "rises", 0.1)
    with pytest.raises(ValueError, match="words have tolerance 0"):
        claim("rises", "rises", 0.1)
    for bad in (0.0, -0.1, math.nan):
        with pytest.raises(ValueError, match="numbers a positive one"):
            claim(tolerance=bad)


def test_a_verdict_that_is_not_the_recorded_one_is_seen():
    assert not Result(claim(), 2.05).changed
    assert Result(claim(), 3.0).changed
    assert Result(claim(recorded="disagrees"), 2.05).changed
    assert not Result(claim(recorded="disagrees"), 3.0).changed
    assert tally([Result(claim(), 2.0), Result(claim(), 3.0)]) == "2 rows: 1 agree, 1 disagree; 1 not as recorded"


def test_the_command_exits_with_1_when_a_verdict_changed(gears3d, only):
    only(claim())
    assert gears3d("papers")[0] == 0
    only(claim(computed=3.0, recorded="disagrees", note="why it is so"))
    code, out, _ = gears3d("papers")
    assert code == 0
    assert "why it is so" in out
    for changed in (claim(computed=3.0), claim(recorded="disagrees")):
        only(claim(), changed)
        code, out, _ = gears3d("papers")
        assert code == 1
        assert "(not as recorded)" in out


def test_rows_have_the_keys_of_the_contract(gears3d, only):
    only(claim(unit="mm", note="n", basis="b", model="law"), claim(computed=math.nan, recorded="disagrees"))
    code, out, _ = gears3d("papers", "--json")
    rows = json.loads(out)
    assert code == 0
    assert rows[0] == {
        "paper": "a", "figure": "fig. 1", "quantity": "q", "published": 2.0, "computed": 2.05, "tolerance": 0.1,
        "unit": "mm", "model": "law", "verdict": "agrees", "note": "n", "recorded": "agrees", "basis": "b",
    }  # fmt: skip
    assert rows[1]["computed"] == "nan"
    assert rows[1]["verdict"] == "disagrees"


def test_out_writes_rows_table_and_figures(gears3d, only, tmp_path):
    def draw(bench, sheet):
        run = bench.run(FIG10, {"run.duration": "0.5 s"})
        sheet.add_subplot().plot(run.time, run.signals["displacement_m"])

    only(claim(note="<b>not bold</b>"), figures=(Figure("a", "fig. 1", "a figure", draw),))
    code, out, _ = gears3d("papers", "--out", str(tmp_path / "p"))
    assert code == 0
    assert sorted(path.name for path in (tmp_path / "p").iterdir()) == [
        "papers.html",
        "papers.json",
        "papers.md",
        "report.html",
    ]
    page = (tmp_path / "p/papers.html").read_text()
    assert page.count("data:image/png;base64,") == 1
    assert "&lt;b&gt;not bold" in page
    assert "gears3d run rigaud-2020/fig10 --model rigid --set" in page
    assert not any(text in page for text in ('src="http', "url(http", "@import", 'rel="stylesheet"'))  # works offline
    assert json.loads((tmp_path / "p/papers.json").read_text())[0]["verdict"] == "agrees"
    assert "a photograph" in (tmp_path / "p/papers.md").read_text()
    assert str(tmp_path / "p/papers.html") in out


def test_ctrl_c_breaks_off_at_a_safe_moment(gears3d, only, tmp_path):
    import os
    import signal

    def compute(bench):
        os.kill(os.getpid(), signal.SIGINT)
        bench.run(FIG10, {"run.duration": "0.5 s"})
        raise AssertionError("the run should not have started")

    only(replace(claim(), compute=compute))
    assert gears3d("papers", "--out", str(tmp_path / "p"))[0] == 130
    assert not (tmp_path / "p").exists()


def test_a_paper_that_is_not_there_is_usage(gears3d):
    code, _, err = gears3d("papers", "--only", "rigaud")
    assert code == 2
    assert "there is no paper 'rigaud'" in err
    with pytest.raises(UsageError, match="did you mean 'rigaud-2020'"):
        papers("rigaud-202")


def test_a_scenario_runs_once_and_is_a_command_of_its_figure():
    told = []
    bench = Bench(told.append)
    with bench.working_on("looking at fig. 10", "fig. 10"):
        one = bench.run(FIG10, {"run.duration": "0.5 s", "motion.harmonics": [{"amplitude": "4 rpm", "order": 20}]})
        two = bench.run(FIG10, {"run.duration": "0.5 s", "motion.harmonics": [{"amplitude": "4 rpm", "order": 20}]})
    assert one is two
    assert set(told) == {"looking at fig. 10"}
    with bench.working_on("looking at fig. 10", "fig. 11"):
        bench.once("needs a run", lambda: bench.run(FIG10, {"run.duration": "0.5 s"}))
    with bench.working_on("looking at fig. 10", "fig. 12"):
        bench.once("needs a run", lambda: bench.run(FIG10, {"run.duration": "0.5 s"}))
    assert bench.commands["fig. 11"] == bench.commands["fig. 12"] != []
    assert bench.run(FIG10, {"run.duration": "0.6 s"}) is not one
    (command,) = bench.commands["fig. 10"]
    assert command == (
        "gears3d run rigaud-2020/fig10 --model rigid --set 'run.duration=\"0.5 s\"' "
        "--set 'motion.harmonics=[{ amplitude = \"4 rpm\", order = 20 }]'"
    )


def test_a_command_of_the_page_sets_what_the_bench_set():
    import shlex

    from gears3d.scenario import load
    from gears3d.scenario.document import shipped

    overrides = {"motion.harmonics": [{"amplitude": "4 rpm", "order": 20}], "impact.restitution": 0.5}
    bench = Bench()
    bench.run(FIG10, {**overrides, "run.duration": "0.1 s", "run.settle": "0 s"})
    words = shlex.split(bench.commands[""][0])
    settings = [word for before, word in pairwise(words) if before == "--set"]
    told, ran = load(shipped() / FIG10, settings), bench.scenario(FIG10, overrides)
    assert told.motion == ran.motion
    assert told.impact == ran.impact


@pytest.mark.parametrize("name", PAPERS)
def test_every_figure_and_table_has_a_row_or_an_excuse(name):
    found = paper(name)
    assert found.forgotten == []
    assert {claim.figure for claim in found.claims} <= set(found.contents)
    assert {figure.name for figure in found.figures} <= set(found.contents)
    assert {claim.paper for claim in found.claims} == {name}
    assert not {claim.figure for claim in found.claims} & set(found.excused)


@pytest.mark.parametrize("name", PAPERS)
def test_rows_say_where_their_tolerance_comes_from_and_red_ones_why(name):
    for each in paper(name).claims:
        assert each.basis or isinstance(each.published, str), each.quantity
        assert each.note or each.recorded == "agrees", each.quantity
    names = [(each.figure, each.quantity) for each in paper(name).claims]
    assert len(set(names)) == len(names)


def test_a_note_that_rows_share_is_told_once(gears3d, only, tmp_path):
    shared = "because of this"
    only(*(claim(computed=3.0, recorded="disagrees", note=shared, model=each) for each in ("rigid", "law")))
    _, out, _ = gears3d("papers", "--out", str(tmp_path))
    assert out.count(shared) == 1
    assert "fig. 1, q and 1 more" in out
    for name in ("papers.md", "papers.html"):
        assert (tmp_path / name).read_text().count(shared) == 1


def test_numbers_and_tables_read_well():
    assert number(-19.94, "mm/s", 2.1) == "−19.94 mm/s"
    assert number(-1e-9, "mm", 0.1) == "0 mm"
    assert number("contact") == "contact"
    text = markdown([(Paper("a", "A.", (), (), (), {}), [Result(replace(claim(), quantity="p|q"), 3.0)])])
    assert "| fig. 1 | p\\|q | 2 | 3 | ± 0.1 | rigid | **disagrees** |" in text
