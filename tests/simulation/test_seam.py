"""Adding an effect is adding one file: a new cause in a foreign package runs in twin and engine unasked."""

import importlib
import sys

import numpy as np
import pytest

import gears3d as g3
from gears3d.effects.base import _REGISTRY

EFFECT = '''
from dataclasses import dataclass
from typing import ClassVar
from gears3d.effects import Param, register
from gears3d.effects.rows import torque_power

@register
@dataclass(frozen=True)
class DragWindage:
    """Windage of the gear's rim, C = coefficient * w**2."""
    coefficient: float
    kind: ClassVar[str] = "drag_windage"
    place: ClassVar[str] = "torque"
    params: ClassVar[dict] = {"coefficient": Param("ratio", 0.0, 10.0)}

    def rows(self, rig):
        return [torque_power(self.coefficient, 2.0)]

    def unit_size(self, rig):
        return rig.drag_torque / rig.mean_speed**2
'''
COEFFICIENT = 0.02  # N m s2: about the base drag at 30 rpm


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    package = tmp_path / "windage_lab"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "drag_windage.py").write_text(EFFECT)
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("windage_lab.drag_windage")
    base = g3.load("scenarios/rigaud-2020/fig5-20rpm.toml", overrides=["run.duration=1 s"])
    effect = [{"kind": "drag_windage", "coefficient": COEFFICIENT}]
    yield base, base.with_({"effect": effect})
    del _REGISTRY["drag_windage"]
    for name in [name for name in sys.modules if name.startswith("windage_lab")]:
        del sys.modules[name]


def deceleration_in_flight(recording, backlash):
    """Return speed and deceleration of the loose gear at samples well inside flights."""
    signals = recording.signals
    omega, time = signals["omega_loose_rad_s"], signals["time_s"]
    s = signals["displacement_m"]
    inside = (s > 0.1 * backlash) & (s < 0.9 * backlash)
    inside = inside & np.roll(inside, 3) & np.roll(inside, -3)
    rate = np.zeros_like(omega)
    rate[1:-1] = (omega[2:] - omega[:-2]) / (time[2:] - time[:-2])
    return omega[inside], -rate[inside]


@pytest.mark.parametrize("model", ["rigid", "bullet"])
def test_a_new_effect_acts_in_both_models_by_its_own_law(scenario, model):
    _, extended = scenario
    rig = extended.rig()
    recording = g3.simulate(extended, model=model)
    omega, deceleration = deceleration_in_flight(recording, rig.backlash)
    assert len(omega) > 500
    expected = (rig.drag_torque + COEFFICIENT * omega**2) / rig.inertia
    assert np.ptp(expected) > 0.1 * expected.mean()
    np.testing.assert_allclose(deceleration, expected, rtol=2e-3)


def test_the_change_is_the_same_in_both_models(scenario):
    base, extended = scenario
    change = {}
    for model in ("rigid", "bullet"):
        plain, more = (g3.simulate(s, model=model).impacts for s in (base, extended))
        first = slice(0, 2)  # the first crossing and its impact: before anything can drift apart
        change[model] = [more[key][first] - plain[key][first] for key in ("time_s", "velocity_m_s")]
    np.testing.assert_allclose(change["bullet"], change["rigid"], rtol=0.05)
