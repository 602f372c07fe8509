"""The density of seen rebounds: whole over what can be seen, and that of normal numbers where nothing bounds them."""

import numpy as np
import pytest
from scipy.stats import norm

from gears3d.identify.restitution_fit import densities, noise


@pytest.mark.parametrize(("mean", "scatter", "cut"), [(0.6, 0.08, 0.3), (0.4, 0.05, 0.4), (0.9, 0.1, 0.2)])
def test_the_density_of_what_is_seen_is_whole(mean, scatter, cut):
    """Coefficients beyond 1 are held there, so that the mass above 1 comes from errors alone."""
    ratio = np.linspace(cut, 1.5, 200_001)
    same = np.ones_like(ratio)
    density = np.exp(densities(ratio, cut * same, mean * same, 0.03 * same, scatter, 0.0))
    assert np.trapezoid(density, ratio) == pytest.approx(1.0, abs=2e-3)


def test_without_bounds_it_is_normal():
    ratio = np.linspace(0.3, 0.7, 41)
    same = np.ones_like(ratio)
    told = densities(ratio, -10.0 * same, 0.5 * same, 0.03 * same, 0.04, 0.0)
    assert told == pytest.approx(norm.logpdf(ratio, 0.5, 0.05), abs=1e-12)


def test_errors_of_both_speeds_join():
    """e = w/v: the relative errors of both add as squares, and the law's slope turns that of the approach."""
    one = np.ones(5)
    found = noise(0.04 * one, 0.02 * one, (4e-4 * one, 3e-4 * one), 0.5 * one, (2.0, 0.0), 1e-3)
    assert found == pytest.approx(2.0 * np.hypot(3e-4, 0.5 * 4e-4) / 0.04)
