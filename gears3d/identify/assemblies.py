"""Drag of each part, from run-downs of several assemblies: an added part adds its drag."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.identify.coastdown_law import choose, report
from gears3d.identify.coastdown_record import Track
from gears3d.identify.law import Identified
from gears3d.identify.parts import CANDIDATES, Assembly, Inertia, Model, Part, Share, terms_of
from gears3d.identify.trend import Oil, trends

# Usual laws of the parts; Kadmiri et al. 2012, eqs (6), (7); Ottewill et al. 2010, eq. (12).
USUAL = {"shear": "viscous", "churning": "power", "mesh": "viscous"}


@dataclass(frozen=True, eq=False)
class Run:
    """A run-down of an assembly.

    Args:
        track: what was recorded.
        shares: parts that slowed it.
        inertias: name of an inertia and how often it counts.
        temperature: of the oil [°C]; ``None`` where it plays no part.
    """

    track: Track
    shares: tuple[Share, ...]
    inertias: tuple[tuple[str, float], ...]
    temperature: float | None = None


def identify_assemblies(
    runs: Sequence[Run],
    inertias: Mapping[str, Inertia],
    laws: Mapping[str, str] | None = None,
    each: Mapping[str, bool] | None = None,
    oil: Oil | None = None,
) -> Identified:
    """Identify the drag of every part, jointly: the uncertainty of one part widens the intervals of the others.

    The law of a part without one is chosen where it comes in first, the parts before it known; then all numbers are
    fitted at once to all runs.

    Args:
        runs: of all assemblies.
        inertias: by the names that the runs give.
        laws: of parts, such as ``{"shear": "viscous"}``; ``USUAL`` where not given.
        each: whether a part has numbers of its own at each temperature; if not told, a part does that was recorded at
            several temperatures and nowhere without one.
        oil: for the trend over viscosity.

    Returns:
        ``part.name`` of every part, ``part@temperature.name`` of those that change with it.

    Raises:
        InputError: the runs do not tell the parts apart, or nothing fits.

    Source: Kadmiri et al. 2012, section 4, eqs (4)-(8); Ottewill et al. 2010, section 4.1.
    """
    laws = {**USUAL, **(laws or {})}
    runs = [_at_temperature(run, _each(runs, dict(each or {}))) for run in runs]
    order = _order(runs)
    _refuse_mixed(runs, order)
    tracks = [run.track for run in runs]
    made = tuple(Assembly(run.shares, run.inertias) for run in runs)
    terms: dict[str, tuple[str, ...]] = {}
    losses: dict[str, float | None] = {}
    for base in dict.fromkeys(_base(name) for name in order):
        if base in laws:
            terms[base] = terms_of(laws[base])
            continue
        some = [at for at, run in enumerate(runs) if {_base(s.part) for s in run.shares} <= {*terms, base}]
        rivals = [_model({**terms, base: law}, order, made, inertias).within(some) for law in CANDIDATES]
        found = choose([tracks[at] for at in some], rivals)
        losses |= found.losses
        terms[base] = next(part.terms for part in found.best.model.parts if _base(part.name) == base)
    joint = choose(tracks, [_model(terms, order, made, inertias)])
    answer = report(joint._replace(losses={**losses, **joint.losses}), tracks)
    over = trends(joint.best, {_shown(run.temperature): run.temperature for run in runs}, oil)
    return replace(answer, goodness={**answer.goodness, "temperature": over}) if over else answer


def identify_mesh_drag(
    loose: Sequence[Track],
    drive: Sequence[Track],
    meshed: Sequence[Track],
    inertias: tuple[Inertia, Inertia],
    ratio: float,
    laws: Mapping[str, str] | None = None,
) -> Identified:
    """Identify the drag of the mesh: the run-down in mesh less the run-downs of both gears alone.

    Args:
        loose: run-downs of the loose gear alone.
        drive: run-downs of the drive alone, its own angle.
        meshed: run-downs of both gears in mesh, the loose gear's angle.
        inertias: of loose gear and drive, with all that turns with them.
        ratio: speed of the drive over that of the loose gear.
        laws: of ``"loose"`` and ``"drive"``; the best unless given.

    Returns:
        ``mesh_drag`` [N·m·s/rad] and the laws of both shafts.

    Raises:
        InputError: one of them is missing, or no law fits.

    Source: Ottewill et al. 2010, section 4.1, eqs (12)-(16).
    """
    for name, tracks in (("FILE", loose), ("--drive-alone", drive), ("--meshed", meshed)):
        if not tracks:
            remedy = "mesh drag is what the gears in mesh lose more than both alone: record all three"
            raise InputError(Fault(name, "is missing", remedy))
    runs = [Run(track, (Share("loose"),), (("loose", 1.0),)) for track in loose]
    runs += [Run(track, (Share("drive"),), (("drive", 1.0),)) for track in drive]
    both = (Share("loose"), Share("drive", ratio), Share("mesh"))
    runs += [Run(track, both, (("loose", 1.0), ("drive", ratio**2))) for track in meshed]
    known = {"loose": inertias[0], "drive": inertias[1]}
    found = identify_assemblies(runs, known, laws, each=dict.fromkeys(("loose", "drive", "mesh"), False))
    laws = {**dict(one.split(": ") for one in found.law.split(", ")), "mesh": "coulomb+viscous"}
    richer = identify_assemblies(runs, known, laws, each=dict.fromkeys(laws, False))
    constant = richer.parameters["mesh.coulomb"]
    notes = found.warnings
    if not constant.low <= 0.0 <= constant.high:
        what = f"a constant part of {constant.value:.3g} N m fits, too ({constant.low:.3g} to {constant.high:.3g})"
        notes = (*notes, f"the mesh's drag does not only go with the speed: {what}; mesh_drag leaves that out")
    parameters = {"mesh_drag": found.parameters["mesh.viscous"], **found.parameters}
    del parameters["mesh.viscous"]
    return replace(found, parameters=parameters, warnings=notes)


def _base(name: str) -> str:
    return name.split("@")[0]


def _shown(temperature: float | None) -> str:
    return "" if temperature is None else f"{temperature:g}"


def _each(runs: Sequence[Run], each: dict[str, bool]) -> dict[str, bool]:
    """Return for every part whether it changes with temperature."""
    seen: dict[str, set[float | None]] = {}
    for run in runs:
        for share in run.shares:
            seen.setdefault(share.part, set()).add(run.temperature)
    return {part: each.get(part, None not in where and len(where) > 1) for part, where in seen.items()}


def _at_temperature(run: Run, each: dict[str, bool]) -> Run:
    """Return the run with parts named after its temperature that change with it."""
    at = f"@{_shown(run.temperature)}"
    shares = tuple(
        share._replace(part=share.part + at) if each[share.part] and run.temperature is not None else share
        for share in run.shares
    )
    return replace(run, shares=shares)


def _order(runs: Sequence[Run]) -> list[str]:
    """Return the parts, those of simple assemblies first."""
    simple = sorted(runs, key=lambda run: len(run.shares))
    return list(dict.fromkeys(share.part for run in simple for share in run.shares))


def _model(
    terms: Mapping[str, tuple[str, ...]], order: list[str], made: tuple[Assembly, ...], inertias: Mapping[str, Inertia]
) -> Model:
    parts = tuple(Part(name, terms[_base(name)]) for name in order if _base(name) in terms)
    return Model(parts, made, inertias)


def _refuse_mixed(runs: Sequence[Run], order: list[str]) -> None:
    """Refuse runs in which two parts always come together."""
    rows = np.zeros((len(runs), 2 * len(order)))
    for row, run in zip(rows, runs, strict=True):
        for share in run.shares:
            row[order.index(share.part)] = share.ratio
            row[len(order) + order.index(share.part)] = share.against
    if np.linalg.matrix_rank(rows) >= len(order):
        return
    together = [
        (one, other)
        for one, other in pairwise(order)
        if all((rows[at, order.index(one)] != 0) == (rows[at, order.index(other)] != 0) for at in range(len(runs)))
    ]
    which = " and ".join(together[0]) if together else ", ".join(order)
    remedy = "record an assembly with one of them only"
    raise InputError(Fault("run", f"the parts {which} come together in every run: they cannot be separated", remedy))
