"""A run that cannot go on says when, why and what to do, and keeps everything up to that instant."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from gears3d.engine import simulate
from gears3d.engine.nearby import WINDOWS, Nearby
from gears3d.errors import EngineError
from gears3d.gears import Eccentricity, ToothDeviation
from gears3d.scenario import load
from tests.engine.poison import poison

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
OFFSET = 400e-6


def fig5(**changes):
    return load(FIG5, {"run.duration": "0.5 s", "run.settle": "0 s", **changes})


def stopped(scenario, match, **how):
    """Run into the fault; return what was kept."""
    with pytest.raises(EngineError, match=match) as caught:
        simulate(scenario, **how)
    kept = caught.value.partial
    assert kept.meta["interrupted"]
    assert kept.meta["stopped_by"] == str(caught.value)
    assert f"t = {kept.meta['reached_s']:.6g} s" in str(caught.value)
    sample = 1.0 / scenario.run.output_rate
    assert kept.meta["reached_s"] - sample <= kept.time[-1] <= kept.meta["reached_s"]
    return kept


def same_until_then(kept, whole):
    """Whether what was kept is, bit by bit, the beginning of a run without the fault."""
    count = len(kept.time)
    assert count > 100
    for name in ("time_s", "theta_drive_rad", "theta_loose_rad", "omega_loose_rad_s"):
        np.testing.assert_array_equal(kept.signals[name], whole.signals[name][:count])
    hits = len(kept.impacts["time_s"])
    np.testing.assert_array_equal(kept.impacts["velocity_m_s"], whole.impacts["velocity_m_s"][:hits])
    return hits


def binding(pair, phase, speed):
    """Time at which an eccentric drive gear has used the backlash up [s], closed form.

    In a transverse section both base circles stay, so the dead band grows by 2 (rb1 + rb2) (inv α - inv αw).
    """
    radii = pair.drive.base_radius + pair.loose.base_radius

    def involute(angle):
        return math.tan(angle) - angle

    def band(time):
        turn = speed * time + phase
        distance = math.hypot(pair.centre_distance - OFFSET * math.cos(turn), OFFSET * math.sin(turn))
        opened = involute(math.acos(radii / distance)) - involute(pair.working_pressure_angle)
        return pair.backlash + 2.0 * radii * opened

    closest = (2.0 * math.pi - phase) / speed
    return brentq(band, 0.0, closest)


@pytest.fixture
def unseen(monkeypatch):
    """Let mountings through that would be refused before anything runs."""
    monkeypatch.setattr("gears3d.gears.pair.check_mounting", lambda *_: None)
    monkeypatch.setattr("gears3d.gears.pair.check_deviations", lambda *_: None)


@pytest.mark.parametrize("spring", [False, True])
def test_backlash_consumed_by_eccentricity_binds(unseen, spring):
    soft = [{"kind": "tooth_compliance", "stiffness": "1e8 N/m", "damping": "0 N s/m"}] if spring else []
    phase = 5.6
    scenario = fig5(**{"motion.harmonics": [], "motion.mean": "60 rpm", "effect": soft, "run.output_rate": "5 kHz"})
    pair = scenario.pair().with_mounting(Eccentricity("drive", OFFSET, phase))
    kept = stopped(scenario, r"the gears jam at t = 0\.0\d+ s: both flanks .*more backlash", pair=pair)
    assert kept.meta["reached_s"] == pytest.approx(binding(pair, phase, scenario.motion.mean), abs=2e-3)
    assert len(kept.time) > 100


def test_a_rattling_pair_that_binds_is_kept_until_then(unseen):
    scenario = fig5()
    thick = [ToothDeviation("loose", flank, 14, 300e-6) for flank in ("active", "reverse")]
    kept = stopped(scenario, "the gears jam", pair=scenario.pair().with_deviations(*thick))
    assert 0.05 < kept.meta["reached_s"] < 0.4
    assert len(kept.impacts["time_s"]) > 0


def test_a_state_that_is_no_number_stops_before_it_is_written(monkeypatch):
    scenario = fig5()
    whole = simulate(scenario)
    poison(monkeypatch, 0.26)
    kept = stopped(scenario, r"not a number after t = .* look at the torques")
    assert all(np.isfinite(values).all() for values in kept.signals.values())
    assert same_until_then(kept, whole) > 0


def test_teeth_that_sink_into_each_other_stop_the_run(monkeypatch):
    """A tooth 20 µm too thick is not among the near ones until it stands in the pitch point.

    The edges of its neighbours, which bear the loose gear until then, leave it another 6.5 µm deep.
    """
    honest = Nearby.fill

    def late(self, found, thetas):
        honest(self, found if thetas[0] > 6.5 * self.width * WINDOWS else found[found[:, 0] != 8], thetas)

    monkeypatch.setattr(Nearby, "fill", late)
    scenario = fig5(**{"motion.harmonics": [], "drag.torque": "5 N m"})
    thick = scenario.pair().with_deviations(ToothDeviation("drive", "active", 8, 20e-6))
    kept = stopped(scenario, r"teeth lie 26\.5 µm deep in each other at t = 0\.1555\d* s", pair=thick)
    assert len(kept.time) > 2000


def test_teeth_that_yield_without_end_stop_the_run():
    soft = {"kind": "tooth_compliance", "stiffness": "7e4 N/m", "damping": "0 N s/m"}
    kept = stopped(fig5(effect=[soft]), r"teeth lie 3[5-9]\d µm deep in each other .*stiffer teeth")
    place = kept.signals["displacement_m"]
    depth = max(-place.min(), place.max() - 250e-6)
    assert depth == pytest.approx(0.35e-3, rel=0.05)  # a tenth of the module of 3.5 mm
    stiff = {**soft, "stiffness": "3e5 N/m"}
    assert simulate(fig5(effect=[stiff])).signals["displacement_m"].min() < -100e-6


def test_bullets_own_contact_that_gives_way_stops_the_run():
    scenario = fig5(**{"drag.torque": "50 N m"})
    fine = simulate(scenario, contact="native", step=2e-4)
    assert not fine.meta["interrupted"]
    kept = stopped(scenario, r"deep in each other .*--contact located", contact="native", step=1e-3)
    assert len(kept.time) > 2000


def test_gears_jammed_from_the_start_have_nothing_to_keep(unseen):
    scenario = fig5()
    thick = [ToothDeviation("loose", flank, tooth, 130e-6) for flank in ("active", "reverse") for tooth in range(1, 91)]
    with pytest.raises(EngineError, match="jammed at the start") as caught:
        simulate(scenario, pair=scenario.pair().with_deviations(*thick))
    assert caught.value.partial is None
