"""The tour: one period in slow motion that stops at each event and says what happens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.recording import FLANKS
from gears3d.views.camera.film import check_ending, write_pictures
from gears3d.views.camera.subject import shots_at
from gears3d.views.plots.panel import Look

if TYPE_CHECKING:
    from gears3d.views.camera.subject import Subject

PLAYED = {".mp4": 25.0, ".gif": 10.0}
"""Pictures a second by the ending of the file."""
LASTS = 12.0
"""Time that the period takes, without the stops [s]."""
STOPS = {"contact loss": 1.6, "flight": 0.0, "impact": 1.6, "bounce": 0.8, "contact": 1.6}
"""Time that the tour stops at an event [s]."""
FEW = 2
"""Bounces on a flank at which it stops; further ones are seen in passing."""
POINTS = 8000
"""Instants at which the state is looked up."""
NO_PERIOD = "the recording is shorter than the begin of a tour"


class Event(NamedTuple):
    """What happens from an instant on.

    Args:
        time: [s].
        kind: ``contact loss``, ``flight``, ``impact``, ``bounce`` or ``contact``.
        words: caption.
        stops: time that the tour stops there [s].
    """

    time: float
    kind: str
    words: str
    stops: float


def events(subject: Subject, start: float, lasts: float) -> list[Event]:
    """Return what happens over a stretch of time, the state at its begin first."""
    time = np.linspace(start, start + lasts, POINTS)
    state, impacts = subject.flank(time), subject.motion.recording.impacts
    struck = np.flatnonzero((impacts["time_s"] >= time[0]) & (impacts["time_s"] <= time[-1]))
    marks = [(float(impacts["time_s"][k]), "impact", int(k)) for k in struck]
    marks += [(float(time[k + 1]), "state", k + 1) for k in np.flatnonzero(np.diff(state))]
    found = [_begin(float(time[0]), int(state[0]))]
    left, bounces = int(state[0]), 0
    for when, what, k in sorted(marks):
        if what == "impact":
            flank, speed = int(impacts["flank"][k]), 1e3 * abs(float(impacts["velocity_m_s"][k]))
            bounces = bounces + 1 if flank == left else 0
            found.append(_impact(when, flank, speed, float(impacts["rebound_m_s"][k]), bounces))
            left = flank
        elif state[k] < 0 and state[k - 1] >= 0:
            left, bounces = int(state[k - 1]), 0
            found.append(_loss(when, left))
            gap = 1e6 * subject.pair.backlash
            words = f"Free flight: only the drag acts on the loose gear in the gap of {gap:.4g} µm."
            found.append(Event(when + STOPS["contact loss"] * 1e-9, "flight", words, 0.0))
        elif state[k] >= 0:
            left, bounces = int(state[k]), 0
            found.append(_begin(when, left))
    return found


def _begin(when: float, flank: int) -> Event:
    if flank < 0:
        return Event(when, "flight", "Free flight: only the drag acts on the loose gear.", 0.0)
    pushes = "the drive gear accelerates the loose gear" if flank == 0 else "the drive gear decelerates the loose gear"
    return Event(when, "contact", f"Contact: the {FLANKS[flank]} flanks touch; {pushes}.", STOPS["contact"])


def _loss(when: float, flank: int) -> Event:
    slows = "the drive gear decelerates faster than the drag decelerates the loose gear"
    why = slows if flank == 0 else "the drive gear accelerates again"
    return Event(when, "contact loss", f"Loss of contact on the {FLANKS[flank]} flank: {why}.", STOPS["contact loss"])


def _impact(when: float, flank: int, speed: float, rebound: float, bounces: int) -> Event:
    after = f", rebound {1e3 * abs(rebound):.3g} mm/s" if np.isfinite(rebound) else ""
    if not bounces:
        words = f"Impact on the {FLANKS[flank]} flank at {speed:.3g} mm/s{after}."
        return Event(when, "impact", words, STOPS["impact"])
    words = f"Bounce {bounces} on the {FLANKS[flank]} flank: impact at {speed:.3g} mm/s{after}."
    return Event(when, "bounce", words, STOPS["bounce"] if bounces <= FEW else 0.0)


def stretch(subject: Subject) -> tuple[float, float]:
    """Return begin and length of the period that a tour shows [s]; all of a recording that is shorter."""
    first, last = subject.span
    lasts = min(subject.period, last - first)
    if not lasts > 0.0:
        raise InputError(Fault("--tour", NO_PERIOD, "record at least one period"))
    return subject.begin(lasts), lasts


def write_tour(
    path: str | Path, subject: Subject, look: Look | None = None, progress: Callable[[float], None] | None = None
) -> dict[str, Any]:
    """Write one period in slow motion with captions as MP4 or GIF; it stops at contact loss, impacts and contact.

    Args:
        path: ends in ``.mp4`` or ``.gif``.
        subject: what is filmed, simulated or measured.
        look: of the camera; by default that of its pictures.
        progress: called now and then with the number of frames that are done.

    Returns:
        ``video``, ``slowed``, ``played_Hz``, ``frames``, ``start_s``, ``lasts_s``, and ``captions`` (``time_s``,
        ``kind``, ``words``), as JSON can hold them.

    Raises:
        UsageError: another ending.
        MissingExtraError: PyAV is not installed, for MP4.
        InputError: the recording is empty, or the file cannot be written.
    """
    place = check_ending(path, *PLAYED)
    played = PLAYED[place.suffix.lower()]
    start, lasts = stretch(subject)
    told = events(subject, start, lasts)
    times, captions = zip(*_times(told, start, lasts, played), strict=True)
    look, slowed = look or Look(subject.pair), LASTS / lasts
    about = f"slowed {slowed:.3g} times, stops at each event"
    write_pictures(place, subject, look, shots_at(subject, np.array(times)), played, about, captions, progress)
    return {
        "video": str(place), "slowed": slowed, "played_Hz": played, "frames": len(times), "start_s": start,
        "lasts_s": lasts,
        "captions": [{"time_s": one.time, "kind": one.kind, "words": one.words} for one in told],
    }  # fmt: skip


def _times(told: list[Event], start: float, lasts: float, played: float) -> Iterator[tuple[float, str]]:
    """Yield the instant and the caption of every picture."""
    grid = np.linspace(start, start + lasts, round(LASTS * played) + 1)
    next_, caption = 0, ""
    for time in grid:
        while next_ < len(told) and told[next_].time <= time:
            caption = told[next_].words
            for _ in range(round(told[next_].stops * played)):
                yield told[next_].time, caption
            next_ += 1
        yield float(time), caption
