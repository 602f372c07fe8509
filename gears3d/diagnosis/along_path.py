"""The path's own verdict: causes by which it comes true, before flights, contacts and impacts are asked one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis.aligned import ENOUGH
from gears3d.diagnosis.candidates import candidates
from gears3d.diagnosis.cause import Cause, Fit, contribution, fit
from gears3d.diagnosis.joint import settled
from gears3d.diagnosis.path_search import EXCLUDED, SAME, SMALLEST, Path, against, path_search
from gears3d.diagnosis.precision import covariance
from gears3d.diagnosis.rivals import Rival
from gears3d.diagnosis.search import Search, given, in_own_channels
from gears3d.diagnosis.shooting import Windows, shootable
from gears3d.diagnosis.verdict import PLACES
from gears3d.diagnosis.zeros import turn

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.diagnosis.paths import Paths
    from gears3d.measured.checks import Admitted

Array = np.ndarray
ACCOUNTS = 4.0
"""Usual mean square of residuals, in variances of the noise, up to which the path counts as accounted for: 1/f noise,
for which a window's start makes up in part only, comes to three."""
LEAVES = 0.5
"""Part of the path's error beyond noise that causes may leave at most where it does not come true."""
FAINT = ("mesh_drag",)
"""Causes that are felt only where a flank is left: the moments of that show what the path hardly does."""
UNSEEN = ("drive_motion",)
"""Causes that no path tells: the drive moves as measured."""
CLEAR = 0.02
"""Smallest size of an effect in each place, in units, that a path must show to tell that there is none."""
APART, KNOWN = 3.0, 0.005
"""Standard deviations by which a number from events may be off that from the path, and how well either is known at
best, in units."""


class AlongPath(NamedTuple):
    """What the path says of a rig.

    Args:
        windows: of the records, as the path's causes have them.
        path: the causes, and how well they account for it.
        records: turned to the zeros of one of them.
        highest: order that was looked for.
    """

    windows: Windows
    path: Path
    records: list[Evidence]
    highest: int

    @property
    def accounts(self) -> bool:
        """Whether the path comes true to its noise, or to the smallest size of a cause."""
        return self.path.after <= ACCOUNTS or self.path.missed <= SMALLEST * self.windows.backlash

    @property
    def decides(self) -> bool:
        """Whether the path comes true by causes, or shows that there is none, so that nothing else is to be asked."""
        if self.path.causes:
            return self.accounts
        clear = self.agrees and max(self.limits.values()) <= CLEAR
        return clear and not in_own_channels(given(self.records, self.highest, ()), FAINT)

    @property
    def agrees(self) -> bool:
        """Whether the path is that of the rig as it is, to its noise."""
        return not self.path.causes and self.path.after <= ACCOUNTS

    @property
    def limits(self) -> dict[str, float]:
        """Smallest size of an effect that the path shows, in units, by place."""
        return {place: max(self.path.seen.get(kind, np.inf), SMALLEST) for place, kind in PLACES.items()}

    def found(self) -> tuple[Search, list[list[Rival]]]:
        """Return the causes as a search has them, and what is not excluded in the place of each."""
        found = given(self.records, self.highest, self.path.causes)
        by, changed = settled(found.records, self.path.causes)
        if changed > ENOUGH:
            records = [turn(one, *each) for one, each in zip(self.records, by.tolist(), strict=True)]
            found = given(records, self.highest, self.path.causes)
        causes, spread = _numbers(found, self.path, in_own_channels(found, UNSEEN))
        rest = found.base - contribution(found.records, [one.effect for one in causes if one.effect is not None])
        now = Fit(tuple(causes), float(rest @ rest), spread, rest)
        return found._replace(fit=now), [*_rivals(self.path), *([] for _ in causes[len(self.path.causes) :])]

    def contradicted(self, found: Search) -> list[bool]:
        """Return which causes of a search the path gives another size, or leaves it as far off with.

        Args:
            found: by a search in channels.
        """
        causes = [one for one in found.fit.causes if one.candidate.kind not in UNSEEN]
        seen = against(self.windows, causes, [one.turned for one in found.records]) if causes else None
        if seen is None:
            return [False] * len(found.fit.causes)
        if not self.accounts:
            leaves = (seen.level - 1.0) / max(self.path.before - 1.0, 1e-9)
            wrong = dict.fromkeys(range(len(causes)), leaves > LEAVES)
        else:
            known, at, wrong = covariance(found.records, causes), 0, {}
            for k, (cause, other) in enumerate(zip(causes, seen.causes, strict=True)):
                own = slice(at, at + len(cause.numbers))
                at = own.stop
                spread = np.diag(known)[own] + np.diag(seen.covariance)[own] + (KNOWN * cause.units) ** 2
                wrong[k] = bool(np.any((cause.numbers - other.numbers) ** 2 > APART**2 * spread))
        told = iter(range(len(causes)))
        return [one.candidate.kind not in UNSEEN and wrong[next(told)] for one in found.fit.causes]


def along_path(
    records: Sequence[Evidence], admitted: Sequence[Admitted], paths: Paths, highest: int,
    told: Callable[[float], None] = lambda part: None,
) -> AlongPath | None:  # fmt: skip
    """Return the causes by which the path comes true, or what is left of it; ``None`` where no windows can be shot.

    Args:
        records: of one rig, as they were cut.
        admitted: the same, as they came in.
        paths: of the records.
        highest: order that is looked for.
        told: called with the part that is done.
    """
    came = {one.file: one for one in admitted}
    pairs = [(one, came[one.name]) for one in records if one.name in came]
    rigs = [one.rig for _, one in pairs if one.rig is not None]
    if not rigs or len(rigs) < len(pairs) or not all(shootable(rig) for rig in rigs):
        return None
    periods = [rig.period if rig.motion.harmonics else np.inf for rig in rigs]
    tracks, unmarked = [paths.of(one) for _, one in pairs], [one.unmarked for one, _ in pairs]
    windows = Windows(rigs[0], tracks, periods, unmarked)
    lasts = max(float(one.time[-1] - one.time[0]) for one in tracks)
    speed = float(np.mean([abs(one.motion.mean) for one in records]))
    known = candidates(replace(records[0].rig, mean_speed=speed), lasts, highest)
    path = path_search(windows, [one for one in known if one.kind not in (*UNSEEN, *FAINT)], told)
    if path is None:
        return None
    turned = {one.name: by for (one, _), by in zip(pairs, windows.turned.tolist(), strict=True)}
    return AlongPath(windows, path, [turn(one, *turned.get(one.name, (0.0, 0.0))) for one in records], highest)


def _rivals(path: Path) -> list[list[Rival]]:
    """Return what was tried in the place of each cause."""
    told = []
    for gain, own in zip(path.gains, path.others, strict=True):
        least = max(EXCLUDED, SAME * float(gain))
        told.append(sorted((Rival((one,), worse, worse > least) for one, worse in own), key=lambda one: one.worse))
    return told


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
