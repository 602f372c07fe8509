"""Three motions side by side in slow motion: what was measured, what the rig makes of it, and the extended rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from gears3d.files import replacing
from gears3d.views.mesh import colours
from gears3d.views.mesh.motion import Frames, Motion, frames
from gears3d.views.mesh.teeth import Section, widening
from gears3d.views.replay import plots, scene, zone
from gears3d.views.replay.layout import ABOUT, FRAMES_A_SECOND, axis, time_panel, zone_view
from gears3d.views.replay.plots import DISPLACEMENT, STATE
from gears3d.views.replay.write import scalars

if TYPE_CHECKING:
    from gears3d.diagnosis.stretch import Stretch

NAMES = ("measured", "base", "extended")
"""Of the three, and of their entities."""
LINES = (colours.LINE, colours.TWIN, colours.EXTENDED)
WIDTHS = (1.5, 2.5, 6.0)
"""The extended rig's line is seen beside the measured one that covers it."""
_UM = 1e6


class _Shown(NamedTuple):
    """One of the three as it is drawn."""

    name: str
    motion: Motion
    wide: Section
    frames: Frames


def beside(stretch: Stretch, causes: tuple[str, ...] = (), out: str | Path = "replay.rrd") -> Path:
    """Write a stretch of a record, the rig and the extended rig side by side as a film for the rerun viewer.

    Args:
        stretch: the three motions.
        causes: kinds that the extended rig has more than the rig.
        out: the file, written under a temporary name and renamed.

    Returns:
        The file.

    Raises:
        InputError: the file cannot be written.
    """
    target = Path(out)
    three = _three(stretch)
    with replacing(target) as unfinished:
        try:
            _write(unfinished, stretch, three, causes)
        except RuntimeError as error:  # what the recorder raises when a disk is full
            raise OSError(str(error)) from error
    return target


def _three(stretch: Stretch) -> list[_Shown]:
    recordings = stretch.measured, stretch.base, stretch.extended
    rigs = stretch.extended_rig, stretch.rig, stretch.extended_rig  # measured flanks are where the causes put them
    pair = stretch.rig.pair()
    true, wide = Section(pair), Section(pair, widening(pair))
    motions = [
        Motion(recording, true, tuple(rig.rows()), near)
        for recording, rig, near in zip(recordings, rigs, stretch.near, strict=True)
    ]
    hits = [one.recording.impacts["time_s"] for one in motions[1:]]
    time = np.unique(np.concatenate([motions[0].frame_times(), *hits]))
    return [_Shown(name, one, wide, frames(one, time)) for name, one in zip(NAMES, motions, strict=True)]


def _write(path: Path, stretch: Stretch, three: list[_Shown], causes: tuple[str, ...]) -> None:
    rate = three[0].motion.frame_rate()
    with rr.RecordingStream("gears3d") as rec:
        rec.save(path, default_blueprint=_layout(three, causes, rate))
        for one, colour, width in zip(three, LINES, WIDTHS, strict=True):
            _zone(rec, one)
            entity = f"{DISPLACEMENT}/{one.name}"
            plots.style(rec, entity, [one.name], [colour], width)
            signals = one.motion.recording.signals
            scalars(rec, entity, signals["time_s"], signals["displacement_m"] * _UM)
            plots.states(rec, one.frames.time, one.frames.flank, f"{STATE}/{one.name}")
        _flanks(rec, three[2])
        rec.log(ABOUT, _about(stretch, three, causes, rate), static=True)
        rec.flush()


def _zone(rec: rr.RecordingStream, one: _Shown) -> None:
    root, module = f"/{one.name}", one.wide.pair.drive.module * 1e3
    zone.gears(rec, one.wide, one.frames, root)
    zone.lines_of_action(rec, one.wide, root)
    zone.gaps(rec, one.wide, one.frames, root)
    scene.contacts(rec, root, one.wide, one.frames, 0.3, 0.6 * module, 6.0)
    scene.impulses(rec, root, one.wide, one.motion, 0.4, 2.5 * module)


def _flanks(rec: rr.RecordingStream, one: _Shown) -> None:
    """Write where the flanks of the extended rig are."""
    signals = one.motion.recording.signals
    places = one.motion.flanks(signals["theta_drive_rad"], signals["theta_loose_rad"])
    for word, colour, place in zip(("active", "reverse"), colours.FLANKS, places, strict=True):
        entity = f"{DISPLACEMENT}/{word}_flank"
        plots.style(rec, entity, [f"{word} flank"], [colour], 2.0)
        scalars(rec, entity, signals["time_s"], np.asarray(place) * _UM)


def _layout(three: list[_Shown], causes: tuple[str, ...], rate: float) -> rrb.Blueprint:
    time = three[0].motion.recording.time
    whole = axis(float(time[-1] - time[0]))
    titles = ("Measured", "Base: the rig as claimed", f"Extended: {' + '.join(causes) or 'nothing to add'}")
    zones = [zone_view(one.wide, f"/{one.name}", title) for one, title in zip(three, titles, strict=True)]
    curves = rrb.TimeSeriesView(
        origin=DISPLACEMENT,
        name="Displacement between the flanks [um]: white measured, pink base, green extended",
        axis_x=whole,
        plot_legend=rrb.PlotLegend(visible=True),
    )
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*zones),
            curves,
            rrb.Horizontal(
                rrb.StateTimelineView(origin=STATE, name="Touching", time_view=whole),
                rrb.TextDocumentView(origin=ABOUT, name="About this replay"),
                column_shares=[0.6, 0.4],
            ),
            row_shares=[0.45, 0.3, 0.25],
        ),
        time_panel(rate),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _about(stretch: Stretch, three: list[_Shown], causes: tuple[str, ...], rate: float) -> rr.TextDocument:
    time, near = stretch.measured.time, stretch.near[0]
    wide = three[0].wide
    begun = "amid a flight" if stretch.riding is None else f"on the {('active', 'reverse')[stretch.riding]} flank"
    lines = [
        f"### {Path(stretch.name).name}, {time[0]:.4g} to {time[-1]:.4g} s",
        off(stretch),
        "Base and extended rig start from the measured state at the beginning, "
        f"{begun}, and follow the measured motion of the drive; nothing pulls them back to the record.",
        f"Added: {', '.join(causes) or 'nothing, extended is base'}.",
        f"- **Blue active flank, orange reverse flank, grey flight.** Backlash drawn {wide.factor:g} times as wide.",
        f"- Slow motion: 1 s takes {rate / FRAMES_A_SECOND:.0f} s.",
        f"- Measured flanks are drawn where the extended rig has them; nearer than {near * _UM:.2g} um is touching. "
        "Impacts are those that were measured well.",
    ]
    return rr.TextDocument("\n\n".join(lines[:4]) + "\n" + "\n".join(lines[4:]), media_type=rr.MediaType.MARKDOWN)


def off(stretch: Stretch) -> str:
    """Return in one sentence how far base and extended rig are off the measured displacement.

    Args:
        stretch: the three motions.
    """
    time, place = stretch.measured.time, stretch.measured.signals["displacement_m"]
    rest = [
        float(np.sqrt(np.mean((np.interp(time, one.time, one.signals["displacement_m"]) - place) ** 2))) * _UM
        for one in (stretch.base, stretch.extended)
    ]
    return f"Off the measured displacement (root mean square): base {rest[0]:.3g} um, extended {rest[1]:.3g} um."
