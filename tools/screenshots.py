"""Pictures for the README, painted by the real viewer from a run of the engine."""

from __future__ import annotations

import io
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

from gears3d.errors import GearsError
from gears3d.recording import REVERSE, Recording
from gears3d.scenario import load
from gears3d.simulation import simulate
from gears3d.views.replay import replay
from gears3d.views.replay.viewer import Headless

SCENARIO = "scenarios/rigaud-2020/fig5-20rpm.toml"
PLACE = "docs/pictures"
SIZE = (1600, 900)
TITLE_BAR = 36
PANEL = 470
LARGEST = 300_000
GREETING = 5.0
"""The viewer greets in a corner of its window for some seconds."""


def main(scenario: str = SCENARIO, place: str = PLACE) -> int:
    """Run the scenario, replay it and take the pictures."""
    question = load(scenario, {"run.duration": "1.7 s"})
    recording, twin = simulate(question), simulate(question, "rigid")
    folder = Path(place)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        film = replay(recording, question, twin, Path(scratch) / "replay.rrd")
        moments = story(recording, question.pair().backlash)
        with Headless(film, SIZE) as viewer:
            zone = [opened(viewer.picture(at, "/zone")) for at in moments]
            time.sleep(GREETING)
            whole = opened(viewer.picture(moments[-1]))
    save(whole.crop((0, TITLE_BAR, *whole.size)), folder / "replay.png")
    save(strip(zone), folder / "mesh-zone.png")
    return 0


def story(recording: Recording, backlash: float) -> list[float]:
    """Return a moment on the active flank, one half way across, and a hard impact on the reverse flank [s].

    The impact is the hardest of the middle third, so that the curves are filled on both sides of it.
    """
    impacts, gap = recording.impacts, recording.signals["displacement_m"]
    share = impacts["time_s"] / recording.time[-1]
    hits = np.flatnonzero((impacts["flank"] == REVERSE) & (share > 0.35) & (share < 0.7))
    hit = float(impacts["time_s"][hits[np.argmax(impacts["velocity_m_s"][hits])]])
    before = recording.time < hit
    half_way = float(recording.time[before & (gap < 0.5 * backlash)][-1])
    rest = float(recording.time[before & (gap < 1e-3 * backlash)][-1])
    return [rest - 0.02, half_way, hit + 5e-4]


def opened(png: bytes) -> Image.Image:
    return Image.open(io.BytesIO(png)).convert("RGB")


def strip(pictures: list[Image.Image]) -> Image.Image:
    """Lay the middles of pictures side by side."""
    height = pictures[0].height
    joined = Image.new("RGB", (len(pictures) * (PANEL + 6) - 6, height), "white")
    for place, picture in enumerate(pictures):
        left = (picture.width - PANEL) // 2
        joined.paste(picture.crop((left, 0, left + PANEL, height)), (place * (PANEL + 6), 0))
    return joined


def save(picture: Image.Image, path: Path) -> None:
    picture.quantize(200, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE).save(path, optimize=True)
    size = path.stat().st_size
    print(f"{path}  {picture.width} x {picture.height}  {size / 1e3:.0f} kB")
    if size > LARGEST:
        raise GearsError(f"{path} has {size} bytes, more than {LARGEST}")


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:]))
    except GearsError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
