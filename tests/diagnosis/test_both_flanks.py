"""A single tooth is told on one flank only where the records touch its other one."""

import numpy as np
import pytest

from gears3d.diagnosis import Candidate, Search, begin, contribution, preprocess
from gears3d.diagnosis.causes import fit
from gears3d.diagnosis.pitch_error import whole_teeth
from gears3d.diagnosis.prediction import SIDES, influence
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan

OUT = {"active": 0.1, "reverse": -0.1}
"""Sizes in backlashes of teeth that stand out."""


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """A short record in which nothing is hidden."""
    folder = tmp_path_factory.mktemp("flanks")
    hide(plan(31, (), records=1, duration=1.5, noise=0.003), folder)
    rig = load(folder / "rig.toml")
    return preprocess(next(admit(file, rig, chart) for file, chart in files_of([folder / "record.toml"])))


def told(record, tooth, flank, size):
    """Return the flank on which a tooth of the drive is told whose deviation on one flank is all that is amiss."""
    shape = {"gear": "drive", "tooth": tooth, "flank": flank}
    cause = begin(Candidate("pitch_error", shape, "offset", record.rig.backlash, False, ("contact",)), np.array([size]))
    base = contribution([record], [cause.effect])
    (only,) = whole_teeth(Search(fit([record], base, [cause]), base, [], None, [record])).fit.causes
    np.testing.assert_allclose(only.numbers, cause.numbers, rtol=1e-6)
    return only.candidate.shape["flank"]


def places(record, flank, *channels):
    """Return where a flank was touched, as the drive's angle in pitches."""
    seen = [getattr(record.channels, name) for name in channels]
    return np.concatenate([own.drive[own.flank == flank] for own in seen]) * teeth_of(record) / (2.0 * np.pi)


def teeth_of(record):
    """Return the number of teeth of the drive."""
    return record.scenario.gears.drive.teeth


def carries(record, flank):
    """Return from where to where a tooth is alone in carrying, in pitches from its number."""
    angle, moved = influence(record.pair, "drive", SIDES[flank], -1.0)
    mine = angle[np.abs(moved) > 0.5 * np.abs(moved).max()]
    return mine.min() / (2.0 * np.pi), mine.max() / (2.0 * np.pi)


def met(record, at, begin, end):
    """Return the teeth that some place lies within an interval of."""
    count = teeth_of(record)
    since = np.mod(at[:, None] - np.arange(count) - begin, count)
    return {k + 1 for k in np.flatnonzero(np.any(since < end - begin, axis=0))}


@pytest.mark.parametrize("flank", ["active", "reverse"])
def test_a_tooth_is_on_one_flank_only_where_the_other_is_touched(record, flank):
    other = 1 - SIDES.index(flank)
    begin, end = carries(record, other)
    touched = met(
        record, places(record, other, "contacts", "impacts", "losses", "velocity_jumps"), begin - 2.0, end + 2.0
    )
    untouched = {*range(1, teeth_of(record) + 1)} - touched
    rested = met(record, places(record, other, "contacts"), begin, end)
    assert len(rested) > 3
    assert len(untouched) > 3
    assert {told(record, tooth, flank, OUT[flank]) for tooth in untouched} == {"both"}
    assert {told(record, tooth, flank, OUT[flank]) for tooth in rested} == {flank}


@pytest.mark.parametrize("flank", ["active", "reverse"])
def test_a_tooth_that_stands_back_stays_on_its_flank(record, flank):
    """On the other it would throw the gear off, which nobody could miss."""
    assert {told(record, tooth, flank, -OUT[flank]) for tooth in range(1, 8)} == {flank}
