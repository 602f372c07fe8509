"""Gears as solids: the outline carried along the axis, stitched by numpy alone."""

from __future__ import annotations

from math import ceil, pi, sqrt, tan
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gears3d.gears.outline import Outline, outline
from gears3d.gears.pair import Pair

if TYPE_CHECKING:
    from trimesh import Trimesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_INNER = 1 << 40
"""Added to an index that counts along the bore instead of the outline."""


class MassProperties(NamedTuple):
    """Mass of a solid.

    Args:
        mass: [kg].
        volume: [m³].
        centre: centre of mass [m], (3,).
        inertia: about the centre of mass [kg·m²], (3, 3).
    """

    mass: float
    volume: float
    centre: Array
    inertia: Array


def solid(pair: Pair, which: str, chord: float = 0.2e-6, root_chord: float | None = None) -> Trimesh:
    """Return a gear as one watertight solid in its own frame, in metres.

    Args:
        pair: the pair, deviations included.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the facets from the flanks [m].
        root_chord: the same for tip, fillet, root and bore [m]; five times ``chord`` when not given.

    Returns:
        The solid, its axis along z and its middle plane at z = 0.

    Raises:
        InputError: a chord that is not positive, or an unknown gear.

    >>> from gears3d.gears import Gear
    >>> gear = Gear(module=2e-3, teeth=20, face_width=5e-3)
    >>> solid(Pair.from_backlash(gear, gear, 1e-4), "drive", chord=2e-6).is_watertight
    True
    """
    import trimesh

    section = outline(pair, which, chord, root_chord)
    vertices, faces = _welded(pair, which, section, root_chord or 5.0 * chord)
    return trimesh.Trimesh(vertices, faces, process=False, metadata={"name": which, "units": "m"})


def solid_arrays(pair: Pair, which: str, chord: float = 0.2e-6) -> tuple[Array, Indices, Array]:
    """Return a gear's surface for drawing, with a normal at every vertex and none of them shared across edges.

    Args:
        pair: the pair, deviations included.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the facets from the flanks [m].

    Returns:
        Vertices [m], (n, 3); triangles, (m, 3); unit normals, (n, 3).

    Raises:
        InputError: a chord that is not positive, or an unknown gear.
    """
    section = outline(pair, which, chord)
    levels = _levels(pair, which, 5.0 * chord)
    inner = _inner_ring(pair, which, section, 5.0 * chord)
    cap = _cap(section, inner)
    flat = np.vstack([section.points.reshape(-1, 2), inner])
    upright = np.tile([0.0, 0.0, 1.0], (len(flat), 1))
    parts = [(_lift(flat, levels[:1]), cap[:, ::-1], -upright), (_lift(flat, levels[-1:]), cap, upright)]
    ring, segments, outward = _split(section)
    parts.append(_wall(ring, segments, outward, levels))
    if len(inner) > 1:
        around = np.arange(len(inner))
        backwards = np.c_[np.roll(around, -1), around]
        parts.append(_wall(inner, backwards, -inner / np.hypot(*inner.T)[:, None], levels))
    bases = np.cumsum([0] + [len(points) for points, _, _ in parts])
    faces = [triangles + base for (_, triangles, _), base in zip(parts, bases, strict=False)]
    return np.vstack([p for p, _, _ in parts]), np.vstack(faces), np.vstack([n for _, _, n in parts])


def mass_properties(body: Trimesh, density: float) -> MassProperties:
    """Return mass, centre and inertia of a solid of one density.

    Args:
        body: a watertight solid [m].
        density: [kg/m³].

    Returns:
        Mass, volume, centre of mass and inertia about it.
    """
    copy = body.copy()
    copy.density = density
    found = copy.mass_properties
    return MassProperties(float(found.mass), float(found.volume), np.array(found.center_mass), np.array(found.inertia))


def _welded(pair: Pair, which: str, section: Outline, chord: float) -> tuple[Array, Indices]:
    """Vertices and triangles of the closed surface, every vertex once."""
    levels = _levels(pair, which, chord)
    outer, inner = section.points.reshape(-1, 2), _inner_ring(pair, which, section, chord)
    hollow = len(inner) > 1
    layer = np.vstack([outer, inner]) if hollow else outer
    vertices = _lift(layer, levels)
    cap = _cap(section, inner)
    around = np.arange(len(outer))
    segments = [np.c_[around, np.roll(around, -1)]]
    bottom, top = cap[:, ::-1], cap + len(layer) * (len(levels) - 1)
    if hollow:
        around = len(outer) + np.arange(len(inner))
        segments.append(np.c_[np.roll(around, -1), around])
    else:
        vertices = np.vstack([vertices, _lift(inner, levels[[0, -1]])])
        centre = len(layer) * len(levels)
        bottom = np.where(bottom == len(outer), centre, bottom)
        top = np.where(cap == len(outer), centre + 1, top)
    return vertices, np.vstack([bottom, top, _stitch(np.vstack(segments), len(layer), len(levels))])


def _levels(pair: Pair, which: str, chord: float) -> Array:
    """Heights of the layers and the angle by which the helix turns each, (levels, 2)."""
    gear = pair.gear(which)
    sense = 1.0 if which == "drive" else -1.0
    lead = sense * tan(gear.helix_angle) / gear.reference_radius
    count = max(1, ceil(abs(lead) * gear.face_width * sqrt(gear.tip_radius / (8.0 * chord))))
    heights = np.linspace(-0.5, 0.5, count + 1) * gear.face_width
    return np.c_[heights, lead * heights]


def _lift(points: Array, levels: Array) -> Array:
    """Put plane points on every level, turned by its angle: (levels·n, 3), level after level."""
    c, s = np.cos(levels[:, 1])[:, None], np.sin(levels[:, 1])[:, None]
    x, y = c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]
    return np.stack([x, y, np.broadcast_to(levels[:, :1], x.shape)], axis=2).reshape(-1, 3)


def _inner_ring(pair: Pair, which: str, section: Outline, chord: float) -> Array:
    """Points of the bore in step with the roots, or the centre alone where there is no bore, (m, 2)."""
    gear = pair.gear(which)
    if gear.bore is None:
        return np.zeros((1, 2))
    points, root = section.points, section.root
    angles = np.arctan2(points[..., 1], points[..., 0])
    right, left = angles[:, : root + 1], angles[:, points.shape[1] - root :]
    if root == 0:
        left = np.roll(right, -1, axis=0)
    width = np.mod(left[:, :1] - right[:, -1:], 2.0 * pi)
    under = max(1, ceil(float(width.max()) * sqrt(gear.bore / (16.0 * chord))))
    between = right[:, -1:] + width * np.linspace(0.0, 1.0, under + 1)
    last = left[:, 1:] if root else left[:, :0]
    ring = np.hstack([right[:, :-1], between, last] if root else [between[:, :-1]]).ravel()
    return 0.5 * gear.bore * np.c_[np.cos(ring), np.sin(ring)]


def _cap(section: Outline, inner: Array) -> Indices:
    """Triangulate the end face tooth by tooth, counter-clockwise; the inner ring counts on after the outline."""
    teeth, n = section.points.shape[:2]
    root, side = section.root, section.fillet + section.flank
    end = n - root
    up = np.arange(side)
    low, high = root + up, end - up
    first = root + side
    fan = first + np.arange(1, section.tip)
    triangles = [
        np.c_[low, low + 1, high - 1],
        np.c_[low, high - 1, high],
        np.c_[np.full_like(fan, first), fan, fan + 1],
    ]
    outer = np.concatenate([np.arange(root + 1), np.arange(end, n + 1)])
    if len(inner) == 1:
        triangles.append(np.c_[outer[:-1], outer[1:], np.full(len(outer) - 1, _INNER)])
    else:
        triangles.append(_annulus(outer, root, len(inner) // teeth))
    template = np.vstack(triangles)
    tooth = np.arange(teeth)[:, None, None]
    outline_index = (template + tooth * n) % (teeth * n)
    inner_index = teeth * n + (template - _INNER + tooth * (len(inner) // teeth)) % len(inner)
    return np.where(template >= _INNER, inner_index, outline_index).reshape(-1, 3)


def _annulus(outer: Indices, root: int, inner_count: int) -> Indices:
    """Triangles of one tooth's share between the roots and the bore, whose points follow the roots' angles."""
    under = inner_count - 2 * root
    triangles = []
    for place in range(len(outer) - 1):
        here, there = outer[place], outer[place + 1]
        if place == root:
            below = _INNER + root + np.arange(under)
            triangles.append(np.array([[here, there, _INNER + root + under]]))
            triangles.append(np.c_[np.full(under, here), below + 1, below])
        else:
            start = _INNER + place + (under - 1 if place > root else 0)
            triangles.append(np.array([[here, there, start + 1], [here, start + 1, start]]))
    return np.vstack(triangles)


def _stitch(segments: Indices, layer: int, levels: int) -> Indices:
    """Triangles between the levels over segments (start, end) of one layer, outside to the right."""
    shift = layer * np.arange(levels - 1)[:, None, None]
    a, b = segments[:, 0], segments[:, 1]
    faces = np.vstack([np.c_[a, b, b + layer], np.c_[a, b + layer, a + layer]])
    return (faces + shift).reshape(-1, 3)


def _wall(points: Array, segments: Indices, outward: Array, levels: Array) -> tuple[Array, Indices, Array]:
    """Carry a chain along the axis; ``outward`` are its normals in the plane, tilted here by the helix."""
    lead = (levels[-1, 1] - levels[0, 1]) / (levels[-1, 0] - levels[0, 0])
    normals = _lift(outward, levels)
    around = points[:, 0] * outward[:, 1] - points[:, 1] * outward[:, 0]
    normals[:, 2] = np.tile(-lead * around, len(levels))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return _lift(points, levels), _stitch(segments, len(points), len(levels)), normals


def _split(section: Outline) -> tuple[Array, Indices, Array]:
    """Double the corners of the tips: points, segments between them and outward normals in the plane."""
    n = section.points.shape[1]
    first = section.root + section.fillet + section.flank
    order = np.concatenate([np.arange(first + 1), np.arange(first, first + section.tip + 1)])
    order = np.concatenate([order, np.arange(first + section.tip, n)])
    ring = section.points[:, order].reshape(-1, 2)
    index = np.arange(len(ring))
    follower = np.roll(index, -1)
    step = ring[follower] - ring
    length = np.hypot(*step.T)
    real = length > 0.0
    normal = np.c_[step[:, 1], -step[:, 0]] / np.where(real, length**2, 1.0)[:, None]
    both = normal + np.roll(normal, 1, axis=0)
    return ring, np.c_[index, follower][real], both / np.hypot(*both.T)[:, None]
