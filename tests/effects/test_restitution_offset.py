"""A restitution offset is another restitution."""

import pytest

from tests.effects.bench import MODELS, run, same


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("offset", [0.2, -0.2])
def test_it_is_the_base_coefficient_by_another_name(model, offset):
    changed = run(model, {"kind": "restitution_offset", "offset": offset}, run__duration="0.3 s")
    assert same(changed, run(model, impact__restitution=0.3 + offset, run__duration="0.3 s")) < 1e-12
    assert len(changed.impacts["time_s"]) >= 4


@pytest.mark.parametrize("model", MODELS)
def test_no_impact_gives_energy(model):
    hits = run(model, {"kind": "restitution_offset", "offset": 1.0}).impacts
    assert -hits["rebound_m_s"] == pytest.approx(hits["velocity_m_s"])
