"""Proposed maps read the file that they were made from, and come to the true angles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError
from gears3d.measured.readers import propose, read
from gears3d.scenario import load

RATE = 5000.0
TIME = np.arange(5000) / RATE
TEETH = (30, 45)
DRIVE = 2 * np.pi * 7.3 * TIME + 0.4 * np.sin(2 * np.pi * 3.0 * TIME)
LOOSE = DRIVE * TEETH[0] / TEETH[1] + 1e-3 * np.sin(2 * np.pi * 11.0 * TIME)
OMEGA = np.gradient(DRIVE, TIME), np.gradient(LOOSE, TIME)


@pytest.fixture(scope="module")
def rig():
    return load(
        {
            "format": 1,
            "gears": {"module": "3 mm", "drive": {"teeth": TEETH[0]}, "loose": {"teeth": TEETH[1]}},
            "mount": {"backlash": "200 um"},
            "motion": {"mean": f"{7.3 * 60} rpm"},
            "sensors": {"sample_rate": "5 kHz", "counts_per_revolution": 8000},
        }
    )


def write(path, columns, header="", delimiter=";"):
    lines = [header] if header else []
    if not all(name.isdigit() for name in columns):
        lines.append(delimiter.join(columns))
    lines += [delimiter.join(repr(float(each)) for each in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def proposed(path, rig=None):
    """Return the proposed map and what it reads."""
    text = propose(path, rig, path.parent)
    chart = path.parent / "record.toml"
    chart.write_text(text)
    return text, read(chart)


def turns(angle):
    return angle - angle[0]


FILES = {
    "words for gears and units in brackets": (
        {"Zeit [ms]": 1e3 * TIME, "Abtrieb [deg]": np.degrees(LOOSE), "Antrieb [deg]": np.degrees(DRIVE)},
        1e-9,
        False,
    ),
    "numbers for gears, one of them a speed": (
        {"t": TIME, "T_oil [degC]": 40 + TIME, "n1 [1/min]": OMEGA[0] * 30 / np.pi, "phi2 [rad]": LOOSE},
        2e-5,
        False,
    ),
    "no units, speeds, the rig tells": ({"t": TIME, "speed_1": OMEGA[0] * 30 / np.pi, "speed_2": OMEGA[1]}, 2e-5, True),
    "no units, angles, the rig tells": (
        {"time": 1e3 * TIME, "angle 1": np.degrees(DRIVE), "angle 2": LOOSE},
        1e-9,
        True,
    ),
    "no names at all, the rig tells": ({"0": TIME, "1": DRIVE, "2": LOOSE}, 1e-9, True),
    "sawtooth and backwards": (
        {"t_s": TIME, "drive_deg [deg]": np.degrees(DRIVE) % 360, "driven [deg]": -np.degrees(LOOSE) % 360},
        1e-9,
        False,
    ),
    "counts of the rig's encoders": (
        {"t": TIME, "enc1": np.floor(DRIVE * 8000 / (2 * np.pi)), "enc2": np.floor(LOOSE * 8000 / (2 * np.pi))},
        2 * np.pi / 8000,
        True,
    ),
    "no time but a rate above the numbers": ({"drive [rad]": DRIVE, "loose [rad]": LOOSE}, 1e-9, False),
    "places changed, only the teeth tell": ({"t": TIME, "a [rad]": LOOSE, "b [rad]": DRIVE}, 1e-9, True),
}


@pytest.mark.parametrize("name", FILES)
def test_a_proposed_map_reads_the_file_to_the_truth(name, tmp_path, rig):
    columns, slack, with_rig = FILES[name]
    path = write(tmp_path / "run 7.txt", columns, "Sample rate: 5000 Hz" if "time" in name else "")
    text, found = proposed(path, rig if with_rig else None)
    np.testing.assert_allclose(found.columns["time_s"], TIME, rtol=0, atol=1e-9)
    np.testing.assert_allclose(turns(found.columns["theta_drive_rad"]), turns(DRIVE), rtol=0, atol=slack)
    np.testing.assert_allclose(turns(found.columns["theta_loose_rad"]), turns(LOOSE), rtol=0, atol=slack)
    assert text.count("#") > 4
    assert ("as 30 and 45 teeth in mesh do" in text) == with_rig
    assert not found.condition


def test_what_is_unsure_is_said(tmp_path):
    path = write(tmp_path / "run.csv", {"t": 1e3 * TIME, "speed 1": OMEGA[0], "speed 2": OMEGA[1]})
    text, _ = proposed(path)
    assert "NOT SURE of the unit" in text


def test_another_speed_than_the_rigs_becomes_a_condition(tmp_path, rig):
    path = write(tmp_path / "run.csv", {"t [s]": TIME, "drive [rad]": 2 * DRIVE, "loose [rad]": 2 * LOOSE})
    text, found = proposed(path, rig)
    assert "and not at the rig's 438 rpm" in text
    speed = float(found.condition["motion.mean"].removesuffix(" rpm"))
    assert speed == pytest.approx(2 * np.ptp(DRIVE) / np.ptp(TIME) * 30 / np.pi, rel=1e-3)


def test_gears_that_do_not_fit_the_teeth_are_told(tmp_path, rig):
    path = write(tmp_path / "run.csv", {"t [s]": TIME, "drive [rad]": DRIVE, "loose [rad]": 4 * LOOSE})
    assert "NOT as 30 and 45 teeth in mesh do, 4 times as much of the loose gear" in proposed(path, rig)[0]


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"drive [rad]": DRIVE, "loose [rad]": LOOSE}, "time: is not to be guessed"),
        ({"t": TIME, "T [degC]": TIME**2}, "no signal looks like the angle or speed of a gear"),
        (
            {"t": TIME, "enc1": np.floor(1e3 * DRIVE), "enc2": np.floor(900 * LOOSE)},
            "how many are a revolution is not to",
        ),
    ],
)
def test_what_cannot_be_guessed_is_an_error(columns, message, tmp_path):
    with pytest.raises(InputError, match=message):
        propose(write(tmp_path / "run.csv", columns))


@settings(max_examples=40, deadline=None)
@given(
    names=st.lists(st.text(max_size=12), min_size=1, max_size=5),
    kinds=st.lists(
        st.sampled_from(["time", "angle", "speed", "saw", "counts", "noise", "flat"]), min_size=5, max_size=5
    ),
)
def test_a_proposal_works_or_is_an_input_error(names, kinds, tmp_path_factory):
    import h5py

    made = {
        "time": TIME[:500],
        "angle": DRIVE[:500],
        "speed": OMEGA[0][:500],
        "saw": np.degrees(LOOSE[:500]) % 360,
        "counts": np.floor(1e4 * DRIVE[:500]),
        "noise": np.random.default_rng(1).normal(size=500),
        "flat": np.ones(500),
    }
    path = tmp_path_factory.mktemp("guess") / "run.h5"
    with h5py.File(path, "w") as file:
        for at, (name, kind) in enumerate(zip(names, kinds, strict=False)):
            clean = name.replace("/", "_").replace("\x00", "").replace(".", "")
            file.create_dataset(f"{at}{clean}".encode("utf-8", "replace"), data=made[kind])
    try:
        found = proposed(path)[1]
    except InputError as error:
        found = error
    assert isinstance(found, InputError) or len(found.columns["time_s"]) == 500
