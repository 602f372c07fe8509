"""Located contact against closed forms."""

import numpy as np
import pytest

from gears3d.engine import simulate
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"


def test_plastic_orbit_has_the_closed_form():
    """Rigaud & Perret-Liaudet 2020, eqs (17)-(19), roots found to 30 digits; Rb = 148.0016 mm shifts them by 1e-5."""
    scenario = load(FIG5, ["impact.restitution=0.0", 'run.duration="0.7 s"'])
    hits = simulate(scenario).impacts
    assert hits["flank"].tolist() == [1, 0, 1, 0]
    assert hits["time_s"][:2] == pytest.approx([0.1116544, 0.2696574], rel=2e-5)
    assert hits["velocity_m_s"][:2] == pytest.approx([0.0308581, -0.0312425], rel=2e-5)
    assert hits["phase_rad"][2:] == pytest.approx(hits["phase_rad"][:2], abs=1e-7)
    assert np.all(hits["flight_height_m"] == pytest.approx(250e-6, abs=1e-9))
