"""Intervals hold the true numbers as often as they say, whether errors are independent or hang together."""

import numpy as np
import pytest

from gears3d.diagnosis.run_information import STRETCHES, _wider

RECORDS, POINTS, DRAWS = 5, 480, 1500


def covered(common, parts, rng):
    """Return how often intervals of 95 % hold both of two numbers' true values, (2,), and their mean deviations.

    Errors are independent but for one that each of some parts of a record has in common.
    """
    slopes = np.stack([np.ones((RECORDS, POINTS)), 0.5 + rng.normal(size=(RECORDS, POINTS))], axis=-1)
    flat = slopes.reshape(-1, 2)
    normal, holds, sizes = flat.T @ flat, np.zeros(2), np.zeros(2)
    for _ in range(DRAWS):
        together = np.repeat(rng.normal(size=(RECORDS, parts)), POINTS // parts, axis=1)
        errors = rng.normal(size=(RECORDS, POINTS)) + common * together
        off = np.linalg.solve(normal, flat.T @ errors.ravel())
        rest = errors - slopes @ off
        scores = (slopes * rest[..., None]).reshape(RECORDS, STRETCHES[0], -1, 2).sum(axis=2)
        sigma = np.sqrt(np.diag(_wider(normal, scores, max(float(np.mean(rest**2)), 1.0))))
        holds += np.abs(off) < 1.96 * sigma
        sizes += sigma / DRAWS
    return holds / DRAWS, sizes / np.sqrt(np.diag(np.linalg.inv(normal)))


@pytest.mark.parametrize("parts", [4, 16])
@pytest.mark.parametrize("common", [0.1, 0.3, 1.0])
def test_intervals_cover_what_they_say(common, parts):
    share, _ = covered(common, parts, np.random.default_rng([1986, parts, int(10 * common)]))
    assert np.all(share > 0.93), share  # of 1500; three deviations are 0.017


@pytest.mark.parametrize("common", [0.1, 0.3])
def test_five_whole_records_cover_nearly_so(common):
    """Five means leave a mean that is off by as much: Student's interval would be 1.4 times as wide."""
    share, _ = covered(common, 1, np.random.default_rng([1987, int(10 * common)]))
    assert np.all(share > 0.85), share


def test_independent_errors_are_hardly_told_larger():
    share, larger = covered(0.0, 1, np.random.default_rng(1988))
    assert np.all(share > 0.95), share
    assert np.all(larger < 1.25), larger


def test_what_no_point_tells_has_no_variance_of_its_own():
    """A combination of numbers that nothing depends on is left as it is, and does not spoil the others."""
    scores = np.zeros((1, STRETCHES[0], 2))
    found = _wider(np.ones((2, 2)), scores, 1.0)
    np.testing.assert_allclose(np.ones(2) @ found @ np.ones(2), 1.0, rtol=1e-9)
    np.testing.assert_allclose(found @ [1.0, -1.0], 0.0, atol=1e-12)
