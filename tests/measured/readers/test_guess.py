"""Proposed maps read the file that they were made from, and come to the true angles."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError
from gears3d.measured.readers import files_of, propose, read
from gears3d.scenario import load
from gears3d.units import parse

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
    text = propose(path, None, path.parent)
    assert "DOUBTFUL in 3 points" in text.splitlines()[0]
    assert text.count("NOT SURE of the unit") == 3
    chart = tmp_path / "record.toml"
    chart.write_text(text)
    with pytest.raises(InputError, match=r"time.unit: is missing: t tells none .*write unit"):
        read(chart)
    chart.write_text(text.replace('# unit = "s"', 'unit = "ms"').replace('# unit = "rpm"', 'unit = "rad/s"'))
    found = read(chart).columns
    np.testing.assert_allclose(found["time_s"], TIME, atol=1e-9)
    np.testing.assert_allclose(turns(found["theta_drive_rad"]), turns(DRIVE), rtol=0, atol=2e-5)


NOISE = np.random.default_rng(3)
STRANGE = {
    "weather": {"time_s": 600 * np.arange(500), "temp": 15 + NOISE.normal(size=500), "wind_speed [rpm]": np.arange(500),
                "wind_direction [deg]": NOISE.integers(0, 360, 500), "rain_total": np.cumsum(NOISE.random(500))},
    "power": {"time [s]": np.arange(500) / 10, "voltage": 230 + NOISE.normal(size=500), "energy": np.arange(500) / 7,
              "output_voltage": np.arange(500), "input_voltage": 12 + NOISE.normal(size=500)},
    "place": {"time [s]": np.arange(500), "lat [deg]": 48 + np.arange(500) / 1e5, "lon [deg]": np.arange(500) / 1e5},
    "temperatures": {"t [s]": TIME[:500], "T1": 20 + TIME[:500], "T2": 20 + 0.7 * TIME[:500]},
    "sales": {"t [s]": TIME[:500], "in": np.arange(500) * 3, "out": np.arange(500) * 2},
    "no names": {"0": TIME[:500], "1": 7 * TIME[:500], "2": 3 * TIME[:500]},
    "commands": {"t [s]": TIME[:500], "target angle [deg]": 7 * TIME[:500], "load 1": TIME[:500], "load 2": TIME[:500]},
}  # fmt: skip


@pytest.mark.parametrize("with_rig", [False, True])
@pytest.mark.parametrize("name", STRANGE)
def test_tables_of_other_things_are_no_gears(name, with_rig, tmp_path, rig):
    path = write(tmp_path / "run.csv", STRANGE[name])
    with pytest.raises(InputError, match="no signal looks like the angle or speed of a gear"):
        propose(path, rig if with_rig else None)


def test_a_speed_that_is_alone_is_no_other_signals_gear(tmp_path, rig):
    columns = {"t [s]": TIME, "throttle": TIME, "rpm": 30 / np.pi * OMEGA[1], "coolant": 60 + TIME, "n2 command": TIME}
    text = propose(write(tmp_path / "run.csv", columns), rig)
    assert '[loose]\nchannel = "rpm"' in text
    assert "[drive]" not in text


def test_a_rig_that_fits_neither_speed_nor_teeth_gives_no_condition(tmp_path, rig):
    columns = {"t [s]": TIME, "angle 1 [deg]": np.degrees(DRIVE) / 100, "angle 2 [deg]": np.degrees(LOOSE)}
    text, found = proposed(write(tmp_path / "run.csv", columns), rig)
    assert not found.condition
    assert "it may be another rig, or no rig at all" in text
    assert "DOUBTFUL in 2 points" in text.splitlines()[0]


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


@pytest.mark.slow
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


def test_a_gear_of_another_rate_is_reported(tmp_path, rig):
    from asammdf import MDF, Signal

    file = MDF(version="4.10")
    file.append([Signal(DRIVE, TIME, name="phi_drive", unit="rad")])
    file.append([Signal(LOOSE[::2], TIME[::2], name="phi_loose", unit="rad")])
    file.save(tmp_path / "run.mf4")
    text, _ = proposed(tmp_path / "run.mf4", rig)
    assert "NOT taken: 'group 2/phi_loose' has another rate" in text
    assert "DOUBTFUL in 1 point," in text.splitlines()[0]


@pytest.mark.parametrize(("factor", "meant"), [(np.pi / 180, "rad were meant"), (1 / 360, "revolutions"), (0.05, "")])
def test_a_speed_far_from_the_rigs_is_doubtful_and_no_condition(factor, meant, tmp_path, rig):
    columns = {"t [s]": TIME, "drive [rad]": factor * DRIVE, "loose [rad]": factor * LOOSE}
    text, found = proposed(write(tmp_path / "run.csv", columns), rig)
    assert not found.condition
    assert "NOT SURE: the drive would turn at" in text
    assert ("as if " + meant in text) == bool(meant)


@pytest.mark.parametrize(("unit", "factor"), [("rad/s", 30 / np.pi), ("rpm", 1.0)])
def test_speeds_in_the_unit_that_a_file_does_not_state_are_doubtful(unit, factor, tmp_path, rig):
    speeds = {name: factor * np.gradient(angle, TIME) for name, angle in (("n1", DRIVE), ("n2", LOOSE))}
    columns = {"t [s]": TIME, **{f"{name} [{unit}]": speed for name, speed in speeds.items()}}
    text, found = proposed(write(tmp_path / "run.csv", columns), rig)
    assert not found.condition
    assert "meant where it says " + unit in text


def test_travels_of_part_of_a_record_are_stated_as_such(tmp_path, rig):
    more = TIME[-1] + TIME[1] + np.arange(200_000) * TIME[1]
    speed = (DRIVE[-1] - DRIVE[0]) / TIME[-1]
    drive = np.concatenate([DRIVE, DRIVE[-1] + speed * (more - TIME[-1])])
    columns = {"t [s]": np.concatenate([TIME, more]), "drive [rad]": drive, "loose [rad]": 2 / 3 * drive}
    assert "revolutions in the first 200000 samples" in propose(write(tmp_path / "run.csv", columns), rig)
    short = {name: values[:50_000] for name, values in columns.items()}
    assert "samples" not in propose(write(tmp_path / "run.csv", short), rig)


def test_a_time_that_does_not_change_is_doubtful(tmp_path, rig):
    path = write(tmp_path / "run.csv", {"t [s]": 0 * TIME, "drive [rad]": DRIVE, "loose [rad]": LOOSE})
    assert "NOT SURE: 't [s]' is called a time and does not change" in propose(path, rig)


def test_two_uneven_columns_are_no_times_of_edges(tmp_path):
    time = np.cumsum(np.random.default_rng(1).uniform(0.5, 2.0, 50))
    path = write(tmp_path / "run.csv", {"0": time, "1": np.cos(time)})
    with pytest.raises(InputError, match="time: is not to be guessed"):
        propose(path)
    with pytest.raises(InputError, match="it may be the times of edges"):
        propose(write(tmp_path / "stamps.csv", {"0": time}))


def test_units_in_capitals_and_names_with_a_stroke(tmp_path):
    columns = {"t [s]": TIME, "input velocity (Rad/S)": OMEGA[0], "output (RAD/S)": OMEGA[1], "Target/4": TIME}
    text, found = proposed(write(tmp_path / "run.csv", columns))
    assert "Target" not in text.split("# not used")[0]
    np.testing.assert_allclose(turns(found.columns["theta_drive_rad"]), turns(DRIVE), rtol=0, atol=2e-5)


def test_a_velocity_without_unit_gets_none_from_the_other_gear_alone(tmp_path):
    columns = {"time_s": TIME, "wheel_rpm": 30 / np.pi * OMEGA[1], "velocity": 0.3 * OMEGA[1]}
    text = propose(write(tmp_path / "run.csv", columns), None, tmp_path)
    assert '\n# unit = "' in text.split("[drive]")[1].split("[loose]")[0]
    assert '[loose]\nchannel = "wheel_rpm"\nunit = "rpm"' in text


def loaded(chart):
    return [read(file, mapped) for file, mapped in files_of([chart])]


def runs(tmp_path, *columns):
    return [write(tmp_path / f"run-{k}.csv", one) for k, one in enumerate(columns)]


def test_one_map_of_several_files_has_what_they_share_once_and_their_speeds_apart(tmp_path, rig):
    names = ("Zeit [s]", "Antrieb [deg]", "Abtrieb [deg]")
    speeds = (1.0, 0.5, 1.5)
    files = runs(tmp_path, *(
        dict(zip(names, (TIME, np.degrees(part * DRIVE), np.degrees(part * LOOSE)), strict=True)) for part in speeds
    ))  # fmt: skip
    text = propose(files, rig, tmp_path)
    assert text.startswith("# Proposed from 3 files; check")
    for table in ("[time]", "[drive]", "[loose]"):
        assert text.splitlines().count(table) == 1
    assert text.count("[[record]]") == 3
    chart = tmp_path / "record.toml"
    chart.write_text(text)
    found = loaded(chart)
    assert [Path(one.file).name for one in found] == [file.name for file in files]
    for one, part in zip(found, speeds, strict=True):
        np.testing.assert_allclose(turns(one.columns["theta_drive_rad"]), turns(part * DRIVE), rtol=0, atol=1e-9)
    conditions = [one.condition for one in found]
    assert not conditions[0]  # the rig's own speed
    means = [parse(one["motion.mean"], "speed") for one in conditions[1:]]
    np.testing.assert_allclose(means, [0.5 * 2 * np.pi * 7.3, 1.5 * 2 * np.pi * 7.3], rtol=2e-3)


def test_what_differs_between_the_files_of_a_map_stands_below_its_record(tmp_path, rig):
    first = {"Zeit [s]": TIME, "Antrieb [deg]": np.degrees(DRIVE), "Abtrieb [deg]": np.degrees(LOOSE)}
    files = runs(tmp_path, first, {**first, "Abtrieb [deg]": -np.degrees(LOOSE)})
    text = propose(files, rig, tmp_path)
    assert "\n[drive]\n" in text
    assert text.count("[record.loose]") == 2
    assert "\n[loose]\n" not in text
    chart = tmp_path / "record.toml"
    chart.write_text(text)
    for one in loaded(chart):
        np.testing.assert_allclose(turns(one.columns["theta_loose_rad"]), turns(LOOSE), rtol=0, atol=1e-9)


def test_doubts_of_a_common_table_count_once(tmp_path):
    one = {"t": 1e3 * TIME, "speed 1": OMEGA[0], "speed 2": OMEGA[1]}
    text = propose(runs(tmp_path, one, one), None, tmp_path)
    assert "Proposed from 2 files: DOUBTFUL in 3 points" in text.splitlines()[0]
