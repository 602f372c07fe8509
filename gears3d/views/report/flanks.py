"""Where the flanks stand over time, and how long the loose gear needs from one to the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.effects import Code, Flank, Gear
from gears3d.recording import FLANKS
from gears3d.signals import states

if TYPE_CHECKING:
    from gears3d.effects import Row
    from gears3d.recording import Recording

NEAR = 0.1e-6
"""Closer to a flank than this counts as touching it [m]."""


class Walls(NamedTuple):
    """The two ends of the dead band.

    Args:
        active: displacement at which the active flanks touch [m], (n,).
        reverse: displacement at which the reverse flanks touch [m], (n,).
        moving: whether any flank deviates from the involute.
        complete: false when single teeth deviate, which the two lines leave out.
    """

    active: np.ndarray
    reverse: np.ndarray
    moving: bool
    complete: bool


def walls(recording: Recording, rows: tuple[Row, ...], backlash: float, time: np.ndarray) -> Walls:
    """Return the displacement of both flanks over time, from the flank deviations of the scenario.

    Args:
        recording: gives the angles of both gears.
        rows: of the scenario's effects.
        backlash: width of the dead band of perfect flanks [m].
        time: where to say it [s], (n,).
    """
    shift = {Flank.ACTIVE: np.zeros(len(time)), Flank.REVERSE: np.zeros(len(time))}
    harmonics = [row.p for row in rows if row.code == Code.FLANK_HARMONIC and len(recording.time)]
    for gear, flank, order, amplitude, phase in harmonics:
        name = "theta_drive_rad" if Gear(int(gear)) is Gear.DRIVE else "theta_loose_rad"
        angle = np.interp(time, recording.time, recording.signals[name])
        shift[Flank(int(flank))] += amplitude * np.cos(order * angle + phase)
    complete = not any(row.code == Code.FLANK_TOOTH for row in rows)
    return Walls(shift[Flank.ACTIVE], backlash - shift[Flank.REVERSE], bool(harmonics), complete)


def crossings(recording: Recording, state: np.ndarray, start: float) -> dict[str, np.ndarray]:
    """Return how long each flight across the backlash lasted and how fast it ended.

    A crossing ends with the first impact after one on the other flank; it begins where the gear last touched the
    flank that it left.

    Args:
        recording: with impacts.
        state: of the samples, as :func:`gears3d.signals.states` gives them, (n,).
        start: what is earlier than this is left out [s].

    Returns:
        By ``"active"`` and ``"reverse"``, the flank that was struck: duration [s] and impact speed [m/s], (k, 2).
    """
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in FLANKS}
    flank, hits, time = recording.impacts["flank"], recording.impacts["time_s"], recording.time
    latest = [np.maximum.accumulate(np.where(state == code, np.arange(len(state)), -1)) for code in (0, 1)]
    for k in np.flatnonzero(np.diff(flank)) + 1:
        left = int(latest[1 - flank[k]][max(int(np.searchsorted(time, hits[k])) - 1, 0)])
        if left >= 0 and hits[k] >= start:
            begin = max(float(time[left]), float(hits[k - 1]))
            found[FLANKS[flank[k]]].append((float(hits[k]) - begin, abs(float(recording.impacts["velocity_m_s"][k]))))
    return {name: np.array(values).reshape(-1, 2) for name, values in found.items()}


def touching(recording: Recording, rows: tuple[Row, ...], backlash: float) -> np.ndarray | None:
    """Return the state of every sample (0 active, 1 reverse, 2 flight), ``None`` without a displacement.

    Args:
        recording: with displacement.
        rows: of the scenario's effects.
        backlash: m.
    """
    if "displacement_m" not in recording.signals or not len(recording.time):
        return None
    ends = walls(recording, rows, backlash, recording.time)
    return states(recording.signals["displacement_m"], ends.active, ends.reverse, NEAR)
