"""trimesh: :class:`trimesh.Trimesh` and :class:`trimesh.Scene` in and out.

Examples
--------
>>> import trimesh
>>> import tetsimplify
>>> mesh = trimesh.creation.icosphere(subdivisions=4)
>>> tetsimplify.simplify(mesh, max_edge_length=0.2).is_watertight
True
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import seams
from tetsimplify.adapters import Adapter, MeshArrays, needs
from tetsimplify.errors import MeshError
from tetsimplify.topology import TopologyReport
from tetsimplify.topology import topology as topology_of_arrays

with needs("trimesh"):
    import trimesh
    from trimesh.visual import ColorVisuals, TextureVisuals

Data: TypeAlias = dict[str, NDArray[Any]]

VISUAL = "visual."  # before the names of what is stored in ``mesh.visual``
MATERIAL = VISUAL + "face_materials"


def simplify(
    mesh: trimesh.Trimesh | trimesh.Scene, *, return_report: bool = False, **options: Any
) -> Any:
    """Contract edges until a criterion is reached, without changing the topology.

    Parameters
    ----------
    mesh : trimesh.Trimesh or trimesh.Scene
        Not changed. Vertices at texture seams, which trimesh holds twice, stay where they are.
        In a scene every mesh is simplified in its own coordinates, before the transforms of the
        nodes; all other geometry is copied.
    return_report : bool
        Return the :class:`tetsimplify.SimplificationReport` too; for a scene a dictionary of
        them under the names of the geometries.
    **options
        Those of :func:`tetsimplify.simplify`: `max_edge_length`, `keep_ratio`, `locked`, ...

    Returns
    -------
    trimesh.Trimesh or trimesh.Scene
        Made with ``process=False``. Visuals, `vertex_attributes`, `face_attributes`, `metadata`
        and units are those of `mesh`; normals are computed anew when asked for.
    report : optional

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold (``repair=True`` repairs it), or
        not a mesh.
    """
    if isinstance(mesh, trimesh.Scene):
        result, report = _simplify_scene(mesh, options)
    else:
        result, report = _simplify_mesh(mesh, options)
    return (result, report) if return_report else result


def topology(mesh: trimesh.Trimesh | trimesh.Scene) -> TopologyReport:
    """Tell the topology of a mesh, or of all meshes at the nodes of a scene together."""
    if not isinstance(mesh, trimesh.Scene):
        return topology_of_arrays(_checked(mesh).vertices, mesh.faces)
    vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), np.int64)]
    for node in mesh.graph.nodes_geometry:
        part = mesh.geometry[mesh.graph[node][1]]
        if isinstance(part, trimesh.Trimesh):
            faces.append(part.faces + sum(map(len, vertices)))
            vertices.append(part.vertices)
    return topology_of_arrays(np.concatenate(vertices), np.concatenate(faces))


def from_trimesh(mesh: trimesh.Trimesh) -> MeshArrays:
    """Take a mesh apart, without copying.

    Returns
    -------
    MeshArrays
        `vertex_data` and `face_data` hold the attributes with one entry for each vertex or face
        under their names, and those of the visuals as ``"visual.uv"``,
        ``"visual.vertex_colors"``, ``"visual.face_colors"``, ``"visual.face_materials"``.

    Examples
    --------
    >>> mesh = trimesh.creation.box()
    >>> mesh.face_attributes["side"] = np.arange(12)
    >>> list(from_trimesh(mesh).face_data)
    ['side']
    """
    n_vertices, n_faces = len(_checked(mesh).vertices), len(mesh.faces)
    of_vertices = _of_length(mesh.vertex_attributes, n_vertices)
    of_faces = _of_length(mesh.face_attributes, n_faces)
    visual = mesh.visual
    if isinstance(visual, TextureVisuals):
        stored = _of_length(dict(visual.vertex_attributes.items()), n_vertices)
        of_vertices |= {VISUAL + name: values for name, values in stored.items()}
        if visual.face_materials is not None and len(visual.face_materials) == n_faces:
            of_faces[MATERIAL] = np.asarray(visual.face_materials)
    elif kind := _colour_kind(visual):
        data = of_vertices if kind == "vertex" else of_faces
        data[f"{VISUAL}{kind}_colors"] = np.asarray(getattr(visual, f"{kind}_colors"))
    return MeshArrays(np.asarray(mesh.vertices), np.asarray(mesh.faces), of_vertices, of_faces)


def to_trimesh(
    vertices: ArrayLike,
    faces: ArrayLike,
    vertex_data: Data | None = None,
    face_data: Data | None = None,
    *,
    like: trimesh.Trimesh | None = None,
) -> trimesh.Trimesh:
    """Put a mesh together; the inverse of :func:`from_trimesh`.

    Parameters
    ----------
    vertices, faces, vertex_data, face_data
        As :func:`from_trimesh` returns them.
    like : trimesh.Trimesh, optional
        The mesh to take materials, metadata with units, density and all attributes from that
        do not belong to single vertices or faces.

    Returns
    -------
    trimesh.Trimesh
        Made with ``process=False``.
    """
    of_vertices, seen = _parted(vertex_data or {})
    of_faces, seen_faces = _parted(face_data or {})
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if like is not None:
        of_vertices |= _others(like.vertex_attributes, len(like.vertices))
        of_faces |= _others(like.face_attributes, len(like.faces))
        # raw elements of the file, kept by the loader, can be larger than the mesh
        private = {name: like.metadata[name] for name in like.metadata if name == "_ply_raw"}
        mesh.metadata = private | deepcopy(
            {name: value for name, value in like.metadata.items() if name not in private}
        )
        for name in ("density", "center_mass"):
            if name in like._data:
                mesh._data[name] = deepcopy(like._data[name])
    mesh.vertex_attributes.update(of_vertices)
    mesh.face_attributes.update(of_faces)
    mesh.visual = _visual(mesh, seen | seen_faces, None if like is None else like.visual)
    return mesh


def _simplify_mesh(mesh: trimesh.Trimesh, options: dict[str, Any]) -> tuple[Any, Any]:
    arrays = from_trimesh(mesh)
    wedges = {}
    if MATERIAL in arrays.face_data:  # borders of materials are seams
        wedges[MATERIAL] = np.repeat(arrays.face_data[MATERIAL][:, None], 3, axis=1)
    result = seams.simplify(
        arrays.vertices,
        arrays.faces,
        vertex_data=arrays.vertex_data,
        face_data=arrays.face_data,
        wedge_data=wedges,
        **options,
    )
    new = (result.vertices, result.faces, result.vertex_data, result.face_data)
    return to_trimesh(*new, like=mesh), result.report


def _simplify_scene(scene: trimesh.Scene, options: dict[str, Any]) -> tuple[Any, Any]:
    new = trimesh.Scene(
        graph=scene.graph.copy(),
        metadata=deepcopy(scene.metadata),
        camera=scene.camera.copy() if scene.has_camera else None,
        lights=deepcopy(getattr(scene, "_lights", None)),
    )
    reports = {}
    for name, part in scene.geometry.items():
        if isinstance(part, trimesh.Trimesh):
            new.geometry[name], reports[name] = _simplify_mesh(part, options)
        else:
            new.geometry[name] = part.copy()
    return new, reports


def _checked(mesh: Any) -> trimesh.Trimesh:
    if not isinstance(mesh, trimesh.Trimesh):
        raise MeshError(
            f"expected a trimesh.Trimesh or trimesh.Scene, got a trimesh.{type(mesh).__name__}"
        )
    return mesh


def _of_length(attributes: Any, n: int) -> Data:
    """The attributes with an entry for each vertex or face; others may be anything."""
    sized = {name: values for name, values in attributes.items() if hasattr(values, "__len__")}
    return {name: np.asarray(values) for name, values in sized.items() if len(values) == n > 0}


def _others(attributes: Any, n: int) -> dict[str, Any]:
    """The attributes that do not belong to single vertices or faces."""
    single = _of_length(attributes, n)
    return {name: deepcopy(attributes[name]) for name in attributes if name not in single}


def _colour_kind(visual: Any) -> str | None:
    """Where colours are stored: ``"vertex"``, ``"face"``, or nowhere."""
    if visual.kind is None:
        # default colours become stored ones when somebody has written to them
        for name in ("vertex_colors", "face_colors"):
            if name in visual._cache.cache:
                getattr(visual, name)
    kind: str | None = visual.kind
    return kind


def _parted(data: Data) -> tuple[Data, Data]:
    """Attributes of the mesh and of its visuals."""
    seen = {name.removeprefix(VISUAL): data[name] for name in data if name.startswith(VISUAL)}
    return {name: data[name] for name in data if not name.startswith(VISUAL)}, seen


def _visual(mesh: trimesh.Trimesh, data: Data, like: Any) -> Any:
    """The visuals of a new mesh."""
    if not isinstance(like, TextureVisuals) and "uv" not in data:
        colours = {name: data[name] for name in data if name.endswith("_colors")}
        return ColorVisuals(mesh, **colours)
    material = like.material.copy() if isinstance(like, TextureVisuals) else None
    visual = TextureVisuals(
        uv=data.pop("uv", None), material=material, face_materials=data.pop("face_materials", None)
    )
    visual.vertex_attributes.update(data)
    return visual


ADAPTER = Adapter("trimesh", simplify, topology)
