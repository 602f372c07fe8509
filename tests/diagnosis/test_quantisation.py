"""Where encoders are coarse, what is off in one record alone is told of no gear; what all show is."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis import BINS, Structure, diagnose, uncut
from gears3d.diagnosis.residual_tests import (
    COARSE_COUNT,
    count_notes,
    quantum_of,
    single_record_note,
    without_quantisation,
)
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide
from tests.diagnosis.blind import FINE, NOISY, PARTS, Case, cases, play

BACKLASH = 1e-4


def record(name, counts, blows):
    gear = SimpleNamespace(counts_per_revolution=counts)
    sensors = SimpleNamespace(drive=gear, loose=SimpleNamespace(counts_per_revolution=0))
    few, none = np.zeros((0, BINS)), SimpleNamespace(time=np.zeros(0))
    channels = SimpleNamespace(
        flights=SimpleNamespace(time=few), contacts=none, losses=none, drive=none,
        impacts=SimpleNamespace(time=np.arange(float(blows))),
    )  # fmt: skip
    return SimpleNamespace(name=name, scenario=SimpleNamespace(sensors=sensors), radii=(0.05, 0.05), channels=channels,
                           drive=none, rig=SimpleNamespace(backlash=BACKLASH))  # fmt: skip


@pytest.mark.parametrize(
    "part",
    [pytest.param(part, marks=pytest.mark.slow if part in ("ablation", "limits") else ()) for part in PARTS],
)
def test_of_all_benches_only_those_meant_to_be_are_coarse(part):
    for case in cases(part, 0, 1):
        quantum = quantum_of(uncut(case.plan().rig))
        assert quantum > 2.0 * COARSE_COUNT if part == "coarse" else quantum < 0.05 * COARSE_COUNT


def looked(records, rest):
    """Structure wherever any record is off on the mean."""
    sizes = np.cumsum([len(one.channels.impacts.time) for one in records])
    off = any(abs(part.mean()) > 1.0 for part in np.split(rest, sizes[:-1]) if part.size)
    return [Structure("impact.speed", 1.0, 0.0, 1.0, "m/s", 0.0)] if off else []


def test_a_count_is_that_of_the_coarser_encoder_over_the_backlash():
    assert quantum_of(record("a", 8192, 3)) == pytest.approx(2.0 * np.pi * 0.05 / 8192 / BACKLASH)
    assert quantum_of(record("a", 0, 3)) == 0.0


@pytest.mark.parametrize(
    ("off", "counts", "told"),
    [
        ((0.0, 3.0, 0.0), 8192, False),  # one record alone
        ((0.0, 3.0, 2.0), 8192, True),  # two of them
        ((0.0, 3.0, 0.0), 1_000_000, True),  # fine encoders do no such thing
    ],
)
def test_what_one_record_alone_has_is_told_of_fine_encoders_only(off, counts, told):
    records = [record(name, counts, 20) for name in "abc"]
    assert (quantum_of(records[0]) > COARSE_COUNT) is (counts == 8192)
    rest = np.concatenate([np.full(20, each) for each in off])
    same, odd = without_quantisation(records, rest, looked)
    assert [len(same), len(odd)] == [int(told), int(not told)]
    notes = count_notes(records, odd)
    assert [note.kind for note in notes] == [] if told else ["coarse-counts"]


def test_rebounds_like_those_before_them_are_told_of_fine_encoders_only():
    rest = np.full(60, 3.0)

    def alike(records, rest):
        return [Structure("impact.time", 1.0, 0.0, 1.0, "m/s", 2.0)]

    for counts, told in ((8192, 0), (1_000_000, 1)):
        records = [record(name, counts, 20) for name in "abc"]
        assert len(without_quantisation(records, rest, alike)[0]) == told


@pytest.mark.parametrize(
    ("sizes", "told"), [((3.0, 3.0, 3.0), False), ((9.0, 0.0, 0.0), True), ((9.0, -4.0, 3.0), True)]
)
def test_a_cause_must_gain_without_the_record_in_which_it_gains_most(sizes, told, monkeypatch):
    records = [record(name, 8192, 20) for name in "abc"]
    own = np.repeat(np.abs(sizes), 20)
    rest = np.where(np.repeat(sizes, 20) < 0.0, -own, 0.0)  # where it is of the wrong sign it takes away nothing
    monkeypatch.setattr("gears3d.diagnosis.residual_tests.contribution", lambda *_: own)
    cause = SimpleNamespace(effect=object(), candidate=SimpleNamespace(kind="restitution_speed"))
    note = single_record_note(records, rest, cause)
    assert (note is not None) is told
    assert note is None or note.record == "a"


def test_of_one_record_all_is_told():
    records = [record("a", 8192, 20), record("b", 8192, 0)]
    rest = np.full(20, 3.0)
    assert len(without_quantisation(records, rest, looked)[0]) == 1


def test_a_fluctuation_that_no_encoder_resolves_leaves_causes_undecided():
    """Its amplitude is a seventh of a count: drag, scatter and torques over the angle were named instead of a drag."""
    found = play(next(iter(cases("space", 1269, 1))))
    assert found["verdict"] == "not_decidable"
    assert not found["causes"]


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "noise"), [(395, FINE), (397, FINE), (398, FINE), (403, NOISY)])
def test_coarse_encoders_on_a_bench_with_nothing_hidden_are_no_effect(seed, noise, tmp_path):
    hide(Case("coarse", seed, (), (("noise", noise),), bench="coarse").plan(), tmp_path)
    rig = load(tmp_path / "rig.toml")
    found = diagnose([admit(file, rig, chart) for file, chart in files_of([tmp_path / "record.toml"])], rig)
    assert found.causes == ()
    assert found.verdict == "nothing_to_add"  # the path is explained to the noise of counts
