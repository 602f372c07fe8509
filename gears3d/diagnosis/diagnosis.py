"""The complete diagnosis: from records and a rig to deviations, causes, the extended rig and its held-out gain."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.diagnosis.along_path import AlongPath, along_path
from gears3d.diagnosis.causes import significant_digits
from gears3d.diagnosis.contact_law import (
    ContactLawFit,
    EpisodeAnalysis,
    contact_law_of,
    contact_law_with_others,
    has_compliance,
)
from gears3d.diagnosis.evidence import Paths, uncut
from gears3d.diagnosis.heldout import EngineCheck, Split, engine_check, heldout_3d, heldout_summary, splits
from gears3d.diagnosis.pitch_error import search_with_resegmentation, tooth_synchronous_contact_loss
from gears3d.diagnosis.preprocessing import (
    Note,
    segmented,
    usable,
)
from gears3d.diagnosis.residual_patterns import Resonance, Structure, resonance
from gears3d.diagnosis.residual_tests import (
    consistent_causes,
    count_notes,
    own_scatter,
    whole_channels,
)
from gears3d.diagnosis.search import Experiment, Probable, Rival, Search, blind, experiments, posterior, rivals
from gears3d.diagnosis.validity import phase_notes, split_accepted, tested_by_path, tested_by_prediction, tooth_notes
from gears3d.diagnosis.verdict import (
    Named,
    classify,
    minimum_detectable,
    name_contact_law,
    record_contributions,
    remaining,
)
from gears3d.errors import Fault, InputError
from gears3d.measured.checks import Admitted, admit_each
from gears3d.measured.drive_motion import DriveMotion
from gears3d.results import Result
from gears3d.scenario import Scenario, load
from gears3d.units import show

# Highest order that is searched, unless the numbers of teeth require more.
HIGHEST_ORDER = 40
_NO_ENGINE_CHECK = EngineCheck(
    (), (), {}, "the contact law is identified from complete contact episodes, which the engine cannot start in between"
)
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
        law: law of contact from contact episodes, if any; results of segmentation are then discarded.
        runs: proposed runs that separate causes from competing hypotheses.
        rings: a resonance of the readings, if any.
        motions: of the drive as measured by its encoder, by record.
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
    law: ContactLawFit | None = field(default=None, repr=False)
    runs: tuple[Experiment, ...] = ()
    rings: Resonance | None = field(default=None, repr=False)
    motions: dict[str, DriveMotion] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        causes = " + ".join(one.kind for one in self.causes) or "no cause"
        left = [f"residual {self.left[0].name}"] if self.left else []
        return f"Diagnosis({', '.join([self.verdict, causes, *left])})"

    def _repr_html_(self) -> str:
        from gears3d import notebook

        told = heldout_summary(self.held)
        numbers = (
            (f"{one.kind}: {name}", f"{number.value:.5g} {number.unit} (95 %: {number.low:.5g} to {number.high:.5g})")
            for one in self.causes
            for name, number in one.parameters.items()
        )
        gain = "" if told["gain"] is None else f"{100.0 * told['gain']:.4g} %"
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
    records: Sequence[Admitted] | Sequence[str | Path] | str | Path,
    rig: Scenario | str | Path,
    progress: Callable[[str, float], None] | None = None,
    *,
    bodies: bool = False,
    runs: bool = False,
    stated_motion: bool = False,
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

    Returns:
        The diagnosis.

    Raises:
        InputError: a record cannot be read or measured, or is missing.

    Theory: docs/theory/diagnosis.md, equations (1), (3).
    """
    admitted, bench = _opened(records, rig, stated_motion)
    found = _diagnosed(admitted, bench, progress or (lambda doing, part: None), bodies, runs)
    return replace(found, motions={one.file: one.motion for one in admitted if one.motion is not None})


def _diagnosed(
    admitted: Sequence[Admitted], rig: Scenario, tell: Callable[[str, float], None], bodies: bool, runs: bool
) -> Diagnosis:
    admitted_all, (admitted, notes), paths = admitted, usable(admitted), Paths()
    highest = max(HIGHEST_ORDER, rig.rig().teeth_drive + 2, rig.rig().teeth_loose + 2)

    def searching(part: float) -> None:
        tell("searching for causes of the path", 0.6 + 0.1 * part)

    if has_compliance(rig):
        whole = along_path([], admitted, paths, highest, searching)
        if whole is not None and (whole.decides or whole.agrees):
            return _by_path(admitted_all, rig, notes, whole, tell, bodies, runs)
        seen = contact_law_of(admitted, notes, tell, paths)
        if (law := seen.law or (None if seen.agrees else contact_law_with_others(seen))) is not None:
            return _by_contact_law(admitted_all, rig, notes, law, bodies)
        return _with_compliance(admitted_all, rig, notes, seen)
    records, refused = [], None
    try:
        records, notes = segmented(admitted, notes, tell, paths)
    except InputError as error:  # compliance, an oil film or a resonance may prevent segmentation
        refused = error
    rings = resonance(admitted, paths)
    if refused is not None:
        whole = along_path([], admitted, paths, highest, searching)  # a body that the gear carries rings, too
        if whole is not None and whole.decides and (rings is None or whole.carries):
            return _by_path(admitted_all, rig, notes, whole, tell, bodies, runs)
        seen = contact_law_of(admitted, notes, tell, paths)
        if (law := seen.law or contact_law_with_others(seen)) is not None:
            return _by_contact_law(admitted_all, rig, notes, law, bodies)
        if rings is not None:
            return _unsegmented(admitted_all, rig, notes, "unexplained", rings)
        raise refused
    whole = along_path(records, admitted, paths, highest, searching)
    if whole is not None and whole.decides and (rings is None or whole.path.causes or whole.path.scatter):
        return _by_path(admitted_all, rig, notes, whole, tell, bodies, runs)
    quiet = whole is not None and whole.quiet  # no law of contact makes it nearer
    seen = EpisodeAnalysis(None, None) if quiet else contact_law_of(admitted, notes, tell, paths)
    if seen.law is not None:
        return _by_contact_law(admitted_all, rig, notes, seen.law, bodies)
    records, found, short = search_with_resegmentation(admitted, records, highest, paths, tell)
    beyond = [] if rings is None else [rings.structure]
    beyond += tooth_synchronous_contact_loss(found.records, found.fit.causes) if short is None else []
    found, left, coarse = consistent_causes(found, highest, beyond)
    if left and not beyond and (law := contact_law_with_others(seen)) is not None:
        return _by_contact_law(admitted_all, rig, notes, law, bodies)
    scatter = own_scatter(records, found, left) if rings is None else None
    if scatter is not None and whole is not None and whole.denies_scatter(scatter.value):
        scatter = None
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
    tell: Callable[[str, float], None], bodies: bool, runs: bool,
) -> Diagnosis:  # fmt: skip
    """Return the diagnosis of records whose path is explained with causes, or without any."""
    found, others = whole.found()
    notes = [
        one._replace(text=one.text.replace("record excluded:", "not segmented, only its path is used:"))
        if one.kind == "not-measured"
        else one
        for one in notes
    ]
    accepted = split_accepted(found, others, whole.path.scatter, None, rig, notes, whole.path)
    found, causes = accepted.found, accepted.causes
    tell("predicting held-out records", 0.9)
    held = whole.held(found)
    solid, proposed = _further(found, accepted.others, tell, bodies, runs)
    limits, known = whole.limits, found.records + (whole.others if whole.records else [])
    told = (*accepted.notes, *phase_notes(causes), *tooth_notes(found.records))
    verdict = classify(causes, [], limits) if accepted.decides else "not_decidable"
    tell("done", 1.0)
    return Diagnosis(verdict, causes, (), held, limits, _extended(rig, causes), tuple(record_contributions(known)),
                     _findings(admitted), found, accepted.others, told, accepted.suspects, solid,
                     runs=proposed)  # fmt: skip


def _opened(
    records: Sequence[Admitted] | Sequence[str | Path] | str | Path, rig: Scenario | str | Path, stated_motion: bool
) -> tuple[Sequence[Admitted], Scenario]:
    """Return admitted records and the rig, read from their files where these are given."""
    bench = load(rig) if isinstance(rig, str | Path) else rig
    named = [records] if isinstance(records, str | Path) else records
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


def _by_contact_law(
    admitted: Sequence[Admitted], rig: Scenario, notes: list[Note], law: ContactLawFit, bodies: bool
) -> Diagnosis:
    """Return the diagnosis of a law of contact; segmentation by rigid flanks adds nothing to it."""
    causes = name_contact_law(law)
    found = blind([uncut(one.scenario, one.name) for one in law.records])
    rows = zip(record_contributions(found.records), law.records, strict=True)
    contributions = tuple({**row, "visits": len(one.sizes)} for row, one in rows)
    return Diagnosis("explained", causes, (), law.splits, {}, _extended(rig, causes), contributions,
                     _findings(admitted), found, [], (*notes, *phase_notes(causes)),
                     bodies=_NO_ENGINE_CHECK if bodies else None, law=law)  # fmt: skip


def _with_compliance(
    admitted: Sequence[Admitted], rig: Scenario, notes: list[Note], seen: EpisodeAnalysis
) -> Diagnosis:
    """Return the diagnosis of a rig that has a law of contact already: it agrees, or this is not decided."""
    if not seen.agrees:
        text = (
            "records are not segmented with compliant or lubricated flanks, and too few contact episodes were observed"
        )
        if seen.plain is not None:
            text = "contact episodes with compliant or lubricated flanks deviate from the nominal model by "
            text += f"{np.sqrt(seen.plain.level):.3g} sigma"
        remedy = "in addition to the contact law of the rig, no cause but mesh_friction is tested"
        notes = [*notes, Note("yielding-flanks", text, remedy, "", True)]
    return _unsegmented(admitted, rig, notes, "nothing_to_add" if seen.agrees else "not_decidable")


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
        lines[k:k] = ["", *(f"# {line}" for line in _facts(cause))]
    told = "\n".join(lines) + "\n"
    return told if tomllib.loads(told) == tomllib.loads(text) else text


def _facts(cause: Named) -> list[str]:
    """Return the known facts on a cause, line by line."""
    told = [f"found by gears3d diagnose: {cause.kind}", *(f"95 %: {each}" for each in _intervals(cause))]
    if cause.zero:
        told.append(
            f"phase and tooth number count from the first angle of {Path(cause.zero).name}, not from an index mark"
        )
    return told


def _intervals(cause: Named) -> list[str]:
    """Return the 95 % intervals of a cause's numbers in the form of a scenario."""
    told = []
    for name, one in cause.parameters.items():
        family, digits = cause.effect.params[name].family, significant_digits(one)
        told.append(f"{name} {show(one.low, family, digits)} to {show(one.high, family, digits)}")
    return told
