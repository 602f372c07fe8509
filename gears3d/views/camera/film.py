"""The film: what the camera sees at thousands of frames a second, slowed by a stated factor."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError, UsageError
from gears3d.extras import require
from gears3d.files import replacing
from gears3d.views.camera.strip import source
from gears3d.views.camera.subject import shots, told
from gears3d.views.plots.panel import WORDS, Shot, colour_of, name, paint

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.views.camera.subject import Subject
    from gears3d.views.plots.panel import Look

LARGE, SMALL = (1280, 800), (640, 400)
"""Pixels of a frame: as the camera of Rigaud & Perret-Liaudet 2020 has them up to 3200 frames a second, and beyond."""
FULL_RATE = 3200.0
"""Frames a second up to which frames are large."""
SHOWN = 25.0
"""Frames a second of a film that nobody asked another speed of."""
PLAYED = (1.0, 120.0)
"""Frames a second that players show."""
PYAV = ("av", "a film (--video)", "video")
"""What the encoder is, what needs it, and the extra that installs it."""
COLOURS = 64
"""Colours of a GIF."""
MOST = 20_000
"""Frames of a film at most."""


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
    if not PLAYED[0] <= played <= PLAYED[1]:
        low, high = (rate / one for one in reversed(PLAYED))
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
