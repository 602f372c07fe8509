"""One pulse a tooth: angles of a toothed wheel, with missing teeth, and of wheels with spacing errors."""

from __future__ import annotations

from math import pi
from typing import Literal, NamedTuple

import numpy as np

from gears3d.measured.readers.decode.results import Edges, Even, Note, refuse, time_of
from gears3d.measured.readers.decode.switches import Switches, levels, switches

# Ratio of a pulse spacing to its neighbours from which teeth are missing.
GAP = 1.5


class Spacing(NamedTuple):
    """Spacing errors of a toothed wheel.

    Args:
        error: by which each tooth passes too early, in the order of the pulses from the first on [rad], (m,).
        sigma: standard deviation of each [rad], (m,).
        revolutions: that were averaged.
    """

    error: np.ndarray
    sigma: np.ndarray
    revolutions: int


def tacho(
    time: np.ndarray | Even,
    voltage: np.ndarray,
    positions: int,
    missing: int | Literal["find"] = 0,
    edge: Literal["rising", "falling"] = "rising",
    channel: str = "tacho",
    threshold: float | None = None,
    hysteresis: float | None = None,
) -> Edges:
    """Return when the teeth of a wheel passed, one angle a tooth.

    Args:
        time: of the samples [s], (n,), or their even rate.
        voltage: of the pulses, or 0 and 1 [V], (n,).
        positions: teeth in a revolution, missing ones included: 60 of a wheel 60-2; pulses in a revolution.
        missing: neighbouring teeth that are left out: 2 of a wheel 60-2, or ``"find"``.
        edge: that is taken; that of a tooth's sharper end.
        channel: named in faults and notes.
        threshold: middle of the hysteresis [V]; found when not given.
        hysteresis: full width [V]; 40 % of the difference of the levels when not given.

    Returns:
        Times and angles, zero at the first tooth after the gap, or at the first pulse of a wheel without one.

    Raises:
        InputError: there are no two pulses, or the declared gap is not there.

    >>> turn = np.linspace(0.0, 2.0, 4001)
    >>> found = tacho(turn, np.sin(2 * pi * 6 * turn - 1.0) > 0, positions=6)
    >>> len(found.time), round(float(np.ptp(found.angle) / pi), 6), found.notes[-1].kind
    (12, 3.666667, 'pulses')
    """
    passed = switches(np.asarray(voltage), levels(voltage, channel, threshold, hysteresis))
    return pulses(time, passed, positions, missing, edge)


def pulses(
    time: np.ndarray | Even,
    passed: Switches,
    positions: int,
    missing: int | Literal["find"] = 0,
    edge: Literal["rising", "falling"] = "rising",
) -> Edges:
    """Return when the teeth of a wheel passed, from the switches of its channel; for channels read in blocks.

    Args:
        time: of the samples [s], (n,), or their even rate.
        passed: switches of the channel.
        positions: teeth in a revolution, missing ones included.
        missing: neighbouring teeth that are left out, or ``"find"``.
        edge: that is taken.

    Raises:
        InputError: there are no two pulses, or the declared gap is not there.

    >>> from gears3d.measured.readers.decode.switches import Levels
    >>> row = np.array([0, 1, 2, 5, 6, 7, 10, 11]) + 0.5
    >>> rises = Switches(np.sort(np.r_[row, row + 0.2]), np.array([True, False] * 8), False, 12, Levels(0.3, 0.7, "n"))
    >>> (pulses(Even(1.0), rises, 5, missing=2).angle * 5 / (2 * pi)).round(9).tolist()
    [-5.0, -4.0, -3.0, 0.0, 1.0, 2.0, 5.0, 6.0]
    """
    name = passed.levels.channel
    if positions < 1 or int(positions) != positions:
        raise refuse(name, f"has {positions} positions", "give the teeth in a revolution, missing ones included")
    if edge not in ("rising", "falling"):
        raise refuse(name, f"takes the {edge!r} edges", "give rising or falling")
    at = time_of(passed.row[passed.rises == (edge == "rising")], time)
    if len(at) < 2:
        raise refuse(name, f"has {len(at)} pulses", "see whether the wheel turned, and the thresholds")
    place, notes = _places(at, int(positions), missing, name)
    text = (
        f"{len(at)} pulses, {positions} positions a revolution: the angle is known there only, nothing is seen of what "
        f"happens between two pulses; the wheel is taken to turn one way all the time"
    )
    seen = (*passed.levels.notes, *notes, Note("pulses", name, float(len(at)), "", text))
    return Edges(at, 2 * pi / positions * place, seen)


def _places(at: np.ndarray, positions: int, missing: int | Literal["find"], name: str) -> tuple[np.ndarray, list[Note]]:
    """Return the position of every pulse, zero after the first gap, and irregularities of the gaps."""
    plain = np.arange(len(at), dtype=float)
    if missing == 0:
        return plain, []
    ratio, notes = _ratios(at), []
    found = missing
    if found == "find":
        wide = ratio[ratio > GAP]
        found = round(float(np.median(wide))) - 1 if len(wide) else 0
    gaps = np.flatnonzero((ratio > found + 0.5) & (ratio < found + 1.5)) if found else np.zeros(0, dtype=int)
    if missing == "find":
        notes = [Note("missing-teeth", name, found, "", f"{found} teeth are missing, seen {len(gaps)} times")]
    elif not len(gaps) and len(at) >= positions:
        what = f"shows no gap of {missing} teeth in {len(at)} pulses"
        raise refuse(name, what, "declare the missing teeth as they are, or let them be found")
    if not len(gaps):
        return plain, notes
    between = np.diff(gaps)
    odd = between != positions - found
    if odd.any():
        which = int(np.argmax(odd))
        text = (
            f"{int(odd.sum())} of {len(between)} revolutions have another number of pulses than {positions - found}, "
            f"the first {between[which]} after {at[gaps[which]]:.6g} s"
        )
        notes.append(Note("lost-pulses", name, float(np.sum(np.abs(between - (positions - found)))), "", text, False))
    step = np.ones(len(at))
    step[0] = 0.0
    step[gaps + 1] += found
    place = np.cumsum(step)
    return place - place[gaps[0] + 1], notes


def _ratios(at: np.ndarray) -> np.ndarray:
    """Return every distance of pulses in terms of the mean of its two neighbours; at an end there is but one."""
    own = np.diff(at)
    if len(own) < 2:
        return np.ones(len(own))
    early, late = np.concatenate([[own[1]], own[:-1]]), np.concatenate([own[1:], [own[-2]]])
    return own / np.sqrt(early * late)


def spacing(edges: Edges, positions: int, channel: str = "tacho") -> Spacing:
    """Return the spacing errors of the teeth of a wheel, from whole revolutions at nearly steady speed.

    Every pulse is compared with the mean of the revolution around it. Motion of the shaft itself once or a
    whole number of times per revolution counts as the wheel's: a record of the wheel alone cannot separate the two.

    Args:
        edges: of the wheel.
        positions: teeth in a revolution, missing ones included.
        channel: named in faults.

    Raises:
        InputError: there are fewer than three revolutions.

    >>> even = np.arange(200.0)
    >>> round(float(spacing(Edges(even + 0.01 * (even % 4 == 0), even * pi / 2), 4).error.min() * 2 / pi), 6)
    -0.0075
    """
    place = np.round(edges.angle * positions / (2 * pi)).astype(np.int64)
    full = np.arange(place[0], place[-1] + 1)
    if len(full) < 3 * positions + 1:
        what = f"turned by {(len(full) - 1) / positions:.3g} revolutions"
        raise refuse(channel, what, "spacing is found from three revolutions and more")
    every = np.interp(full, place, edges.time)
    weight = np.ones(positions + 1 if positions % 2 == 0 else positions)
    if positions % 2 == 0:
        weight[[0, -1]] = 0.5
    half = len(weight) // 2
    mean = np.convolve(every, weight / weight.sum(), "valid")
    speed = 2 * pi / positions * np.gradient(np.arange(len(mean)), mean)
    inner = place - place[0]
    own = (inner >= half) & (inner < half + len(mean))
    early = (mean[inner[own] - half] - edges.time[own]) * speed[inner[own] - half]
    tooth = np.mod(place[own], positions)
    seen = np.bincount(tooth, minlength=positions)
    error = np.bincount(tooth, early, minlength=positions) / np.maximum(seen, 1)
    spread = np.bincount(tooth, early**2, minlength=positions) / np.maximum(seen, 1) - error**2
    teeth = seen > 0
    error[teeth] -= error[teeth].mean()
    sigma = np.sqrt(np.maximum(spread, 0.0) / np.maximum(seen - 1, 1))
    return Spacing(np.where(teeth, error, 0.0), np.where(teeth, sigma, 0.0), int(seen.max()))


def evened(edges: Edges, found: Spacing, channel: str = "tacho") -> Edges:
    """Return edges corrected for the spacing errors of the teeth; only on request.

    Args:
        edges: of the wheel.
        found: of :func:`spacing`, from this record or a steadier one of the same wheel, with the same gap.
        channel: named in the note.

    >>> even = np.arange(200.0)
    >>> edges = Edges(even + 0.01 * (even % 4 == 0), even * pi / 2)
    >>> bool(np.ptp(np.diff(np.interp(even, *evened(edges, spacing(edges, 4))[:2]))[9:-9]) < 1e-4)
    True
    """
    positions = len(found.error)
    place = np.round(edges.angle * positions / (2 * pi)).astype(np.int64)
    worst = float(np.max(np.abs(found.error)))
    text = (
        f"teeth put where they stand, up to {worst:.3g} rad off even spacing (sigma {float(found.sigma.max()):.2g} "
        f"rad, {found.revolutions} revolutions); what the shaft itself did once a revolution is gone, too"
    )
    note = Note("spacing-corrected", channel, worst, "rad", text)
    return edges._replace(angle=edges.angle - found.error[np.mod(place, positions)], notes=(*edges.notes, note))
