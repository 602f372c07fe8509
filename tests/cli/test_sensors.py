"""``gears3d segment`` tells what is wrong with the sensors before it says anything of gears."""

import json

import pytest
from typer.testing import CliRunner

from gears3d.cli import app
from gears3d.recording import Recording
from tests.measured.checks import faults
from tests.measured.checks.clean import RIGAUD, rattling


@pytest.fixture
def file(tmp_path):
    _, columns = rattling(duration="3 s", noise=0.002)
    bad = faults.without_rows(faults.scaled(columns, **{faults.LOOSE: -1.0}), range(500, 510))
    Recording(bad).write(tmp_path / "record.parquet")
    return str(tmp_path / "record.parquet")


def test_a_gear_that_turns_backwards_is_refused_with_what_would_mend_it(file):
    told = CliRunner().invoke(app, ["segment", file, "--rig", RIGAUD])
    assert told.exit_code == 3
    assert "--correct sense" in told.stderr
    assert "[sense]" in told.stderr


def test_what_is_corrected_and_what_is_only_told_stand_in_the_summary(file):
    told = CliRunner().invoke(app, ["segment", file, "--rig", RIGAUD, "--correct", "skew,sense", "--json"])
    assert told.exit_code == 0, told.exception
    summary = json.loads(told.stdout)
    findings = {one["kind"]: one for one in summary["quality"]["findings"]}
    assert findings.keys() == {"sense", "gaps"}
    assert findings["sense"]["corrected"]
    assert not findings["gaps"]["corrected"]
    assert summary["regime"] == "double_sided"
    shown = CliRunner().invoke(app, ["segment", file, "--rig", RIGAUD, "--correct", "sense"])
    assert "gaps: time_s: 10 rows" in shown.stderr
    assert "(corrected)" in shown.stderr
