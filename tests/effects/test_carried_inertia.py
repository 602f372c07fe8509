"""A carried body against closed forms: two masses on a spring, impacts of the gear alone, accounts of energy."""

from math import inf, pi, sqrt

import numpy as np
import pytest

from gears3d.effects import Rig
from gears3d.effects.rows import torque_carried
from gears3d.errors import InputError
from gears3d.lumped import layout as at
from gears3d.lumped.model import model
from gears3d.lumped.run import run
from gears3d.simulation import simulate
from tests.effects.bench import MODELS, bench

J, BODY, K, DRAG, R, B = 0.0695, 0.03, 2000.0, 0.22, 0.148, 250e-6
SPEED, E = pi, 0.5


def packed(*rows, drag=DRAG, e=E, harmonics=(), backlash=B):
    return model(Rig(R, R, J, drag, backlash, e, SPEED, 90, 90), list(harmonics), list(rows))


def falls(t, inertia=J, body=BODY, stiffness=K, drag=DRAG, twist=0.0, rate=0.0, speed=0.0):
    """Displacement of a gear that drag decelerates, from a twist and its rate and a relative speed: two masses."""
    omega, whole = sqrt(stiffness * (1.0 / inertia + 1.0 / body)), inertia + body
    rest = drag / (inertia * omega**2)
    turned = rest + (twist - rest) * np.cos(omega * t) + rate / omega * np.sin(omega * t)
    middle = (speed / R + body / whole * rate) * t - 0.5 * drag / whole * t**2
    return R * (middle - body / whole * (turned - twist))


def test_a_fall_is_that_of_two_masses_on_a_spring():
    done = run(packed(torque_carried(BODY, K)), 0.02, 1e-4, "free")
    t, s = done.samples[:, 0], done.samples[:, 5]
    assert done.counters["impacts"] == 0
    assert np.abs(s - 0.5 * B - falls(t)).max() < 1e-9 * B
    assert np.abs(s - 0.5 * B + 0.5 * DRAG / J * R * t**2).max() > 0.05 * B  # without the body


def test_an_impact_leaves_the_body_its_speed():
    done = run(packed(torque_carried(BODY, K)), 0.045, 1e-5, "free")
    when, _, velocity, rebound, impulse = done.impacts[0, :5]
    assert rebound == pytest.approx(-E * velocity, rel=1e-12)
    assert impulse == pytest.approx(J / R**2 * (rebound - velocity), rel=1e-9)
    omega = sqrt(K * (1.0 / J + 1.0 / BODY))
    rest = DRAG / (J * omega**2)
    twist, rate = rest * (1.0 - np.cos(omega * when)), rest * omega * np.sin(omega * when)
    later = (done.samples[:, 0] > when) & (done.samples[:, 0] < done.impacts[1, 0])
    t = done.samples[later, 0] - when
    expected = falls(t, twist=twist, rate=rate - (rebound - velocity) / R, speed=rebound)
    assert later.sum() > 20
    assert np.abs(done.samples[later, 5] - expected).max() < 1e-8 * B


@pytest.mark.parametrize("play", [0.0, 2e-4])
def test_energy_goes_in_impacts_and_drag_alone(play):
    m = packed(torque_carried(BODY, K, 0.0, play))._replace(tolerance=1e-12)
    done = run(m, 0.3, inf, "free")
    state = done.state
    gear = state[at.SPEED] - SPEED  # of the frame that turns with the drive, whose flanks do no work there
    body = gear + state[at.TWIST_RATE]
    stretch = max(abs(state[at.TWIST]) - 0.5 * play, 0.0)
    energy = 0.5 * J * gear**2 + 0.5 * BODY * body**2 + 0.5 * K * stretch**2
    turned = state[at.ANGLE] - 0.5 * B / R
    fallen = DRAG * (turned - SPEED * 0.3)
    lost = 0.5 * J / R**2 * np.sum(done.impacts[:, 2] ** 2 - done.impacts[:, 3] ** 2)
    assert done.counters["impacts"] > 3
    assert energy + fallen == pytest.approx(-lost, rel=1e-6)


def test_within_its_play_the_gear_turns_alone():
    done = run(packed(torque_carried(BODY, K, 0.0, 0.02)), 0.02, 1e-4, "free")
    t, s = done.samples[:, 0], done.samples[:, 5]
    assert np.abs(s - 0.5 * B + 0.5 * DRAG / J * R * t**2).max() < 1e-9 * B


def test_a_damped_body_comes_to_turn_with_the_gear():
    done = run(packed(torque_carried(BODY, K, 5.0)), 1.0, 0.1, "active")
    assert done.contacts.tolist() == [[0, 0, 1.0]]
    assert abs(done.state[at.TWIST_RATE]) < 1e-12
    assert abs(done.state[at.TWIST]) < 1e-12


def test_a_small_body_on_a_stiff_spring_changes_little():
    plain = run(packed(harmonics=[(2.0, 3.0, 0.0)]), 1.0).impacts
    first = plain[plain[:, 6] > 5e-5][:4]
    off = []
    for body in (1e-4, 1e-5):
        found = run(packed(torque_carried(body, 1e4, 0.3), harmonics=[(2.0, 3.0, 0.0)]), 1.0).impacts
        found = found[found[:, 6] > 5e-5][:4]
        off.append(np.abs(found[:, 0] - first[:, 0]).max())
    assert off[1] < 0.2 * off[0] < 1e-3


def test_two_bodies_are_refused():
    with pytest.raises(InputError, match="2 carried bodies"):
        packed(torque_carried(BODY, K), torque_carried(BODY, K))


@pytest.mark.parametrize("model", MODELS)
def test_the_fall_in_every_model(model):
    body = {"kind": "carried_inertia", "inertia": f"{BODY} kg m^2", "stiffness": f"{K} N m/rad"}
    scene = bench(body, start__state="free", run__duration="15 ms", motion__harmonics=[])
    rig = scene.rig()
    signals = simulate(scene, model).signals
    t, s = signals["time_s"], signals["displacement_m"]
    radius = rig.base_radius_loose
    expected = falls(t, inertia=rig.inertia, drag=rig.drag_torque) * radius / R
    assert np.abs(s - s[0] - expected).max() < 1e-4 * np.abs(expected).max()


@pytest.mark.parametrize("body", [1e-4, 1e-8, 1e-12])
def test_the_fall_with_a_small_body_in_the_engine(body):
    given = {"kind": "carried_inertia", "inertia": f"{body} kg m^2", "stiffness": f"{K} N m/rad"}
    scene = bench(given, start__state="free", run__duration="2 ms", motion__harmonics=[])
    rig = scene.rig()
    signals = simulate(scene, "bullet").signals
    t, s = signals["time_s"], signals["displacement_m"]
    expected = falls(t, inertia=rig.inertia, body=body, drag=rig.drag_torque) * rig.base_radius_loose / R
    assert np.abs(s - s[0] - expected).max() < 1e-13  # m, a hundredth of the error budget


def test_a_small_body_separates_the_flanks_by_less_than_a_nanometre_in_both_models():
    """Its spring's torque oscillates by more than drag still presses where contact ends."""
    scene = bench(
        {"kind": "carried_inertia", "inertia": "1e-5 kg m^2", "stiffness": "4000 N m/rad"}, run__duration="0.28 s"
    )
    one, other = (simulate(scene, model).impacts for model in MODELS)
    assert np.array_equal(one["flank"], other["flank"])
    assert (other["flight_height_m"] < 1e-9).sum() >= 2
    assert np.abs(one["time_s"] - other["time_s"]).max() < 1e-8


def test_a_body_that_oscillates_too_fast_for_the_engine_is_refused():
    body = {"kind": "carried_inertia", "inertia": "1e-12 kg m^2", "stiffness": "1e6 N m/rad"}
    with pytest.raises(InputError, match=r"effect.*steps of .*inertia"):
        simulate(bench(body), "bullet")


def test_engine_and_rigid_model_agree_over_impacts_and_contact():
    body = {
        "kind": "carried_inertia",
        "inertia": "0.03 kg m^2",
        "stiffness": "400 N m/rad",
        "damping": "0.05 N m s/rad",
    }
    for play in ("0 rad", "20 urad"):
        scene = bench({**body, "play": play}, run__duration="0.35 s")
        one, other = (simulate(scene, model) for model in MODELS)
        count = min(len(one.impacts["time_s"]), len(other.impacts["time_s"]), 3)
        assert count == 3
        assert np.array_equal(one.impacts["flank"][:count], other.impacts["flank"][:count])
        off = one.impacts["time_s"][:count] - other.impacts["time_s"][:count]
        assert np.abs(off).max() < 2e-6
        speed = np.abs(one.impacts["velocity_m_s"][:count]).max()
        assert np.abs(one.impacts["velocity_m_s"][:count] - other.impacts["velocity_m_s"][:count]).max() < 1e-3 * speed
