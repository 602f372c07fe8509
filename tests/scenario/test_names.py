"""Shipped scenarios go by name wherever a path is taken, from any folder; an existing file wins."""

from pathlib import Path

import pytest

from gears3d.errors import InputError
from gears3d.scenario import load
from gears3d.scenario.document import ROWS, find, names, shipped

NAME = "rigaud-2020/fig5-20rpm"


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_shipped_scenario_has_a_name_that_loads_it():
    assert len(names()) > 70
    assert {shipped() / f"{name}.toml" for name in names()} == {
        file for file in shipped().rglob("*.toml") if file.name != ROWS
    }
    for name in names():
        assert load(name).path == shipped() / f"{name}.toml"


@pytest.mark.parametrize("kind", [str, Path])
def test_a_name_is_the_file_it_names(kind):
    assert load(kind(NAME)) == load(shipped() / f"{NAME}.toml")
    assert load(kind("rigaud-2020/fig12-1.6rpm-3Hz")).title.endswith("1.6 rpm at 3 Hz")


def test_a_name_takes_overrides():
    assert load(NAME, ["drag.torque=0.46 N m"]).drag.torque == 0.46


@pytest.mark.parametrize("folder", ["", "deep/down"])
def test_a_name_is_extended_from_any_folder(elsewhere, folder):
    file = elsewhere / folder / "mine.toml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f'extends = "{NAME}"\n[impact]\nrestitution = 0.5\n')
    scenario = load(file)
    assert scenario.impact.restitution == 0.5
    assert scenario.gears == load(NAME).gears
    assert load(f'extends = "{NAME}"\nmount = {{ backlash = "1 mm" }}').mount.backlash == 1e-3


def test_an_existing_file_wins_over_a_name(elsewhere):
    own = elsewhere / NAME
    own.parent.mkdir()
    own.write_text((shipped() / "base/kadmiri-2012.toml").read_text())
    assert find(NAME) == Path(NAME)
    assert load(NAME).title == load("base/kadmiri-2012").title
    (elsewhere / "top.toml").write_text(f'extends = "{NAME}"\n')
    assert load("top.toml").title == load("base/kadmiri-2012").title


def test_a_folder_does_not_hide_a_name(elsewhere):
    (elsewhere / NAME).mkdir(parents=True)
    assert load(NAME).path == shipped() / f"{NAME}.toml"


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("rigaud-2020/fig5-20rmp", NAME),
        ("fig5-20rpm", NAME),
        (f"{NAME}.toml", NAME),
        (f"scenarios/{NAME}.toml", NAME),
        ("base/rigaud", "base/rigaud-2020"),
    ],
)
def test_an_unknown_name_is_one_fault_with_the_nearest(word, meant):
    with pytest.raises(InputError) as error:
        load(word)
    (fault,) = error.value.faults
    assert fault.remedy == f"did you mean {meant!r}?"


def test_an_unknown_name_that_is_extended_is_a_fault_of_the_file(elsewhere):
    (elsewhere / "top.toml").write_text('extends = "rigaud-2020/fig5-20rmp"\n')
    with pytest.raises(InputError) as error:
        load("top.toml")
    (fault,) = error.value.faults
    assert (fault.key, fault.file, fault.remedy) == ("extends", "top.toml", f"did you mean {NAME!r}?")


def test_a_missing_file_is_compared_with_files_first(elsewhere):
    (elsewhere / "fig5.toml").write_text("format = 1\n")
    with pytest.raises(InputError, match=r"did you mean 'fig5.toml'\?"):
        load("fig6.toml")


def test_nothing_near_says_where_the_names_are():
    with pytest.raises(InputError, match="gears3d list scenarios"):
        load("zzz")
