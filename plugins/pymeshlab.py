"""PyMeshLab: filters of every ``pymeshlab.MeshSet``, and ``pymeshlab.Mesh`` in and out.

Importing this module adds two filters to those of PyMeshLab, where they are called and listed
as the others: ``meshing_decimation_topology_preserving_edge_collapse`` and
``generate_isosurface_by_marching_tetrahedra``. :func:`remove_filters` takes them out again; the
functions of this module work without them.

Examples
--------
>>> import pymeshlab
>>> import tetsimplify.plugins.pymeshlab
>>> ms = pymeshlab.MeshSet()
>>> ms.create_sphere(subdiv=5)
>>> figures = ms.meshing_decimation_topology_preserving_edge_collapse(
...     maxedgelength=pymeshlab.PercentageValue(3)
... )
>>> figures["genus"], ms.get_topological_measures()["genus"]
(0, 0)
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from tetsimplify.plugins.pymeshlab_in_place import (
    Selection,
    Writer,
    apply_filter,
    filter_parameter_values,
    levels,
    textures_of_faces,
)

from tetsimplify import seams
from tetsimplify.adapters import Adapter, MeshArrays, needs
from tetsimplify.errors import MeshError, TetsimplifyError
from tetsimplify.isosurface import extract_isosurface
from tetsimplify.lattices import LATTICES
from tetsimplify.options import BLOCKED, DEFAULT_FOLDOVER, OUTER, PLACEMENTS
from tetsimplify.report import SimplificationReport
from tetsimplify.topology import TopologyReport
from tetsimplify.topology import topology as topology_of_arrays

with needs("pymeshlab"):
    import pymeshlab
    from pymeshlab import InvalidEnumException, PercentageValue, PureValue, PyMeshLabException

Data = dict[str, NDArray[Any]]

CUSTOM = "custom."  # before the names of custom attributes: (n,) are scalar, (n, 3) point ones
WEDGES = "wedge_tex_coord"  # among the face data, shape (m, 3, 2)

SIMPLIFY = "meshing_decimation_topology_preserving_edge_collapse"
ISOSURFACE = "generate_isosurface_by_marching_tetrahedra"


# --- meshes ----------------------------------------------------------------------------------


def simplify(
    mesh: pymeshlab.Mesh,
    *,
    custom_attributes: Collection[str] = (),
    return_report: bool = False,
    **options: Any,
) -> Any:
    """Contract every edge shorter than `max_edge_length` without changing the topology.

    Parameters
    ----------
    mesh : pymeshlab.Mesh
        Not changed.
    custom_attributes : collection of str
        Names of the custom attributes to be carried; a mesh does not tell which it has.
    return_report : bool
        Return the :class:`tetsimplify.SimplificationReport` too.
    **options
        Those of :func:`tetsimplify.simplify`: `max_edge_length`, `placement`, `locked`, ...

    Returns
    -------
    pymeshlab.Mesh
        A new mesh with the label, colours, scalars and texture coordinates of `mesh` and with
        normals of its own. Texture images, transform and selection stay with meshes in a
        ``MeshSet``, since PyMeshLab has no way to write them; the filter keeps them.
    report : optional

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold (``repair=True`` repairs it).
    """
    arrays = from_pymeshlab(mesh, custom_attributes, normals=False)
    vertex_data = arrays.vertex_data
    # what is the same everywhere, as colours that nobody has set, needs no interpolation
    same = {name: rows[0] for name, rows in vertex_data.items() if _is_constant(rows)}
    wedges = {name: rows for name, rows in arrays.face_data.items() if name == WEDGES}
    result = seams.simplify(
        arrays.vertices,
        arrays.faces,
        vertex_data={name: rows for name, rows in vertex_data.items() if name not in same},
        face_data={name: rows for name, rows in arrays.face_data.items() if name != WEDGES},
        wedge_data=wedges,
        **options,
    )
    n_vertices = len(result.vertices)
    of_vertices = result.vertex_data | {
        name: np.broadcast_to(row, (n_vertices, *row.shape)) for name, row in same.items()
    }
    of_faces = result.face_data | result.wedge_data
    new = to_pymeshlab(result.vertices, result.faces, of_vertices, of_faces, like=mesh)
    return (new, result.report) if return_report else new


def topology(mesh: pymeshlab.Mesh) -> TopologyReport:
    """Tell the topology of a mesh."""
    with _compact(mesh) as compact:
        return topology_of_arrays(compact.vertex_matrix(), compact.face_matrix())


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
    with _compact(mesh) as compact:
        return _arrays(compact, custom_attributes, normals)


def to_pymeshlab(
    vertices: ArrayLike,
    faces: ArrayLike,
    vertex_data: Data | None = None,
    face_data: Data | None = None,
    *,
    like: pymeshlab.Mesh | None = None,
) -> pymeshlab.Mesh:
    """Put a mesh together; the inverse of :func:`from_pymeshlab`.

    Parameters
    ----------
    vertices, faces, vertex_data, face_data
        As :func:`from_pymeshlab` returns them.
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
    mesh = pymeshlab.Mesh(np.asarray(vertices), np.asarray(faces), **arguments)
    for kind, name, values in custom:
        shape = "scalar" if values.ndim == 1 else "point"
        getattr(mesh, f"add_{kind}_custom_{shape}_attribute")(values, name)
    if like is not None:
        mesh.set_label(like.label())
    return mesh


_ARGUMENTS = {
    "normal": "normals_matrix",
    "color": "color_matrix",
    "scalar": "scalar_array",
    "tex_coord": "tex_coords_matrix",
}


def _arrays(mesh: pymeshlab.Mesh, custom_attributes: Collection[str], normals: bool) -> MeshArrays:
    of_vertices: Data = {}
    of_faces: Data = {}
    if normals:
        of_vertices["normal"] = _c(mesh.vertex_normal_matrix())
        of_faces["normal"] = _c(mesh.face_normal_matrix())
    for kind, data in (("vertex", of_vertices), ("face", of_faces)):
        if getattr(mesh, f"has_{kind}_color")():
            data["color"] = _colors(mesh, kind)
        if getattr(mesh, f"has_{kind}_scalar")():
            data["scalar"] = getattr(mesh, f"{kind}_scalar_array")()
    if mesh.has_vertex_tex_coord():
        of_vertices["tex_coord"] = _c(mesh.vertex_tex_coord_matrix())
    if mesh.has_wedge_tex_coord():
        of_faces[WEDGES] = _c(mesh.wedge_tex_coord_matrix()).reshape(-1, 3, 2)
    for name in custom_attributes:
        found = [
            (data, _custom(mesh, kind, shape, name))
            for kind, data in (("vertex", of_vertices), ("face", of_faces))
            for shape in ("scalar_attribute_array", "point_attribute_matrix")
        ]
        if all(values is None for _, values in found):
            raise PyMeshLabException(f"No custom attribute found with name {name}.")
        for data, values in found:
            if values is not None:
                data[CUSTOM + name] = values
    return MeshArrays(_c(mesh.vertex_matrix()), _c(mesh.face_matrix()), of_vertices, of_faces)


def _colors(mesh: pymeshlab.Mesh, kind: str) -> NDArray[np.float64]:
    """Colours, of little memory and in little time where nobody has set any."""
    packed = getattr(mesh, f"{kind}_color_array")()
    if len(packed) and (packed == packed[0]).all():
        levels_of_one = int(packed[0]) >> np.array([16, 8, 0, 24]) & 255  # 0xAARRGGBB
        return np.broadcast_to(levels_of_one / 255, (len(packed), 4))
    return _c(getattr(mesh, f"{kind}_color_matrix")())


@contextmanager
def _compact(mesh: Any) -> Iterator[pymeshlab.Mesh]:
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


def _custom(mesh: pymeshlab.Mesh, kind: str, shape: str, name: str) -> NDArray[Any] | None:
    """The values of a custom attribute, None where there is none of this kind and shape."""
    try:
        return _c(getattr(mesh, f"{kind}_custom_{shape}")(name))
    except PyMeshLabException:
        return None


def _c(array: NDArray[Any]) -> NDArray[Any]:
    """PyMeshLab's matrices are in Fortran order."""
    return np.ascontiguousarray(array)


def _is_constant(rows: NDArray[Any]) -> bool:
    return len(rows) > 0 and (rows.strides[0] == 0 or bool((rows == rows[0]).all()))


# --- filters ---------------------------------------------------------------------------------


class Parameter(NamedTuple):
    """A parameter of a filter."""

    kind: type
    """``int``, ``float``, ``bool``, ``str``, ``numpy.ndarray``, or ``PercentageValue`` for
    lengths, which may be given as ``PureValue`` too."""
    default: Any
    """None is "depends on the others", and is described by `note`."""
    note: str = ""
    choices: tuple[str, ...] = ()


class Filter(NamedTuple):
    """A filter as PyMeshLab has them."""

    run: Callable[..., dict[str, Any]]
    parameters: dict[str, Parameter]
    pending: tuple[str, ...] = ()
    """Parameters that are known, and refused until what they ask for exists."""


def simplify_current_mesh(ms: pymeshlab.MeshSet, **parameters: Any) -> dict[str, Any]:
    """Contract every short edge of the current mesh in place, whatever its topology.

    This is the filter ``meshing_decimation_topology_preserving_edge_collapse`` as a function.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
        Its current mesh is changed in place and stays current under its id.
    maxedgelength : PercentageValue or PureValue
        Shorter edges are contracted. Percentages are of the diagonal of the bounding box.
    preserveboundary : bool
        Vertices on the boundary stay where they are.
    selected : bool
        Only selected faces change. By default where faces are selected, as in other filters.
    blocked, placement, outer : str
        See :func:`tetsimplify.simplify`.
    removallimit : PercentageValue or PureValue
        How far from its edge a contraction may remove vertices, 4 times `maxedgelength` if not
        given.
    foldover : float
        Largest change of a face normal in one contraction, in degrees; 180 is no limit.

    Returns
    -------
    dict
        Figures, named as those of ``get_topological_measures`` where these exist.

    Raises
    ------
    PyMeshLabException
        When a parameter is unknown or has the wrong type, when there is no mesh, no face, or the
        mesh is no oriented 2-manifold.
    """
    return _run(ms, SIMPLIFY, parameters)


def isosurface_to_new_mesh(ms: pymeshlab.MeshSet, **parameters: Any) -> dict[str, Any]:
    """Extract an isosurface by marching tetrahedra to a new mesh, which becomes current.

    This is the filter ``generate_isosurface_by_marching_tetrahedra`` as a function.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
        May be empty.
    volume : ndarray, shape (n0, n1, n2)
        Samples.
    isovalue : float
        The level of the surface.
    spacing, origin : ndarray, shape (3,)
    lattice, normals : str
    closed : bool
        See :func:`tetsimplify.extract_isosurface`.
    meshname : str
        Label of the new mesh.

    Returns
    -------
    dict
        The numbers of vertices and faces.

    Raises
    ------
    PyMeshLabException
        When a parameter is unknown or wrong.
    """
    return _run(ms, ISOSURFACE, parameters)


def _simplify_in_place(ms: pymeshlab.MeshSet, given: dict[str, Any]) -> dict[str, Any]:
    mesh = ms.current_mesh()
    if not mesh.face_number():
        raise PyMeshLabException(
            f"Failed to apply filter:  '{SIMPLIFY}. Current mesh does not have Any Faces."
        )
    if mesh.edge_number():
        raise PyMeshLabException("the current mesh has polyline edges beside its faces")
    mesh.compact()
    arrays = _arrays(mesh, (), normals=False)
    writer = Writer(ms)
    wedges = {name: rows for name, rows in arrays.face_data.items() if name == WEDGES}
    if wedges and writer.has_attributes["f"]:
        raise PyMeshLabException(
            f"Failed to apply filter: {SIMPLIFY}\nDetails: PyMeshLab cannot write texture "
            "coordinates per wedge of a mesh that has custom attributes per face."
        )
    if wedges and mesh.texture_number() > 1:
        wedges["texture"] = np.repeat(textures_of_faces(mesh)[:, None], 3, axis=1)

    selected = Selection(mesh.vertex_selection_array(), mesh.face_selection_array())
    locked = np.zeros(len(arrays.vertices), np.bool_)
    if given["selected"]:
        locked[arrays.faces[~selected.faces]] = True
    if given["preserveboundary"]:
        locked[_boundary_vertices(arrays.faces)] = True
    limit = given["removallimit"]
    result = seams.simplify(
        arrays.vertices,
        arrays.faces,
        vertex_data={k: rows for k, rows in arrays.vertex_data.items() if not _is_constant(rows)},
        wedge_data=wedges,
        locked=locked,
        max_edge_length=_length(mesh, given["maxedgelength"]),
        blocked=given["blocked"],
        placement=given["placement"],
        outer=given["outer"],
        removal_limit=None if limit is None else _length(mesh, limit),
        foldover=None if given["foldover"] >= 180 else given["foldover"],
    )
    writer.replace(result, arrays, selected)
    return _figures(result.report)


def _extract_to_new_mesh(ms: pymeshlab.MeshSet, given: dict[str, Any]) -> dict[str, Any]:
    label = given.pop("meshname")
    volume, level = given.pop("volume"), given.pop("isovalue")
    mesh = extract_isosurface(volume, level, **given)
    ms.add_mesh(pymeshlab.Mesh(*mesh), label)
    return {"vertices_number": len(mesh.vertices), "faces_number": len(mesh.faces)}


def _figures(report: SimplificationReport) -> dict[str, Any]:
    after = report.topology_after
    return {
        "vertices_number": after.n_vertices,
        "edges_number": after.n_edges,
        "faces_number": after.n_faces,
        "faces_number_before": report.topology_before.n_faces,
        "connected_components_number": after.n_components,
        "boundary_edges": after.n_boundary_edges,
        "number_holes": after.n_boundary_loops,
        "genus": after.genus,
        "contractions_number": report.n_contractions,
        "nested_contractions_number": report.n_nested,
        "shortest_edge_before": report.shortest_edge_before,
        "shortest_edge": report.shortest_edge_after,
        "remaining_short_edges": report.remaining,
        "seconds": sum(report.seconds.values()),
    }


def _boundary_vertices(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Vertices of edges that have one face."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    key = ends.min(axis=1).astype(np.int64) << 32 | ends.max(axis=1)
    _, first, counts = np.unique(key, return_index=True, return_counts=True)
    vertices: NDArray[np.int32] = np.unique(ends[first[counts == 1]])
    return vertices


def _length(mesh: pymeshlab.Mesh, value: PercentageValue | PureValue) -> float:
    """A length in the units of the mesh."""
    if isinstance(value, PercentageValue):
        return float(mesh.bounding_box().diagonal() * value.value() / 100)
    return float(value.value())


# --- parameters ------------------------------------------------------------------------------

FILTERS = {
    SIMPLIFY: Filter(
        _simplify_in_place,
        {
            "maxedgelength": Parameter(PercentageValue, PercentageValue(1)),
            "targetfacenum": Parameter(int, 0),
            "targetperc": Parameter(float, 0.0),
            "qualitythr": Parameter(float, 0.3),
            "preserveboundary": Parameter(bool, False),
            "boundaryweight": Parameter(float, 1.0),
            "preservenormal": Parameter(bool, False),
            "optimalplacement": Parameter(bool, True),
            "planarquadric": Parameter(bool, False),
            "planarweight": Parameter(float, 0.001),
            "qualityweight": Parameter(bool, False),
            "selected": Parameter(bool, None, "whether faces are selected"),
            "blocked": Parameter(str, "contract", choices=BLOCKED),
            "placement": Parameter(str, "midpoint", choices=tuple(PLACEMENTS)),
            "removallimit": Parameter(PercentageValue, None, "4 * maxedgelength"),
            "outer": Parameter(str, "region", choices=OUTER),
            "foldover": Parameter(float, DEFAULT_FOLDOVER),
        },
        pending=(
            "targetfacenum",
            "targetperc",
            "qualitythr",
            "boundaryweight",
            "preservenormal",
            "optimalplacement",
            "planarquadric",
            "planarweight",
            "qualityweight",
        ),
    ),
    ISOSURFACE: Filter(
        _extract_to_new_mesh,
        {
            "volume": Parameter(np.ndarray, None, "to be given"),
            "isovalue": Parameter(float, 0.0),
            "spacing": Parameter(np.ndarray, np.ones(3)),
            "origin": Parameter(np.ndarray, np.zeros(3)),
            "lattice": Parameter(str, "kuhn", choices=tuple(LATTICES)),
            "closed": Parameter(bool, False),
            "normals": Parameter(str, "lower", choices=("lower", "higher")),
            "meshname": Parameter(str, "Isosurface"),
        },
    ),
}

_CASTS: dict[type, tuple[type, ...]] = {
    int: (int, np.integer, np.bool_),
    float: (int, float, np.integer, np.floating, np.bool_),
    bool: (int, np.integer, np.bool_),
    str: (str,),
}


def _run(ms: pymeshlab.MeshSet, name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Apply one of our filters."""
    values = _checked(ms, name, given)
    try:
        return FILTERS[name].run(ms, values)
    except TetsimplifyError as error:
        advice = ""
        if name == SIMPLIFY and isinstance(error, MeshError):
            advice = (
                "\nFilters that may help: meshing_remove_duplicate_faces, "
                "meshing_repair_non_manifold_edges, meshing_repair_non_manifold_vertices, "
                "meshing_re_orient_faces_coherently."
            )
        raise PyMeshLabException(
            f"Failed to apply filter: {name}\nDetails: {error}{advice}"
        ) from error


def _checked(ms: pymeshlab.MeshSet, name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """All parameters of a filter that exist, checked, with the defaults filled in."""
    parameters, pending = FILTERS[name].parameters, FILTERS[name].pending
    if name == SIMPLIFY and not ms.mesh_number():
        raise PyMeshLabException(f"{name} requires at least one mesh loaded in the MeshSet.")
    for key in given:
        if key not in parameters:
            raise PyMeshLabException(
                f"Parameter {key} not found for filter {name}. Please check the documentation."
            )
        if key in pending:
            raise PyMeshLabException(
                f"Parameter {key} of filter {name} comes with the quadric mode, which this "
                "version does not have yet: give maxedgelength."
            )
    values = {key: p.default for key, p in parameters.items() if key not in pending}
    values |= {key: _cast(key, parameters[key], value) for key, value in given.items()}
    if "selected" in values and values["selected"] is None:
        values["selected"] = ms.current_mesh().selected_face_number() > 0
    if name == ISOSURFACE and values["volume"] is None:
        raise PyMeshLabException(f"Parameter volume of filter {name} must be given.")
    return values


def _cast(name: str, parameter: Parameter, value: Any) -> Any:
    """A value as a parameter wants it, or the error that PyMeshLab users know."""
    kind = parameter.kind
    if kind is PercentageValue:
        if not isinstance(value, (PercentageValue, PureValue)):
            raise PyMeshLabException(
                f"Parameter {name}: must be a pymeshlab.Percentage object or a"
                "pymeshlab.AbsoluteValue object. Other type values are not accepted."
            )
        return value
    if kind is np.ndarray:
        return value  # the core checks arrays
    if not isinstance(value, _CASTS[kind]):
        raise PyMeshLabException(
            f"Parameter {name}: must be of type {kind.__name__}, got {value!r}."
        )
    if parameter.choices and value not in parameter.choices:
        listed = "".join(f"{choice!r}; " for choice in parameter.choices)
        raise InvalidEnumException(f"Enum '{value}' not found. Possible values are {listed}")
    return kind(value)


# --- at home in PyMeshLab --------------------------------------------------------------------

_native: dict[str, Callable[..., Any]] = {
    "apply_filter": apply_filter,
    "filter_parameter_values": filter_parameter_values,
    "filter_list": pymeshlab.filter_list,
    "print_filter_list": pymeshlab.print_filter_list,
    "print_filter_parameter_list": pymeshlab.print_filter_parameter_list,
    "search": pymeshlab.search,
}


def add_filters() -> None:
    """Add the filters to every ``MeshSet``, and to the lists of filters and parameters."""
    pymeshlab.MeshSet.apply_filter = _apply_filter
    pymeshlab.MeshSet.filter_parameter_values = _filter_parameter_values
    for name in FILTERS:
        setattr(pymeshlab.MeshSet, name, pymeshlab.bind_function(name))
    for function in (_filter_list, _print_filter_list, _print_filter_parameter_list, _search):
        setattr(pymeshlab, function.__name__, function)


def remove_filters() -> None:
    """Leave PyMeshLab as it was before :func:`add_filters`."""
    pymeshlab.MeshSet.apply_filter = _native["apply_filter"]
    pymeshlab.MeshSet.filter_parameter_values = _native["filter_parameter_values"]
    for name in FILTERS:
        if hasattr(pymeshlab.MeshSet, name):
            delattr(pymeshlab.MeshSet, name)
    for name in ("filter_list", "print_filter_list", "print_filter_parameter_list", "search"):
        setattr(pymeshlab, name, _native[name])


@wraps(_native["apply_filter"])
def _apply_filter(self: pymeshlab.MeshSet, *args: Any, **parameters: Any) -> dict[str, Any]:
    name = args[0] if args else parameters.get("filter_name")
    if name in FILTERS and len(args) < 2:
        parameters.pop("filter_name", None)
        return _run(self, name, parameters)
    result: dict[str, Any] = _native["apply_filter"](self, *args, **parameters)
    return result


@wraps(_native["filter_parameter_values"])
def _filter_parameter_values(self: pymeshlab.MeshSet, name: str, **given: Any) -> dict[str, Any]:
    if name not in FILTERS:
        native: dict[str, Any] = _native["filter_parameter_values"](self, name, **given)
        return native
    values = _checked(self, name, {"volume": (), **given} if name == ISOSURFACE else given)
    if name == SIMPLIFY:
        mesh = self.current_mesh()
        length = _length(mesh, values["maxedgelength"])
        limit = values["removallimit"]
        values["maxedgelength"] = length
        values["removallimit"] = 4 * length if limit is None else _length(mesh, limit)
    return values


@wraps(_native["filter_list"])
def _filter_list() -> list[str]:
    return sorted([*_native["filter_list"](), *FILTERS])


@wraps(_native["print_filter_list"])
def _print_filter_list() -> None:
    _native["print_filter_list"]()
    print(*FILTERS, sep="\n")


@wraps(_native["print_filter_parameter_list"])
def _print_filter_parameter_list(filter_name: str) -> None:
    if filter_name not in FILTERS:
        _native["print_filter_parameter_list"](filter_name)
        return
    print(f"{filter_name} filter - list of parameter names:")
    for name, parameter in FILTERS[filter_name].parameters.items():
        if name not in FILTERS[filter_name].pending:
            print(f"\t{name} : {_described(parameter)}")


def _described(parameter: Parameter) -> str:
    """The type and the default of a parameter, as PyMeshLab prints them."""
    default = parameter.default
    text = repr(default) if isinstance(default, str) else str(default)
    if isinstance(default, PercentageValue):
        text = f"{default.value():g}%"
    elif isinstance(default, float):
        text = f"{default:g}"
    elif default is None:
        text = parameter.note
    choices = f" [{', '.join(map(repr, parameter.choices))}]" if parameter.choices else ""
    kind = "numpy.ndarray" if parameter.kind is np.ndarray else parameter.kind.__name__
    return f"{kind} = {text}{choices}"


@wraps(_native["search"])
def _search(keyword: str) -> None:
    _native["search"](keyword)
    print(*(name for name in FILTERS if keyword in name), sep="\n")


add_filters()

ADAPTER = Adapter("pymeshlab", simplify, topology)
