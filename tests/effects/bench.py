"""Figure 5 of Rigaud & Perret-Liaudet 2020 with effects, and what the equations of motion say of its first flight."""

from math import cos, pi, sin

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gears3d.simulation import simulate
from gears3d.verification.validation import fig5

MODELS = ("rigid", "bullet")
J, DRAG, BACKLASH = 0.0695, 0.22, 250e-6
MEAN, SWING, OMEGA = pi, 2 * pi / 3, 6 * pi  # 30 rpm, 20 rpm at 3 Hz


def bench(*effects, **changes):
    """The scenario with these effects, 0.13 s long unless said otherwise: contact, flight, first reverse impact."""
    return fig5(**{"run__duration": "0.13 s", **changes}).with_({"effect": list(effects)})


def run(model, *effects, **changes):
    return simulate(bench(*effects, **changes), model)


def drive(time):
    """Angle, speed and acceleration of the drive."""
    return (
        MEAN * time + SWING / OMEGA * (1 - cos(OMEGA * time)),
        MEAN + SWING * sin(OMEGA * time),
        SWING * OMEGA * cos(OMEGA * time),
    )


def first_flight(contact, flight=None, gap=lambda theta: BACKLASH, slope=lambda theta: 0.0):
    """When the active flank is lost, when the reverse one is reached, and the approach speed, by other means.

    ``contact(t, theta, omega)`` and ``flight`` are the resisting torques; ``gap(theta_drive)`` is the backlash
    and ``slope`` its derivative.
    """
    flight = flight or contact
    radius = bench().rig().base_radius_loose

    def pressed(time):
        theta, omega, alpha = drive(time)
        return J * alpha + contact(time, theta, omega)

    lost = brentq(pressed, 0.06, 0.12, xtol=1e-15)

    def left(time, state):
        return radius * (state[0] - drive(time)[0]) - gap(drive(time)[0])

    left.terminal = True
    done = solve_ivp(
        lambda t, y: [y[1], -flight(t, y[0], y[1]) / J], (lost, lost + 0.1), drive(lost)[:2], "DOP853",
        events=left, rtol=1e-13, atol=1e-14, max_step=1e-3,
    )  # fmt: skip
    time, (_, omega) = done.t_events[0][0], done.y_events[0][0]
    theta_drive, omega_drive, _ = drive(time)
    return lost, time, radius * (omega - omega_drive) - slope(theta_drive) * omega_drive


def found(recording):
    """The same three of a recording."""
    hits = recording.impacts
    return recording.meta["contacts"][0][2], float(hits["time_s"][0]), float(hits["velocity_m_s"][0])


def off(recording, expected):
    """Largest error of the three, as times in s and as a speed relative to itself."""
    ours = found(recording)
    return max(abs(ours[0] - expected[0]), abs(ours[1] - expected[1]), abs(ours[2] / expected[2] - 1))


def same(one, other):
    """Largest difference of two recordings' displacement and impact times and speeds."""
    parts = [np.abs(one.signals["displacement_m"] - other.signals["displacement_m"]).max()]
    parts += [np.abs(one.impacts[key] - other.impacts[key]).max() for key in ("time_s", "velocity_m_s", "impulse_N_s")]
    return max(parts)
