"""Flanks may have a form besides orders: it belongs to one flank alone, and its size may be known beforehand."""

import numpy as np
import pytest

from gears3d.measured.segmentation import make_terms
from gears3d.measured.segmentation.displacement import Blocks, Shape
from gears3d.measured.segmentation.flanks import through

GAP = 2e-4


def _tooth(drive, loose):
    return (np.abs(np.mod(drive - 1.0, 2.0 * np.pi) - 0.1) < 0.1) * 1.0


def _drawn(shapes, seed=1, robust=True):
    """Flanks through places on both, the active one with a tooth that stands out."""
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 10.0, 4000)
    drive = 7.0 * time
    loose, side = 0.6 * drive, random.integers(0, 2, len(time))
    place = np.where(side == 1, GAP, 5e-5 * _tooth(drive, loose)) + random.normal(0.0, 1e-6, len(time))
    path = Blocks(time, drive, loose, place, 1e-6, 0.0, 1, 1e-3, shapes)
    terms = make_terms(path, None)
    return through(terms, terms.columns(time, drive, loose), side, place, 1e-6, GAP, True, robust)


@pytest.mark.parametrize("flank", [0, 1])
def test_a_form_is_that_of_its_flank_alone(flank):
    flanks = _drawn((Shape(_tooth, flank),), robust=False)
    on, off = np.array([1.1]), np.array([3.0])
    low, high = flanks.places(np.ones(1), on, 0.6 * on)
    beside = flanks.places(np.ones(1), off, 0.6 * off)
    if flank == 0:
        assert low - beside[0] == pytest.approx(5e-5, abs=1e-6)
        assert flanks.lifted(on, 0.6 * on, np.zeros(1)) == pytest.approx(5e-5, abs=1e-6)
    other = high - beside[1] if flank == 0 else low - beside[0]
    assert abs(other) < 1e-5  # orders may bend a little towards what no form explains
    assert flanks.lifted(on, 0.6 * on, np.array([1 - flank])) == pytest.approx(0.0, abs=1e-12)


def test_a_size_that_is_about_known_is_found_among_strays():
    on, where = np.array([1.1]), np.zeros(1)
    held = _drawn((Shape(_tooth, 0, 4.98e-5, True),))
    assert held.lifted(on, 0.6 * on, where) == pytest.approx(5e-5, abs=5e-7)
    low, high = held.sigma(where, on, 0.6 * on, where), held.sigma(where, on, 0.6 * on, where + 1.0)
    assert 0.0 < high[0] < low[0] < 1e-6  # the reverse flank has no tooth to be unsure of
