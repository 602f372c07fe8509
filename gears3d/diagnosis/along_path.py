"""The path's own verdict: causes by which it comes true, in the place of those of flights, contacts and impacts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis.cause import Cause, Fit, contribution, fit
from gears3d.diagnosis.path_search import EXCLUDED, SAME, SMALLEST, Path, path_search
from gears3d.diagnosis.precision import covariance
from gears3d.diagnosis.rivals import Rival, rivals
from gears3d.diagnosis.shooting import Windows, shootable

if TYPE_CHECKING:
    from gears3d.diagnosis.paths import Paths
    from gears3d.diagnosis.search import Search
    from gears3d.measured.checks import Admitted

Array = np.ndarray
ACCOUNTS = 4.0
"""Usual mean square of residuals, in variances of the noise, up to which the path counts as accounted for: 1/f noise,
for which a window's start makes up in part only, comes to three."""
FAINT = ("mesh_drag",)
"""Causes that are felt only where a flank is left, with their square: windows test them, but do not find them."""
SAME_PATH = {"transmission_error", "eccentricity"}
"""Errors of flanks that a path tells from those of the drive's encoder by its turn alone."""
LEAVES = 0.5
"""Part of the path's error beyond noise that causes may leave at most where it does not come true."""
UNSEEN = ("drive_motion",)
"""Causes that no path tells: the drive moves as measured."""


class Along(NamedTuple):
    """What the path makes of a search.

    Args:
        found: the search with the path's causes.
        covariance: of their numbers [SI], (p, p).
        others: what is not excluded in the place of each.
        path: how well they account for it.
        decides: whether they do; else the search's own causes are as they were.
        refutes: whether the search's own causes leave most of the path's error.
    """

    found: Search
    covariance: Array
    others: list[list[Rival]]
    path: Path
    decides: bool = True
    refutes: bool = False


def along_path(
    found: Search, admitted: Sequence[Admitted], paths: Paths, told: Callable[[float], None] = lambda part: None
) -> Along | None:
    """Return the causes by which the path comes true; ``None`` where no windows can be shot.

    Args:
        found: by the search in flights, contacts and impacts.
        admitted: the records.
        paths: of the records.
        told: called with the part that is done.
    """
    came = {one.file: one for one in admitted}
    pairs = [(one, came[one.name]) for one in found.records if one.name in came]
    rigs = [one.rig for _, one in pairs if one.rig is not None]
    if not rigs or len(rigs) < len(pairs) or not all(shootable(rig) for rig in rigs):
        return None
    periods = [rig.period if rig.motion.harmonics else np.inf for rig in rigs]
    windows = Windows(rigs[0], [paths.of(one) for _, one in pairs], periods, [one.turned for one, _ in pairs])
    kept = [one for one in found.fit.causes if one.candidate.kind in UNSEEN]
    first = [one for one in found.fit.causes if one.candidate.kind not in UNSEEN]
    known = [one for one in found.known.candidates if one.kind not in (*UNSEEN, *FAINT)]
    path = path_search(windows, known, first, told)
    if path is None:
        return None
    if path.after > ACCOUNTS and path.missed > SMALLEST * windows.backlash:
        leaves = (path.first - 1.0) / max(path.before - 1.0, 1e-9)
        return Along(found, found.fit.covariance, [], path, False, bool(first) and leaves > LEAVES)
    if first and (path.first <= ACCOUNTS or not _contradicted(first, path)):
        return Along(found, found.fit.covariance, [], path, False)
    causes, spread = _numbers(found, path, kept)
    now = _as_they_are(found, causes, spread)
    found = found._replace(fit=now)
    return Along(found, spread, _rivals(found, path), path)


def _rivals(found: Search, path: Path) -> list[list[Rival]]:
    """Return what was tried in the place of each cause: by the path, and in channels what the path was not asked."""
    told = []
    for k, own in enumerate(rivals(found.records, found)):
        mine = path.others[k] if k < len(path.others) else ()
        asked = {one.candidate.kind for one, _ in mine}
        least = max(EXCLUDED, SAME * float(path.gains[k])) if k < len(path.gains) else EXCLUDED
        made = [Rival((one,), worse, worse > least) for one, worse in mine]
        made += [one for one in own if one.causes[0].candidate.kind not in asked]
        told.append(sorted(made, key=lambda one: one.worse))
    return told


def _contradicted(first: Sequence[Cause], path: Path) -> bool:
    """Return whether the path excludes a cause that flights, contacts and impacts show."""
    able = {one.candidate.kind for one in path.causes}
    for own, gain in zip(path.others, path.gains, strict=True):
        able |= {one.candidate.kind for one, worse in own if worse < max(EXCLUDED, SAME * float(gain))}
    if "encoder_eccentricity" in able:
        able |= SAME_PATH  # flanks that stand out move the gear as a drive does whose encoder errs
    return not {one.candidate.kind for one in first} <= able


def _numbers(found: Search, path: Path, kept: Sequence[Cause]) -> tuple[list[Cause], Array]:
    """Return the causes with the numbers of path or channels, whichever are known better and agree."""
    own = fit(found.records, found.base, [*path.causes, *kept])
    theirs = covariance(found.records, own.causes) if own.causes else own.covariance
    size = len(path.covariance)
    spread = np.array(theirs, float)
    spread[:size, :size] = path.covariance
    causes, at = [], 0
    for cause, other in zip(path.causes, own.causes, strict=False):
        part = slice(at, at + len(cause.numbers))
        at = part.stop
        mine, its = np.diag(path.covariance)[part], np.diag(theirs)[part]
        near = np.all(np.abs(cause.numbers - other.numbers) < 3.0 * np.sqrt(mine + its))
        if near and np.all(its < mine) and np.all(its > 0.0):
            cause = other
            spread[part, part] = theirs[part, part]
        causes.append(cause)
    return [*causes, *own.causes[len(path.causes) :]], spread


def _as_they_are(found: Search, causes: Sequence[Cause], spread: Array) -> Fit:
    """Return causes with their numbers as a fit of the channels."""
    effects = [one.effect for one in causes if one.effect is not None]
    rest = found.base - contribution(found.records, effects)
    return Fit(tuple(causes), float(rest @ rest), spread, rest)
