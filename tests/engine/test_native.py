"""Bullet's own contact: exact where the gears hardly turn, and wrong where they do."""

import numpy as np
import pytest

from gears3d.engine import simulate
from gears3d.errors import InputError
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
SMALL = 'motion.harmonics=[{amplitude="2 rpm", frequency="30 Hz"}]'


def native(*changes):
    return simulate(load(FIG5, ["run.duration=0.2 s", 'run.settle="0 s"', *changes]), contact="native")


def realised(record, above):
    hits = record.impacts
    hard = np.abs(hits["velocity_m_s"]) > above
    return -hits["rebound_m_s"][hard] / hits["velocity_m_s"][hard]


@pytest.mark.parametrize("restitution", [pytest.param(0.3, marks=pytest.mark.slow), 0.7])
def test_restitution_at_zero_mean_speed(restitution):
    record = native("motion.mean=0 rpm", SMALL, f"impact.restitution={restitution}")
    found = realised(record, above=0.01)
    assert len(found) >= 8
    assert np.abs(found - restitution).max() <= 0.01
    assert record.meta["contact"] == "native"


def test_a_speed_dependent_restitution_is_realised():
    slope = 'effect=[{kind="restitution_speed", slope="-4 s/m"}]'
    record = native("motion.mean=0 rpm", SMALL, "impact.restitution=0.5", slope)
    hits = record.impacts
    hard = np.abs(hits["velocity_m_s"]) > 0.01
    expected = 0.5 - 4.0 * np.abs(hits["velocity_m_s"][hard])
    assert realised(record, above=0.01) == pytest.approx(expected, abs=0.01)


@pytest.mark.slow
def test_facets_scatter_restitution_once_the_gears_turn():
    still, turning = (
        realised(native(f"motion.mean={mean}", SMALL, "impact.restitution=0.7"), above=0.01)
        for mean in ("0 rpm", "750 rpm")
    )
    assert np.std(still) < 0.01
    assert np.std(turning) > 0.1


def test_what_bullet_cannot_do_is_refused():
    soft = 'effect=[{kind="tooth_compliance", stiffness="1e7 N/m"}]'
    with pytest.raises(InputError, match=r"tooth_compliance. does not act in Bullet"):
        native(soft)
