"""Readers that go away, and arguments that are nothing that could be meant."""

import subprocess
import sys

import pytest

import gears3d as g3
from gears3d.comparison import compare
from gears3d.errors import UsageError
from gears3d.verification.validation import fig5

FILE = "scenarios/rigaud-2020/fig5-20rpm.toml"


def piped(*words, stderr=False):
    """Exit code and stderr of a verb whose reader has gone before the first line."""
    command = [sys.executable, "-m", "gears3d", *words]
    errors = subprocess.STDOUT if stderr else subprocess.PIPE
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True) as process:
        process.stdout.close()
        told = "" if stderr else process.stderr.read()
        return process.wait(timeout=120), told


@pytest.mark.parametrize("words", [("schema",), ("--help",), ("show", FILE), ("check", FILE)])
def test_a_reader_that_goes_away_is_no_error(words):
    assert piped(*words) == (0, "")


def test_exit_codes_stay_what_they_are():
    assert piped("check", "nowhere.toml")[0] == 3
    assert piped("check", "nowhere.toml", stderr=True)[0] == 3


def test_a_run_whose_table_nobody_reads_is_whole(tmp_path):
    out = tmp_path / "run"
    words = ("run", FILE, "--model", "rigid", "--no-views", "--set", "run.duration=1 s", "--out", str(out))
    assert piped(*words) == (0, "")
    assert (out / "summary.json").exists()


@pytest.mark.parametrize(
    "call",
    [
        lambda: g3.load(3),
        lambda: g3.load(None),
        lambda: g3.load([]),
        lambda: g3.load(FILE, 3),
        lambda: g3.load(FILE, "impact.restitution=0.3"),
        lambda: g3.load(FILE).with_(None),
        lambda: g3.simulate(None),
        lambda: g3.simulate(FILE, model=None),
        lambda: g3.simulate(FILE, "rigid", contact="located"),
        lambda: g3.simulate(FILE, "plastic", pair=fig5().pair()),
        lambda: g3.compare(None, None),
        lambda: g3.compare(3, 3),
        lambda: g3.replay(None),
        lambda: g3.replay(3),
    ],
)
def test_what_cannot_be_meant_is_a_usage_error_that_says_what_can(call):
    with pytest.raises(UsageError, match=r"give|there is no model|no choice of contact|knows no solids"):
        call()


def test_objects_say_what_they_are_in_one_line():
    scenario = fig5(run__duration="1 s")
    assert repr(scenario) == (
        "Scenario('Rigaud & Perret-Liaudet 2020, fig. 5, 20 rpm', 90:90 teeth, 30 rpm + 20 rpm at 3 Hz, 1 s)"
    )
    effect = [{"kind": "drag_viscous", "coefficient": "1e-3 N m s/rad"}]
    assert repr(scenario.with_({"effect": effect})).endswith(", 1 s, drag_viscous)")
    run = g3.simulate(scenario, "rigid")
    text = repr(compare(run, run))
    assert "\n" not in text
    assert text.startswith("Comparison(trajectory, ")
    assert "missed, 0 invented, speed error 0 (median), 0 (95 %), double_sided)" in text
