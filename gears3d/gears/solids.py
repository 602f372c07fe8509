"""Solids of gears: triangles of flanks, fillets, faces and the body inside the teeth."""

from __future__ import annotations

from itertools import pairwise
from math import ceil, pi, sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gears3d.extras import require
from gears3d.gears.deviation import GEARS, HarmonicDeviation
from gears3d.gears.flank import ACTIVE, REVERSE
from gears3d.gears.limits import refuse_crossed
from gears3d.gears.outline import FINEST, Outline, check_size, default_chord, inner_radius, layers_at, outline
from gears3d.gears.pair import Pair
from gears3d.gears.surface import flank_leads, lead_turn

if TYPE_CHECKING:
    from trimesh import Trimesh

    from gears3d.gears.gear import Gear


Array = NDArray[np.float64]
Indices = NDArray[np.int64]
_INNER = 1 << 40  # Added to an index that counts along the bore instead of the outline


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
    """Return the surface between the inner edges of both end faces."""
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
    """Return the inside as strips for drawing, each with flat or round normals of its own."""
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

    >>> loop(0, 3).tolist()
    [[0, 1], [1, 2], [2, 0]]
    """
    around = first + np.arange(count)
    return np.c_[around, np.roll(around, -1)]


def lift(points: Array, levels: Array, turns: Array | None = None) -> Array:
    """Put plane points on every level, turned by its angle.

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
    """Return the triangles between levels over a chain of one layer."""
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

    Returns:
        Points, triangles and normals.
    """
    lead = (levels[-1, 1] - levels[0, 1]) / (levels[-1, 0] - levels[0, 0])
    normals = lift(outward, levels, turns)
    around = points[:, 0] * outward[:, 1] - points[:, 1] * outward[:, 0]
    normals[:, 2] = np.tile(-lead * around, len(levels))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return lift(points, levels, turns), stitch(segments[0], len(points), len(levels), segments[1]), normals


class MassProperties(NamedTuple):
    """Mass of a solid."""

    mass: float  # [kg]
    volume: float  # [m³]
    centre: Array  # centre of mass [m], (3,)
    inertia: Array  # about the centre of mass [kg·m²], (3, 3)


def solid(pair: Pair, which: str, chord: float | None = None, root_chord: float | None = None) -> Trimesh:
    """Return a gear as one watertight solid in its own frame, in metres.

    Args:
        pair: the pair, deviations included.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the facets from the flanks [m]; that of :func:`default_chord` when not given.
        root_chord: the same for tip, fillet, root and bore, and for the edges of helical tips [m]; ``chord`` when not
            given.

    Returns:
        The solid, its axis along z and its middle plane at z = 0.

    Raises:
        InputError: a chord that is not positive or too fine for the memory, an unknown gear, or teeth without a tip.
        MissingExtraError: trimesh is not installed.

    >>> from gears3d.gears import Gear
    >>> gear = Gear(module=2e-3, teeth=20, face_width=5e-3)
    >>> solid(Pair.from_backlash(gear, gear, 1e-4), "drive", chord=2e-6).is_watertight
    True
    """
    trimesh = require("trimesh", "a gear as a solid", "engine")
    refuse_crossed(pair)
    chord = default_chord(pair, which) if chord is None else chord
    check_size(pair, which, chord, root_chord)
    vertices, faces = _welded(pair, which, (chord, root_chord or chord))
    return trimesh.Trimesh(vertices, faces, process=False, metadata={"name": which, "units": "m"})


def solid_arrays(
    pair: Pair, which: str, chord: float = FINEST, root_chord: float | None = None
) -> tuple[Array, Indices, Array]:
    """Return a gear's surface for drawing, with a normal at every vertex and none of them shared across edges.

    Deviating helical gears are drawn with their middle section all along.

    Args:
        pair: the pair, deviations included.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the facets from the flanks [m].
        root_chord: the same elsewhere [m]; ``chord`` when not given.

    Returns:
        Vertices [m], (n, 3); triangles, (m, 3); unit normals, (n, 3).

    Raises:
        InputError: a chord that is not positive or too fine for the memory, an unknown gear, or teeth without a tip.
    """
    check_size(pair, which, chord, root_chord)
    section = outline(pair, which, chord, root_chord)
    levels = _levels(pair, which, root_chord or chord)
    inner = _inner_ring(pair, which, section, root_chord or chord)
    cap = _cap(section, inner)
    flat = np.vstack([section.points.reshape(-1, 2), inner])
    upright = np.tile([0.0, 0.0, 1.0], (len(flat), 1))
    turns = _turns(pair, which, section, levels)
    first, last = None, None
    if turns is not None:
        first, last = (np.pad(turns[[end]], ((0, 0), (0, len(inner)))) for end in (0, -1))
    parts = [(lift(flat, levels[:1], first), cap[:, ::-1], -upright), (lift(flat, levels[-1:], last), cap, upright)]
    ring, segments, outward, order = _split(section)
    chain = segments, _falling(section, levels)[order[segments[:, 0]] % section.points.shape[1]]
    parts.append(wall(ring, chain, outward, levels, None if turns is None else turns[:, order]))
    parts += drawn_inside(pair.gear(which), inner, levels)
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
    return _mass_properties(np.asarray(body.vertices, dtype=float), np.asarray(body.faces), density)


def mass_of(pair: Pair, which: str, density: float, chord: float) -> MassProperties:
    """Return mass, centre and inertia of a gear of one density, without the library of :func:`solid`."""
    return _mass_properties(*_welded(pair, which, (chord, chord)), density)


def _mass_properties(vertices: Array, faces: Indices, density: float) -> MassProperties:
    """Sum volume, first and second moment over the tetrahedra that each facet makes with the origin."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    total, volume = a + b + c, float(six.sum()) / 6.0
    centre = six @ total / (24.0 * volume)
    second = sum((one * six[:, None]).T @ one for one in (a, b, c, total)) / 120.0 - volume * np.outer(centre, centre)
    inertia = density * (np.trace(second) * np.eye(3) - second)
    return MassProperties(density * volume, volume, centre, inertia)


def _welded(pair: Pair, which: str, chords: tuple[float, float]) -> tuple[Array, Indices]:
    """Vertices and triangles of the closed surface, every vertex once."""
    section, levels = outline(pair, which, *chords), _levels(pair, which, chords[1])
    outer, inner = section.points.reshape(-1, 2), _inner_ring(pair, which, section, chords[1])
    turns = _turns(pair, which, section, levels)
    falling = np.tile(_falling(section, levels), len(section.points))
    vertices, faces = lift(outer, levels, turns), stitch(loop(0, len(outer)), len(outer), len(levels), falling)
    if levels[0, 1] != 0.0 and any(isinstance(d, HarmonicDeviation) and d.gear == which for d in pair.deviations):
        layers = [outline(pair, which, *chords, height).points.reshape(-1, 2) for height in levels[:, 0]]
        each = [None if turns is None else turns[i : i + 1] for i in range(len(levels))]
        vertices = np.vstack([lift(p, levels[i : i + 1], each[i]) for i, p in enumerate(layers)])
    inside, walls, top = inside_surface(pair.gear(which), inner, levels)
    cap, count = _cap(section, inner), len(outer)

    def face(outer_start: int, inner_start: int) -> Indices:
        return np.where(cap < count, cap + outer_start, cap - count + inner_start)

    first = len(vertices)
    bottom, above = face(0, first)[:, ::-1], face(count * (len(levels) - 1), first + top)
    return np.vstack([vertices, inside]), np.vstack([bottom, above, faces, walls + first])


def _levels(pair: Pair, which: str, chord: float) -> Array:
    """Heights of the layers, the angle by which helix and helix slope turn each, and that of crowning, (levels, 3)."""
    gear, count = pair.gear(which), layers_at(pair, which, chord)
    lead = lead_turn(gear, 1.0 if which == "drive" else -1.0)
    heights = np.linspace(-0.5, 0.5, count + 1) * gear.face_width
    lean = gear.lead_crowning / gear.base_radius * (2.0 * heights / gear.face_width) ** 2
    return np.c_[heights, lead * heights, lean]


def _turns(pair: Pair, which: str, section: Outline, levels: Array) -> Array | None:
    """What crowning and helix slopes of single flanks turn each point by on each level, (levels, teeth·n), or None."""
    leads = flank_leads(pair)[GEARS.index(which), :, : pair.gear(which).teeth]
    if not levels[:, 2].any() and not leads.any():
        return None
    weights = _weights(section)
    turns = levels[:, 2:3] * np.tile(weights[0] - weights[1], len(section.points))
    if leads.any():
        sense = 1 if which == "drive" else -1
        order = (-sense * np.arange(leads.shape[1])) % leads.shape[1]  # of the teeth, as they stand in the outline
        slopes = np.outer(leads[REVERSE, order], weights[0]) + np.outer(leads[ACTIVE, order], weights[1])
        turns = turns + levels[:, :1] * slopes.ravel()
    return turns


def _falling(section: Outline, levels: Array) -> NDArray[np.bool_]:
    """Over which segments of a tooth the diagonals between levels fall, (n,): those that lie close to the surface.

    A flank is straight along its generators, along which its normal does not turn, and so is a tip; where the outline
    turns with the helix one comes back along it from level to level. In the hollow of a fillet the walk continues.
    """
    n, root, fillet = section.points.shape[1], section.root, section.fillet
    place = np.arange(n)
    hollow = ((place >= root) & (place < root + fillet)) | ((place >= n - root - fillet) & (place < n - root))
    return hollow == (levels[-1, 1] < levels[0, 1]) if levels[0, 1] != 0.0 else np.zeros(n, np.bool_)


def _weights(section: Outline) -> Array:
    """How far each point of a tooth's outline goes with its reverse and with its active flank, (2, n)."""
    n = section.points.shape[1]
    rise = np.arange(section.fillet) / section.fillet
    weights = np.zeros((2, n))
    low, top = section.root, section.root + section.fillet
    high = top + section.flank + section.tip
    weights[0, low:top] = rise
    weights[0, top : top + section.flank + 1] = 1.0
    weights[0, top + section.flank : high + 1] = np.linspace(1.0, 0.0, section.tip + 1)
    weights[1, top + section.flank : high + 1] = np.linspace(0.0, 1.0, section.tip + 1)
    weights[1, high : high + section.flank + 1] = 1.0
    down = rise[::-1][: n - high - section.flank - 1]
    weights[1, high + section.flank + 1 : high + section.flank + 1 + len(down)] = down
    return weights


def _inner_ring(pair: Pair, which: str, section: Outline, chord: float) -> Array:
    """Points of the inner edge of the end face in step with the roots, or the centre alone of a full face, (m, 2)."""
    radius = inner_radius(pair.gear(which))
    if radius == 0.0:
        return np.zeros((1, 2))
    points, root = section.points, section.root
    angles = np.arctan2(points[..., 1], points[..., 0])
    right, left = angles[:, : root + 1], angles[:, points.shape[1] - root :]
    if root == 0:
        left = np.roll(right, -1, axis=0)
    width = np.mod(left[:, :1] - right[:, -1:], 2.0 * pi)
    under = max(1, ceil(float(width.max()) * sqrt(radius / (8.0 * chord))))
    between = right[:, -1:] + width * np.linspace(0.0, 1.0, under + 1)
    last = left[:, 1:] if root else left[:, :0]
    ring = np.hstack([right[:, :-1], between, last] if root else [between[:, :-1]]).ravel()
    return radius * np.c_[np.cos(ring), np.sin(ring)]


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


def _split(section: Outline) -> tuple[Array, Indices, Array, Indices]:
    """Double the corners of the tips: points, segments between them, outward normals in the plane, their numbers."""
    teeth, n = section.points.shape[:2]
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
    numbers = (n * np.arange(teeth)[:, None] + order).ravel()
    return ring, np.c_[index, follower][real], both / np.hypot(*both.T)[:, None], numbers
