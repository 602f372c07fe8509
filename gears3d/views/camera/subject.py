"""What stands before the camera: a pair of gears and how it moved, simulated or measured."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.views.plots.motion import Motion, as_measured, is_measured, states
from gears3d.views.plots.teeth import Section

if TYPE_CHECKING:
    from collections.abc import Callable

    from gears3d.gears import Pair
    from gears3d.measured.segmentation import Measurement
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

    Places = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

NEAR = 1e-3
"""Part of the backlash within which a flank is touched, where a recording does not tell its contacts."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A pair of gears and its motion.

    Args:
        motion: the recording and its flanks.
        pair: as it is drawn, without deviations of flanks and axes, which are too small to see.
        period: of the excitation [s].
        settle: time that is left out at the beginning [s].
        title: first line of a picture.
        placed: whether the record tells where the teeth stand; where not, tooth 1 begins at the pitch point.
        places: displacement of both flanks [m] over time [s]; the motion's own if none.
    """

    motion: Motion
    pair: Pair
    period: float
    settle: float = 0.0
    title: str = ""
    placed: bool = True
    places: Places | None = None

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the recording [s]."""
        time = self.motion.recording.time
        return float(time[0]), float(time[-1])

    @property
    def revolution(self) -> float:
        """Mean time of a revolution of the drive gear [s]."""
        time, angle = self.motion.recording.time, self.motion.recording.signals["theta_drive_rad"]
        return float(2.0 * np.pi * (time[-1] - time[0]) / max(abs(angle[-1] - angle[0]), 1e-12))

    @cached_property
    def contacts(self) -> np.ndarray:
        """Permanent contacts that were written down: flank, start [s], end [s], (c, 3)."""
        return np.array(self.motion.recording.meta.get("contacts") or []).reshape(-1, 3)

    def gaps(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the gaps at the active and at the reverse flank [m], never below 0, each (n,)."""
        drive, loose, place = (self.motion.at(time, name) for name in _NAMES)
        if self.places is None:
            active, reverse = self.motion.flanks(drive, loose)
        else:
            active, reverse = self.places(time)
            reverse = np.where(np.isfinite(reverse), reverse, active + self.pair.backlash)
        return np.maximum(place - active, 0.0), np.maximum(reverse - place, 0.0)

    def flank(self, time: np.ndarray) -> np.ndarray:
        """Return which flank touches: 0 active, 1 reverse, -1 none, (n,)."""
        if not len(self.contacts):
            active, reverse = self.gaps(time)
            return states(active, np.zeros(len(time)), active + reverse, NEAR * self.pair.backlash)
        found = np.full(len(time), -1)
        for flank, start, end in self.contacts:
            found[(time >= start) & (time <= end)] = int(flank)
        return found

    def begin(self, lasts: float) -> float:
        """Return when to begin where nobody says: during a contact with the active flank, after settling."""
        first, last = self.span
        latest = max(last - lasts, first)
        settled = min(first + self.settle, latest)
        for flank, start, end in self.contacts:
            middle = 0.5 * (start + end)
            if flank == 0 and settled <= middle <= latest and start > first:
                return float(middle)
        return settled


_NAMES = ("theta_drive_rad", "theta_loose_rad", "displacement_m")


def subject(recording: Recording, scenario: Scenario) -> Subject:
    """Return a recording of a model, or the folder that ``gears3d segment`` wrote, as something to film."""
    if len(recording.time) < 2:
        raise InputError(Fault("", "has no samples"))
    pair = scenario.pair()
    if "displacement_m" not in recording.signals:
        recording = recording.with_base_radii(pair.drive.base_radius, pair.loose.base_radius)
    drawn = replace(as_measured(pair, recording), deviations=(), mounting=())
    motion = Motion(recording, Section(drawn), () if is_measured(recording) else tuple(scenario.rows()))
    return Subject(
        motion,
        drawn,
        scenario.period,
        0.0 if is_measured(recording) else scenario.run.settle,
        scenario.title,
        recording.meta.get("teeth_from") != "record",
    )


def measured(found: Measurement, rig: Scenario) -> Subject:
    """Return a measured record as something to film, its flanks where the measurement has them."""
    seen = subject(found.recording, rig)
    cut = found.segments
    zero = float(cut.flanks.active[0])

    def places(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        low, high = cut.flanks.places(time, *cut.track.angles(time))
        return low - zero, high - zero

    return replace(seen, places=places)
