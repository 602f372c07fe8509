"""Drag of a run-down, part by part: bearings, shear, churning, mesh; each run has some of them and an inertia."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gears3d.errors import UsageError, did_you_mean
from gears3d.identify.motion import Law

# Free numbers of each term, in order.
NUMBERS = {"coulomb": ("coulomb",), "viscous": ("viscous",), "power": ("coefficient", "exponent")}
UNITS = {"coulomb": "N m", "viscous": "N m s/rad", "coefficient": "N m", "exponent": ""}
# Laws that compete, the simpler before the richer; Kadmiri et al. 2012, eqs (4)-(7), Rigaud 2020, Ottewill 2010.
CANDIDATES = (("coulomb",), ("viscous",), ("coulomb", "viscous"), ("coulomb", "power"), ("coulomb", "viscous", "power"))
# Name of the only part of a plain run-down.
ALONE = "drag"


class Part(NamedTuple):
    """One source of drag, on a shaft of its own.

    Args:
        name: of the part.
        terms: of its law: ``"coulomb"``, ``"viscous"``, ``"power"``.
    """

    name: str
    terms: tuple[str, ...]

    def names(self) -> tuple[str, ...]:
        """Return the names of its free numbers, in order."""
        return tuple(name for term in self.terms for name in NUMBERS[term])


class Share(NamedTuple):
    """A part in a run.

    Args:
        part: its name.
        ratio: speed of its shaft over the speed that is recorded.
        against: speed of what it rubs on [rad/s]; only viscous terms feel it.
    """

    part: str
    ratio: float = 1.0
    against: float = 0.0


class Inertia(NamedTuple):
    """A moment of inertia.

    Args:
        value: as it is known [kg·m²].
        sigma: standard deviation [kg·m²].
        shift: how far the runs say that it is off, in standard deviations.
    """

    value: float
    sigma: float = 0.0
    shift: float = 0.0


class Assembly(NamedTuple):
    """The rotating assembly of one run.

    Args:
        shares: parts that slow it.
        inertias: name of an inertia and how often it counts, at the recorded speed.
        torque: known, that spins the shaft up in this run [N·m]; 0: it coasts down.
    """

    shares: tuple[Share, ...]
    inertias: tuple[tuple[str, float], ...]
    torque: float = 0.0


class Model(NamedTuple):
    """Parts with free numbers, shared by runs.

    Args:
        parts: in the order of the free numbers.
        runs: one for each track.
        inertias: by name.
    """

    parts: tuple[Part, ...]
    runs: tuple[Assembly, ...]
    inertias: Mapping[str, Inertia]

    def names(self) -> tuple[tuple[str, str], ...]:
        """Return part and name of every free number, in order."""
        return tuple((part.name, name) for part in self.parts for name in part.names())

    def inertia(self, run: int) -> float:
        """Return the inertia of a run [kg·m²]."""
        parts = ((self.inertias[name], often) for name, often in self.runs[run].inertias)
        return sum(often * (own.value + own.shift * own.sigma) for own, often in parts)

    def unsure(self) -> tuple[str, ...]:
        """Return the names of the inertias that are not known exactly."""
        used = {name for run in self.runs for name, _ in run.inertias}
        return tuple(name for name, own in self.inertias.items() if own.sigma > 0.0 and name in used)

    def weights(self, run: int) -> list[float]:
        """Return the relative change of a run's inertia with a standard deviation of each unsure one."""
        often, whole = dict(self.runs[run].inertias), self.inertia(run)
        return [often.get(name, 0.0) * self.inertias[name].sigma / whole for name in self.unsure()]

    def shifted(self, shifts: np.ndarray) -> Model:
        """Return the model with other inertias."""
        moved = {
            name: self.inertias[name]._replace(shift=float(z)) for name, z in zip(self.unsure(), shifts, strict=True)
        }
        return self._replace(inertias={**self.inertias, **moved})

    def law(self, numbers: np.ndarray, run: int) -> Law:
        """Return the deceleration of a run: the torques of its parts, brought to the recorded shaft, over its inertia.

        ``numbers``: free numbers of the parts, torques in N·m, (p,).

        >>> model = plain(("coulomb", "power"), 2.0, 1)
        >>> model.law(np.array([1.0, 4.0, 1.5]), 0)
        Law(coulomb=0.5, viscous=0.0, coefficient=2.0, exponent=1.5, more=(), table=None, push=0.0)
        """
        per = 1.0 / self.inertia(run)
        coulomb = viscous = 0.0
        powers: list[tuple[float, float]] = []
        shares = {share.part: share for share in self.runs[run].shares}
        at = 0
        for part in self.parts:
            own = dict(zip(part.names(), map(float, numbers[at : at + len(part.names())]), strict=True))
            at += len(own)
            if (share := shares.get(part.name)) is None:
                continue
            n = share.ratio
            if "coulomb" in own:
                coulomb += per * n * own["coulomb"]
            if "viscous" in own:
                viscous += per * n**2 * own["viscous"]
                coulomb -= per * n * own["viscous"] * share.against
            if "exponent" in own:
                powers.append((per * n ** (1.0 + own["exponent"]) * own["coefficient"], own["exponent"]))
        first = powers[0] if powers else (0.0, 2.0)
        return Law(coulomb, viscous, *first, more=tuple(powers[1:]), push=per * self.runs[run].torque)

    def within(self, runs: list[int]) -> Model:
        """Return the model of some of the runs, with the parts that are in them."""
        chosen = tuple(self.runs[run] for run in runs)
        present = {share.part for run in chosen for share in run.shares}
        return self._replace(parts=tuple(part for part in self.parts if part.name in present), runs=chosen)


def plain(
    terms: tuple[str, ...], inertia: float, runs: int, sigma: float = 0.0, torques: Sequence[float] = ()
) -> Model:
    """Return the model of run-downs with one common drag.

    ``inertia``: of the rotating assembly [kg·m²]; ``sigma``: standard deviation of the inertia [kg·m²]; ``torques``:
    known torque that spins each run up [N·m], 0 of coast-downs; all coast down unless given.
    """
    one = Assembly((Share(ALONE),), (("inertia", 1.0),))
    made = tuple(one._replace(torque=torque) for torque in torques) or (one,) * runs
    return Model((Part(ALONE, terms),), made, {"inertia": Inertia(inertia, sigma)})


def terms_of(law: str) -> tuple[str, ...]:
    """Return the terms of a law.

    Raises UsageError when a term is unknown.

    >>> terms_of("coulomb+power")
    ('coulomb', 'power')
    """
    terms = tuple(law.split("+"))
    if terms not in (*CANDIDATES, ("power",)):
        known = ["+".join(one) for one in (*CANDIDATES, ("power",))]
        raise UsageError(f"there is no law {law!r}; {did_you_mean(law, known)}")
    return terms
