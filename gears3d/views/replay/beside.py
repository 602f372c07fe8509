"""Three motions side by side in slow motion: measured, nominal model and extended model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gears3d.views.plots import colours
from gears3d.views.plots.motion import Motion, frames
from gears3d.views.plots.teeth import Section, widening
from gears3d.views.replay.lanes import Lane, arranged, draw, flanks
from gears3d.views.replay.layout import ABOUT, FRAMES_A_SECOND
from gears3d.views.replay.sdk import rr
from gears3d.views.replay.write import film

if TYPE_CHECKING:
    from gears3d.diagnosis.stretch import Stretch

NAMES = ("measured", "base", "extended")
"""Of the three, and of their entities."""
LINES = (colours.LINE, colours.TWIN, colours.EXTENDED)
WIDTHS = (1.5, 2.5, 6.0)
"""Width of the line of the extended model, which stays visible behind the measured one."""
_UM = 1e6


def beside(stretch: Stretch, causes: tuple[str, ...] = (), out: str | Path = "replay.rrd") -> Path:
    """Write a stretch of a record, the rig and the extended rig side by side as an animation for the rerun viewer."""
    target = Path(out)
    three = _three(stretch, causes)
    rate, time = three[0].motion.frame_rate(), stretch.measured.time
    curves = "Displacement between the flanks [um]: white measured, pink base, green extended"
    with film(target, arranged(three, curves, float(time[-1] - time[0]), rate)) as rec:
        for lane in three:
            draw(rec, lane)
        flanks(rec, three[2])
        rec.log(ABOUT, _about(stretch, three, causes, rate), static=True)
    return target


def _three(stretch: Stretch, causes: tuple[str, ...]) -> list[Lane]:
    recordings = stretch.measured, stretch.base, stretch.extended
    rigs = stretch.extended_rig, stretch.rig, stretch.extended_rig  # measured flanks are where the causes put them
    titles = ("Measured", "Base: nominal model", f"Extended: {' + '.join(causes) or 'nothing to add'}")
    pair = stretch.rig.pair()
    true, wide = Section(pair), Section(pair, widening(pair))
    motions = [
        Motion(recording, true, tuple(rig.rows()), near)
        for recording, rig, near in zip(recordings, rigs, stretch.near, strict=True)
    ]
    hits = [one.recording.impacts["time_s"] for one in motions[1:]]
    time = np.unique(np.concatenate([motions[0].frame_times(), *hits]))
    return [
        Lane(name, title, colour, width, motion, wide, frames(motion, time))
        for name, title, colour, width, motion in zip(NAMES, titles, LINES, WIDTHS, motions, strict=True)
    ]


def _about(stretch: Stretch, three: list[Lane], causes: tuple[str, ...], rate: float) -> rr.TextDocument:
    time, near = stretch.measured.time, stretch.near[0]
    wide = three[0].wide
    begun = (
        "during a free flight" if stretch.riding is None else f"on the {('active', 'reverse')[stretch.riding]} flank"
    )
    lines = [
        f"### {Path(stretch.name).name}, {time[0]:.4g} to {time[-1]:.4g} s",
        off(stretch),
        "Base (nominal model) and extended model start from the measured state at the beginning, "
        f"{begun}, and follow the measured motion of the drive; they are not corrected by the record later.",
        f"Added: {', '.join(causes) or 'no cause; the extended model equals the base'}.",
        f"- **Blue active flank, orange reverse flank, grey flight.** Backlash drawn {wide.factor:g} times as wide.",
        f"- Slow motion: 1 s takes {rate / FRAMES_A_SECOND:.0f} s.",
        f"- Measured flanks are drawn at the positions of the extended model; a gap below {near * _UM:.2g} um is "
        "shown as contact. Only impacts that are used for identification are shown.",
    ]
    return rr.TextDocument("\n\n".join(lines[:4]) + "\n" + "\n".join(lines[4:]), media_type=rr.MediaType.MARKDOWN)


def off(stretch: Stretch) -> str:
    """Return in one sentence the errors of nominal and extended model, relative to the measured displacement."""
    time, place = stretch.measured.time, stretch.measured.signals["displacement_m"]
    rest = [
        float(np.sqrt(np.mean((np.interp(time, one.time, one.signals["displacement_m"]) - place) ** 2))) * _UM
        for one in (stretch.base, stretch.extended)
    ]
    return f"Root mean square error of the displacement: base {rest[0]:.3g} um, extended {rest[1]:.3g} um."
