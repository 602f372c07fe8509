"""Input of camera and replay: a run folder, a folder of ``segment``, or a measured record with its rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement
    from gears3d.recording import Recording
    from gears3d.runs import Run
    from gears3d.scenario import Scenario


class Filmed(NamedTuple):
    """A recording and its gears.

    Args:
        recording: simulated or measured.
        scenario: of the run, or of the test rig.
        run: the run, if it is one.
        measurement: the measurement, if it is a measured record.
    """

    recording: Recording
    scenario: Scenario
    run: Run | None = None
    measurement: Measurement | None = None


def filmed(
    source: Path, rig: Scenario | None, map_file: Path | None = None, correct: list[str] | None = None
) -> Filmed:
    """Open a recording with its scenario."""
    from gears3d.errors import UsageError

    if source.is_dir() or not source.exists():
        if rig is None:
            from gears3d.runs import read_run

            run = read_run(source)
            return Filmed(run.recording, run.scenario, run)
        from gears3d.recording import read

        return Filmed(read(source), rig)
    if rig is None:
        raise UsageError(f"Missing option '--rig': {source} is a measured record, give the scenario of its test rig")
    return _measured(source, rig, map_file, correct or [])


def _measured(source: Path, rig: Scenario, map_file: Path | None, correct: list[str]) -> Filmed:
    from gears3d.errors import Fault, InputError
    from gears3d.measured import segmentation
    from gears3d.measured.checks import admit
    from gears3d.measured.readers import files_of

    pairs = files_of([source], map_file)
    if len(pairs) != 1:
        raise InputError(Fault("", f"names {len(pairs)} records", "name one of them, with --map", str(source)))
    file, chart = pairs[0]
    admitted = admit(file, rig, chart, correct)
    found = segmentation.measure(admitted.recording, admitted.rig, admitted.file, motion=admitted.motion)
    return Filmed(found.recording, admitted.rig or rig, measurement=found)
