"""What the pictures show at which instant: frame times, the flanks' positions, and which flank touches."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects import Code

if TYPE_CHECKING:
    from gears3d.effects import Row
    from gears3d.gears import Pair
    from gears3d.recording import Recording
    from gears3d.views.plots.teeth import Section

FRAME_RATE = (500.0, 4000.0)
"""Frames per second of simulated time: at least, at most."""
FRAMES_PER_PITCH = 24
PLOT_RATE = 4000.0
"""Samples per second that plots keep away from impacts."""


@dataclass(frozen=True)
class Motion:
    """A recording together with the flanks it moves between.

    Args:
        recording: what moves.
        section: the teeth, for the contacts of the true pair.
        rows: the effects' normal forms; flank deviations among them move the flanks.
        near: gap below which noise lets flanks be shown as touching at least [m].
    """

    recording: Recording
    section: Section
    rows: tuple[Row, ...] = ()
    near: float = 0.0

    @cached_property
    def displacement(self) -> np.ndarray:
        """Displacement along the line of action at the samples [m], (n,)."""
        return self.recording.signals["displacement_m"]

    @cached_property
    def tolerance(self) -> float:
        """Gap below which flanks are shown as touching [m]."""
        return max(1e-3 * self.section.pair.backlash, 1e-7, self.near)

    def at(self, time: np.ndarray, name: str) -> np.ndarray:
        """Return a signal between its samples, (m,)."""
        return np.interp(time, self.recording.time, self.recording.signals[name])

    def frame_times(self) -> np.ndarray:
        """Return the instants of the pictures: a regular grid and every impact [s], ascending."""
        time = self.recording.time
        if len(time) < 2:
            return time.copy()
        grid = np.arange(time[0], time[-1], 1.0 / self.frame_rate())
        hits = self.recording.impacts["time_s"]
        return np.union1d(np.append(grid, time[-1]), hits[(hits >= time[0]) & (hits <= time[-1])])

    def frame_rate(self) -> float:
        """Return regular frames per second of simulated time, enough to see each tooth pass."""
        time, angle = self.recording.time, self.recording.signals["theta_drive_rad"]
        pitches = abs(angle[-1] - angle[0]) * self.section.pair.drive.teeth / (2.0 * np.pi)
        return float(np.clip(FRAMES_PER_PITCH * pitches / max(time[-1] - time[0], 1e-9), *FRAME_RATE))

    def plot_rows(self) -> np.ndarray:
        """Return the samples that plots keep: all near an impact, elsewhere about PLOT_RATE per second."""
        time = self.recording.time
        if len(time) < 3:
            return np.arange(len(time))
        step = max(round((len(time) - 1) / max(time[-1] - time[0], 1e-12) / PLOT_RATE), 1)
        keep = np.zeros(len(time), dtype=bool)
        keep[::step] = keep[-1] = True
        after = np.searchsorted(time, self.recording.impacts["time_s"])
        for offset in (-2, -1, 0, 1):
            keep[np.clip(after + offset, 0, len(time) - 1)] = True
        return np.flatnonzero(keep)

    def flanks(self, drive: np.ndarray, loose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the displacement at which the loose gear lies on its active and on its reverse flank [m]."""
        material = [np.zeros(len(drive)), np.zeros(len(drive))]
        angles = (drive, loose)
        teeth = [row.p for row in self.rows if row.code == Code.FLANK_TOOTH]
        for row in self.rows:
            if row.code == Code.FLANK_HARMONIC:
                gear, flank, order, amplitude, phase = row.p[:5]
                material[int(flank)] += amplitude * np.cos(order * angles[int(gear)] + phase)
        for flank in (0, 1):
            material[flank] += self._of_teeth(drive, flank, [p for p in teeth if int(p[1]) == flank])
        return material[0], self.section.pair.backlash - material[1]

    def _of_teeth(self, drive: np.ndarray, flank: int, rows: list[tuple[float, ...]]) -> np.ndarray:
        """Largest deviation among the tooth pairs on the path of contact."""
        if not rows:
            return np.zeros(len(drive))
        pair = self.section.pair
        row, tooth, _ = self.section.touching(drive, np.full(len(drive), flank))
        excess = np.zeros(len(tooth))
        for gear, _flank, number, offset in (p[:4] for p in rows):
            teeth = (pair.drive, pair.loose)[int(gear)].teeth
            excess += np.where(np.mod(tooth, teeth) == int(number) - 1, offset, 0.0)
        most = np.full(len(drive), -np.inf)
        np.maximum.at(most, row, excess)
        return np.where(np.isfinite(most), most, 0.0)


@dataclass(frozen=True)
class Frames:
    """The pair at the instants of the pictures.

    Args:
        time: [s], (n,).
        drive: angle of the drive gear [rad], (n,).
        loose: angle of the loose gear [rad], (n,).
        share: displacement from the active flank as a share of the backlash, 0 active to 1 reverse, (n,).
        flank: 0 active or 1 reverse flank touches, -1 flight, (n,).
    """

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    share: np.ndarray
    flank: np.ndarray


def frames(motion: Motion, time: np.ndarray | None = None) -> Frames:
    """Return the pair at every instant that is shown."""
    time = motion.frame_times() if time is None else time
    drive, loose = (motion.at(time, f"theta_{gear}_rad") for gear in ("drive", "loose"))
    displacement = motion.at(time, "displacement_m")
    active, reverse = motion.flanks(drive, loose)
    flank = states(displacement, active, reverse, motion.tolerance)
    if "state" in motion.recording.signals:
        flank = _recorded(motion.recording, time)
    impacts = motion.recording.impacts
    here = np.searchsorted(time, impacts["time_s"])
    inside = (here < len(time)) & (time[np.minimum(here, len(time) - 1)] == impacts["time_s"])
    flank[here[inside]] = impacts["flank"][inside]
    share = np.clip((displacement - active) / np.maximum(reverse - active, 1e-12), 0.0, 1.0)
    share = np.where(flank == 0, 0.0, np.where(flank == 1, 1.0, share))
    return Frames(time, drive, loose, share, flank)


def _recorded(recording: Recording, time: np.ndarray) -> np.ndarray:
    """Return the state that a measurement wrote down at the nearest sample: 0 active, 1 reverse, -1 flight, (n,)."""
    own = recording.time
    after = np.clip(np.searchsorted(own, time), 1, len(own) - 1)
    nearest = after - (time - own[after - 1] < own[after] - time)
    state = recording.signals["state"][nearest]
    return np.where(state == 0, 0, np.where(state == 1, 1, -1))


def is_measured(recording: Recording) -> bool:
    """Return whether a recording was measured: effects of a rig's scenario have no known phase in it."""
    return recording.meta.get("model") == "measured"


def as_measured(pair: Pair, recording: Recording) -> Pair:
    """Return a pair with the backlash that a measurement found, by thinner or thicker teeth; others as they are."""
    found = recording.meta.get("backlash_m")
    if not is_measured(recording) or not found or found <= 0.0:
        return pair
    return replace(pair, thinning=pair.thinning + 0.5 * (found - pair.backlash))


def states(displacement: np.ndarray, active: np.ndarray, reverse: np.ndarray, tolerance: float) -> np.ndarray:
    """Return which flank touches: 0 active, 1 reverse, -1 none, (n,).

    >>> import numpy as np
    >>> states(np.array([0.0, 5e-5, 1e-4]), np.zeros(3), np.full(3, 1e-4), 1e-6).tolist()
    [0, -1, 1]
    """
    return np.where(displacement - active <= tolerance, 0, np.where(reverse - displacement <= tolerance, 1, -1))
