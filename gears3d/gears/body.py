"""The inside of a gear's solid: bore, hub, web and rim, turned about the axis."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def inner_radius(gear: Gear) -> float:
    """Return where the toothed end face ends inwards [m]: at the rim, at the bore, or 0 for a full face.

    Args:
        gear: the gear.
    """
    return gear.pocket[1] if gear.pocket else 0.5 * (gear.bore or 0.0)


def inside_contour(gear: Gear, levels: Array) -> Array:
    """Return the contour from the lower face's inner edge to the upper one's: radius [m], height [m], angle [rad].

    It touches the axis (radius 0) where the body is full there. Each half keeps the angle of its end face; the wall
    of the bore turns from one to the other in as many steps as the teeth do.
    """
    bore = 0.5 * (gear.bore or 0.0)
    half = np.zeros((0, 2))
    face = levels[-1, 0]
    if gear.pocket:
        hub, rim = gear.pocket
        web = 0.5 * (gear.web or 0.0)
        half = np.array([[rim, face], [rim, web]])
        if gear.hub is None:
            face = web
        else:
            half = np.vstack([half, [[hub, web], [hub, face]]])
    below = np.c_[half * [1.0, -1.0], np.full(len(half), levels[0, 1])]
    above = np.c_[half, np.full(len(half), levels[-1, 1])][::-1]
    steps = levels[:, :2] if bore > 0.0 else levels[[0, -1], :2]
    wall = np.c_[np.full(len(steps), bore), steps * [face / levels[-1, 0], 1.0]]
    return np.vstack([below, wall, above])


def inside_surface(gear: Gear, inner: Array, levels: Array) -> tuple[Array, Indices, int]:
    """Return the surface between the inner edges of both end faces.

    Args:
        gear: the gear.
        inner: points of that edge [m], (n, 2), or the centre alone, (1, 2).
        levels: height, angle and angle of crowning of each level, (levels, 3).

    Returns:
        Points, those of the lower edge first [m], (m, 3); triangles, (k, 3); number of the first point of the upper
        edge.
    """
    contour, n = inside_contour(gear, levels), len(inner)
    if n == 1:
        return lift(inner, levels[[0, -1]]), np.zeros((0, 3), np.int64), 1
    around = inner / np.hypot(*inner.T)[:, None]
    points, starts, faces = [], [], []
    count = 0
    for radius, height, angle in contour:
        ring = around if radius > 0.0 else np.zeros((1, 2))
        points.append(lift(radius * ring, np.array([[height, angle, 0.0]])))
        starts.append((count, radius > 0.0))
        count += len(ring)
    back = contour[-1, 2] < contour[0, 2]
    for (lower, lower_ring), (upper, upper_ring) in pairwise(starts):
        a, b = loop(0, n)[:, ::-1].T
        if lower_ring and upper_ring:
            faces.append(np.c_[a + lower, b + lower, (a if back else b) + upper])
            faces.append(np.c_[(b if back else a) + lower, b + upper, a + upper])
        elif lower_ring:
            faces.append(np.c_[a + lower, b + lower, np.full(n, upper)])
        elif upper_ring:
            faces.append(np.c_[np.full(n, lower), b + upper, a + upper])
    return np.vstack(points), np.vstack(faces), starts[-1][0]


def drawn_inside(gear: Gear, inner: Array, levels: Array) -> list[tuple[Array, Indices, Array]]:
    """Return the inside as strips for drawing, each with flat or round normals of its own.

    Args:
        gear: the gear.
        inner: points of the inner edge of the end faces [m], (n, 2), or the centre alone, (1, 2).
        levels: height, angle and angle of crowning of each level, (levels, 3).

    Returns:
        Points, triangles and normals of each strip.
    """
    if len(inner) == 1:
        return []
    around, parts = inner / np.hypot(*inner.T)[:, None], []
    contour, n = inside_contour(gear, levels), len(inner)
    for (r1, z1, a1), (r2, z2, a2) in pairwise(contour):
        if r1 == r2 == 0.0:
            continue
        points = np.vstack([lift(r * around, np.array([[z, a, 0.0]])) for r, z, a in ((r1, z1, a1), (r2, z2, a2))])
        radial = np.vstack([lift(around, np.array([[0.0, a, 0.0]])) for a in (a1, a2)])
        axial, inward = r1 - r2, z1 - z2
        normals = radial * inward + np.array([0.0, 0.0, -axial])
        faces = stitch(loop(0, n)[:, ::-1], n, 2, np.full(n, a2 < a1))
        first, second, third = (points[faces[:, corner]] for corner in range(3))
        area = np.linalg.norm(np.cross(second - first, third - first), axis=1)
        parts.append((points, faces[area > 0.0], normals / np.linalg.norm(normals, axis=1)[:, None]))
    return parts


def loop(first: int, count: int) -> Indices:
    """Return the segments of a closed chain of points.

    Args:
        first: number of the first point.
        count: number of points.

    Returns:
        Start and end of each segment, (count, 2).

    >>> loop(0, 3).tolist()
    [[0, 1], [1, 2], [2, 0]]
    """
    around = first + np.arange(count)
    return np.c_[around, np.roll(around, -1)]


def lift(points: Array, levels: Array, turns: Array | None = None) -> Array:
    """Put plane points on every level, turned by its angle.

    Args:
        points: in the plane [m], (n, 2).
        levels: height [m], angle [rad] and angle of crowning [rad] of each level, (levels, 3).
        turns: what each point turns by on each level beyond its angle [rad], (levels, n); nothing when not given.

    Returns:
        Points level after level [m], (levels·n, 3).
    """
    angle = levels[:, 1:2]
    if turns is not None:
        angle = angle + turns
    c, s = np.cos(angle), np.sin(angle)
    x, y = c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]
    return np.stack([x, y, np.broadcast_to(levels[:, :1], x.shape)], axis=2).reshape(-1, 3)


def stitch(segments: Indices, layer: int, levels: int, falling: NDArray[np.bool_] | None = None) -> Indices:
    """Return the triangles between levels over a chain of one layer.

    Args:
        segments: start and end of each segment, the outside to its right, (m, 2).
        layer: number of points in a layer.
        levels: number of layers.
        falling: whether the diagonal over a segment runs from its start on the upper level to its end on the lower
            one, (m,); the other way where not, and everywhere when not given.

    Returns:
        Triangles, (2·m·(levels − 1), 3).
    """
    shift = layer * np.arange(levels - 1)[:, None, None]
    a, b = segments[:, 0], segments[:, 1]
    faces = np.vstack([np.c_[a, b, b + layer], np.c_[a, b + layer, a + layer]])
    if falling is not None:
        other = np.vstack([np.c_[a, b, a + layer], np.c_[b, b + layer, a + layer]])
        faces = np.where(np.tile(falling, 2)[:, None], other, faces)
    return (faces + shift).reshape(-1, 3)


def wall(
    points: Array,
    segments: tuple[Indices, NDArray[np.bool_] | None],
    outward: Array,
    levels: Array,
    turns: Array | None = None,
) -> tuple[Array, Indices, Array]:
    """Carry a chain along the axis, for drawing.

    Args:
        points: of the chain [m], (n, 2).
        segments: start and end of each segment, (m, 2), and which of them have falling diagonals, as in
            :func:`stitch`.
        outward: normals of the points in the plane, tilted here by the helix, (n, 2).
        levels: height, angle and angle of crowning of each level, (levels, 3).
        turns: what each point turns by on each level beyond its angle [rad], (levels, n).

    Returns:
        Points, triangles and normals.
    """
    lead = (levels[-1, 1] - levels[0, 1]) / (levels[-1, 0] - levels[0, 0])
    normals = lift(outward, levels, turns)
    around = points[:, 0] * outward[:, 1] - points[:, 1] * outward[:, 0]
    normals[:, 2] = np.tile(-lead * around, len(levels))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return lift(points, levels, turns), stitch(segments[0], len(points), len(levels), segments[1]), normals
