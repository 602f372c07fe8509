"""All checks in order, and all requested corrections."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.errors import UsageError, did_you_mean
from gears3d.measured.checks import columns, contact, counts, mesh, readings
from gears3d.measured.checks.view import MESH, Finding, View, declared, stated_of
from gears3d.measured.readers import Channels

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

Columns = dict[str, np.ndarray]


class Check(NamedTuple):
    """One check.

    Args:
        examine: finds faults.
        correct: corrects them, by kind; those kinds can be named on the command line.
        kinds: that can be corrected, in the order in which they must be.
    """

    examine: Callable[[View], list[Finding]]
    correct: Callable[[Columns, list[Finding]], Columns] | None = None
    kinds: tuple[str, ...] = ()


# In this order: each check relies on what those before it found correct, or corrected.
CHECKS = (
    Check(columns.examine, columns.correct, ("drop-outs", "not-finite")),
    Check(columns.examine_order, columns.correct_order, ("duplicates", "time-wrap", "time-order", "time-stamps")),
    Check(columns.examine_unit, columns.correct_unit, ("time-unit",)),
    Check(columns.examine_spacing),
    Check(counts.examine_wraps, counts.correct_wraps, ("angle-wrap",)),
    Check(readings.examine_holds, readings.correct_holds, ("held",)),
    Check(counts.examine_edges, counts.correct_edges, ("merged-edges", "doubled-edges")),
    Check(readings.examine_jumps, readings.correct_jumps, ("lost-counts",)),
    Check(mesh.examine_ratio, mesh.correct_ratio, ("swapped", "angle-unit", "sense", "ratio")),
    Check(mesh.examine_speeds, mesh.correct_speeds, ("speed-unit",)),
    Check(mesh.compare_with_usual),
    Check(counts.examine_counts),
    Check(contact.examine_delay, contact.correct_delay, ("skew",)),
    Check(contact.examine_drift),
    Check(contact.examine_waves, contact.correct_waves, ("encoder-wave",)),
)
# Kinds that are corrected without being named: a row without a reading is of no use.
ALWAYS = ("drop-outs",)
CORRECTABLE = (*(kind for check in CHECKS for kind in check.kinds), "duplicated-file")


def examine(
    channels: Channels,
    rig: Scenario | None = None,
    others: Iterable[Channels] = (),
    needs: Sequence[str | Sequence[str]] = MESH,
    *,
    stated_motion: bool = False,
) -> tuple[Finding, ...]:
    """Return what is wrong with the sensors and the clock of a record.

    What can be corrected is corrected for the checks that come after, so that one pass finds everything; the record
    itself stays as it is. Behind a fault that nothing corrects, no further check is made.

    Args:
        channels: the record, unchecked.
        rig: scenario of the bench in this record's condition; without it, and without base radii in the metadata, the
            angles are not compared with each other.
        others: records given before, to find the same one given twice.
        needs: columns that must be there besides time; alternatives as a tuple. Only with both angles the gears count
            as meshing.
        stated_motion: whether the rig's ``[motion]`` is stated of this record; keys of its condition are in any case.

    Returns:
        The findings, in the order of the checks.

    >>> time = np.linspace(0.0, 1.0, 1001)
    >>> twice = np.sort(np.append(time, time[500]))
    >>> rows = Channels({"time_s": twice, "theta_drive_rad": twice, "theta_loose_rad": twice})
    >>> [(one.kind, one.size) for one in examine(rows)]
    [('duplicates', 1.0)]
    """
    about = declared(rig, channels.meta, needs, stated_of(channels.condition, rig, stated_motion))
    own, found = dict(channels.columns), columns.examine_decoded(channels.meta)
    view = View(own, about)
    for check in CHECKS:
        new = check.examine(view)
        found += new
        if any(finding.fatal and not finding.correctable for finding in new):
            break
        if any(finding.correctable for finding in new):
            own = _corrected(own, check, new, check.kinds)
            about = readings.quietest(mesh.recounted(about, new), new)
            view = View(own, about)
            if short := columns.empty(view):
                found += short
                break
    else:
        found += columns.examine_copies(channels, others)
    return tuple(found)


def correct(channels: Channels, findings: Sequence[Finding], kinds: Sequence[str]) -> Channels:
    """Return the record with some kinds of findings undone.

    Args:
        channels: the record that was examined.
        findings: of it.
        kinds: to correct.

    Raises:
        UsageError: a kind cannot be corrected.

    >>> time = np.array([0.0, 1.0, 1.0, 2.0, 3.0])
    >>> rows = Channels({"time_s": time, "theta_drive_rad": time, "theta_loose_rad": time})
    >>> correct(rows, examine(rows), ["duplicates"]).columns["time_s"].tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    refuse_unknown(kinds)
    own = dict(channels.columns)
    for check in CHECKS:
        own = _corrected(own, check, findings, [kind for kind in check.kinds if kind in kinds])
    return replace(channels, columns=own)


def refuse_unknown(kinds: Iterable[str]) -> None:
    """Refuse kinds that cannot be corrected.

    Raises UsageError when one is not known.
    """
    for kind in kinds:
        if kind not in CORRECTABLE:
            raise UsageError(f"{kind!r} cannot be corrected; {did_you_mean(kind, list(CORRECTABLE))}")


def _corrected(columns: Columns, check: Check, findings: Sequence[Finding], kinds: Sequence[str]) -> Columns:
    for kind in kinds:
        mine = [finding for finding in findings if finding.kind == kind and finding.correctable]
        if mine and check.correct is not None:
            columns = check.correct(columns, mine)
    return columns
