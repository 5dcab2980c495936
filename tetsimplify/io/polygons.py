"""From the polygons that files hold to a triangle mesh."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify.errors import FileError
from tetsimplify.mesh import Mesh

log = logging.getLogger("tetsimplify.io")


def mesh_of_polygons(
    points: NDArray[Any], n_corners: ArrayLike, corner_points: NDArray[Any]
) -> Mesh:
    """Build a mesh from polygons, every one fanned around its first corner.

    ::

        d---c            d---c
        |   |    ->      | / |      a b c d  ->  a b c,  a c d
        a---b            a---b

    Points and faces stay in order; nothing is merged, and nothing is dropped but polygons
    with fewer than three corners.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Positions.
    n_corners : array_like, shape (k,) or int
        Number of corners of each polygon; one number when all are alike.
    corner_points : ndarray, shape (sum of n_corners,)
        The points of the corners, polygon after polygon.

    Raises
    ------
    FileError
        When a polygon refers to a point that is not there.
    """
    vertices = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    corner_points = np.asarray(corner_points)
    _check_range(corner_points, n_corners, len(vertices))
    corner_points = corner_points.astype(np.int32, copy=False)
    if np.ndim(n_corners) == 0 and n_corners == 3:
        return Mesh(vertices, np.ascontiguousarray(corner_points.reshape(-1, 3)))
    counts = np.broadcast_to(n_corners, (_n_polygons(n_corners, corner_points),))
    return Mesh(vertices, _fan(counts.astype(np.int64), corner_points))


def _n_polygons(n_corners: ArrayLike, corner_points: NDArray[Any]) -> int:
    counts = np.asarray(n_corners)
    return len(counts) if counts.ndim else len(corner_points) // max(int(counts), 1)


def _check_range(corner_points: NDArray[Any], n_corners: ArrayLike, n_points: int) -> None:
    wrong = (corner_points < 0) | (corner_points >= n_points)
    if not wrong.any():
        return
    corner = int(np.argmax(wrong))
    counts = np.broadcast_to(n_corners, (_n_polygons(n_corners, corner_points),))
    face = int(np.searchsorted(np.cumsum(counts), corner, side="right"))
    raise FileError(
        f"face {face} refers to vertex {corner_points[corner]}, but there are {n_points:,} vertices"
    )


def _fan(counts: NDArray[np.int64], corner_points: NDArray[np.int32]) -> NDArray[np.int32]:
    first_corners = np.cumsum(counts) - counts
    n_fanned = int((counts > 3).sum())
    n_dropped = int((counts < 3).sum())
    if n_fanned:
        log.info("%s polygons with more than three corners fanned into triangles", f"{n_fanned:,}")
    if n_dropped:
        log.warning("%s faces with fewer than three corners left out", f"{n_dropped:,}")

    n_triangles = np.maximum(counts - 2, 0)
    first_triangles = np.cumsum(n_triangles) - n_triangles
    step = np.arange(n_triangles.sum()) - np.repeat(first_triangles, n_triangles)
    apex = np.repeat(first_corners, n_triangles)
    faces = np.empty((len(step), 3), np.int32)
    faces[:, 0] = corner_points[apex]
    faces[:, 1] = corner_points[apex + step + 1]
    faces[:, 2] = corner_points[apex + step + 2]
    return faces
