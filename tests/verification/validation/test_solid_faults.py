"""Faulty solids of the 3D engine are found by the diagnosis with the rig of perfect ones."""

import numpy as np
import pytest

from gears3d.diagnosis.residual_tests import heldout_3d
from gears3d.gears import quasi_static
from gears3d.scenario import load
from gears3d.verification.validation.faults import BENCH, FAULTS, judged

BY_NAME = {fault.name: fault for fault in FAULTS}


def narrower():
    """Return what the tilted axis takes off the backlash, by rolling on the surfaces [m]."""
    rig = load(BENCH)
    truth = rig.with_(BY_NAME["misaligned axis"].truth).pair()
    return float(np.mean(quasi_static(truth, np.linspace(0.0, 0.3, 20)).backlash)) - rig.pair().backlash


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "true"),
    [
        ("eccentric axis", {"offset": 20e-6, "phase": 0.872665}),
        ("centre distance", {"offset": 40e-6}),
        ("misaligned axis", {"offset": narrower}),
    ],
)
def test_faults_of_whole_gears_are_named_measured_and_mended(tmp_path, name, true):
    found = judged(BY_NAME[name], tmp_path)
    assert found.right, found.found.to_dict()
    assert found.found.verdict == "explained"
    for parameter, value in true.items():
        value = value() if callable(value) else value
        assert found.found.causes[0].parameters[parameter].value == pytest.approx(value, rel=0.01)
    rigid, solid, same = found.gains
    assert rigid > 0.95
    assert solid > 0.95
    assert solid == pytest.approx(same, abs=0.01)
    truth, nominal, extended = found.energy
    assert abs(extended - truth) < 0.2 * abs(nominal - truth)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["thick tooth", "pitch errors"])
def test_single_teeth_are_named(tmp_path, name):
    found = judged(BY_NAME[name], tmp_path)
    assert found.right, found.found.to_dict()
    numbers = {each["tooth"] for each in BY_NAME[name].truth["effect"]}
    assert {one.table["tooth"] for one in found.found.causes} <= numbers
    assert heldout_3d(found.found.bodies)["why"] == ""
    rigid, solid, same = found.gains
    assert rigid > 0.9
    assert solid > 0.9
    assert solid == pytest.approx(same, abs=0.01)


def test_every_fault_is_one_of_the_truth_alone():
    rig = load(BENCH)
    for fault in FAULTS:
        truth = rig.with_(fault.truth)
        assert truth.document != rig.document
        assert not any(effect.kind not in fault.kinds for effect in truth.effects)
