"""The log of a run: samples on the time axis of the recording, and the table of impacts."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from gears3d.engine.closing import Arc, angle_after, speed_after
from gears3d.engine.compile import inner
from gears3d.engine.mesh import call_side
from gears3d.engine.motion import drive_at, drive_samples

HELICAL = ("height_m", "axial_impulse_N_s")  # columns of helical teeth only


class Impact(NamedTuple):
    """One impact, in the order of the recording's columns.

    Args:
        time_s: s.
        flank: 0 active, 1 reverse.
        velocity_m_s: relative to the flank just before [m/s].
        rebound_m_s: the same just after [m/s].
        impulse_N_s: on the loose gear, along the contact normal; positive on the active flank [N s].
        phase_rad: of the first harmonic of the motion [rad].
        tooth_drive: number of the drive gear's tooth.
        tooth_loose: number of the loose gear's tooth.
        flight_height_m: largest distance from the flank that the flight left [m].
        height_m: middle of the line of contact along the face, from the middle of the face [m]; helical teeth only.
        axial_impulse_N_s: on the loose gear, along +z [N s]; helical teeth only.
    """

    time_s: float
    flank: int
    velocity_m_s: float
    rebound_m_s: float
    impulse_N_s: float
    phase_rad: float
    tooth_drive: int
    tooth_loose: int
    flight_height_m: float
    height_m: float = math.nan
    axial_impulse_N_s: float = math.nan


@inner
def fill_flight(arc: Arc, until: float, times: np.ndarray, first: int, out: np.ndarray) -> int:
    """Write the samples before ``until`` from a flight; return the first sample not written."""
    while first < times.size and times[first] < until:
        after = times[first] - arc.time
        out[first, 0], out[first, 1] = angle_after(arc, after), speed_after(arc, after)
        first += 1
    return first


@inner
def fill_contact(system, teeth, side, ends, times, first, out):
    """Write the samples of a step with the gap held closed; return the first sample not written.

    ``ends`` holds time, angle, speed at start and end; between them a cubic, corrected by the gap measured there.
    """
    start, theta, omega, until, theta_end, omega_end = ends
    span = until - start
    while first < times.size and times[first] < until:
        x = (times[first] - start) / span
        y = 1.0 - x
        guess = y * y * ((1.0 + 2.0 * x) * theta + x * span * omega)
        guess += x * x * ((3.0 - 2.0 * x) * theta_end - y * span * omega_end)
        angle, speed, _ = drive_at(system.motion, times[first])
        gap, by_drive, by_loose, _ = call_side(system.surfaces.side, (system.surfaces, teeth, side, angle, guess))
        out[first, 0] = guess - gap / by_loose
        out[first, 1] = -by_drive / by_loose * speed
        first += 1
    return first


class Log:
    """Samples and impacts of one run.

    Args:
        duration: of the run [s].
        rate: of the samples [Hz].
        times: of the samples in place of evenly spaced ones [s], (n,).
    """

    goes_on = False
    """Whether further samples follow in another block."""

    def __init__(self, duration: float, rate: float, times: np.ndarray | None = None) -> None:
        even = np.arange(math.floor(duration * rate * (1.0 + 1e-12)) + 1) / rate if times is None else times
        self.times: np.ndarray = even
        self.impacts: list[Impact] = []
        self.rows = np.zeros((self.times.size, 2))
        self.written = 0

    def turn_over(self) -> None:
        """Provide space for further samples and impacts."""

    def flight(self, arc: Arc, until: float) -> None:
        """Write the samples of a flight that starts at ``arc.time`` and ends at ``until`` [s]."""
        self.written = fill_flight(arc, until, self.times, self.written, self.rows)

    def finish(self, theta: float, omega: float, time: float) -> None:
        """Write the sample that falls on the end of the run, if one does."""
        if self.written < self.times.size and self.times[self.written] <= time * (1.0 + 1e-12):
            self.rows[self.written] = theta, omega
            self.written += 1

    def loose(self) -> np.ndarray:
        """Return the loose gear's angle at the samples [rad], (n,), NaN at those that were not reached."""
        return np.where(np.arange(len(self.times)) < self.written, self.rows[:, 0], np.nan)

    def states(self) -> np.ndarray:
        """Return the loose gear's angle [rad] and speed [rad/s] at the samples that were reached, (n, 2)."""
        return self.rows[: self.written].copy()

    def signals(self, motion: np.ndarray, base_radii: tuple[float, float]) -> dict[str, np.ndarray]:
        """Return the columns of the recording, with base radii [m] of drive and loose gear."""
        times, loose = self.times[: self.written], self.rows[: self.written]
        drive = drive_samples(motion, times)
        of_drive, of_loose = base_radii
        return {
            "time_s": times,
            "theta_drive_rad": drive[:, 0],
            "theta_loose_rad": loose[:, 0],
            "omega_drive_rad_s": drive[:, 1],
            "omega_loose_rad_s": loose[:, 1],
            "displacement_m": of_loose * loose[:, 0] - of_drive * drive[:, 0],
            "velocity_m_s": of_loose * loose[:, 1] - of_drive * drive[:, 1],
        }

    def impact_columns(self) -> dict[str, np.ndarray]:
        """Return the impacts, column by column, each (k,)."""
        columns = {name: np.array([getattr(hit, name) for hit in self.impacts]) for name in Impact._fields}
        return {name: values for name, values in columns.items() if name not in HELICAL or np.isfinite(values).any()}
