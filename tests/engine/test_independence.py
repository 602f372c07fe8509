"""The engine finds what nobody told it, and refuses to go on where its two measures of a gap part."""

import numpy as np
import pytest
from scipy.optimize import brentq

from gears3d.engine import run, simulate
from gears3d.errors import EngineError
from gears3d.gears import HarmonicDeviation, ToothDeviation
from gears3d.lumped import rigid
from gears3d.scenario import load
from tests.engine.poison import poison

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
THICK = 20e-6


def fig5(*changes):
    return load(FIG5, ["run.duration=0.7 s", *changes])


def closed_form(scenario, gap):
    """Impact on the active flank after leaving the reverse one, e = 0; Rigaud & Perret-Liaudet 2020, eqs (18), (19)."""
    radius = scenario.pair().loose.base_radius
    force = scenario.drag.torque / scenario.gears.loose.inertia * radius
    harmonic = scenario.motion.harmonics[0]
    speed, omega = harmonic.amplitude * radius, 2.0 * np.pi * harmonic.frequency
    lost = 2.0 * np.pi - np.arccos(-force / (speed * omega))

    def place(angle):  # of the loose gear above the active flank
        flight = (angle - lost) / omega
        own = speed * np.sin(lost) * flight - 0.5 * force * flight**2
        return gap + own + speed / omega * (np.cos(angle) - np.cos(lost))

    hit = brentq(place, lost + 1e-3, lost + 1.5, xtol=1e-15)
    flight = (hit - lost) / omega
    return hit / omega, speed * np.sin(lost) - force * flight - speed * np.sin(hit)


def test_a_thick_tooth_shows_by_the_closed_form_amount():
    scenario = fig5("impact.restitution=0.0")
    perfect = simulate(scenario).impacts
    drive, loose = (int(perfect[f"tooth_{which}"][1]) for which in ("drive", "loose"))
    for told in (ToothDeviation("drive", "active", drive, THICK), ToothDeviation("loose", "active", loose, THICK)):
        hits = simulate(scenario, pair=scenario.pair().with_deviations(told)).impacts
        when, speed = closed_form(scenario, scenario.pair().backlash - THICK)
        assert hits["time_s"][1] == pytest.approx(when, abs=1e-9)
        assert hits["velocity_m_s"][1] == pytest.approx(speed, rel=1e-7)
        assert hits["tooth_" + told.gear][1] == told.tooth
        assert perfect["time_s"][1] - hits["time_s"][1] > 5e-4
        assert hits["time_s"][0] == pytest.approx(perfect["time_s"][0], abs=1e-12)  # another tooth
    when, speed = closed_form(scenario, scenario.pair().backlash)
    assert rigid.simulate(scenario).impacts["time_s"][1] == pytest.approx(when, abs=1e-9)  # nobody told the twin
    assert perfect["velocity_m_s"][1] == pytest.approx(speed, rel=1e-7)


def test_a_thick_tooth_meets_with_its_mates_edge_before_the_path_of_contact():
    """In contact the mate's tip runs up the thick tooth: an impact, no jump of the loose gear's place."""
    scenario = fig5("motion.harmonics=[]", "run.settle=0 s", "impact.restitution=0.0", "drag.torque=5 N m")
    pair = scenario.pair().with_deviations(ToothDeviation("drive", "active", 8, THICK))
    record = simulate(scenario, pair=pair)
    hits, place = record.impacts, record.signals["displacement_m"]
    assert len(simulate(scenario).impacts["time_s"]) == 0
    assert hits["tooth_drive"][0] == 8
    before_pitch_point = 7 - record.impacts["time_s"][0] * scenario.motion.mean / (2 * np.pi) * 90
    assert before_pitch_point > 0.5 * pair.contact_ratio
    assert place.max() == pytest.approx(THICK, rel=1e-6)
    assert np.abs(np.diff(place)).max() < 1e-6


def test_raw_gap_outside_the_hull_budget_stops_the_run(monkeypatch):
    """Flanks moved by 4 µm behind the hulls' back."""
    scenario = fig5()
    honest = run.pieces
    monkeypatch.setattr(run, "pieces", lambda pair, which, **how: honest(scenario.pair(), which, **how))
    moved = scenario.pair().with_deviations(HarmonicDeviation("loose", "reverse", 0, 4e-6))
    with pytest.raises(EngineError, match=r"reverse flanks, drive tooth \d+ against loose tooth \d+: Bullet measures"):
        simulate(scenario, pair=moved)
    simulate(scenario, pair=scenario.pair())


def test_a_single_tooth_moved_behind_the_hulls_back_is_named(monkeypatch):
    scenario = fig5()
    honest = run.pieces
    monkeypatch.setattr(run, "pieces", lambda pair, which, **how: honest(scenario.pair(), which, **how))
    moved = scenario.pair().with_deviations(ToothDeviation("loose", "active", 11, 5e-6))
    with pytest.raises(EngineError, match="against loose tooth 11"):
        simulate(scenario, pair=moved)


def test_jammed_gears_are_refused(monkeypatch):
    monkeypatch.setattr("gears3d.gears.pair.check_deviations", lambda pair: None)
    scenario = fig5()
    swollen = [HarmonicDeviation("loose", flank, 0, 130e-6) for flank in ("active", "reverse")]
    with pytest.raises(EngineError, match=r"jammed at the start.*overlap by 10 µm.*backlash"):
        simulate(scenario, pair=scenario.pair().with_deviations(*swollen))


def test_gears_that_jam_later_are_refused(monkeypatch):
    monkeypatch.setattr("gears3d.gears.pair.check_deviations", lambda pair: None)
    scenario = fig5()
    swollen = [ToothDeviation("loose", flank, 4, 300e-6) for flank in ("active", "reverse")]
    with pytest.raises(EngineError, match=r"jam at t = 0\.0.*more backlash"):
        simulate(scenario, pair=scenario.pair().with_deviations(*swollen))


def test_a_state_that_is_no_number_is_refused(monkeypatch):
    poison(monkeypatch, 0.0)
    for start in ("free", "active"):
        with pytest.raises(EngineError, match="not a number"):
            simulate(fig5(f"start.state={start}"))
