"""Writing replay.rrd."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import rerun as rr

from gears3d.errors import InputError, UsageError
from gears3d.files import replacing
from gears3d.views.mesh.motion import Motion, as_measured, frames, is_measured
from gears3d.views.mesh.teeth import Section, widening
from gears3d.views.replay import plots, scene, zone
from gears3d.views.replay.about import about
from gears3d.views.replay.layout import ABOUT, layout

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.runs import Run
    from gears3d.scenario import Scenario

APPLICATION = "gears3d"


def replay(
    source: Recording | Run | str | Path,
    scenario: Scenario | None = None,
    twin: Recording | None = None,
    out: str | Path = "replay.rrd",
) -> Path:
    """Write a recording as a film for the rerun viewer: gears, magnified mesh zone, curves and impacts.

    Args:
        source: a recording, a run, or the path of a run folder.
        scenario: what was simulated; a run brings its own.
        twin: a second recording whose displacement is drawn as a thin line; a run brings its own.
        out: the file, written under a temporary name and renamed.

    Returns:
        The file.

    Raises:
        UsageError: a bare recording without its scenario, or nothing that can be shown.
        InputError: the run folder cannot be read, nothing was recorded, or the file cannot be written.
    """
    recording, scenario, twin = _opened(source, scenario, twin)
    if not len(recording.time):
        raise InputError("nothing was recorded: there is nothing to replay")
    pair = as_measured(scenario.pair(), recording)
    rows = () if is_measured(recording) else tuple(scenario.rows())
    if "displacement_m" not in recording.signals:
        recording = recording.with_base_radii(pair.drive.base_radius, pair.loose.base_radius)
    true, wide = Section(pair), Section(pair, widening(pair))
    motion = Motion(recording, true, rows)
    target = Path(out)
    with replacing(target) as unfinished:
        try:
            _write(unfinished, scenario, motion, wide, twin)
        except RuntimeError as error:  # what the recorder raises when a disk is full
            raise OSError(str(error)) from error
    return target


def _opened(
    source: Recording | Run | str | Path, scenario: Scenario | None, twin: Recording | None
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


def _write(path: Path, scenario: Scenario, motion: Motion, wide: Section, twin: Recording | None) -> None:
    true = motion.section
    shown = frames(motion)
    module = true.pair.drive.module * 1e3
    width = 0.5e3 * max(true.pair.drive.face_width, true.pair.loose.face_width)
    with rr.RecordingStream(APPLICATION) as rec:
        rec.save(path, default_blueprint=layout(wide, motion.frame_rate(), _window(scenario, motion)))
        scene.solids(rec, true, shown)
        scene.contacts(rec, scene.ROOT, true, shown, width + 0.2 * module, 3.0 * module, 5.0)
        scales = [scene.impulses(rec, scene.ROOT, true, motion, width + 0.4 * module, 12.0 * module)]
        zone.gears(rec, wide, shown)
        zone.lines_of_action(rec, wide)
        zone.gaps(rec, wide, shown)
        scene.contacts(rec, zone.ROOT, wide, shown, 0.3, 0.6 * module, 6.0)
        scales.append(scene.impulses(rec, zone.ROOT, wide, motion, 0.4, 2.5 * module))
        plots.curves(rec, motion)
        if twin is not None and "displacement_m" in twin.signals:
            plots.twin_curve(rec, twin, Motion(twin, true).plot_rows())
        plots.impacts(rec, motion)
        plots.states(rec, shown.time, shown.flank)
        rec.log(ABOUT, about(scenario, motion, wide, tuple(scales)), static=True)
        rec.flush()


def _window(scenario: Scenario, motion: Motion) -> float:
    """Time that the curves show: two periods of the slowest fluctuation, at most all of it [s]."""
    time = motion.recording.time
    all_of_it = float(time[-1] - time[0]) if len(time) else 1.0
    frequencies = [harmonic.frequency for harmonic in scenario.motion.harmonics if harmonic.frequency > 0.0]
    return min(2.0 / min(frequencies), all_of_it) if frequencies else all_of_it
