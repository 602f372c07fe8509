"""What the report makes of signals: corners, thinning, flanks, flights; and the drawing of the mesh."""

import re

import numpy as np
import pytest

from gears3d.effects import Flank, Gear, flank_harmonic, flank_tooth
from gears3d.gears import Gear as GearShape
from gears3d.gears import Pair
from gears3d.recording import Recording
from gears3d.views.report.drawing import exaggeration, mesh_drawing, tooth
from gears3d.views.report.flanks import contacts, crossings, walls
from gears3d.views.report.traces import TICK, cornered, knots, traces

RADIUS, GAP = 0.148, 250e-6


def one_impact(at=0.50002, before=0.04, after=-0.02, rate=20_000):
    """A gear that flies straight to the reverse flank, strikes it between two samples, and flies back."""
    time = np.arange(rate + 1) / rate
    late = time > at
    s = GAP + np.where(late, after, before) * (time - at)
    v = np.where(late, after, before)
    theta = 3.0 * time
    signals = {"time_s": time, "theta_drive_rad": theta, "theta_loose_rad": theta + s / RADIUS}
    speeds = {"omega_drive_rad_s": 3.0 + 0 * time, "omega_loose_rad_s": 3.0 + v / RADIUS}
    impacts = {"time_s": [at], "flank": [1], "velocity_m_s": [before], "rebound_m_s": [after]}
    return Recording({**signals, **speeds, "displacement_m": s, "velocity_m_s": v}, impacts)


def test_the_corner_of_an_impact_is_restored():
    columns = cornered(one_impact())
    left, right = np.flatnonzero(columns["keep"])
    assert (columns["tick"][[left, right]] == [round(0.50002 / TICK) - 1, round(0.50002 / TICK) + 1]).all()
    assert columns["displacement_m"][left] == pytest.approx(GAP, abs=1e-12)
    assert columns["velocity_m_s"][[left, right]].tolist() == pytest.approx([0.04, -0.02], rel=1e-9)
    jump = columns["omega_loose_rad_s"][right] - columns["omega_loose_rad_s"][left]
    assert jump == pytest.approx(-0.06 / RADIUS, rel=1e-9)


def test_straight_flights_need_few_points():
    block = traces(one_impact())
    assert len(block["time"]) < 1600
    s = np.cumsum(block["run"]["displacement_m"]["steps"]) * 1e-9
    assert s.max() == pytest.approx(GAP, abs=1e-9)


def test_noise_cannot_make_the_page_large():
    rng = np.random.default_rng(1)
    clean = one_impact()
    signals = {**clean.signals, "displacement_m": clean.signals["displacement_m"] + rng.normal(0, 1e-4, 20_001)}
    noisy = Recording(signals, clean.impacts)
    assert len(traces(noisy)["time"]) > 10_000
    assert len(traces(noisy, most=4000)["time"]) <= 4000


def test_knots_bound_the_distance():
    rng = np.random.default_rng(2)
    x = np.cumsum(rng.uniform(0.5, 1.5, 5000))
    y = np.stack([np.sin(x / 90), np.cumsum(rng.normal(0, 0.003, 5000))])
    at = knots(x, y, np.array([0, 4999]), 0.02)
    for channel in y:
        assert np.abs(np.interp(x, x[at], channel[at]) - channel).max() <= 0.02
    assert 20 < len(at) < 2500


def test_walls_follow_the_deviations_of_their_own_gear():
    recording = one_impact()
    rows = (
        flank_harmonic(Gear.DRIVE, Flank.ACTIVE, 2, 5e-6, 0.3),
        flank_harmonic(Gear.LOOSE, Flank.REVERSE, 1, -4e-6, 0.1),
    )
    ends = walls(recording, rows, GAP, recording.time)
    drive, loose = recording.signals["theta_drive_rad"], recording.signals["theta_loose_rad"]
    np.testing.assert_allclose(ends.active, 5e-6 * np.cos(2 * drive + 0.3), atol=1e-15)
    np.testing.assert_allclose(ends.reverse, GAP + 4e-6 * np.cos(loose + 0.1), atol=1e-15)
    assert ends.moving
    assert ends.complete
    assert not walls(recording, (flank_tooth(Gear.LOOSE, Flank.ACTIVE, 3, 2e-5),), GAP, recording.time).complete


def test_a_crossing_is_timed_from_flank_to_flank():
    time = np.arange(0, 2.0001, 1e-3)
    s = np.interp(time, [0, 0.5, 0.75, 1.0, 1.125, 2.0], [0, 0, GAP, GAP, 0, 0])
    impacts = {"time_s": [0.1, 0.75, 1.125], "flank": [0, 1, 0], "velocity_m_s": [-1.0, 0.5, -2.0]}
    recording = Recording(
        {"time_s": time, "theta_drive_rad": time, "theta_loose_rad": time, "displacement_m": s}, impacts
    )
    state = contacts(recording, (), GAP)
    found = crossings(recording, state, 0.0)
    assert found["reverse"][0].tolist() == pytest.approx([0.25, 0.5], abs=1e-9)
    assert found["active"][0].tolist() == pytest.approx([0.125, 2.0], abs=1e-9)
    assert crossings(recording, state, 1.0)["reverse"].size == 0


def pair(backlash=GAP, **changes):
    gear = GearShape(module=3.5e-3, teeth=90, face_width=7.5e-3, **changes)
    return Pair.from_backlash(gear, gear, backlash)


def test_the_drawn_tooth_has_the_gear_s_own_radii_and_thickness():
    gear, half = pair().drive, pair().half_angle("drive")
    outline = tooth(gear, half)
    assert outline[0].tolist() == pytest.approx([gear.root_radius, np.pi / 90])
    assert outline[-1, 0] == pytest.approx(gear.tip_radius)
    at_reference = np.interp(gear.reference_radius, outline[:, 0], outline[:, 1])
    assert 2 * at_reference * gear.reference_radius == pytest.approx(np.pi * 3.5e-3 / 2, rel=1e-3)


def segments(svg, name):
    return [
        np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", d), float)
        for d in re.findall(f'class="{name}" d="M([^"]*)"', svg)
    ]


def distance(point, curve):
    """From a point to a polyline."""
    a, ab = curve[:-1], np.diff(curve, axis=0)
    share = np.clip(((point - a) * ab).sum(axis=1) / np.maximum((ab**2).sum(axis=1), 1e-12), 0, 1)
    return np.linalg.norm(a + share[:, None] * ab - point, axis=1).min()


def test_at_true_scale_active_flanks_touch_at_the_pitch_point_and_reverse_flanks_stand_apart():
    svg = str(mesh_drawing(pair(2e-3)))
    panel = svg[: svg.index("true scale, active")]
    point = np.array([150.0, 190.0])
    assert sorted(distance(point, c) for c in segments(panel, "edge-active"))[1] < 0.2
    assert min(distance(point, c) for c in segments(panel, "edge-reverse")) > 20.0


@pytest.mark.parametrize(("backlash", "factor"), [(250e-6, 10), (25e-6, 100), (2e-3, 1)])
def test_the_exaggeration_is_a_round_number_and_stated(backlash, factor):
    assert exaggeration(pair(backlash)) == factor
    assert f"× {factor}," in mesh_drawing(pair(backlash))


def test_helical_gears_are_drawn_too():
    assert mesh_drawing(pair(helix_angle=0.3)).count("gear-loose") == 2
