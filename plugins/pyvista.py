"""PyVista and VTK: :class:`pyvista.PolyData` in and out, isosurfaces of :class:`pyvista.ImageData`.

Where tetsimplify is installed, the accessor needs no import of this module.

Examples
--------
>>> import pyvista
>>> import tetsimplify.plugins.pyvista
>>> mesh = pyvista.Icosphere(nsub=4)
>>> mesh.tetsimplify.simplify(max_edge_length=0.1).is_manifold
True
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import seams
from tetsimplify.adapters import Adapter, MeshArrays, needs
from tetsimplify.errors import MeshError, VolumeError
from tetsimplify.io import Volume, isosurface_of
from tetsimplify.mesh import NORMALS
from tetsimplify.topology import TopologyReport
from tetsimplify.topology import topology as topology_of_arrays

with needs("pyvista"):
    import pyvista
    from pyvista.core.errors import NotAllTrianglesError

Data = dict[str, NDArray[Any]]

N_ATTRIBUTES = 11  # vtkDataSetAttributes::NUM_ATTRIBUTES: active scalars, vectors, normals, ...


class NotTrianglesError(MeshError, NotAllTrianglesError):
    """The mesh has cells that are no triangles."""


def simplify(mesh: pyvista.PolyData, *, return_report: bool = False, **options: Any) -> Any:
    """Contract edges until a criterion is reached, without changing the topology.

    Parameters
    ----------
    mesh : pyvista.PolyData or vtkPolyData
        All triangles; not changed. Points on the boundary that coincide with others there, as
        at texture seams and sharp edges, stay where they are.
    return_report : bool
        Return the :class:`tetsimplify.SimplificationReport` too.
    **options
        Those of :func:`tetsimplify.simplify`: `max_edge_length`, `keep_ratio`, `locked`, ...

    Returns
    -------
    pyvista.PolyData
        With the point, cell and field data of `mesh`, its active arrays and the precision of
        its points. Floats are interpolated, so are colours (three or four components of 8
        bits); all else is taken from the nearest point. Normals have unit length again.
    report : optional

    Raises
    ------
    NotTrianglesError
        When there are other cells than triangles: `mesh.triangulate()` first.
    MeshError
        When the mesh is no consistently oriented 2-manifold; ``repair=True`` repairs it,
        `mesh.clean()` merges points that are there twice.
    """
    source = _wrapped(mesh)
    arrays = from_pyvista(source)
    result = seams.simplify(
        arrays.vertices,
        arrays.faces,
        vertex_data=arrays.vertex_data,
        face_data=arrays.face_data,
        **options,
    )
    points = result.vertices.astype(arrays.vertices.dtype, copy=False)
    point_data, cell_data = result.vertex_data, result.face_data
    if (name := _normals_name(source.point_data)) in point_data:
        point_data[name] = _unit(point_data[name])
    if (name := _normals_name(source.cell_data)) in cell_data:
        cell_data[name] = _cell_normals(points, result.faces, cell_data[name])
    new = to_pyvista(points, result.faces, point_data, cell_data, like=source)
    return (new, result.report) if return_report else new


def topology(mesh: pyvista.PolyData) -> TopologyReport:
    """Tell the topology of a mesh; see :func:`tetsimplify.topology`."""
    source = _wrapped(mesh)
    return topology_of_arrays(source.points, source.regular_faces)


def isosurface(
    image: pyvista.ImageData,
    level: float | str | Iterable[float | str] | None = None,
    scalars: str | None = None,
    **options: Any,
) -> pyvista.PolyData:
    """Extract the surface where point scalars have a value, by marching tetrahedra.

    Parameters
    ----------
    image : pyvista.ImageData or vtkImageData
    level : float, "otsu", or iterable of these
        The iso-value; with several all surfaces are in one mesh, as `contour` does it. Not given
        where the options have `labels`, whose surfaces are in one mesh likewise.
    scalars : str, optional
        The point array; by default the active scalars.
    **options
        Those of :func:`tetsimplify.extract_isosurface`: `labels`, `lattice`, `closed`, `normals`,
        `refine`, `regularise`, `vertex_normals`, `progress`. As `vertex_data` also a list of the
        names of other point arrays.

    Returns
    -------
    pyvista.PolyData
        In the coordinates of `image` (spacing, origin, extent and direction). The point array
        of the name of the scalars holds the level or the label of each point; others hold what
        was asked for, the normals as active normals.

    Raises
    ------
    VolumeError
        When there are no such scalars with one component at the points of the image.

    Examples
    --------
    >>> image = pyvista.Wavelet()
    >>> image.tetsimplify.isosurface([130.0, 180.0]).n_open_edges > 0
    True
    """
    source = image if isinstance(image, pyvista.ImageData) else pyvista.wrap(image)
    name = scalars or source.point_data.active_scalars_name or ""
    if name not in source.point_data:
        hint = f"it has {source.point_data.keys()}"
        if source.cell_data:
            hint = "image.cell_data_to_point_data() makes point data of cell data"
        raise VolumeError(f"the image has no point array {name!r}: {hint}")
    samples = _samples(source, name)
    affine = np.array(source.index_to_physical_matrix)
    affine[:3, 3] += affine[:3, :3] @ source.extent[::2]
    fields = options.pop("vertex_data", None) or {}
    if not isinstance(fields, Mapping):
        fields = {field: _samples(source, field) for field in fields}
    several = level if isinstance(level, str) or not isinstance(level, Iterable) else list(level)
    found = isosurface_of(Volume(samples, affine), several, vertex_data=fields, **options)
    surfaces = found if isinstance(found, list) else [found]

    first = np.cumsum([0] + [len(surface.vertices) for surface in surfaces])
    points = [np.empty((0, 3)), *(surface.vertices for surface in surfaces)]
    faces = [surface.faces + np.int32(n) for surface, n in zip(surfaces, first[:-1], strict=True)]
    data: Data = {}
    for field in getattr(surfaces[0], "vertex_data", {}) if surfaces else {}:
        data[field] = np.concatenate([surface.vertex_data[field] for surface in surfaces])
    if surfaces and hasattr(surfaces[0], "label"):
        shown = np.array([surface.label for surface in surfaces])
    else:
        shown = np.array([surface.level for surface in surfaces], float)
    normals = data.pop(NORMALS, None)
    data[name] = np.repeat(shown, np.diff(first))
    made = to_pyvista(
        np.concatenate(points), np.concatenate([np.empty((0, 3), np.int32), *faces]), data
    )
    if normals is not None:
        made.point_data.active_normals = normals
    made.set_active_scalars(name)
    return made


def _samples(image: pyvista.ImageData, name: str) -> NDArray[Any]:
    """A point array as a volume, x first; nothing is copied."""
    if name not in image.point_data:
        raise VolumeError(f"the image has no point array {name!r}, only {image.point_data.keys()}")
    values = np.asarray(image.point_data[name])
    if values.ndim != 1:
        raise VolumeError(f"scalars must have one component, {name!r} has shape {values.shape}")
    return values.reshape(image.dimensions[::-1]).T  # x runs fastest


def from_pyvista(mesh: pyvista.PolyData) -> MeshArrays:
    """Take a mesh apart: points, faces, point data and cell data.

    Raises
    ------
    NotTrianglesError

    Examples
    --------
    >>> points, faces, point_data, cell_data = from_pyvista(pyvista.Sphere())
    >>> points.shape, faces.shape, list(point_data)
    ((842, 3), (1680, 3), ['Normals'])
    """
    source = _wrapped(mesh)
    return MeshArrays(
        np.asarray(source.points),
        source.regular_faces if source.n_cells else np.empty((0, 3), np.int64),
        {name: np.asarray(values) for name, values in source.point_data.items()},
        {name: np.asarray(values) for name, values in source.cell_data.items()},
    )


def to_pyvista(
    vertices: ArrayLike,
    faces: ArrayLike,
    vertex_data: Data | None = None,
    face_data: Data | None = None,
    *,
    like: pyvista.PolyData | None = None,
) -> pyvista.PolyData:
    """Put a mesh together; the inverse of :func:`from_pyvista`.

    Parameters
    ----------
    vertices, faces, vertex_data, face_data
        As :func:`from_pyvista` returns them.
    like : pyvista.PolyData, optional
        The mesh to take field data and the names of the active arrays from.
    """
    triangles = np.ascontiguousarray(faces, dtype=np.int64)
    mesh: pyvista.PolyData = pyvista.PolyData.from_regular_faces(
        np.array(vertices),
        triangles,  # type: ignore[arg-type]
        deep=True,
    )
    mesh.point_data.update(vertex_data or {})
    mesh.cell_data.update(face_data or {})
    if like is None:
        return mesh
    mesh.GetFieldData().DeepCopy(like.GetFieldData())
    for new, old in (
        (mesh.GetPointData(), like.GetPointData()),
        (mesh.GetCellData(), like.GetCellData()),
    ):
        for role in range(N_ATTRIBUTES):
            active = old.GetAbstractAttribute(role)
            new.SetActiveAttribute(None if active is None else active.GetName(), role)
    mesh.copy_meta_from(like)
    return mesh


def _wrapped(mesh: Any) -> pyvista.PolyData:
    """The mesh as PyVista has it, checked."""
    source = mesh if isinstance(mesh, pyvista.PolyData) else pyvista.wrap(mesh)
    if not isinstance(source, pyvista.PolyData):
        raise MeshError(
            f"expected a PolyData, got a {type(source).__name__}: "
            "mesh.extract_surface().triangulate() first"
        )
    if source.n_cells and not source.is_all_triangles:
        raise NotTrianglesError(
            f"mesh must consist of only triangles, got {source.n_cells:,} cells of which some are "
            "others: mesh.triangulate() first"
        )
    return source


def _normals_name(data: Any) -> str:
    """The name of the active normals."""
    name: str | None = data.active_normals_name
    return name or ""


def _unit(vectors: NDArray[Any]) -> NDArray[Any]:
    """Vectors of unit length; zero stays zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: NDArray[Any] = vectors / np.where(lengths == 0, 1, lengths).astype(vectors.dtype)
    return unit


def _cell_normals(points: NDArray[Any], faces: NDArray[Any], carried: NDArray[Any]) -> NDArray[Any]:
    """Normals of cells, on the side where they were."""
    a, b, c = points[faces].astype(np.float64).transpose(1, 0, 2)
    normals = _unit(np.cross(b - a, c - a))
    against = (normals * carried).sum(axis=1) < 0
    # a few cells may have turned far; what counts is the side that most of them are on
    side = -1.0 if against.mean() > 0.5 else 1.0
    result: NDArray[Any] = (side * normals).astype(carried.dtype)
    return result


@pyvista.register_dataset_accessor("tetsimplify", pyvista.PolyData)
class MeshAccessor:
    """``mesh.tetsimplify`` of a :class:`pyvista.PolyData`."""

    def __init__(self, mesh: pyvista.PolyData) -> None:
        self._mesh = mesh

    def simplify(
        self, max_edge_length: float | None = None, *, return_report: bool = False, **options: Any
    ) -> Any:
        """Contract edges; see :func:`tetsimplify.plugins.pyvista.simplify`."""
        if max_edge_length is not None:
            options["max_edge_length"] = max_edge_length
        return simplify(self._mesh, return_report=return_report, **options)

    def topology(self) -> TopologyReport:
        """Tell the topology; see :func:`tetsimplify.topology`."""
        return topology(self._mesh)


@pyvista.register_dataset_accessor("tetsimplify", pyvista.ImageData)
class ImageAccessor:
    """``image.tetsimplify`` of a :class:`pyvista.ImageData`."""

    def __init__(self, image: pyvista.ImageData) -> None:
        self._image = image

    def isosurface(
        self,
        level: float | str | Iterable[float | str] | None = None,
        scalars: str | None = None,
        **options: Any,
    ) -> pyvista.PolyData:
        """Extract surfaces; see :func:`tetsimplify.plugins.pyvista.isosurface`."""
        return isosurface(self._image, level, scalars, **options)


ADAPTER = Adapter("pyvista", simplify, topology)
