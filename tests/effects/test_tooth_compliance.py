"""Teeth that yield: a stiff spring without damper rebounds as e = 1, and contact lasts half its period."""

from math import pi, sqrt

import pytest

from tests.effects.bench import MODELS, J, bench, run


@pytest.mark.parametrize("model", MODELS)
def test_a_spring_gives_everything_back(model):
    hits = run(model, {"kind": "tooth_compliance", "stiffness": "1e8 N/m"}).impacts
    assert -hits["rebound_m_s"][0] / hits["velocity_m_s"][0] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("damping", [0.1, 0.3])
def test_damped_rebound(model, damping):
    """Damping ratio ζ and a force that never pulls: the flanks let go where it vanishes."""
    mass, stiffness = J / bench().rig().base_radius_loose ** 2, 1e12
    c = 2 * damping * sqrt(stiffness * mass)
    spring = {"kind": "tooth_compliance", "stiffness": f"{stiffness} N/m", "damping": f"{c} N s/m"}
    hits = run(model, spring, start__state="free", run__duration="8 ms").impacts
    ours = -hits["rebound_m_s"][0] / hits["velocity_m_s"][0]
    assert ours == pytest.approx(rebound(damping), rel=2e-3)
    assert rebound(damping) < 1 - damping


def rebound(ratio):
    """Speed at which spring and damper let go over that of entry, u' = w there: -k·u - c·u' = 0."""
    from math import asin, atan2, cos, exp, sin

    # u = exp(-ζτ)·sin(ωτ)/ω, u' = exp(-ζτ)·(cos ωτ - ζ/ω·sin ωτ); u + 2ζ·u' = 0
    w = sqrt(1 - ratio**2)
    end = pi - atan2(2 * ratio * w, 1 - 2 * ratio**2)
    assert sin(end) / w + 2 * ratio * (cos(end) - ratio / w * sin(end)) == pytest.approx(0.0, abs=1e-12)
    assert asin(1.0) < end < pi
    return -exp(-ratio * end / w) * (cos(end) - ratio / w * sin(end))
