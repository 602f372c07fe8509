"""Writing replay.rrd."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import InputError, UsageError
from gears3d.views.camera.subject import subject
from gears3d.views.camera.tour import PLAYED, events, stretch, write_tour
from gears3d.views.plots.motion import Motion, as_measured, frames, is_measured
from gears3d.views.plots.teeth import Section, widening
from gears3d.views.replay.curves import curves, impact_marks, poincare, states, torque, twin_curve
from gears3d.views.replay.layout import ABOUT, CAPTION, FRAMES_A_SECOND, about_text, layout
from gears3d.views.replay.scene import SCENE, ZONE, contacts, impulses, lines_of_action, solids, zone_gaps, zone_gears
from gears3d.views.replay.side_by_side import Shown, several
from gears3d.views.replay.write import clock, film, require_rerun, rr

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.runs import Run
    from gears3d.scenario import Scenario
    from gears3d.views.camera.subject import Subject
    from gears3d.views.camera.tour import Event

TOUR = 20.0
"""Time that the period of a tour takes in the viewer [s]."""


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
