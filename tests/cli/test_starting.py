"""``new``, ``list`` and ``doctor``: what somebody types first works, and says what is missing."""

import json
import tomllib
from importlib.util import find_spec
from pathlib import Path

import pytest

from gears3d import cli
from gears3d.cli import doctor as doctor_room
from gears3d.cli import main
from gears3d.effects import catalogue
from gears3d.scenario import STARTERS, load
from gears3d.scenario.document import names
from gears3d.simulation import ABOUT, MODELS, simulate

NAME = "rigaud-2020/fig5-20rpm"
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def gears3d(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as end:
            main([*map(str, arguments)])
        said = capsys.readouterr()
        return end.value.code, said.out, said.err

    return run


@pytest.mark.parametrize("kind", STARTERS)
def test_a_new_scenario_is_sound_and_commented(gears3d, tmp_path, kind):
    place = tmp_path / "some where" / "first.toml"
    code, out, _ = gears3d("new", place.with_suffix(""), "--kind", kind, "--json")
    assert code == 0
    assert json.loads(out)["scenario"] == str(place)
    scenario = load(place)
    assert scenario.title == "first"
    text = place.read_text()
    assert "NAME" not in text
    assert text.count("#") > 5
    assert not scenario.expect


@pytest.mark.parametrize("kind", ["rattle", "bench"])
def test_a_new_scenario_rattles(tmp_path, gears3d, kind):
    gears3d("new", tmp_path / "a", "--kind", kind)
    found = simulate(load(tmp_path / "a.toml"), "rigid")
    assert set(found.impacts["flank"]) == {0, 1}


def test_what_a_comment_offers_can_be_switched_on(tmp_path, gears3d):
    gears3d("new", tmp_path / "a")
    lines = (tmp_path / "a.toml").read_text().splitlines()
    begin = next(k for k, line in enumerate(lines) if line == "# [[effect]]")
    on = [*lines[:begin], *(line.removeprefix("# ") if "=" in line or "[" in line else line for line in lines[begin:])]
    (tmp_path / "b.toml").write_text("\n".join(on))
    scenario = load(tmp_path / "b.toml")
    assert [effect.kind for effect in scenario.effects] == ["transmission_error"]
    assert scenario.expect


@pytest.mark.parametrize("name", ["rigaud-2020/fig5-20rpm", "kadmiri-2012/fig7-100rpm", "ottewill-2010/fig6-lag"])
def test_a_copy_of_a_shipped_scenario_stands_alone(gears3d, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    code, out, _ = gears3d("new", "mine", "--from", name, "--json")
    assert code == 0
    told = json.loads(out)
    assert (told["scenario"], told["kind"], told["from"]) == ("mine.toml", None, name)
    text, original, made = (tmp_path / "mine.toml").read_text(), load(name), load("mine.toml")
    assert "extends" not in tomllib.loads(text)
    assert f"scenarios/{name}" not in text
    assert f"gears3d run {name}" not in text
    assert text.count("#") > 5
    assert (made.title, made.source, made.expect) == ("mine", f"copy of {name}", {})
    for part in ("gears", "mount", "motion", "drag", "impact", "start", "run", "sensors", "effects", "lubricated"):
        assert getattr(made, part) == getattr(original, part), part


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["--from", "rigaud-2020/fig5-20rmp"], 3, "did you mean 'rigaud-2020/fig5-20rpm'?"),
        (["--from", "base/rigaud-2020", "--kind", "bench"], 2, "give one of --kind and --from"),
        (["--kind", "rattel"], 2, "did you mean 'rattle'?"),
    ],
)
def test_what_cannot_be_started_from_is_refused(gears3d, tmp_path, arguments, code, told):
    found, _, err = gears3d("new", tmp_path / "mine", *arguments)
    assert found == code
    assert told in err
    assert not (tmp_path / "mine.toml").exists()


def test_nothing_is_overwritten(tmp_path, gears3d):
    (tmp_path / "mine.toml").write_text("# precious\n")
    code, _, err = gears3d("new", tmp_path / "mine.toml")
    assert code == 3
    assert "exists already" in err
    assert (tmp_path / "mine.toml").read_text() == "# precious\n"


@pytest.mark.parametrize(("name", "code"), [('a"b', 2), ("/dev/null/x", 3), ("", 2)])
def test_names_that_cannot_be(gears3d, name, code):
    found, _, err = gears3d("new", name)
    assert found == code
    assert "Traceback" not in err


def test_lists_name_all_there_is(gears3d):
    code, out, _ = gears3d("list", "--json")
    told = json.loads(out)
    assert code == 0
    assert {one["name"] for one in told["effects"]} == set(catalogue())
    assert {one["name"] for one in told["models"]} == set(MODELS) == set(ABOUT)
    assert {one["name"] for one in told["starters"]} == set(STARTERS)
    assert {one["name"] for one in told["scenarios"]} == set(names())
    assert all(one["about"] for rows in told.values() for one in rows)
    assert all("``" not in one["about"] for rows in told.values() for one in rows)


@pytest.mark.parametrize("what", ["effects", "papers", "models", "starters", "units", "scenarios", ""])
def test_lists_for_people_name_all_for_programs(gears3d, what):
    told = gears3d("list", *[what][: bool(what)])[1]
    one = {
        "effects": "drag_viscous",
        "papers": "kadmiri-2012",
        "models": "plastic",
        "starters": "helical",
        "scenarios": NAME,
    }
    assert one.get(what, "") in told


def test_an_unknown_list_is_told(gears3d):
    code, _, err = gears3d("list", "effect")
    assert code == 2
    assert "did you mean 'effects'?" in err


def test_the_doctor_finds_engine_and_twin_in_agreement(gears3d):
    code, out, _ = gears3d("doctor", "--json")
    told = json.loads(out)
    assert code == 0
    check = told["self_check"]
    assert check["passed"]
    assert check["impacts"] > 20
    assert check["velocity_error_p95"] < 1e-6
    assert told["versions"]["pybullet"]


def test_a_check_that_fails_is_an_engine_that_fails(gears3d, monkeypatch):
    monkeypatch.setattr(doctor_room, "WORST", 0.0)
    code, out, _ = gears3d("doctor")
    assert code == 4
    assert "FAILED" in out


def test_without_a_check_or_viewer_it_tells_what_to_type(gears3d, monkeypatch):
    monkeypatch.setattr("gears3d.views.replay.viewer.executable", fails)
    code, out, _ = gears3d("doctor", "--no-check")
    assert code == 0
    assert "pip install" in out
    assert "self-check" not in out


def fails():
    from gears3d.views.replay.viewer import ViewerError

    raise ViewerError("the viewer does not start: pip install 'rerun-sdk'")


def test_every_verb_is_of_a_file():
    assert all(find_spec(f"gears3d.cli.{verb}") for verb in cli.VERBS)
