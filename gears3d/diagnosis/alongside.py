"""Laws of contact beside other causes: visits to the flanks are held against both, for cutting sees neither rightly."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from gears3d.diagnosis.candidates import Candidate, candidates
from gears3d.diagnosis.cause import Cause, begin
from gears3d.diagnosis.contactlaw import Held, gains, hold
from gears3d.diagnosis.visits import Visits, some
from gears3d.effects import Rig
from gears3d.errors import InputError

KINDS = ("backlash_offset", "backlash_variation", "eccentricity", "transmission_error", "drag_coulomb",
         "drag_viscous", "drag_position")  # fmt: skip
"""Kinds that are looked for beside a law of contact."""
HIGHEST = 4
"""Order that is looked for."""
FEW = 40
"""Visits that are used while causes are looked for."""
ROUNDS, TRIAL = 10, 3
MOST = 2
"""Causes beside a law at most."""
TRIED = 3
"""Candidates that are fitted in each round."""
ENOUGH = 1.5
"""Chi-square a point at which visits are what the causes make of them."""
FALLS = 0.9
"""Part of the cost that a further cause may leave at most."""
PRICE = 8.0
"""Chi-square that a number must be worth against a rival with fewer."""
SMALLEST = 0.02
"""Size in units below which a cause is none."""
BEGIN, NOTHING = 1e-3, 1e-6
"""Sizes in units from which a cause is fitted, and that stand for none."""


def shortlist(rig: Rig) -> list[Candidate]:
    """Return the candidates that are looked for beside a law of contact.

    Args:
        rig: constants of the bench.
    """
    every = candidates(rig, 1.0, HIGHEST)
    return [one for one in every if one.kind in KINDS and one.shape.get("flank", "both") == "both"]


def beside(records: Sequence[Visits], laws: Iterable[list[Cause]]) -> Held | None:
    """Return the law of contact and the causes beside it that leave least of some visits.

    Args:
        records: visits of all records.
        laws: each at the sizes from which it is fitted.
    """
    few, known = some(records, FEW), shortlist(records[0].rig)
    found = None
    for started in laws:
        begun = _begun(few, started)
        if begun is None:
            continue
        held = further(few, begun, known)
        if found is None or held.cost < found.cost:
            found = held
    return None if found is None else hold(records, [], found.causes)


def further(records: Sequence[Visits], now: Held, known: Sequence[Candidate]) -> Held:
    """Return visits held against further causes, as long as each takes much of what is left.

    Args:
        records: visits of all records, or some of them.
        now: held against the causes so far.
        known: candidates.
    """
    for _ in range(MOST):
        if now.level < ENOUGH and now.cost < ENOUGH * now.count:
            break
        promised = gains(records, now, [begin(one, np.full(1 + one.phased, NOTHING)) for one in known])
        best = now
        for k in np.argsort(promised)[::-1][:TRIED]:
            cause = begin(known[k], np.full(1 + known[k].phased, BEGIN))
            held = hold(records, [], [*now.causes, cause], now, ROUNDS)
            best = held if _worth(held) < _worth(best) and size_of(held.causes[-1]) > SMALLEST else best
        if best is now or best.cost > FALLS * now.cost:
            break
        now = best
    return now


def size_of(cause: Cause) -> float:
    """Return the size of a cause in units.

    Args:
        cause: with its numbers.
    """
    return float(np.linalg.norm(cause.numbers[: 1 + cause.candidate.phased])) / cause.candidate.unit


def needed(records: Sequence[Visits], held: Held) -> list[float]:
    """Return by how much chi-square rises without each of the causes, the others fitted anew.

    Args:
        records: visits of all records.
        held: against all causes.
    """
    found = []
    for k in range(len(held.causes)):
        others = held.causes[:k] + held.causes[k + 1 :]
        found.append(hold(records, [], others, held, ROUNDS).cost - held.cost)
    return found


def _begun(records: Sequence[Visits], started: list[Cause]) -> Held | None:
    """Return the best of the sizes at which a law is begun."""
    found = None
    for cause in started:
        try:
            held = hold(records, [], [cause], rounds=TRIAL)
        except InputError:  # a size that the rig cannot have
            continue
        if found is None or held.cost < found.cost:
            found = held
    return found


def _worth(held: Held) -> float:
    return held.cost + PRICE * sum(len(one.numbers) for one in held.causes)
