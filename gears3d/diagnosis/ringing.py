"""Ringing after impacts: paths of flights against an oscillator that every impact excites."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import pi
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence, standardised_flight
from gears3d.diagnosis.structure import FEWEST, Structure, bounded, level_of, likelihood

Array = np.ndarray
# Tried frequencies [Hz], and ratio of neighbouring ones: lower ones do not ring, but repeat with the drive.
LOWEST, HIGHEST, APART = 30.0, 250.0, 1.03
# Tried damping ratios; the lowest makes lines about as wide as their distance.
DAMPING = (0.01, 0.03, 0.1)

# Relative step of the refined frequency, and ratios of the refined damping.
FINER, SHARES = 0.003, (0.5, 1.0, 1.7)


def rung(records: Sequence[Evidence], rest: Sequence[Array], sure: Array) -> Iterator[Structure]:
    """Return the strongest ringing after impacts, in proportion to the change of speed, equal in all records.

    One record is not sufficient: effects that repeat with the drive's fluctuation look like ringing there.

    rest: by record, in standard deviations, each (f * BINS,); sure: one over the standard deviation of each flight's
    deceleration [s²/rad], (f,).
    """
    from scipy.stats import chi2

    some = [(one, own) for one, own in zip(records, rest, strict=True) if len(own) and len(one.channels.impacts.time)]
    if len(some) < 2 or sum(len(own) for _, own in some) < FEWEST * BINS:
        return
    value = np.concatenate([own for _, own in some])
    level = level_of(value)
    value = bounded(value, level)
    turns = 2.0 * pi * LOWEST * APART ** np.arange(int(np.log(HIGHEST / LOWEST) / np.log(APART)))
    parts = np.split(value, np.cumsum([len(own) for _, own in some])[:-1])
    blows = [_blows(one) for one, _ in some]

    def strongest(tried: list[tuple[float, float]]) -> tuple[float, float, float, float]:
        return max((*_gain([_ringing(one, *each) for one in blows], parts), *each) for each in tried)

    tried = [(turn, damping) for turn in turns for damping in DAMPING]
    *_, turn, damping = strongest(tried)
    gain, likely, turn, _ = strongest(
        [(turn * (1.0 + k * FINER), damping * share) for k in range(-10, 11) for share in SHARES]
    )
    chance = float(-np.expm1(10 * len(tried) * np.log1p(-min(float(chi2.sf(likely, 2)), 0.5))))
    size = float(np.sqrt(max(gain, 0.0) * level**2 / np.sum(sure**2)))
    yield Structure("impact.duration", gain, chance, size, "rad/s^2", float(turn) / 2.0 / pi, gain * level**2)


def _gain(waves: list[Array], parts: list[Array]) -> tuple[float, float]:
    """Return the chi-square fall of one amplitude and phase in all records but the best, and twice its log-likelihood.

    The latter is at most the former. Effects that repeat with the drive's fluctuation or with a gear's angle look like
    a ringing at one speed only.
    """
    columns = [np.column_stack([np.real(wave), np.imag(wave)]) for wave in waves]
    heavy = [own.T @ own for own in columns]
    force = [own.T @ part for own, part in zip(columns, parts, strict=True)]
    whole = np.sum(heavy, axis=0)
    if np.linalg.det(whole) <= 1e-12 * np.trace(whole) ** 2:
        return 0.0, 0.0
    told = np.linalg.solve(whole, np.sum(force, axis=0))
    gains = [float(2.0 * told @ pull - told @ own @ told) for own, pull in zip(heavy, force, strict=True)]
    likely = [likelihood(max(gain, 0.0), part) for gain, part in zip(gains, parts, strict=True)]
    gain = sum(gains) - max(gains)
    return gain, min(gain, sum(likely) - max(likely))


class _Blows(NamedTuple):
    """Impacts of a record, and the points of its flights that respond to them.

    Args:
        apart: time since the previous impact, of each [s], (i,).
        jump: change of speed, (i,).
        last: last impact before each flight, -1 without one, (f,).
        since: time from it to the points of the flight [s], (f, BINS).
        width: averaging time of a point [s], (f, 1).
        heard: the record of the flights.
    """

    apart: Array
    jump: Array
    last: Array
    since: Array
    width: Array
    heard: Evidence


def _blows(one: Evidence) -> _Blows:
    """Return the impacts of a record, and the points that respond to them."""
    struck, flights = one.channels.impacts, one.channels.flights
    order = np.argsort(struck.time)
    time, jump = struck.time[order], (struck.rebound - struck.velocity)[order]
    last = np.searchsorted(time, flights.time[:, 0], side="right") - 1
    since = np.maximum(flights.time - time[np.maximum(last, 0)][:, None], 0.0)
    width = (flights.time[:, -1:] - flights.time[:, :1]) / (BINS - 1)
    return _Blows(np.diff(time, prepend=time[0]), jump, last, since, width, one)


def _ringing(one: _Blows, turn: float, damping: float) -> Array:
    """Return the response of flight points to the impacts of a record, without start angle and speed."""
    pole = turn * (1j - damping)
    state, now = [], 0j
    for kept, jump in zip(np.exp(pole * one.apart).tolist(), one.jump.tolist(), strict=True):
        now = now * kept + jump
        state.append(now)
    wave = np.where(one.last < 0, 0j, np.array(state)[np.maximum(one.last, 0)])[:, None] * np.exp(pole * one.since)
    return standardised_flight(one.heard, wave * np.sinc(turn * one.width / (2.0 * pi)))
