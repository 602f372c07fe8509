"""Tables of the displacement that the flanks impose, over the drive's angle: piecewise polynomials through samples."""

from __future__ import annotations

from collections.abc import Callable
from math import lcm, pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears import HarmonicDeviation, Misalignment, ToothDeviation
from gears3d.gears.rolling import rolled
from gears3d.gears.surface import compile_surfaces
from gears3d.lumped import layout
from gears3d.lumped.tables import Table

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.gears.deviation import Deviation

Array = NDArray[np.float64]

DEGREE = 7  # Of a piece: a balance of number and length of the pieces
# Chebyshev points of the second kind in [0, 1].
NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
CHECKS = 0.5 * (NODES[1:] + NODES[:-1]) + np.array([0.011, -0.017, 0.019, 0.005, -0.013, 0.017, -0.007])
JUMP = 1e4  # change over the shortest piece that only a jump makes, not a slope discontinuity, in accuracies
CLOSER = (1.0, 0.03, 1e-3)  # parts of the first width next to which slope discontinuities are looked for
NOUGHT = 2e-15  # displacement that is rounding [m]
MOST = 1_000_000  # so many spans at once are noise, not slope discontinuities
_AMONG = np.argsort(np.concatenate([NODES, CHECKS]))
_SOLVE = np.linalg.inv(np.vander(NODES, increasing=True))
_CHECK = np.vander(CHECKS, DEGREE + 1, increasing=True)
ACCURACY = 1e-13  # of the polynomials, at the places tried [m]
NARROW = 1e-9  # shortest piece, in pitches


def fit(function: Callable[[Array], Array], edges: Array, accuracy: float, narrow: float) -> tuple[Array, Array]:
    """Return the knots (m + 1,) and pieces (m, 9) of a piecewise polynomial of degree 7 that follows a function.

    Each piece holds its own zero and coefficients. Pieces end at the rising ``edges`` (n + 1,) and meet at slope
    discontinuities, which are found where the polynomials of both sides intersect. The largest error at the places
    tried is ``accuracy``; pieces as short as ``narrow`` are not divided. A jump of the function is a ValueError that
    carries its place.

    >>> knots, pieces = fit(lambda x: np.abs(x - 0.3), np.array([0.0, 1.0]), 1e-11, 1e-9)
    >>> 0.3 in knots.round(12)
    True
    """
    spans = np.stack([edges[:-1], edges[1:]], 1)
    coarse = 0.004 * float(np.median(spans[:, 1] - spans[:, 0]))
    done, left = np.zeros((0, DEGREE + 3)), spans
    for part in CLOSER:  # short polynomials next to a discontinuity are accurate up to where they intersect
        more, left = _divide(function, left, accuracy, part * coarse)
        done, left = _corners(function, np.concatenate([done, more]), left, accuracy, narrow)
    more, rest = _divide(function, left, accuracy, narrow)
    jump = np.abs(np.sum(rest[:, 3:] * (rest[:, 1:2] - rest[:, :1]) ** np.arange(1, DEGREE + 1), axis=1))
    if (jump > JUMP * accuracy).any():
        raise ValueError(rest[jump > JUMP * accuracy, 0][0])
    found = np.concatenate([done, more, rest])
    found = _joined(found[np.argsort(found[:, 0])])
    return np.append(found[:, 0], found[-1, 1]), np.delete(found, 1, 1)


def _divide(function, spans: Array, accuracy: float, least: float) -> tuple[Array, Array]:
    """Divide spans at their largest curvature until polynomials fit; returns those, and spans shorter than least."""
    done, rest = [np.zeros((0, DEGREE + 3))], [np.zeros((0, DEGREE + 3))]
    while len(spans):
        if len(spans) > MOST:
            raise ValueError(spans[0, 0])
        width = spans[:, 1] - spans[:, 0]
        places = spans[:, :1] + width[:, None] * np.concatenate([NODES, CHECKS])
        places[:, DEGREE] = spans[:, 1]
        values = _sample(function, places)
        normal = values[:, : DEGREE + 1] @ _SOLVE.T
        off = np.abs(normal @ _CHECK.T - values[:, DEGREE + 1 :]).max(axis=1)
        pieces = np.concatenate([spans, normal / width[:, None] ** np.arange(DEGREE + 1)], axis=1)
        good, short = off <= accuracy, width <= least
        done.append(pieces[good])
        rest.append(pieces[~good & short])
        again = ~good & ~short
        spans = _about_bends(places[again][:, _AMONG], values[again][:, _AMONG])
    return np.concatenate(done), np.concatenate(rest)


def _about_bends(x: Array, y: Array) -> Array:
    """Divide spans into up to three: before, about and after the largest curvature of the samples."""
    slope = np.diff(y) / np.diff(x)
    j = 1 + np.abs(np.diff(slope)).argmax(axis=1)
    row = np.arange(len(x))
    cuts = np.stack([x[:, 0], x[row, j - 1], x[row, j + 1], x[:, -1]], 1)
    spans = np.concatenate([cuts[:, k : k + 2] for k in range(3)])
    return spans[spans[:, 1] > spans[:, 0]]


def _sample(function, places: Array) -> Array:
    flat, back = np.unique(places, return_inverse=True)
    return function(flat)[back].reshape(places.shape)


def _corners(function, done: Array, left: Array, accuracy: float, narrow: float) -> tuple[Array, Array]:
    """Extend the polynomials on both sides of short spans to where they intersect, if the function follows them."""
    if not len(left):
        return done, left[:, :2]
    ends, starts = {b: i for i, b in enumerate(done[:, 1])}, {a: i for i, a in enumerate(done[:, 0])}
    open_, tries = [], []
    left = left[np.argsort(left[:, 0])]
    merged = [list(left[0, :2])]
    for a, b in left[1:, :2]:
        if a == merged[-1][1]:
            merged[-1][1] = b
        else:
            merged.append([a, b])
    for a, b in merged:
        sides = ends.get(a), starts.get(b)
        place = None if None in sides else _cross(done[sides[0]], done[sides[1]], a, b, narrow)
        if place is None:
            open_.append((a, b))
        else:
            tries.append((a, b, *sides, place))
    if tries:
        bounds, places = np.array([t[:2] for t in tries]), np.array([t[4] for t in tries])
        x = bounds[:, :1] + (bounds[:, 1:] - bounds[:, :1]) * np.linspace(0.06, 0.94, 8)
        x = np.sort(np.concatenate([x, places[:, None]], 1), axis=1)
        y = _sample(function, x)
        for (a, b, i, j, place), xs, ys in zip(tries, x, y, strict=True):
            mine = np.where(xs <= place, _value(done[i], xs), _value(done[j], xs))
            if np.abs(mine - ys).max() <= 4 * accuracy:
                done[i, 1] = place
                done[j] = _moved(done[j], place)
            else:
                open_.append((a, b))
    return done, np.array(open_, dtype=float).reshape(-1, 2)


def _value(piece: Array, x: Array) -> Array:
    return np.polynomial.polynomial.polyval(x - piece[0], piece[2:])


def _moved(piece: Array, start: float) -> Array:
    """The same polynomial with its zero elsewhere."""
    p = np.polynomial.Polynomial(piece[2:])(np.polynomial.Polynomial([start - piece[0], 1.0])).coef
    return np.concatenate([[start, piece[1]], p, np.zeros(DEGREE + 1 - len(p))]).astype(np.float64)


def _cross(one: Array, two: Array, a: float, b: float, narrow: float) -> float | None:
    """Where two polynomials intersect between a and b."""
    low, high = _value(one, np.array([a, b])) - _value(two, np.array([a, b]))
    if not low * high < 0.0:
        return None
    sign = np.sign(low)
    while b - a > 1e-6 * narrow and a < 0.5 * (a + b) < b:
        middle = 0.5 * (a + b)
        off = sign * float(_value(one, np.array(middle)) - _value(two, np.array(middle)))
        a, b = (middle, b) if off > 0.0 else (a, middle)
    return 0.5 * (a + b)


def _joined(pieces: Array) -> Array:
    """Merge neighbours that are both zero within rounding."""
    reach = (pieces[:, 1] - pieces[:, 0])[:, None, None] * np.append(NODES, CHECKS)[:, None]
    flat = np.abs((reach ** np.arange(DEGREE + 1) @ pieces[:, 2:, None])[..., 0]).max(axis=1) < NOUGHT
    pieces = pieces.copy()
    pieces[flat, 2:] = 0.0
    first = ~flat | ~np.concatenate([[False], flat[:-1]])
    last = np.append(first[1:], True)
    joined = pieces[first]
    joined[:, 1] = pieces[last, 1]
    return joined


def flank_tables(pair: Pair, low: float, high: float, ticks: Callable[[], None] | None = None) -> tuple[Table, Table]:
    """Return the displacement of the contact on the active and reverse flanks by deviations, reliefs and mounting.

    Both are tables over the drive's angle from ``low`` to ``high`` [rad], degree 7, in m: φ(θ) of the active flanks,
    −φ(θ) of the reverse ones. Where the period is shorter, tables repeat. Teeth out of mesh are an InputError.
    ``ticks`` is called now and then, to end early by an exception.

    >>> from gears3d.gears import Gear, Pair, ToothDeviation
    >>> gear = Gear(3.5e-3, 30)
    >>> thick = Pair.from_backlash(gear, gear, 1e-4).with_deviations(ToothDeviation("drive", "active", 3, 1e-5))
    >>> active, reverse = flank_tables(thick, 0.0, 10.0)
    >>> active(np.array([0.0, 4 * np.pi / 30])).round(9).tolist(), len(reverse.pieces)
    ([0.0, 1e-05], 1)
    """
    pitch, period = 2.0 * pi / pair.drive.teeth, table_period(pair)
    repeats = period <= 1.02 * (high - low)
    first, last = (0, round(period / pitch)) if repeats else (np.floor(low / pitch) - 1, np.ceil(high / pitch) + 1)
    edges = pitch * np.arange(first, last + 1, dtype=np.float64)
    if repeats:
        edges[-1] = period
    surfaces = compile_surfaces(pair)

    def displacement(flank: int, theta: Array) -> Array:
        places = rolled(pair, surfaces, theta, flank, ticks)[0]
        return pair.backlash - places if flank else places

    tables = []
    for flank in (0, 1):
        try:
            knots, pieces = fit(lambda theta, flank=flank: displacement(flank, theta), edges, ACCURACY, NARROW * pitch)
        except ValueError as why:
            fault = Fault("gears", f"have flanks whose place jumps at {why} rad of the drive", "deviate less from true")
            raise InputError(fault) from why
        tables.append(Table(layout.THETA1, knots, pieces, period if repeats else 0.0))
    return tables[0], tables[1]


def table_period(pair: Pair) -> float:
    """Return the angle of the drive gear after which the flanks' displacements repeat [rad].

    It is one pitch when all teeth of both gears are the same and run true, a revolution of the gear whose teeth do not,
    or the hunting period.

    >>> from gears3d.gears import Gear, Pair
    >>> table_period(Pair.from_backlash(Gear(2e-3, 20), Gear(2e-3, 30), 1e-4)) * 20 / (2 * pi)
    1.0
    """
    uneven = {one.gear for one in pair.deviations if not _same_on_all_teeth(pair, one)}
    uneven |= {one.gear for one in pair.mounting if not isinstance(one, Misalignment)}
    turns = [pair.gear(which).teeth for which in uneven]
    return 2.0 * pi * lcm(*turns) / pair.drive.teeth if turns else 2.0 * pi / pair.drive.teeth


def _same_on_all_teeth(pair: Pair, one: Deviation) -> bool:
    if isinstance(one, HarmonicDeviation):
        return one.order % pair.gear(one.gear).teeth == 0
    return not isinstance(one, ToothDeviation)


def perfect(pair: Pair) -> bool:
    """Whether a pair's flanks are perfect involutes on true axes, which need no table.

    >>> from gears3d.gears import Gear, Pair
    >>> perfect(Pair.from_backlash(Gear(2e-3, 20), Gear(2e-3, 30), 1e-4))
    True
    """
    shaped = ("tip_relief", "root_relief", "lead_crowning", "helix_slope")
    gears = (pair.drive, pair.loose)
    return not (pair.mounting or pair.deviations or any(getattr(gear, name) for gear in gears for name in shaped))
