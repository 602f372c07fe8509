"""Impacts made by hand: bounces under a constant acceleration, seen with errors and only when they rise high enough."""

from types import SimpleNamespace

import numpy as np

from gears3d.recording import Recording
from gears3d.scenario import load

RIG = load("scenarios/rigaud-2020/fig5-20rpm.toml").rig()
FALL = 6.0
"""Acceleration towards the flank in bounces [m/s²]."""
HEIGHT = 1e-6
"""Lowest flight that is seen [m]."""


def bounces(seed, count=150, restitution=0.5, slope=0.0, asymmetry=0.0, deviation=0.0, error=1e-4, per_sliding=0.0):
    """Return a measured record of about so many impacts, each swing one fast blow and its bounces.

    ``error`` is the standard deviation of every speed [m/s]; restitution changes with the sliding speed [s/m] if asked.
    """
    random = np.random.default_rng(seed)
    rows, clock, flank = [], 0.0, 0
    turn = 2.0 * np.pi * 0.5
    path = RIG.contact_ratio * 2.0 * np.pi * RIG.base_radius_drive / RIG.teeth_drive
    while len(rows) < count:
        speed = random.uniform(0.015, 0.035)
        clock += random.uniform(0.05, 0.1)
        flank = 1 - flank
        while True:
            sliding = (turn + 0.4 * np.cos(7.0 * clock)) * 2.0 * path / 4.0
            e = restitution + slope * speed + (0.5 - flank) * asymmetry + per_sliding * sliding
            e = np.clip(e + deviation * random.normal(), 0.0, 1.0)
            rebound = e * speed
            seen = rebound**2 / (2.0 * FALL) > HEIGHT
            sign = 1.0 if flank else -1.0
            before = sign * (speed + error * random.normal())
            after = -sign * (rebound + error * random.normal()) if seen else np.nan
            rows.append((clock, flank, before, after, error, error if seen else np.nan, 1))
            if not seen:
                break
            clock += 2.0 * rebound / FALL
            speed = rebound
    names = ("time_s", "flank", "velocity_m_s", "rebound_m_s", "velocity_sigma_m_s", "rebound_sigma_m_s", "testifies")
    impacts = dict(zip(names, np.array(rows).T, strict=True))
    time = np.arange(0.0, clock + 0.1, 1e-3)
    angle = turn * time + 0.4 / 7.0 * np.sin(7.0 * time)
    recording = Recording({"time_s": time, "theta_drive_rad": angle, "theta_loose_rad": angle}, impacts)
    quality = {"flight_height_min_m": HEIGHT, "averaged_over_s": 6e-5}
    summary = {"quality": quality, "cut": {"deceleration_median_rad_s2": 3.2}}
    return SimpleNamespace(recording=recording, summary=summary, segments=SimpleNamespace(flights=no_flights()))


def no_flights():
    """Flights that tell nothing of where flanks are."""
    names = ("struck", "blow", "start_s", "end_s", "start_sigma_s", "end_sigma_s", "velocity_m_s", "departure_m_s")
    return {name: np.zeros(0) for name in names}
