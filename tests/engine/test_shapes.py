"""Flanks that the twin rolls beforehand and the engine touches tooth by tooth; `quasi_static` is the referee."""

from functools import cache

import numpy as np
import pytest

from gears3d.comparison import compare
from gears3d.engine import simulate
from gears3d.gears import quasi_static
from gears3d.lumped import rigid
from gears3d.scenario import flank_deviations
from gears3d.verification.validation import SHAPES, along_action, fig5

PLASTIC = ("tooth 14 of the drive +20 um, active flank", "profile slope of the drive 10 um", "drive 40 um eccentric")
"""Shapes that are asked without any rebound, too: a tooth, all teeth, and none."""
THICK = [{"kind": "pitch_error", "gear": "loose", "tooth": tooth, "offset": "20 um"} for tooth in (3, 88)]
RESTED = {name: shape for name, shape in SHAPES.items() if not name.startswith(("tooth", "profile slope of the loose"))}
RESTED |= {"teeth 3 and 88 of the loose gear, both flanks": {"effect": THICK}}
"""Shapes that are in mesh on the way: seven pitches from the first tooth to either side."""


@cache
def recordings(name, restitution):
    changes = {"run.duration": "1 s"}
    scenario = fig5(impact__restitution=restitution).with_({**changes, **SHAPES.get(name, {})})
    return scenario, simulate(scenario), rigid.simulate(scenario)


@pytest.mark.parametrize(
    ("name", "restitution"),
    [(name, 0.5) for name in SHAPES]
    + [pytest.param(name, 0.0, marks=() if name in PLASTIC else pytest.mark.slow) for name in SHAPES],
)
def test_impacts_are_the_twins(name, restitution):
    scenario, engine, twin = recordings(name, restitution)
    found = compare(along_action(engine, scenario), twin, flight_height_min=0.05e-6).to_dict()
    assert found["impacts_missed"] + found["impacts_invented"] == 0
    assert found["impacts_compared"] >= 6
    assert found["regime_equal"]
    assert found["velocity_error_median"] < 0.002
    assert found["velocity_error_p95"] < 0.006
    assert abs(found["velocity_bias"]) < 0.001
    assert found["phase_error_median_cycles"] < 1e-4
    # where flanks part at zero curvature the time is known to 1e-6 s, at relative speeds of 30 mm/s and less
    assert np.abs(engine.signals["displacement_m"] - twin.signals["displacement_m"]).max() < 3e-8
    plain = recordings("", restitution)[2].signals["displacement_m"]
    assert np.abs(twin.signals["displacement_m"] - plain).max() > 1e-6, "the shape is not felt"


def test_no_loss_of_contact_at_a_relief_is_stepped_over():
    """At e = 0.3 reliefs throw the loose gear off for a millisecond now and then."""
    _, engine, twin = recordings("tip relief of 20 um over 7 mm", 0.3)
    assert len(engine.impacts["time_s"]) == len(twin.impacts["time_s"]) > 160


@pytest.mark.parametrize("flank", [0, 1])
@pytest.mark.parametrize("name", RESTED)
def test_a_pressed_gear_rests_where_the_surfaces_touch(name, flank):
    """Dry drag presses onto the reverse flank when the drive turns back; a slow turn, so that no corner throws off."""
    mean = ("1 rpm", "-1 rpm")[flank]
    start = ("active", "reverse")[flank]
    scenario = fig5(motion__harmonics=[], motion__mean=mean, drag__torque="50 N m", start__state=start)
    changes = {"run.duration": "5 s", "run.output_rate": "100 Hz"}
    scenario = scenario.with_({**changes, **RESTED[name]})
    pair = scenario.pair().with_deviations(*flank_deviations(scenario.rows()))
    for model in (simulate, rigid.simulate):
        signals = model(scenario).signals
        true = quasi_static(pair, signals["theta_drive_rad"])
        off = signals["displacement_m"] - (true.phi_reverse + pair.backlash if flank else true.phi_active)
        assert np.median(np.abs(off)) < 1e-12
        assert np.abs(off).max() < 1e-9


def one_sided(pair, theta, flank):
    """Return the slopes of the displacement by the drive's angle before and behind a corner [m/rad]."""
    for sign in (-1, 1):
        x = sign * np.linspace(2e-7, 3e-5, 40)
        rolled = quasi_static(pair, theta + x)
        values = rolled.phi_reverse if flank else rolled.phi_active
        yield np.polynomial.Polynomial.fit(x, values, 4).deriv()(0.0)


def test_speeds_at_corners_of_the_flanks_are_those_of_the_surfaces():
    """Handed from tooth to tooth, a gear in contact is hit with the change of slope times the drive's speed."""
    scenario, engine, twin = recordings("profile slope of the drive 10 um", 0.0)
    for recording, bound in ((engine, 1e-7), (twin, 3e-5)):
        hit = recording.impacts
        corners = np.flatnonzero((hit["flight_height_m"] == 0.0) & (np.abs(hit["velocity_m_s"]) > 1e-4))[:6]
        assert len(corners) == 6
        for k in corners:
            time = hit["time_s"][k]
            speed = np.pi + 2 * np.pi / 3 * np.sin(6 * np.pi * time)
            theta = np.pi * time + (1 - np.cos(6 * np.pi * time)) / 9
            before, behind = one_sided(scenario.pair(), theta, hit["flank"][k])
            assert hit["velocity_m_s"][k] == pytest.approx((before - behind) * speed, rel=bound)


def test_the_engines_speeds_are_those_along_the_common_normal():
    """It leans by the slope of the loose gear's relief, 20 um over 7 mm of roll; the drive's changes no lever."""
    scenario, engine, _ = recordings("tip relief of 20 um over 7 mm", 0.5)
    straight = along_action(engine, scenario)
    lean = engine.impacts["velocity_m_s"] / straight.impacts["velocity_m_s"] - 1.0
    assert np.isclose(np.abs(lean), 20e-6 / 7e-3, rtol=0.01).sum() > 20
    assert straight.impacts["rebound_m_s"] == pytest.approx(-0.5 * straight.impacts["velocity_m_s"], abs=1e-4)
