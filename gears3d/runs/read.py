"""Reading a run folder back, as far as it is there."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.errors import Fault, InputError
from gears3d.inputs import read_text
from gears3d.runs.folder import MARK

MOST = 1 << 26
"""Bytes of a summary."""

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario


@dataclass(frozen=True)
class Run:
    """A run folder's content.

    Args:
        path: the folder.
        scenario: what was simulated.
        recording: what came out.
        twin: what the twin said, if it ran.
        summary: the content of ``summary.json``.
    """

    path: Path
    scenario: Scenario
    recording: Recording
    twin: Recording | None
    summary: dict[str, Any]


def read_run(path: str | Path) -> Run:
    """Read a run folder.

    Args:
        path: the folder that ``gears3d run`` wrote.

    Returns:
        Its content; ``twin`` is ``None`` when there is none.

    Raises:
        InputError: it is no run folder, or a file in it cannot be read.
    """
    from gears3d.recording import read
    from gears3d.scenario import load

    folder = Path(path)
    if not (folder / MARK).is_file():
        what = "is not there"
        if folder.exists():
            what = "is no run folder: it has no summary.json" if folder.is_dir() else "is a file, not a run folder"
        raise InputError(Fault("", what, "make one with `gears3d run SCENARIO --out DIR`", str(folder)))
    try:
        summary = json.loads(read_text(folder / MARK, MOST))
    except (ValueError, RecursionError) as error:
        raise InputError(Fault("", f"is not JSON: {error}", "run the scenario again", str(folder / MARK))) from error
    twin = read(folder / "twin") if (folder / "twin").is_dir() else None
    return Run(folder, load(folder / "scenario.toml"), read(folder), twin, summary)
