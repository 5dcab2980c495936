"""Meshes to write and read, and what must come back."""

from __future__ import annotations

import numpy as np

from tetsimplify.mesh import Mesh

THIRD = 1 / 3
POINTS = [
    [0.1, 0.0, 0.0],
    [THIRD, 1e-17, 1.0],
    [3.141592653589793, 2.0, -3e30],
    [4.0, 5.0, 6.000000000000001],
    [9.0, 9.0, 9.0],  # unreferenced
    [0.1, 0.0, 0.0],  # as the first
    [7.0, 8.0, 1.0],
]
TRIANGLES = [[0, 1, 2], [0, 2, 3], [5, 6, 1], [0, 1, 2], [3, 3, 0]]  # one twice, one degenerate
POLYGONS = [[0, 1, 2], [0, 2, 3, 5], [5, 6, 1, 2, 3], [1, 2, 3]]
FANNED = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [5, 6, 1], [5, 1, 2], [5, 2, 3], [1, 2, 3]]


def nasty_mesh() -> Mesh:
    """Unreferenced, coincident and far vertices; duplicate and degenerate faces."""
    points = np.array(POINTS)
    points[2, 2] = -3e5
    return Mesh(points, np.array(TRIANGLES, np.int32))


def sphere(n: int = 24) -> Mesh:
    """A sphere without its poles, its vertices at positions that no short decimal number has."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n)[1:-1], np.linspace(0, 2 * np.pi, n)[:-1])
    ring = np.sin(theta)
    points = np.stack([ring * np.cos(phi), ring * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    rows, columns = n - 1, n - 2
    i, j = (k.reshape(-1) for k in np.mgrid[:rows, : columns - 1])
    a, b = i * columns + j, (i + 1) % rows * columns + j
    faces = np.concatenate([np.c_[a, a + 1, b], np.c_[b, a + 1, b + 1]])
    return Mesh(points / 3, faces.astype(np.int32))


def assert_same(mesh: Mesh, points: object, faces: object) -> None:
    """Exactly the same arrays, in the types promised."""
    assert mesh.vertices.dtype == np.float64
    assert mesh.faces.dtype == np.int32
    np.testing.assert_array_equal(mesh.vertices, points)
    np.testing.assert_array_equal(mesh.faces, faces)
