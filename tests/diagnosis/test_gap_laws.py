"""Laws of contact are told from whole paths to the flanks, hidden by a generator with equations of its own."""

import json

import pytest

from gears3d.diagnosis import diagnose
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.simulation import record
from gears3d.verification.challenge import hide, plan, reveal
from gears3d.views.pages.diagnosed import render
from tests.diagnosis.blind import cases, play

pytestmark = pytest.mark.usefixtures("low_orders")
SHORT = {"size": 0.3, "records": 2, "duration": 2.0}


def hidden(folder, kinds, seed=11, **options):
    hide(plan(seed, kinds, **options), folder)
    rig = load(folder / "rig.toml")
    return rig, [admit(file, rig, chart) for file, chart in files_of([folder / "record.toml"])]


def judged(folder, rig, admitted):
    found = diagnose(admitted, rig)
    (folder / "diagnosis.json").write_text(json.dumps(found.to_dict()), encoding="utf-8")
    return found, reveal(folder, folder / "diagnosis.json")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["oil_film", "mesh_friction", "tooth_compliance"])
def test_a_law_of_contact_is_named_and_measured(tmp_path, kind):
    found, score = judged(tmp_path / "c", *hidden(tmp_path / "c", (kind,), **SHORT))
    assert score["kinds_first"], found.to_dict()
    assert not score["wrong_names"]
    assert found.verdict == "explained"
    assert all(one["error"] is not None for one in score["parameters"])  # numbers with units, chosen ones too
    errors = [abs(one["error"]) for one in score["parameters"]]
    assert max(errors) < 0.02
    held = found.to_dict()["heldout"]
    assert held["gain"] > 0.9
    assert held["extended"]["visit"]["value"] < 0.2 * held["base"]["visit"]["value"]
    assert found.extended.effects[-1].kind == kind
    assert f"{kind} (" in render(found)


@pytest.mark.slow
@pytest.mark.parametrize("kinds", [(), ("restitution_speed",)])
def test_no_law_of_contact_where_flanks_are_rigid(tmp_path, kinds):
    found, _ = judged(tmp_path / "c", *hidden(tmp_path / "c", kinds, **SHORT))
    assert [one.kind for one in found.causes] == list(kinds)


@pytest.mark.parametrize("kinds", [(), pytest.param(("drag_viscous",), marks=pytest.mark.slow)])
def test_a_rig_whose_teeth_yield_agrees_or_lacks_what_is_hidden(tmp_path, kinds):
    soft = plan(11, ("mesh_friction",), records=2, duration=2.0).rig
    found, score = judged(tmp_path / "c", *hidden(tmp_path / "c", kinds, rig=soft, size=0.3, records=2, duration=2.0))
    assert found.verdict == ("explained" if kinds else "nothing_to_add"), found.to_dict()
    assert score["set_right"] if kinds else not found.causes
    assert not score["wrong_names"]
    assert kinds or "of backlash or drag torque." in render(found)


SPRINGS = {
    "format": 1,
    "gears": {"module": "2.128 mm", "drive": {"teeth": 30}, "loose": {"teeth": 40, "inertia": "1e-3 kg m^2"}},
    "mount": {"backlash": "100 um"},
    "motion": {"mean": "80 rad/s", "harmonics": [{"amplitude": "1500 rad/s^2", "order": 2, "phase": "-90 deg"}]},
    "drag": {"torque": "0.3 N m"},
    "impact": {"restitution": 0.6},
    "run": {"duration": "3 s", "settle": "0.2 s", "output_rate": "50 kHz"},
    "sensors": {"sample_rate": "50 kHz", "counts_per_revolution": 1_000_000},
    "effect": [
        {"kind": "tooth_compliance", "stiffness": "2e8 N/m", "damping": "3589 N s/m"},
        {"kind": "drag_viscous", "coefficient": "0.002 N m s/rad"},
    ],
}
"""Teeth as springs, and drag that depends on speed: from windows of coarse steps a drag of the mesh was named."""


@pytest.mark.slow
def test_nothing_is_named_of_a_rig_of_springs_and_viscous_drag_that_is_as_stated(tmp_path):
    rig = load(SPRINGS)
    record(rig, seed=3).write(tmp_path / "record.parquet")
    found = diagnose(tmp_path / "record.parquet", rig)
    assert found.verdict == "nothing_to_add", found


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["oil_film", "tooth_compliance", "mesh_friction"])
@pytest.mark.parametrize(("seed", "size"), [(12, 0.1), (13, 0.5)])
def test_small_and_large_laws_of_contact_at_high_noise(tmp_path, kind, seed, size):
    found, score = judged(tmp_path / "c", *hidden(tmp_path / "c", (kind,), seed, size=size, noise=0.015))
    assert score["set_right"], found.to_dict()
    assert not score["wrong_names"]
    assert all(abs(one["error"]) < 0.1 for one in score["parameters"] if one["error"] is not None and one["true"])


@pytest.mark.slow
def test_compliant_teeth_explain_a_resonance_of_the_readings():
    """Records of stiff teeth are not segmented, and ring: windows showed the cause, and were not asked."""
    told = play(next(iter(cases("space", 1360, 1))))
    assert told["kinds_first"]
    assert told["verdict"] == "explained"
    assert all(one["covered"] for one in told["parameters"])
