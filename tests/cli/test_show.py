"""``gears3d show``: data sheet for people and programs, drawing, errors."""

import json
from pathlib import Path

import pytest

from gears3d import cli

BASE = "scenarios/base/rigaud-2020.toml"


@pytest.fixture
def show(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(["show", *arguments])
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run


def test_sheet_for_people_has_units_and_both_gears(show):
    code, out, err = show(BASE, "--set", "gears.loose.teeth=60")
    assert (code, err) == (0, "")
    (teeth,) = [line for line in out.splitlines() if line.startswith("number of teeth")]
    assert teeth.split()[-3:] == ["z", "90", "60"]
    (normal,) = [line for line in out.splitlines() if line.startswith("normal backlash")]
    assert normal.split()[-3:] == ["j_bn", "250", "um"]
    assert "0.0695 kg m^2" in out
    assert "--plot FILE.png" in out


def test_json_is_si_and_names_the_equations(show):
    code, out, _ = show(BASE, "--json")
    answer = json.loads(out)
    assert code == 0
    sheet = {line["symbol"]: line for line in answer["sheet"]}
    assert sheet["j_bt"]["value"] == pytest.approx(250e-6, abs=1e-15)
    assert (sheet["z"]["drive"], sheet["z"]["loose"]) == (90, 90)
    assert (sheet["α_wt"]["unit"], sheet["α_wt"]["source"]) == ("rad", "ISO 21771:2007 (54), (55)")
    assert answer["inertia_simulated_kg_m2"] == {"drive": None, "loose": 0.0695}
    assert answer["drawing"] is None


@pytest.mark.parametrize(("ending", "mark"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_drawing_is_written_whole(show, tmp_path, ending, mark):
    file = tmp_path / f"mesh.{ending}"
    code, out, _ = show(BASE, "--plot", str(file))
    assert code == 0
    assert f"picture written to {file}" in out.replace("\n", "")
    assert file.read_bytes().startswith(mark)
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


def test_bad_input_and_bad_places(show, tmp_path):
    code, _, err = show(BASE, "--plot", str(tmp_path / "mesh.gif"))
    assert code == 2
    assert "the name of this file ends in .png, .svg, .pdf" in err
    code, _, err = show(BASE, "--plot", str(Path(BASE) / "mesh.png"))
    assert code == 3
    assert "cannot be written" in err
    code, _, err = show("nowhere.toml")
    assert code == 3
    assert "Traceback" not in err
