"""Which effect acts in which model: the one table against short runs, messages and the documentation."""

import importlib
import json
from functools import cache

import numpy as np
import pytest

from gears3d import cli
from gears3d.effects import Code, Gate, catalogue
from gears3d.effects.support import NATIVE, TAKEN, models_of
from gears3d.errors import InputError
from gears3d.scenario import load
from gears3d.simulation import MODELS, simulate

FILE = "scenarios/rigaud-2020/fig5-20rpm.toml"
SHORT = {"run.settle": "0 s", "run.output_rate": "2 kHz", "drag.torque": "0.3 N m"}
LASTS, LASTS_NATIVE = 0.4, 0.04
"""Durations of runs [s]; Bullet's own contact takes fixed steps of 10 us and is lost for the first time after 3 ms."""
OIL = {"kind": "oil_film", "viscosity": "10 mPa s"}
EXAMPLES = {
    "transmission_error": {"amplitude": "5 um", "order": 3},
    "eccentricity": {"offset": "5 um"},
    "pitch_error": {"offset": "10 um", "tooth": 3},
    "backlash_offset": {"offset": "20 um"},
    "backlash_variation": {"amplitude": "20 um", "order": 2},
    "carried_inertia": {"inertia": "0.02 kg m^2", "stiffness": "400 N m/rad"},
    "drag_coulomb": {"torque": "-0.05 N m"},
    "drag_viscous": {"coefficient": "1 mN m s/rad"},
    "drag_power": {"coefficient": "1 mN m", "exponent": 1.5},
    "drag_differential": {"coefficient": "1 mN m s/rad", "shaft_speed": "20 rad/s"},
    "drag_position": {"amplitude": "20 mN m"},
    "drag_drift": {"relative_change": -0.2, "time_constant": "1 s"},
    "drag_stick_slip": {"amplitude": "20 mN m", "angle": "30 deg"},
    "mesh_drag": {"coefficient": "10 mN m s/rad"},
    "mesh_friction": {"coefficient": 0.05},
    "restitution_offset": {"offset": 0.1},
    "restitution_speed": {"slope": "-2 s/m"},
    "restitution_asymmetry": {"asymmetry": -0.1},
    "restitution_scatter": {"standard_deviation": 0.05},
    "tooth_compliance": {"stiffness": "1e7 N/m", "damping": "300 N s/m"},
    "oil_film": {"viscosity": "20 mPa s"},
    "drive_motion": {"amplitude": "0.5 rpm", "order": 2.0},
    "encoder_eccentricity": {"amplitude": "0.1 mrad"},
    "encoder_skew": {"delay": "10 us"},
}
HEAD = "| effect | bullet | bullet, native contact | rigid | plastic | lubricated |"


def scenario(model, kind=None):
    """A short run that the model takes, with one more effect."""
    lasts = LASTS_NATIVE if model == NATIVE else LASTS
    changes = {**SHORT, "run.duration": f"{lasts} s", "impact.restitution": 0.0 if model == "plastic" else 0.3}
    effects = [OIL] if model == "lubricated" and kind != "oil_film" else []
    effects += [] if kind is None else [{"kind": kind, **EXAMPLES[kind]}]
    return load(FILE, changes).with_({"effect": effects})


def made(model, scene):
    return simulate(scene, "bullet", contact="native") if model == NATIVE else simulate(scene, model)


@pytest.fixture(scope="module")
def plain():
    """The recording of a model without the effect, made once."""
    return cache(lambda model: made(model, scenario(model)))


def test_the_table_names_every_model_and_knows_every_form():
    assert set(TAKEN) == {*MODELS, NATIVE}
    assert set(EXAMPLES) == {kind for kind, one in catalogue().items() if one.__module__.startswith("gears3d.")}
    assert set(TAKEN["bullet"]) == set(TAKEN["rigid"]) == set(Code)
    assert all(gates <= set(Gate) for forms in TAKEN.values() for gates in forms.values())


@pytest.mark.parametrize("model", TAKEN)
@pytest.mark.parametrize("kind", EXAMPLES)
def test_an_effect_acts_in_a_model_or_is_refused_as_the_table_says(kind, model, plain):
    scene = scenario(model, kind)
    taken = models_of(scene.effects[-1], scene.rig())
    if model in taken:
        one, other = made(model, scene), plain(model)
        assert one.meta["reached_s"] == pytest.approx(scene.run.duration)
        tables = ((one.signals, other.signals), (one.impacts, other.impacts))  # friction changes impulses alone
        assert any(not np.array_equal(mine[name], its[name]) for mine, its in tables for name in its)
        return
    with pytest.raises(InputError) as refusal:
        made(model, scene)
    fault = refusal.value.faults[0]
    where = "Bullet's own contact" if model == NATIVE else f"the {model} model"
    assert fault.key == f"effect[{len(scene.effects) - 1}]"
    assert fault.message == f"{kind!r} does not act in {where}"
    ways = [name for name in taken if name != NATIVE]
    way = "use contact = located" if model == NATIVE else f"run it with --model {' or '.join(ways)}"
    assert fault.remedy == f"leave it out, or {way}"


@pytest.mark.parametrize(("model", "kind"), [("plastic", "mesh_drag"), ("lubricated", "restitution_scatter")])
def test_check_lists_what_a_model_does_not_take(model, kind, tmp_path, capsys):
    file = tmp_path / "rig.toml"
    file.write_text(load(FILE).with_({"effect": [{"kind": kind, **EXAMPLES[kind]}]}).document)
    for words, code, count in ((["--model", "rigid"], 0, 0), (["--model", model], 3, 2)):
        with pytest.raises(SystemExit) as stop:
            cli.main(["check", str(file), *words, "--json"])
        assert (stop.value.code or 0) == code
        faults = json.loads(capsys.readouterr().out)["files"][0]["faults"]
        assert len(faults) == count
    told = next(fault for fault in faults if fault["key"] == "effect[0]")
    ways = "bullet or rigid or lubricated" if model == "plastic" else "bullet or rigid"
    assert told["message"] == f"{kind!r} does not act in the {model} model"
    assert told["remedy"] == f"leave it out, or run it with --model {ways}"


def test_the_documentation_has_the_table(monkeypatch):
    monkeypatch.syspath_prepend("tools")
    lines = importlib.import_module("docs_effects").effects().splitlines()
    start = lines.index(HEAD)
    table = {}
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        kind, *marks = (cell.strip() for cell in line.strip("|").split("|"))
        table[kind.strip("`")] = tuple(model for model, mark in zip(TAKEN, marks, strict=True) if mark == "yes")
    rig = load(FILE).rig()
    effects = {kind: scenario("rigid", kind).effects[-1] for kind in EXAMPLES}
    assert table == {kind: models_of(effect, rig) for kind, effect in effects.items()}
