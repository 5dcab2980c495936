r"""Simplification of meshes with seams, for the adapters.

A texture seam is a path of edges on whose two sides the same vertices have different texture
coordinates. Some programs hold the values at face corners (wedges), others hold two copies of
each vertex of the seam, so that the mesh is open there::

    one vertex, two values             two vertices in one place

       \   |a   b|   /                     \   |     |   /
        \  |a   b|  /                       \  |a   b|  /
    -----  v-----v  -----    cut ->     -----  v     v'  -----
        /  |a   b|  \                       /  |a   b|  \
       /   |a   b|   \      <- weld        /   |     |   \

:func:`simplify` does both: wedges are cut apart first. The vertices on the seam are locked, so
both sides stay where they are: nothing tears and nothing bleeds. Then the copies are welded.

What could still go wrong is that the two sides, each for itself, come to have an edge between
the same two vertices of the seam, which would be one edge of four faces when they are welded,
or a face between the same three.
This is looked for, and where it happens all is done again with the neighbours of the seam
locked as well, which excludes it: no contraction then reaches a face at the seam.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify.arrays import as_mesh, as_vertex_mask
from tetsimplify.errors import MeshError
from tetsimplify.mesh import Mesh
from tetsimplify.repair import repair as repair_mesh
from tetsimplify.report import Repaired, Simplification, SimplificationReport
from tetsimplify.simplify import simplify as simplify_arrays
from tetsimplify.topology import topology

Array = NDArray[Any]
Indices = NDArray[np.int32]
Mask = NDArray[np.bool_]

MIXING = (0.2718281828459045, 0.3141592653589793, 0.1618033988749895)  # of x, y, z to one number
SPREADING = np.uint64(0x9E3779B97F4A7C15)  # odd, so that no two numbers become one
MOST_THROWS = 32  # far more than a hash that tells the places apart needs
WEDGE = "\0"  # before the names of wedge data among vertex data, which may have the same names


class Seamed(NamedTuple):
    """A simplified mesh with its attributes; see :func:`simplify`."""

    vertices: NDArray[np.float64]
    faces: Indices
    vertex_map: Indices
    """Shape (old n,): new index of the vertex that each old one became, -1 where removed."""
    face_map: Indices
    """Shape (m,): old index of each new face."""
    report: SimplificationReport
    vertex_data: dict[str, Array]
    """Shapes (n, ...)."""
    face_data: dict[str, Array]
    """Shapes (m, ...)."""
    wedge_data: dict[str, Array]
    """Shapes (m, 3, ...)."""


class Cut(NamedTuple):
    """A mesh cut open along its seams."""

    faces: Indices
    """Shape (m, 3)."""
    origin: Indices
    """Shape (n cut,): the vertex that each one is a copy of. The first copies keep the numbers
    of their origins, the others follow."""
    on_seam: Mask
    """Shape (n cut,): vertices that lie on a seam, copied or not (at the end of a seam)."""


def simplify(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    vertex_data: Mapping[str, Array] | None = None,
    face_data: Mapping[str, Array] | None = None,
    wedge_data: Mapping[str, Array] | None = None,
    colours: Collection[str] | None = None,
    locked: ArrayLike | None = None,
    repair: bool = False,
    **options: Any,
) -> Seamed:
    """Simplify a mesh with its attributes; seams neither tear nor bleed.

    A seam is where wedge data differ at one vertex, or where vertices on the boundary are in
    exactly the same place as others there. Neither is merged with the other.

    Parameters
    ----------
    vertices, faces : array_like, shapes (n, 3) and (m, 3)
    vertex_data, face_data : mapping of names to arrays, shapes (n, ...) and (m, ...)
    wedge_data : mapping of names to arrays, shapes (m, 3, ...)
        Values at the corners of the faces. A material of each face goes in here as well,
        repeated for its corners: then borders of materials are seams.
    colours : collection of str, optional
        Integer vertex and wedge data that are to be interpolated and rounded; None takes those
        of 8 bits with 3 or 4 components. Other integers are labels, which are never averaged.
    locked, repair, **options
        As in :func:`tetsimplify.simplify`.

    Returns
    -------
    Seamed

    Examples
    --------
    A square grid with a texture seam along x = 2; its wedges are told apart, and stay so:

    >>> import numpy as np
    >>> from tetsimplify import seams
    >>> y, x = np.divmod(np.arange(25), 5)
    >>> a = np.flatnonzero((x < 4) & (y < 4))
    >>> faces = np.concatenate([np.c_[a, a + 1, a + 6], np.c_[a, a + 6, a + 5]])
    >>> right = x[faces].mean(axis=1) > 2
    >>> u = np.where(right[:, None], x[faces] + 10.0, x[faces])
    >>> result = seams.simplify(np.c_[x, y, 0 * x], faces, wedge_data={"u": u}, max_edge_length=9)
    >>> x_of_wedges = result.vertices[result.faces, 0]
    >>> bool(np.isin(result.wedge_data["u"] - x_of_wedges, (0, 10)).all())
    True
    """
    mesh = as_mesh(vertices, faces)
    held = as_vertex_mask("locked", locked, len(mesh.vertices))
    of_vertices, of_faces, of_wedges = (
        {name: np.asarray(values) for name, values in (data or {}).items()}
        for data in (vertex_data, face_data, wedge_data)
    )
    repaired = repair_mesh(*mesh) if repair else None
    if repaired is not None:
        of_wedges = _turned(of_wedges, mesh.faces, repaired)
        of_faces = {name: values[repaired.face_map] for name, values in of_faces.items()}
        of_vertices = {name: data[repaired.vertex_origin] for name, data in of_vertices.items()}
        held = held[repaired.vertex_origin]
        mesh = Mesh(repaired.vertices, repaired.faces)

    parts = cut(mesh.faces, of_wedges.values(), len(mesh.vertices))
    seam = _with_copies(_Seam(parts.origin, parts.on_seam), mesh)
    is_cut = len(parts.origin) > len(mesh.vertices)
    opened, values = Mesh(mesh.vertices, parts.faces), dict(of_vertices)
    if is_cut:
        opened, held = Mesh(mesh.vertices[parts.origin], parts.faces), held[parts.origin]
        values = {name: data[parts.origin] for name, data in of_vertices.items()}
    values |= {_wedge(name): _at_vertices(data, parts) for name, data in of_wedges.items()}

    averaged = _colours(values) if colours is None else set(colours)
    averaged = {name for name in values if {name, name.removeprefix(WEDGE)} & averaged}
    types = {name: values[name].dtype for name in averaged}
    values |= {name: values[name].astype(np.float64) for name in averaged}
    result = _simplify_cut(
        opened, seam, locked=held, vertex_data=values, face_data=of_faces, **options
    )
    carried = dict(result.vertex_data)
    carried |= {name: _rounded(carried[name], dtype) for name, dtype in types.items()}
    new_wedges = {name: carried.pop(_wedge(name))[result.faces] for name in of_wedges}
    result = result._replace(vertex_data=carried)
    if is_cut:
        result = weld(mesh, result, parts.origin)
    if repaired is not None:
        result = _composed(result, repaired)
    return Seamed(*result, new_wedges)


# --- cutting -------------------------------------------------------------------------------------


def cut(faces: ArrayLike, wedge_values: Collection[Array] | Array, n_vertices: int) -> Cut:
    """Cut a mesh open along the edges on whose two sides wedge values differ.

    Parameters
    ----------
    faces : array_like, shape (m, 3)
    wedge_values : ndarray or collection of ndarray, shapes (m, 3, ...)
    n_vertices : int

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
    if not torn.any():
        return uncut

    # only faces two rings around such vertices matter
    near = np.zeros(n_vertices, np.bool_)
    near[triangles[torn[triangles].any(axis=1)]] = True
    corners = _corners(np.flatnonzero(near[triangles].any(axis=1)))
    sides = _paired_sides(triangles.reshape(-1), corners)
    differs = [_differ(rows, here, there) for here, there in sides]
    is_seam = differs[0] | differs[1]
    on_seam = np.zeros(n_vertices, np.bool_)
    on_seam |= torn
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
    key = corner_vertex[low].astype(np.int64) << 32 | corner_vertex[high]
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


def _at_vertices(wedges: Array, parts: Cut) -> Array:
    """Wedge values as values of the vertices of the cut mesh."""
    values = np.zeros((len(parts.origin), *wedges.shape[2:]), wedges.dtype)
    values[parts.faces] = wedges
    return values


def _wedge(name: str) -> str:
    """The key of wedge data among vertex data."""
    return WEDGE + name


# --- copies of vertices --------------------------------------------------------------------------


def places(vertices: NDArray[np.float64]) -> Indices:
    """For each vertex one in exactly the same place, the same one for all that are there.

    The vertices are thrown into slots by a hash of their coordinates. The last one in a slot wins
    it; those in its place are found with it, and all others are thrown again.
    """
    x, y, z = vertices.T
    mixed = x * MIXING[0]
    mixed += y * MIXING[1]
    mixed += z * MIXING[2]
    mixed += 0.0  # makes -0.0 equal to 0.0
    keys = mixed.view(np.uint64)
    result = np.arange(len(vertices), dtype=np.int32)
    left = result
    for _ in range(MOST_THROWS):
        keys = keys * SPREADING
        n_bits = len(left).bit_length() + 1
        slots = (keys >> np.uint64(64 - n_bits)).view(np.int64)
        entries = np.arange(len(left), dtype=np.int32)
        winner_of_slot = np.empty(2**n_bits, np.int32)
        winner_of_slot[slots] = entries
        winners = winner_of_slot[slots]
        losers = np.flatnonzero(winners != entries)
        winners = winners[losers]
        same = keys[winners] == keys[losers]
        a, b = left[winners[same]], left[losers[same]]
        same[same] = found = (vertices[a] == vertices[b]).all(axis=1)
        result[b[found]] = a[found]
        losers = losers[~same]
        left, keys = left[losers], keys[losers]
        if len(left) == 0:
            return result
    # many places have one hash, as where coordinates differ by less than sums of them can show
    _, first, which = np.unique(vertices[left], axis=0, return_index=True, return_inverse=True)
    result[left] = left[first[which.reshape(-1)]]
    return result


def _with_copies(seam: _Seam, mesh: Mesh) -> _Seam:
    """The seam, and in addition the vertices on the boundary that have copies there."""
    place = places(mesh.vertices)
    copies = np.flatnonzero(place != np.arange(len(place)))
    if len(copies) == 0:
        return seam
    shared = np.zeros(len(place), np.bool_)
    shared[place[copies]] = True
    shared = _on_boundary(mesh.faces, shared[place])
    n_copies = np.bincount(place[shared], minlength=len(place))
    on_seam = shared & (n_copies > 1)[place]
    place = np.where(on_seam, place, np.arange(len(place), dtype=np.int32))
    return _Seam(place[seam.place], on_seam[seam.place] | seam.on_seam)


def _on_boundary(faces: Indices, among: Mask) -> Mask:
    """Which vertices of a set are at edges with one face."""
    near = faces[among[faces].any(axis=1)]
    edges, counts = np.unique(_edge_keys(near), return_counts=True)
    lonely = edges[counts == 1]
    result = np.zeros(len(among), np.bool_)
    result[lonely >> 32] = True
    result[lonely & 0xFFFFFFFF] = True
    return result & among


def _edge_keys(faces: Indices) -> NDArray[np.int64]:
    """Both ends of each side of each face as one number."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
    keys: NDArray[np.int64] = ends.min(axis=1) << 32 | ends.max(axis=1)
    return keys


# --- between cutting and welding -----------------------------------------------------------------


class _Seam(NamedTuple):
    """Which vertices of a cut mesh belong together."""

    place: Indices
    """Shape (n,): the same for vertices to be welded."""
    on_seam: Mask
    """Shape (n,)."""


def _simplify_cut(mesh: Mesh, seam: _Seam, *, locked: Mask, **options: Any) -> Simplification:
    """Simplify with the seam locked, and with its neighbours too where that is not enough."""
    result = simplify_arrays(*mesh, locked=locked | seam.on_seam, **options)
    if not seam.on_seam.any():
        return result
    before = _n_shared(mesh.faces, seam)
    if _n_shared(result.faces, _followed(seam, result)) == before:
        return result
    ring = np.zeros(len(mesh.vertices), np.bool_)
    ring[mesh.faces[seam.on_seam[mesh.faces].any(axis=1)]] = True
    result = simplify_arrays(*mesh, locked=locked | ring, **options)
    if _n_shared(result.faces, _followed(seam, result)) != before:
        raise MeshError("the two sides of a seam cannot be simplified apart from each other")
    return result


def _followed(seam: _Seam, result: Simplification) -> _Seam:
    """The seam in the simplified mesh."""
    new = result.vertex_map[seam.on_seam]
    kept = new >= 0  # without faces a vertex is dropped even if it is locked
    n_vertices = len(result.vertices)
    place = len(seam.place) + np.arange(n_vertices, dtype=np.int32)
    place[new[kept]] = seam.place[seam.on_seam][kept]
    on_seam = np.zeros(n_vertices, np.bool_)
    on_seam[new[kept]] = True
    return _Seam(place, on_seam)


def _n_shared(faces: Indices, seam: _Seam) -> tuple[int, int]:
    """How many edges and faces at the seam become one with others when it is welded."""
    near = faces[seam.on_seam[faces].any(axis=1)]
    welded = seam.place[near]
    n_distinct = len(np.unique(np.sort(welded, axis=1), axis=0))
    return _n_edges(near) - _n_edges(welded), len(near) - n_distinct


def _n_edges(faces: Indices) -> int:
    """The number of edges, and none for those that join a vertex to itself."""
    keys = np.unique(_edge_keys(faces))
    return int((keys >> 32 != keys & 0xFFFFFFFF).sum())


# --- welding -------------------------------------------------------------------------------------


def weld(mesh: Mesh, result: Simplification, origin: Indices) -> Simplification:
    """Join the copies that a simplified mesh had when it was cut.

    Parameters
    ----------
    mesh : Mesh
        The mesh before it was cut.
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
        topology_before=topology(*mesh),
        topology_after=topology(vertices, faces),
        remaining_edges=edges,
        remaining_reasons=result.report.remaining_reasons[kept],
    )
    vertex_data = {name: values[is_first] for name, values in result.vertex_data.items()}
    return Simplification(
        vertices, faces, vertex_map, result.face_map, report, vertex_data, result.face_data
    )


# --- repair, colours -----------------------------------------------------------------------------


def _turned(wedges: dict[str, Array], faces: Indices, repaired: Repaired) -> dict[str, Array]:
    """Wedge data of the faces that are left, turned over with them."""
    old = faces[repaired.face_map]
    flipped = repaired.vertex_origin[repaired.faces[:, 0]] != old[:, 0]
    turned = {name: values[repaired.face_map] for name, values in wedges.items()}
    for values in turned.values():
        values[flipped] = values[flipped][:, ::-1]
    return turned


def _composed(result: Simplification, repaired: Repaired) -> Simplification:
    """The maps from the mesh before it was repaired."""
    return result._replace(
        vertex_map=np.append(result.vertex_map, np.int32(-1))[repaired.vertex_map],
        face_map=repaired.face_map[result.face_map],
        report=replace(result.report, repairs=repaired.report),
    )


def _colours(data: Mapping[str, Array]) -> set[str]:
    """The data that look like colours: three or four components of 8 bits."""
    return {
        name
        for name, values in data.items()
        if values.dtype == np.uint8 and values.ndim == 2 and values.shape[1] in (3, 4)
    }


def _rounded(values: Array, dtype: np.dtype[Any]) -> Array:
    """Interpolated colours as the type that they had."""
    if dtype.kind in "iu":
        values = np.rint(values)
    rounded: Array = values.astype(dtype)
    return rounded
