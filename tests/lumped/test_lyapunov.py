"""The largest exponent, told apart by what it is for: whether two runs that differ a little stay together."""

import numpy as np
import pytest

from tests.lumped.rig import simulate


def parted(e, change=1e-9):
    """Largest difference of the displacement late in two runs whose drag differs by a part of ``change`` [m]."""
    runs = [simulate(20.0, e=e, drag=0.22 * (1 + part), spacing=1e-3).samples[:, 5] for part in (0.0, change)]
    return np.abs(runs[0] - runs[1])[10_000:].max()


@pytest.mark.parametrize("e", [0.0, 0.5, 0.8])
def test_contact_in_every_period_wipes_the_memory(e):
    assert simulate(20.0, e=e, lyapunov=True).lyapunov == -np.inf
    assert parted(e) < 1e-9


@pytest.mark.parametrize("e", [0.9, 0.95])
def test_hard_rebounds_are_chaotic_though_they_stick_at_times(e):
    done = simulate(20.0, e=e, lyapunov=True)
    assert done.lyapunov > 1.0
    assert parted(e) > 1e-5


def test_contact_alone_is_not_chaotic():
    assert simulate(10.0, amplitude=0.1, lyapunov=True).lyapunov == -np.inf
