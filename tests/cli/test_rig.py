"""A verb that needs the scenario of a test rig says so in its help and ends with the exit code of usage without it."""

import pytest
from typer.main import get_command

from gears3d import cli
from gears3d.cli import main
from gears3d.scenario import load
from gears3d.simulation import record

NAME = "rigaud-2020/fig5-20rpm"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    place = tmp_path_factory.mktemp("rig") / "rattle.parquet"
    record(load(NAME, {"run.duration": "1 s"})).write(place)
    return place


@pytest.mark.parametrize(
    "words",
    [
        ["segment", "FILE"],
        ["diagnose", "FILE"],
        ["camera", "FILE"],
        ["replay", "FILE"],
        ["replay", "FILE", "FILE"],
        ["identify", "restitution", "FILE"],
        ["identify", "threshold", "FILE"],
        ["identify", "transmission-error", "FILE"],
        ["identify", "backlash", "FILE"],
        ["identify", "coastdown", "FILE"],
        ["identify", "coastdown", "FILE", "--meshed", "FILE", "--drive-alone", "FILE"],
    ],
    ids=" ".join,
)
def test_without_a_rig_is_usage(words, file, capsys):
    with pytest.raises(SystemExit) as end:
        main([str(file) if word == "FILE" else word for word in words])
    assert end.value.code == 2
    assert "--rig" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["diagnose"], *(["identify", kind] for kind in ("threshold", "backlash"))])
def test_the_help_says_that_it_is_required(words):
    command = get_command(cli.app)
    for word in words:
        command = command.get_command(command.make_context(word, ["--help"], resilient_parsing=True), word)
    assert next(one for one in command.params if one.name == "rig").required


def test_a_map_is_proposed_without_a_rig(file, capsys):
    with pytest.raises(SystemExit) as end:
        main(["inspect", str(file), "--guess"])
    assert end.value.code in (0, None)
    assert "theta_loose_rad" in capsys.readouterr().out
