"""Admission of measured records: read, examined, corrected on request, joined with the rig of their condition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gears3d.errors import Fault, InputError
from gears3d.measured.checks.examination import ALWAYS, examine, refuse_unknown
from gears3d.measured.checks.examination import correct as undo
from gears3d.measured.checks.view import MESH, Finding, stated_of
from gears3d.measured.drive_motion import DriveMotion, drive_motion
from gears3d.measured.readers import Channels, Span, files_of, read, within
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Admitted:
    """A record that may be used.

    Args:
        channels: the columns, corrected where that was asked for.
        rig: scenario of the bench with this record's conditions, where one was given; its motion is the measured one as
            far as it is not stated.
        findings: of the gate, corrected ones among them.
        file: where the record came from.
        motion: of the drive as its encoder measured it; ``None`` without the drive's angle.
        stated: parts of the rig's motion that are stated of this record: ``mean``, ``harmonics``, ``record``.
        map_file: ``record.toml`` that it was read with, where one was given.
    """

    channels: Channels
    rig: Scenario | None
    findings: tuple[Finding, ...]
    file: str
    motion: DriveMotion | None = None
    stated: frozenset[str] = frozenset()
    map_file: str | None = None

    @cached_property
    def recording(self) -> Recording:
        """The record in the contract's columns; both angles must be there."""
        return Recording(self.channels.columns, meta=self.channels.meta)

    @property
    def inputs(self) -> tuple[str | Path | None, ...]:
        """Files that it was made from: the record, its map, the rig."""
        return self.file, self.map_file, None if self.rig is None else self.rig.path

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was found, as one line each."""
        return tuple(told(finding) for finding in self.findings)

    @property
    def repeats(self) -> bool:
        """Whether a record given before holds the same readings, so that this one must not count."""
        return any(finding.kind == "duplicated-file" for finding in self.findings)


# Periods of a record below which the frequency of its fluctuation cannot be separated from a run-up.
SHORT = 3.0


class Admission(NamedTuple):
    """Result of the admission of several files.

    Args:
        admitted: records that may be used, in the order given.
        repeated: records that are excluded, as they repeat the readings of one before.
        faults: of files that cannot be used as they are.
    """

    admitted: tuple[Admitted, ...]
    repeated: tuple[Admitted, ...]
    faults: tuple[Fault, ...]

    def all(self) -> tuple[Admitted, ...]:
        """Return the records that may be used.

        Raises:
            InputError: there are faults.
        """
        if self.faults:
            raise InputError(self.faults)
        return self.admitted


def admit(
    path: str | Path,
    rig: Scenario | None = None,
    map_file: str | Path | None = None,
    correct: Sequence[str] = (),
    *,
    needs: Sequence[str | Sequence[str]] = MESH,
    others: Sequence[Channels] = (),
    tolerate: Sequence[str] = (),
    stated_motion: bool = False,
    span: Span = (None, None),
) -> Admitted:
    """Read a measured record, examine its sensors and return it with the rig of its condition.

    Args:
        path: the file.
        rig: scenario of the bench; ``[condition]`` of the map overrides its keys.
        map_file: ``record.toml``.
        correct: kinds of findings to correct, also several parted by commas; nothing else is corrected, but
            for few rows without a reading, which are excluded.
        needs: columns that must be there besides time, alternatives as a tuple: ``("theta_loose_rad",)`` for a gear
            that runs down out of mesh. Without both angles nothing is said of the mesh.
        others: records given before, to find one that is given twice.
        tolerate: kinds of findings that the caller handles itself: they are never fatal.
        stated_motion: whether the rig's ``[motion]`` is a statement about this record; otherwise the drive's encoder
            alone says how the drive moved, but for keys of ``motion`` under ``[condition]`` of the map.
        span: first and last time of the part that is used, in the record's own time [s].

    Returns:
        The record, the rig and what was found.

    Raises:
        InputError: the record cannot be used as it is; it names the corrections that make it usable.
        UsageError: a kind cannot be corrected.
    """
    kinds = _kinds(correct)
    channels = within(read(path, map_file), span)
    own = rig if rig is None else _conditioned(rig, channels, map_file or path)
    findings = examine(channels, own, others, needs, stated_motion=stated_motion)
    fatal = {one.kind for one in findings if one.fatal}
    kinds += [kind for kind in ALWAYS if kind not in kinds and (kind not in fatal or kind in tolerate)]
    done = tuple(replace(one, corrected=one.correctable and one.kind in kinds) for one in findings)
    bad = [one for one in done if one.fatal and not one.corrected and one.kind not in tolerate]
    if bad:
        raise InputError([_fault(one, channels.file) for one in bad])
    channels = undo(channels, findings, kinds) if any(one.corrected for one in done) else channels
    stated = stated_of(channels.condition, own, stated_motion)
    motion = _motion(channels, own, needs)
    if own is not None and motion is not None:
        own = _moved(own, motion, stated)
    return Admitted(channels, own, done, channels.file, motion, stated, None if map_file is None else str(map_file))


def admit_each(
    paths: Sequence[str | Path],
    rig: Scenario | None = None,
    map_file: str | Path | None = None,
    correct: Sequence[str] = (),
    *,
    needs: Sequence[str | Sequence[str]] = MESH,
    others: Sequence[Channels] = (),
    tolerate: Sequence[str] = (),
    stated_motion: bool = False,
    span: Span = (None, None),
) -> Admission:
    """Examine several records and sort them into those that may be used, those that are excluded and the faults.

    Args:
        paths: the files, or maps that name them.
        rig: scenario of the bench, for all of them.
        map_file: ``record.toml``, for all of them.
        correct: kinds of findings to correct; ``"duplicated-file"`` excludes a file that repeats another's readings.
        needs: columns that must be there besides time.
        others: records given before these, to find one that is given twice.
        tolerate: as for :func:`admit`.
        stated_motion: as for :func:`admit`.
        span: as for :func:`admit`, of each record.

    Returns:
        What became of each file.

    Raises:
        UsageError: a kind cannot be corrected.
    """
    admitted: list[Admitted] = []
    repeated: list[Admitted] = []
    faults: list[Fault] = []
    for path, chart in files_of(paths, map_file):
        known = [*others, *(one.channels for one in admitted)]
        try:
            one = admit(
                path,
                rig,
                chart,
                correct,
                needs=needs,
                others=known,
                tolerate=tolerate,
                stated_motion=stated_motion,
                span=span,
            )
        except InputError as error:
            faults += error.faults
        else:
            (repeated if one.repeats else admitted).append(one)
    return Admission(tuple(admitted), tuple(repeated), tuple(faults))


def admit_all(
    paths: Sequence[str | Path],
    rig: Scenario | None = None,
    map_file: str | Path | None = None,
    correct: Sequence[str] = (),
    *,
    needs: Sequence[str | Sequence[str]] = MESH,
    stated_motion: bool = False,
) -> tuple[Admitted, ...]:
    """Return several records, each once; the faults of all of them are raised together.

    Args:
        paths: as for :func:`admit_each`.
        rig: as for :func:`admit_each`.
        map_file: as for :func:`admit_each`.
        correct: as for :func:`admit_each`.
        needs: as for :func:`admit_each`.
        stated_motion: as for :func:`admit`.

    Raises:
        InputError: some cannot be used as they are.
        UsageError: a kind cannot be corrected.
    """
    return admit_each(paths, rig, map_file, correct, needs=needs, stated_motion=stated_motion).all()


def told(finding: Finding) -> str:
    """Return a finding as one line.

    Args:
        finding: of the gate.

    >>> told(Finding("gaps", "time_s", 0.1, "s", "3 rows are missing", corrected=True))
    'gaps: time_s: 3 rows are missing (corrected)'
    """
    place = f"{finding.kind}: {finding.channel}: " if finding.channel else f"{finding.kind}: "
    done = "excluded" if finding.kind in ALWAYS else "corrected"
    remedy = done if finding.corrected else _remedy(finding)
    return f"{place}{finding.evidence}" + (f" ({remedy})" if remedy else "")


def _conditioned(rig: Scenario, channels: Channels, file: str | Path) -> Scenario:
    """Return the rig in the condition of a record; faults name the map."""
    if not channels.condition:
        return rig
    try:
        return rig.with_(channels.condition)
    except InputError as error:
        faults = [Fault(f"condition.{one.key}", one.message, one.remedy, str(file)) for one in error.faults]
        raise InputError(faults) from error


def _motion(channels: Channels, rig: Scenario | None, needs: Sequence[str | Sequence[str]]) -> DriveMotion | None:
    """Return the drive's motion of a record of gears in mesh; ``None`` of any other.

    A record too short to show the frequency of its fluctuation may show that of the rig.
    """
    columns = channels.columns
    if not set(MESH) <= {*needs} or not {"time_s", MESH[0]} <= columns.keys() or len(columns["time_s"]) < 2:
        return None
    time, angle = columns["time_s"], columns[MESH[0]]
    found, span = drive_motion(time, angle), float(time[-1] - time[0])
    slow = [] if rig is None else [one.frequency for one in rig.motion.harmonics if one.frequency * span < SHORT]
    return found if found.harmonics or not slow else drive_motion(time, angle, slow)


def _moved(rig: Scenario, motion: DriveMotion, stated: frozenset[str]) -> Scenario:
    """Return the rig with the measured motion in place of what is not stated."""
    if "record" in stated or {"mean", "harmonics"} <= stated:
        return rig
    table = motion.scenario()
    if rig.motion.record is None:
        return rig.with_({f"motion.{key}": value for key, value in table.items() if key not in stated})
    return rig.with_({"motion": table})


def _kinds(correct: Sequence[str]) -> list[str]:
    """Return the kinds to correct, each item one or several parted by commas."""
    kinds = [kind.strip() for item in correct for kind in item.split(",") if kind.strip()]
    refuse_unknown(kinds)
    return kinds


def _remedy(finding: Finding) -> str:
    ways = [f"--correct {finding.kind}"] if finding.correctable else []
    return ", ".join([*ways, *([finding.remedy] if finding.remedy else [])])


def _fault(finding: Finding, file: str) -> Fault:
    return Fault(finding.channel, f"{finding.evidence} [{finding.kind}]", _remedy(finding), file)
