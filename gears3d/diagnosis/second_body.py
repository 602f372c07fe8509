"""A body that the loose gear carries on a spring: at which frequency it oscillates, and the fit that begins there.

In flight the pair's centre falls as torques say and its twist oscillates at one frequency; impacts act on the gear
alone. Where flights begin with impacts, that frequency shows in their readings. Where they begin at rest, it shows in
what follows an impact, and is sought in beginnings of windows: with a wrong one these part from their readings soon.
"""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.causes import Candidate, Cause, begin, swings
from gears3d.diagnosis.path_fit import (
    BODY,
    State,
    effects_of,
    fitted,
    followed,
    gain_of,
    polished,
    restore,
    state_of,
)
from gears3d.diagnosis.shooting import NOISE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gears3d.diagnosis.shooting import Windows

Array = np.ndarray
# Part of the backlash off a flank from which on readings are of a flight, and readings of one at least.
BETWEEN, FEWEST = 0.06, 16
# Periods in a usual flight at least, readings of a window in a period at least, and ratio of neighbouring frequencies
# that are sought in flights.
CYCLES, PER_CYCLE, RATIO = 0.8, 6.0, 1.02
# Flights at most.
FLIGHTS = 200
# Part of the deviation of flights from a parabola that an oscillation must explain, and its least size in variances
# of the noise.
SHARE, LEVEL = 0.4, 1.5
# Windows in which a body is sought; part of them whose first flight may be shorter than the first fit; ratio of
# neighbouring frequencies that are tried: in three rigs, those within 10 % led to the hidden one.
TRIED, FLYING, DENSE = 12, 0.25, 1.1
# Neighbours of a frequency that flights suggest from which fits begin, too: the inertia of the first may be off.
NEIGHBOURS = (-2, -1, 0, 1, 2)
# Periods in a fall across the backlash, from which frequencies are tried, and up to which nodes tell them.
LONGEST, SHORTEST = 0.7, 14.0
# Times the first flight that windows are long in the fits of all frequencies, and times as long in each later one;
# fits that are kept after the first, and part of its frequency by which another must differ to be another.
FARTHER, KEPT, SAME = (2.2, 1.4), 4, 3e-3
# Part of the chi-square in beginnings of windows that the best body may leave for fits in longer ones to be made.
HELPS = 0.5
# Inertia over that of the gear from which fits begin, the damping ratio, and rounds of the fits of all frequencies.
FIRST, DAMPING, SHORT = 0.2, 0.05, 4
# Plays from which fits begin, in backlashes, and part of the damping at which a body was tried that one with play
# begins with at least.
PLAYS, LEAST = (0.03, 0.1, 0.3), 0.2


def flights(windows: Windows) -> list[tuple[Array, Array]]:
    """Return times, and displacements of the loose gear as if the drive stood still in noise, of free flights.

    Args:
        windows: of the records.
    """
    turned = windows.read + windows.radii[0] * windows.between(windows.drive[0])
    amid = _amid(windows)
    cut = np.flatnonzero(np.diff(amid.astype(int)) | np.diff(windows.window)) + 1
    made = []
    for rows in np.split(np.arange(len(amid)), cut):
        if amid[rows[0]] and len(rows) >= FEWEST:
            made.append((windows.time[rows], turned[rows] / windows.sigma[rows]))
    every = np.linspace(0, len(made) - 1, min(len(made), FLIGHTS)).round().astype(int)
    return [made[k] for k in every]


def frequencies(windows: Windows) -> list[float]:
    """Return the frequency [rad/s] at which flights oscillate about their parabolas, if they do.

    Args:
        windows: of the records.
    """
    seen = flights(windows)
    if not seen:
        return []
    lasts = float(np.median([time[-1] - time[0] for time, _ in seen]))
    spacing = float(np.median([(time[-1] - time[0]) / (len(time) - 1) for time, _ in seen]))
    low, high = 2.0 * pi * CYCLES / lasts, 2.0 * pi / (PER_CYCLE * spacing)
    if high <= low:
        return []
    turns = low * RATIO ** np.arange(int(np.log(high / low) / np.log(RATIO)) + 1)
    off, gains = np.zeros(len(seen)), np.zeros((len(seen), len(turns)))
    for k, (time, place) in enumerate(seen):
        since = (time - time.mean()) / (time[-1] - time[0])
        base = np.linalg.qr(np.stack([np.ones_like(since), since, since**2], axis=1))[0]
        rest = place - base @ (base.T @ place)
        off[k] = float(rest @ rest) / (len(rest) - 3)
        wave = np.exp(1j * np.outer(turns, time - time.mean()))
        own = np.stack([wave.real, wave.imag], axis=1)
        own = own - (own @ base) @ base.T
        normal, right = own @ own.transpose(0, 2, 1), own @ rest
        sizes = np.linalg.solve(normal + 1e-9 * np.trace(normal[0]) * np.eye(2), right[:, :, None])[:, :, 0]
        gains[k] = np.sum(sizes * right, axis=1) / (len(rest) - 3)
    if np.median(off) < LEVEL:
        return []
    most = 4.0 * float(np.median(off))
    share = np.mean(gains * (np.minimum(off, most) / off)[:, None], axis=0) / np.mean(np.minimum(off, most))
    best = int(np.argmax(share))
    if share[best] < SHARE or not 0 < best < len(turns) - 1:
        return []
    left, here, right_ = share[best - 1 : best + 2]
    shift = 0.5 * (left - right_) / (left - 2.0 * here + right_)
    return [float(turns[best] * RATIO**shift)]


def _amid(windows: Windows) -> Array:
    """Return whether readings are between the flanks, (n,)."""
    place, edge = windows.read - windows.guessed[windows.record[windows.window]], BETWEEN * windows.backlash
    return (place > edge) & (place < windows.backlash - edge)


def _flight(windows: Windows) -> float:
    """Return the part of windows, from their beginning on, in which most are still in their first flight."""
    ends = np.ones(len(windows))
    share, met = (windows.node + windows.beyond) / (windows.drive[0].shape[1] - 1), ~_amid(windows)
    np.minimum.at(ends, windows.window[met], share[met])
    return float(np.quantile(ends, FLYING))


def carrying(windows: Windows, turns: Sequence[float], now: State, start: State) -> State:
    """Return a state of a sample of windows with a body on a spring as well, of the frequency that leaves least.

    Args:
        windows: sample.
        turns: frequencies that are tried [rad/s]; any up to those that nodes resolve without.
        now: state of the sample, whose zeros and starts are taken.
        start: causes to start with.
    """
    restore(windows, now)
    few = windows.some(TRIED)[0]
    few.zeros, few.weight = windows.guessed.copy(), np.ones(len(few))
    own, cycle = windows.values.inertia, 2.0 * pi / windows.fall
    law = Candidate(BODY, {}, "inertia", own, False, ())
    flight = _flight(few)
    falls = _tried(few.until(flight), start.causes, _cause(law, SHORTEST / 2.0 * cycle, FIRST), anew=True)
    size = float(falls.causes[-1].numbers[0]) / own
    grid = cycle * LONGEST * DENSE ** np.arange(int(np.log(SHORTEST / LONGEST) / np.log(DENSE)) + 1)
    near = [turn * DENSE**k for turn in turns for k in NEIGHBOURS]
    reach = FARTHER[0] * flight
    part = few.until(reach) if reach < 1.0 else few
    found = [_tried(part, falls.causes[:-1], _cause(law, turn, size), SHORT) for turn in near or grid.tolist()]
    found = _apart(part, found)
    if not _level(part, found[0]) < HELPS * _level(part, _longer(part, falls._replace(causes=falls.causes[:-1]))):
        restore(windows, now)
        return now
    while part is not few:
        reach *= FARTHER[1]
        part = few.until(reach) if reach < 1.0 else few
        found = [_longer(part, one) for one in found]
    best = min(found, key=lambda one: _level(few, one))
    restore(windows, now)
    windows.zeros, windows.weight = best.zeros.copy(), np.ones(len(windows))
    return _longer(windows, best)


def _apart(windows: Windows, tries: Sequence[State]) -> list[State]:
    """Return the best states of other frequencies each."""
    made: list[State] = []
    for one in sorted(tries, key=lambda one: _level(windows, one)):
        turn = swings(one.causes[-1])[0]
        if all(abs(turn / swings(other.causes[-1])[0] - 1.0) > SAME for other in made):
            made.append(one)
    return made[:KEPT]


def _cause(law: Candidate, turn: float, size: float) -> Cause:
    """Return a body of a natural frequency [rad/s] and an inertia over that of the gear."""
    per = (1.0 + 1.0 / size) / law.unit
    shape = {"stiffness": turn**2 / per, "damping": 2.0 * DAMPING * turn / per}
    return begin(law._replace(shape=shape), np.array([size]))


def _tried(part: Windows, causes: Sequence[Cause], cause: Cause, rounds: int = 8, *, anew: bool = False) -> State:
    """Return a fit of one more cause in beginnings of windows."""
    every = (*causes, cause)
    zeros, starts = part.zeros.copy(), part.starts
    part.restart(effects_of(every), anew=anew)
    made = fitted(part, state_of(part, every, part.residuals(effects_of(every))), rounds)
    part.zeros, part.starts = zeros, starts
    return made


def _longer(part: Windows, now: State) -> State:
    """Return a fit in windows of another length, or other ones, whose starts follow their readings."""
    part.zeros, part.turned, part.weight = now.zeros.copy(), now.turned.copy(), np.ones(len(part))
    if len(part) == len(now.starts.place):
        part.starts = now.starts
    effects = effects_of(now.causes)
    part.restart(effects)
    rest = followed(part, effects, part.residuals(effects))
    return fitted(part, state_of(part, now.causes, rest))


def _level(windows: Windows, now: State) -> float:
    """Return the usual mean square of residuals."""
    return float(np.median(windows.level(now.rest)))


def playing(windows: Windows, now: State, least: float) -> State:
    """Return a state whose last cause, a body on a spring, has play as well where that gains so much."""
    if not now.causes or now.causes[-1].candidate.kind != BODY:  # no body helps
        return now
    best = now
    for part in PLAYS if _level(windows, now) > NOISE else ():
        restore(windows, now)
        tried = polished(windows, _longer(windows, now._replace(causes=(*now.causes[:-1], _loose(windows, now, part)))))
        if gain_of(windows, best, tried)[0] > least:
            best = tried
    restore(windows, best)
    return best


def _loose(windows: Windows, now: State, part: float) -> Cause:
    """Return the last cause, a body on a spring, with a play of a part of the backlash."""
    cause = now.causes[-1]
    damping = max(float(cause.numbers[2]), LEAST * cause.candidate.shape["damping"])
    shape = {"stiffness": float(np.exp(cause.numbers[1])), "damping": damping}
    shape["play"] = part * windows.backlash / windows.radii[1]
    return begin(cause.candidate._replace(shape=shape), cause.numbers[:1] / cause.candidate.unit)
