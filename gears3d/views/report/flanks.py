"""Where the flanks stand over time, and how long the loose gear needs from one to the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.effects import Code, Flank, Gear
from gears3d.recording import FLANKS
from gears3d.signals import contacts as from_samples
from gears3d.signals import contacts_of, flights

if TYPE_CHECKING:
    from gears3d.effects import Row
    from gears3d.recording import Recording


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
    """Return the displacement of both flanks over time, from the flank deviations of the scenario."""
    shift = {Flank.ACTIVE: np.zeros(len(time)), Flank.REVERSE: np.zeros(len(time))}
    harmonics = [row.p for row in rows if row.code == Code.FLANK_HARMONIC and len(recording.time)]
    for gear, flank, order, amplitude, phase in harmonics:
        name = "theta_drive_rad" if Gear(int(gear)) is Gear.DRIVE else "theta_loose_rad"
        angle = np.interp(time, recording.time, recording.signals[name])
        shift[Flank(int(flank))] += amplitude * np.cos(order * angle + phase)
    complete = not any(row.code == Code.FLANK_TOOTH for row in rows)
    return Walls(shift[Flank.ACTIVE], backlash - shift[Flank.REVERSE], bool(harmonics), complete)


def contacts(recording: Recording, rows: tuple[Row, ...], backlash: float) -> np.ndarray | None:
    """Return the permanent contacts, [flank, start s, end s]: as written down, or as the samples show them."""
    if "contacts" not in recording.meta:
        if "displacement_m" not in recording.signals or not len(recording.time):
            return None
        ends = walls(recording, rows, backlash, recording.time)
        place = recording.signals["displacement_m"]
        return from_samples(recording.time, place, ends.active, ends.reverse, recording.impacts)
    return contacts_of(recording.signals, recording.impacts, recording.meta)[0]


def crossings(recording: Recording, table: np.ndarray, start: float) -> dict[str, np.ndarray]:
    """Return how long each flight across the backlash lasted and how fast it ended."""
    found = flights(recording.impacts["time_s"], recording.impacts["flank"], table)
    across = (found.left != found.struck) & (found.impact >= 0) & (found.start >= start)
    speeds = np.abs(np.append(recording.impacts["velocity_m_s"], np.nan))[found.impact]
    both = np.stack([found.end - found.start, speeds], axis=1)
    return {name: both[across & (found.struck == code)] for code, name in enumerate(FLANKS)}
