"""Runs that are proposed to tell a cause from a rival do tell them apart, by what was predicted."""

import numpy as np
import pytest

from gears3d.diagnosis import diagnose
from gears3d.diagnosis.search import RUN_DURATION, known_of, rivals, runs
from gears3d.measured.checks import admit
from gears3d.scenario import load
from gears3d.simulation import record
from tests.diagnosis import asked

BENCH = {"run.duration": "3 s", "run.settle": "0 s", "sensors.sample_rate": "20 kHz", "gears.drive.teeth": 45,
         "gears.loose.teeth": 60, "motion.mean": "60 rpm", "sensors.drive.noise": "5 urad",
         "sensors.loose.noise": "50 urad"}  # fmt: skip
HIDDEN = [{"kind": "drag_viscous", "coefficient": "0.002 N m s/rad"}]


def bench(**changes):
    return load("scenarios/rigaud-2020/fig5-20rpm.toml", {**BENCH, **changes})


def admitted(folder, name, own, seed):
    path = folder / f"{name}.parquet"
    record(own.with_({"effect": HIDDEN}), seed=seed).write(path)
    return admit(path, own)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder, rig = tmp_path_factory.mktemp("runs"), bench()
    with pytest.MonkeyPatch.context() as patch:
        asked.only(patch, lambda one: one.kind in ("drag_coulomb", "drag_viscous"))
        alone = diagnose([admitted(folder, "a", rig, 1)], rig, runs=True)
        best = alone.runs[0].runs[0]
        more = rig.with_([("run.duration", f"{best.duration} s"), *best.keys.items()])
        both = diagnose([admitted(folder, "a", rig, 1), admitted(folder, "b", more, 2)], rig)
    return alone, best, both


@pytest.mark.slow
def test_a_rival_is_named_with_the_runs_that_would_exclude_it(found):
    alone, best, _ = found
    one = alone.runs[0]
    assert {one.cause, one.rival} == {"drag_coulomb", "drag_viscous"}
    assert one.now < 4.0
    sigmas = [run.sigma for run in one.runs if run.sigma is not None]
    assert sigmas == sorted(sigmas, reverse=True)
    assert best.change.startswith("mean speed")
    assert best.sigma > 3.0 * one.now + 3.0


def test_the_proposed_run_separates_them_as_predicted(found):
    _, best, both = found
    assert [cause.kind for cause in both.causes] == ["drag_viscous"]
    assert all(one.excluded for one in both.others[0] if one.causes[0].candidate.kind == "drag_coulomb")
    known = known_of(both.found.records, 4)[1]
    in_channels = rivals(both.found.records, both.found._replace(known=known))[0]  # as predicted; the path tells more
    rival = next(one for one in in_channels if one.causes[0].candidate.kind == "drag_coulomb")
    assert rival.excluded
    level = max(both.found.fit.chi2 / len(both.found.fit.rest), 1.0)
    assert np.sqrt(rival.worse / level) == pytest.approx(best.sigma, rel=0.3)


def test_json_has_every_run_and_what_it_sets(found):
    alone, _, _ = found
    told = alone.to_dict()["experiments"][0]
    assert len(told["runs"]) == len(runs(alone.found.records[0])) == 7
    assert all(load("scenarios/rigaud-2020/fig5-20rpm.toml", {**BENCH, **one["set"]}) for one in told["runs"])
    assert {one["duration_s"] for one in told["runs"]} == {RUN_DURATION, 5 * RUN_DURATION}


def test_without_rivals_nothing_is_proposed(found):
    _, _, both = found
    assert both.runs == ()
    assert both.to_dict()["experiments"] == []
