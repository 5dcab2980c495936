r"""Meshes cut open along seams, and welded again.

A seam is a path of edges. To cut a mesh open there, each vertex of the seam gets a copy for each
fan of faces between the edges of the seam that meet there::

       \   |a   b|   /                     \   |     |   /
        \  |a   b|  /                       \  |a   b|  /
    -----  v-----v  -----    cut ->     -----  v     v'  -----
        /  |a   b|  \                       /  |a   b|  \
       /   |a   b|   \      <- weld        /   |     |   \
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify.mesh import Mesh
from tetsimplify.report import Simplification
from tetsimplify.topology import TopologyReport, topology

Array = NDArray[Any]
Indices = NDArray[np.int32]
Mask = NDArray[np.bool_]


class Cut(NamedTuple):
    """A mesh cut open along its seams."""

    faces: Indices
    """Shape (m, 3)."""
    origin: Indices
    """Shape (n cut,): the vertex that each one is a copy of. The first copies keep the numbers
    of their origins, the others follow."""
    on_seam: Mask
    """Shape (n cut,): vertices that lie on a seam, copied or not (at the end of a seam)."""


def cut(
    faces: ArrayLike,
    wedge_values: Collection[Array] | Array,
    n_vertices: int,
    edges: Indices | None = None,
) -> Cut:
    """Cut a mesh open along the edges on whose two sides wedge values differ.

    Parameters
    ----------
    faces : array_like, shape (m, 3)
    wedge_values : ndarray or collection of ndarray, shapes (m, 3, ...)
    n_vertices : int
    edges : ndarray, shape (k, 2), int32, optional
        Edges to cut besides.

    Returns
    -------
    Cut
        After it all wedges at a vertex have the same values. Vertices that only touch the
        end of a seam are not copied; a vertex that two seams cross gets a copy for each fan
        of faces between them, even where some of these have the same values.
    """
    triangles = np.asarray(faces, dtype=np.int32)
    arrays = [wedge_values] if isinstance(wedge_values, np.ndarray) else list(wedge_values)
    rows = [values.reshape(triangles.size, -1) for values in arrays if values.size]
    uncut = Cut(triangles, np.arange(n_vertices, dtype=np.int32), np.zeros(n_vertices, np.bool_))
    torn = _torn_vertices(triangles, rows, n_vertices)
    if edges is not None:
        torn[edges] = True
    if not torn.any():
        return uncut

    # only faces two rings around such vertices matter
    near = np.zeros(n_vertices, np.bool_)
    near[triangles[torn[triangles].any(axis=1)]] = True
    corners = _corners(np.flatnonzero(near[triangles].any(axis=1)))
    sides = _paired_sides(triangles.reshape(-1), corners)
    differs = [_differ(rows, here, there) for here, there in sides]
    is_seam = differs[0] | differs[1]
    if edges is not None:
        low, high = (triangles.reshape(-1)[here] for here, _ in sides)
        is_seam |= np.isin(edge_keys(low, high), edge_keys(*np.sort(edges, axis=1).T))
    on_seam = torn
    for here, _ in sides:
        on_seam[triangles.reshape(-1)[here[is_seam]]] = True

    corners = corners[on_seam[triangles.reshape(-1)[corners]]]
    joined = np.concatenate([np.stack(side)[:, ~is_seam] for side in sides], axis=1)
    fans = _fans(corners, joined, triangles.size)
    new_faces = triangles.reshape(-1).copy()
    first, fan_of_corner = np.unique(fans, return_inverse=True)
    fan_vertex = new_faces[first].copy()
    _, keeps_number = np.unique(fan_vertex, return_index=True)
    is_copy = np.ones(len(first), np.bool_)
    is_copy[keeps_number] = False
    number = fan_vertex.copy()
    number[is_copy] = n_vertices + np.arange(is_copy.sum())
    new_faces[corners] = number[fan_of_corner]
    origin = np.concatenate([uncut.origin, fan_vertex[is_copy]])
    return Cut(new_faces.reshape(-1, 3), origin, on_seam[origin])


def _torn_vertices(triangles: Indices, rows: list[Array], n_vertices: int) -> Mask:
    """Vertices with different values at their corners."""
    torn = np.zeros(n_vertices, np.bool_)
    if not rows:
        return torn
    corner_vertex = triangles.reshape(-1)
    last = np.zeros(n_vertices, np.int64)
    last[corner_vertex] = np.arange(len(corner_vertex))
    for values in rows:
        torn[corner_vertex[_differ([values], np.arange(len(values)), last[corner_vertex])]] = True
    return torn


def _differ(rows: list[Array], here: Array, there: Array) -> Mask:
    """Whether values at pairs of corners differ; NaN does not differ from NaN."""
    result = np.zeros(len(here), np.bool_)
    for values in rows:
        a, b = values[here], values[there]
        unequal = a != b
        if values.dtype.kind in "fc":
            unequal &= (a == a) | (b == b)
        result |= unequal.any(axis=1)
    return result


def _corners(faces: Array) -> Array:
    """The corners of some faces."""
    return (3 * faces[:, None] + np.arange(3)).reshape(-1)


def _paired_sides(corner_vertex: Indices, corners: Array) -> list[tuple[Array, Array]]:
    """The pairs of faces at edges, as pairs of corners at the lower and at the higher end."""
    heads = np.where(corners % 3 == 2, corners - 2, corners + 1)
    flip = corner_vertex[corners] > corner_vertex[heads]
    low, high = np.where(flip, heads, corners), np.where(flip, corners, heads)
    key = edge_keys(corner_vertex[low], corner_vertex[high])
    order = np.argsort(key, kind="stable")
    pair = np.flatnonzero(key[order[:-1]] == key[order[1:]])
    here, there = order[pair], order[pair + 1]
    return [(low[here], low[there]), (high[here], high[there])]


def _fans(corners: Array, joined: Array, n_corners: int) -> Array:
    """The lowest corner of the fan that each of `corners` is in."""
    label = np.arange(n_corners)
    a, b = joined
    while True:
        lowest = np.minimum(label[a], label[b])
        if np.array_equal(lowest, label[a]) and np.array_equal(lowest, label[b]):
            result: Array = label[corners]
            return result
        np.minimum.at(label, a, lowest)
        np.minimum.at(label, b, lowest)
        label = label[label]


def at_vertices(wedges: Array, parts: Cut) -> Array:
    """Wedge values, shape (m, 3, ...), as values of the vertices of the cut mesh."""
    values = np.zeros((len(parts.origin), *wedges.shape[2:]), wedges.dtype)
    values[parts.faces] = wedges
    return values


def edge_keys(low: Indices, high: Indices) -> NDArray[np.int64]:
    """Both ends of edges as one number."""
    keys: NDArray[np.int64] = low.astype(np.int64) << 32 | high
    return keys


def weld(
    mesh: Mesh, before: TopologyReport, result: Simplification, origin: Indices
) -> Simplification:
    """Join the copies that a simplified mesh had when it was cut.

    Parameters
    ----------
    mesh : Mesh
        The mesh before it was cut.
    before : TopologyReport
        Its topology.
    result : Simplification
        Of the cut mesh, with all vertices locked that were copied.
    origin : ndarray, shape (n cut,), int32
        See :class:`Cut`.

    Returns
    -------
    Simplification
        Of the mesh before it was cut: its maps and its report too.
    """
    n_copies = np.bincount(origin, minlength=len(mesh.vertices))
    copied = np.flatnonzero((n_copies[origin] > 1) & (result.vertex_map >= 0))
    twin = np.arange(len(result.vertices), dtype=np.int32)
    first = np.full(len(mesh.vertices), -1, np.int32)
    first[origin[copied[::-1]]] = result.vertex_map[copied[::-1]]
    twin[result.vertex_map[copied]] = first[origin[copied]]

    is_first = twin == np.arange(len(twin))
    number = (np.cumsum(is_first, dtype=np.int32) - 1)[twin]
    vertices, faces = result.vertices[is_first], number[result.faces]
    vertex_map = np.append(number, np.int32(-1))[result.vertex_map[: len(mesh.vertices)]]
    edges, kept = np.unique(
        np.sort(number[result.report.remaining_edges], axis=1), axis=0, return_index=True
    )
    report = replace(
        result.report,
        topology_before=before,
        topology_after=topology(vertices, faces),
        remaining_edges=edges,
        remaining_reasons=result.report.remaining_reasons[kept],
    )
    vertex_data = {name: values[is_first] for name, values in result.vertex_data.items()}
    return Simplification(
        vertices, faces, vertex_map, result.face_map, report, vertex_data, result.face_data
    )
