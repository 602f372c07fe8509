"""``gears3d excitation``: table, JSON of the contract, map."""

import json

import pytest

from gears3d import cli

FILE = "scenarios/rigaud-2020/fig5-20rpm.toml"


@pytest.fixture
def gears3d(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(list(map(str, arguments)))
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run


def test_the_table(gears3d):
    code, out, err = gears3d("excitation", FILE)
    assert (code, err) == (0, "")
    text = " ".join(out.split())
    assert "excitation Λ 12.47" in text
    assert "1.604 rpm at this frequency" in text
    assert "expected regime: double sided (closed form)" in text
    assert "30.86 mm/s" in text


def test_the_json_of_the_contract(gears3d):
    code, out, _ = gears3d("excitation", FILE, "--json", "--set", "impact.restitution=0")
    found = json.loads(out)
    assert code == 0
    assert set(found) == {
        "scenario", "title", "source", "mass_kg", "drag", "drag_torque_N_m", "drag_force_N", "deceleration_rad_s2",
        "backlash_m", "backlash_narrowest_m", "harmonics", "deceleration_largest_rad_s2", "excitation_total",
        "expected", "notes", "map",
    }  # fmt: skip
    assert set(found["harmonics"][0]) == {
        "source", "frequency_Hz", "amplitude_rad_s", "phase_rad", "stroke_m", "excitation", "backlash_dimensionless",
        "threshold_amplitude_rad_s", "threshold_frequency_Hz",
    }  # fmt: skip
    assert set(found["expected"]) == {"regime", "basis", "why", "periods", "impacts_per_period", "flights"}
    assert [flight["struck"] for flight in found["expected"]["flights"]] == ["reverse", "active"]


def test_the_map(gears3d, tmp_path):
    file = tmp_path / "map.png"
    code, out, _ = gears3d("excitation", FILE, "--out", file)
    assert code == 0
    assert file.read_bytes().startswith(b"\x89PNG")
    assert str(file) in out.replace("\n", "")
    assert [path.name for path in tmp_path.iterdir()] == ["map.png"]
    code, _, err = gears3d("excitation", FILE, "--out", tmp_path / "map.bmp")
    assert code == 2
    assert "ends in .png" in err


def test_bad_input_is_said(gears3d):
    assert gears3d("excitation", FILE, "--set", "drag.torque=3 mm")[0] == 3
