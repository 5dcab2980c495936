"""Simplification of meshes with seams: borders that stay where they are.

A seam is a path of edges where data jump: on its two sides the same vertices have different
texture coordinates, or faces have different labels. Some programs hold the values at face corners
(wedges), others hold copies of each vertex of the seam, so that the mesh is open there.

:func:`simplify` does both: wedges and labels are cut apart first, see :mod:`tetsimplify.cutting`.
Then each region of labels is a surface of its own, whose topology is kept. The vertices on the
seam are locked, so both sides stay where they are: nothing tears and nothing bleeds. Then the
copies are welded.

What could still go wrong is that the two sides, each for itself, come to have an edge between
the same two vertices of the seam, which would be one edge of four faces when they are welded,
or a face between the same three.
This is looked for, and where it happens all is done again with the neighbours of these vertices
locked as well, so that their faces stay as they are. After a few rounds all neighbours of the seam
are locked, which excludes it everywhere: no contraction then reaches a face at the seam.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify.arrays import as_data, as_mesh, as_vertex_mask, listed
from tetsimplify.contract import Clock, after_repair, contract
from tetsimplify.copies import Seam, clashes, followed, n_shared, with_copies
from tetsimplify.cutting import at_vertices, cut, edge_keys, weld
from tetsimplify.data import WEDGE
from tetsimplify.engine import Engine
from tetsimplify.errors import MeshError, OptionError
from tetsimplify.mesh import Mesh
from tetsimplify.options import Options, Progress
from tetsimplify.repair import repair as repair_mesh
from tetsimplify.report import Repaired, Simplification, SimplificationReport
from tetsimplify.topology import TopologyReport, topology

Array = NDArray[Any]
Indices = NDArray[np.int32]
Mask = NDArray[np.bool_]

MOST_ROUNDS = 4  # in the last of these all neighbours of the seam are locked


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


class Asked(NamedTuple):
    """What `seams` names."""

    edges: Indices
    """Shape (k, 2)."""
    labels: list[Array]
    """Of the faces, shapes (m, ...)."""
    wedges: list[str]
    """Names of face data of shape (m, 3, ...) that belong to the corners."""
    copies: bool
    """Whether vertices in one place stay together."""


def simplify(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    vertex_data: Mapping[str, ArrayLike] | None = None,
    face_data: Mapping[str, ArrayLike] | None = None,
    wedge_data: Mapping[str, ArrayLike] | None = None,
    seams: ArrayLike | None = None,
    copies: bool = True,
    colours: Collection[str] | None = None,
    locked: ArrayLike | None = None,
    repair: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Seamed:
    """Simplify a mesh with its attributes; seams neither tear nor bleed.

    A seam is where wedge data differ at one vertex, where `seams` says so, or where vertices on
    the boundary are in exactly the same place as others there. Neither is merged with the other.

    Parameters
    ----------
    vertices, faces : array_like, shapes (n, 3) and (m, 3)
    vertex_data, face_data : mapping of names to arrays, shapes (n, ...) and (m, ...)
    wedge_data : mapping of names to arrays, shapes (m, 3, ...)
        Values at the corners of the faces. A material of each face goes in here as well,
        repeated for its corners: then borders of materials are seams.
    seams : array_like or str or list of str, optional
        As in :func:`tetsimplify.simplify`.
    copies : bool
        Whether vertices on the boundary that are in one place are copies of one.
    colours : collection of str, optional
        Integer vertex and wedge data that are to be interpolated and rounded; None takes those
        of 8 bits with 3 or 4 components. Other integers are labels, which are never averaged.
    locked, repair, threads, progress, **options
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
    clock, checked = Clock(), Options(**options)
    with clock.stage("check"):
        mesh = as_mesh(vertices, faces)
        held = as_vertex_mask("locked", locked, len(mesh.vertices))
        of_vertices = as_data("vertex_data", vertex_data, len(mesh.vertices))
        of_faces, of_wedges = (
            as_data(name, data, len(mesh.faces))
            for name, data in (("face_data", face_data), ("wedge_data", wedge_data))
        )
        asked = _asked(seams, mesh, of_vertices, of_faces, of_wedges)
        if seams is not None and checked.blocked == "violate":
            raise OptionError("seams need a topology that is kept, not blocked='violate'")
        of_wedges |= {name: of_faces.pop(name) for name in asked.wedges}
        repaired = repair_mesh(*mesh) if repair else None
        if repaired is not None:
            asked = _repaired(asked, repaired)
            of_wedges = _turned(of_wedges, mesh.faces, repaired)
            of_faces = {name: values[repaired.face_map] for name, values in of_faces.items()}
            of_vertices = {name: data[repaired.vertex_origin] for name, data in of_vertices.items()}
            held = held[repaired.vertex_origin]
            mesh = Mesh(repaired.vertices, repaired.faces)

        corners = [*of_wedges.values(), *(np.stack([x] * 3, axis=1) for x in asked.labels)]
        edges = asked.edges if len(asked.edges) else None
        parts = cut(mesh.faces, corners, len(mesh.vertices), edges)
        is_cut = len(parts.origin) > len(mesh.vertices)
        opened, values = Mesh(mesh.vertices, parts.faces), dict(of_vertices)
        if is_cut:
            before = _manifold(mesh)
            opened, held = Mesh(mesh.vertices[parts.origin], parts.faces), held[parts.origin]
            values = {name: data[parts.origin] for name, data in of_vertices.items()}
        values |= {_wedge(name): at_vertices(data, parts) for name, data in of_wedges.items()}
        averaged = _colours(values) if colours is None else set(colours)
        averaged = {name for name in values if {name, name.removeprefix(WEDGE)} & averaged}
        types = {name: values[name].dtype for name in averaged}
        values |= {name: values[name].astype(np.float64) for name in averaged}

        engine = Engine(opened, checked, held | parts.on_seam, threads=threads)
        seam = Seam(parts.origin, parts.on_seam)
        if copies or asked.copies:
            seam = with_copies(seam, opened.vertices, engine.on_boundary)
            engine.lock(seam.on_seam)

    result = _contract_cut(
        engine,
        opened,
        seam,
        locked=held,
        vertex_data=values,
        face_data=of_faces,
        progress=progress,
        clock=clock,
    )
    with clock.stage("report"):
        carried = dict(result.vertex_data)
        carried |= {name: _rounded(carried[name], dtype) for name, dtype in types.items()}
        new_wedges = {name: carried.pop(_wedge(name))[result.faces] for name in of_wedges}
        result = result._replace(vertex_data=carried)
        if is_cut:
            result = weld(mesh, before, result, parts.origin)
        if repaired is not None:
            result = after_repair(result, repaired)
    return Seamed(*result, new_wedges)


def _contract_cut(
    engine: Engine, mesh: Mesh, seam: Seam, *, locked: Mask, **more: Any
) -> Simplification:
    """Simplify with the seam locked, and where that is not enough with its neighbours too."""
    result = contract(engine, mesh, locked=locked | seam.on_seam, **more)
    if not seam.on_seam.any():
        return result
    before, held = n_shared(mesh.faces, seam), locked | seam.on_seam
    for n_left in reversed(range(MOST_ROUNDS)):
        if n_shared(result.faces, followed(seam, result)) == before:
            return result
        met = clashes(mesh.faces, seam, result) if n_left else seam.on_seam
        held[mesh.faces[met[mesh.faces].any(axis=1)]] = True
        anew = Engine(mesh, engine.options, held, threads=engine.n_threads)
        result = contract(anew, mesh, locked=held, **more)
    if n_shared(result.faces, followed(seam, result)) != before:
        raise MeshError("the two sides of a seam cannot be simplified apart from each other")
    return result


def _manifold(mesh: Mesh) -> TopologyReport:
    """The topology of a mesh that is to be cut, which could hide what is wrong with it."""
    report = topology(*mesh)
    if (defects := report.defects()) is not None:
        raise MeshError(
            f"the mesh is no consistently oriented 2-manifold: {defects}; repair=True repairs it"
        )
    return report


# --- what is asked for ---------------------------------------------------------------------------


def _asked(
    seams: ArrayLike | None,
    mesh: Mesh,
    of_vertices: Mapping[str, Array],
    of_faces: Mapping[str, Array],
    of_wedges: Mapping[str, Array],
) -> Asked:
    """Look up what `seams` names, or check the edges that it holds."""
    nothing = np.empty((0, 2), np.int32)
    if seams is None:
        return Asked(nothing, [], [], False)
    names = [seams] if isinstance(seams, str) else seams
    if not isinstance(names, (list, tuple, set)) or not all(isinstance(x, str) for x in names):
        return Asked(_as_edges(seams, mesh), [], [], False)
    labels, wedges, copies = [], [], False
    for name in sorted(names):
        if name not in {*of_vertices, *of_faces, *of_wedges}:
            given = ", ".join(repr(key) for key in (*of_faces, *of_vertices)) or "none"
            raise OptionError(
                f"seams={name!r} names no face_data and no vertex_data, given: {given}"
            )
        copies |= name in of_vertices
        if name in of_faces and _is_at_corners(of_faces[name]):
            wedges.append(name)
        elif name in of_faces:
            labels.append(_as_labels(name, of_faces[name]))
    return Asked(nothing, labels, wedges, copies)


def _is_at_corners(values: Array) -> bool:
    """Whether face data have a value for each corner: texture coordinates, (m, 3, 2)."""
    return values.ndim > 2 and values.shape[1] == 3


def _as_labels(name: str, values: Array) -> Array:
    """Labels of faces, checked."""
    if values.dtype.kind not in "biuUS":
        raise OptionError(
            f"seams={name!r}: labels of faces must be integers, booleans or strings, or values at "
            f"corners of shape (m, 3, ...), got {values.dtype} of shape {values.shape}"
        )
    return values


def _as_edges(seams: Any, mesh: Mesh) -> Indices:
    """Edges of a mesh, checked."""
    pairs = np.asarray(seams)
    if pairs.size == 0:
        return np.empty((0, 2), np.int32)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.dtype.kind not in "iu":
        raise OptionError(
            "seams must be names of face_data or vertex_data, or edges, integers of shape (k, 2); "
            f"got {pairs.dtype} of shape {pairs.shape}"
        )
    last = len(mesh.vertices) - 1
    if pairs.min() < 0 or pairs.max() > last:
        raise OptionError(
            f"seams must hold vertex indices from 0 to {last}, got {pairs.min()} to {pairs.max()}"
        )
    is_edge = np.isin(edge_keys(*np.sort(pairs, axis=1).T), _sides(mesh.faces)[1])
    if not is_edge.all():
        raise OptionError(f"seams must hold edges of the mesh, got {listed(pairs[~is_edge])}")
    edges: Indices = pairs.astype(np.int32)
    return edges


def _sides(faces: Indices) -> tuple[Indices, NDArray[np.int64]]:
    """The sides of all faces: both ends of each, the lower one first, and as one number."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    return ends, edge_keys(*ends.T)


# --- repair, colours -----------------------------------------------------------------------------


def _repaired(asked: Asked, repaired: Repaired) -> Asked:
    """What is asked for, of the mesh when it is repaired."""
    edges = asked.edges
    if len(edges):
        ends, _ = _sides(repaired.faces)
        keys = edge_keys(*np.sort(repaired.vertex_origin[ends], axis=1).T)
        edges = ends[np.isin(keys, edge_keys(*np.sort(edges, axis=1).T))]
    return asked._replace(edges=edges, labels=[x[repaired.face_map] for x in asked.labels])


def _turned(wedges: dict[str, Array], faces: Indices, repaired: Repaired) -> dict[str, Array]:
    """Wedge data of the faces that are left, turned over with them."""
    old = faces[repaired.face_map]
    flipped = repaired.vertex_origin[repaired.faces[:, 0]] != old[:, 0]
    turned = {name: values[repaired.face_map] for name, values in wedges.items()}
    for values in turned.values():
        values[flipped] = values[flipped][:, ::-1]
    return turned


def _wedge(name: str) -> str:
    """The key of wedge data among vertex data."""
    return WEDGE + name


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
