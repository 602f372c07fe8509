"""A run-down in the engine is that of the closed form, and gives the drag back."""

import numpy as np
import pytest

from gears3d import cli
from gears3d.bench import rundown
from gears3d.errors import InputError
from gears3d.scenario import load

RIG = "scenarios/base/rigaud-2020.toml"


@pytest.mark.slow
def test_dry_and_viscous_drag_follow_the_closed_form():
    viscous = {"kind": "drag_viscous", "coefficient": "0.02 N m s/rad"}
    run = rundown(load(RIG, {"effect": [viscous]}), speed=20.0)
    rate, floor = 0.02 / 0.0695, 0.22 / 0.02
    moving = run.omega > 0.0
    exact = (20.0 + floor) * np.exp(-rate * run.time) - floor
    assert run.omega[moving] == pytest.approx(exact[moving], abs=1e-7)
    gone = (20.0 + floor) * -np.expm1(-rate * run.time) / rate - floor * run.time
    assert run.theta[moving] == pytest.approx(gone[moving], abs=1e-7)
    assert run.time[moving][-1] == pytest.approx(np.log(1.0 + 20.0 / floor) / rate, abs=1e-4)
    assert (run.theta[~moving] == run.theta[-1]).all()
    assert run.found.law == "coulomb+viscous"
    for name, truth in (("coulomb", 0.22), ("viscous", 0.02)):
        found = run.found.parameters[name]
        assert found.low < truth < found.high


def test_flanks_play_no_part():
    effects = [
        {"kind": "transmission_error", "order": 3, "amplitude": "40 um"},
        {"kind": "mesh_friction", "coefficient": 0.1},
    ]
    bare, other = rundown(load(RIG)), rundown(load(RIG, {"effect": effects}))
    assert (bare.theta == other.theta).all()


def test_nothing_that_slows_it_down():
    with pytest.raises(InputError, match="does not stop"):
        rundown(load(RIG, {"drag.torque": "0 N m"}))
    with pytest.raises(InputError, match="nothing runs down"):
        rundown(load(RIG, {"motion.mean": "0 rpm", "run.settle": "0 s"}))


@pytest.mark.slow
def test_bench_and_identify_give_the_same_warnings_and_the_same_residual(tmp_path, capsys):
    """A torque of an order is in no law of drag: the residual has structure."""
    effect = 'effect=[{kind="drag_position", amplitude="0.05 N m", order=3}]'
    said = []
    for words in (
        ("bench", "coastdown", RIG, "--set", effect, "--out", tmp_path / "made"),
        ("identify", "coastdown", tmp_path / "made" / "record.parquet", "--rig", tmp_path / "made" / "scenario.toml"),
    ):
        with pytest.raises(SystemExit) as end:
            cli.main([*map(str, words)])
        assert end.value.code == 0
        said.append(capsys.readouterr())
    bench, identified = said
    assert "residual has structure" in identified.err
    assert bench.err == identified.err
    (line,) = [line for line in identified.out.splitlines() if line.startswith("residual: ")]
    assert line in bench.out.splitlines()
