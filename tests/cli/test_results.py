"""Results leave gears3d in one way: ``--out``, ``--plot``, ``--json``; in Python ``save``, ``plot``, ``report``."""

import json
import sys

import pytest

import gears3d as g3
from gears3d import cli
from gears3d.errors import InputError, UsageError
from gears3d.identify import identify_restitution
from gears3d.views.sheet import data_sheet_of

NAME = "rigaud-2020/fig5-20rpm"
SHORT = {"run.duration": "2 s"}
RIG = ("--rig", NAME)
VERBS = {
    "report": (("report", "{run}"), "summary.json", ["signals.parquet", "impacts.parquet", "summary.png"]),
    "compare": (("compare", "{run}", "{run}"), "comparison.json", ["comparison.png"]),
    "camera": (("camera", "{run}"), "camera.json", ["strip.png"]),
    "show": (("show", NAME), "sheet.json", ["sheet.png", "scenario.toml"]),
    "excitation": (("excitation", NAME), "excitation.json", ["excitation.png", "scenario.toml"]),
    "segment": (("segment", "{record}", *RIG), "summary.json", ["signals.parquet", "measured.png"]),
    "restitution": (("identify", "restitution", "{record}", *RIG), "law.json", ["law.png", "law.toml"]),
    "inspect": (("inspect", "{record}", *RIG), "findings.json", []),
}
NO_PLOT = ("inspect",)


def run(capsys, *words):
    with pytest.raises(SystemExit) as stop:
        cli.main([*map(str, words)])
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    return stop.value.code or 0, said.out, said.err


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a simulated run and its scenario, and the files that verbs read."""
    place = tmp_path_factory.mktemp("results")
    scenario = g3.load(NAME, SHORT)
    recording = g3.simulate(scenario, "rigid")
    g3.synthesize(scenario).write(place / "record.parquet")
    words = ["run", NAME, "--model", "rigid", "--no-views", "--set", "run.duration=2 s"]
    with pytest.raises(SystemExit):
        cli.main([*words, "--out", str(place / "run"), "--plot", str(place / "run.png")])
    return {"run": place / "run", "record": place / "record.parquet", "recording": recording, "scenario": scenario}


@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_writes_a_folder_a_picture_and_json(made, tmp_path, capsys, monkeypatch, verb):
    words, name, more = VERBS[verb]
    words = [word.format(**made) for word in words]
    plot = [] if verb in NO_PLOT else ["--plot", tmp_path / "picture.svg"]
    monkeypatch.setattr(sys, "argv", ["gears3d", *words])
    code, out, err = run(capsys, *words, "--out", tmp_path / "kept", *plot)
    assert code == 0, err
    assert str(tmp_path / "kept" / "report.html") in out.replace("\n", "")
    assert {"report.html", name, *more} <= {file.name for file in (tmp_path / "kept").iterdir()}
    kept = json.loads((tmp_path / "kept" / name).read_text(encoding="utf-8"))
    assert kept["provenance"]["command"].startswith(f"gears3d {words[0]}")
    page = (tmp_path / "kept" / "report.html").read_text(encoding="utf-8")
    assert page.count("<h1>") == 1
    assert "http://" not in page.replace("http://www.w3.org", "")
    if plot:
        assert "</svg>" in (tmp_path / "picture.svg").read_text(encoding="utf-8")
    code, out, _ = run(capsys, *words, "--json", *(["--plot", tmp_path / "again.png"] if verb == "camera" else []))
    assert code == 0
    assert json.loads(out)


def test_a_run_draws_its_picture_as_well(made):
    assert made["run"].with_suffix(".png").stat().st_size > 10_000


@pytest.mark.parametrize("verb", ["compare", "camera", "restitution"])
def test_a_picture_in_out_is_written_and_warns_in_one_line(made, tmp_path, capsys, verb):
    words = [word.format(**made) for word in VERBS[verb][0]]
    code, out, err = run(capsys, *words, "--out", tmp_path / "old.png")
    assert code == 0
    assert (tmp_path / "old.png").stat().st_size > 10_000
    assert err.count("is called --plot") == 1
    assert "picture written to" in out


@pytest.mark.slow
def test_python_writes_what_the_command_line_writes(made, tmp_path):
    record = g3.segment(made["record"], NAME)
    results = {
        "report": made["recording"],
        "compare": g3.compare(made["recording"], made["recording"]),
        "camera": g3.camera(made["recording"], made["scenario"]),
        "show": data_sheet_of(made["scenario"]),
        "excitation": g3.assess(made["scenario"]),
        "segment": record,
        "restitution": identify_restitution([record], made["scenario"].rig()),
    }
    for verb, result in results.items():
        _, name, more = VERBS[verb]
        folder = result.save(tmp_path / verb, command="by hand", inputs=[made["record"]])
        wanted = {"report.html", name, *more} - {"scenario.toml"}
        assert wanted <= {file.name for file in folder.iterdir()}, verb
        told = json.loads((folder / name).read_text(encoding="utf-8"))["provenance"]
        assert told["command"] == "by hand"
        assert [one["file"] for one in told["inputs"]] == [str(made["record"])]
        if verb in ("report", "restitution"):  # one door for all, through which they are saved, too
            assert result.report().startswith("<!doctype html>")
            assert result.plot(tmp_path / f"{verb}.png").axes


def test_what_cannot_be_saved_is_refused(made, tmp_path):
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="is not empty"):
        made["recording"].save(tmp_path / "foreign")
    assert [file.name for file in (tmp_path / "foreign").iterdir()] == ["thesis.tex"]
    with pytest.raises(UsageError, match=r"\.png, \.svg, \.pdf"):
        made["recording"].plot(tmp_path / "picture.bmp")


def test_marks_of_html_in_titles_are_text(made):
    scenario = made["scenario"].with_({"title": "<script>alert(1)</script>"})
    assert "<script>alert(1)" not in g3.assess(scenario).report()
