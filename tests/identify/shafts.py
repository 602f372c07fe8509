"""Run-downs in closed form or by a standard solver, seen by encoders: nothing here is shared with what identifies."""

from math import log, pi

import numpy as np
from scipy.integrate import solve_ivp

INERTIA = 0.0695
ENCODERS = {"2048 lines": (8192, 50e3), "10 000 ppr": (40_000, 1e3), "400 000 ppr": (1_600_000, 50e3)}
"""Counts per revolution and sample rate [Hz] of the rigs of Kadmiri 2012, Ottewill 2010, Rigaud 2020."""


def coulomb(torque, speed, rate):
    """Return time [s] and angle [rad] under a constant torque [N m] from a speed [rad/s]."""
    slowing = torque / INERTIA
    time = np.arange(0.0, 1.05 * speed / slowing, 1.0 / rate)
    turning = np.minimum(time, speed / slowing)
    return time, speed * turning - 0.5 * slowing * turning**2


def viscous(torque, coefficient, speed, rate):
    """Return time [s] and angle [rad] under a constant torque [N m] and a coefficient [N m s/rad]."""
    decay, rest = coefficient / INERTIA, torque / coefficient
    stop = log(1.0 + speed / rest) / decay
    time = np.arange(0.0, 1.02 * stop, 1.0 / rate)
    turning = np.minimum(time, stop)
    return time, (speed + rest) * -np.expm1(-decay * turning) / decay - rest * turning


def churning(torque, coefficient, exponent, speed, rate):
    """Return time [s] and angle [rad] under a constant torque and a power law, solved to 1e-12."""

    def slowing(_, y):
        return [y[1], -(torque + coefficient * max(y[1], 0.0) ** exponent) / INERTIA]

    def stands(_, y):
        return y[1]

    stands.terminal = True
    found = solve_ivp(
        slowing, (0.0, 1e4), [0.0, speed], method="DOP853", rtol=1e-12, atol=1e-12, events=stands, dense_output=True
    )
    time = np.arange(0.0, found.t[-1], 1.0 / rate)
    return time, found.sol(time)[0]


def counted(angle, counts, seed):
    """Return what a counter with an unknown start shows [rad]."""
    count = 2.0 * pi / counts
    return np.floor(angle / count + np.random.default_rng(seed).uniform()) * count


def solved(inertia, torque, coefficient, power, exponent, speed, rate, last=0.02):
    """Return time and angle under a whole law, solved to 1e-13, down to a part of the speed."""

    def slowing(_, y):
        w = max(y[1], 0.0)
        return [y[1], -(torque + coefficient * w + power * w**exponent) / inertia]

    def slow(_, y):
        return y[1] - last * speed

    slow.terminal = True
    found = solve_ivp(
        slowing, (0.0, 1e4), [0.0, speed], method="DOP853", rtol=1e-13, atol=1e-13, events=slow, dense_output=True
    )
    time = np.arange(0.0, found.t[-1], 1.0 / rate)
    return time, found.sol(time)[0]
