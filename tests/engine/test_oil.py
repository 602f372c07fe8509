"""Oil in the engine: against closed forms, and against the twin, whose code shares nothing with the engine's."""

from math import sqrt

import numpy as np
import pytest

from gears3d import engine, simulate
from gears3d.effects import Code
from gears3d.errors import EngineError, InputError
from gears3d.scenario import load

SPUR = "scenarios/rigaud-2020/fig5-20rpm.toml"
HELICAL = "scenarios/dct-helical-lubricated/fig13.toml"


def oil(viscosity, **more):
    return {"kind": "oil_film", "viscosity": f"{viscosity} Pa s", **more}


def bench(file, *effects, **changes):
    return load(
        file, {"run.settle": "0 s", "effect": list(effects), **{k.replace("__", "."): v for k, v in changes.items()}}
    )


def both(scenario):
    return simulate(scenario), simulate(scenario, model="rigid")


def apart(solids, twin, name):
    return float(np.abs(solids.impacts[name] - twin.impacts[name]).max())


@pytest.mark.parametrize("viscosity", [pytest.param(0.0005, marks=pytest.mark.slow), 0.05])
def test_spur_gears_under_oil_move_as_the_twin_says(viscosity):
    solids, twin = both(bench(SPUR, oil(viscosity), impact__restitution=0.6, run__duration="0.3 s"))
    off = solids.signals["displacement_m"] - twin.signals["displacement_m"]
    assert np.abs(off).max() < 1e-9
    assert len(solids.impacts["time_s"]) == len(twin.impacts["time_s"]) >= 2
    assert np.array_equal(solids.impacts["flank"], twin.impacts["flank"])
    assert apart(solids, twin, "time_s") < 1e-7
    for name in ("velocity_m_s", "rebound_m_s"):
        assert apart(solids, twin, name) < 1e-6
    assert apart(solids, twin, "impulse_N_s") < 1e-6
    assert apart(solids, twin, "flight_height_m") < 1e-9
    theirs, ours = np.array(twin.meta["contacts"]), np.array(solids.meta["contacts"])
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs).max() < 1e-6


def test_helical_gears_under_oil_move_as_the_twin_says():
    scenario = load(HELICAL, {"run.settle": "0 s", "run.duration": "30 ms"})
    solids, twin = both(scenario)
    assert np.abs(solids.signals["displacement_m"] - twin.signals["displacement_m"]).max() < 1e-9
    assert len(solids.impacts["time_s"]) == len(twin.impacts["time_s"]) == 2
    assert apart(solids, twin, "velocity_m_s") < 1e-7
    axial, along = solids.impacts["axial_impulse_N_s"], solids.impacts["impulse_N_s"]
    assert np.allclose(np.abs(axial / along), np.tan(scenario.rig().base_helix_angle), rtol=1e-6)


def test_oil_over_teeth_that_yield_and_have_errors_moves_as_the_twin_says():
    spring = {"kind": "tooth_compliance", "stiffness": "1e6 N/m", "damping": "30 N s/m"}
    wave = {"kind": "transmission_error", "order": 3, "amplitude": "20 um", "phase": "20 deg"}
    solids, twin = both(bench(SPUR, oil(0.002), spring, wave, run__duration="0.2 s"))
    assert np.abs(solids.signals["displacement_m"] - twin.signals["displacement_m"]).max() < 1e-9
    assert len(solids.impacts["time_s"]) == len(twin.impacts["time_s"]) >= 2
    assert apart(solids, twin, "rebound_m_s") < 1e-6


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_squeezed_film_takes_a_speed_off_every_approach_that_only_heights_tell(restitution):
    """v(t) = a·t − 2·Cs/m·(1/√h(t) − 1/√h(0)), from m·v' = F − Cs·v/h^1.5 and h' = −v."""
    film = oil(0.001, wedge=0.0, felt_height="4 um")
    scenario = bench(
        SPUR, film, impact__restitution=restitution, motion__harmonics=[], start__state="free", run__duration="0.1 s"
    )
    rig = scenario.rig()
    _, squeeze, _, _, minimum, felt = next(row.p for row in scenario.rows() if row.code == Code.GAP_FILM)
    mass = rig.inertia / rig.base_radius_loose**2
    falls = rig.drag_torque / rig.base_radius_loose / mass
    hit = {name: values[0] for name, values in simulate(scenario).impacts.items()}
    assert hit["flank"] == 0

    def taken(high, low):
        return 2.0 * squeeze / mass * (1.0 / sqrt(low) - 1.0 / sqrt(high))

    enters = falls * hit["time_s"] - taken(0.5 * rig.backlash, felt)
    assert -hit["velocity_m_s"] == pytest.approx(enters, rel=1e-8)
    within = 2.0 * falls * (felt - minimum)  # over so small a height drag is a small part
    arrives = sqrt(enters**2 + within) - taken(felt, minimum)
    leaves = sqrt(max((restitution * arrives) ** 2 - within, 0.0))
    assert hit["rebound_m_s"] == pytest.approx(leaves, rel=5e-3, abs=1e-12)
    if leaves > 0.0:
        drags = falls * (felt - minimum) * (1.0 / enters + 1.0 / leaves)  # during the passage
        assert hit["impulse_N_s"] == pytest.approx(mass * (leaves + enters + drags), rel=0.01)


YIELDS = {"kind": "tooth_compliance", "stiffness": "1e6 N/m", "damping": "30 N s/m"}


@pytest.mark.parametrize("more", [(), pytest.param((YIELDS,), marks=pytest.mark.slow)])
def test_the_error_estimate_sees_steps_in_oil_and_they_are_small(more):
    scenario = bench(SPUR, oil(0.005), *more, run__duration="0.2 s")
    usual, twin = simulate(scenario), simulate(scenario, model="rigid")
    told = engine.simulate(scenario, error_estimate=True).meta["error_estimate"]
    off = np.abs(usual.signals["displacement_m"] - twin.signals["displacement_m"]).max()
    assert told["impacts"] >= 1
    assert 0.0 < told["displacement_m"] < 1e-9
    assert 0.2 * off < told["displacement_m"] < 5.0 * off
    coarse, fine, exact = (
        engine.simulate(scenario, step=share * usual.meta["longest_step_s"]).signals["displacement_m"]
        for share in (1.0, 0.25, 0.1)
    )
    assert coarse.tolist() == usual.signals["displacement_m"].tolist()
    assert np.abs(coarse - exact).max() > 30.0 * np.abs(fine - exact).max()  # of fourth order it is 256, until rounding


def test_oil_that_fills_the_backlash_and_two_films_are_refused():
    with pytest.raises(InputError, match=r"uses up the backlash.*minimum_thickness"):
        simulate(bench(SPUR, oil(0.01, minimum_thickness="80 um"), mount__backlash="150 um"))
    with pytest.raises(InputError, match="2 oil films"):
        simulate(bench(SPUR, oil(0.01), oil(0.02)))
    with pytest.raises(InputError, match="Bullet's own contact"):
        simulate(bench(SPUR, oil(0.01)), contact="native")


def test_flanks_that_leave_no_room_for_the_oil_are_refused_at_the_door_and_jam_if_they_came_in(monkeypatch):
    wide = {"kind": "backlash_variation", "order": 1, "amplitude": "246 um"}
    with pytest.raises(InputError, match=r"uses up the backlash.*-6 um.*minimum_thickness"):
        bench(SPUR, wide, oil(0.01, minimum_thickness="5 um"))
    monkeypatch.setattr("gears3d.scenario.checks.check_effects", lambda *_: None)
    with pytest.raises(EngineError, match="jam"):
        simulate(bench(SPUR, wide, oil(0.01, minimum_thickness="5 um"), run__duration="2 s"))
