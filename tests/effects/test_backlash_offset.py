"""A wider gap: the active flank is left as before, the reverse one is reached later, by the closed form."""

import pytest

from gears3d.laws import crossing, loss_phases
from gears3d.verification.validation import swing
from tests.effects.bench import BACKLASH, MODELS, bench, found, off, run


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("offset", [20e-6, -20e-6, -100e-6])
def test_first_flight(model, offset):
    done = run(model, {"kind": "backlash_offset", "offset": f"{offset} m"})
    case = swing(bench())
    phase, _ = loss_phases(case.excitation)
    expected = (phase / case.omega, *crossing(case.speed, case.omega, case.pull, phase, BACKLASH + offset))
    assert off(done, expected) < 1e-7
    assert done.impacts["flight_height_m"][0] == pytest.approx(BACKLASH + offset, abs=1e-10)
    assert found(done)[0] == pytest.approx(found(run(model))[0], abs=1e-9)
