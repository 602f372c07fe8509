"""Raw channels are proposed as what they are: quadrature, pulses, increments; the rate of the file wins."""

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.measured.checks import examine
from gears3d.measured.readers import propose, read
from gears3d.scenario import load

TEETH = (30, 45)
FINE = np.arange(40_000) / 40_000.0
FAST = 2 * np.pi * 7.3 * FINE + 0.05 * np.sin(2 * np.pi * 3.0 * FINE)
SLOW = FAST * TEETH[0] / TEETH[1]
COARSE = slice(None, None, 8)
RATE = 5000


def rig_of(rate, counts):
    return load(
        {
            "format": 1,
            "gears": {"module": "3 mm", "drive": {"teeth": TEETH[0]}, "loose": {"teeth": TEETH[1]}},
            "mount": {"backlash": "200 um"},
            "motion": {"mean": f"{7.3 * 60} rpm"},
            "sensors": {"sample_rate": rate, "counts_per_revolution": counts},
        }
    )


@pytest.fixture(scope="module")
def rig():
    return rig_of("40 kHz", 2000)


@pytest.fixture(scope="module")
def slow_rig():
    return rig_of("5 kHz", 8000)


def write(path, columns, header=""):
    lines = [*([header] if header else []), ";".join(columns)]
    lines += [";".join(f"{each:.9g}" for each in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def proposed(path, rig):
    text = propose(path, rig, path.parent)
    (path.parent / "record.toml").write_text(text)
    return text, read(path.parent / "record.toml")


def turns(angle):
    return angle - angle[0]


def quadrature_of(angle, lines, sense=1):
    """Return A and B; A leads where the angle grows."""
    place = (sense * angle * lines / (2 * np.pi)) % 1.0
    return (place < 0.5).astype(float), ((place - 0.25) % 1.0 < 0.5).astype(float)


@pytest.mark.parametrize("with_index", [True, False])
@pytest.mark.parametrize("sense", [1, -1])
def test_raw_quadrature_is_decoded(with_index, sense, tmp_path, rig):
    (a1, b1), (a2, b2) = quadrature_of(FAST, 500), quadrature_of(SLOW, 500, sense)
    mark = (np.abs((FAST + 1.0) % (2 * np.pi) - np.pi) < 0.1).astype(float)
    columns = {"t [s]": FINE, "A1": a1, "B1": b1} | ({"Z1": mark} if with_index else {}) | {"A2": a2, "B2": b2}
    text, found = proposed(write(tmp_path / "run.csv", columns), rig)
    assert ("index = {" in text) == with_index
    count = 2 * np.pi / 2000
    for name, angle in (("theta_drive_rad", FAST), ("theta_loose_rad", SLOW)):
        np.testing.assert_allclose(turns(found.columns[name]), turns(angle), rtol=0, atol=1.5 * count)
    with pytest.raises(InputError, match="are raw quadrature, and the lines of its encoder are not known"):
        propose(tmp_path / "run.csv")


def test_sampled_pulses_are_a_tacho(tmp_path, rig):
    pulses = [
        5.0 * ((angle * teeth / (2 * np.pi)) % 1.0 < 0.5) for angle, teeth in zip((FAST, SLOW), TEETH, strict=True)
    ]
    path = write(tmp_path / "run.csv", {"t [s]": FINE, "p1": pulses[0] + 0.02, "p2": pulses[1] - 0.03})
    text, found = proposed(path, rig)
    assert 'kind = "tacho", positions = 30' in text
    assert 'kind = "tacho", positions = 45' in text
    time = found.columns["time_s"]
    for name, angle in (("theta_drive_rad", FAST), ("theta_loose_rad", SLOW)):
        turned = np.ptp(np.interp(time, FINE, angle))
        assert np.ptp(found.columns[name]) == pytest.approx(turned, rel=5e-3)
    with pytest.raises(InputError, match="how many are a revolution is not known"):
        propose(path)


def test_counts_since_the_last_sample_are_added_up(tmp_path, slow_rig):
    angles = FAST[COARSE], SLOW[COARSE]
    counted = [np.diff(np.floor(angle * 8000 / (2 * np.pi)), prepend=0.0) for angle in angles]
    path = write(tmp_path / "run.csv", {"t": FINE[COARSE], "enc 1 count": counted[0], "enc 2 count": counted[1]})
    with pytest.raises(InputError, match="how many are a revolution is not to be guessed"):
        propose(path)
    text, found = proposed(path, slow_rig)
    assert text.count("increments = true") == 2
    for name, angle in zip(("theta_drive_rad", "theta_loose_rad"), angles, strict=True):
        np.testing.assert_allclose(turns(found.columns[name]), turns(angle), rtol=0, atol=2 * np.pi / 8000)


@pytest.mark.parametrize("names", [("d1 [counts]", "d2 [counts]"), ("increments 1", "increments 2")])
def test_increments_are_not_taken_for_counts(names, tmp_path, slow_rig):
    angles = FAST[COARSE], SLOW[COARSE]
    counted = [np.diff(np.floor(angle * 8000 / (2 * np.pi)), prepend=0.0) for angle in angles]
    columns = {"t [s]": FINE[COARSE], names[0]: counted[0], names[1]: counted[1]}
    text, found = proposed(write(tmp_path / "run.csv", columns), slow_rig)
    assert text.count("increments = true") == 2
    np.testing.assert_allclose(turns(found.columns["theta_loose_rad"]), turns(angles[1]), rtol=0, atol=2 * np.pi / 8000)


def test_counts_that_go_forth_and_back_are_not_taken_for_increments(tmp_path, slow_rig):
    angle = 0.2 * np.sin(2 * np.pi * 3.0 * FINE[COARSE]) + 0.3
    counts = np.floor(angle * 8000 / (2 * np.pi))
    columns = {"t [s]": FINE[COARSE], "enc 1 [counts]": counts, "enc 2 [counts]": np.floor(counts * 2 / 3)}
    text, _ = proposed(write(tmp_path / "run.csv", columns), slow_rig)
    assert "increments" not in text


def test_increments_of_a_speed_are_refused(tmp_path):
    path = write(tmp_path / "run.csv", {"t [s]": FINE[:50], "n [rpm]": FINE[:50]})
    chart = tmp_path / "record.toml"
    chart.write_text('format = 1\n[time]\nchannel = "t"\n[drive]\nchannel = "n"\nincrements = true\n')
    with pytest.raises(InputError, match=r"drive.increments: is given for a speed or a sawtooth"):
        read(path, chart)


def test_no_speed_that_no_rig_reaches_becomes_a_condition(tmp_path, slow_rig):
    columns = {"t [s]": FINE[COARSE], "drive [rad]": 600 * FAST[COARSE], "loose [rad]": 600 * SLOW[COARSE]}
    text, found = proposed(write(tmp_path / "run.csv", columns), slow_rig)
    assert not found.condition
    assert "NOT SURE: the drive would turn at" in text
    fast = {"t [s]": FINE[COARSE], "angle": 10 * np.degrees(FAST[COARSE])}
    assert 'unit = "deg"' in propose(write(tmp_path / "fast.csv", fast))


@pytest.mark.parametrize(
    ("name", "unit", "factor"), [("n_1 rpm", "rpm", 30 / np.pi), ("n_1_deg_s", "deg/s", 180 / np.pi)]
)
def test_units_at_the_end_of_a_name(name, unit, factor, tmp_path):
    speed = np.gradient(FAST, FINE)[COARSE]
    path = write(tmp_path / "run.csv", {"t_s": FINE[COARSE], name: factor * speed, "n_2 rpm": speed * 20 / np.pi})
    text, found = proposed(path, None)
    assert f'unit = "{unit}"' in text
    np.testing.assert_allclose(turns(found.columns["theta_drive_rad"]), turns(FAST[COARSE]), atol=1e-3)


def test_the_rate_of_the_file_wins_over_the_rigs(tmp_path, slow_rig):
    columns = {"drive [rad]": FAST[COARSE], "loose [rad]": SLOW[COARSE]}
    text, found = proposed(write(tmp_path / "run.csv", columns, "Sample rate: 5.1 kHz"), slow_rig)
    assert np.median(np.diff(found.columns["time_s"])) == pytest.approx(1 / 5100)
    assert "declared by the file" in text


def test_contradicting_rates_are_an_error(tmp_path, slow_rig):
    columns = {"drive [rad]": FAST[COARSE], "loose [rad]": SLOW[COARSE]}
    path = write(tmp_path / "run.csv", columns, "Sample rate: 10 kHz")
    with pytest.raises(InputError, match=r"states 10000 Hz, the rig sensors.sample_rate = 5000 Hz .*\[condition\]"):
        propose(path, slow_rig)
    chart = tmp_path / "own.toml"
    chart.write_text('format = 1\n[time]\nsample_rate = "5 kHz"\n[drive]\nchannel = "drive"\n')
    with pytest.raises(InputError, match="is 5000 Hz, the file states 10000 Hz"):
        read(path, chart)
    chart.write_text('format = 1\n[drive]\nchannel = "drive"\n[loose]\nchannel = "loose"\n')
    (finding,) = [each for each in examine(read(path, chart), slow_rig) if each.kind == "sample-rate"]
    assert finding.fatal
    assert "10000 Hz, the rig declares 5000 Hz" in finding.evidence


@pytest.mark.parametrize("unit", ["s", "ms"])
def test_epochs_lose_no_digits(unit, tmp_path):
    scale = {"s": 1.0, "ms": 1e3}[unit]
    lines = [f"{scale * 1_764_000_000 + scale * 0.002 * k:.3f};{k}" for k in range(300)]
    (tmp_path / "run.csv").write_text("time;a\n" + "\n".join(lines))
    chart = tmp_path / "record.toml"
    chart.write_text(f'format = 1\n[time]\nchannel = "time"\nunit = "{unit}"\n[drive]\nchannel = "a"\nunit = "deg"\n')
    np.testing.assert_allclose(read(tmp_path / "run.csv", chart).columns["time_s"], 0.002 * np.arange(300), atol=1e-7)


def test_a_time_that_contradicts_the_rigs_rate_is_an_error(tmp_path, slow_rig):
    columns = {"t [s]": 10 * FINE[COARSE], "drive [rad]": FAST[COARSE], "loose [rad]": SLOW[COARSE]}
    path = write(tmp_path / "run.csv", columns)
    with pytest.raises(InputError, match=r"time: t \[s\] in s makes 500 Hz, the rig sensors.sample_rate = 5000 Hz"):
        propose(path, slow_rig)
    assert 'unit = "s"' in propose(path)


def test_a_rig_that_states_no_rate_contradicts_none(tmp_path):
    sections = {"gears": {"module": "3 mm", "drive": {"teeth": TEETH[0]}, "loose": {"teeth": TEETH[1]}}}
    rig = load({"format": 1, **sections, "mount": {"backlash": "200 um"}, "motion": {"mean": f"{7.3 * 60} rpm"}})
    columns = {"drive [rad]": FAST[COARSE], "loose [rad]": SLOW[COARSE]}
    text, found = proposed(write(tmp_path / "run.csv", columns, "Sample rate: 5 kHz"), rig)
    assert "declared by the file" in text
    assert not [each for each in examine(found, rig) if each.kind == "sample-rate"]


def test_a_column_that_rises_at_the_stated_rate_is_the_time(tmp_path, slow_rig):
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"data": np.column_stack([FINE, FAST, SLOW])[COARSE], "fs": 5000.0})
    _, found = proposed(tmp_path / "run.mat", slow_rig)
    np.testing.assert_allclose(turns(found.columns["theta_drive_rad"]), turns(FAST[COARSE]), rtol=0, atol=1e-12)
    np.testing.assert_allclose(turns(found.columns["theta_loose_rad"]), turns(SLOW[COARSE]), rtol=0, atol=1e-12)


def test_positions_at_stops_are_no_quadrature(tmp_path):
    random = np.random.default_rng(2)
    stops = [np.repeat(random.choice([0, 900, 450], 80, p=[0.48, 0.48, 0.04]), 9) for _ in range(2)]
    columns = {"t [s]": np.arange(720) / 10, "pos": stops[0], "speed": np.roll(stops[0], 4)}
    with pytest.raises(InputError) as caught:
        propose(write(tmp_path / "run.csv", columns))
    assert "quadrature" not in str(caught.value)
