"""Half the asymmetry is added on the active flank and taken off on the reverse one."""

import numpy as np
import pytest

from tests.effects.bench import MODELS, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("asymmetry", [0.2, -0.2])
def test_every_rebound(model, asymmetry):
    hits = run(model, {"kind": "restitution_asymmetry", "asymmetry": asymmetry}, run__duration="0.3 s").impacts
    ratio, free = -hits["rebound_m_s"] / hits["velocity_m_s"], hits["rebound_m_s"] != 0.0
    sign = np.where(hits["flank"] == 0, 0.5, -0.5)
    assert set(hits["flank"][free]) == {0, 1}
    assert ratio[free] == pytest.approx(0.3 + sign[free] * asymmetry)
