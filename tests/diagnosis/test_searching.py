"""Records that were cut badly do not decide: neither on numbers, nor on which cause stays."""

from dataclasses import replace

import numpy as np
import pytest

from gears3d.diagnosis import Candidate, Contacts, Drive, begin, uncut
from gears3d.diagnosis.causes import ACCEPT, Fit, Scored, acceptable, fit, has_possible_size, is_accepted, within_bounds
from gears3d.diagnosis.search import _base, _held, badly_segmented, search, without_outliers
from gears3d.scenario import load

SIZE, NOISE = 2e-5, 5e-7
WAVE = Candidate("transmission_error", {"gear": "drive", "order": 3, "flank": "both"}, "amplitude", 1e-4, True,
                 ("contact",))  # fmt: skip
MORE = {"drive": 0.0, "loose": 0.0, "": 0.0}


def _records(wrong=0.0, count=5, points=600, far=2e-3):
    """Records of contact on a wave; in the last one part of the points lie far off, all on one side."""
    random, rig, made = (
        np.random.default_rng(4),
        load("scenarios/rigaud-2020/fig5-20rpm.toml", {"motion.harmonics": []}),
        [],
    )
    for k in range(count):
        drive = np.sort(random.uniform(0.0, 40.0, points))
        place = SIZE * np.cos(3.0 * drive) + NOISE * random.normal(size=points)
        if k == count - 1:
            place[: int(wrong * points)] += far
        none = np.zeros(points)
        contacts = Contacts(drive, drive, drive, none.astype(int), place, none + NOISE, none)
        one = uncut(rig, str(k))
        even = np.linspace(0.0, 40.0, points)
        steady = Drive(even, one.motion.mean * even, NOISE, 40.0 / points)
        made.append(replace(one, channels=one.channels._replace(contacts=contacts, drive=steady)))
    return made


def _found(records):
    return fit(records, _base(records), [begin(WAVE, np.array([0.1, 0.0]))])


def test_a_record_cut_badly_does_not_bend_what_the_others_are_held_against():
    records = _records(wrong=0.06)
    bent = _found(records)
    assert abs(np.hypot(*bent.causes[0].numbers) - SIZE) > 10.0 * NOISE  # that is what it did
    rest = _held(records, bent)
    cuts = np.cumsum([len(one.channels.contacts.time) for one in records])
    own = np.split(rest, cuts[:-1])
    assert all(np.sqrt(np.mean(part**2)) == pytest.approx(1.0, rel=0.1) for part in own[:-1])
    kept = without_outliers(records, rest, 100.0)
    assert kept is not None
    assert [len(one.channels.contacts.time) for one in kept] == [600] * 4 + [600 - 36]
    assert np.hypot(*_found(kept).causes[0].numbers) == pytest.approx(SIZE, abs=5.0 * NOISE / np.sqrt(3000))


def test_records_that_agree_are_held_against_all_of_them():
    records = _records()
    found = _found(records)
    assert _held(records, found) is found.rest


def test_a_cause_beside_one_that_is_like_it_still_shows_in_every_record():
    """Two causes that nearly cancel are each far larger than what they bring."""
    records = _records()
    alone = _found(records)
    nothing = fit(records, _base(records), ())
    assert is_accepted(records, alone.causes[0], nothing, alone, MORE)
    numbers = np.array([5.0, 0.0]) * SIZE
    large = begin(WAVE, numbers / WAVE.unit)
    assert is_accepted(records, large, nothing, alone, MORE)


def test_a_cause_that_gains_in_one_record_alone_is_none():
    records = _records()
    nothing = fit(records, _base(records), ())
    cause = begin(WAVE, np.array([0.2, 0.0]))
    cuts = np.cumsum([len(one.channels.contacts.time) for one in records])
    rest = nothing.rest.copy()
    rest[: cuts[3]] *= 1.01
    rest[cuts[3] : cuts[4]] *= 0.1
    alone = Fit((cause,), float(rest @ rest), np.eye(2), rest)
    assert nothing.chi2 - alone.chi2 > ACCEPT
    assert not is_accepted(records, cause, nothing, alone, MORE)


def test_a_record_cut_badly_is_left_out_as_a_whole_where_it_agrees_with_no_other():
    records = _records(wrong=0.4, far=1e-4)
    last = records[-1].channels
    records[-1] = replace(records[-1], channels=last._replace(left_out={"contact": 300}))
    assert badly_segmented(records[-1])
    found = search(records, 5)
    assert [len(one.channels.contacts.time) for one in found.records] == [600] * 4 + [0]
    assert found.records[-1].channels.left_out["contact"] == 900
    assert len(found.records[-1].channels.drive.time) == 600
    (cause,) = [one for one in found.fit.causes if one.candidate.kind == "transmission_error"]
    assert np.hypot(*cause.numbers) == pytest.approx(SIZE, abs=5.0 * NOISE / np.sqrt(2400))


def test_a_record_that_disagrees_but_was_cut_well_stays():
    records = _records(wrong=0.4, far=1e-4)
    assert not any(map(badly_segmented, records))
    assert len(search(records, 5).records[-1].channels.contacts.time) == 600


@pytest.mark.parametrize("kind", ["drag_viscous", "mesh_drag"])
def test_a_drag_that_drives_is_no_cause_however_well_it_fits(kind):
    drag = Candidate(kind, {}, "coefficient", 1e-3, False, ("flight", "loss"))
    assert begin(drag, np.array([0.3])).possible
    assert not begin(drag, np.array([-0.3])).possible
    assert has_possible_size(begin(drag, np.array([0.3])))
    assert not has_possible_size(begin(drag, np.array([-0.3])))
    assert not begin(drag, np.array([0.0])).possible  # nothing at all


@pytest.mark.parametrize(("time", "possible"), [(0.1, False), (0.11, True), (1e4, True)])
def test_a_change_that_ends_as_early_as_it_may_is_a_constant_torque(time, possible):
    drift = begin(Candidate("drag_drift", {"time_constant": 1.0}, "relative_change", 1.0, False, ("flight",)), [0.2])
    ended = drift._replace(numbers=within_bounds(drift, np.array([0.2, np.log(time)])))
    assert ended.possible == has_possible_size(ended) == possible


def test_a_cause_that_is_there_is_no_candidate_any_more():
    drag = Candidate("mesh_drag", {}, "coefficient", 1.0, False, ("loss",))
    other = WAVE._replace(shape={**WAVE.shape, "order": 4})
    left = [Scored(one, 1e4, np.array([0.3]), np.array([0.01])) for one in (drag, WAVE, other)]
    assert [one.candidate for one in acceptable(left, MORE)] == [drag, WAVE, other]
    there = [begin(drag, np.array([0.1])), begin(WAVE, np.array([0.1, 0.0]))]
    assert [one.candidate for one in acceptable(left, MORE, there)] == [other]
