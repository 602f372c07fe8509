"""The film, what the camera sees at thousands of frames a second, slowed; and the tour, which stops at each event."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError, UsageError
from gears3d.extras import require
from gears3d.files import replacing
from gears3d.recording import FLANKS
from gears3d.views.camera.strip import source
from gears3d.views.camera.subject import shots, shots_at, told
from gears3d.views.plots.section import WORDS, Look, Shot, colour_of, name, paint

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.views.camera.subject import Subject

# Pixels of a frame: as the camera of Rigaud & Perret-Liaudet 2020 has them up to 3200 frames a second, and beyond.
LARGE, SMALL = (1280, 800), (640, 400)
# Frames a second up to which frames are large.
FULL_RATE = 3200.0
# Frames a second of a film that nobody asked another speed of.
SHOWN = 25.0
# Frames a second.
SHOWN_BY_PLAYERS = (1.0, 120.0)
# What the encoder is, what needs it, and the extra that installs it.
PYAV = ("av", "a film (--video)", "video")
# Colours of a GIF.
COLOURS = 64
# Frames of a film at most.
MOST = 20_000


def write_film(
    path: str | Path,
    subject: Subject,
    look: Look,
    span: tuple[float, float],
    rate: float = FULL_RATE,
    slow: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> dict[str, Any]:
    """Write a film of a stretch of time as MP4 (H.264).

    Args:
        path: ends in ``.mp4``.
        subject: what is filmed.
        look: of the camera.
        span: time of the first frame, and how long is filmed [s].
        rate: frames a second of the camera [Hz].
        slow: times slower than it was; ``None`` for 25 frames a second.
        progress: called now and then with the number of frames that are done.

    Returns:
        ``video``, ``camera_Hz``, ``slowed``, ``played_Hz``, ``frames``, ``size``, as JSON can hold them.

    Raises:
        UsageError: another ending.
        MissingExtraError: PyAV is not installed.
        InputError: a stretch outside the recording, a film too long, or a file that cannot be written.
    """
    place = check_ending(path, ".mp4")
    slowed = rate / SHOWN if slow is None else slow
    played, count = rate / slowed, int(span[1] * rate + 1e-9) + 1
    _refuse(played, count, rate)
    pictures = shots(subject, count, span[0], (count - 1) / rate)
    size = LARGE if rate <= FULL_RATE else SMALL
    about = f"{rate:g} frames a second\nslowed {slowed:g} times"
    write_pictures(place, subject, look, pictures, played, about, (), progress, size)
    return {"video": str(place), "camera_Hz": rate, "slowed": slowed, "played_Hz": played, "frames": count,
            "size": list(size)}  # fmt: skip


def check_ending(path: str | Path, *endings: str) -> Path:
    """Return the path of a film; refuse another ending, and an encoder that is missing."""
    place = Path(path)
    if place.suffix.lower() not in endings:
        raise UsageError(f"{path}: the file name must end in {' or '.join(endings)}")
    if place.suffix.lower() == ".mp4":
        require(*PYAV)
    return place


def write_pictures(
    place: Path,
    subject: Subject,
    look: Look,
    pictures: tuple[Shot, ...],
    played: float,
    about: str,
    captions: Sequence[str] = (),
    progress: Callable[[float], None] | None = None,
    size: tuple[int, int] | None = None,
) -> None:
    """Write pictures as a film, MP4 or GIF by the ending, with a line about its speed and a caption below each."""
    size = size or (SMALL if place.suffix.lower() == ".gif" else LARGE)
    frames = _frames(subject, look, pictures, size, about, captions)
    with replacing(place) as unfinished:
        encode = _write_gif if place.suffix.lower() == ".gif" else _write
        encode(unfinished, _watched(frames, progress), size, played)


def _watched(frames: Iterator[np.ndarray], progress: Callable[[float], None] | None) -> Iterator[np.ndarray]:
    for done, frame in enumerate(frames):
        yield frame
        if progress is not None and done % 10 == 0:
            progress(float(done))


def _write(path: Path, frames: Iterator[np.ndarray], size: tuple[int, int], played: float) -> None:
    """Encode frames into a file; errors of the encoder are of type OSError already."""
    av = require(*PYAV)
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as film:
        stream = film.add_stream("libx264", rate=Fraction(played).limit_denominator(1000))
        stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        stream.options = {"crf": "20", "preset": "veryfast"}
        for frame in frames:
            film.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        film.mux(stream.encode())


def _write_gif(path: Path, frames: Iterator[np.ndarray], size: tuple[int, int], played: float) -> None:
    """Write frames as a GIF that repeats; equal ones in a row become one that lasts longer."""
    from PIL import Image

    step, lasts, kept = round(1000.0 / played), [], []
    last: np.ndarray | None = None
    for frame in frames:
        if last is not None and np.array_equal(frame, last):
            lasts[-1] += step
            continue
        kept.append(Image.fromarray(frame).quantize(COLOURS, dither=Image.Dither.NONE))
        lasts.append(step)
        last = frame.copy()
    kept[0].save(path, format="GIF", save_all=True, append_images=kept[1:], duration=lasts, loop=0, optimize=True)


def _refuse(played: float, count: int, rate: float) -> None:
    if not SHOWN_BY_PLAYERS[0] <= played <= SHOWN_BY_PLAYERS[1]:
        low, high = (rate / one for one in reversed(SHOWN_BY_PLAYERS))
        what = f"would be shown at {played:.4g} frames a second"
        raise InputError(Fault("--slow", what, f"give {low:.4g} to {high:.4g}"))
    if count > MOST:
        raise InputError(
            Fault("--over", f"takes {count} frames, more than {MOST}", "film less, or with a smaller --rate")
        )


def _frames(
    subject: Subject, look: Look, pictures: tuple[Shot, ...], size: tuple[int, int], about: str, captions: Sequence[str]
) -> Iterator[np.ndarray]:
    """Yield the frames as RGB pixels, (height, width, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    scale = size[0] / LARGE[0]
    figure = Figure(figsize=(LARGE[0] / 100, LARGE[1] / 100), dpi=100 * scale, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    stage = figure.add_axes((0.0, 0.0, LARGE[1] * 1.25 / LARGE[0], 1.0))
    beside = _beside(figure, subject, look, pictures, about)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)  # type: ignore[attr-defined]
    frame = np.zeros(0, dtype=np.uint8)
    shown: tuple[Shot | None, str] = (None, "")
    for shot, caption in zip(pictures, captions or [""] * len(pictures), strict=True):
        if (shot, caption) == shown:  # the film stops
            yield frame
            continue
        for artist in (*stage.lines, *stage.patches, *stage.texts, *stage.images):
            artist.remove()
        paint(stage, look, shot, 1.6)
        name(stage, look)
        canvas.restore_region(still)  # type: ignore[attr-defined]
        stage.draw(canvas.renderer)
        _now(beside, shot, caption)
        for text in beside.values():
            figure.draw_artist(text)
        frame, shown = np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3]), (shot, caption)
        yield frame


def _beside(figure: Figure, subject: Subject, look: Look, pictures: tuple[Shot, ...], speed: str) -> dict[str, Any]:
    """Write the constant texts next to the picture and return those that change."""
    left, high = 0.80, 0.94
    scale = "gap at true scale" if look.factor == 1.0 else f"gap drawn {look.factor:g} times as wide"
    about = [*speed.split("\n"), scale, source(subject)]
    if not subject.placed:
        about.append("tooth positions are not recorded")
    figure.text(left, high, _broken(subject.title or "Gears in mesh", 27), fontsize=12, fontweight="bold", va="top")
    figure.text(
        left,
        0.06,
        "\n".join(_broken(line, 26) for line in about),
        fontsize=11,
        color="#444444",
        va="bottom",
        linespacing=1.5,
    )
    course = figure.add_axes((left + 0.035, 0.26, 0.15, 0.22))
    time = np.linspace(pictures[0].time, pictures[-1].time, 1000)
    active, reverse = subject.gaps(time)
    flank, after = subject.flank(time), 1e3 * (time - time[0])
    for code in (0, 1, -1):
        course.plot(after, np.where(flank == code, 1e6 * active, np.nan), color=colour_of(code), linewidth=2.0)
    course.plot(after, 1e6 * (active + reverse), color=colour_of(1), linewidth=0.7)
    course.set_title("gap at the active flanks [µm]", fontsize=9, loc="left")
    course.set_xlabel("time [ms]", fontsize=9)
    course.tick_params(labelsize=8)
    course.spines[["top", "right"]].set_visible(False)
    (cursor,) = course.plot([], [], "o", color="white", markeredgecolor="black", markersize=7, animated=True, zorder=9)
    words = {
        word: figure.text(left, high - down, "", fontsize=size, va="top", animated=True)
        for word, down, size in (("time", 0.16, 16), ("state", 0.22, 14), ("pairs", 0.27, 14), ("gaps", 0.32, 12))
    }
    back = {"boxstyle": "square,pad=0.4", "linewidth": 0, "facecolor": "white", "alpha": 0.85}
    words["caption"] = figure.text(0.39, 0.105, "", fontsize=15, ha="center", va="center", animated=True, bbox=back)
    return {**words, "cursor": cursor}


def _broken(text: str, width: int) -> str:
    return "\n".join(textwrap.wrap(text, width))


def _now(beside: dict[str, Any], shot: Shot, caption: str) -> None:
    ink = "#666666" if shot.flank < 0 else colour_of(shot.flank)
    beside["time"].set_text(f"{1e3 * shot.after:.2f} ms")
    beside["state"].set(text=WORDS[shot.flank], color=ink)
    pairs = f"tooth pair {told(shot.pairs)}" if len(shot.pairs) == 1 else f"tooth pairs {told(shot.pairs)}"
    beside["pairs"].set_text(pairs)
    active, reverse = (1e6 * gap for gap in shot.gaps)
    beside["gaps"].set_text("" if shot.flank >= 0 else f"gaps {active:.0f} + {reverse:.0f} µm")
    beside["caption"].set_text(_broken(caption, 62))
    beside["cursor"].set_data([1e3 * shot.after], [1e6 * shot.gaps[0]])
    beside["cursor"].set_markeredgecolor(ink)


# Pictures a second by the ending of the file.
PLAYED = {".mp4": 25.0, ".gif": 10.0}
# Time that the period takes, without the stops [s].
LASTS = 12.0
# Time that the tour stops at an event [s].
STOPS = {"contact loss": 1.6, "flight": 0.0, "impact": 1.6, "bounce": 0.8, "contact": 1.6}
# Bounces on a flank at which it stops; further ones are seen in passing.
FEW = 2
# Instants at which the state is looked up.
POINTS = 8000
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
