"""Tables for the compiled kernel: piecewise polynomials over time, an angle or the loose gear's speed."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gears3d.effects import Row
from gears3d.effects.rows import Variable
from gears3d.errors import Fault, InputError
from gears3d.lumped import layout

_ROW = {
    Variable.SPEED: layout.OMEGA2,
    Variable.ANGLE: layout.THETA2,
    Variable.TIME: layout.TIME_TABLE,
}


class Table(NamedTuple):
    """A piecewise polynomial.

    Args:
        variable: row of the work array that it is a function of, or TIME_TABLE.
        knots: where its pieces begin and end, infinite where the last ones continue, (n + 1,).
        pieces: of each piece its own zero, then its coefficients from the constant on, (n, degree + 2).
        period: after which it repeats, 0: it does not.
    """

    variable: int
    knots: np.ndarray
    pieces: np.ndarray
    period: float = 0.0

    def __call__(self, x: ArrayLike) -> np.ndarray:
        """Return the values at places ``x`` of any shape, in the variable's unit, for tests and drawings.

        >>> lines(Variable.SPEED, [(0.0, 1.0), (2.0, 5.0)])([-1.0, 0.5, 9.0]).tolist()
        [1.0, 2.0, 5.0]
        """
        x = np.asarray(x, dtype=float)
        x = np.mod(x, self.period) if self.period else x
        k = np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, len(self.pieces) - 1)
        u, value = x - self.pieces[k, 0], np.zeros(x.shape)
        for coefficient in self.pieces[k, 1:].T[::-1]:
            value = value * u + coefficient.T
        return value


def lines(variable: Variable, points: Sequence[tuple[float, float]]) -> Table:
    """Return straight lines between rising points, abscissa [rad/s, rad or s] and value, constant beyond the ends."""
    x, y = np.array(points, dtype=float).reshape(-1, 2).T
    slopes = np.concatenate([[0.0], np.diff(y) / np.diff(x), [0.0]])
    start = np.concatenate([x[:1], x])
    value = np.concatenate([y[:1], y])
    return Table(_ROW[variable], np.concatenate([[-inf], x, [inf]]), np.stack([start, value, slopes], 1))


def quintic(time: ArrayLike, value: ArrayLike) -> Table:
    """Return the quintic spline through six or more values (n,) at rising times [s], (n,).

    It has four continuous derivatives.

    >>> t = np.linspace(0.0, 1.0, 30)
    >>> bool(abs(quintic(t, np.sin(t))(0.512) - np.sin(0.512)) < 1e-10)
    True
    """
    from scipy.interpolate import PPoly, make_interp_spline

    pieces = PPoly.from_spline(make_interp_spline(np.asarray(time, float), np.asarray(value, float), k=5))
    some = np.diff(pieces.x) > 0.0
    starts = pieces.x[:-1][some]
    knots = np.concatenate([[-inf], starts[1:], [inf]])
    return Table(layout.TIME_TABLE, knots, np.column_stack([starts, pieces.c[::-1, some].T]))


def torque_lines(row: Row) -> Table:
    """Return the table of a TORQUE_TABLE; points that are missing, not finite or not rising are an InputError."""
    points = np.array(row.table, dtype=float).reshape(-1, 2)
    if len(points) == 0 or not np.isfinite(points).all() or not (np.diff(points[:, 0]) > 0.0).all():
        raise InputError(
            Fault("effect", "a tabulated torque has points that do not rise or are not finite", "sort them, once each")
        )
    return lines(Variable(int(row.p[0])), row.table)


def pack(tables: Sequence[Table], at_tables: int) -> np.ndarray:
    """Return the numbers of tables (n,) as in :mod:`gears3d.lumped.layout`: a line for each, then knots and pieces.

    They begin at ``at_tables`` in the model's numbers.
    """
    at = at_tables + layout.PER_TABLE * len(tables)
    heads, data = [], []
    for table in tables:
        count, width = table.pieces.shape
        heads += [table.variable, count, width, table.period, at, at + count + 1]
        data += [table.knots, table.pieces.ravel()]
        at += count + 1 + count * width
    return np.concatenate([np.array(heads, dtype=float), *data])
