"""Causes of a measurement plan: by name, with assumed sizes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import FREE, Candidate, candidates
from gears3d.diagnosis.cause import Cause, begin
from gears3d.diagnosis.path_fit import LAWS, OIL, SOFT, SQUARED, effects_of
from gears3d.effects import catalogue
from gears3d.errors import InputError, UsageError, did_you_mean
from gears3d.units import parse

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

Array = np.ndarray
# Number of shapes at which effects with a free shape are computed, and of tried values between these: an exponent is
# wrong by 0.01 at most.
NODES, VALUES = 9, 241
# Kinds that cannot be planned for: each record has its own motion of the drive; friction of rigid flanks moves nothing;
# scatter depends on the number of impacts only.
UNPLANNED = ("drive_motion", "mesh_friction", "restitution_scatter")
# Default kinds: those that a data sheet of a rig states.
DRAG, IMPACT, GEOMETRY = "drag_coulomb", "restitution_offset", "backlash_offset"


class Truth(NamedTuple):
    """Assumed causes, and the alternatives that are fitted to their readings.

    Args:
        causes: with their sizes; nuisances last.
        others: alternatives that do not act.
        pairs: names of pairs of sets, numbers of the true set in units, (p,), and the free directions of the other set,
            (p, k) each, of which it has one.
    """

    causes: tuple[Cause, ...]
    others: tuple[Cause, ...] = ()
    pairs: tuple[tuple[str, Array, tuple[Array, ...]], ...] = ()

    @property
    def effects(self) -> list[Any]:
        """Effects that act."""
        return effects_of(self.causes)

    @property
    def lawful(self) -> bool:
        """Whether a law of contact is among them, without segmentation into events."""
        return any(one.candidate.kind in LAWS for one in self.causes)


class Wanted:
    """The request: causes to be determined, and pairs of sets to be separated.

    Args:
        rig: scenario of the test rig.
        causes: as for :func:`plan`.
        separate: as for :func:`plan`.
        nuisances: as for :func:`plan`.
        size: as for :func:`plan`.
        at: assumed size of the causes, in units.
        longest: duration of a record [s].
    """

    def __init__(
        self, rig: Scenario, causes: Sequence[str], separate: Sequence[str], nuisances: Sequence[str], size: float,
        at: float, longest: float,
    ) -> None:  # fmt: skip
        self.size, self.at, self.longest = size, at, longest
        values = self._values = rig.rig()
        highest = max(12, values.teeth_drive, values.teeth_loose)
        self._known = candidates(values, longest, highest)
        if values.face_width > 0.0:
            self._known.append(Candidate(OIL, {}, "viscosity", catalogue()[OIL](viscosity=1e-3).unit_size(values),
                                         False, ()))  # fmt: skip
        unit, mass = catalogue()[SOFT](stiffness=1e6).unit_size(values), values.inertia / values.base_radius_loose**2
        damping = 0.2 * float(np.sqrt(unit / abs(at) * mass))
        self._known.append(Candidate(SOFT, {"damping": damping}, "stiffness", unit, False, ()))
        free = tuple(begin(one, np.zeros(1 + one.phased)) for one in (self._chosen(name)[0] for name in nuisances))
        sets = [one.split("+") for one in separate]
        if separate and len(sets) < 2:
            raise UsageError(f"--separate is {separate[0]!r}; give two sets or more, e.g. drag_viscous,drag_coulomb")
        if not causes and not sets:
            causes = (DRAG, IMPACT, GEOMETRY) if values.drag_torque > 0.0 else (IMPACT, GEOMETRY)
        wanted = [self._chosen(one)[0] for one in causes]
        self.wanted = len(wanted)
        self.truths = [Truth((*map(self._sized, wanted), *free))] if wanted else []
        self.truths += [self._against(sets, k, free) for k in range(len(sets))]

    def _chosen(self, text: str) -> list[Candidate]:
        """Return the candidates for a kind with shapes: all of them, the usual one first."""
        kind, *shapes = text.strip().split(":")
        kinds = list(dict.fromkeys(one.kind for one in self._known))
        if kind in UNPLANNED or kind not in kinds:
            if kind in catalogue():
                able = ", ".join(one for one in kinds if one not in UNPLANNED)
                raise UsageError(f"{kind!r} is not planned for; kinds that are: {able}")
            raise UsageError(f"{kind!r} is not an effect (gears3d list effects); {did_you_mean(kind, kinds)}")
        wanted = {name: value for name, _, value in (one.partition("=") for one in shapes)}
        able = [one for one in self._known if one.kind == kind]
        bends = {name: wanted.pop(name) for name in begin(able[0], np.zeros(1)).free if name in wanted}
        good = [one for one in able if all(str(one.shape.get(name)) == value for name, value in wanted.items())]
        if good and bends:
            families = {name: catalogue()[kind].params[name].family for name in bends}
            try:
                return [self._bent(good[0], {name: parse(text, families[name]) for name, text in bends.items()})]
            except InputError as error:
                raise UsageError(f"{text!r}: {error.faults[0].message}") from None
        if not good:
            own = {name: list(dict.fromkeys(str(one.shape[name]) for one in able)) for name in able[0].shape}
            each = (f"{name}={'|'.join(some[:4])}{'|...' if len(some) > 4 else ''}" for name, some in own.items())
            raise UsageError(f"{text!r} is not a shape of {kind}; it has {', '.join(each) or 'none'}")
        return good

    def _sized(self, one: Candidate) -> Cause:
        """Return a candidate with the assumed size."""
        if one.kind == SOFT:
            return begin(one, np.array([1.0 / abs(self.at)]))
        return begin(one, np.array([self.at, 0.0][: 2 if one.phased else 1]))

    def _against(self, sets: Sequence[Sequence[str]], k: int, free: Sequence[Cause]) -> Truth:
        """Return a set of causes as true, and all others as alternatives."""
        for kind in (name.split(":")[0] for one in sets for name in one):
            if kind in (*LAWS, SQUARED):
                raise UsageError(f"--separate: effects of {kind} are not linear in its size; use --causes {kind}")
        own = [self._chosen(one)[0] for one in sets[k]]
        causes = [*map(self._sized, own), *free]
        others = [[self._forms(name, own) for name in one] for j, one in enumerate(sets) if j != k]
        acting = [cause for one in others for forms in one for cause in forms]
        at = np.cumsum([0, *(len(one.numbers) for one in (*causes, *acting))])
        places = iter(range(len(causes), len(causes) + len(acting)))
        size = np.zeros(at[-1])
        for cause, first in zip(causes[: len(own)], at, strict=False):
            size[first] = cause.numbers[0] / cause.units[0]
        fixed = [np.eye(at[-1])[:, at[len(own)] : at[len(causes)]]]
        pairs = []
        for one, names in zip(others, (one for j, one in enumerate(sets) if j != k), strict=True):
            ways = [fixed]
            for name, forms in zip(names, one, strict=True):
                held = [j for j, each in enumerate(own) if not forms and each == self._chosen(name)[0]]
                spans = [slice(at[j], at[j + 1]) for j in held or [next(places) for _ in forms]]
                ways = [[*before, way] for before in ways for way in _ways(forms, spans, at[-1])]
            pairs.append((f"{'+'.join(sets[k])} (true) or {'+'.join(names)}", size, tuple(map(np.hstack, ways))))
        return Truth(tuple(causes), tuple(acting), tuple(pairs))

    def _forms(self, name: str, true: Sequence[Candidate]) -> list[Cause]:
        """Return forms of a cause as alternatives, several if its shape is free, without the true ones."""
        able = self._chosen(name)
        if able[0] in true:
            return []
        if len(able) < 2 or not (free := begin(able[0], np.zeros(1)).free):
            return [self._sized(able[0])]
        (shape,) = free
        log = FREE[able[0].kind][shape].log
        ends = [float((np.log if log else float)(one.shape[shape])) for one in able]
        nodes = 0.5 * (min(ends) + max(ends)) - 0.5 * np.ptp(ends) * np.cos(np.linspace(0.0, np.pi, NODES))
        each = (np.exp(nodes) if log else nodes).tolist()
        return [self._sized(self._bent(able[0], {shape: value})) for value in each]

    def _bent(self, one: Candidate, shape: dict[str, float]) -> Candidate:
        """Return a candidate with another shape, and its unit size."""
        trial = catalogue()[one.kind](**{**one.shape, **shape}, **{one.size: one.unit})
        return one._replace(shape={**one.shape, **shape}, unit=trial.unit_size(self._values))

    @property
    def in_time(self) -> bool:
        """Whether a cause changes with time."""
        return any("time_constant" in one.candidate.shape for own in self.truths for one in (*own.causes, *own.others))


def _ways(forms: Sequence[Cause], spans: Sequence[slice], size: int) -> list[Array]:
    """Return directions of a cause, (size, k) each: of a free shape, one for each of many values.

    Between the values of a few forms, effects of a unit size are polynomials of the shape's number (Lagrange).
    """
    every = np.eye(size)
    if len(forms) < 2:
        return [every[:, spans[0]]]
    nodes = np.array([one.numbers[1] for one in forms])
    made = []
    for value in np.linspace(nodes.min(), nodes.max(), VALUES):
        apart = np.where(np.eye(len(nodes), dtype=bool), 1.0, nodes[:, None] - nodes)
        parts = np.where(np.eye(len(nodes), dtype=bool), 1.0, value - nodes) / apart
        made.append(every[:, [span.start for span in spans]] @ np.prod(parts, axis=1)[:, None])
    return made


def name_of(cause: Cause) -> str:
    """Return the kind of a cause with the given parts of its shape."""
    free = (*cause.free, "damping")
    return ":".join([cause.candidate.kind, *(f"{k}={v}" for k, v in cause.candidate.shape.items() if k not in free)])
