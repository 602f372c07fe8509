"""What the report makes of signals: corners, thinning, flanks, flights; and the drawing of the mesh."""

import numpy as np
import pytest

from gears3d import palette
from gears3d.effects import Flank, Gear, flank_harmonic, flank_tooth
from gears3d.gears import Gear as GearShape
from gears3d.gears import Pair
from gears3d.recording import Recording
from gears3d.views.pages.charts import TICK, contacts, cornered, crossings, knots, traces, walls
from gears3d.views.pages.run import mesh
from gears3d.views.plots.section import widening

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


@pytest.mark.parametrize(("backlash", "factor"), [(250e-6, 8), (25e-6, 80), (2e-3, 1)])
def test_the_exaggeration_is_a_round_number_and_stated(backlash, factor):
    drawn = mesh(pair(backlash))
    assert widening(pair(backlash)) == factor
    assert f"drawn {factor} times as wide" in drawn.words
    assert f"{factor} times as wide" in drawn.caption
    assert ("gap drawn" in drawn.data) == (factor > 1)


def test_at_true_scale_active_flanks_touch_and_in_the_middle_of_the_gap_none_does():
    first, second = mesh(pair()).data.split("</clipPath>")[1:]
    assert first.count("<circle") == 1  # one pair of teeth touches, at the pitch point
    assert palette.ACTIVE in first
    assert "<circle" not in second
    assert "gaps 125 + 125" in second


def test_helical_gears_are_drawn_too():
    assert mesh(pair(helix_angle=0.3)).data.count(f'fill="{palette.LOOSE}"') == 2
