"""Smallest distance of two triangle meshes by their vertices, facets and edges, with numpy alone."""

import numpy as np
from scipy.spatial import cKDTree


def _dot(a, b):
    return np.einsum("ij,ij->i", a, b)


def point_triangle(points, corners):
    """Distance of each point from its own triangle: from the facet where it lies above it, from the edges elsewhere."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    above = np.ones(len(points), bool)
    edges = np.full(len(points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        step = end - start
        above &= _dot(np.cross(step, points - start), normal) >= 0.0
        along = np.clip(_dot(points - start, step) / _dot(step, step), 0.0, 1.0)
        edges = np.minimum(edges, np.linalg.norm(points - start - along[:, None] * step, axis=1))
    height = np.abs(_dot(points - a, normal)) / length
    return np.where(above, height, edges)


def edge_edge(p, q, r, s):
    """Distance of the lines p-q and r-s where their feet lie within both, infinite elsewhere."""
    u, v, w = q - p, s - r, p - r
    a, b, c, d, e = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    bottom = a * c - b * b
    crossing = bottom > 1e-12 * a * c
    bottom = np.where(crossing, bottom, 1.0)
    first, second = (b * e - c * d) / bottom, (a * e - b * d) / bottom
    within = crossing & (first >= 0) & (first <= 1) & (second >= 0) & (second <= 1)
    foot = np.linalg.norm(w + first[:, None] * u - second[:, None] * v, axis=1)
    return np.where(within, foot, np.inf)


def mesh_distance(one, two):
    """Smallest distance of two sets of triangles that do not cut each other, (n, 3, 3) and (m, 3, 3)."""
    trees, radii = [], []
    for corners in (one, two):
        middle = corners.mean(axis=1)
        trees.append(cKDTree(middle))
        radii.append(float(np.linalg.norm(corners - middle[:, None], axis=2).max()))
    vertices = cKDTree(two.reshape(-1, 3))
    bound = float(vertices.query(one.reshape(-1, 3))[0].min())
    # a facet that comes nearer than that has its middle within both radii more
    pairs = trees[0].sparse_distance_matrix(trees[1], bound + sum(radii), output_type="ndarray")
    near_one, near_two = one[pairs["i"]], two[pairs["j"]]
    found = [bound]
    for k in range(3):
        found.append(point_triangle(near_one[:, k], near_two).min(initial=np.inf))
        found.append(point_triangle(near_two[:, k], near_one).min(initial=np.inf))
        for m in range(3):
            ends = near_one[:, k], near_one[:, (k + 1) % 3], near_two[:, m], near_two[:, (m + 1) % 3]
            found.append(edge_edge(*ends).min(initial=np.inf))
    return float(min(found))
