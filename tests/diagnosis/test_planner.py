"""Runs that are planned: predicted intervals follow closed forms, what cannot be seen or separated is said to be so."""

import json
from math import pi

import numpy as np
import pytest

from gears3d.cli import main
from gears3d.diagnosis import plan
from gears3d.diagnosis.causes import MODEL
from gears3d.diagnosis.planner import SIGMAS, needed
from gears3d.errors import InputError, UsageError
from gears3d.scenario import load

RIG = "scenarios/rigaud-2020/fig5-20rpm.toml"
FINE = 1_000_000
RPM = pi / 30.0


@pytest.fixture(scope="module")
def rig():
    """A gear pair that turns fast enough for some revolutions in 4 s, and whose encoders are read at 10 kHz."""
    return load(RIG, {"motion.mean": "90 rpm", "sensors.sample_rate": "10 kHz", "run.settle": "0 s"})


def one_run(rig, *causes, **more):
    """The plan of one run at the rig's own speed and fluctuation."""
    usual = {"speeds": [rig.motion.mean], "amplitudes": [rig.motion.harmonics[0].amplitude], "lengths": [4.0],
             "counts": [FINE], "noise": 2e-5, "most": 1}  # fmt: skip
    (option,) = plan(rig, list(causes), **{**usual, **more}).options
    return option


def half(option, kind, name):
    """Return half the width of an interval without the error of the model, which more data do not reduce."""
    one = option.grid[0].alone[kind][name]
    return np.sqrt((0.5 * (one.high - one.low)) ** 2 - (1.96 * MODEL * one.value) ** 2)


@pytest.mark.slow
def test_the_interval_of_a_drag_narrows_with_the_root_of_the_duration(rig):
    """The same seconds are simulated for both, so that the law is exact."""
    short, long = (
        half(one_run(rig, "drag_coulomb", lengths=[lasts]), "drag_coulomb", "torque") for lasts in (8.0, 32.0)
    )
    assert long == pytest.approx(0.5 * short, rel=1e-6)


@pytest.mark.slow
def test_twice_the_noise_makes_intervals_twice_as_wide(rig):
    quiet, loud = (one_run(rig, "drag_coulomb", "backlash_offset", noise=noise) for noise in (3e-5, 6e-5))
    for kind, name in (("drag_coulomb", "torque"), ("backlash_offset", "offset")):
        assert half(loud, kind, name) == pytest.approx(2.0 * half(quiet, kind, name), rel=0.25)


def test_the_size_that_shows_is_five_standard_deviations(rig):
    option = one_run(rig, "drag_coulomb", size=1e-6)
    (aim,), (run,) = option.aims, option.runs
    (torque,) = run.alone["drag_coulomb"].values()
    assert aim.value == pytest.approx(SIGMAS * 0.5 * (torque.high - torque.low) / 1.96 / rig.drag.torque)
    assert not aim.reached
    assert aim.possible
    assert run.together == run.alone


def test_restitution_does_not_show_where_no_flank_is_struck(rig):
    gentle = rig.motion.harmonics[0].amplitude / 20.0
    option = one_run(rig, "restitution_offset", amplitudes=[gentle])
    (aim,) = option.aims
    assert (aim.possible, aim.reached, option.runs) == (False, False, ())
    assert option.grid[0].alone["restitution_offset"]["offset"].high > rig.impact.restitution


@pytest.mark.slow
def test_a_torque_over_speed_is_told_from_a_constant_one_at_two_speeds_alone(rig):
    pair = {"separate": ["drag_viscous", "drag_coulomb"], "amplitudes": [10.0 * RPM], "at": 0.02, "most": 3}
    once = one_run(rig, speeds=[300.0 * RPM], **pair)
    assert [one.reached for one in once.aims] == [False, False]
    twice = one_run(rig, speeds=[300.0 * RPM, 100.0 * RPM], **pair)
    assert [one.reached for one in twice.aims] == [True, True]
    assert {round(run.mean / RPM) for run in twice.runs} == {100, 300}
    assert all(one.value > needed() for one in twice.aims)


@pytest.mark.slow
def test_order_1_of_either_gear_is_the_same_where_both_have_as_many_teeth(rig):
    order = "transmission_error:order=1:flank=both:gear"
    alike = one_run(rig, separate=[f"{order}=drive", f"{order}=loose"])
    assert not any(one.possible for one in alike.aims)
    apart = one_run(rig, separate=[f"{order}=drive", "drag_coulomb"])
    assert all(one.reached for one in apart.aims)


@pytest.mark.slow
def test_a_power_law_can_be_a_viscous_one(rig):
    option = one_run(rig, separate=["drag_viscous", "drag_power"], speeds=[300.0 * RPM, 100.0 * RPM], at=0.1)
    viscous = next(one for one in option.aims if one.name.startswith("drag_viscous"))
    assert not viscous.possible


@pytest.mark.slow
def test_nuisances_that_are_free_widen_intervals(rig):
    alone = one_run(rig, "drag_coulomb")
    both = one_run(rig, "drag_coulomb", nuisances=["drag_viscous"])
    assert half(both, "drag_coulomb", "torque") > 2.0 * half(alone, "drag_coulomb", "torque")
    assert [one.name for one in both.aims] == ["drag_coulomb"]


@pytest.mark.slow
def test_phases_of_encoders_without_marks_are_free_in_every_run_but_the_first(rig):
    known = {}
    for marks in (True, False):
        usual = {"speeds": [rig.motion.mean], "amplitudes": [rig.motion.harmonics[0].amplitude], "lengths": [4.0],
                 "counts": [FINE], "noise": 2e-5, "most": 2, "size": 1e-7}  # fmt: skip
        (option,) = plan(rig, ["drag_position:order=3"], marks=marks, at=0.1, **usual).options
        first, second = (run.together["drag_position:order=3"]["phase"] for run in option.runs)
        known[marks] = (second.high - second.low) / (first.high - first.low)
    assert known[True] == pytest.approx(2.0**-0.5, rel=0.2)
    assert known[False] == pytest.approx(1.0, rel=0.2)


@pytest.mark.slow
def test_runs_become_scenarios_with_their_encoders(rig, tmp_path):
    found = plan(rig, ["drag_coulomb"], speeds=[rig.motion.mean], amplitudes=[rig.motion.harmonics[0].amplitude],
                 lengths=[4.0, 8.0], counts=[FINE], noise=2e-5)  # fmt: skip
    found.save(tmp_path)
    written = load(tmp_path / "run-1.toml")
    assert written.run.duration == 4.0
    assert written.sensors.drive.counts_per_revolution == FINE
    assert written.sensors.loose.noise == pytest.approx(2e-5)
    told = json.loads((tmp_path / "plan.json").read_text())
    (option,) = told["options"]
    assert option["reached"] is True
    assert option["runs"][0]["alone"]["drag_coulomb"]["torque"]["ci95"] is not None


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"causes": ["drag_viscus"]}, "drag_viscous"),
        ({"causes": ["drive_motion"]}, "not planned for"),
        ({"causes": ["transmission_error:order=900"]}, "order="),
        ({"causes": ["drag_power:exponent=fast"]}, "exponent"),
        ({"separate": ["drag_viscous"]}, "two sets"),
        ({"separate": ["oil_film", "drag_viscous"]}, "--causes oil_film"),
        ({"lengths": [0.0]}, "--lengths"),
        ({"counts": [-5]}, "--counts"),
        ({"size": -0.1}, "--size"),
    ],
)
def test_what_cannot_be_planned_is_refused_with_a_remedy(rig, wrong, word):
    with pytest.raises(UsageError, match=word):
        plan(rig, **{"noise": 1e-5, **wrong})


def test_readings_without_any_error_are_refused():
    with pytest.raises(InputError, match="--counts"):
        plan(load("scenarios/base/helical-17-43.toml"), ["restitution_offset"])


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--size", "2 rpm"], "--size"),
        (["--counts", "many"], "--counts"),
        (["--causes", "drag_viscus"], "drag_viscous"),
        (["--speeds", "1e3 rpm", "--amplitudes", "2e3 rpm"], "--amplitudes"),
    ],
)
def test_options_that_cannot_be_used_are_one_line_each(capsys, words, told):
    with pytest.raises(SystemExit) as ended:
        main(["plan", "rigaud-2020/fig5-20rpm", *words])
    assert ended.value.code in (2, 3)
    said = capsys.readouterr().err.strip()
    assert told in said
    assert "Traceback" not in said
    assert said.count("error:") == 1
