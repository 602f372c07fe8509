"""What is no ground for a diagnosis is told with its remedy, and nothing is blamed then."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gears3d import cli
from gears3d.diagnosis import diagnose
from gears3d.errors import Fault, InputError
from gears3d.measured.checks import admit
from gears3d.scenario import load
from gears3d.simulation import record
from tests.diagnosis import asked

BENCH = "scenarios/rigaud-2020/fig5-20rpm.toml"
PLAIN = {"run.duration": "3 s", "run.settle": "0 s", "sensors.sample_rate": "20 kHz", "drag.torque": "0.3 N m",
         "gears.loose.teeth": 60}  # fmt: skip
FEW = ("backlash_offset", "drag_coulomb", "drag_viscous", "restitution_offset", "transmission_error", "drive_motion")


@pytest.fixture(autouse=True)
def _few_candidates(monkeypatch):
    """A few kinds do: what is tested comes before the search and after it."""

    asked.only(monkeypatch, lambda one: one.kind in FEW and one.shape.get("order", 1) == 1)


def written(path, truth=None, change=None):
    made = record(load(BENCH, {**PLAIN, **(truth or {})}))
    made.write(path)
    if change is not None:
        pq.write_table(pa.table(change(dict(made.signals)), metadata=pq.read_schema(path).metadata), path)
    return path


def judged(path, rig=None, stated_motion=False):
    bench = load(BENCH, {**PLAIN, **(rig or {})})
    return diagnose([admit(path, bench, stated_motion=stated_motion)], bench)


def kinds(found):
    return [note.kind for note in found.notes]


def blamed_nothing(found, kind):
    """Check that nothing is blamed, that the kind blocks, and that the note says what to do."""
    assert found.verdict == "not_decidable"
    assert not found.causes
    assert not found.extended.effects
    note = next(one for one in found.notes if one.kind == kind)
    assert note.blocks
    assert note.remedy
    return note


def changed_places(signals):
    names = ("theta_drive_rad", "theta_loose_rad")
    return {**signals, names[0]: signals[names[1]], names[1]: signals[names[0]]}


@pytest.mark.slow
def test_torques_are_as_uncertain_as_the_inertia_and_the_inertia_that_does_the_same_is_stated(tmp_path):
    path, inertia = written(tmp_path / "r.parquet", {"drag.torque": "0.33 N m"}), load(BENCH).rig().inertia
    stated = {"value": f"{inertia!r} kg m^2", "uncertainty": "5 %"}
    exact, unsure = (judged(path, one) for one in ({}, {"gears.loose.inertia": stated}))
    sigmas = [(one.high - one.low) / 3.92 for one in (each.causes[0].parameters["torque"] for each in (exact, unsure))]
    assert sigmas[1] == pytest.approx(np.hypot(sigmas[0], 0.05 * 0.33), rel=1e-3)
    text = next(note.text for note in exact.notes if note.kind == "inertia-or-drag")
    told = float(text.split("gear of ")[1].split()[0])
    assert told == pytest.approx(inertia / 1.1, rel=2e-3) or told == pytest.approx(1e6 * inertia / 1.1, rel=2e-3)


@pytest.mark.slow
def test_what_is_found_is_blamed_where_nothing_is_amiss(tmp_path):
    found = judged(written(tmp_path / "r.parquet", {"drag.torque": "0.33 N m"}))
    assert found.causes[0].kind == "drag_coulomb"
    assert kinds(found) == ["one-speed", "inertia-or-drag"]
    assert not found.suspects


def test_a_record_of_one_period_leaves_suspects(tmp_path):
    path = written(tmp_path / "r.parquet", {"drag.torque": "0.4 N m", "run.duration": "0.6 s"})
    found = judged(path)
    assert "1.8 periods" in blamed_nothing(found, "too-short").text
    assert [one.kind for one in found.suspects] == ["drag_coulomb"]
    assert found.to_dict()["suspects"][0]["parameters"]["torque"]["value"] == pytest.approx(0.1, abs=0.01)


def test_a_wrong_number_of_teeth_is_named_with_those_that_would_fit(tmp_path):
    with pytest.raises(InputError, match=r"90:60.* teeth would match, 90:61 are declared"):
        judged(written(tmp_path / "r.parquet"), {"gears.loose.teeth": 61})


@pytest.mark.parametrize("ratio", [60, pytest.param(90, marks=pytest.mark.slow)])
def test_changed_places_are_named_at_any_ratio(tmp_path, ratio):
    path = written(tmp_path / "r.parquet", {"gears.loose.teeth": ratio}, changed_places)
    with pytest.raises(InputError, match=r"channels are interchanged|has the nominal motion of the drive gear"):
        judged(path, {"gears.loose.teeth": ratio})


def test_one_gear_turned_round_is_refused_and_both_block(tmp_path):
    def one(s):
        return {**s, "theta_loose_rad": -s["theta_loose_rad"]}

    def both(s):
        return {**one(s), "theta_drive_rad": -s["theta_drive_rad"]}

    with pytest.raises(InputError, match=r"gears have opposite signs.*--correct sense"):
        judged(written(tmp_path / "one.parquet", change=one))
    note = blamed_nothing(judged(written(tmp_path / "both.parquet", change=both), stated_motion=True), "turned-round")
    assert "--correct sense" in note.remedy


@pytest.mark.parametrize(
    ("truth", "rig"),
    [
        ({"motion.harmonics": [{"amplitude": "20 rpm", "frequency": "5 Hz"}]}, {}),
        ({"motion.harmonics": []}, {}),
        ({}, {"motion.harmonics": []}),
    ],
)
def test_another_motion_than_the_claimed_one_blocks(tmp_path, truth, rig):
    note = blamed_nothing(judged(written(tmp_path / "r.parquet", truth), rig, stated_motion=True), "other-motion")
    assert "[condition]" in note.remedy


@pytest.mark.slow
def test_another_mean_speed_is_told_and_the_measured_one_used(tmp_path):
    path = written(tmp_path / "r.parquet", {"motion.mean": "60 rpm", "drag.torque": "0.33 N m"})
    found = judged(path, stated_motion=True)
    assert "60 rpm" in next(one.text for one in found.notes if one.kind == "other-speed")
    assert found.causes[0].kind == "drag_coulomb"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "rig"),
    [
        ({"motion.mean": "60 rpm"}, {}),
        ({"motion.mean": "33 rpm", "motion.harmonics": [{"amplitude": "20 rpm", "frequency": "5 Hz"}]}, {}),
        ({}, {"motion.harmonics": []}),
    ],
)
def test_a_record_of_another_motion_than_the_rig_file_is_used_as_measured(tmp_path, truth, rig):
    found = judged(written(tmp_path / "r.parquet", {"drag.torque": "0.33 N m", **truth}), rig)
    assert [one.kind for one in found.causes] == ["drag_coulomb"]
    assert kinds(found) == ["one-speed", "inertia-or-drag"]
    motion = found.to_dict()["records"][0]["drive_motion"]
    true = load(BENCH, {**PLAIN, **truth}).motion
    assert motion["mean_rad_s"]["value"] == pytest.approx(true.mean, rel=1e-6)
    (harmonic,) = motion["harmonics"]
    assert harmonic["frequency_Hz"]["value"] == pytest.approx(true.harmonics[0].frequency, rel=1e-4)
    assert harmonic["amplitude_rad_s"]["value"] == pytest.approx(true.harmonics[0].amplitude, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", [0.3, 8.0])
def test_a_harmonic_of_the_drive_of_any_size_is_a_cause_only_where_the_motion_is_stated(tmp_path, amplitude):
    sine = {"amplitude": "10 rpm", "frequency": "3 Hz"}
    true = {"motion.harmonics": [sine, {"amplitude": f"{amplitude} rpm", "frequency": "7.3 Hz"}]}
    rig = {"motion.harmonics": [sine]}
    path = written(tmp_path / "r.parquet", true)
    stated = judged(path, rig, stated_motion=True)
    assert [one.kind for one in stated.causes] == ["drive_motion"]
    assert stated.verdict == "explained"
    numbers = stated.causes[0].parameters
    assert numbers["frequency"].value == pytest.approx(7.3, rel=1e-4)
    assert numbers["amplitude"].value == pytest.approx(amplitude * 2.0 * np.pi / 60.0, rel=1e-3)
    found = judged(path, rig)
    assert not found.causes
    assert len(found.to_dict()["records"][0]["drive_motion"]["harmonics"]) == 2


@pytest.mark.slow
def test_another_bench_of_the_same_ratio_is_doubted(tmp_path):
    rig = {"mount.backlash": "600 um", "drag.torque": "0.9 N m", "impact.restitution": 0.7}
    found = judged(written(tmp_path / "r.parquet"), rig)
    note = blamed_nothing(found, "other-rig")
    assert "backlash 250 um instead of 600 um" in note.text
    assert {one.kind for one in found.suspects} >= {"backlash_offset", "drag_coulomb"}


@pytest.mark.slow
def test_gears_of_another_size_in_the_same_ratio_look_like_backlash_and_are_told(tmp_path):
    found = judged(written(tmp_path / "r.parquet"), {"gears.drive.teeth": 60, "gears.loose.teeth": 40})
    assert found.causes[0].kind == "backlash_offset"
    assert "differs by +50 %" in next(one.text for one in found.notes if one.kind == "gear-size")


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", ["0.5 rpm", "0.2 rpm"])
def test_below_the_threshold_only_contact_is_judged(tmp_path, amplitude):
    motion = {"motion.harmonics": [{"amplitude": amplitude, "frequency": "3 Hz"}]}
    found = judged(written(tmp_path / "r.parquet", motion), motion)
    assert found.verdict == "not_decidable"
    assert kinds(found) == ["no-rattle"]
    assert found.to_dict()["power"] == {"geometry": None, "torque": None, "impact": None}


@pytest.mark.slow
def test_an_order_that_does_not_come_round_is_a_suspect(tmp_path):
    eccentric = [{"kind": "transmission_error", "order": 1, "amplitude": "30 um"}]
    path = written(tmp_path / "r.parquet", {"effect": eccentric})
    found = judged(path)
    assert found.verdict == "not_decidable"
    assert "occurs 1.5 times" in next(one.text for one in found.notes if one.kind == "few-turns")


def test_rows_that_are_no_numbers_are_told_with_the_way_to_leave_them_out(tmp_path):
    def holes(s):
        return {**s, "theta_loose_rad": np.where(np.arange(len(s["time_s"])) % 1000 == 7, np.nan, s["theta_loose_rad"])}

    path = written(tmp_path / "r.parquet", change=holes)
    with pytest.raises(InputError, match=r"60 of 60001 rows are not finite numbers.*--correct not-finite"):
        judged(path)
    bench = load(BENCH, PLAIN)
    found = diagnose([admit(path, bench, correct=["not-finite"])], bench)
    assert not found.causes


@pytest.mark.slow
def test_a_record_that_is_off_is_left_out_where_there_are_others(tmp_path):
    good = written(tmp_path / "good.parquet", {"drag.torque": "0.33 N m"})
    other = written(tmp_path / "other.parquet", {"motion.harmonics": []})
    bench = load(BENCH, PLAIN)
    found = diagnose([admit(one, bench, stated_motion=True) for one in (good, other)], bench)
    assert found.causes[0].kind == "drag_coulomb"
    note = next(one for one in found.notes if one.kind == "other-motion")
    assert note.record == str(other)
    assert note.remedy.endswith("(this record was excluded)")


@pytest.mark.parametrize("rows", [5, 300])
def test_the_command_ends_without_a_traceback(tmp_path, rows, capsys):
    path = written(tmp_path / "r.parquet", change=lambda s: {name: values[:rows] for name, values in s.items()})
    rig = tmp_path / "rig.toml"
    rig.write_text(load(BENCH, PLAIN).document)
    with pytest.raises(SystemExit) as stop:
        cli.main(["diagnose", str(path), "--rig", str(rig), "--out", str(tmp_path / "out")])
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    if rows == 5:
        assert stop.value.code == 3
        assert "at least 200 readings" in said.err
    else:
        assert not stop.value.code
        assert "The data are insufficient for a verdict: the longest record has" in said.out
        assert "the longest record has" in (tmp_path / "out/report.html").read_text()


@pytest.mark.slow
@pytest.mark.parametrize(("backlash", "kept"), [("250 um", 2), ("150 um", 1)])
def test_a_record_that_fails_by_itself_is_segmented_along_the_flanks_of_another_where_these_explain_it(
    tmp_path, monkeypatch, backlash, kept
):
    from gears3d.diagnosis import preprocessing

    own = {"drag.torque": "0.33 N m", "run.duration": "2 s"}
    good = written(tmp_path / "good.parquet", own)
    bad = written(tmp_path / "bad.parquet", {**own, "motion.mean": "33 rpm", "mount.backlash": backlash})
    alone = preprocessing.segments_of

    def failing(known, rig, file, **more):
        if file == str(bad):
            raise InputError(Fault("theta_loose_rad", "is not explained", "", file))
        return alone(known, rig, file, **more)

    monkeypatch.setattr(preprocessing, "segments_of", failing)
    bench = load(BENCH, PLAIN)
    found = diagnose([admit(one, bench) for one in (bad, good)], bench)
    assert [one["name"] for one in found.records] == [str(bad), str(good)][-kept:]
    assert [one.kind for one in found.causes] == ["drag_coulomb"]
    note = next(one for one in found.notes if one.record == str(bad))
    assert note.kind == ("flanks-of-another" if kept == 2 else "not-measured")
    assert not note.blocks


@pytest.mark.parametrize(("laws", "noted"), [(["drag_power"], True), (["drag_viscous"], False)])
def test_a_law_of_speed_of_as_many_numbers_as_speeds_is_noted(laws, noted):
    from types import SimpleNamespace

    from gears3d.diagnosis.verdict import speed_notes

    flown = SimpleNamespace(flights=SimpleNamespace(time=np.zeros(3)))
    records = [SimpleNamespace(motion=SimpleNamespace(mean=mean), channels=flown) for mean in (5.0, 5.2, -9.0)]
    effects = [SimpleNamespace(kind=kind) for kind in laws]
    found = speed_notes(records, effects)
    assert [note.kind for note in found] == ["few-speeds"] * noted
    assert not any(note.blocks for note in found)
