"""Axes that are not parallel: teeth lean on an end of the face, by the closed-form amount, and hit there."""

from math import acos, atan2, cos, hypot, tan

import numpy as np
import pytest

from gears3d.comparison import compare
from gears3d.engine import Bench, simulate
from gears3d.engine.lines import line_gap
from gears3d.engine.mesh import meshed, side_gap
from gears3d.gears import compile_surfaces, mates, quasi_static
from gears3d.lumped import rigid
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
WIDTH = 30e-3
ACROSS = {"out_of_plane": "0.5 mrad"}
WITHIN = {"in_plane": "1 mrad"}


def rig(lean=None, **changes):
    given = {"gears.face_width": "30 mm", "run.duration": "0.5 s", "run.settle": "0 s"}
    given |= {} if lean is None else {"mount.misalignment": lean}
    return load(FIG5, {**given, **changes})


def band(pair, within, across, z):
    """Where the flanks of one transverse section touch, active and reverse [m]: involutes about displaced axes."""
    total, working = pair.drive.base_radius + pair.loose.base_radius, pair.working_pressure_angle
    x, y = pair.centre_distance + tan(within) * z, tan(across) * z
    angle = acos(total / hypot(x, y))
    wider = total * ((tan(angle) - angle) - (tan(working) - working))
    aside = -total * atan2(y, x)
    return aside - wider, aside + wider + pair.backlash


@pytest.mark.parametrize(("within", "across"), [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 5e-4), (0.0, -5e-4), (6e-4, 4e-4)])
def test_teeth_lean_on_the_end_of_the_face_that_touches_first(within, across):
    lean = {"in_plane": f"{within} rad", "out_of_plane": f"{across} rad"}
    scenario = rig(lean, **{"motion.harmonics": []})
    pair = scenario.pair()
    ends = np.array([band(pair, within, across, z) for z in (-WIDTH / 2, WIDTH / 2)])
    touching = (ends[:, 0].max(), ends[:, 1].min())
    times = np.linspace(0.01, 0.4, 9)
    shape = meshed(pair)
    with Bench(scenario) as bench:
        drive = np.array([bench.drive(time)[0] for time in times])
        for side in (0, 1):
            loose = bench.rest(side, times)
            place = pair.loose.base_radius * loose - pair.drive.base_radius * drive
            assert place == pytest.approx(touching[side], abs=1e-11)
            where = np.sign(np.diff(ends[:, side])[0]) * (1.0 if side == 0 else -1.0) * WIDTH / 2
            surfaces = compile_surfaces(pair)
            both = np.array([(*teeth, side) for teeth in mates(surfaces, drive[0], loose[0], side)])
            row = side_gap(shape, both, side, drive[0], loose[0])[3]
            found = line_gap(shape.along, drive[0], loose[0], *both[row, :2], side)
            assert found[3] == where
    # to first order: half the width times the angle times the sine, or the cosine, of the working pressure angle
    working = pair.working_pressure_angle
    linear = WIDTH / 2 * np.array([within * np.sin(working), across * cos(working)])
    assert touching[0] == pytest.approx(np.abs(linear).sum(), abs=0.02e-6 + abs(linear).sum() * 1e-3)


@pytest.mark.parametrize("lean", [ACROSS, WITHIN], ids=["across", "within"])
def test_impacts_are_those_of_the_twin_and_lie_at_the_ends(lean):
    scenario = rig(lean)
    made = simulate(scenario)
    found = compare(made, rigid.simulate(scenario), mode="trajectory").to_dict()
    assert found["impacts_compared"] > 5
    assert found["impacts_missed"] == found["impacts_invented"] == 0
    assert found["velocity_error_p95"] < 1e-6
    hits = made.impacts
    assert np.abs(hits["height_m"]) == pytest.approx(WIDTH / 2, abs=1e-12)
    ends = [set(np.sign(hits["height_m"][hits["flank"] == side])) for side in (0, 1)]
    assert all(len(end) == 1 for end in ends)
    assert (ends[0] == ends[1]) == (lean is WITHIN)  # across, the flanks of one tooth lean on opposite ends
    aligned = simulate(rig()).impacts
    assert "height_m" not in aligned
    narrower = scenario.pair().backlash - np.ptp(made.signals["displacement_m"])
    bands = [band(scenario.pair(), 1e-3 * (lean is WITHIN), 5e-4 * (lean is ACROSS), z) for z in (-15e-3, 15e-3)]
    assert narrower == pytest.approx(250e-6 - min(b for _, b in bands) + max(a for a, _ in bands), abs=1e-9)


def test_crowned_teeth_touch_where_crowning_and_lean_balance():
    """The gap C (2z/b)^2 + β cos αw z is least at z = -β cos αw b²/(8 C)."""
    across, crowning = 2e-4, 8e-6
    scenario = rig({"out_of_plane": f"{across} rad"}, **{"gears.lead_crowning": f"{crowning} m"})
    hits = simulate(scenario).impacts
    place = across * cos(scenario.pair().working_pressure_angle) * WIDTH**2 / (8.0 * 2.0 * crowning)
    assert len(hits["time_s"]) > 5
    assert np.abs(hits["height_m"]) == pytest.approx(place, rel=1e-3)
    assert np.ptp(np.sign(hits["height_m"]) * (2 * hits["flank"] - 1)) == 0


def test_a_helix_slope_has_the_same_end():
    """A lead error is a lean of one flank: slope over the face adds half of itself at an end."""
    scenario = rig(**{"gears.drive.helix_slope": "10 um", "motion.harmonics": []})
    pair = scenario.pair()
    times = np.linspace(0.01, 0.3, 5)
    with Bench(scenario) as bench:
        drive = np.array([bench.drive(time)[0] for time in times])
        place = pair.loose.base_radius * bench.rest(0, times) - pair.drive.base_radius * drive
    assert place == pytest.approx(5e-6, abs=1e-10)


def test_a_wobbling_gear_is_that_of_its_surfaces_rolled():
    scenario = rig(**{"gears.loose.wobble": {"angle": "0.5 mrad", "phase": "0.4 rad"}, "motion.harmonics": []})
    pair = scenario.pair()
    times = np.linspace(0.0, 2.0, 21)
    with Bench(scenario) as bench:
        drive = np.array([bench.drive(time)[0] for time in times])
        exact = quasi_static(pair, drive)
        for side, touching in ((0, exact.phi_active), (1, pair.backlash + exact.phi_reverse)):
            place = pair.loose.base_radius * bench.rest(side, times) - pair.drive.base_radius * drive
            assert place == pytest.approx(touching, abs=1e-10)
            assert np.ptp(place) > 2e-6


def test_helical_teeth_on_leaning_axes():
    scenario = rig({"out_of_plane": "0.3 mrad"}, **{"gears.helix_angle": "25 deg", "run.duration": "0.25 s"})
    made = simulate(scenario)
    found = compare(made, rigid.simulate(scenario), mode="trajectory").to_dict()
    assert found["impacts_compared"] > 2
    assert found["impacts_missed"] == found["impacts_invented"] == 0
    assert found["velocity_error_p95"] < 5e-3
    assert np.abs(made.impacts["height_m"]).max() <= WIDTH / 2
