"""Faults of the file: each found with its size, and undone where that is asked for."""

from dataclasses import replace

import numpy as np
import pyarrow.parquet
import pytest

from gears3d.errors import InputError, UsageError
from gears3d.measured.checks import CORRECTABLE, admit, admit_all, correct, examine
from gears3d.measured.readers import Channels
from gears3d.recording import Recording
from tests.measured.checks import faults
from tests.measured.checks.clean import channels, rattling, turning
from tests.measured.checks.encoder_rigs import turned

LOOSE, DRIVE = faults.LOOSE, faults.DRIVE


@pytest.fixture(scope="module", params=["rattle", "contact"])
def record(request):
    return rattling() if request.param == "rattle" else turning()


def found(record, columns, **options):
    return examine(channels(columns), record[0], **options)


def the_one(record, columns):
    findings = found(record, columns)
    assert len(findings) == 1, [(one.kind, one.evidence) for one in findings]
    return findings[0]


def undone(record, columns, *kinds):
    """Columns after correction, which the gate finds nothing wrong with."""
    findings = found(record, columns)
    mended = correct(channels(columns), findings, kinds)
    assert examine(mended, record[0]) == ()
    return mended.columns


def test_nothing_is_found_in_a_clean_record(record):
    assert found(*[record, record[1]]) == ()


def test_rows_with_nan_are_told_and_left_out(record):
    _, columns = record
    rows = np.arange(5, 50_000, 1000)
    bad = faults.holes(columns, LOOSE, rows, np.inf)
    one = found(record, bad)[0]
    assert (one.kind, one.channel, one.size, one.rows[:2], one.fatal) == ("not-finite", LOOSE, 50.0, (5, 1005), True)
    mended = correct(channels(bad), [one], ["not-finite"]).columns
    assert np.array_equal(mended["time_s"], np.delete(columns["time_s"], rows))


@pytest.mark.parametrize(("value", "name"), [(0.0, LOOSE), (np.nan, LOOSE), (0.0, DRIVE), (np.inf, DRIVE)])
def test_few_single_rows_without_a_reading_are_excluded_and_reported(record, tmp_path, value, name):
    rig, columns = record
    shifted = {key: values + (100.0 if key == name else 0.0) for key, values in columns.items()}
    rows = [700, 7000, 7001, 90_000]
    bad = faults.holes(shifted, name, rows, value)
    path = tmp_path / "r.parquet"
    pyarrow.parquet.write_table(pyarrow.table(bad), path)
    own = admit(path, rig)
    one, gaps = own.findings
    assert (one.kind, one.channel, one.size, one.fatal, one.corrected) == ("drop-outs", name, 4.0, False, True)
    assert (gaps.kind, gaps.fatal) == ("gaps", False)
    assert own.warnings[0].endswith("(excluded)")
    assert np.array_equal(own.channels.columns[name], np.delete(shifted[name], rows))


def test_an_angle_that_starts_at_or_passes_zero_has_no_drop_outs(record):
    rig, columns = record
    for row in (0, 40_000):
        moved = {**columns, LOOSE: columns[LOOSE] - columns[LOOSE][row]}
        assert [one for one in examine(channels(moved), rig) if one.kind == "drop-outs"] == []


def held_back(columns, names, every, seed=None):
    """Readings are held: for ``every`` rows, or for a random number with that mean."""
    rows = np.arange(len(columns["time_s"]))
    changed = dict(columns)
    for name in names:
        new = rows % every == 0 if seed is None else np.random.default_rng(seed).random(len(rows)) < 1.0 / every
        changed[name] = columns[name][np.maximum.accumulate(np.where(new, rows, 0))]
    return changed


@pytest.mark.parametrize("names", [(LOOSE,), (DRIVE, LOOSE)])
@pytest.mark.parametrize(("every", "seed"), [(2, None), (4, None), (33, None), (3, 5)])
def test_held_readings_are_reported_with_their_rate_and_can_be_interpolated(record, names, every, seed):
    rig, columns = record
    bad = held_back(columns, names, every, seed)
    findings = examine(channels(bad), rig)
    assert [(one.kind, one.channel, one.fatal) for one in findings] == [("held", name, False) for name in names]
    assert all(one.size == pytest.approx(50e3 / every, rel=1e-9 if seed is None else 0.02) for one in findings)
    mended = correct(channels(bad), findings, ["held"]).columns
    for name in names:
        assert np.std(mended[name] - columns[name]) < 0.7 * np.std(bad[name] - columns[name])


@pytest.mark.parametrize(("every", "seed"), [(7, None), (20, None), (7, 5)])
def test_updates_between_which_fast_gears_turn_by_backlashes_are_held_not_frozen(every, seed):
    """Within a row the gears turn by 2 backlashes; a reading that then stands much longer than all others is frozen."""
    rig = turned("nothing", revolutions=20, patterns=0.0)
    bad = held_back(rig.columns, [LOOSE], every, seed)
    first, *others = examine(channels(bad), rig.scenario)
    assert (first.kind, first.channel) == ("held", LOOSE)
    assert {one.kind for one in (first, *others) if one.fatal} == set()
    bad[LOOSE][5000:5900] = bad[LOOSE][5000]
    assert ("frozen", LOOSE) in [(one.kind, one.channel) for one in examine(channels(bad), rig.scenario)]


@pytest.mark.parametrize("share", [0.01, 0.2])
def test_single_readings_that_repeat_at_random_are_held_not_frozen(share):
    rig = turned("nothing", revolutions=20, patterns=0.0)
    bad = {name: np.array(column) for name, column in rig.columns.items()}
    fresh = np.random.default_rng(8).uniform(size=len(bad[LOOSE])) > share
    fresh[0] = True
    bad[LOOSE] = bad[LOOSE][np.maximum.accumulate(np.where(fresh, np.arange(len(fresh)), 0))]
    found = examine(channels(bad), rig.scenario)
    assert [one.channel for one in found if one.kind == "held"] == [LOOSE]
    assert {one.kind for one in found if one.fatal} == set()


@pytest.mark.parametrize("every", [5, 20])
def test_held_counts_stay_counts_when_they_are_interpolated(every):
    rig, columns = rattling(noise=1e-4, counts=1_600_000)
    bad = held_back(columns, [LOOSE], every)
    (one,) = examine(channels(bad), rig)
    assert (one.kind, one.channel, one.size) == ("held", LOOSE, pytest.approx(50e3 / every))
    mended = correct(channels(bad), [one], ["held"]).columns
    count = 2 * np.pi / 1_600_000
    steps = np.diff(mended[LOOSE]) / count
    assert np.abs(steps - np.round(steps)).max() < 1e-6
    assert np.std(mended[LOOSE] - columns[LOOSE]) < 0.1 * np.std(bad[LOOSE] - columns[LOOSE])


def test_a_channel_that_is_nan_throughout_is_not_corrected(record):
    one = the_one(record, faults.holes(record[1], DRIVE, slice(None)))
    assert (one.kind, one.correctable) == ("not-finite", False)


def test_missing_and_empty_and_uneven_columns(record):
    _, columns = record
    assert the_one(record, {name: columns[name] for name in ("time_s", DRIVE)}).kind == "missing"
    assert the_one(record, {name: values[:1] for name, values in columns.items()}).kind == "empty"
    assert the_one(record, {**columns, LOOSE: columns[LOOSE][:-1]}).kind == "lengths"
    assert the_one(record, {**columns, LOOSE: columns[LOOSE].astype(str)}).kind == "not-numbers"


def test_repeated_rows(record):
    _, columns = record
    bad = faults.twice(faults.twice(columns, 900), 400)
    one = the_one(record, bad)
    assert (one.kind, one.size, one.rows) == ("duplicates", 2.0, (401, 902))
    mended = undone(record, bad, "duplicates")
    assert all(np.array_equal(mended[name], columns[name]) for name in columns)


@pytest.mark.parametrize(("tick", "bits"), [(1e-6, 20), (20e-6, 16), (1e-9, 30)])
def test_a_clock_that_wraps(record, tick, bits):
    _, columns = record
    bad = faults.clock_wrap(columns, tick, bits)
    one = the_one(record, bad)
    assert (one.kind, one.size) == ("time-wrap", pytest.approx(tick * 2**bits, rel=1e-10))
    mended = undone(record, bad, "time-wrap")
    assert np.allclose(mended["time_s"], columns["time_s"], rtol=0.0, atol=1e-9)


def test_rows_out_of_order(record):
    _, columns = record
    bad = faults.shuffled(columns, 3000, 64)
    assert the_one(record, bad).kind == "time-order"
    mended = undone(record, bad, "time-order")
    assert all(np.array_equal(mended[name], columns[name]) for name in columns)


def test_two_records_in_one_file_are_not_corrected(record):
    _, columns = record
    both = {name: np.tile(values[:20_000], 2) for name, values in columns.items()}
    one = the_one(record, both)
    assert (one.kind, one.rows, one.correctable) == ("time-not-rising", (20_000,), False)


def test_stamps_with_too_few_digits(record):
    _, columns = record
    bad = {**columns, "time_s": np.round(columns["time_s"], 4)}
    one = the_one(record, bad)
    assert (one.kind, one.size) == ("time-stamps", pytest.approx(1e-4, rel=1e-6))
    assert np.allclose(undone(record, bad, "time-stamps")["time_s"], columns["time_s"], rtol=0.0, atol=2e-5)


@pytest.mark.parametrize("factor", [1e3, 1e6, 50_000.0])
def test_time_in_another_unit(record, factor):
    bad = faults.scaled(record[1], time_s=factor)
    one = the_one(record, bad)
    assert (one.kind, one.size) == ("time-unit", pytest.approx(factor))
    assert np.allclose(undone(record, bad, "time-unit")["time_s"], record[1]["time_s"])


@pytest.mark.parametrize("factor", [1e3, 1e6, 1e9, 1.0 / 60.0])
@pytest.mark.parametrize("every", [1, 5, 7])
def test_time_in_another_unit_shows_in_the_motion(factor, every):
    """The rate is not that of the rig, so that the sampling interval tells nothing."""
    record = rattling()
    thinned = {name: values[::every] for name, values in record[1].items()}
    bad = faults.scaled(thinned, time_s=factor)
    one = examine(channels(bad), record[0], stated_motion=True)[0]
    assert (one.kind, one.size, one.fatal) == ("time-unit", pytest.approx(factor), True)
    mended = correct(channels(bad), [one], ["time-unit"]).columns["time_s"]
    assert np.allclose(mended, thinned["time_s"], rtol=1e-14)


def test_a_speed_that_no_unit_explains_is_an_error():
    record = rattling()
    rig = record[0].with_({"sensors.sample_rate": f"{50_000 / 37!r} Hz"})
    one = examine(channels(faults.scaled(record[1], time_s=37.0)), rig, stated_motion=True)[-1]
    assert (one.kind, one.fatal, one.correctable) == ("time-unit", True, False)
    assert "neither the unit of the time nor that of the angles" in one.evidence


@pytest.mark.parametrize(("factor", "told"), [(1.05, False), (1.25, True), (0.8, True), (4.0, True)])
def test_times_of_another_rate_than_the_rig_states_are_reported(factor, told):
    record = rattling()
    bad = channels(faults.scaled(record[1], time_s=1.0 / factor))
    found = [one for one in examine(bad, record[0]) if one.kind == "sample-rate"]
    assert [one.size for one in found] == ([pytest.approx(factor)] if told else [])
    assert not any(one.fatal or one.correctable for one in found)  # a slow roll is recorded at another rate than rattle
    own = record[0].with_({"sensors.sample_rate": f"{50e3 * factor!r} Hz"})
    assert not [one for one in examine(bad, own) if one.kind == "sample-rate"]


def test_a_rate_that_the_rig_does_not_state_contradicts_no_times(record):
    rig = record[0]
    silent = replace(rig, sensors=replace(rig.sensors, stated=False))
    bad = channels(faults.scaled(record[1], time_s=0.8))
    assert not [one for one in examine(bad, silent) if one.kind == "sample-rate"]


def test_an_angle_that_wraps_is_no_slow_drive():
    record = rattling()
    bad = {name: values if name == "time_s" else np.mod(values, 2.0 * np.pi) for name, values in record[1].items()}
    assert {one.kind for one in examine(channels(bad), record[0])} == {"angle-wrap"}


@pytest.mark.parametrize("rows", [1, 30])
def test_gaps_in_the_time_base(record, rows):
    one = the_one(record, faults.without_rows(record[1], np.arange(4000, 4000 + rows)))
    assert (one.kind, one.fatal) == ("gaps", False)
    assert one.size == pytest.approx((rows + 1) * 2e-5)


@pytest.mark.parametrize("share", [0.05, 0.15, 0.3])
def test_jitter_has_its_size(record, share):
    findings = found(record, faults.jitter(record[1], share * 2e-5, seed=5))
    assert findings[0].kind == ("jitter" if share < 0.2 else "time-stamps")
    assert findings[0].size == pytest.approx(share * 2e-5, rel=0.03)


@pytest.mark.parametrize("width", [2 * np.pi / 40, 2 * np.pi])
def test_an_angle_that_wraps(record, width):
    scenario, columns = record
    if width < 6.0:  # 2^n counts of the declared encoder
        width = 2**15 * 2 * np.pi / scenario.sensors.loose.counts_per_revolution
    bad = faults.angle_wrap(columns, LOOSE, width)
    if np.ptp(columns[LOOSE]) < width:
        pytest.skip("does not turn far enough")
    one = the_one(record, bad)
    assert (one.kind, one.channel, one.size) == ("angle-wrap", LOOSE, pytest.approx(width, rel=1e-9))
    mended = undone(record, bad, "angle-wrap")[LOOSE]
    assert np.allclose(mended - mended[0], columns[LOOSE] - columns[LOOSE][0])


def test_saturation_and_freezing(record):
    _, columns = record
    one = the_one(record, faults.clipped(columns, LOOSE, 0.8))
    assert (one.kind, one.channel) == ("saturated", LOOSE)
    assert one.size == pytest.approx(0.2 * (columns["time_s"][-1] - columns["time_s"][0]), rel=0.2)
    still = {**columns, DRIVE: np.full(len(columns[DRIVE]), 1.5)}
    assert the_one(record, still).kind == "frozen"


def test_samples_that_are_held_and_rows_that_are_left_out():
    record = turning(noise=0.0, counts=16_000_000)
    one = found(record, faults.held(record[1], 7000, 3))[0]
    assert (one.kind, one.size) == ("repeated", 3.0)
    assert one.rows == (7001, 7002, 7003)
    one = found(record, faults.left_out(record[1], 9000, 5))[0]
    assert (one.kind, one.rows) == ("left-out", (9000,))
    assert one.size == pytest.approx(5 * 2e-5)


def test_the_same_file_twice(record, tmp_path):
    scenario, columns = record
    late = {**columns, "time_s": columns["time_s"] + 3.25, LOOSE: columns[LOOSE] + 0.5}
    part = {name: values[5000:60_000] for name, values in late.items()}
    for copy in (columns, late, part):
        one = examine(channels(copy), scenario, [channels(columns, "first.csv")])
        assert [finding.kind for finding in one] == ["duplicated-file"]
        assert one[0].size == len(copy["time_s"])
        assert "first.csv" in one[0].evidence
    other = rattling(seed=2)[1]
    assert examine(channels(other), scenario, [channels(columns)]) == ()
    for name in ("a.parquet", "b.parquet"):
        Recording(columns).write(tmp_path / name)
    with pytest.raises(InputError, match=r"b\.parquet.*duplicated-file"):
        admit_all([tmp_path / "a.parquet", tmp_path / "b.parquet"], scenario)
    kept = admit_all([tmp_path / "a.parquet", tmp_path / "b.parquet"], scenario, correct=["duplicated-file"])
    assert len(kept) == 1


def test_admit_tells_all_fatal_findings_and_takes_what_is_to_be_corrected(record, tmp_path):
    scenario, columns = record
    bad = faults.scaled(faults.shuffled(columns, 3000, 64), **{LOOSE: -1.0})
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.table(bad), tmp_path / "bad.parquet")
    with pytest.raises(InputError, match="--correct time-order") as refused:
        admit(tmp_path / "bad.parquet", scenario)
    assert "--correct sense" in str(refused.value)
    taken = admit(tmp_path / "bad.parquet", scenario, correct=["time-order,sense"])
    assert [(one.kind, one.corrected) for one in taken.findings] == [("time-order", True), ("sense", True)]
    assert np.array_equal(taken.recording.signals[LOOSE], columns[LOOSE])
    with pytest.raises(UsageError, match="did you mean 'sense'"):
        admit(tmp_path / "bad.parquet", scenario, correct=["sens"])
    assert "duplicated-file" in CORRECTABLE


def test_one_angle_is_enough_where_nothing_meshes(tmp_path):
    time = np.linspace(0.0, 4.0, 4001)
    columns = {"time_s": time, LOOSE: 8.0 * time - time**2, DRIVE: 0.0 * time}
    assert examine(Channels({k: columns[k] for k in ("time_s", LOOSE)}), None, needs=(LOOSE,)) == ()
    assert examine(Channels(columns), rattling()[0].with_({"sensors.sample_rate": "1 kHz"}), needs=(LOOSE,)) == ()
    assert examine(Channels({"time_s": time, "omega_rad_s": time}), None, needs=((LOOSE, "omega_rad_s"),)) == ()
    assert [one.kind for one in examine(Channels({"time_s": time}), None, needs=((LOOSE, "omega_rad_s"),))] == [
        "missing"
    ]
    Recording(columns).write(tmp_path / "down.csv")
    assert "theta_loose_rad" in admit(tmp_path / "down.csv", needs=(LOOSE,)).channels.columns


def test_angles_that_no_gear_reaches_are_refused(record):
    far = {**record[1], DRIVE: 1e300 * record[1]["time_s"]}
    one = next(one for one in found(record, far) if one.kind == "too-large")
    assert (one.channel, one.fatal, one.correctable) == (DRIVE, True, False)
    assert "no angle of a gear" in one.evidence
