"""The way in for measured records: read, examined, corrected where asked, joined with the rig of their condition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gears3d.gate.finding import Finding
from gears3d.readers import read
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Admitted:
    """A record that may be used.

    Args:
        recording: checked, in the contract's columns.
        rig: scenario of the bench with this record's conditions, where one was given.
        findings: of the gate, corrected ones among them.
        file: where the record came from.
    """

    recording: Recording
    rig: Scenario | None
    findings: tuple[Finding, ...]
    file: str


def admit(
    path: str | Path,
    rig: Scenario | None = None,
    map_file: str | Path | None = None,
    correct: Sequence[str] = (),
) -> Admitted:
    """Read a measured record, examine its sensors and return it with the rig of its condition.

    Args:
        path: the file.
        rig: scenario of the bench; ``[condition]`` of the map overrides its keys.
        map_file: ``record.toml``.
        correct: kinds of findings to correct; nothing is corrected that is not named.

    Returns:
        The record, the rig and what was found.

    Raises:
        InputError: the file cannot be used as it is; tells which corrections would make it usable.
    """
    channels = read(path, map_file)
    own = rig.with_(channels.condition) if rig is not None and channels.condition else rig
    return Admitted(Recording(channels.columns, meta=channels.meta), own, (), channels.file)
