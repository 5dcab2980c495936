"""PyMeshLab meshes taken apart and put together."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify.adapters import MeshArrays, needs
from tetsimplify.errors import MeshError
from tetsimplify.seams import Seamed

with needs("pymeshlab"):
    import pymeshlab
    from pymeshlab import PyMeshLabException

Data = dict[str, NDArray[Any]]
Indices = NDArray[np.int32]

CUSTOM = "custom."  # before the names of custom attributes: (n,) are scalar, (n, 3) point ones
WEDGES = "wedge_tex_coord"  # among the face data, shape (m, 3, 2)

# arguments of ``pymeshlab.Mesh``, after "v_" and "f_"
_ARGUMENTS = {
    "normal": "normals_matrix",
    "color": "color_matrix",
    "scalar": "scalar_array",
    "tex_coord": "tex_coords_matrix",
}


def from_pymeshlab(
    mesh: pymeshlab.Mesh, custom_attributes: Collection[str] = (), *, normals: bool = True
) -> MeshArrays:
    """Take a mesh apart.

    Parameters
    ----------
    mesh : pymeshlab.Mesh
        Compact or not; not changed.
    custom_attributes : collection of str
        Names of custom attributes.
    normals : bool
        Take the normals too.

    Returns
    -------
    MeshArrays
        `vertex_data` has what there is of ``"normal"``, ``"color"``, ``"scalar"``,
        ``"tex_coord"``; `face_data` of ``"normal"``, ``"color"``, ``"scalar"``, and
        ``"wedge_tex_coord"`` of shape (m, 3, 2). Custom attributes are ``"custom.<name>"``.

    Examples
    --------
    >>> ms = pymeshlab.MeshSet()
    >>> ms.create_cube()
    >>> vertices, faces, vertex_data, _ = from_pymeshlab(ms.current_mesh())
    >>> vertices.shape, faces.shape, "normal" in vertex_data
    ((8, 3), (12, 3), True)
    """
    with compact(mesh) as source:
        of_vertices: Data = {}
        of_faces: Data = {}
        if normals:
            of_vertices["normal"] = in_rows(source.vertex_normal_matrix())
            of_faces["normal"] = in_rows(source.face_normal_matrix())
        for kind, data in (("vertex", of_vertices), ("face", of_faces)):
            if getattr(source, f"has_{kind}_color")():
                data["color"] = _colors(source, kind)
            if getattr(source, f"has_{kind}_scalar")():
                data["scalar"] = getattr(source, f"{kind}_scalar_array")()
        if source.has_vertex_tex_coord():
            of_vertices["tex_coord"] = in_rows(source.vertex_tex_coord_matrix())
        if source.has_wedge_tex_coord():
            of_faces[WEDGES] = in_rows(source.wedge_tex_coord_matrix()).reshape(-1, 3, 2)
        for name in custom_attributes:
            _add_custom(source, name, of_vertices, of_faces)
        vertices, faces = in_rows(source.vertex_matrix()), in_rows(source.face_matrix())
        return MeshArrays(vertices, faces, of_vertices, of_faces)


def to_pymeshlab(
    vertices: ArrayLike,
    faces: ArrayLike,
    vertex_data: Data | None = None,
    face_data: Data | None = None,
    *,
    edges: ArrayLike | None = None,
    like: pymeshlab.Mesh | None = None,
) -> pymeshlab.Mesh:
    """Put a mesh together; the inverse of :func:`from_pymeshlab`.

    Parameters
    ----------
    vertices, faces, vertex_data, face_data
        As :func:`from_pymeshlab` returns them.
    edges : array_like, shape (k, 2), optional
        Edges of polylines.
    like : pymeshlab.Mesh, optional
        The mesh to take the label from.

    Returns
    -------
    pymeshlab.Mesh
        Normals of vertices, which PyMeshLab computes itself, are not taken over.
    """
    arguments: dict[str, Any] = {}
    custom: list[tuple[str, str, NDArray[Any]]] = []
    for letter, kind, data in (("v", "vertex", vertex_data), ("f", "face", face_data)):
        for name, values in (data or {}).items():
            if name.startswith(CUSTOM):
                custom.append((kind, name.removeprefix(CUSTOM), values))
            elif name == WEDGES:
                arguments["w_tex_coords_matrix"] = values.reshape(-1, 2)
            else:
                rows = levels(values) if name == "color" else values
                arguments[f"{letter}_{_ARGUMENTS[name]}"] = rows
    if edges is not None:
        arguments["edge_matrix"] = np.asarray(edges)
    mesh = pymeshlab.Mesh(np.asarray(vertices), np.asarray(faces), **arguments)
    for kind, name, values in custom:
        shape = "scalar" if values.ndim == 1 else "point"
        getattr(mesh, f"add_{kind}_custom_{shape}_attribute")(values, name)
    if like is not None:
        mesh.set_label(like.label())
    return mesh


@contextmanager
def compact(mesh: Any) -> Iterator[pymeshlab.Mesh]:
    """The mesh, or a copy where it holds deleted elements."""
    if isinstance(mesh, pymeshlab.MeshSet):
        raise MeshError("expected a pymeshlab.Mesh, got a MeshSet: give ms.current_mesh()")
    if mesh.is_compact():
        yield mesh
        return
    holder = pymeshlab.MeshSet()  # owns the copy
    holder.add_mesh(mesh)
    holder.current_mesh().compact()
    yield holder.current_mesh()


def in_rows(matrix: NDArray[Any]) -> NDArray[Any]:
    """An array in C order; PyMeshLab's are in Fortran order."""
    return matrix if matrix.ndim == 1 else np.stack(matrix.T, axis=1)  # a quick copy


def levels(colors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colours so that PyMeshLab, which keeps 8 bits and rounds down, takes the nearest ones."""
    return (np.rint(255 * colors) + 0.25) / 255


def is_constant(rows: NDArray[Any]) -> bool:
    """Whether all elements have the same value, as colours that nobody has set."""
    return len(rows) > 0 and (rows.strides[0] == 0 or bool((rows == rows[0]).all()))


def with_ends(result: Seamed, given: MeshArrays, ends: Indices) -> Seamed:
    """A result with the ends of polylines that belong to no face, which it has dropped."""
    loose = np.unique(ends[result.vertex_map[ends] < 0])
    if len(loose) == 0:
        return result
    number = result.vertex_map.copy()
    number[loose] = len(result.vertices) + np.arange(len(loose))
    carried = {
        name: np.concatenate([rows, given.vertex_data[name][loose]])
        for name, rows in result.vertex_data.items()
    }
    vertices = np.concatenate([result.vertices, given.vertices[loose]])
    return result._replace(vertices=vertices, vertex_map=number, vertex_data=carried)


def _add_custom(mesh: pymeshlab.Mesh, name: str, of_vertices: Data, of_faces: Data) -> None:
    """Add the values of the custom attributes of a name to the data."""
    found = False
    for kind, data in (("vertex", of_vertices), ("face", of_faces)):
        for shape in ("scalar_attribute_array", "point_attribute_matrix"):
            try:
                data[CUSTOM + name] = in_rows(getattr(mesh, f"{kind}_custom_{shape}")(name))
            except PyMeshLabException:
                continue
            found = True
    if not found:
        raise PyMeshLabException(f"No custom attribute found with name {name}.")


def _colors(mesh: pymeshlab.Mesh, kind: str) -> NDArray[np.float64]:
    """Colours, of little memory and in little time where nobody has set any."""
    packed = getattr(mesh, f"{kind}_color_array")()
    if is_constant(packed):
        levels_of_one = int(packed[0]) >> np.array([16, 8, 0, 24]) & 255  # 0xAARRGGBB
        return np.broadcast_to(levels_of_one / 255, (len(packed), 4))
    return in_rows(getattr(mesh, f"{kind}_color_matrix")())
