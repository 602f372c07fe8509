"""The verb of several kinds: what there is, and what there is not."""

import json

import pytest

from gears3d import cli
from gears3d.cli.identify import KINDS


def _exit(arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(arguments)
    return stop.value.code


THERE = list(KINDS)


@pytest.mark.parametrize("kind", THERE)
def test_help_names_the_kinds_that_are_there(capsys, kind):
    assert _exit(["identify", "--help"]) == 0
    assert kind in capsys.readouterr().out


@pytest.mark.parametrize("kind", THERE)
def test_every_kind_has_an_example_and_json(capsys, kind):
    assert _exit(["identify", kind, "--help"]) == 0
    out = capsys.readouterr().out
    assert f"gears3d identify {kind}" in out
    assert "Example" in out
    assert "--json" in out
    assert "--out" in out


def test_unknown_kind_is_told_as_json(capsys):
    assert _exit(["identify", "coastdwn", "a.csv", "--json"]) == 2
    told = json.loads(capsys.readouterr().out)["error"]
    assert told["exit_code"] == 2
    assert "did you mean 'coastdown'?" in told["message"]
