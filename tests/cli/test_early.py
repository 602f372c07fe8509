"""Options that can be judged before the work begins are."""

import sys

import pytest

from gears3d import cli, recording, simulation
from gears3d.measured import checks, segmentation

FILE = "scenarios/rigaud-2020/fig5-20rpm.toml"
HEAVY = (
    (simulation, "simulate"),
    (simulation, "record"),
    (simulation, "stream"),
    (segmentation, "measure"),
    (checks, "admit_each"),
    (recording, "read"),
)
"""What the verbs below would do for seconds or minutes."""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with things that are in the way, and a test that fails if anything heavy begins."""

    def begins(*_, **__):
        raise AssertionError("the work began")

    for module, name in HEAVY:
        monkeypatch.setattr(module, name, begins)
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder").mkdir()
    (tmp_path / "dangling").symlink_to("nothing")
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "thesis.tex").write_text("years of work")
    return tmp_path


RIG = ("--rig", FILE)
FOLDERS = {
    "run": ("run", FILE),
    "sweep": ("sweep", FILE, "--vary", "drag.torque=0.1..1 N m lin 4"),
    "diagnose": ("diagnose", "record.parquet", *RIG),
    "challenge": ("challenge", "--seed", "1"),
    "papers": ("papers",),
    "mesh": ("export", FILE),
}
FILES = {
    "camera": ("camera", "run"),
    "compare": ("compare", "a", "b"),
    "describe": ("report", "run"),
    "show": ("show", FILE),
    "excitation": ("excitation", FILE),
    "record": ("synthesize", FILE),
    "sound": ("sound", "run"),
    "validate": ("validate",),
    "replay": ("replay", "run"),
    "identify": ("identify", "coastdown", "record.csv", "--inertia", "1e-3 kg m^2"),
}


def refused(capsys, *words):
    """Exit code and text of a verb that is to refuse."""
    with pytest.raises(SystemExit) as stop:
        cli.main([*map(str, words)])
    said = capsys.readouterr().err
    assert "Traceback" not in said
    return stop.value.code, " ".join(said.split())


@pytest.mark.parametrize("verb", FOLDERS)
@pytest.mark.parametrize(("out", "why"), [("file", "is a file"), ("file/run", "Not a directory"), ("dangling", "link")])
def test_a_folder_that_cannot_be(place, capsys, verb, out, why):
    before = sorted(place.rglob("*"))
    code, said = refused(capsys, *FOLDERS[verb], "--out", place / out)
    assert code == 3
    assert why in said
    assert str(place / out) in said.replace(" ", "") or str(place / out) in said
    assert sorted(place.rglob("*")) == before


@pytest.mark.parametrize("verb", FILES)
@pytest.mark.parametrize("out", ["folder", "file/picture"])
def test_a_file_that_cannot_be(place, capsys, verb, out):
    endings = {"record": ".csv", "sound": ".wav", "replay": ".rrd", "validate": ".md"}
    taken = place / f"folder{endings.get(verb, '.png')}"
    taken.mkdir()
    out = taken if out == "folder" else place / f"{out}{endings.get(verb, '.png')}"
    before = sorted(place.rglob("*"))
    code, said = refused(capsys, *FILES[verb], "--out", out)
    assert code == 3
    assert "Is a directory" in said or "Not a directory" in said
    assert sorted(place.rglob("*")) == before


@pytest.mark.parametrize("verb", ["camera", "compare", "describe", "show", "excitation", "record", "sound", "identify"])
def test_an_ending_that_is_not_known(place, capsys, verb):
    option = "--out" if verb in ("record", "sound") else "--plot"
    code, said = refused(capsys, *FILES[verb], option, place / "out.bmp")
    assert code == 2
    assert "the name of this file ends in" in said
    if option == "--plot":
        code, said = refused(capsys, *FILES[verb], "--out", place / "out.bmp")
        assert code == 2
        assert "--out names a folder; --plot names a picture" in said


@pytest.mark.parametrize(
    ("words", "code", "why"),
    [
        (("run", FILE, "--twin", "foo"), 2, "--twin is 'foo'"),
        (("run", FILE, "--twin", "plastic"), 3, "--twin none"),
        (("run", FILE, "--twin", "lubricated"), 3, "--twin none"),
        (("run", FILE, "--out", "."), 3, "is the current folder or one above it"),
        (("run", FILE, "--out", ".."), 3, "is the current folder or one above it"),
        (("run", FILE, "--out", "foreign"), 3, "is not a run folder and is not empty"),
        (("camera", "run", "--video", "film.avi"), 2, "ends in .mp4"),
        (("diagnose", "record.parquet"), 2, "--rig"),
    ],
)
def test_words_that_cannot_be_meant(place, capsys, monkeypatch, words, code, why):
    root = sys.modules["gears3d"].__file__.rpartition("/gears3d/")[0]
    monkeypatch.chdir(place)
    before = sorted(place.rglob("*"))
    found, said = refused(capsys, *(f"{root}/{word}" if word == FILE else word for word in words))
    assert (found, why in said) == (code, True), said
    assert sorted(place.rglob("*")) == before


@pytest.mark.parametrize("name", ["[red]x", "[/]x", "[/red]", "[link=a]b", "back\\"])
def test_markup_in_names_and_titles_is_printed_as_it_is(tmp_path, monkeypatch, capsys, name):
    scenario = tmp_path / "a.toml"
    # the title of a scenario and the name of a folder are a user's words, not markup
    scenario.write_text(f"extends = 'rigaud-2020/fig5-20rpm'\ntitle = '{name}'\n")
    monkeypatch.setenv("COLUMNS", "200")
    out = tmp_path / name.replace("/", "")
    words = ("--model", "rigid", "--no-views", "--set", "run.duration=1 s", "--out", str(out))
    with pytest.raises(SystemExit) as stop:
        cli.main(["run", str(scenario), *words])
    said = capsys.readouterr()
    assert stop.value.code in (0, None), said.err
    assert name in said.out
    assert str(out) in said.out.replace("\n", "")
