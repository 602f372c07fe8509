"""A body that the loose gear carries on a spring: its motion in windows, and the search that names it."""

import numpy as np
import pytest

from gears3d.diagnosis import diagnose
from gears3d.diagnosis.causes import Candidate, begin, swings
from gears3d.diagnosis.path_candidates import playing
from gears3d.diagnosis.path_fit import followed, state_of
from gears3d.diagnosis.path_search import path_search
from gears3d.diagnosis.verdict import is_sine
from gears3d.effects import catalogue
from gears3d.measured.checks import admit_all
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan
from tests.diagnosis.test_shooting import RIG, low_of, shot

RATIO, CYCLES = 0.3, 5.0
"""Inertia over that of the gear, and periods of the natural frequency in a fall across the backlash."""
SMALL = {
    "drag_position": {"amplitude": 1e-4, "order": 2, "phase": 0.3},
    "drag_viscous": {"coefficient": 1e-5},
    "restitution_asymmetry": {"asymmetry": 1e-4},
    "backlash_offset": {"offset": 1e-9},
    "eccentricity": {"offset": 1e-9, "phase": 0.3, "gear": "drive"},
    "encoder_eccentricity": {"amplitude": 1e-8, "phase": 0.3, "gear": "drive"},
    "encoder_skew": {"delay": 1e-8, "gear": "loose"},
}


@pytest.fixture(scope="module")
def rig():
    return load(RIG, {"run.duration": "6 s", "run.settle": "0 s"})


def body(rig, ratio=RATIO, cycles=CYCLES, damping=0.03, play=0.0):
    """A body by inertia ratio, periods of the natural frequency in a fall, damping ratio and play in backlashes."""
    own, known = rig.rig().inertia, rig.rig()
    fall = np.sqrt(2.0 * known.backlash * own / known.base_radius_loose / known.drag_torque)
    turn, per = 2.0 * np.pi * cycles / fall, (1.0 + 1.0 / ratio) / own
    wide = play * known.backlash / known.base_radius_loose
    numbers = {"inertia": ratio * own, "stiffness": turn**2 / per, "damping": 2.0 * damping * turn / per, "play": wide}
    return catalogue()["carried_inertia"](**{name: float(value) for name, value in numbers.items()})


def settled_on(windows, effects):
    windows.restart(effects, anew=True)
    return followed(windows, effects, windows.residuals(effects))


@pytest.mark.parametrize("ratio", [0.3, 1.0])
def test_windows_go_where_two_masses_on_a_spring_go(rig, ratio):
    """The other integrator is that of the rigid model, with controlled steps."""
    effects = [body(rig, ratio)]
    windows, _ = shot(rig, effects)
    missed = np.abs(settled_on(windows, effects) * windows.sigma)
    assert np.median(missed) < 5e-4 * windows.backlash
    assert np.quantile(missed, 0.9) < 2e-3 * windows.backlash
    blind = np.abs(settled_on(windows, []) * windows.sigma)
    assert np.mean(blind) > 10.0 * np.mean(missed)


@pytest.mark.parametrize("kind", SMALL)
def test_small_changes_are_followed_with_a_body(rig, kind):
    effects, effect = [body(rig)], catalogue()[kind](**SMALL[kind])
    windows, _ = shot(rig, effects)
    settled_on(windows, effects)
    run = windows.along(effects)
    apart = run.rest - windows.residuals([*effects, effect])
    assert np.median(windows.level(run.column(effect) - apart)) < 0.05**2 * np.median(windows.level(apart))


@pytest.mark.parametrize("number", range(4))
def test_small_changes_of_starts_and_twists_are_followed(rig, number):
    effects, small = [body(rig)], 1e-5
    windows, _ = shot(rig, effects)
    settled_on(windows, effects)
    run, starts = windows.along(effects), windows.starts
    free = windows.starts.mode == 0
    by = small * np.eye(4)[number] * np.array([*windows.units(), *windows.turns()])
    moved = starts._replace(
        place=starts.place + by[0] * free, rate=starts.rate + by[1] * free, twist=starts.twist + by[2:]
    )
    apart = (run.rest - windows.residuals(effects, moved)) / small
    usual = np.median(windows.level(apart)[free])
    assert np.median(windows.level(run.starts()[number] - apart)[free]) < 0.05**2 * usual


@pytest.mark.parametrize("carried", [True, False])
def test_grazing_impacts_have_finite_slopes(rig, carried):
    """An approach at no speed has no slope; it ended a diagnosis of eccentric encoders and drag of the mesh."""
    effects = [body(rig)] if carried else []
    windows, _ = shot(rig, effects)
    settled_on(windows, effects)
    along = windows.along(effects)
    along.run.events[:, ::3, 4] = 0.0
    assert np.all(np.isfinite(along.starts()))


def test_where_no_body_helps_none_gets_a_play(rig):
    """It ended a diagnosis of waves of a flank in the operating space."""
    windows, _ = shot(rig)
    none = state_of(windows, (), settled_on(windows, []))
    assert playing(windows, none, 0.0) is none


def searched(rig, effects):
    """What a search for torques, restitution and a body finds in records of a rig with effects."""
    windows, _ = shot(rig, effects)
    plain = [one for one in low_of(rig, windows) if one.kind.startswith(("drag_c", "drag_v", "restitution_o"))]
    law = Candidate("carried_inertia", {}, "inertia", rig.rig().inertia, False, ())
    return path_search(windows, [*plain, law])


@pytest.mark.slow
@pytest.mark.parametrize("more", [{}, {"drag_coulomb": {"torque": 0.04}}])
def test_a_body_is_found_with_its_inertia_and_frequency(rig, more):
    own = body(rig)
    found = searched(rig, [own, *(catalogue()[kind](**numbers) for kind, numbers in more.items())])
    kinds = [one.candidate.kind for one in found.causes]
    assert sorted(kinds) == sorted(["carried_inertia", *more])
    cause = found.causes[kinds.index("carried_inertia")]
    true = np.sqrt(own.stiffness * (1.0 / rig.rig().inertia + 1.0 / own.inertia))
    assert cause.numbers[0] == pytest.approx(own.inertia, rel=0.1)
    assert swings(cause)[0] == pytest.approx(true, rel=0.02)
    assert found.after < 4.0


def test_a_body_is_no_sine_over_the_angle(rig):
    windows, _ = shot(rig, [body(rig)])
    settled_on(windows, [body(rig)])
    own = body(rig)
    shape = {"stiffness": own.stiffness, "damping": own.damping, "play": own.play}
    law = Candidate("carried_inertia", shape, "inertia", rig.rig().inertia, False, ())
    assert not is_sine(windows, (begin(law, np.array([RATIO])),))


def diagnosed(folder, kinds, seed, **options):
    hide(plan(seed, kinds, noise=0.003, **options), folder)
    bench = load(folder / "rig.toml")
    return diagnose(admit_all([folder / "record.toml"], bench), bench)


@pytest.mark.slow
@pytest.mark.usefixtures("low_orders")
def test_a_hidden_body_is_named_with_intervals_and_confirmed_by_other_windows(tmp_path):
    found = diagnosed(tmp_path, ("carried_inertia",), 4, size=0.3, records=2, duration=3.0)
    assert [one.kind for one in found.causes] == ["carried_inertia"]
    assert found.verdict == "explained"
    told = found.to_dict()["causes"][0]["parameters"]
    assert all(told[name]["ci95"][0] < told[name]["ci95"][1] for name in ("inertia", "stiffness", "damping"))
    true = plan(4, ("carried_inertia",), size=0.3, records=2, duration=3.0, noise=0.003).told()["effects"][0]
    assert told["inertia"]["value"] == pytest.approx(true["inertia"], rel=0.01)
    assert told["stiffness"]["value"] == pytest.approx(true["stiffness"], rel=0.01)
    assert "natural frequency" in found.causes[0].evidence
    assert found.to_dict()["heldout"]["gain"] > 0.9
    assert found.extended.effects[-1].kind == "carried_inertia"


@pytest.mark.slow
@pytest.mark.usefixtures("low_orders")
def test_noise_is_no_body(tmp_path):
    assert not diagnosed(tmp_path, (), 4, records=2, duration=2.0).causes


@pytest.mark.slow
def test_an_encoder_that_sways_on_its_mount_is_no_body(tmp_path):
    found = diagnosed(tmp_path, ("encoder_mount",), 3)
    assert not [one.kind for one in found.causes]
    assert found.verdict in ("unexplained", "not_decidable")
