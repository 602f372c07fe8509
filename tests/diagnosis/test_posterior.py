"""Posterior probability of sets of causes: sums, prices, and calibration on data from known hypotheses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binomtest

from gears3d.diagnosis.causes import begin, candidates
from gears3d.diagnosis.run_information import prior_covariance
from gears3d.diagnosis.search import OUTSIDE, PRIOR, STATED, occam, options, posterior
from gears3d.scenario import load

RIG = "scenarios/rigaud-2020/fig5-20rpm.toml"
POINTS, SIZE = 400, 30.0


def test_probabilities_of_a_place_sum_to_one() -> None:
    told = options("drag_viscous", 1e4, [(("drag_power",), 3.0), (("drag_coulomb", "drag_viscous"), 9.0)])
    assert sum(one.probability for one in told) == pytest.approx(1.0)
    assert told[-1].kinds is None
    assert told[-1].probability == OUTSIDE


def test_hypotheses_of_equal_evidence_share_the_probability() -> None:
    told = options("eccentricity", 1e6, [(("transmission_error",), 0.0)])
    assert told[0].probability == pytest.approx(told[1].probability) == pytest.approx(0.5 * (1.0 - OUTSIDE))


def test_a_cause_that_gains_its_price_is_as_probable_as_none() -> None:
    first, none, _ = options("drag_coulomb", 30.0, [])
    assert none.kinds == ()
    assert none.probability == pytest.approx(first.probability)


def test_sets_are_products_of_their_places_and_all_together_one() -> None:
    places = [options("drag_viscous", 1e3, [(("drag_power",), 2.0)]), options("restitution_offset", 1e3, [])]
    told = posterior(places)
    assert told[0].kinds == ("drag_viscous", "restitution_offset")
    assert told[0].probability == pytest.approx(places[0][0].probability * places[1][0].probability)
    assert told[-1].kinds is None
    assert sum(one.probability for one in told) == pytest.approx(1.0)


def test_the_same_set_from_two_places_is_stated_once() -> None:
    """Two causes that stand for each other make one set, whichever place each has."""
    places = [options("a", 1e3, [(("b",), 0.0)]), options("b", 1e3, [(("a",), 0.0)])]
    kinds = [one.kinds for one in posterior(places)]
    assert len(kinds) == len(set(kinds))
    assert ("a", "b") in kinds


def test_nothing_is_stated_without_causes() -> None:
    assert posterior([]) == ()


def test_negligible_sets_are_left_to_the_others() -> None:
    told = posterior([options("drag_viscous", 1e4, [(("drag_power",), 40.0)])])
    assert [one.kinds for one in told] == [("drag_viscous",), None]
    assert told[0].probability > STATED


@pytest.mark.parametrize("angle", [0.05, 0.2, 1.0])
def test_stated_probabilities_come_true_in_data_of_known_hypotheses(angle: float) -> None:
    """Two regressors at an angle and both together, sizes and noise drawn: shares of true statements are as stated."""
    random, stated = np.random.default_rng(7), []
    for _ in range(600):
        a, b = np.linalg.qr(random.standard_normal((POINTS, 2)))[0].T
        columns = {("a",): [a], ("b",): [np.cos(angle) * a + np.sin(angle) * b]}
        columns["a", "b"] = columns["a",] + columns["b",]
        truth = list(columns)[random.integers(3)]
        data = random.standard_normal(POINTS)
        data += np.column_stack(columns[truth]) @ (SIZE * random.standard_normal(len(truth)))
        chi2 = {kinds: _left(np.column_stack(own), data) for kinds, own in columns.items()}
        cost = {kinds: _price(np.column_stack(own)) for kinds, own in columns.items()}
        first = min(columns, key=lambda kinds: chi2[kinds] + cost[kinds])
        others = [(kinds, chi2[kinds] + cost[kinds] - chi2[first] - cost[first]) for kinds in columns if kinds != first]
        told = options(" + ".join(first), float(data @ data) - chi2[first], others)
        for one, kinds in zip(told, [first, *(kinds for kinds, _ in others)], strict=False):
            stated.append((one.probability / (1.0 - OUTSIDE), kinds == truth))
    for low, high in ((0.0, 0.1), (0.9, 1.01)):
        own = [(p, true) for p, true in stated if low <= p < high]
        reach = binomtest(sum(true for _, true in own), len(own)).proportion_ci(0.99)
        assert low <= reach.high, (low, len(own), reach)
        assert reach.low <= high, (high, len(own), reach)


@pytest.mark.parametrize("exponent", [0.5, 2.0, 4.0])
def test_a_power_law_costs_what_its_torque_and_exponent_are_known_by(exponent: float) -> None:
    """Whatever its exponent: at 4 the unit of a coefficient of exponent 2 had cost 11.8 more than a viscous torque."""
    candidate = next(one for one in candidates(load(RIG).rig(), 10.0, 8) if one.kind == "drag_power")
    pivot, torque, sigma, spread = 200.0, 0.4, 0.02, 0.1
    unit = candidate.unit * pivot ** (candidate.shape["exponent"] - exponent)
    cause = begin(candidate, np.array([torque]))._replace(numbers=np.array([torque * unit, np.log(exponent)]))
    slope = torque * unit * np.log(pivot) * exponent
    known = np.array(
        [[(sigma * unit) ** 2 + (slope * spread) ** 2, -slope * spread**2], [-slope * spread**2, spread**2]]
    )
    assert prior_covariance(known, [cause], pivot) == pytest.approx(np.diag([sigma**2, spread**2]), abs=1e-9)


@pytest.mark.parametrize("shaft", [-5000.0, 0.0, 150.0])
def test_a_torque_over_a_difference_of_speeds_costs_what_its_torque_is_known_by(shaft: float) -> None:
    """Whatever the speed of the shaft, which one mean speed does not determine: a far one had cost 54 more."""
    candidate = next(one for one in candidates(load(RIG).rig(), 10.0, 8) if one.kind == "drag_differential")
    pivot, torque, sigma, spread = 200.0, 0.4, 0.02, 900.0
    unit = candidate.unit * abs(pivot - candidate.shape["shaft_speed"])
    cause = begin(candidate, np.array([torque]))
    cause = cause._replace(numbers=np.array([torque * unit / (pivot - shaft), shaft]))
    per_torque, slope = unit / (pivot - shaft), cause.numbers[0] / (pivot - shaft)
    known = np.array(
        [[(sigma * per_torque) ** 2 + (slope * spread) ** 2, slope * spread**2], [slope * spread**2, spread**2]]
    )
    expected = np.diag([sigma**2, (spread / abs(candidate.shape["shaft_speed"])) ** 2])
    assert prior_covariance(known, [cause], pivot) == pytest.approx(expected, rel=1e-6, abs=1e-6)


def _price(columns: np.ndarray) -> float:
    """Return the price of the numbers of some columns whose sizes are drawn with a standard deviation of ``SIZE``."""
    return occam(np.linalg.inv(columns.T @ columns), np.full(columns.shape[1], SIZE / PRIOR))


def _left(columns: np.ndarray, data: np.ndarray) -> float:
    return float(np.sum((data - columns @ np.linalg.lstsq(columns, data, rcond=None)[0]) ** 2))
