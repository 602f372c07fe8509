"""The complete diagnosis: from records and a rig to deviations, causes, the extended rig and its held-out gain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.diagnosis.along_path import AlongPath, along_path
from gears3d.diagnosis.amiss import amiss, unspent
from gears3d.diagnosis.contact_law import (
    ContactLawFit,
    EpisodeAnalysis,
    contact_law_of,
    contact_law_with_others,
    has_compliance,
)
from gears3d.diagnosis.evidence import Evidence, Paths, uncut
from gears3d.diagnosis.experiments import Experiment, experiments
from gears3d.diagnosis.grounds import Note, of_channels, of_phases, of_teeth, of_zeros
from gears3d.diagnosis.heldout import EngineCheck, Split, engine_check, heldout_3d, heldout_summary, splits
from gears3d.diagnosis.kicked import thrown
from gears3d.diagnosis.quantisation import of_counts, shared
from gears3d.diagnosis.readied import along_another, delay_of, ready, searched, with_one_flank
from gears3d.diagnosis.remains import structures
from gears3d.diagnosis.resonance import Resonance, resonance
from gears3d.diagnosis.search import Rival, Search, blind, keeping, rivals
from gears3d.diagnosis.structure import Structure
from gears3d.diagnosis.suspicion import part, predicted, unproven
from gears3d.diagnosis.verdict import (
    CHANCE,
    Named,
    beside,
    evidence_of,
    judged,
    name_law,
    power,
    predictive,
    remaining,
    upheld,
)
from gears3d.diagnosis.whiteness import own_scatter
from gears3d.errors import Fault, InputError
from gears3d.measured.checks import Admitted, admit_each
from gears3d.measured.drive_motion import DriveMotion
from gears3d.results import Result
from gears3d.scenario import Scenario, load

# Highest order that is searched, unless the numbers of teeth require more.
HIGHEST = 40
_RIGID = EngineCheck(
    (), (), {}, "the contact law is identified from complete contact episodes, which the engine cannot start in between"
)


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

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary in the form of the contract."""
        return {
            "verdict": self.verdict,
            "causes": [one.to_dict() for one in self.causes],
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
    """
    admitted, bench = _opened(records, rig, stated_motion)
    found = _diagnosed(admitted, bench, progress or (lambda doing, part: None), bodies, runs)
    return replace(found, motions={one.file: one.motion for one in admitted if one.motion is not None})


def _diagnosed(
    admitted: Sequence[Admitted], rig: Scenario, tell: Callable[[str, float], None], bodies: bool, runs: bool
) -> Diagnosis:
    admitted_all, notes = admitted, [*of_channels(admitted), *of_zeros(admitted)]
    admitted = _moving(admitted, notes)
    paths = Paths()
    highest = max(HIGHEST, rig.rig().teeth_drive + 2, rig.rig().teeth_loose + 2)

    def searching(part: float) -> None:
        tell("searching for causes of the path", 0.6 + 0.1 * part)

    if has_compliance(rig):
        whole = along_path([], admitted, paths, highest, searching)
        if whole is not None and (whole.decides or whole.agrees):
            return _along(admitted_all, rig, notes, whole, tell, bodies, runs)
        seen = contact_law_of(admitted, notes, tell, paths)
        if (law := seen.law or (None if seen.agrees else contact_law_with_others(seen))) is not None:
            return _lawful(admitted_all, rig, notes, law, bodies)
        return _beside(admitted_all, rig, notes, seen)
    rings = resonance(admitted, paths)
    try:
        records, notes = _measured(admitted, notes, tell, paths)
    except InputError:  # compliance, an oil film or a resonance may prevent segmentation
        if rings is None:
            whole = along_path([], admitted, paths, highest, searching)
            if whole is not None and whole.decides:
                return _along(admitted_all, rig, notes, whole, tell, bodies, runs)
        seen = contact_law_of(admitted, notes, tell, paths)
        if (law := seen.law or contact_law_with_others(seen)) is not None:
            return _lawful(admitted_all, rig, notes, law, bodies)
        if rings is not None:
            return _uncut(admitted_all, rig, notes, "unexplained", rings)
        raise
    whole = along_path(records, admitted, paths, highest, searching)
    if whole is not None and whole.decides and (rings is None or whole.path.causes or whole.path.scatter):
        return _along(admitted_all, rig, notes, whole, tell, bodies, runs)
    seen = contact_law_of(admitted, notes, tell, paths)
    if seen.law is not None:
        return _lawful(admitted_all, rig, notes, seen.law, bodies)
    records, found, deep = searched(admitted, records, highest, paths, tell)
    kicks = [] if rings is None else [rings.structure]
    kicks += thrown(found.records, found.fit.causes) if deep is None else []
    while True:
        same, odd = _left(found, highest)
        left = [*kicks, *same]
        kept = [] if kicks else upheld(found, left)
        if len(kept) == len(found.fit.causes):
            kept = predictive(found)
        if len(kept) == len(found.fit.causes):
            break
        found = keeping(found, kept)
    if left and not kicks and (law := contact_law_with_others(seen)) is not None:
        return _lawful(admitted_all, rig, notes, law, bodies)
    tell("testing competing hypotheses", 0.85)
    others = rivals(found.records, found)
    spread = own_scatter(records, found, left) if rings is None else None
    parted = part(found, others, beside(spread, deep), rig, notes)
    tell("predicting the displacement from measured states", 0.88)
    parted, far = predicted(parted, admitted, paths)
    if whole is not None and deep is None and rings is None:
        parted = unproven(parted, whole.path, whole.contradicted(parted.found))
    found, others, causes = parted.found, parted.others, parted.causes
    tell("predicting held-out records", 0.9)
    held = tuple(splits(found.records, found.fit.causes)) if found.fit.causes else ()
    solid, apart = _further(found, others, tell, bodies, runs)
    limits = power(found.known) if rings is None else {}
    extended = rig.with_([("effect[+]", one.table) for one in causes]) if causes else rig
    findings = {one.file: [each.to_dict() for each in one.findings] for one in admitted_all}
    tell("done", 1.0)
    off, more = shared(found.records, found.fit.rest, amiss(found.records, found.fit.rest), amiss)
    off += [one for one in unspent(found) if one.name not in {each.name for each in [*left, *off]}]
    left, odd = [*left, *off, *far], [*odd, *more]
    told = (*parted.notes, *of_phases(causes), *of_teeth(found.records), *of_counts(found.records, odd))
    if whole is not None and whole.agrees and not causes and not parted.suspects:
        left = []  # residuals of single events come from segmentation
        limits = {place: min(limit, whole.limits[place]) for place, limit in limits.items()}
    verdict = judged(causes, left, limits) if parted.decides else "not_decidable"
    return Diagnosis(verdict, causes, tuple(left), held, limits, extended, tuple(evidence_of(found.records)), findings,
                     found, others, told, parted.suspects, solid, runs=apart, rings=rings)  # fmt: skip


def _along(
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
    parted = part(found, others, beside(whole.path.scatter, None), rig, notes, whole.path)
    found, causes = parted.found, parted.causes
    tell("predicting held-out records", 0.9)
    held = whole.held(found)
    solid, apart = _further(found, parted.others, tell, bodies, runs)
    limits, known = whole.limits, found.records + (whole.others if whole.records else [])
    extended = rig.with_([("effect[+]", one.table) for one in causes]) if causes else rig
    findings = {one.file: [each.to_dict() for each in one.findings] for one in admitted}
    told = (*parted.notes, *of_phases(causes), *of_teeth(found.records))
    verdict = judged(causes, [], limits) if parted.decides else "not_decidable"
    tell("done", 1.0)
    return Diagnosis(verdict, causes, (), held, limits, extended, tuple(evidence_of(known)), findings,
                     found, parted.others, told, parted.suspects, solid, runs=apart)  # fmt: skip


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
    solid, apart = None, ()
    if bodies:
        doing = "predicting held-out events in the 3D engine"
        solid = engine_check(found.records, found.fit.causes, lambda part: tell(doing, 0.92 + 0.03 * part))
    if runs:
        doing = "searching for experiments that distinguish competing hypotheses"
        apart = experiments(found, others, lambda part: tell(doing, 0.95 + 0.05 * part))
    return solid, apart


def _moving(admitted: Sequence[Admitted], notes: list[Note]) -> list[Admitted]:
    """Return the records with the motion of the rig, if there is one; notes report the others."""
    bad = {note.record for note in notes if note.blocks}
    if len(bad) == len({one.file for one in admitted}):
        return list(admitted)
    notes[:] = [
        note._replace(blocks=False, remedy=f"{note.remedy} (this record was excluded)") if note.blocks else note
        for note in notes
    ]
    return [one for one in admitted if one.file not in bad]


def _lawful(
    admitted: Sequence[Admitted], rig: Scenario, notes: list[Note], law: ContactLawFit, bodies: bool
) -> Diagnosis:
    """Return the diagnosis of a law of contact; segmentation by rigid flanks adds nothing to it."""
    causes = name_law(law)
    extended = rig.with_([("effect[+]", one.table) for one in causes])
    findings = {one.file: [each.to_dict() for each in one.findings] for one in admitted}
    found = blind([uncut(one.scenario, one.name) for one in law.records])
    rows = zip(evidence_of(found.records), law.records, strict=True)
    told = tuple({**row, "visits": len(one.sizes)} for row, one in rows)
    return Diagnosis("explained", causes, (), law.splits, {}, extended, told, findings, found, [],
                     (*notes, *of_phases(causes)), bodies=_RIGID if bodies else None, law=law)  # fmt: skip


def _beside(admitted: Sequence[Admitted], rig: Scenario, notes: list[Note], seen: EpisodeAnalysis) -> Diagnosis:
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
    return _uncut(admitted, rig, notes, "nothing_to_add" if seen.agrees else "not_decidable")


def _uncut(
    admitted: Sequence[Admitted], rig: Scenario, notes: Sequence[Note], verdict: str, rings: Resonance | None = None
) -> Diagnosis:
    """Return the diagnosis of records that are not, or cannot be, segmented."""
    findings = {one.file: [each.to_dict() for each in one.findings] for one in admitted}
    found = blind([uncut(one.rig, one.file) for one in admitted if one.rig is not None])
    left = () if rings is None else (rings.structure,)
    return Diagnosis(verdict, (), left, (), {}, rig, tuple(evidence_of(found.records)), findings, found, [],
                     tuple(notes), rings=rings)  # fmt: skip


def _measured(
    admitted: Sequence[Admitted], notes: list[Note], tell: Callable[[str, float], None], paths: Paths
) -> tuple[list[Evidence], list[Note]]:
    """Return the records that can be measured, and notes on these and the others."""
    records: dict[str, Evidence] = {}
    faults: dict[str, InputError] = {}
    delay = delay_of(admitted)
    for k, one in enumerate(admitted):
        tell(f"measuring {one.file}", 0.1 + 0.5 * k / len(admitted))
        assert one.rig is not None
        try:
            records[one.file] = ready(one, delay, paths=paths)
        except InputError as error:
            faults[one.file] = error
    if not records:
        every = [fault for error in faults.values() for fault in error.faults]
        raise InputError([*(Fault("", note.text, note.remedy, note.record) for note in notes), *every])
    stated, own = [], list(records.values())
    for one in admitted:
        if (error := faults.get(one.file)) is None:
            continue
        first = error.faults[0]
        if (found := along_another(one, own, delay, paths)) is None:
            stated += [Note("not-measured", f"record excluded: {fault.key} {fault.message}", fault.remedy, one.file)
                     for fault in error.faults]  # fmt: skip
        else:
            records[one.file], like = found
            text = f"segmented along the flanks of {like}, as by itself it {first.message}"
            stated.append(Note("flanks-of-another", text, "record longer, or with less noise", one.file))
    kept = [records[one.file] for one in admitted if one.file in records]
    return with_one_flank(admitted, kept, paths), [*notes, *stated]


def _left(found: Search, highest: int) -> tuple[list[Structure], list[Structure]]:
    """Return the residual patterns, and those that coarse encoders cause in one record."""

    def looked(records: Sequence[Evidence], rest: np.ndarray) -> list[Structure]:
        return [one for one in structures(records, rest, highest) if one.chance < CHANCE]

    return shared(found.records, found.fit.rest, looked(found.records, found.fit.rest), looked)
