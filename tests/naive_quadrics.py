"""Slow and obvious oracles of quadric errors: planes in lists, nothing accumulated."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Plane = tuple[NDArray[np.float64], NDArray[np.float64], float]  # a point, a unit normal, a weight


def planes_of(vertices: NDArray, faces: NDArray) -> list[list[Plane]]:
    """The planes of the faces at each vertex, weighted by the area."""
    planes: list[list[Plane]] = [[] for _ in vertices]
    for face in faces:
        a, b, c = vertices[face]
        normal = np.cross(b - a, c - a)
        twice = float(np.linalg.norm(normal))
        if twice > 0.0:
            for v in face:
                planes[v].append((a, normal / twice, 0.5 * twice))
    return planes


def quadric_error(planes: list[Plane], point: NDArray) -> float:
    """Sum of the weighted squared distances of a point from planes."""
    return sum(weight * float(normal @ (point - at)) ** 2 for at, normal, weight in planes)


def clusters(vertex_map: NDArray, n: int) -> list[list[int]]:
    """The vertices given that became each vertex of the result."""
    members: list[list[int]] = [[] for _ in range(n)]
    for old, new in enumerate(vertex_map.tolist()):
        if new >= 0:
            members[new].append(old)
    return members


def rms_errors(vertices: NDArray, faces: NDArray, result) -> NDArray[np.float64]:
    """Root mean squared distance of each new vertex from the planes merged into it."""
    planes = planes_of(vertices, faces)
    errors = []
    for point, members in zip(
        result.vertices, clusters(result.vertex_map, len(result.vertices)), strict=True
    ):
        merged = [plane for old in members for plane in planes[old]]
        weight = sum(plane[2] for plane in merged)
        errors.append(math.sqrt(quadric_error(merged, point) / weight) if weight else 0.0)
    return np.array(errors)


def shapes(vertices: NDArray, faces: NDArray) -> NDArray[np.float64]:
    """4 sqrt(3) area / (sum of the squared edges) of each face: 1 when it is equilateral."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    squares = sum(((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a)))
    return 4.0 * math.sqrt(3.0) * area / np.where(squares > 0.0, squares, 1.0)


def deviations(vertices: NDArray, faces: NDArray, result) -> NDArray[np.float64]:
    """Angle of each new face to the mean normal of the faces merged into its vertices, degrees.

    0 where these normals cancel each other for the most part.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = 0.5 * np.cross(b - a, c - a)
    at_vertex = np.zeros((len(result.vertices), 4))
    rows = np.column_stack([normals, np.linalg.norm(normals, axis=1)])
    for k in range(3):
        new = result.vertex_map[faces[:, k]]
        np.add.at(at_vertex, new[new >= 0], rows[new >= 0])
    p, q, r = (result.vertices[result.faces[:, k]] for k in range(3))
    normal = np.cross(q - p, r - p)
    mean = at_vertex[result.faces].sum(axis=1)
    length = np.linalg.norm(normal, axis=1) * np.linalg.norm(mean[:, :3], axis=1)
    is_clear = np.linalg.norm(mean[:, :3], axis=1) > 0.11 * mean[:, 3]
    cosine = np.einsum("ij,ij->i", normal, mean[:, :3]) / np.where(length > 0.0, length, 1.0)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return np.where(is_clear & (length > 0.0), angle, 0.0)
