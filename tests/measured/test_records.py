"""Published measurements that ship with the tests, next to independent fits of the same readings."""

import json
from pathlib import Path

import numpy as np
import pytest

from gears3d.cli import main

RECORDS = Path(__file__).parent / "records"
GYROSCOPE = """format = 1
file = "gyroscope.csv"
[time]
channel = "time"
unit = "min"
[loose]
channel = "speed"
unit = "rpm"
"""


def identified(capsys, *words):
    """Return what a verb of identification prints as JSON."""
    with pytest.raises(SystemExit) as stop:
        main(["identify", *map(str, words), "--json"])
    assert stop.value.code == 0
    return json.loads(capsys.readouterr().out)


def test_a_gyroscope_slows_down_as_its_author_states(tmp_path, capsys):
    (tmp_path / "gyroscope.csv").write_bytes((RECORDS / "gyroscope.csv").read_bytes())
    (tmp_path / "gyroscope.toml").write_text(GYROSCOPE)
    found = identified(capsys, "coastdown", tmp_path / "gyroscope.toml", "--inertia", "1 kg m^2")
    one = found["parameters"]["viscous"]
    minutes, rpm = np.loadtxt(RECORDS / "gyroscope.csv", delimiter=",", skiprows=1, unpack=True)
    own = -float(np.polyfit(60.0 * minutes, np.log(rpm), 1, w=rpm)[0])
    assert found["law"] == "viscous"
    assert one["value"] == pytest.approx(own, rel=0.005)
    assert one["ci95"][0] < 6.531e-4 < one["ci95"][1]  # 0.0006531 ± 0.0000042 1/s by the author


def test_corners_of_a_cube_rebound_with_a_scatter_that_is_not_normal(capsys):
    found = identified(capsys, "restitution", RECORDS / "cube-tosses.csv")
    before, after = np.loadtxt(RECORDS / "cube-tosses.csv", delimiter=",", skiprows=1, unpack=True)
    ratios = (after / before)[after > 0.0]
    one, scatter = (found["parameters"][name] for name in ("restitution", "standard_deviation"))
    assert found["goodness"]["pairs"] == len(ratios) == 569
    assert one["ci95"][0] <= np.median(ratios) + 1e-12  # the interval includes both centres
    assert np.mean(ratios) < one["ci95"][1]
    assert 1.4826 * np.median(np.abs(ratios - np.median(ratios))) < scatter["value"] < np.std(ratios)
    assert any("not normal" in one for one in found["warnings"])


def test_impacts_of_no_gear_are_on_no_flank(tmp_path):
    with pytest.raises(SystemExit):
        main(["identify", "restitution", str(RECORDS / "cube-tosses.csv"), "--out", str(tmp_path / "cube")])
    page = (tmp_path / "cube" / "report.html").read_text()
    assert '"label":"impacts of the list"' in page
    assert '"label":"active' not in page
