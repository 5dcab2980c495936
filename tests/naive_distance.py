"""Slow and obvious distances between surfaces: every point against every triangle.

A mesh is a pair of vertices, (n, 3), and faces, (m, 3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[np.float64]
Mesh = tuple[ArrayLike, ArrayLike]

POINTS_AT_ONCE = 200


def corners_of(mesh: Mesh) -> Points:
    """The corners of all faces, (m, 3, 3)."""
    return np.asarray(mesh[0], np.float64)[np.asarray(mesh[1])]


def distances(points: ArrayLike, mesh: Mesh) -> Points:
    """The distance of each point to a mesh."""
    points, (a, b, c) = np.asarray(points, np.float64), corners_of(mesh).swapaxes(0, 1)
    found = np.empty(len(points))
    for k in range(0, len(points), POINTS_AT_ONCE):
        part = points[k : k + POINTS_AT_ONCE, None]
        to_edges = [distances_to_segments(part, *ends) for ends in ((a, b), (b, c), (c, a))]
        found[k : k + POINTS_AT_ONCE] = np.min([*to_edges, heights(part, a, b, c)], axis=(0, 2))
    return found


def distances_to_segments(points: Points, p: Points, q: Points) -> Points:
    """The distance of each point to each segment."""
    along = q - p
    length2 = (along**2).sum(axis=-1)
    length2[length2 == 0] = 1
    t = np.clip(((points - p) * along).sum(axis=-1) / length2, 0, 1)
    return np.linalg.norm(points - (p + t[..., None] * along), axis=-1)


def heights(points: Points, a: Points, b: Points, c: Points) -> Points:
    """The height of each point over each triangle, infinite where the foot is not inside."""
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    is_inside = (lengths > 0).T
    for p, q in ((a, b), (b, c), (c, a)):
        is_inside = is_inside & ((np.cross(q - p, points - p) * normals).sum(axis=-1) >= 0)
    return np.where(is_inside, np.abs(((points - a) * normals).sum(axis=-1)), np.inf)


def samples(mesh: Mesh, n: int) -> tuple[Points, float]:
    """Points on all faces, n + 1 along each edge, and how far others are from one at most."""
    corners = corners_of(mesh)
    weights = [(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]
    points = np.einsum("wk,fkx->fwx", np.array(weights) / n, corners).reshape(-1, 3)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    return points, longest / n


def largest(a: Mesh, b: Mesh, n: int) -> tuple[float, float]:
    """Bounds of the largest distance of a point of a from b."""
    points, gap = samples(a, n)
    farthest = float(distances(points, b).max())
    return farthest, farthest + gap


def means(a: Mesh, b: Mesh, n: int) -> tuple[float, float]:
    """Mean and root mean square of the distance from a to b, each face cut into n * n."""
    corners = corners_of(a)
    centres = [(i + 1 / 3, j + 1 / 3) for i in range(n) for j in range(n - i)]
    centres += [(i + 2 / 3, j + 2 / 3) for i in range(n) for j in range(n - 1 - i)]
    weights = np.array([(i, j, n - i - j) for i, j in centres]) / n
    points = np.einsum("wk,fkx->fwx", weights, corners)
    found = distances(points.reshape(-1, 3), b).reshape(points.shape[:2])
    sides = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    mean = np.average(found.mean(axis=1), weights=areas)
    return float(mean), float(np.sqrt(np.average((found**2).mean(axis=1), weights=areas)))
