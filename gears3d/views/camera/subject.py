"""What stands before the camera, simulated or measured, and the instants at which it looks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import floor, pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.views.plots.section import Motion, Section, Shot, as_measured, is_measured, states

if TYPE_CHECKING:
    from collections.abc import Callable

    Places = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    from gears3d.gears import Pair
    from gears3d.measured.segmentation import Measurement
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

# Part of the backlash within which a flank is touched, where a recording does not tell its contacts.
NEAR = 1e-3


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


# Distance from the pitch point, in pitches, within which one pair is named; between two pairs both are.
BESIDE = 1.0 / 3.0


def shots(subject: Subject, count: int, start: float, lasts: float) -> tuple[Shot, ...]:
    """Return pictures evenly over a stretch of time, both ends included.

    Source: Rigaud & Perret-Liaudet 2020, fig. 8: nine pictures over a period, tooth pairs counted from the first.
    """
    begin, end = subject.span
    slack = 1e-9 * max(end, 1.0)
    if not (begin - slack <= start and start + lasts <= end + slack):
        what = f"is {start:.6g} to {start + lasts:.6g} s, the recording {begin:.6g} to {end:.6g} s"
        raise InputError(Fault("--at, --over", what, "film a part of the recording"))
    return shots_at(subject, np.clip(np.linspace(start, start + lasts, count), begin, end))


def shots_at(subject: Subject, time: np.ndarray) -> tuple[Shot, ...]:
    """Return pictures at given instants within the recording, ascending, (n,)."""
    drive = subject.motion.at(time, "theta_drive_rad")
    flank, (active, reverse) = subject.flank(time), subject.gaps(time)
    share = np.where(flank == 0, 0.0, np.where(flank == 1, 1.0, active / np.maximum(active + reverse, 1e-12)))
    place = drive * subject.pair.drive.teeth / (2.0 * pi)
    first = round(float(place[0])) - 1
    return tuple(
        Shot(float(t), float(t - time[0]), float(turn), float(part), int(one), (float(a), float(r)), -first,
             float(where) - first, named(float(where) - first))
        for t, turn, part, one, a, r, where in zip(time, drive, share, flank, active, reverse, place, strict=True)
    )  # fmt: skip


def named(place: float) -> tuple[int, ...]:
    """Return the numbers of the pairs in the middle of a picture.

    >>> named(12.2), named(6.5), named(29.9)
    ((12,), (6, 7), (30,))
    """
    below = floor(place)
    beside = place - below
    if beside <= BESIDE:
        return (below,)
    return (below + 1,) if beside >= 1.0 - BESIDE else (below, below + 1)


def told(pairs: tuple[int, ...]) -> str:
    """Return numbers of pairs as a picture has them.

    >>> told((6, 7)), told((12,))
    ('6–7', '12')
    """
    return "–".join(map(str, pairs))


def moment(shot: Shot, index: int, count: int, periods: float | None) -> str:
    """Return when a picture was taken, in parts of the period where it is one.

    >>> moment(Shot(0.1, 0.05, 0, 0, 0, (0, 0), 1, 1.0, (1,)), 3, 9, 1.0)
    't = 3T/8'
    """
    if periods is None or count < 2:
        return f"t = {1e3 * shot.after:.4g} ms"
    part = Fraction(periods).limit_denominator(1000) * Fraction(index, count - 1)
    if not part:
        return "t = 0"
    over = f"/{part.denominator}" if part.denominator > 1 else ""
    return f"t = {part.numerator if part.numerator > 1 else ''}T{over}"


def picture_table(subject: Subject, shot: Shot) -> dict[str, object]:
    """Return a picture as JSON can hold it."""
    drive, loose = ([(n - shot.first) % gear.teeth + 1 for n in shot.pairs] for gear in _gears(subject))
    return {
        "time_s": shot.time,
        "after_s": shot.after,
        "state": shot.state,
        "pairs": list(shot.pairs),
        "pair_at_pitch_point": shot.place,
        "teeth_drive": drive,
        "teeth_loose": loose,
        "gap_active_m": shot.gaps[0],
        "gap_reverse_m": shot.gaps[1],
    }


def _gears(subject: Subject) -> tuple:
    return subject.pair.drive, subject.pair.loose
