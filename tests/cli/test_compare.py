"""``gears3d compare``: table, picture, JSON, exit codes."""

import json

import numpy as np
import pytest

from gears3d import cli
from gears3d.comparison import KEYS
from gears3d.recording import Recording

PERIOD = 1 / 3


@pytest.fixture
def gears3d(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run


@pytest.fixture
def folders(tmp_path):
    def write(name, scale=1.0, drop=(), **meta):
        hits = {
            "time_s": np.ravel([[(k + 0.37) * PERIOD, (k + 0.87) * PERIOD] for k in range(15)]),
            "flank": np.array([1, 0] * 15),
            "velocity_m_s": scale * np.array([0.03, -0.03] * 15),
        }
        hits = {column: np.delete(values, drop) for column, values in hits.items()}
        axis = np.linspace(0, 5, 101)
        signals = dict.fromkeys(("time_s", "theta_drive_rad", "theta_loose_rad", "displacement_m"), axis)
        return Recording(signals, hits, {"period_s": PERIOD, "title": "fig. 5", **meta}).write(tmp_path / name)

    return write("a", 1.02, [4]), write("b", drop=[7]), write("other", title="fig. 6")


def test_the_table_tells_what_agrees(gears3d, folders):
    code, out, err = gears3d("compare", *folders[:2])
    assert (code, err) == (0, "")
    text = " ".join(out.split())
    assert "28 of 29 matched 1 missed, 1 invented" in text
    assert "median 2 %, 95 % below 2 % bias +2 %" in text
    assert "the same (double sided)" in text
    assert "to keep it: --out DIR (report, JSON, data), --plot FILE.png" in text


def test_json_has_the_contracts_keys_first(gears3d, folders):
    code, out, _ = gears3d("compare", *folders[:2], "--json")
    found = json.loads(out)
    assert code == 0
    assert tuple(found)[: len(KEYS)] == KEYS
    assert (found["impacts_matched"], found["mode"], found["notes"]) == (28, "trajectory", [])


def test_distribution_mode_tells_its_tests_and_power(gears3d, folders):
    code, out, _ = gears3d("compare", *folders[:2], "--mode", "distribution")
    text = " ".join(out.split())
    assert code == 0
    assert "29 in the reference, not paired" in text
    assert "active speed different (p = 0.001" in text
    assert "reverse phase no difference found (p = 1)" in text
    found = json.loads(gears3d("compare", *folders[:2], "--mode", "distribution", "--json")[1])
    assert [test["quantity"] for test in found["tests"] if test["different"]] == ["active.speed", "reverse.speed"]
    assert found["impacts_missed"] is None


def test_a_picture_is_written_where_asked(gears3d, folders, tmp_path):
    place = tmp_path / "picture.svg"
    code, out, _ = gears3d("compare", *folders[:2], "--plot", place)
    assert code == 0
    assert f"picture written to {place}" in out.replace("\n", "")
    assert place.read_text().startswith("<?xml")


def test_different_scenarios_are_warned_of(gears3d, folders):
    code, _, err = gears3d("compare", folders[0], folders[2])
    assert code == 0
    assert err == "warning: different scenarios: title is 'fig. 5' and 'fig. 6'\n"


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["{a}", "{a}/nothing"], 3, "nothing: is not there"),
        (["{a}", "{a}", "--mode", "distributed"], 2, "did you mean 'distribution'?"),
        (["{a}", "{a}", "--plot", "c.gif"], 2, "the name of this file ends in .png, .svg, .pdf"),
        (["{a}", "{a}", "--plot", "{a}/impacts.parquet/c.png"], 3, "cannot be written"),
    ],
)
def test_bad_input_is_told_in_a_line(gears3d, folders, arguments, code, message):
    done, _, err = gears3d("compare", *(argument.format(a=folders[0]) for argument in arguments))
    assert done == code
    assert message in err
    assert "Traceback" not in err


def test_a_bare_measured_record_has_no_impacts_to_compare(gears3d, tmp_path):
    file = tmp_path / "record.csv"
    file.write_text("time_s,theta_drive_rad,theta_loose_rad\n0,0,0\n1,3,3\n")
    code, _, err = gears3d("compare", str(file), str(file))
    assert code == 3
    assert "not a table of impacts" in " ".join(err.split())
    assert str(file) in "".join(err.split())
