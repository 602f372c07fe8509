"""Several recordings on one time line: runs side by side, and side by side with measured records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.errors import InputError, UsageError
from gears3d.recording import Recording
from gears3d.views.plots import colours
from gears3d.views.plots.motion import Motion, as_measured, frames, is_measured
from gears3d.views.plots.teeth import Section, widening
from gears3d.views.replay.about import motion_words
from gears3d.views.replay.lanes import Lane, arranged, draw, flanks
from gears3d.views.replay.layout import ABOUT, FRAMES_A_SECOND
from gears3d.views.replay.poincare import ROOT, poincare, view
from gears3d.views.replay.sdk import require_rerun, rr
from gears3d.views.replay.write import film

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

LINES = {"white": colours.LINE, "pink": colours.TWIN, "green": colours.EXTENDED, "yellow": colours.FOURTH}
MOST = len(LINES)
"""Recordings side by side."""
WIDTHS = (5.0, 3.5, 2.0, 1.0)
"""Of the lines; later ones cover earlier ones where they agree."""
SAME_PERIOD = 1e-3
"""Relative difference of periods of which one phase can be taken for the other's."""


class Shown(NamedTuple):
    """A recording to be shown side by side with others.

    Args:
        name: what it is called.
        recording: simulated or measured.
        scenario: what was simulated, or the rig.
    """

    name: str
    recording: Recording
    scenario: Scenario


def several(shown: Sequence[Shown], out: str | Path = "replay.rrd") -> Path:
    """Write recordings side by side as an animation for the rerun viewer: mesh zones, displacements, sections.

    What was measured does not know when its fluctuation began: it is shown by at most half a period earlier or later,
    so that its drive is in phase with that of the first simulated recording.
    """
    require_rerun()
    if not 2 <= len(shown) <= MOST:
        raise UsageError(f"replay shows 2 to {MOST} recordings side by side, not {len(shown)}")
    for one in shown:
        if not len(one.recording.time):
            raise InputError(f"{one.name}: the recording is empty")
    shown, later = _in_phase(shown)
    lanes = [_lane(k, one) for k, one in enumerate(shown)]
    rate = max(lane.motion.frame_rate() for lane in lanes)
    rows = [lane.motion.plot_rows() for lane in lanes]
    speeds = [np.abs(np.nan_to_num(one.recording.impacts["velocity_m_s"])) for one in shown]
    reach = 1e3 * max((float(speed.max()) for speed in speeds if len(speed)), default=0.0)
    hit = [lane for lane, speed in zip(lanes, speeds, strict=True) if len(speed)]
    sections = [view(f"{ROOT}/{lane.name}", f"Poincaré: {lane.title}") for lane in hit]
    curves = "Displacement between the flanks [um]: " + ", ".join(
        f"{colour} {one.name}" for colour, one in zip(LINES, shown, strict=False)
    )
    window = min(3.0 * shown[0].scenario.period, max(float(np.ptp(one.recording.time)) for one in shown))
    target = Path(out)
    with film(target, arranged(lanes, curves, window, rate, sections)) as rec:
        known: list[tuple] = []
        for lane, one, kept in zip(lanes, shown, rows, strict=True):
            draw(rec, lane, kept)
            poincare(rec, one.recording, one.scenario.period, f"{ROOT}/{lane.name}", reach)
            its = (round(lane.motion.section.pair.backlash * 1e7), lane.motion.rows)
            if its not in known:
                known.append(its)
                flanks(rec, lane, f"{lane.name}_", kept)
        rec.log(ABOUT, _about(shown, later, lanes[0].wide.factor, rate), static=True)
    return target


def _lane(number: int, one: Shown) -> Lane:
    pair = as_measured(one.scenario.pair(), one.recording)
    recording = one.recording
    if "displacement_m" not in recording.signals:
        recording = recording.with_base_radii(pair.drive.base_radius, pair.loose.base_radius)
    rows = () if is_measured(recording) else tuple(one.scenario.rows())
    motion = Motion(recording, Section(pair), rows)
    colour = list(LINES.values())[number]
    return Lane(
        f"run_{number + 1}", one.name, colour, WIDTHS[number], motion, Section(pair, widening(pair)), frames(motion)
    )


def _in_phase(shown: Sequence[Shown]) -> tuple[list[Shown], list[float]]:
    """Return the recordings, measured ones in phase with the others, and how much later each is shown [s]."""
    first = next((one for one in shown if not is_measured(one.recording)), shown[0])
    known = _phase(first)
    moved, later = [], []
    for one in shown:
        own, wait = _phase(one), 0.0
        period = first.scenario.period
        alike = abs(one.scenario.period / period - 1.0) < SAME_PERIOD
        if one is not first and is_measured(one.recording) and alike and own is not None and known is not None:
            wait = float(np.angle(np.exp(1j * (own - known)))) / (2.0 * np.pi) * period
        moved.append(one._replace(recording=_later(one.recording, wait)) if wait else one)
        later.append(wait)
    return moved, later


def _phase(one: Shown) -> float | None:
    """Return the fluctuation's phase at t = 0, by the phases of the impacts [rad]; ``None`` where they tell none."""
    impacts = one.recording.impacts
    told = impacts.get("phase_rad", np.full(len(impacts["time_s"]), np.nan))
    off = np.exp(1j * (told - 2.0 * np.pi * impacts["time_s"] / one.scenario.period))
    off = off[np.isfinite(off)]
    return float(np.angle(off.mean())) if len(off) else None


def _later(recording: Recording, wait: float) -> Recording:
    signals = {**recording.signals, "time_s": recording.time + wait}
    impacts = {**recording.impacts, "time_s": recording.impacts["time_s"] + wait}
    return Recording(signals, impacts, recording.meta)


def _about(shown: Sequence[Shown], later: Sequence[float], factor: float, rate: float) -> rr.TextDocument:
    lines = []
    for colour, one, wait in zip(LINES, shown, later, strict=False):
        flank = one.recording.impacts["flank"]
        words = f"- **{one.name}** ({colour}): {one.scenario.title or 'gear rattle'}, {motion_words(one.scenario)}, "
        words += (
            f"{int((flank == 0).sum())} impacts on the active flank, {int((flank == 1).sum())} on the reverse flank"
        )
        if one.recording.meta.get("model"):
            words += f"; {one.recording.meta['model']}"
        moved = f"; shown {abs(1e3 * wait):.4g} ms {'later' if wait > 0 else 'earlier'}, its drive in phase"
        lines.append(words + (moved if wait else "") + ".")
    lines += [
        "- Blue active flank, orange reverse flank, grey flight. "
        f"Backlash of the first drawn {factor:g} times as wide.",
        f"- Slow motion: 1 s takes {rate / FRAMES_A_SECOND:.0f} s.",
    ]
    return rr.TextDocument("\n".join(lines), media_type=rr.MediaType.MARKDOWN)
