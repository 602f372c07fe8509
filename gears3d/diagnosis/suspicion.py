"""Causes found by the search without support from records, rig or predicted path: they are not accepted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import score
from gears3d.diagnosis.cause import fit
from gears3d.diagnosis.grounds import Note, carried, of_causes, of_records, of_speeds
from gears3d.diagnosis.quantisation import alone, are_coarse
from gears3d.diagnosis.search import directions
from gears3d.diagnosis.verdict import Named, name_causes
from gears3d.diagnosis.windows import path_errors
from gears3d.errors import EngineError, InputError

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Paths
    from gears3d.diagnosis.path_search import Path
    from gears3d.diagnosis.search import Rival, Search
    from gears3d.diagnosis.structure import Structure
    from gears3d.measured.checks import Admitted
    from gears3d.scenario import Scenario

Array = np.ndarray
# Cause with random impacts, after which no path can be predicted.
SCATTER = "restitution_scatter"


class Parted(NamedTuple):
    """Causes that are accepted, and those that are not.

    Args:
        found: the search with the accepted causes.
        others: their competing hypotheses.
        causes: in words.
        suspects: those not accepted, in words.
        notes: all of them.
        decides: whether a verdict may be given.
    """

    found: Search
    others: list[list[Rival]]
    causes: tuple[Named, ...]
    suspects: tuple[Named, ...]
    notes: tuple[Note, ...]
    decides: bool


def part(
    found: Search,
    others: list[list[Rival]],
    beside: Sequence[Named],
    rig: Scenario,
    notes: Sequence[Note],
    path: Path | None = None,
) -> Parted:
    """Separate the causes that records and rig support from those that they do not."""
    named = sorted([*name_causes(found, others, path), *beside], key=lambda one: -one.gain)
    weak = _not_carried(found) if path is None else [None] * len(found.fit.causes)
    own = [cause.effect for cause, why in zip(found.fit.causes, weak, strict=True) if why is None]
    told = [
        *notes,
        *of_records(found.records),
        *of_causes(rig, own),
        *of_speeds(found.records, own),
        *(why for why in weak if why is not None),
    ]
    blocked = any(one.blocks for one in told)
    stays = [why is None and not blocked for why in weak]
    kept = [cause.effect for cause, stay in zip(found.fit.causes, stays, strict=True) if stay]
    causes = tuple(one for one in named if not blocked and (one.effect in kept or one in beside))
    suspects = tuple(one for one in named if one not in causes)
    if not all(stays):
        found = _only(found, stays)
        others = [each for each, stay in zip(others, stays, strict=True) if stay]
    return Parted(found, others, causes, suspects, tuple(told), not blocked and (bool(causes) or not suspects))


def predicted(parted: Parted, admitted: Sequence[Admitted], paths: Paths) -> tuple[Parted, list[Structure]]:
    """Return the causes that improve the prediction of the path, and the residual of the path."""
    if not parted.causes:
        return parted, []
    try:
        errors = path_errors(parted.found.records, parted.causes, admitted, paths.of)
    except (EngineError, InputError):  # the model does not cover the rig
        return parted, []
    refuted, chance = errors.refuted(), any(one.kind == SCATTER for one in parted.causes)
    left = [] if chance else errors.left()
    if not any(refuted):
        return parted, left
    told = [
        Note(
            "path-refutes",
            f"{one.kind}: in {len(errors.base)} windows that begin in measured states, the model without it comes"
            f" nearer to the measured displacement: {_um(own)} without it, {_um(errors.extended)} with it,"
            f" {_um(errors.base)} for the rig as it is",
            "check the motion, the counts and the condition of the records",
        )
        for one, own, bad in zip(parted.causes, errors.without, refuted, strict=True)
        if bad
    ]
    causes = tuple(one for one, bad in zip(parted.causes, refuted, strict=True) if not bad)
    suspects = (*(one for one in parted.causes if one not in causes), *parted.suspects)
    kept = [one.effect for one in causes]
    stays = [cause.effect in kept for cause in parted.found.fit.causes]
    others = [each for each, stay in zip(parted.others, stays, strict=True) if stay]
    found = parted.found if all(stays) else _only(parted.found, stays)
    decides = parted.decides and bool(causes)
    return Parted(found, others, causes, suspects, (*parted.notes, *told), decides), left if causes else []


def unproven(parted: Parted, path: Path, wrong: Sequence[bool]) -> Parted:
    """Return candidate causes that the path contradicts in size, or that hardly reduce its error."""
    bad = [cause.effect for cause, own in zip(parted.found.fit.causes, wrong, strict=True) if own]
    refuted = tuple(one for one in parted.causes if one.effect in bad)
    if not refuted:
        return parted
    text = (
        f"{', '.join(one.kind for one in refuted)}: the displacement predicted in {path.windows} windows contradicts"
        f" it: it deviates by {np.sqrt(path.before):.3g} times the noise for the rig as it is, and by"
        f" {np.sqrt(path.after):.3g} times with the causes that it shows itself"
    )
    told = Note("path-refutes", text, "check the motion, the counts and the condition of the records")
    stays = [not own for own in wrong]
    others = [each for each, stay in zip(parted.others, stays, strict=True) if stay]
    causes = tuple(one for one in parted.causes if one not in refuted)
    return Parted(_only(parted.found, stays), others, causes, (*refuted, *parted.suspects), (*parted.notes, told),
                  parted.decides and bool(causes))  # fmt: skip


def _um(errors: Array) -> str:
    return f"{1e6 * float(np.sqrt(np.mean(errors**2))):.3g} um"


def _not_carried(found: Search) -> list[Note | None]:
    """Return why records do not support each cause, ``None`` where they do; compensated ones are tested again."""
    weak = [carried(found.records, cause) for cause in found.fit.causes]
    while are_coarse(found.records):
        stays = [k for k, why in enumerate(weak) if why is None]
        now = fit(found.records, found.base, [found.fit.causes[k] for k in stays])
        anew = [alone(found.records, now.rest, cause) for cause in now.causes]
        if not any(anew):
            break
        for k, why in zip(stays, anew, strict=True):
            weak[k] = why
    return weak


def _only(found: Search, stays: Sequence[bool]) -> Search:
    """Return a search with some of its causes, refitted."""
    causes = [cause for cause, stay in zip(found.fit.causes, stays, strict=True) if stay]
    now = fit(found.records, found.base, causes)
    return found._replace(fit=now, left=score(found.known, now.rest, directions(found.records, now)))
