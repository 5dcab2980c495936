"""The filters of PyMeshLab that are made of tetsimplify, and their parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tetsimplify.plugins.pymeshlab_arrays import (
    WEDGES,
    from_pymeshlab,
    in_rows,
    is_constant,
    with_ends,
)
from tetsimplify.plugins.pymeshlab_in_place import Selection, Writer, textures_of_faces

from tetsimplify import kernels, seams
from tetsimplify.adapters import needs
from tetsimplify.errors import MeshError, TetsimplifyError
from tetsimplify.isosurface import extract_isosurface
from tetsimplify.lattices import LATTICES
from tetsimplify.options import BLOCKED, DEFAULT_FOLDOVER, OUTER, PLACEMENTS
from tetsimplify.report import SimplificationReport
from tetsimplify.topology import analyse

with needs("pymeshlab"):
    import pymeshlab
    from pymeshlab import InvalidEnumException, PercentageValue, PureValue, PyMeshLabException

SIMPLIFY = "meshing_decimation_topology_preserving_edge_collapse"
ISOSURFACE = "generate_isosurface_by_marching_tetrahedra"


class Parameter(NamedTuple):
    """A parameter of a filter."""

    kind: type
    """``int``, ``float``, ``bool``, ``str``, ``numpy.ndarray``, or ``PercentageValue`` for
    lengths, which may be given as ``PureValue`` too."""
    default: Any
    """None is "depends on the others", and is described by `note`."""
    option: str = ""
    """What the filter takes it as, mostly an option of the core. Without one it is pending:
    known, and refused until what it asks for exists."""
    as_option: Callable[[Any], Any] = lambda value: value
    """The value of the option, of that of the parameter; lengths are in units of the mesh."""
    note: str = ""
    choices: tuple[str, ...] = ()


class Filter(NamedTuple):
    """A filter as PyMeshLab has them."""

    run: Callable[[pymeshlab.MeshSet, dict[str, Any]], dict[str, Any]]
    """``run(ms, options)``, the options under their names; gives figures."""
    parameters: dict[str, Parameter]

    @property
    def live(self) -> dict[str, Parameter]:
        """The parameters that are not pending."""
        return {name: each for name, each in self.parameters.items() if each.option}


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
    return apply(ms, SIMPLIFY, parameters)


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
    return apply(ms, ISOSURFACE, parameters)


def _simplify_in_place(ms: pymeshlab.MeshSet, options: dict[str, Any]) -> dict[str, Any]:
    mesh = ms.current_mesh()
    if not mesh.face_number():
        raise PyMeshLabException(
            f"Failed to apply filter:  '{SIMPLIFY}. Current mesh does not have Any Faces."
        )
    mesh.compact()
    given = from_pymeshlab(mesh, normals=False)
    writer = Writer(ms)
    wedges = {name: rows for name, rows in given.face_data.items() if name == WEDGES}
    if wedges and writer.has_attributes["f"]:
        raise PyMeshLabException(
            f"Failed to apply filter: {SIMPLIFY}\nDetails: PyMeshLab cannot write texture "
            "coordinates per wedge of a mesh that has custom attributes per face."
        )
    if wedges and mesh.texture_number() > 1:
        wedges["texture"] = np.repeat(textures_of_faces(mesh)[:, None], 3, axis=1)

    selected = Selection(mesh.vertex_selection_array(), mesh.face_selection_array())
    ends = in_rows(mesh.edge_matrix())
    locked = np.zeros(len(given.vertices), np.bool_)
    locked[ends] = True
    if options.pop("selected"):
        locked[given.faces[~selected.faces]] = True
    if options.pop("preserveboundary"):
        locked |= _on_boundary(given.faces, len(locked))
    result = seams.simplify(
        given.vertices,
        given.faces,
        vertex_data={k: rows for k, rows in given.vertex_data.items() if not is_constant(rows)},
        wedge_data=wedges,
        locked=locked,
        **options,
    )
    writer.replace(with_ends(result, given, ends), given, selected)
    return _figures(mesh, result.report)


def _extract_to_new_mesh(ms: pymeshlab.MeshSet, options: dict[str, Any]) -> dict[str, Any]:
    label = options.pop("label")
    mesh = extract_isosurface(**options)
    ms.add_mesh(pymeshlab.Mesh(*mesh), label)
    return {"vertices_number": len(mesh.vertices), "faces_number": len(mesh.faces)}


def _figures(mesh: pymeshlab.Mesh, report: SimplificationReport) -> dict[str, Any]:
    after = report.topology_after
    return {
        "vertices_number": mesh.vertex_number(),
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


def _on_boundary(faces: NDArray[np.int32], n_vertices: int) -> NDArray[np.bool_]:
    """Which vertices are on the boundary."""
    corner_vertex = faces.reshape(-1)
    corners = kernels.corners.link_corners(corner_vertex, n_vertices)
    loop = analyse(corner_vertex, *corners)[1]
    return loop >= 0


# --- parameters ------------------------------------------------------------------------------

FILTERS = {
    SIMPLIFY: Filter(
        _simplify_in_place,
        {
            "maxedgelength": Parameter(PercentageValue, PercentageValue(1), "max_edge_length"),
            "targetfacenum": Parameter(int, 0),
            "targetperc": Parameter(float, 0.0),
            "qualitythr": Parameter(float, 0.3),
            "preserveboundary": Parameter(bool, False, "preserveboundary"),
            "boundaryweight": Parameter(float, 1.0),
            "preservenormal": Parameter(bool, False),
            "optimalplacement": Parameter(bool, True),
            "planarquadric": Parameter(bool, False),
            "planarweight": Parameter(float, 0.001),
            "qualityweight": Parameter(bool, False),
            "selected": Parameter(bool, None, "selected", note="whether faces are selected"),
            "blocked": Parameter(str, "contract", "blocked", choices=BLOCKED),
            "placement": Parameter(str, "midpoint", "placement", choices=tuple(PLACEMENTS)),
            "removallimit": Parameter(
                PercentageValue, None, "removal_limit", note="4 * maxedgelength"
            ),
            "outer": Parameter(str, "region", "outer", choices=OUTER),
            "foldover": Parameter(
                float, DEFAULT_FOLDOVER, "foldover", lambda angle: None if angle >= 180 else angle
            ),
        },
    ),
    ISOSURFACE: Filter(
        _extract_to_new_mesh,
        {
            "volume": Parameter(np.ndarray, None, "volume", note="to be given"),
            "isovalue": Parameter(float, 0.0, "level"),
            "spacing": Parameter(np.ndarray, np.ones(3), "spacing"),
            "origin": Parameter(np.ndarray, np.zeros(3), "origin"),
            "lattice": Parameter(str, "kuhn", "lattice", choices=tuple(LATTICES)),
            "closed": Parameter(bool, False, "closed"),
            "normals": Parameter(str, "lower", "normals", choices=("lower", "higher")),
            "meshname": Parameter(str, "Isosurface", "label"),
        },
    ),
}

_CASTS: dict[type, tuple[type, ...]] = {
    int: (int, np.integer, np.bool_),
    float: (int, float, np.integer, np.floating, np.bool_),
    bool: (int, np.integer, np.bool_),
    str: (str,),
}


def apply(ms: pymeshlab.MeshSet, name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Apply one of our filters."""
    values = checked(ms, name, given)
    live = FILTERS[name].live.items()
    options = {each.option: each.as_option(values[key]) for key, each in live}
    try:
        return FILTERS[name].run(ms, options)
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


def checked(ms: pymeshlab.MeshSet, name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """All parameters of a filter that are not pending, checked, with the defaults filled in.

    Lengths are in units of the current mesh.
    """
    parameters, live = FILTERS[name].parameters, FILTERS[name].live
    if name == SIMPLIFY and not ms.mesh_number():
        raise PyMeshLabException(f"{name} requires at least one mesh loaded in the MeshSet.")
    for key in given:
        if key not in parameters:
            raise PyMeshLabException(
                f"Parameter {key} not found for filter {name}. Please check the documentation."
            )
        if key not in live:
            raise PyMeshLabException(
                f"Parameter {key} of filter {name} comes with the quadric mode, which this "
                "version does not have yet: give maxedgelength."
            )
    values = {key: each.default for key, each in live.items()}
    values |= {key: _cast(key, live[key], value) for key, value in given.items()}
    if "selected" in values and values["selected"] is None:
        values["selected"] = ms.current_mesh().selected_face_number() > 0
    if name == ISOSURFACE and values["volume"] is None:
        raise PyMeshLabException(f"Parameter volume of filter {name} must be given.")
    return {
        key: _length(ms, value) if live[key].kind is PercentageValue else value
        for key, value in values.items()
    }


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


def _length(ms: pymeshlab.MeshSet, value: PercentageValue | PureValue | None) -> float | None:
    """A length in units of the current mesh."""
    if value is None:
        return None
    if isinstance(value, PercentageValue):
        return float(ms.current_mesh().bounding_box().diagonal() * value.value() / 100)
    return float(value.value())
