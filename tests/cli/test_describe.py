"""``gears3d report`` says of any recording what the models say of their own."""

import json

import numpy as np
import pytest

from gears3d import describe, load, simulate
from gears3d.cli import main
from gears3d.recording import Recording, settled, spectra
from gears3d.signals import lines
from gears3d.views.plots.pictures import recording_picture as picture

SCENARIO = "scenarios/rigaud-2020/fig5-20rpm.toml"


@pytest.fixture(scope="module")
def recording():
    return simulate(load(SCENARIO), "rigid")


@pytest.fixture(scope="module")
def folder(recording, tmp_path_factory):
    place = tmp_path_factory.mktemp("run")
    recording.write(place)
    return place


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        main(["report", *map(str, arguments)])
    said = capsys.readouterr()
    return end.value.code, said.out, said.err


def test_json_is_what_python_says_and_the_lines_of_the_spectra(recording, folder, capsys):
    code, out, _ = run(capsys, folder, "--json", "--lines", 2)
    said = json.loads(out)
    assert code == 0
    assert {key: value for key, value in said.items() if key != "spectra"} == describe(recording)
    first = said["spectra"]["frequency"]["lines"][0]
    assert first["frequency_Hz"] == pytest.approx(3.0, rel=1e-5)  # on a bin but for a third of a sample in 86 667
    assert said["spectra"]["order_drive"]["lines"][0]["order"] == 6.0  # 3 Hz at 30 rpm
    assert len(said["spectra"]["frequency"]["lines"]) == 2


def test_the_strongest_line_is_the_fourier_coefficient_of_the_path(recording):
    part = settled(recording)
    time, place = part.time, part.signals["displacement_m"]
    assert (time[-1] - time[0]) * 3 == pytest.approx(13, abs=1e-3)
    direct = 2 * abs(np.mean((place - place.mean()) * np.exp(-6j * np.pi * time)))
    assert lines(spectra(recording)["frequency"], 1)[0][1] == pytest.approx(direct, rel=1e-3)


def test_blows_after_flights_across_are_told_apart_from_bounces(recording, folder, capsys):
    """At e = 0.3 the first blow of each burst is that of the plastic orbit; bounces pull the mean to 11.34 mm/s."""
    found = describe(recording)
    assert found["active_crossing_velocity_mean_m_s"] == pytest.approx(-31.2426e-3, rel=1e-4)
    assert found["active_velocity_mean_m_s"] == pytest.approx(-11.34e-3, rel=1e-3)
    assert "31.24 mm/s" in run(capsys, folder)[1]


def test_no_lines_are_a_usage_error(folder, capsys):
    assert run(capsys, folder, "--lines", "-4")[0] == 2


def test_a_scenario_is_no_recording(capsys):
    code, _, said = run(capsys, SCENARIO)
    assert code == 3
    assert "name a run folder" in said
    assert "magic bytes" not in said


def test_the_table_and_the_picture(folder, tmp_path, capsys):
    code, out, _ = run(capsys, folder, "--out", tmp_path / "a.svg")
    assert code == 0
    for text in ("double sided, 1T", "excitation Λ", "12.5", "24.06 ms", "3 Hz", "picture written to"):
        assert text in out
    assert (tmp_path / "a.svg").read_text(encoding="utf-8").startswith("<?xml")
    assert run(capsys, folder, "--out", tmp_path / "a.gif")[0] == 2


def test_a_recording_of_little_is_drawn_and_told_without_what_it_lacks(recording):
    bare = Recording(
        {key: recording.signals[key] for key in ("time_s", "theta_drive_rad", "theta_loose_rad")},
        {key: recording.impacts[key] for key in ("time_s", "flank", "velocity_m_s")},
    )
    told = describe(bare)
    assert told["regime"] == "double_sided"
    assert told["energy_J_s"] is told["flight_share"] is told["excitation"] is told["durations_from"] is None
    assert set(spectra(bare).values()) == {None}
    assert len(picture(bare).axes) == 6


def test_a_bare_record_is_refused(recording, tmp_path, capsys):
    keep = ("time_s", "theta_drive_rad", "theta_loose_rad")
    Recording({key: recording.signals[key] for key in keep}).write(tmp_path / "a.csv")
    code, _, err = run(capsys, tmp_path / "a.csv")
    assert code == 3
    assert "not a table of impacts" in err
