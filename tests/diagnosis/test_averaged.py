"""The average of two estimates of one cause."""

import numpy as np
import pytest

from gears3d.diagnosis.causes import begin, candidates
from gears3d.diagnosis.run_information import averaged
from gears3d.scenario import load

KNOWN = {one.kind: one for one in candidates(load("scenarios/rigaud-2020/fig5-20rpm.toml").rig(), 6.0, 12)}
PIVOT = 25.0


def averaged_of(kind, first, mine, second, its):
    unit = KNOWN[kind].unit
    one, other = (begin(KNOWN[kind], np.atleast_1d(value) / unit) for value in (first, second))
    made, factor = averaged(one, np.atleast_2d(mine), other, np.atleast_2d(its), PIVOT)
    return made.numbers, factor


def test_the_mean_is_weighted_by_inverse_variances():
    numbers, factor = averaged_of("restitution_offset", -0.05, 0.002**2, -0.049, 0.001**2)
    assert numbers[0] == pytest.approx((-0.05 / 4.0 - 0.049) / 1.25)
    assert factor == 1.0  # both come from one record: no more precise than the better one


def test_estimates_that_disagree_have_a_wider_interval():
    numbers, factor = averaged_of("restitution_offset", -0.0559, 0.0018**2, -0.05, 0.0013**2)
    variance = 0.0018**2 * 0.0013**2 / (0.0018**2 + 0.0013**2)
    scale = 0.0059**2 / (0.0018**2 + 0.0013**2)
    assert factor * 0.0013**2 == pytest.approx(scale * variance)
    assert abs(numbers[0] + 0.0559) < 1.96 * np.sqrt(factor) * 0.0013


def test_an_order_is_averaged_as_a_whole():
    mine, its = np.diag([4e-14, 4e-14]), np.array([[1e-14, 5e-15], [5e-15, 1e-14]])
    numbers, _ = averaged_of("eccentricity", (2e-5, 1e-5), mine, (2.01e-5, 1.01e-5), its)
    sure = np.linalg.inv(mine), np.linalg.inv(its)
    mean = np.linalg.solve(sure[0] + sure[1], sure[0] @ (2e-5, 1e-5) + sure[1] @ (2.01e-5, 1.01e-5))
    np.testing.assert_allclose(numbers, mean, rtol=1e-9)


def test_a_torque_over_a_difference_of_speeds_is_averaged_at_the_torque_that_both_have():
    """Slopes differ by two standard deviations; the torque at mean speed is known to 1e-5."""
    kind = next(one for one in KNOWN.values() if one.kind == "drag_differential")
    torque, estimates = 0.005, []
    for slope, sigma in ((1.3e-3, 2e-4), (0.9e-3, 3e-5)):
        speed = PIVOT - torque / slope
        line = np.array([1.0, torque / slope**2])  # along it the torque at mean speed stays
        across = np.array([0.0, 1e-5 * torque / slope])
        estimates.append((np.array([slope, speed]), sigma**2 * np.outer(line, line) + np.outer(across, across)))
    one, other = (begin(kind, np.ones(1))._replace(numbers=own) for own, _ in estimates)
    made, factor = averaged(one, estimates[0][1], other, estimates[1][1], PIVOT)
    slope, speed = made.numbers
    weight = 1.0 / (1.0 + (3e-5 / 2e-4) ** 2)
    assert slope == pytest.approx(1.3e-3 - 4e-4 * weight, rel=1e-4)
    assert slope * (PIVOT - speed) == pytest.approx(torque, rel=1e-4)
    assert factor < 2.5  # (4e-4 / 2e-4)**2, less the smaller variance, over two numbers
