"""Records whose encoders begin anywhere: the same causes and sizes, phases from the first record, else nothing."""

import json
from dataclasses import replace

import numpy as np
import pytest

from gears3d.diagnosis import CHANNELS, added, diagnose, extended_text, preprocess
from gears3d.diagnosis.causes import Candidate, begin, candidates, fit, gear_of, regressors_of
from gears3d.diagnosis.preprocessing import moved, one_size, single_tooth, turn
from gears3d.diagnosis.residual_tests import splits
from gears3d.diagnosis.search import TOOTH_GAIN, Rival, given
from gears3d.diagnosis.verdict import name_causes
from gears3d.effects import catalogue
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan, reveal
from tests.diagnosis import asked

BY_ANGLE = {
    "eccentricity": {"offset": 3e-5, "gear": "drive"},
    "transmission_error": {"amplitude": 2e-5, "order": 3, "gear": "loose"},
    "backlash_variation": {"amplitude": 2e-5, "order": 2},
    "drag_position": {"amplitude": 1e-2, "order": 2},
    "encoder_eccentricity": {"amplitude": 1e-4, "order": 1, "gear": "loose"},
}


def up_to(order, monkeypatch):
    """Look for candidates of low orders, which do to tell zeros apart."""
    asked.only(monkeypatch, lambda one: one.kind != "pitch_error" and one.shape.get("order", 1) <= order)


def written(folder, kinds, seed, table=None, **options):
    """Return the records of a challenge with arbitrary zeros, and its rig."""
    made = plan(seed, kinds, zero="arbitrary", **options)
    if table is not None:
        made = replace(made, effects=({**made.effects[0], **table},))
    hide(made, folder)
    rig = load(folder / "rig.toml")
    return [admit(file, rig, chart) for file, chart in files_of([folder / "record.toml"])], rig


def judged(folder, *about, **options):
    """Return diagnosis and score."""
    admitted, rig = written(folder, *about, **options)
    found = diagnose(admitted, rig)
    (folder / "diagnosis.json").write_text(json.dumps(found.to_dict(), allow_nan=False), encoding="utf-8")
    return found, reveal(folder, folder)


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """A record as evidence."""
    return preprocess(written(tmp_path_factory.mktemp("zeros"), (), 10101, records=1, duration=3.0)[0][0])


def test_every_channel_with_angles_is_turned(record):
    there = turn(record, 0.3, -0.2)
    asked = 0
    for name in record.channels._fields:
        before, after = getattr(record.channels, name), getattr(there.channels, name)
        if {"drive", "loose"} <= set(getattr(before, "_fields", ())):
            asked += 1
            assert len(before.drive) > 0, name
            np.testing.assert_allclose(after.drive - before.drive, 0.3, atol=1e-9)
            np.testing.assert_allclose(after.loose - before.loose, -0.2, atol=1e-9)
    assert asked == 6


def test_every_kind_that_goes_by_an_angle_is_known():
    """What has a phase or a tooth goes by an angle, but for the drive's own motion, which goes by time."""
    for kind, effect in catalogue().items():
        angled = ("phase" in effect.params or "tooth" in effect.params) and kind != "drive_motion"
        gear = "loose" if "gear" in effect.params else None
        assert bool(gear_of(kind, gear)) == angled, kind


@pytest.mark.parametrize("kind", BY_ANGLE)
def test_a_turned_record_asks_for_the_moved_effect(record, kind):
    assert record.unmarked == ("drive", "loose")
    effect = catalogue()[kind](phase=0.4, **BY_ANGLE[kind])
    for by in ((1.3, 0.0), (0.0, -2.1), (0.7, 2.9)):
        there, here = turn(record, *by), moved(effect, *by)
        assert there.turned == by
        for name in CHANNELS:
            expected = added(record, [here], name)
            # a flight's points and the fine grid between them are rounded apart
            assert np.allclose(added(there, [effect], name), expected, atol=1e-6 * np.abs(expected).max(initial=1.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "seed", "table"),
    [
        pytest.param("transmission_error", 10102, {"order": 3}, id="transmission error of order 3"),
        pytest.param("drag_position", 10021, {"order": 1}, id="drag over the angle"),
    ],
)
def test_a_cause_by_angle_is_named_with_its_size_and_its_phase_in_the_first_record(
    tmp_path, monkeypatch, kind, seed, table
):
    up_to(4, monkeypatch)
    found, score = judged(tmp_path, (kind,), seed, table, size=0.3, records=3, duration=4.0)
    assert score["set_right"], found.to_dict()
    assert found.verdict == "explained"
    assert not score["wrong_names"]
    rows = {one["name"]: one for one in score["parameters"]}
    assert rows["order"]["right"]
    assert abs(rows["amplitude"]["error"]) < 0.01
    assert abs(rows["phase"]["error"]) < 0.01
    assert found.to_dict()["heldout"]["gain"] > 0.95
    cause = found.to_dict()["causes"][0]
    assert cause["phase_from"].endswith("record-1.parquet")
    assert any(note.kind == "zeros-arbitrary" and "record-1" in note.record for note in found.notes)
    assert "# phase and tooth number count from the first angle of record-1.parquet" in extended_text(found)


def test_phases_count_from_the_first_record_also_where_that_is_not_segmented(record):
    first, second = replace(record, name="record-1"), turn(replace(record, name="record-2"), 0.3, -0.2)
    known = candidates(record.scenario.rig(), 3.0, 3)
    cause = begin(next(one for one in known if one.kind == "drag_position"), np.array([0.1, 0.05]))
    found = given([second], [cause], ())
    found = found._replace(fit=fit(found.records, found.base, [cause]))
    (named,) = name_causes(found, [[]], records=[first, second])
    assert named.zero == "record-1"
    assert "phase" in named.parameters


@pytest.mark.parametrize(("time_constant", "is_open"), [(0.1, False), (0.3, True)])
def test_a_drift_that_ends_before_records_show_it_is_no_alternative(record, time_constant, is_open):
    """What is left of it is a constant torque: six sets of torques had it as their fifth."""
    known = candidates(record.scenario.rig(), 3.0, 3)
    cause, drift = (
        begin(next(one for one in known if one.kind == kind), np.array([0.1]))
        for kind in ("drag_coulomb", "drag_drift")
    )
    drift = drift._replace(numbers=np.array([drift.numbers[0], np.log(time_constant)]))
    found = given([record], [cause], ())
    (named,) = name_causes(found, [[Rival((drift,), 1.0, excluded=False, deviance=1.0)]])
    told = named.alternatives if is_open else named.excluded
    assert [one["kind"] for one in told] == ["drag_drift"]
    assert (named.options[1].probability > 0.1) == is_open
    assert sum(one.probability for one in named.options) == pytest.approx(1.0)


def test_a_record_without_events_is_not_held_out(record):
    seen = record.channels
    tables = {name: getattr(seen, name) for name in ("flights", "contacts", "impacts", "losses")}
    none = {name: type(table)(*(column[:0] for column in table)) for name, table in tables.items()}
    none["drive"] = seen.drive._replace(time=seen.drive.time[:0], angle=seen.drive.angle[:0])
    fine = tuple(column[:0] for column in record.fine)
    still = replace(record, name="still", channels=seen._replace(**none), fine=fine, at=record.at[:0])
    cause = begin(next(one for one in candidates(record.scenario.rig(), 3.0, 3) if one.kind == "drag_coulomb"), [0.1])
    held = splits([record, record, record, still], [cause])
    assert len(held) == 3
    assert all(np.isfinite([one.base, one.extended, one.noise]).all() for one in held)
    assert splits([still], [cause]) == []


def test_phases_cost_freedom(record):
    """Five records with a phase each must gain what chance gives six numbers as seldom as two the usual gain."""
    from scipy.stats import chi2

    from gears3d.diagnosis.causes import ACCEPT
    from gears3d.diagnosis.preprocessing import parameter_penalty

    more = parameter_penalty([record] * 5, "loose")
    assert chi2.sf(ACCEPT + more, 6) == pytest.approx(chi2.sf(ACCEPT, 2), rel=0.05)
    assert parameter_penalty([record], "loose") == parameter_penalty([record] * 5, "") == 0.0
    marked = replace(record, unmarked=())
    assert parameter_penalty([marked, record], "loose") == pytest.approx(parameter_penalty([record] * 2, "loose"))


@pytest.mark.slow
def test_a_rig_that_goes_by_an_angle_is_not_held_against_records_without_marks(tmp_path, monkeypatch):
    up_to(1, monkeypatch)
    admitted, rig = written(tmp_path, (), 10103, records=1, duration=2.0)
    bound = rig.with_([("effect[+]", {"kind": "eccentricity", "offset": "30 um", "gear": "loose"})])
    found = diagnose([replace(one, rig=bound) for one in admitted], bound)
    assert found.verdict == "not_decidable"
    assert not found.causes
    assert any(note.kind == "zeros-unknown" and "eccentricity" in note.text for note in found.notes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "seed"),
    [("eccentricity", 10010), ("drag_position", 10021), ("encoder_eccentricity", 10031), ("transmission_error", 10051),
     ("backlash_variation", 10061), ("drag_viscous", 10071)],
)  # fmt: skip
def test_kinds_are_right_first_whatever_the_zeros(tmp_path, kind, seed):
    found, score = judged(tmp_path, (kind,), seed, size=0.3, records=3, duration=5.0)
    assert score["set_right"], found.to_dict()
    assert not score["wrong_names"], found.to_dict()
    assert all(abs(one["error"]) < 0.01 for one in score["parameters"] if one["error"] is not None)
    assert all(one["right"] is not False for one in score["parameters"])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [10041, 10042, 10043])
def test_nothing_is_named_where_nothing_is_hidden(tmp_path, seed):
    found, _ = judged(tmp_path, (), seed, records=5, duration=4.0)
    assert not found.causes, found.to_dict()


@pytest.mark.slow
def test_zeros_that_are_off_are_not_made_up_for_by_a_third_cause(tmp_path):
    """The first record has its flights at one angle: by itself it tells its phase badly."""
    found, score = judged(tmp_path, ("encoder_eccentricity", "drag_position"), 10081, size=0.3, records=3, duration=5.0)
    assert score["kinds_first"], found.to_dict()
    assert not score["wrong_names"], found.to_dict()
    sizes = [one for one in score["parameters"] if one["error"] is not None and one["name"] != "phase"]
    assert all(abs(one["error"]) < 0.01 for one in sizes)
    assert all(one["covered"] for one in score["parameters"] if one["name"] == "phase")


def test_a_loss_before_two_readings_of_its_flight_ends_no_diagnosis(record):
    seen = record.channels.losses
    assert len(seen.time) > 0
    short = seen._replace(begun=np.where(np.arange(len(seen.time)) == 0, seen.after[:, -2], seen.begun))
    one = replace(record, channels=record.channels._replace(losses=short))
    effect = catalogue()["drag_viscous"](coefficient=1e-3)
    made, usual = added(one, [effect], "loss"), added(record, [effect], "loss")
    assert np.all(np.isfinite(made))
    assert made[1:] == pytest.approx(usual[1:], rel=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_one_size_with_a_phase_for_each_record_explains_what_has_one(seed):
    """Records may show almost one direction only: rounds of Newton's method alone left the largest gain there."""
    drawn = np.random.default_rng(seed)
    size, normal, right = 10.0 ** drawn.uniform(-2.0, 0.0), [], []
    for phase, angle in zip(*drawn.uniform(-np.pi, np.pi, (2, 3)), strict=True):
        along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        weak = 10.0 ** drawn.uniform(-9.0, 0.0)
        own = 10.0 ** drawn.uniform(4.0, 7.0) * (np.outer(along, along) + weak * np.outer(across, across))
        normal.append(own)
        right.append(own @ (size * np.array([np.cos(phase), -np.sin(phase)])))
    asked = Candidate("transmission_error", {"gear": "drive", "order": 3, "flank": "both"}, "amplitude", 1.0, True, ())
    found = one_size(asked, np.array(normal), np.array(right))
    every = sum(float(b @ np.linalg.solve(a, b)) for a, b in zip(normal, right, strict=True))
    assert found.gain == pytest.approx(every, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("offset", [3e-6, 2e-5, 6e-5])
@pytest.mark.parametrize(("gear", "number"), [("drive", 5), ("loose", 6)])
def test_a_tooth_is_found_at_any_angle(record, gear, number, offset):
    """What a displaced tooth that comes by in contact adds, turned on by parts of a pitch, and noise."""
    drawn, by = np.random.default_rng(10104), (0.0, 1.234, -2.5)
    side = ("drive", "loose").index(gear)
    records = [turn(record, *(angle * np.eye(2)[side])) for angle in by]
    known = regressors_of(records, [one for one in candidates(record.rig, 3.0, 1) if one.kind != "pitch_error"])
    effect = catalogue()["pitch_error"](offset=offset, tooth=number, gear=gear)
    rest = np.concatenate([added(record, [effect], name) for name in CHANNELS for _ in by])
    found = single_tooth(known, rest + drawn.standard_normal(len(rest)), gear)
    teeth = record.rig.teeth_drive if gear == "drive" else record.rig.teeth_loose
    off = found.place - ((number - 1) * 2.0 * np.pi / teeth + np.array(by))
    assert np.abs((off + np.pi) % (2.0 * np.pi) - np.pi).max() < 0.1 * 2.0 * np.pi / teeth
    assert found.gain > 0.95 * float(rest @ rest)
    stands = np.mod((found.place + found.turns) * teeth / (2.0 * np.pi), teeth)
    assert np.allclose(stands, number - 1.0)
    assert single_tooth(known, drawn.standard_normal(len(rest)), gear).gain < TOOTH_GAIN
