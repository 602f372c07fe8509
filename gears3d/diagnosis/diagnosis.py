"""The complete diagnosis: from records and a rig to deviations, causes, the extended rig and its held-out gain.

Causes are first selected by the trajectory residuals of multiple shooting (path search), which needs no segmentation.
If the residuals are noise, channels of flights, contacts and impacts only decide between hypotheses that windows do not
distinguish, and test causes that a trajectory does not determine. Otherwise all causes are selected in the channels.
"""

from __future__ import annotations

import pathlib
import tomllib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import EXCLUDED, SMALLEST, Candidate, Cause, Fit, candidates, contribution, fit
from gears3d.diagnosis.evidence import Paths, has_compliance, shootable, uncut
from gears3d.diagnosis.path_fit import ACCOUNTS, BODY, LAWS, OIL, RUB, SCATTER, SLIP, SOFT, effects_of
from gears3d.diagnosis.path_search import law_of_contact, path_search
from gears3d.diagnosis.pitch_error import search_with_resegmentation, tooth_synchronous_contact_loss
from gears3d.diagnosis.preprocessing import Note, segmented, settled, turn, usable
from gears3d.diagnosis.residual_patterns import Resonance, Structure, resonance
from gears3d.diagnosis.residual_tests import (
    EngineCheck,
    Split,
    consistent_causes,
    count_notes,
    engine_check,
    heldout_3d,
    heldout_summary,
    splits,
    whole_channels,
)
from gears3d.diagnosis.run_information import Path, covariance
from gears3d.diagnosis.search import (
    ENOUGH,
    Experiment,
    Probable,
    Rival,
    Search,
    blind,
    experiments,
    given,
    in_own_channels,
    posterior,
    rivals,
)
from gears3d.diagnosis.shooting import LONG, NOISE, Windows
from gears3d.diagnosis.shooting_kernels import Exhausted
from gears3d.diagnosis.validity import (
    Against,
    against,
    fitted_in,
    halves,
    level_in,
    own_scatter,
    scatter_patterns,
    split_accepted,
    tested_by_path,
    tested_by_prediction,
)
from gears3d.diagnosis.verdict import (
    PLACES,
    Named,
    classify,
    distinguished_by_channels,
    facts_of,
    is_sawtooth,
    is_sine,
    minimum_detectable,
    numbers_of,
    phase_notes,
    record_contributions,
    remaining,
    slip_angles,
    tooth_notes,
)
from gears3d.effects import Code, catalogue
from gears3d.errors import Fault, InputError
from gears3d.measured.checks import Admitted, admit_each
from gears3d.measured.drive_motion import DriveMotion
from gears3d.results import Result
from gears3d.scenario import Scenario, load

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence
    from gears3d.measured.segmentation import Track

Array = np.ndarray
# Largest part of the trajectory chi-square beyond noise that causes may leave, and the same where they leave more than
# noise that is known badly may have: 10 % of the error. In records of a model with springs for teeth five wrong causes
# left 8 % of it, the right one less than noise.
LEAVES, BEYOND = 0.5, 0.01
# Causes with an effect only near contact loss: its moments show them, the trajectory hardly does.
FAINT = ("mesh_drag",)
# Causes that no trajectory determines: the drive moves as measured.
UNSEEN = ("drive_motion",)
# Causes that move a flank from tooth to tooth, and nodes of a window per tooth from which on the trajectory follows it.
STEPS, PER_TOOTH = ("pitch_error",), 4.0
# Largest part of the windows that may diverge from the model: 0 to 6 % did in 17 rigs of the blind benchmark (space, 79
# to 102 and 309; space3, 303) whose causes were found or which had none, 9 to 20 % with a single tooth, 16 % where one
# record of six was of another rig.
PARTED = 0.075
# Standard deviations by which noise alone exceeds the usual mean square of a window.
CHANCE = 4.0
# Largest minimum detectable effect in each place, in units, at which the trajectory excludes one.
CLEAR = 0.02
# Fall of chi-square that the uncertainty of the drive's motion may explain where channels distinguish hypotheses: it
# was 1 to 17 in four records with a well-known drive, 124 to 472 in one whose drive is known to 1 %.
UNSURE = 64.0
# Work of trajectories of a search, with all else 0.1 to 0.15 µs each: about 40 minutes. Right searches of the blind
# benchmark took 1.1e9 with two causes (space2, 444), more than 5e9 with four (space4, 411).
WORK = 2e10
# Part of a cause's size from which its fit to a trajectory without it begins.
LITTLE = 0.05
# Phases at which stick-slip is tried, and part of the budget of a search for it.
SLIP_EFFORT = 0.02
SLIP_PHASES = tuple(np.pi / 6.0 * (k + 0.5) for k in range(-6, 6))
# Standard deviations by which a number from events may differ from that of the trajectory, and the least standard
# deviation of either, in units.
APART, KNOWN = 3.0, 0.005


class AlongPath(NamedTuple):
    """The result of the path search, with the tests that decide what the channels are used for.

    Args:
        windows: of the records, with the starts and datums of the fit.
        path: the causes, and the residuals that they leave.
        records: with angles shifted to a common datum.
        others: records that could not be segmented.
        names: of the records of the windows.
        left: residual beyond noise that the causes leave, and that of excluded records if they are the majority.
    """

    windows: Windows
    path: Path
    records: list[Evidence]
    others: list[Evidence]
    names: list[str]
    left: tuple[Structure, ...] = ()

    @property
    def accounts(self) -> bool:
        """Whether residuals are noise, or below the smallest size of a cause, in enough windows."""
        near = self.path.after <= ACCOUNTS or self.path.missed <= SMALLEST * self.windows.backlash
        return near and self.path.parted <= PARTED and not (self.path.causes and self._leaves(self.path.after))

    def _leaves(self, level: float) -> bool:
        """Return whether causes with that mean square residual leave more than noise, and too much of the error."""
        part = LEAVES if level <= ACCOUNTS else BEYOND
        return level > NOISE and level - 1.0 > part * max(self.path.before - 1.0, 1e-9)

    def holds_of(self, records: Sequence[Evidence]) -> bool:
        """Return whether the causes explain the trajectory of each record; scattering restitution predicts none.

        Args:
            records: of the windows.
        """
        if self.path.scatter is not None:
            return True
        level, missed, own = self._residuals(records)
        return all(self._is_explained(level[each], missed[each]) for each in own if np.any(each))

    def residual_of(self, records: Sequence[Evidence]) -> Structure:
        """Return the residual that the causes leave in records, with the one that shows it most.

        Args:
            records: of the windows.
        """
        level, missed, own = self._residuals(records)
        each = [float(np.median(level[mine])) if np.any(mine) else 0.0 for mine in own]
        most, size = max(each), float(np.sqrt(np.median(missed[np.any(own, axis=0)])))
        return Structure("path.all", most, 0.0, size, "m", float("nan"), most, records[int(np.argmax(each))].name)

    def _residuals(self, records: Sequence[Evidence]) -> tuple[Array, Array, list[Array]]:
        """Return mean squares of residuals in windows, the same in m², and which windows are of each record."""
        windows, effects = self.windows, effects_of(self.path.causes)
        level, missed = (windows.level(one(effects)) for one in (windows.residuals, windows.missed))
        return level, missed, [windows.record == self.names.index(one.name) for one in records]

    def _is_explained(self, level: Array, missed: Array) -> bool:
        """Return whether residuals of windows are noise, or below the smallest size of a cause."""
        off = float(np.sqrt(np.median(missed)))
        return float(np.median(level)) <= ACCOUNTS or off <= SMALLEST * self.windows.backlash

    @property
    def decides(self) -> bool:
        """Whether the trajectory determines the causes, or excludes any, so that no channel needs a search."""
        if self.path.causes or self.path.scatter:
            return self.accounts
        clear = self.agrees and max(self.limits.values()) <= CLEAR
        return clear and bool(self.records) and not in_own_channels(given(self.records, (), FAINT), FAINT)

    @property
    def zeros(self) -> dict[str, float]:
        """Displacement on the active flank, without deviations, by record [m]."""
        return dict(zip(self.names, (self.windows.origins + self.windows.zeros).tolist(), strict=True))

    @property
    def notes(self) -> tuple[Note, ...]:
        """What prevents the diagnosis: a search that exceeded its budget."""
        if self.path.complete:
            return ()
        text = "the search for causes needs more trajectories than it may compute; hypotheses were not all compared"
        remedy = "state known effects in the rig, diagnose fewer records, or raise --effort"
        return (Note("search-incomplete", text, remedy, "", True),)

    @property
    def carries(self) -> bool:
        """Whether a second body on the loose gear is among the causes."""
        return any(one.candidate.kind == BODY for one in self.path.causes)

    @property
    def vibrates(self) -> bool:
        """Whether a cause with a natural frequency, a second body or compliant teeth, is among the causes."""
        return any(one.candidate.kind in (BODY, SOFT) for one in self.path.causes)

    @property
    def agrees(self) -> bool:
        """Whether the rig without causes explains the trajectory to its noise."""
        none = not self.path.causes and self.path.scatter is None
        return none and self.path.after <= ACCOUNTS and self.path.parted <= PARTED

    @property
    def quiet(self) -> bool:
        """Whether the residuals of the rig without causes are noise alone, but for a few windows."""
        if not self.agrees or self.path.after > NOISE:
            return False
        most = max(NOISE, 1.0 + CHANCE * np.sqrt(2.0 * len(self.windows) / len(self.windows.window)))
        return float(np.mean(self._residuals(())[0] > most)) <= PARTED

    @property
    def limits(self) -> dict[str, float]:
        """Minimum detectable effect, in units, by place; compliant teeth have no restitution."""
        soft = any(row.code == Code.GAP_SPRING for row in self.windows.base)
        kinds = {place: kind for place, kind in PLACES.items() if not (soft and place == "impact")}
        return {place: max(self.path.seen.get(kind, np.inf), SMALLEST) for place, kind in kinds.items()}

    def found(self) -> tuple[Search, list[list[Rival]]]:
        """Return the causes as the result of a search, and the competing hypotheses of each."""
        others = [list(own) for own in self.path.others]
        if not self.records:
            found = blind(self.others)
            now = Fit(self.path.causes, 0.0, self.path.covariance, found.base)
            return found._replace(fit=now), others
        found = given(self.records, self.path.causes, UNSEEN)
        if any(one.candidate.kind in LAWS for one in self.path.causes):  # segmentation assumed rigid dry flanks
            causes, spread = [*self.path.causes], self.path.covariance
        else:
            by, changed = settled(found.records, self.path.causes)
            if changed > ENOUGH:
                records = [turn(one, *each) for one, each in zip(self.records, by.tolist(), strict=True)]
                found = given(records, self.path.causes, UNSEEN)
            known = self.path.unsure < UNSURE  # channels of the loose gear take the drive's measured motion as exact

            def off(causes: Sequence[Cause], k: int) -> bool:
                return self._off(found.records, causes, against(self.windows, causes, self._turned(found)))[k]

            first = distinguished_by_channels(found, self.path.causes, others, known, off)
            found = found._replace(fit=fit(found.records, found.base, first))
            causes, spread = numbers_of(found, self.path, first, in_own_channels(found, UNSEEN), self.windows.pivot)
        rest = found.base - contribution(found.records, [one.effect for one in causes if one.effect is not None])
        now = Fit(tuple(causes), float(rest @ rest), spread, rest)
        return found._replace(fit=now), [*others, *([] for _ in causes[len(others) :])]

    def held(self, found: Search) -> tuple[Split, ...]:
        """Return the held-out prediction by the causes: of channels, or of every second window with laws of contact.

        Args:
            found: with the causes.
        """
        if self.records and not any(one.candidate.kind in LAWS for one in found.fit.causes):
            return tuple(splits(found.records, found.fit.causes)) if found.fit.causes else ()
        predicted = halves(self.windows, found.fit.causes) if found.fit.causes else []
        return tuple(
            Split((name,), base, extended, min(extended, 1.0), gain, {"visit": (off, left)})
            for name, (base, extended, off, left, gain) in zip(("even windows", "odd windows"), predicted, strict=False)
        )

    def contradicted(self, found: Search) -> list[bool]:
        """Return which causes of a search have another size by the trajectory, or do not reduce its residuals.

        Args:
            found: by a search in channels.
        """
        causes = [one for one in found.fit.causes if one.candidate.kind not in UNSEEN]
        turn = float(np.max(self.windows.step[:, None] * np.abs(self.windows.drive[1])))  # of the drive between nodes
        if turn * self.windows.values.teeth_drive > 2.0 * np.pi / PER_TOOTH and any(
            one.candidate.kind in STEPS for one in causes
        ):
            return [False] * len(found.fit.causes)
        turned = self._turned(found)
        if self.agrees:
            wrong = {k: self._denies(found.records, one, turned) for k, one in enumerate(causes)}
        else:
            wrong = self._off(found.records, causes, against(self.windows, causes, turned) if causes else None)
        order = iter(range(len(causes)))
        return [one.candidate.kind not in UNSEEN and wrong[next(order)] for one in found.fit.causes]

    def _turned(self, found: Search) -> list[tuple[float, float]]:
        """Return the shifts of the angular datums of both gears in each record [rad]."""
        turned_of = {one.name: one.turned for one in (*self.others, *found.records)}
        return [turned_of.get(name, (0.0, 0.0)) for name in self.names]

    def _off(self, records: Sequence[Evidence], causes: Sequence[Cause], seen: Against | None) -> dict[int, bool]:
        """Return which causes have another size by the trajectory, or do not reduce its residuals."""
        if seen is None:
            return dict.fromkeys(range(len(causes)), False)
        if not self.accounts:
            return dict.fromkeys(range(len(causes)), self._leaves(seen.level))
        known, at, wrong = covariance(records, causes), 0, {}
        for k, (cause, other) in enumerate(zip(causes, seen.causes, strict=True)):
            own = slice(at, at + len(cause.numbers))
            at = own.stop
            spread = np.diag(known)[own] + np.diag(seen.covariance)[own] + (KNOWN * cause.units) ** 2
            wrong[k] = bool(np.any((cause.numbers - other.numbers) ** 2 > APART**2 * spread))
        return wrong

    def _denies(self, records: Sequence[Evidence], cause: Cause, turned: Sequence[tuple[float, float]]) -> bool:
        """Return whether a cause is detectable in the trajectory, which the rig without causes explains, and absent."""
        numbers = cause.numbers.copy()
        if cause.candidate.kind not in FAINT:  # whose sensitivity vanishes at size 0
            numbers[: 2 if cause.candidate.phased else 1] *= LITTLE
        seen = against(self.windows, [cause._replace(numbers=numbers)], turned)
        if seen is None:
            return False
        own = seen.causes[0].numbers
        apart, sure = cause.numbers - own, np.linalg.pinv(seen.covariance, hermitian=True)
        shows = bool(own @ sure @ own > EXCLUDED) and seen.level < self.path.after
        spread = np.diag(covariance(records, [cause])) + np.diag(seen.covariance)
        return bool(np.any(apart**2 > APART**2 * spread)) or (bool(apart @ sure @ apart > EXCLUDED) and not shows)


class Shown(NamedTuple):
    """Windows of the records, and the candidate causes.

    Args:
        windows: of the records.
        candidates: causes.
        records: those of the windows, not segmented.
        longer: makes windows in which causes must predict the motion.
    """

    windows: Windows
    candidates: list[Candidate]
    records: list[Evidence]
    longer: Callable[[], Windows]


def shown(admitted: Sequence[Admitted], paths: Paths, highest: int, slips: Sequence[float] = ()) -> Shown | None:
    """Return windows of records and candidate causes; ``None`` where multiple shooting does not cover the rig.

    Args:
        admitted: records of one rig.
        paths: of the records.
        highest: order that is searched.
        slips: angles of the loose gear between two slips, at which stick-slip is tried [rad].
    """
    tracks: list[tuple[Admitted, Track]] = []
    for one in admitted:
        with suppress(InputError):
            tracks.append((one, paths.of(one)))
    rigs = [one.rig for one, _ in tracks if one.rig is not None]
    if not rigs or len(rigs) < len(tracks) or not all(shootable(rig) for rig in rigs):
        return None
    periods = [rig.period if rig.motion.harmonics else np.inf for rig in rigs]
    unmarked = [tuple(one.recording.meta.get("zero_arbitrary", ())) for one, _ in tracks]
    made = partial(Windows, rigs[0], [known for _, known in tracks], periods, unmarked)
    windows = made()
    lasts = max(float(known.time[-1] - known.time[0]) for _, known in tracks)
    rig = replace(rigs[0].rig(), mean_speed=float(np.mean([abs(one.motion.mean) for one in rigs])))
    asked = [one for one in candidates(rig, lasts, highest) if one.kind not in UNSEEN]
    there = {row.code for row in rigs[0].rows()}
    if rig.face_width > 0.0 and Code.GAP_FILM not in there:
        unit = catalogue()[OIL](viscosity=1e-3).unit_size(rig)
        asked.append(Candidate(OIL, {}, "viscosity", unit, False, ()))
    if rig.drag_torque > 0.0 and Code.GAP_SPRING not in there:
        unit = catalogue()[SOFT](stiffness=1e6).unit_size(rig)
        asked.append(Candidate(SOFT, {"damping": 1.0}, "stiffness", unit, False, ()))
    if Code.GAP_SPRING in there and Code.TORQUE_FRICTION not in there:
        asked.append(Candidate(RUB, {}, "coefficient", 1.0, False, ()))
    if not there & {Code.GAP_FILM, Code.GAP_SPRING, Code.TORQUE_CARRIED} and not slips:
        asked.append(Candidate(BODY, {}, "inertia", rig.inertia, False, ()))
    every = [{"angle": angle, "phase": phase} for angle in slips for phase in SLIP_PHASES]
    asked += [Candidate(SLIP, one, "amplitude", rig.drag_torque, False, ()) for one in every if rig.drag_torque > 0.0]
    asked.append(Candidate(SCATTER, {}, "standard_deviation", max(rig.restitution, 0.1), False, ()))
    blank = [
        replace(uncut(rig, one.file), unmarked=lost) for rig, (one, _), lost in zip(rigs, tracks, unmarked, strict=True)
    ]
    return Shown(windows, asked, blank, partial(made, LONG))


def _searched(seen: Shown, work: float, progress: Callable[[float], None]) -> tuple[Windows, Path] | None:
    """Return windows and the causes that their trajectories show; ``None`` with too few.

    Causes are searched in longer windows where those found do not predict them, or have a law of contact: over one fall
    across the backlash a slow flight fits the motion on compliant teeth or in oil, and so does one of these the other.
    """
    windows, part_of_all = seen.windows, 1.0 if seen.windows.long else 0.5
    windows.work[:], found = work, None
    try:
        path = path_search(windows, seen.candidates, lambda part: progress(part_of_all * part))
        found = path and (windows, path)
        if path is not None and path.complete and path.scatter is None and not windows.long:
            found = _searched_longer(seen, path, progress)
    except Exhausted:
        found = found and (windows, found[1]._replace(complete=False))
    windows.work[:] = np.inf
    return found


def _searched_longer(seen: Shown, path: Path, progress: Callable[[float], None]) -> tuple[Windows, Path]:
    """Return windows and causes, searched in longer windows where needed, with what the first search left to spend."""
    windows, longer = seen.windows, seen.longer()
    longer.work = windows.work
    longer.zeros, longer.turned, longer.motion = windows.zeros.copy(), windows.turned.copy(), windows.motion
    level = level_in(longer, path.causes) if len(longer) else 0.0
    most = NOISE * max(path.after, 1.0)  # no cause for less than noise
    if level < most and not {one.candidate.kind for one in path.causes} & {OIL, SOFT}:
        return windows, path
    first = path.causes if level < most else fitted_in(longer, path.causes, most)
    longer = longer if first else seen.longer()  # datums of wrong causes are wrong
    longer.work = windows.work
    if not path.causes and not (first := law_of_contact(longer, seen.candidates)):
        return windows, path  # errors of the drive's motion grow with the length as well
    again = path_search(longer, seen.candidates, lambda part: progress(0.5 + 0.5 * part), first)
    if again is not None and again.complete and again.after < max(level, 1.0):
        return longer, again
    return windows, path._replace(complete=again is None or again.complete)


def along_path(
    records: Sequence[Evidence], admitted: Sequence[Admitted], paths: Paths, highest: int,
    progress: Callable[[float], None] = lambda part: None, effort: float = 1.0, slips: Sequence[float] = (),
) -> AlongPath | None:  # fmt: skip
    """Return the causes by multiple shooting and their residuals; ``None`` where it does not cover the rig.

    Args:
        records: of one rig, those that could be segmented.
        admitted: all records.
        paths: of the records.
        highest: order that is searched.
        progress: called with the part that is done.
        effort: multiple of the usual budget of the search.
        slips: angles of the loose gear between two slips, at which stick-slip is tried [rad].
    """
    seen = shown(admitted, paths, highest, slips)
    if seen is None or (searched := _searched(seen, effort * WORK, progress)) is None:
        return None
    windows, path = searched
    by = dict(zip([one.name for one in seen.records], windows.turned.tolist(), strict=True))
    measured, there = [turn(one, *by.get(one.name, (0.0, 0.0))) for one in records], {one.name for one in records}
    others = [replace(one, turned=tuple(by[one.name])) for one in seen.records if one.name not in there]
    found = AlongPath(windows, path, measured, others, list(by))
    if records and others and not (found.accounts and found.holds_of(others)):  # these may be of another rig
        there_only = [one for one in admitted if one.file in there]
        fewer = along_path(records, there_only, paths, highest, progress, effort, slips)
        many = fewer is not None and len(others) > len(records)
        return fewer._replace(left=(found.residual_of(others),)) if fewer is not None and many else fewer
    beyond = path.causes and path.scatter is None and path.after > ACCOUNTS  # small, but not noise
    return found._replace(left=(found.residual_of([*measured, *others]),)) if beyond else found


# Highest order that is searched, unless the numbers of teeth require more.
HIGHEST_ORDER = 40
HEAD = "[[effect]]"


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Result):
    """Deviations of a rig from records, their causes, and the held-out error reduction of the extension.

    Args:
        verdict: ``nothing_to_add``, ``explained``, ``partly_explained``, ``unexplained`` or ``not_decidable``.
        causes: those of greatest gain first.
        left: residual patterns, strongest first, then channels that deviate as a whole.
        held: held-out error reduction by record or stretch.
        power: minimum detectable effect, in units of its channel, by place.
        extended: the rig with the causes; the rig itself without any.
        records: contribution of each record.
        findings: of the sensor gate, by record.
        found: result of the search.
        others: competing hypotheses of each cause of the search.
        notes: conditions that weaken or prevent the diagnosis.
        suspects: candidate causes with insufficient data.
        bodies: held-out error reduction in the 3D engine; ``None`` if not requested.
        runs: proposed runs that separate causes from competing hypotheses.
        rings: a resonance of the readings, if any.
        motions: of the drive as measured by its encoder, by record.
        zeros: displacement on the active flank by record [m], if the path determines it.
    """

    verdict: str
    causes: tuple[Named, ...]
    left: tuple[Structure, ...]
    held: tuple[Split, ...]
    power: dict[str, float]
    extended: Scenario
    records: tuple[dict[str, Any], ...]
    findings: dict[str, list[dict[str, Any]]]
    found: Search = field(repr=False)
    others: list[list[Rival]] = field(repr=False)
    notes: tuple[Note, ...] = ()
    suspects: tuple[Named, ...] = ()
    bodies: EngineCheck | None = None
    runs: tuple[Experiment, ...] = ()
    rings: Resonance | None = field(default=None, repr=False)
    motions: dict[str, DriveMotion] = field(default_factory=dict, repr=False)
    zeros: dict[str, float] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        causes = " + ".join(one.kind for one in self.causes) or "no cause"
        left = [f"residual {self.left[0].name}"] if self.left else []
        return f"Diagnosis({', '.join([self.verdict, causes, *left])})"

    def _repr_html_(self) -> str:
        from gears3d import notebook

        summary = heldout_summary(self.held)
        numbers = (
            (f"{one.kind}: {name}", f"{number.value:.5g} {number.unit} (95 %: {number.low:.5g} to {number.high:.5g})")
            for one in self.causes
            for name, number in one.parameters.items()
        )
        gain = "" if summary["gain"] is None else f"{100.0 * summary['gain']:.4g} %"
        rows = [*numbers, *((one.kind, one.evidence) for one in self.causes), ("held-out error reduction", gain)]
        rows += [("residual pattern", one.name) for one in self.left] + [("note", one.text) for one in self.notes]
        return notebook.table(f"Diagnosis: {self.verdict.replace('_', ' ')}", rows)

    @property
    def posterior(self) -> tuple[Probable, ...]:
        """Return the most probable sets of causes, best first, and the probability of all others."""
        return posterior([one.options for one in self.causes])

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary in the form of the contract."""
        return {
            "verdict": self.verdict,
            "causes": [one.to_dict() for one in self.causes],
            "posterior": [one.to_dict() for one in self.posterior],
            "heldout": heldout_summary(self.held),
            "heldout_3d": heldout_3d(self.bodies),
            "remaining": remaining(self.left),
            "power": {place: limit if np.isfinite(limit) else None for place, limit in self.power.items()},
            "records": [
                {**row, "drive_motion": self.motions[row["name"]].to_dict() if row["name"] in self.motions else None}
                for row in self.records
            ],
            "findings": self.findings,
            "notes": [one.to_dict() for one in self.notes],
            "suspects": [one.to_dict() for one in self.suspects],
            "experiments": [one.to_dict() for one in self.runs],
        }


def diagnose(
    records: Sequence[Admitted] | Sequence[str | pathlib.Path] | str | pathlib.Path,
    rig: Scenario | str | pathlib.Path,
    progress: Callable[[str, float], None] | None = None,
    *,
    bodies: bool = False,
    runs: bool = False,
    stated_motion: bool = False,
    effort: float = 1.0,
) -> Diagnosis:
    """Find the deviations of a rig from measured records, name the causes, extend the rig and measure the gain.

    Args:
        records: that passed the sensor gate, each with the rig of its own condition; or files, or maps that name them,
            which the sensor gate tests first (:func:`gears3d.measured.checks.admit_all`).
        rig: scenario of the test rig, or its file.
        progress: called with the current task and the completed part of the whole.
        bodies: whether the gain is measured in the 3D engine as well.
        runs: whether runs are proposed that separate causes from competing hypotheses that are not excluded.
        stated_motion: whether the rig's ``[motion]`` is a statement about records that are given as files.
        effort: multiple of the usual budget of the search for causes by trajectories.

    Returns:
        The diagnosis.

    Raises:
        InputError: a record cannot be read or measured, or is missing.

    Theory: docs/theory/diagnosis.md, equations (1), (3).
    """
    admitted, bench = _opened(records, rig, stated_motion)
    found = _diagnosed(admitted, bench, progress or (lambda doing, part: None), bodies, runs, effort)
    return replace(found, motions={one.file: one.motion for one in admitted if one.motion is not None})


def _diagnosed(
    admitted: Sequence[Admitted], rig: Scenario, tell: Callable[[str, float], None], bodies: bool, runs: bool,
    effort: float,
) -> Diagnosis:  # fmt: skip
    admitted_all, (admitted, notes), paths = admitted, usable(admitted), Paths()
    highest = max(HIGHEST_ORDER, rig.rig().teeth_drive + 2, rig.rig().teeth_loose + 2)

    def searched(records: Sequence[Evidence], slips: Sequence[float] = ()) -> AlongPath | None:
        doing = f"searching for {'stick-slip' if slips else 'causes of the path'}"
        first, last, share = (0.84, 0.85, SLIP_EFFORT) if slips else (0.6, 0.7, 1.0)

        def report(part: float) -> None:
            tell(doing, first + (last - first) * part)

        return along_path(records, admitted, paths, highest, report, share * effort, slips)

    if has_compliance(rig):
        whole = searched([])
        if whole is not None and (whole.decides or whole.agrees):
            return _by_path(admitted_all, rig, notes, whole, tell, bodies, runs, highest)
        stated = [*notes, _not_explained(whole), *(whole.notes if whole is not None else ())]
        return _unsegmented(admitted_all, rig, stated, "not_decidable")
    records, refused = [], None
    try:
        records, notes = segmented(admitted, notes, tell, paths)
    except InputError as error:  # compliance, an oil film or a resonance may prevent segmentation
        refused = error
    rings = resonance(admitted, paths)
    if refused is not None:
        whole = searched([])  # a body that the gear carries rings, and so do compliant teeth
        if whole is not None and (whole.decides or whole.agrees) and (rings is None or whole.vibrates):
            return _by_path(admitted_all, rig, notes, whole, tell, bodies, runs, highest)
        if rings is not None:
            return _unsegmented(admitted_all, rig, notes, "unexplained", rings)
        raise refused
    whole = searched(records)
    if whole is not None and whole.carries and is_sine(whole.windows, whole.path.causes):
        whole = None
    if whole is not None and whole.decides and (rings is None or whole.path.causes or whole.path.scatter):
        return _by_path(admitted_all, rig, notes, whole, tell, bodies, runs, highest)
    records, found, short = search_with_resegmentation(admitted, records, highest, paths, tell)
    beyond = [] if rings is None else [rings.structure]
    beyond += tooth_synchronous_contact_loss(found.records, found.fit.causes) if short is None else []
    found, left, coarse = consistent_causes(found, highest, beyond)
    slips = slip_angles(left, rig) if rings is None else []
    again = searched(records, slips) if slips else None
    if again is not None and again.path.complete and again.decides and is_sawtooth(again.windows, again.path.causes):
        return _by_path(admitted_all, rig, notes, again, tell, bodies, runs, highest)
    scatter = own_scatter(records, found, left) if rings is None else None
    if whole is not None and (whole.path.scatter is None or scatter_patterns(whole.path.deviations, highest)):
        scatter = None
    elif whole is not None and scatter is not None and whole.path.after <= ACCOUNTS:
        scatter = whole.path.scatter  # weak rebounds, which are missed, bias the other
    notes = [*notes, *(whole.notes if whole is not None else ())]
    tell("testing competing hypotheses", 0.85)
    others = rivals(found.records, found)
    accepted = split_accepted(found, others, scatter, short, rig, notes)
    tell("predicting the displacement from measured states", 0.88)
    accepted, far = tested_by_prediction(accepted, admitted, paths)
    if whole is not None and short is None and rings is None:
        accepted = tested_by_path(accepted, whole.path, whole.contradicted(accepted.found), whole.agrees)
    found, others, causes = accepted.found, accepted.others, accepted.causes
    notes = [*accepted.notes, *phase_notes(causes), *tooth_notes(found.records)]
    off, coarse_too = whole_channels(found, left)
    notes += count_notes(found.records, [*coarse, *coarse_too])
    left = [*left, *off, *far]
    tell("predicting held-out records", 0.9)
    held = tuple(splits(found.records, found.fit.causes)) if found.fit.causes else ()
    solid, proposed = _further(found, others, tell, bodies, runs)
    tell("done", 1.0)
    limits = minimum_detectable(found.known) if rings is None else {}
    if whole is not None and whole.agrees and not causes and (whole.quiet or not accepted.suspects):
        left = []  # residuals of single events come from segmentation
        limits = {place: min(limit, whole.limits[place]) for place, limit in limits.items()}
    verdict = classify(causes, left, limits) if accepted.decides else "not_decidable"
    return Diagnosis(verdict, causes, tuple(left), held, limits, _extended(rig, causes),
                     tuple(record_contributions(found.records)), _findings(admitted_all), found, others, tuple(notes),
                     accepted.suspects, solid, runs=proposed, rings=rings)  # fmt: skip


def _by_path(
    admitted: Sequence[Admitted], rig: Scenario, notes: list[Note], whole: AlongPath,
    tell: Callable[[str, float], None], bodies: bool, runs: bool, highest: int,
) -> Diagnosis:  # fmt: skip
    """Return the diagnosis of records whose path is explained with causes, or without any."""
    found, others = whole.found()
    notes = [
        one._replace(text=one.text.replace("record excluded:", "not segmented, only its path is used:"))
        if one.kind == "not-measured" and (not one.record or one.record in whole.names)
        else one
        for one in notes
    ]
    notes += whole.notes
    patterns = scatter_patterns(whole.path.deviations, highest)
    left = [*patterns, *whole.left]
    known = sorted(found.records + (whole.others if whole.records else []), key=lambda x: whole.names.index(x.name))
    spread = None if patterns else whole.path.scatter
    accepted = split_accepted(found, others, spread, None, rig, notes, whole.path, known, whole.windows)
    found, causes = accepted.found, accepted.causes
    tell("predicting held-out records", 0.9)
    held, (solid, proposed) = whole.held(found), _further(found, accepted.others, tell, bodies, runs)
    stated = (*accepted.notes, *phase_notes(causes), *tooth_notes(found.records))
    verdict = classify(causes, left, whole.limits) if accepted.decides else "not_decidable"
    tell("done", 1.0)
    return Diagnosis(verdict, causes, tuple(left), held, whole.limits, _extended(rig, causes),
                     tuple(record_contributions(known)), _findings(admitted), found, accepted.others, stated,
                     accepted.suspects, solid, runs=proposed, zeros=whole.zeros)  # fmt: skip


def _opened(
    records: Sequence[Admitted] | Sequence[str | pathlib.Path] | str | pathlib.Path,
    rig: Scenario | str | pathlib.Path,
    stated_motion: bool,
) -> tuple[Sequence[Admitted], Scenario]:
    """Return admitted records and the rig, read from their files where these are given."""
    bench = load(rig) if isinstance(rig, str | pathlib.Path) else rig
    named = [records] if isinstance(records, str | pathlib.Path) else records
    admitted = [one for one in named if isinstance(one, Admitted) and not one.repeats]
    files = [one for one in named if not isinstance(one, Admitted)]
    admitted += admit_each(files, bench, others=[one.channels for one in admitted], stated_motion=stated_motion).all()
    if not admitted:
        raise InputError(Fault("", "no record is given", "name at least one"))
    return admitted, bench


def _further(
    found: Search, others: list[list[Rival]], tell: Callable[[str, float], None], bodies: bool, runs: bool
) -> tuple[EngineCheck | None, tuple[Experiment, ...]]:
    """Return the check of causes in the 3D engine and the runs that separate hypotheses, each if requested."""
    solid, proposed = None, ()
    if bodies:
        doing = "predicting held-out events in the 3D engine"
        solid = engine_check(found.records, found.fit.causes, lambda part: tell(doing, 0.92 + 0.03 * part))
    if runs:
        doing = "searching for experiments that distinguish competing hypotheses"
        proposed = experiments(found, others, lambda part: tell(doing, 0.95 + 0.05 * part))
    return solid, proposed


def _not_explained(whole: AlongPath | None) -> Note:
    """Return the note of a rig with a law of contact whose trajectories neither agree nor are explained."""
    text = "records are not segmented with compliant or lubricated flanks, and too few windows show their motion"
    if whole is not None:
        text = "trajectories with compliant or lubricated flanks deviate from the nominal model by "
        text += f"{np.sqrt(whole.path.before):.3g} sigma"
    remedy = "in addition to the contact law of the rig, no set of causes explains them"
    return Note("yielding-flanks", text, remedy, "", True)


def _unsegmented(
    admitted: Sequence[Admitted], rig: Scenario, notes: Sequence[Note], verdict: str, rings: Resonance | None = None
) -> Diagnosis:
    """Return the diagnosis of records that are not, or cannot be, segmented."""
    found = blind([uncut(one.rig, one.file) for one in admitted if one.rig is not None])
    left = () if rings is None else (rings.structure,)
    return Diagnosis(verdict, (), left, (), {}, rig, tuple(record_contributions(found.records)), _findings(admitted),
                     found, [], tuple(notes), rings=rings)  # fmt: skip


def _extended(rig: Scenario, causes: Sequence[Named]) -> Scenario:
    """Return the rig with the causes; the rig itself without any."""
    return rig.with_([("effect[+]", one.table) for one in causes]) if causes else rig


def _findings(admitted: Sequence[Admitted]) -> dict[str, list[dict[str, Any]]]:
    """Return the findings of the sensor gate by record."""
    return {one.file: [each.to_dict() for each in one.findings] for one in admitted}


def extended_text(found: Diagnosis) -> str:
    """Return the extended scenario as text, with a comment above each cause.

    Args:
        found: the diagnosis; without causes the text is that of the rig.
    """
    text = found.extended.document
    lines = text.splitlines()
    heads = [k for k, line in enumerate(lines) if line.strip() == HEAD]
    if not found.causes or len(heads) < len(found.causes):
        return text
    for k, cause in reversed(list(zip(heads[-len(found.causes) :], found.causes, strict=True))):
        lines[k:k] = ["", *(f"# {line}" for line in facts_of(cause))]
    commented = "\n".join(lines) + "\n"
    return commented if tomllib.loads(commented) == tomllib.loads(text) else text
