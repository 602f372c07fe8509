"""The instants at which the camera looks, and what is to be seen then."""

from __future__ import annotations

from fractions import Fraction
from math import floor, pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.views.plots.panel import Shot

if TYPE_CHECKING:
    from gears3d.views.camera.subject import Subject

BESIDE = 1.0 / 3.0
"""Distance from the pitch point, in pitches, within which one pair is named; between two pairs both are."""


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


def table(subject: Subject, shot: Shot) -> dict[str, object]:
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
