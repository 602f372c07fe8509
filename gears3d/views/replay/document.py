"""Writing replay.rrd: of one motion, or of several on one time line.

Several are runs, measured records, or a record with its nominal and extended model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.errors import InputError, UsageError
from gears3d.recording import Recording
from gears3d.views.camera.film import PLAYED, events, stretch, write_tour
from gears3d.views.camera.subject import subject
from gears3d.views.plots.section import Frames, Motion, Section, as_measured, frames, is_measured, widening
from gears3d.views.replay.curves import (
    ABOUT,
    CAPTION,
    DISPLACEMENT,
    FRAMES_A_SECOND,
    SECTION,
    STATE,
    about_text,
    axis,
    curve,
    curves,
    impact_marks,
    layout,
    motion_words,
    panels,
    poincare,
    section_view,
    states,
    style,
    torque,
    twin_curve,
    zone_view,
)
from gears3d.views.replay.scene import (
    EXTENDED,
    FLANKS,
    FOURTH,
    LINE,
    SCENE,
    TWIN,
    ZONE,
    clock,
    contacts,
    film,
    impulses,
    lines_of_action,
    require_rerun,
    rr,
    rrb,
    scalars,
    solids,
    zone_gaps,
    zone_gears,
)

if TYPE_CHECKING:
    from gears3d.diagnosis.validity import Excerpt
    from gears3d.runs import Run
    from gears3d.scenario import Scenario
    from gears3d.views.camera.film import Event
    from gears3d.views.camera.subject import Subject

# Time that the period of a tour takes in the viewer [s].
TOUR = 20.0


def replay(
    source: Recording | Run | str | Path | Sequence[Run | str | Path | tuple[Recording, Scenario]],
    scenario: Scenario | None = None,
    twin: Recording | None = None,
    out: str | Path = "replay.rrd",
    tour: bool = False,
) -> Path:
    """Write a recording as a film for the rerun viewer: gears, magnified mesh zone, curves and impacts.

    Args:
        source: a recording, a run, or the path of a run folder; two to four of them in a list, recordings as
            (recording, scenario), are shown side by side.
        scenario: what was simulated; a run brings its own.
        twin: a second recording whose displacement is drawn as a thin line; a run brings its own.
        out: the file, written under a temporary name and renamed.
        tour: show one period in slow motion with captions; ``out`` may then end in ``.mp4`` or ``.gif`` as well.

    Returns:
        The file.

    Raises:
        UsageError: a bare recording without its scenario, or nothing that can be shown.
        InputError: the run folder cannot be read, nothing was recorded, or the file cannot be written.
        MissingExtraError: rerun is not installed.
    """
    if tour and not isinstance(source, list | tuple):
        recording, scenario, _ = _opened(source, scenario, twin)
        return write_tour_of(subject(recording, scenario), scenario, out)
    require_rerun()
    if tour:
        raise UsageError("a tour shows one recording: name one")
    if isinstance(source, list | tuple):
        return several([_shown(one, k) for k, one in enumerate(source, 1)], out)
    recording, scenario, twin = _opened(source, scenario, twin)
    if not len(recording.time):
        raise InputError("the recording is empty")
    pair = as_measured(scenario.pair(), recording)
    rows = () if is_measured(recording) else tuple(scenario.rows())
    if "displacement_m" not in recording.signals:
        recording = recording.with_base_radii(pair.drive.base_radius, pair.loose.base_radius)
    true, wide = Section(pair), Section(pair, widening(pair))
    motion = Motion(recording, true, rows)
    target = Path(out)
    _write(target, scenario, motion, wide, twin)
    return target


def write_tour_of(
    seen: Subject, scenario: Scenario, out: str | Path, progress: Callable[[float], None] | None = None
) -> Path:
    """Write one period in slow motion with captions: for the rerun viewer, or as MP4 or GIF by the ending."""
    target = Path(out)
    if target.suffix.lower() in PLAYED:
        write_tour(target, seen, progress=progress)
        return target
    require_rerun()
    start, lasts = stretch(seen)
    pair = as_measured(scenario.pair(), seen.motion.recording)
    motion = Motion(seen.motion.recording.between(start, start + lasts), Section(pair), seen.motion.rows)
    _write(target, scenario, motion, Section(pair, widening(pair)), None, events(seen, start, lasts))
    return target


def _shown(source: Run | str | Path | tuple[Recording, Scenario], number: int) -> Shown:
    """Return one of several under the name of its folder, or a number."""
    from gears3d.runs import Run, read_run

    if isinstance(source, tuple):
        recording, scenario, _ = _opened(*source, None)
        return Shown(f"{number}", recording, scenario)
    run = read_run(source) if isinstance(source, str | Path) else source
    recording, scenario, _ = _opened(run, None, None)
    return Shown(run.path.name if isinstance(run, Run) else f"{number}", recording, scenario)


def _opened(
    source: Any, scenario: Scenario | None, twin: Recording | None
) -> tuple[Recording, Scenario, Recording | None]:
    from gears3d.recording import Recording
    from gears3d.runs import Run, read_run

    if isinstance(source, str | Path):
        source = read_run(source)
    if isinstance(source, Recording):
        if scenario is None:
            raise UsageError("replay(recording) does not know the gears: replay(recording, scenario)")
        return source, scenario, twin
    if not isinstance(source, Run):
        what = f"{source!r} is a {type(source).__name__}"
        raise UsageError(
            f"replay: {what}, no recording: give a recording and its scenario, or the path of a run folder"
        )
    return source.recording, scenario or source.scenario, twin or source.twin


def _write(
    path: Path,
    scenario: Scenario,
    motion: Motion,
    wide: Section,
    twin: Recording | None,
    captions: Sequence[Event] = (),
) -> None:
    true = motion.section
    shown = frames(motion)
    module = true.pair.drive.module * 1e3
    width = 0.5e3 * max(true.pair.drive.face_width, true.pair.loose.face_width)
    lasts = float(np.ptp(motion.recording.time))
    rate = FRAMES_A_SECOND * TOUR / lasts if captions else motion.frame_rate()
    with film(path, layout(wide, rate, _window(scenario, motion), bool(captions))) as rec:
        solids(rec, true, shown)
        contacts(rec, SCENE, true, shown, width + 0.2 * module, 3.0 * module, 5.0)
        scales = [impulses(rec, SCENE, true, motion, width + 0.4 * module, 12.0 * module)]
        zone_gears(rec, wide, shown)
        lines_of_action(rec, wide)
        zone_gaps(rec, wide, shown)
        contacts(rec, ZONE, wide, shown, 0.3, 0.6 * module, 6.0)
        scales.append(impulses(rec, ZONE, wide, motion, 0.4, 2.5 * module))
        curves(rec, motion)
        if twin is not None and "displacement_m" in twin.signals:
            twin_curve(rec, twin, Motion(twin, true).plot_rows())
        if not is_measured(motion.recording):  # the second derivative of what encoders counted is noise
            rig = scenario.rig()
            torque(rec, motion, rig.inertia, rig.drag_torque)
        impact_marks(rec, motion)
        poincare(rec, motion.recording, scenario.period)
        states(rec, shown.time, shown.flank)
        _captions(rec, captions)
        rec.log(ABOUT, about_text(scenario, motion, wide, tuple(scales), rate), static=True)


def _captions(rec: rr.RecordingStream, captions: Sequence[Event]) -> None:
    """Write what happens from each instant on."""
    if captions:
        words = [f"## {one.words}" for one in captions]
        rec.log(CAPTION, rr.TextDocument.from_fields(media_type=rr.MediaType.MARKDOWN), static=True)
        time = clock(np.array([one.time for one in captions]))
        rec.send_columns(CAPTION, indexes=[time], columns=rr.TextDocument.columns(text=words))


def _window(scenario: Scenario, motion: Motion) -> float:
    """Time that the curves show: two periods of the slowest fluctuation, at most all of it [s]."""
    time = motion.recording.time
    all_of_it = float(time[-1] - time[0]) if len(time) else 1.0
    frequencies = [harmonic.frequency for harmonic in scenario.motion.harmonics if harmonic.frequency > 0.0]
    return min(2.0 / min(frequencies), all_of_it) if frequencies else all_of_it


class Lane(NamedTuple):
    """One of the motions as it is drawn.

    Args:
        name: of its entities.
        title: above its mesh zone.
        colour: of its curves.
        width: of its curves, in points of the screen.
        motion: what moves.
        wide: the pair as drawn.
        frames: where it is when.
    """

    name: str
    title: str
    colour: tuple[int, int, int]
    width: float
    motion: Motion
    wide: Section
    frames: Frames


def draw_lane(rec: rr.RecordingStream, lane: Lane, rows: np.ndarray | None = None) -> None:
    """Write a motion's mesh zone, its displacement [um] and which flank touches."""
    root, module = f"/{lane.name}", lane.wide.pair.drive.module * 1e3
    zone_gears(rec, lane.wide, lane.frames, root)
    lines_of_action(rec, lane.wide, root)
    zone_gaps(rec, lane.wide, lane.frames, root)
    contacts(rec, root, lane.wide, lane.frames, 0.3, 0.6 * module, 6.0)
    impulses(rec, root, lane.wide, lane.motion, 0.4, 2.5 * module)
    entity, signals = f"{DISPLACEMENT}/{lane.name}", lane.motion.recording.signals
    kept = slice(None) if rows is None else rows
    style(rec, entity, [lane.title], [lane.colour], lane.width)
    scalars(rec, entity, signals["time_s"][kept], signals["displacement_m"][kept] * _UM)
    states(rec, lane.frames.time, lane.frames.flank, f"{STATE}/{lane.name}")


def flank_lines_of(rec: rr.RecordingStream, lane: Lane, prefix: str = "", rows: np.ndarray | None = None) -> None:
    """Write where the flanks of a motion are [um]."""
    kept = slice(None) if rows is None else rows
    signals = lane.motion.recording.signals
    time, drive, loose = (signals[name][kept] for name in ("time_s", "theta_drive_rad", "theta_loose_rad"))
    for word, colour, place in zip(("active", "reverse"), FLANKS, lane.motion.flanks(drive, loose), strict=True):
        entity = f"{DISPLACEMENT}/{prefix}{word}_flank"
        style(rec, entity, [f"{word} flank"], [colour], 2.0)
        scalars(rec, entity, time, np.asarray(place) * _UM)


def arranged(
    lanes: Sequence[Lane], curves: str, window: float, rate: float, more: Sequence[rrb.View] = ()
) -> rrb.Blueprint:
    """Return the blueprint: zones above, displacements below them, which flank touches and the text at the bottom."""
    shown = axis(window)
    zones = [zone_view(lane.wide, f"/{lane.name}", lane.title) for lane in lanes]
    legend = rrb.PlotLegend(visible=True)
    touching = rrb.StateTimelineView(origin=STATE, name="Touching", time_view=shown)
    about = rrb.TextDocumentView(origin=ABOUT, name="About this replay")
    bottom = [0.6, 0.4] if not more else [0.35, *[0.4 / len(more)] * len(more), 0.25]
    return panels(
        rrb.Vertical(
            rrb.Horizontal(*zones),
            curve(DISPLACEMENT, curves, shown, legend),
            rrb.Horizontal(touching, *more, about, column_shares=bottom),
            row_shares=[0.45, 0.3, 0.25],
        ),
        rate,
    )


COLOURS_OF = {"white": LINE, "pink": TWIN, "green": EXTENDED, "yellow": FOURTH}
# Recordings side by side.
MOST = len(COLOURS_OF)
# Of the lines; later ones cover earlier ones where they agree.
WIDTHS_OF = (5.0, 3.5, 2.0, 1.0)
# Relative difference of periods of which one phase can be taken for the other's.
SAME_PERIOD = 1e-3


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
    sections = [section_view(f"{SECTION}/{lane.name}", f"Poincaré: {lane.title}") for lane in hit]
    curves = "Displacement between the flanks [um]: " + ", ".join(
        f"{colour} {one.name}" for colour, one in zip(COLOURS_OF, shown, strict=False)
    )
    window = min(3.0 * shown[0].scenario.period, max(float(np.ptp(one.recording.time)) for one in shown))
    target = Path(out)
    with film(target, arranged(lanes, curves, window, rate, sections)) as rec:
        known: list[tuple] = []
        for lane, one, kept in zip(lanes, shown, rows, strict=True):
            draw_lane(rec, lane, kept)
            poincare(rec, one.recording, one.scenario.period, f"{SECTION}/{lane.name}", reach)
            its = (round(lane.motion.section.pair.backlash * 1e7), lane.motion.rows)
            if its not in known:
                known.append(its)
                flank_lines_of(rec, lane, f"{lane.name}_", kept)
        rec.log(ABOUT, _about_several(shown, later, lanes[0].wide.factor, rate), static=True)
    return target


def _lane(number: int, one: Shown) -> Lane:
    pair = as_measured(one.scenario.pair(), one.recording)
    recording = one.recording
    if "displacement_m" not in recording.signals:
        recording = recording.with_base_radii(pair.drive.base_radius, pair.loose.base_radius)
    rows = () if is_measured(recording) else tuple(one.scenario.rows())
    motion = Motion(recording, Section(pair), rows)
    colour = list(COLOURS_OF.values())[number]
    return Lane(
        f"run_{number + 1}", one.name, colour, WIDTHS_OF[number], motion, Section(pair, widening(pair)), frames(motion)
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


def _about_several(shown: Sequence[Shown], later: Sequence[float], factor: float, rate: float) -> rr.TextDocument:
    lines = []
    for colour, one, wait in zip(COLOURS_OF, shown, later, strict=False):
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


# Of the three, and of their entities.
NAMES = ("measured", "base", "extended")
COLOURS_OF_THREE = (LINE, TWIN, EXTENDED)
# Width of the line of the extended model, which stays visible behind the measured one.
WIDTHS_OF_THREE = (1.5, 2.5, 6.0)
_UM = 1e6


def beside(excerpt: Excerpt, causes: tuple[str, ...] = (), out: str | Path = "replay.rrd") -> Path:
    """Write an excerpt of a record, the rig and the extended rig side by side as an animation for the rerun viewer."""
    target = Path(out)
    three = _three(excerpt, causes)
    rate, time = three[0].motion.frame_rate(), excerpt.measured.time
    curves = "Displacement between the flanks [um]: white measured, pink base, green extended"
    with film(target, arranged(three, curves, float(time[-1] - time[0]), rate)) as rec:
        for lane in three:
            draw_lane(rec, lane)
        flank_lines_of(rec, three[2])
        rec.log(ABOUT, _about_three(excerpt, three, causes, rate), static=True)
    return target


def _three(excerpt: Excerpt, causes: tuple[str, ...]) -> list[Lane]:
    recordings = excerpt.measured, excerpt.base, excerpt.extended
    rigs = (
        excerpt.extended_rig,
        excerpt.rig,
        excerpt.extended_rig,
    )  # measured flanks are where the causes put them
    titles = ("Measured", "Base: nominal model", f"Extended: {' + '.join(causes) or 'nothing to add'}")
    pair = excerpt.rig.pair()
    true, wide = Section(pair), Section(pair, widening(pair))
    motions = [
        Motion(recording, true, tuple(rig.rows()), near)
        for recording, rig, near in zip(recordings, rigs, excerpt.near, strict=True)
    ]
    hits = [one.recording.impacts["time_s"] for one in motions[1:]]
    time = np.unique(np.concatenate([motions[0].frame_times(), *hits]))
    return [
        Lane(name, title, colour, width, motion, wide, frames(motion, time))
        for name, title, colour, width, motion in zip(
            NAMES, titles, COLOURS_OF_THREE, WIDTHS_OF_THREE, motions, strict=True
        )
    ]


def _about_three(excerpt: Excerpt, three: list[Lane], causes: tuple[str, ...], rate: float) -> rr.TextDocument:
    time, near = excerpt.measured.time, excerpt.near[0]
    wide = three[0].wide
    begun = (
        "during a free flight" if excerpt.riding is None else f"on the {('active', 'reverse')[excerpt.riding]} flank"
    )
    lines = [
        f"### {Path(excerpt.name).name}, {time[0]:.4g} to {time[-1]:.4g} s",
        off(excerpt),
        "Base (nominal model) and extended model start from the measured state at the beginning, "
        f"{begun}, and follow the measured motion of the drive; they are not corrected by the record later.",
        f"Added: {', '.join(causes) or 'no cause; the extended model equals the base'}.",
        f"- **Blue active flank, orange reverse flank, grey flight.** Backlash drawn {wide.factor:g} times as wide.",
        f"- Slow motion: 1 s takes {rate / FRAMES_A_SECOND:.0f} s.",
        f"- Measured flanks are drawn at the positions of the extended model; a gap below {near * _UM:.2g} um is "
        "shown as contact. Only impacts that are used for identification are shown.",
    ]
    return rr.TextDocument("\n\n".join(lines[:4]) + "\n" + "\n".join(lines[4:]), media_type=rr.MediaType.MARKDOWN)


def off(excerpt: Excerpt) -> str:
    """Return in one sentence the errors of nominal and extended model, relative to the measured displacement."""
    time, place = excerpt.measured.time, excerpt.measured.signals["displacement_m"]
    rest = [
        float(np.sqrt(np.mean((np.interp(time, one.time, one.signals["displacement_m"]) - place) ** 2))) * _UM
        for one in (excerpt.base, excerpt.extended)
    ]
    return f"Root mean square error of the displacement: base {rest[0]:.3g} um, extended {rest[1]:.3g} um."
