"""The integrator of compliant contact: its coefficients, its order, and what a smaller tolerance makes of impacts."""

from math import inf, pi

import numpy as np
import pytest
from scipy.integrate._ivp import dop853_coefficients as published

from gears3d import integrator
from gears3d.effects import Flank, Gear, Rig, flank_harmonic, gap_spring, torque_harmonic, torque_linear
from gears3d.effects.oil_film import OilFilm
from gears3d.lumped.model import model
from gears3d.lumped.run import run
from tests.lumped.rig import RPM, bench

PAIR = Rig(24.476e-3, 61.909e-3, 3.71e-3, 0.1, 133.72e-6, 0.3, 1500 * RPM, 17, 43, 0.391, 0.4569, 16e-3, 1.372)


def test_the_coefficients_are_those_of_dop853():
    assert np.array_equal(integrator.A, published.A)
    assert np.array_equal(integrator.C, published.C)
    assert np.array_equal(integrator.D, published.D)
    assert np.array_equal(integrator.E, [published.E5[:-1], published.E3[:-1]])


def test_a_step_is_of_order_eight_and_its_dense_output_of_order_seven():
    def rates(given, t, y, k):
        k[0], k[1] = y[1], -y[0]
        k[2] = y[0]  # an integral on which nothing depends

    attempt, open_up = integrator.integrator(rates)
    off = []
    for h in (0.8, 0.4):
        y, end, between, k = np.array([1.0, 0.0, 0.0]), np.zeros(3), np.zeros(3), np.zeros((integrator.STAGES, 3))
        dense = np.zeros((integrator.DENSE, 3))
        rates((), 0.0, y, k[0])
        attempt((), 0.0, y, h, k, end, 2)
        rates((), h, end, k[integrator.END])
        open_up((), 0.0, y, h, k, end, dense, between, 2)
        inside = [integrator.inside(y, dense, 0.3, c) for c in range(3)]
        exact = np.cos(h), -np.sin(h), np.sin(h)
        off.append([np.abs(end - exact).max(), abs(inside[0] - np.cos(0.3 * h)), abs(inside[2] - np.sin(0.3 * h))])
    gained = np.log2(np.array(off[0]) / off[1])
    assert gained[0] > 8.5
    assert gained[1:].min() > 7.5


@pytest.mark.parametrize(
    "packed",
    [
        model(PAIR, [(300 / (100 * pi), 50.0, 0.0)], OilFilm(viscosity=0.1).rows(PAIR)),
        bench(rows=[gap_spring(1e8, 3e3), torque_linear(0.01)]),
        bench(
            rows=[
                gap_spring(1e7, 1e3),
                flank_harmonic(Gear.DRIVE, Flank.ACTIVE, 1, 10e-6, 0.3),
                torque_harmonic(2, 0.02, 0.1),
            ]
        ),
    ],
    ids=["oil", "teeth", "waves"],
)
def test_impacts_tend_to_a_limit_with_the_tolerance(packed):
    found = [run(packed._replace(tolerance=t), 0.2, inf, "free").impacts for t in (1e-7, 1e-9, 1e-12)]
    assert len(found[2]) > 3
    assert all(np.array_equal(one[:, 1], found[2][:, 1]) for one in found)
    scale = np.abs(found[2]).max(axis=0)
    off = [np.abs((one - found[2])[:, [0, 2, 3, 4]] / scale[[0, 2, 3, 4]]).max() for one in found[:2]]
    assert off[1] < 1e-7
    assert off[1] < 0.1 * off[0]
