"""Meshes as short text: what the page shows in three dimensions.

Coordinates have 16 bits each. Vertices are in the order in which the faces use them first, so that
a corner can be told by how far it lies behind the newest vertex: 0 is a new one, and most others
are small. Bytes of equal weight stand together, which compresses well; `mesh.js` is the inverse.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.mesh import Mesh

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]

LEVELS = 2**16 - 1  # of a coordinate
WHOLE_FACES = 150_000  # of a mesh that is embedded as a whole
PAGE_FACES = 3_000_000  # of all meshes that are embedded as a whole
PATCH_FACES = 3_000  # around a place in a larger mesh
MOST_PLACES = 16  # of an input
APART = 0.02  # of the diagonal: nearer places count as one


def whole_limit(face_counts: Sequence[int]) -> int:
    """How many faces a mesh may have to be embedded as a whole, so that the page stays small.

    Parameters
    ----------
    face_counts : sequence of int
        Of all meshes of the page.

    Returns
    -------
    int
        At most `WHOLE_FACES`; the meshes up to this have at most `PAGE_FACES` together.
    """
    limit = total = 0
    for count, equal in groupby(sorted(n for n in face_counts if n <= WHOLE_FACES)):
        total += sum(equal)
        if total > PAGE_FACES:
            return limit
        limit = count
    return WHOLE_FACES


def places_of(violating_edges: Sequence[Floats], vertices: Floats) -> Floats:
    """Where to look at the results for one input.

    Parameters
    ----------
    violating_edges : sequence of ndarray, shapes (k, 6)
        Ends of the violating edges of each result.
    vertices : ndarray, shape (n, 3)
        Of the input.

    Returns
    -------
    ndarray, shape (p, 3)
        Middles of violating edges, of each result in turn, no two near each other. Where there are
        none, the vertex nearest to the middle of the input.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    apart = APART * np.linalg.norm(high - low)
    middles = [(edges[:, :3] + edges[:, 3:]) / 2 for edges in violating_edges]
    places: list[Floats] = []
    for k in range(max(map(len, middles), default=0)):
        for points in middles:
            if k < len(points) and len(places) < MOST_PLACES:
                if all(np.linalg.norm(points[k] - place) > apart for place in places):
                    places.append(points[k])
    if not places:
        distance = np.linalg.norm(vertices - (low + high) / 2, axis=1)
        places.append(vertices[np.argmin(distance)])
    return np.array(places)


def patches(mesh: Mesh, places: Floats) -> Mesh:
    """The faces nearest to some places, `PATCH_FACES` around each, in their order."""
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    n = min(PATCH_FACES, len(middles))
    is_near = np.zeros(len(middles), bool)
    for place in places:
        distance = ((middles - place) ** 2).sum(axis=1)
        is_near[np.argpartition(distance, n - 1)[:n]] = True
    return Mesh(mesh.vertices, mesh.faces[is_near])


def embedded(mesh: Mesh, marked_edges: Floats | None = None) -> dict[str, Any]:
    """Encode the faces of a mesh and the vertices that they use.

    Parameters
    ----------
    mesh : Mesh
        Of finite vertices.
    marked_edges : ndarray, shape (k, 6), optional
        Ends of edges.

    Returns
    -------
    dict
        ``low`` and ``high``, the corners of the box that the coordinates are parts of;
        ``n_vertices``, ``n_faces``; ``marked_edges``, rounded like the vertices; and ``data``,
        the rest as text.
    """
    vertices, faces = _in_order_of_use(mesh)
    vertices = vertices if len(vertices) else np.zeros((1, 3))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = np.where(high > low, high - low, 1.0)

    def rounded(points: Floats) -> Floats:
        return np.floor((points - low) / size * LEVELS + 0.5)

    ends = np.zeros((0, 6)) if marked_edges is None else marked_edges
    levels = rounded(vertices).astype("<u2")
    steps = np.diff(levels, axis=0, prepend=np.zeros((1, 3), "<u2"))
    corners = faces.reshape(-1)
    is_new = np.zeros(len(corners), bool)
    is_new[np.unique(corners, return_index=True)[1]] = True
    behind = (np.cumsum(is_new) - is_new - corners).astype("<u4")
    planes = _byte_planes(steps.T.reshape(-1)) + _byte_planes(behind)
    return {
        "low": low.tolist(),
        "high": high.tolist(),
        "n_vertices": len(vertices),
        "n_faces": len(faces),
        "marked_edges": rounded(ends.reshape(-1, 2, 3)).astype(np.int64).reshape(-1, 6).tolist(),
        "data": base64.b64encode(zlib.compress(planes)).decode("ascii"),
    }


def _in_order_of_use(mesh: Mesh) -> tuple[Floats, Faces]:
    used, first, number = np.unique(mesh.faces, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int32)
    rank[order] = np.arange(len(order), dtype=np.int32)
    return mesh.vertices[used[order]], rank[number.reshape(-1, 3)]


def _byte_planes(numbers: NDArray[Any]) -> bytes:
    """First the lowest bytes of all numbers, then the next."""
    return numbers.view(np.uint8).reshape(-1, numbers.itemsize).T.tobytes()
