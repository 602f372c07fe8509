"""Laws of free form as tables: the points at which straight lines follow a law to a given accuracy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gears3d.errors import Fault, InputError

FIRST, MOST = 8, 200_000  # lines at first, and at most
FINEST = 1e-12  # shortest line as a part of the table: a law that is not straight over this length has a jump


def tabulate(
    law: Callable[[np.ndarray], np.ndarray], low: float, high: float, accuracy: float
) -> tuple[tuple[float, float], ...]:
    """Return points between which straight lines follow a law.

    Args:
        law: of speed, angle or time, vectorised: (n,) -> (n,).
        low: where the table begins, in the law's own unit.
        high: where it ends; the law is constant outside the table.
        accuracy: largest error, in the law's unit.

    Returns:
        Points for :func:`gears3d.effects.rows.torque_table`; the fewer, the faster a simulation: their number grows
        like accuracy^(-1/2).

    Raises:
        InputError: a law that is not finite or jumps, or invalid bounds or accuracy. A torque that jumps where the
            speed changes sign is a row :func:`gears3d.effects.rows.torque_constant` in addition to the table.

    >>> len(tabulate(lambda w: 1e-3 * w**2, 0.0, 10.0, 1e-4))
    17
    """
    if not (np.isfinite([low, high]).all() and low < high and accuracy > 0.0):
        raise InputError(Fault("", f"a table from {low:g} to {high:g}, good to {accuracy:g}, makes no sense"))
    x = np.linspace(low, high, FIRST + 1)
    y = _values(law, x)
    while len(x) <= MOST and np.diff(x).min() > FINEST * (high - low):
        parts = np.array([0.25, 0.5, 0.75])
        inner = x[:-1, None] + parts * np.diff(x)[:, None]
        found = _values(law, inner.ravel()).reshape(inner.shape)
        off = np.abs(found - y[:-1, None] - parts * np.diff(y)[:, None]).max(axis=1)
        split = off > accuracy
        if not split.any():
            return tuple(zip(x.tolist(), y.tolist(), strict=True))
        x = np.concatenate([x, inner[split, 1]])
        y = np.concatenate([y, found[split, 1]])
        order = np.argsort(x)
        x, y = x[order], y[order]
    place = float(x[:-1][np.diff(x).argmin()])
    jump = abs(float(np.diff(y)[np.diff(x).argmin()]))
    raise InputError(
        Fault(
            "",
            f"the law jumps near {place:.4g} by {jump:.4g}, or needs more than {MOST} points for {accuracy:g}",
            "leave the jump out of the law: a torque that changes sign with the speed is a row torque_constant in "
            "addition to the table; or give a larger accuracy",
        )
    )


def _values(law: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    y = np.broadcast_to(np.asarray(law(x), dtype=float), x.shape)
    if not np.isfinite(y).all():
        raise InputError(Fault("", f"the law is not finite at {x[~np.isfinite(y)][0]:g}"))
    return y
