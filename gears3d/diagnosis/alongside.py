"""Laws of contact combined with other causes: contact episodes are compared with both, without segmentation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from gears3d.diagnosis.candidates import Candidate, candidates
from gears3d.diagnosis.cause import Cause, begin
from gears3d.diagnosis.contactlaw import Held, gains, hold
from gears3d.diagnosis.visits import Visits, some
from gears3d.effects import Rig
from gears3d.errors import InputError

# Kinds that are tried in addition to a law of contact.
KINDS = ("backlash_offset", "backlash_variation", "eccentricity", "transmission_error", "drag_coulomb",
         "drag_viscous", "drag_position")  # fmt: skip
# Highest order that is tried.
HIGHEST = 4
# Number of contact episodes that are used in the search for causes.
FEW = 40
ROUNDS, TRIAL = 10, 3
# Maximum number of causes in addition to a law.
MOST = 2
# Number of candidates that are fitted in each round.
TRIED = 3
# Chi-square per point at which the causes explain the contact episodes.
ENOUGH = 1.5
# Largest ratio of the cost with a further cause to the cost without it.
FALLS = 0.9
# Chi-square that a parameter must gain against a competing hypothesis with fewer parameters.
PRICE = 8.0
# Size in units below which a cause is ignored.
SMALLEST = 0.02
# Sizes in units: initial value of a fit, and the value that stands for zero.
BEGIN, NOTHING = 1e-3, 1e-6


def shortlist(rig: Rig) -> list[Candidate]:
    """Return the candidates that are tried in addition to a law of contact."""
    every = candidates(rig, 1.0, HIGHEST)
    return [one for one in every if one.kind in KINDS and one.shape.get("flank", "both") == "both"]


def beside(records: Sequence[Visits], laws: Iterable[list[Cause]]) -> Held | None:
    """Return the law of contact with further causes that has the smallest cost over the contact episodes."""
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
    """Return the fit with further causes, added as long as each reduces the cost considerably."""
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
    """Return the size of a cause in units."""
    return float(np.linalg.norm(cause.numbers[: 1 + cause.candidate.phased])) / cause.candidate.unit


def needed(records: Sequence[Visits], held: Held) -> list[float]:
    """Return the rise of chi-square without each of the causes, the others refitted."""
    found = []
    for k in range(len(held.causes)):
        others = held.causes[:k] + held.causes[k + 1 :]
        found.append(hold(records, [], others, held, ROUNDS).cost - held.cost)
    return found


def _begun(records: Sequence[Visits], started: list[Cause]) -> Held | None:
    """Return the best of the initial sizes of a law."""
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
