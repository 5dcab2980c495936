"""Open3D: ``open3d.geometry.TriangleMesh`` and ``open3d.t.geometry.TriangleMesh`` in and out.

Examples
--------
>>> from tetsimplify.plugins.open3d import simplify  # also finds the libusb that Open3D needs
>>> import open3d as o3d
>>> mesh = o3d.geometry.TriangleMesh.create_torus(tubular_resolution=80)
>>> smaller = simplify(mesh, max_edge_length=0.2).compute_vertex_normals()
>>> smaller.is_watertight(), smaller.euler_poincare_characteristic()
(True, 0)
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import seams
from tetsimplify.adapters import Adapter, MeshArrays, needs
from tetsimplify.errors import MeshError, MissingExtraError
from tetsimplify.isosurface import extract_isosurface
from tetsimplify.topology import TopologyReport
from tetsimplify.topology import topology as topology_of_arrays

LIBUSB = "libusb-1.0.so.0"


def _import_open3d() -> Any:
    """Import Open3D, which needs a libusb even where nothing is plugged in.

    Where the system has none, that of the package libusb-package is loaded first.
    """
    with needs("open3d"):
        try:
            import open3d
        except ImportError as error:
            if LIBUSB not in str(error):
                raise
            _load_libusb(error)
            import open3d
    return open3d


def _load_libusb(cause: ImportError) -> None:
    try:
        import libusb_package
    except ModuleNotFoundError:
        raise MissingExtraError(
            f"Open3D on a system without {LIBUSB}", "libusb-package", "open3d"
        ) from cause
    path = libusb_package.get_library_path()
    if path is None:
        raise ImportError(
            f"libusb-package has no library for this system: install the system's {LIBUSB}"
        ) from cause
    ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)


o3d = _import_open3d()

Data = dict[str, NDArray[Any]]

LegacyMesh = o3d.geometry.TriangleMesh
TensorMesh = o3d.t.geometry.TriangleMesh

WEDGES = ("uvs", "texture_uvs")  # face data of shape (m, 3, 2), by legacy and tensor meshes
MATERIAL = "material_ids"


class NotManifoldError(MeshError, RuntimeError):
    """The mesh is no oriented 2-manifold; Open3D users expect a RuntimeError."""


def simplify(mesh: Any, *, return_report: bool = False, **options: Any) -> Any:
    """Contract edges until a criterion is reached, without changing the topology.

    Parameters
    ----------
    mesh : open3d.geometry.TriangleMesh or open3d.t.geometry.TriangleMesh
        Not changed. Vertices at texture seams and at borders of materials stay where they are.
    return_report : bool
        Return the :class:`tetsimplify.SimplificationReport` too.
    **options
        Those of :func:`tetsimplify.simplify`: `max_edge_length`, `keep_ratio`, `locked`, ...

    Returns
    -------
    TriangleMesh
        A new mesh of the class, the dtypes and the device of `mesh`, with all its attributes,
        textures and material. Normals of vertices are interpolated, those of triangles computed
        anew. Integers are labels, which are never averaged, but for colours.
    report : optional

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold (``repair=True`` repairs it), or
        no triangle mesh.
    """
    arrays = from_open3d(mesh)
    of_faces = dict(arrays.face_data)
    has_face_normals = of_faces.pop("normals", None) is not None
    wedges = {name: of_faces.pop(name) for name in WEDGES if name in of_faces}
    if MATERIAL in of_faces:  # borders of materials are seams
        wedges[MATERIAL] = np.repeat(of_faces[MATERIAL].reshape(-1, 1), 3, axis=1)
    try:
        result = seams.simplify(
            arrays.vertices,
            arrays.faces,
            vertex_data=arrays.vertex_data,
            face_data=of_faces,
            wedge_data=wedges,
            colours=("colors",),
            **options,
        )
    except MeshError as error:
        raise NotManifoldError(
            f"{error} (see is_edge_manifold(), is_vertex_manifold(), is_orientable(); "
            "remove_non_manifold_edges() and orient_triangles() may help)"
        ) from error
    new_wedges = {name: rows for name, rows in result.wedge_data.items() if name != MATERIAL}
    new = to_open3d(
        *(result.vertices, result.faces, result.vertex_data),
        result.face_data | new_wedges,
        like=mesh,
    )
    if has_face_normals:
        new.compute_triangle_normals()
    return (new, result.report) if return_report else new


def topology(mesh: Any) -> TopologyReport:
    """Tell the topology of a legacy or tensor mesh."""
    if isinstance(mesh, LegacyMesh):
        return topology_of_arrays(np.asarray(mesh.vertices), np.asarray(mesh.triangles))
    tensors = _checked(mesh).cpu()
    if "indices" not in tensors.triangle:
        return topology_of_arrays(np.empty((0, 3)), np.empty((0, 3), np.int32))
    return topology_of_arrays(tensors.vertex.positions.numpy(), tensors.triangle.indices.numpy())


def volume_to_open3d(volume: Any, level: float, *, tensor: bool = False, **options: Any) -> Any:
    """Extract an isosurface of a NumPy volume as an Open3D mesh.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2)
    level : float
    tensor : bool
        Give a tensor mesh, else a legacy one.
    **options
        Those of :func:`tetsimplify.extract_isosurface`: `spacing`, `origin`, `closed`, ...

    Returns
    -------
    TriangleMesh

    Examples
    --------
    >>> x, y, z = np.mgrid[-1:1:30j, -1:1:30j, -1:1:30j]
    >>> volume_to_open3d(0.8 - np.sqrt(x**2 + y**2 + z**2), 0.0).euler_poincare_characteristic()
    2
    """
    mesh = extract_isosurface(volume, level, **options)
    return to_open3d(*mesh, like=TensorMesh() if tensor else None)


def from_open3d(mesh: Any) -> MeshArrays:
    """Take a mesh apart.

    Returns
    -------
    MeshArrays
        Views, where Open3D gives them. The data have Open3D's names: of a legacy mesh
        ``"normals"`` and ``"colors"`` of the vertices, ``"normals"``, ``"material_ids"`` and
        ``"uvs"`` (m, 3, 2) of the triangles; all attributes of a tensor mesh.

    Examples
    --------
    >>> mesh = o3d.geometry.TriangleMesh.create_box().compute_vertex_normals()
    >>> vertices, faces, vertex_data, face_data = from_open3d(mesh)
    >>> vertices.shape, list(vertex_data), list(face_data)
    ((8, 3), ['normals'], ['normals'])
    """
    if not isinstance(mesh, LegacyMesh):
        return _from_tensors(_checked(mesh).cpu())
    n_faces = len(mesh.triangles)
    of_faces = {}
    if mesh.has_triangle_normals():
        of_faces["normals"] = np.asarray(mesh.triangle_normals)
    if mesh.has_triangle_material_ids() and len(mesh.triangle_material_ids) == n_faces:
        of_faces[MATERIAL] = np.asarray(mesh.triangle_material_ids)
    if mesh.has_triangle_uvs():
        of_faces["uvs"] = np.asarray(mesh.triangle_uvs).reshape(-1, 3, 2)
    of_vertices = {}
    if mesh.has_vertex_normals():
        of_vertices["normals"] = np.asarray(mesh.vertex_normals)
    if mesh.has_vertex_colors():
        of_vertices["colors"] = np.asarray(mesh.vertex_colors)
    return MeshArrays(np.asarray(mesh.vertices), np.asarray(mesh.triangles), of_vertices, of_faces)


def to_open3d(
    vertices: ArrayLike,
    faces: ArrayLike,
    vertex_data: Mapping[str, ArrayLike] | None = None,
    face_data: Mapping[str, ArrayLike] | None = None,
    *,
    like: Any = None,
) -> Any:
    """Put a mesh together; the inverse of :func:`from_open3d`.

    Parameters
    ----------
    vertices, faces, vertex_data, face_data
        As :func:`from_open3d` returns them.
    like : TriangleMesh, optional
        The mesh to take the class, the textures or the material, the device, and of a tensor
        mesh the dtypes of positions and indices from. None gives a legacy mesh.

    Returns
    -------
    TriangleMesh
    """
    if isinstance(like, TensorMesh):
        return _to_tensors(vertices, faces, vertex_data or {}, face_data or {}, like)
    utility = o3d.utility
    mesh = LegacyMesh()
    mesh.vertices = utility.Vector3dVector(np.ascontiguousarray(vertices, np.float64))
    mesh.triangles = utility.Vector3iVector(np.ascontiguousarray(faces, np.int32))
    for data, wanted in (
        (vertex_data or {}, {"normals": "vertex_normals", "colors": "vertex_colors"}),
        (face_data or {}, {"normals": "triangle_normals"}),
    ):
        for name, attribute in wanted.items():
            if name in data:
                rows = np.ascontiguousarray(data[name], np.float64)
                setattr(mesh, attribute, utility.Vector3dVector(rows))
    data = face_data or {}
    if "uvs" in data:
        uvs = np.ascontiguousarray(data["uvs"], np.float64).reshape(-1, 2)
        mesh.triangle_uvs = utility.Vector2dVector(uvs)
    if MATERIAL in data:
        ids = np.ascontiguousarray(data[MATERIAL], np.int32)
        mesh.triangle_material_ids = utility.IntVector(ids)
    if like is not None and like.has_textures():
        mesh.textures = like.textures
    return mesh


def _from_tensors(mesh: Any) -> MeshArrays:
    of_vertices = {name: tensor.numpy() for name, tensor in mesh.vertex.items()}
    of_faces = {name: tensor.numpy() for name, tensor in mesh.triangle.items()}
    positions = of_vertices.pop("positions", np.empty((0, 3), np.float32))
    indices = of_faces.pop("indices", np.empty((0, 3), np.int64))
    return MeshArrays(positions, indices, of_vertices, of_faces)


def _to_tensors(
    vertices: ArrayLike,
    faces: ArrayLike,
    vertex_data: Mapping[str, ArrayLike],
    face_data: Mapping[str, ArrayLike],
    like: Any,
) -> Any:
    mesh = TensorMesh(o3d.core.Device("CPU:0"))
    mesh.vertex.positions = _tensor(vertices, like.vertex, "positions", np.float32)
    mesh.triangle.indices = _tensor(faces, like.triangle, "indices", np.int64)
    for group, data in ((mesh.vertex, vertex_data), (mesh.triangle, face_data)):
        for name, rows in data.items():
            group[name] = o3d.core.Tensor(np.ascontiguousarray(rows))
    mesh.material = type(like.material)(like.material)
    return mesh.to(like.device)


def _tensor(rows: ArrayLike, group: Any, name: str, default: type) -> Any:
    """A tensor of the dtype of an attribute that another mesh has."""
    dtype = np.dtype(default)
    if name in group:
        dtype = group[name][:0].cpu().numpy().dtype
    elif np.asarray(rows).dtype == np.float64:
        dtype = np.dtype(np.float64)
    return o3d.core.Tensor(np.ascontiguousarray(rows, dtype))


def _checked(mesh: Any) -> Any:
    if not isinstance(mesh, TensorMesh):
        kind = f"{type(mesh).__module__}.{type(mesh).__qualname__}"
        raise MeshError(
            "expected an open3d.geometry.TriangleMesh or open3d.t.geometry.TriangleMesh, got "
            f"{kind}"
        )
    return mesh


ADAPTER = Adapter("open3d", simplify, topology)
