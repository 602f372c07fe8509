"""The engine's own steps against the predictions of the rigid model, effect by effect, and what causes are worth."""

import numpy as np
import pytest

from gears3d.diagnosis import Candidate, added, begin, residuals
from gears3d.diagnosis.evidence import evidence, uncut
from gears3d.diagnosis.residual_tests import (
    contact_stretches,
    drive_start,
    engine_check,
    engine_residuals,
    engine_scenario,
    heldout_summary,
    thinned,
)
from gears3d.effects import catalogue
from gears3d.measured.segmentation import measure
from gears3d.scenario import load
from gears3d.simulation import record

BENCH = "scenarios/rigaud-2020/fig5-20rpm.toml"
PLAIN = {"run.duration": "4 s", "run.settle": "0 s", "gears.loose.teeth": 60, "gears.drive.teeth": 45,
         "motion.mean": "60 rpm"}  # fmt: skip
EFFECTS = {
    "transmission_error": {"amplitude": 1e-5, "order": 3, "gear": "loose", "phase": 0.4},
    "backlash_offset": {"offset": 2e-5},
    "backlash_variation": {"amplitude": 1e-5, "order": 2},
    "drag_viscous": {"coefficient": 0.01},
    "drag_power": {"coefficient": 0.001, "exponent": 2.0},
    "drag_position": {"amplitude": 0.02, "order": 2},
    "drag_drift": {"relative_change": 0.3, "time_constant": 2.0},
    "restitution_offset": {"offset": 0.1},
    "restitution_speed": {"slope": 2.0},
    "restitution_asymmetry": {"asymmetry": 0.1},
    "drive_motion": {"amplitude": 0.05, "frequency": 7.0},
    "encoder_eccentricity": {"amplitude": 2e-5, "order": 1, "gear": "loose"},
}


@pytest.fixture(scope="module")
def one():
    bench = load(BENCH, PLAIN)
    return thinned(evidence(measure(record(bench), bench), bench, "r"))


@pytest.fixture(scope="module")
def plain(one):
    """What the engine predicts without any effect."""
    return engine_residuals(one, ())


@pytest.mark.slow
def test_the_engine_predicts_what_the_rigid_model_does(one, plain):
    rigid, bodies = residuals(one), plain  # the rigid fall is a polygon of 44 pieces: a tenth of a sigma
    for name, most in {"flight": 0.1, "contact": 1e-6, "impact": 1e-9}.items():
        assert len(bodies[name]) == len(rigid[name]) > 0
        assert np.abs(bodies[name] - rigid[name]).max() < most, name


@pytest.mark.parametrize("kind", EFFECTS)
def test_an_effect_adds_in_the_engine_what_its_column_says(one, plain, kind):
    effect = catalogue()[kind](**EFFECTS[kind])
    before, after = plain, engine_residuals(one, [effect])
    for name in before:
        column = added(one, [effect], name)
        made = before[name] - after[name]
        assert np.abs(made - column).max() <= 0.02 * np.abs(column).max() + 0.05, name


@pytest.mark.parametrize("kind", ["eccentricity", "pitch_error"])
def test_solids_that_are_off_move_contacts_as_their_columns_say_to_first_order(one, plain, kind):
    seen = one.channels.contacts
    tooth = round(seen.drive[seen.flank == 0][100] * 45 / (2.0 * np.pi)) % 45 + 1
    shape = {"offset": 1e-5, "gear": "drive"} | ({"tooth": tooth} if kind == "pitch_error" else {"phase": 0.3})
    effect = catalogue()[kind](**shape)
    made = plain["contact"] - engine_residuals(one, [effect])["contact"]
    column = added(one, [effect], "contact")
    off = made - column - np.median(made - column)  # but for the places where the tooth comes and goes
    assert np.mean(np.abs(off) > 0.05 * np.abs(column).max()) < 0.03
    assert np.abs(column).max() > 10.0


def test_the_drive_moves_as_it_was_measured_to(one):
    from gears3d.engine import Bench

    seen = one.channels.drive
    with Bench(engine_scenario(one, ()), drive_start(one)) as bench:
        drive = np.array([bench.drive(time)[0] for time in seen.time])
    assert np.abs(drive - seen.angle).max() < 1e-5


@pytest.mark.slow
def test_a_true_cause_is_worth_in_the_engine_what_it_is_in_the_rigid_model():
    bench = load(BENCH, PLAIN)
    truth = bench.with_({"drag.torque": "0.26 N m", "mount.backlash": "260 um"})
    records = [
        evidence(measure(record(truth.with_({"motion.mean": mean})), own), own, mean)
        for mean in ("45 rpm", "60 rpm", "80 rpm")
        for own in [bench.with_({"motion.mean": mean})]
    ]
    sought = (Candidate("drag_coulomb", {}, "torque", 0.22, False, ("flight",)),
              Candidate("backlash_offset", {}, "offset", 2.5e-4, False, ("contact",)))  # fmt: skip
    causes = [begin(one, np.array([0.01])) for one in sought]
    parts = []
    worth = engine_check(records, causes, parts.append)
    told = heldout_summary(worth.splits)
    assert worth.why == ""
    assert parts[-1] == 1.0
    assert set(told["base"]) == {"flight", "contact", "impact", "D"}
    assert told["gain"] > 0.99
    assert told["gain"] == pytest.approx(heldout_summary(worth.rigid)["gain"], abs=1e-3)


def test_nothing_to_try_and_what_the_engine_cannot_do_are_said(one):
    assert engine_check([one], ()).why == "there is no cause to try"
    mesh = Candidate("mesh_drag", {}, "coefficient", 0.01, False, ("loss",))
    assert "no effect on single flights, impacts or contacts" in engine_check([one], [begin(mesh, np.array([0.1]))]).why
    film = Candidate("oil_film", {"minimum_thickness": 1e-6}, "viscosity", 0.1, False, ("impact",))
    assert "oil" in engine_check([one], [begin(film, np.array([0.5]))]).why


def test_contacts_are_told_apart_by_time_and_flank():
    time = np.array([0.0, 1.0, 2.0, 3.0, 50.0, 51.0])
    assert [rows.tolist() for rows in contact_stretches(time, np.array([0, 0, 1, 1, 1, 1]))] == [[0, 1], [2, 3], [4, 5]]


def test_helical_gears_stand_in_the_engine_as_their_transverse_section():
    bench = load(BENCH, {**PLAIN, "gears.helix_angle": "20 deg", "gears.face_width": "10 mm", "run.duration": "2 s",
                         "gears.drive.profile_shift": 0.2})  # fmt: skip
    own = evidence(measure(record(bench), bench), bench, "r")
    made = engine_scenario(own, ()).pair()
    for which in ("drive", "loose"):
        for name in ("base_radius", "tip_radius", "root_radius", "reference_radius"):
            assert getattr(made.gear(which), name) == pytest.approx(getattr(own.pair.gear(which), name), rel=1e-12)
    for name in ("backlash", "centre_distance", "working_pressure_angle"):
        assert getattr(made, name) == pytest.approx(getattr(own.pair, name), rel=1e-9)
    some = thinned(own)
    rigid, bodies = residuals(some), engine_residuals(some, ())
    assert np.abs(bodies["contact"] - rigid["contact"]).max() < 1e-6


@pytest.mark.slow
def test_a_tooth_that_is_off_is_asked_of_helical_teeth():
    bench = load(BENCH, {**PLAIN, "gears.helix_angle": "20 deg", "gears.face_width": "10 mm", "run.duration": "2 s"})
    own = evidence(measure(record(bench), bench), bench, "r")
    tooth = Candidate("pitch_error", {"tooth": 3, "gear": "drive", "flank": "both"}, "offset", 2.5e-4, False,
                      ("contact",))  # fmt: skip
    assert not engine_check([own], [begin(tooth, np.array([0.1]))]).why


def test_contacts_in_which_a_cause_shows_are_among_those_that_are_predicted():
    bench = load(BENCH, PLAIN)
    own = evidence(measure(record(bench), bench), bench, "r")
    tooth = round(own.channels.contacts.drive[0] * 45 / (2.0 * np.pi)) % 45 + 1
    effect = catalogue()["pitch_error"](offset=1e-5, tooth=tooth, gear="drive")
    plain, asked = thinned(own), thinned(own, [effect])
    assert len(asked.channels.contacts.time) >= len(plain.channels.contacts.time)
    assert np.ptp(added(asked, [effect], "contact")) > 10.0


def test_records_that_are_not_segmented_leave_a_reason():
    rig, cause = load(BENCH), Candidate("drag_coulomb", {}, "torque", 1.0, False, ("flight", "loss"))
    found = engine_check([uncut(rig, "r.parquet")], [begin(cause, np.array([0.1]))])
    assert not found.splits
    assert "no record could be segmented" in found.why
