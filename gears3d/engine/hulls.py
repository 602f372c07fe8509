"""Convex pieces on their way into Bullet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np


def write_compound(path: Path, pieces: Sequence[np.ndarray]) -> None:
    """Write an OBJ with one object a piece, which Bullet loads as a compound of convex hulls.

    Args:
        path: of the file.
        pieces: convex point sets, each (n, 3), in the unit of the world.
    """
    lines: list[str] = []
    first = 1
    for number, points in enumerate(pieces):
        lines.append(f"o piece{number}")
        lines += [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in points]
        # only points named by a face are loaded; which faces does not matter, the hull is taken anew
        lines += [f"f {first} {first + i} {first + i + 1}" for i in range(1, len(points) - 1)]
        first += len(points)
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
