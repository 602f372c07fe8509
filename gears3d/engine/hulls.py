"""Convex pieces in the form that Bullet loads."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

# Bullet's hull computer truncates vertices to this fraction of a piece's extent, towards its middle, on each axis.
QUANTA = 10216


def against_truncation(points: np.ndarray) -> np.ndarray:
    """Return the vertices (n, 3) of one convex piece moved outwards by half a step of Bullet's grid.

    Truncation then rounds them.

    >>> import numpy as np
    >>> against_truncation(np.array([[0.0, 0.0, 0.0], [1.0216, 1.0216, 1.0216]]))[:, 0].round(9).tolist()
    [-5e-05, 1.02165]
    """
    low, high = points.min(axis=0), points.max(axis=0)
    return points + 0.5 * (high - low) / QUANTA * np.sign(points - 0.5 * (low + high))


def write_compound(path: Path, pieces: Sequence[np.ndarray]) -> None:
    """Write an OBJ with one object for each convex piece (n, 3), which Bullet loads as a compound of convex hulls."""
    text: list[str] = []
    first = 1
    for number, piece in enumerate(pieces):
        points = against_truncation(piece)
        text.append(f"o piece{number}\n")
        text.append("v %.9f %.9f %.9f\n" * len(points) % tuple(points.ravel().tolist()))
        # only points of a face are loaded, once for each face; the hull is computed from them
        last = first + len(points) - 1
        corners = np.minimum(np.arange(first, last + 1, 3)[:, None], last - 2) + np.arange(3)
        text.append("f %d %d %d\n" * len(corners) % tuple(corners.ravel().tolist()))
        first += len(points)
    path.write_text("".join(text), encoding="ascii")
