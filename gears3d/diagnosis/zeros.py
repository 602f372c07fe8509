"""Records whose encoders begin anywhere: their angles are turned until all count from the zeros of one record.

What goes by a gear's angle has another phase in each such record. The strongest of it tells by how much the zeros of
the records differ; once their angles are turned by that, all causes are looked for as in records with common marks. A
phase for each record is a freedom that chance has, too: what goes by such an angle must gain the more to be believed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi
from typing import Any, NamedTuple

import numpy as np

from gears3d.diagnosis.candidates import Candidate
from gears3d.diagnosis.cause import contribution
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.library import Library
from gears3d.errors import Fault, InputError

Array = np.ndarray
GEARS = ("drive", "loose")
OWN = {"drag_position": "loose", "backlash_variation": "drive"}
"""By whose angle kinds go that do not name their gear."""
CHANCE = 3e-7
"""Probability of what a cause with a phase must gain at least, to be no chance."""
SHOWS = 25.0
"""Chi-square that a record must be worth by itself, for phases to count from its zeros."""
PHASES, SIZES, ZOOMS, POLISHED = 256, 48, 3, 20
"""Phases and sizes that are tried, times that sizes are tried more finely, and rounds of Newton."""
LARGEST = 4.0
"""Times the size that the stiffest direction of a record tells, up to which sizes are tried."""
STEP = 1e-5
"""Of an angle, for slopes [rad]."""
SURE = 0.1
"""Standard deviations of a zero by which it is not worth while to turn a record."""


def gear_of(kind: str, gear: str | None) -> str:
    """Return by whose angle a cause goes; empty where by none.

    Args:
        kind: of the effect.
        gear: that it names, if any.

    >>> gear_of("drag_position", None), gear_of("eccentricity", "drive"), gear_of("encoder_skew", "loose")
    ('loose', 'drive', '')
    """
    return "" if kind == "encoder_skew" else OWN.get(kind, gear or "")


def goes_by(one: Candidate) -> str:
    """Return by whose angle a candidate goes; empty where by none.

    Args:
        one: any.
    """
    return gear_of(one.kind, one.shape.get("gear"))


def turn(one: Evidence, drive: float, loose: float) -> Evidence:
    """Return a record with its angles counted from other zeros.

    Args:
        one: the record.
        drive: what is added to the drive's angle [rad].
        loose: to that of the loose gear [rad].
    """
    if drive == 0.0 and loose == 0.0:
        return one
    seen, (time, angle, speed) = one.channels, one.fine
    both = {name: (own := getattr(seen, name))._replace(drive=own.drive + drive, loose=own.loose + loose)
            for name in ("contacts", "impacts", "losses", "partings", "corners", "blows")}  # fmt: skip
    flights = seen.flights._replace(loose=seen.flights.loose + loose)
    moved = seen._replace(**both, flights=flights, drive=seen.drive._replace(angle=seen.drive.angle + drive))
    turned = one.turned[0] + drive, one.turned[1] + loose
    return replace(one, channels=moved, fine=(time, angle + loose, speed), turned=turned)


def moved(effect: Any, drive: float, loose: float) -> Any:
    """Return an effect that does at an angle what it did at that angle turned on.

    Args:
        effect: any.
        drive: by which the drive's angle is turned on [rad].
        loose: by which that of the loose gear is [rad].

    Raises:
        InputError: it is at a tooth.
    """
    by = {"drive": drive, "loose": loose}.get(gear_of(effect.kind, getattr(effect, "gear", None)), 0.0)
    if by == 0.0:
        return effect
    if not hasattr(effect, "phase"):
        text = "acts at one tooth, but the angular datum of this record relative to the teeth is unknown"
        raise InputError(Fault(effect.kind, text, "give records with an index mark"))
    phase = effect.phase + getattr(effect, "order", 1) * by
    return replace(effect, phase=float((phase + pi) % (2.0 * pi) - pi))


def in_mesh(one: Evidence, effects: Sequence[Any]) -> tuple[Evidence, list[Any]]:
    """Return a record whose loose gear counts as it does in a mesh that both gears begin at 0, and effects to that.

    Args:
        one: the record; with a mark of the loose gear it stays as it is.
        effects: that go by its angles.
    """
    seen, (drive, loose) = one.channels.contacts, one.radii
    if "loose" not in one.unmarked or not len(seen.time):
        return one, list(effects)
    ahead = seen.loose - (drive * seen.drive + seen.flank * one.rig.backlash) / loose
    by = float(np.median(ahead))
    return turn(one, 0.0, -by), [moved(effect, 0.0, by) for effect in effects]


def free(records: Sequence[Evidence], gear: str) -> int:
    """Return how many phases what goes by a gear's angle has beyond one.

    Args:
        records: all.
        gear: drive or loose gear, or empty for what goes by no angle.
    """
    count = sum(gear in one.unmarked for one in records)
    return count - (count == len(records) and count > 0)


def dear(records: Sequence[Evidence], gear: str) -> float:
    """Return the chi-square that a cause must gain more for the phases that it has in the records.

    Args:
        records: all.
        gear: by whose angle it goes.
    """
    return worth_of(free(records, gear))


def worth_of(more: int) -> float:
    """Return the chi-square by which chance gains more from so many phases than from one.

    Args:
        more: phases beyond one.
    """
    from scipy.stats import chi2

    return float(chi2.isf(CHANCE, 2 + more) - chi2.isf(CHANCE, 2)) if more else 0.0


class Phases(NamedTuple):
    """What each record by itself says of a candidate.

    Args:
        candidate: with a phase.
        gain: of a common size and a phase for each record, in chi-square.
        phase: in each record [rad], (r,).
        worth: what is known of each phase: the inverse of its variance, (r,).
        size: that all have in common, in units.
    """

    candidate: Candidate
    gain: float
    phase: Array
    worth: Array
    size: float = 0.0


def apart(found: Phases, by: Array) -> bool:
    """Whether records must be turned by more than what is known of their zeros.

    Args:
        found: what told by how much.
        by: which each record would be turned [rad], (r,).
    """
    return bool(np.any(np.abs(by) * order_of(found.candidate) * np.sqrt(np.maximum(found.worth, 0.0)) > SURE))


def phases(known: Library, rest: Array, gear: str, orders: Sequence[int] = ()) -> Phases | None:
    """Return the candidate that gains most with one size in all records and a phase in each; ``None`` without any.

    Args:
        known: candidates with their columns.
        rest: residuals, stacked, (n,).
        gear: by whose angle it goes, drive or loose.
        orders: whose multiples are not asked.
    """
    tried = []
    for which, one in enumerate(known.candidates):
        if one.phased and goes_by(one) == gear and not any(order_of(one) % n == 0 for n in orders):
            normal, right = _normal(known, which, rest)
            most = np.einsum("ki,kij,kj->", right, np.linalg.pinv(normal, rcond=1e-9, hermitian=True), right)
            tried.append((float(most), one, normal, right))
    tried.sort(key=lambda each: -each[0])
    best: Phases | None = None
    for most, one, normal, right in tried:
        if best is not None and most < best.gain:  # it would gain that with a size in each record, too
            break
        found = one_size(one, normal, right)
        best = found if best is None or found.gain > best.gain else best
    return best


def _normal(known: Library, which: int, rest: Array) -> tuple[Array, Array]:
    """Return the normal equations of a candidate in each record, (r, 2, 2) and (r, 2)."""
    count = len(known.records)
    normal, right = np.zeros((count, 2, 2)), np.zeros((count, 2))
    for name, stack in known.stacks.items():
        rows = np.flatnonzero(stack.owner == which)
        for k, part in enumerate(known.parts[name] if len(rows) else ()):
            own = stack.columns[rows, part].astype(float)
            normal[k] += own @ own.T
            right[k] += own @ rest[known.spans[name]][part]
    return normal, right


def one_size(one: Candidate, normal: Array, right: Array) -> Phases:
    """Return the size that all records have in common and the phase of each, whose gain is largest.

    Records may know a candidate in one direction only, as where all flights are at one angle: then it is the size of
    the others that tells the phase, so that no record is solved by itself.
    """
    phase = np.linspace(0.0, 2.0 * pi, PHASES, endpoint=False)
    toward = np.stack([np.cos(phase), -np.sin(phase)])
    linear, square = right @ toward, np.einsum("in,kij,jn->kn", toward, normal, toward)
    stiffest = np.maximum(np.linalg.eigvalsh(normal)[:, -1], 1e-300)
    largest = LARGEST * float(np.max(np.hypot(*right.T) / stiffest))
    tried = np.linspace(0.0, largest, SIZES + 1)[1:]
    for _ in range(ZOOMS):
        gain = 2.0 * tried[:, None, None] * linear - tried[:, None, None] ** 2 * square
        best = int(np.argmax(gain.max(axis=2).sum(axis=1)))
        size, at = float(tried[best]), phase[np.argmax(gain[best], axis=1)]
        step = tried[1] - tried[0]
        tried = np.linspace(max(size - step, 0.0), size + step, SIZES + 1)[1:]
    for _ in range(POLISHED):
        u, v = np.array([np.cos(at), -np.sin(at)]).T, np.array([-np.sin(at), -np.cos(at)]).T
        nu, nv = np.einsum("kij,kj->ki", normal, u), np.einsum("kij,kj->ki", normal, v)
        slope = size * np.sum(v * right, axis=1) - size**2 * np.sum(v * nu, axis=1)
        bow = size * np.sum(u * right, axis=1) + size**2 * (np.sum(v * nv, axis=1) - np.sum(u * nu, axis=1))
        at = at + np.where(bow > 0.0, np.clip(slope / np.where(bow > 0.0, bow, 1.0), -0.05, 0.05), 0.0)
        cross = np.sum(v * right, axis=1) - 2.0 * size * np.sum(v * nu, axis=1)
        stiff = np.sum(u * nu) - np.sum(np.where(bow > 0.0, cross**2 / np.where(bow > 0.0, bow, 1.0), 0.0))
        off = float(np.sum(u * right) - size * np.sum(u * nu))
        size = size + off / stiff if stiff > 0.0 else size
    u = np.array([np.cos(at), -np.sin(at)]).T
    gain = float(np.sum(2.0 * size * np.sum(u * right, axis=1) - size**2 * np.einsum("ki,kij,kj->k", u, normal, u)))
    return Phases(one, gain, at, np.maximum(bow, 0.0), size)


def turns(known: Library, rest: Array, gear: str, orders: Sequence[int] = ()) -> tuple[Array, Phases] | None:
    """Return by how much each record must be turned for the strongest candidate to have one phase [rad], (r,).

    Args:
        known: candidates with their columns.
        rest: residuals, stacked, (n,).
        gear: drive or loose.
        orders: whose multiples are not asked.

    Returns:
        The turns, and the candidate that told them; ``None`` where none is more than chance.
    """
    from scipy.stats import chi2

    best = phases(known, rest, gear, orders)
    if best is None or best.gain < chi2.isf(CHANCE, 2 + free(known.records, gear)):
        return None
    lost = np.array([gear in one.unmarked for one in known.records])
    first = reference(best.worth if np.all(lost) else np.where(lost, 0.0, best.worth))
    away = (best.phase - best.phase[first] + pi) % (2.0 * pi) - pi
    return np.where(lost & (best.worth > 0.0), away / order_of(best.candidate), 0.0), best


def order_of(one: Candidate) -> int:
    """Return how often a candidate with a phase comes by in a turn.

    Args:
        one: the candidate.
    """
    return int(one.shape.get("order", 1))


def reference(worth: Array) -> int:
    """Return the record whose zeros all others are counted from: the first in which there is something to be seen.

    Args:
        worth: chi-square in each record, (r,).

    >>> reference(np.array([3.0, 80.0, 900.0])), reference(np.array([3.0, 2.0]))
    (1, 0)
    """
    clear = np.flatnonzero(worth > SHOWS)
    return int(clear[0]) if len(clear) else int(np.argmax(worth))


def kept(one: Evidence, gear: str) -> bool:
    """Whether a record counts a gear's angle as it was read.

    Args:
        one: the record.
        gear: drive or loose.
    """
    return abs(one.turned[GEARS.index(gear)]) < 1e-9


def slopes_of_zeros(one: Evidence, effects: Sequence[Any], own: Array, gears: Sequence[str]) -> list[Array]:
    """Return how what effects add to the predictions of a record changes with its zeros [1/rad], each (n,).

    Args:
        one: the record.
        effects: any.
        own: what they add to it as it is, (n,).
        gears: whose zeros.
    """
    turned = [turn(one, *(STEP if gear == each else 0.0 for each in GEARS)) for gear in gears]
    return [(contribution([each], effects) - own) / STEP for each in turned]


def counted_from(records: Sequence[Evidence], effect: Any) -> str:
    """Return the record from whose zero the phase of an effect counts; empty where all have marks.

    Args:
        records: turned to the zeros of one of them.
        effect: that was found.
    """
    gear = gear_of(effect.kind, getattr(effect, "gear", None))
    if not gear or not all(gear in one.unmarked for one in records):
        return ""
    return next((one.name for one in records if kept(one, gear)), records[0].name)
