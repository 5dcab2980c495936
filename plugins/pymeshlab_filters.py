"""The filters of PyMeshLab that are made of tetsimplify, and their parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tetsimplify.plugins.pymeshlab_arrays import (
    CUSTOM,
    WEDGES,
    from_pymeshlab,
    in_rows,
    is_constant,
    with_ends,
)
from tetsimplify.plugins.pymeshlab_in_place import Selection, Writer, textures_of_faces

from tetsimplify import seams
from tetsimplify.adapters import needs
from tetsimplify.errors import MeshError, TetsimplifyError
from tetsimplify.isosurface import extract_isosurface
from tetsimplify.lattices import LATTICES
from tetsimplify.options import (
    BLOCKED,
    COSTS,
    CRITERIA,
    DEFAULT_FOLDOVER,
    GUARDS_OF_QUADRICS,
    INTERSECTIONS,
    OUTER,
    PLACEMENTS,
)
from tetsimplify.report import SimplificationReport

with needs("pymeshlab"):
    import pymeshlab
    from pymeshlab import InvalidEnumException, PercentageValue, PureValue, PyMeshLabException

SIMPLIFY = "meshing_decimation_topology_preserving_edge_collapse"
ISOSURFACE = "generate_isosurface_by_marching_tetrahedra"

DEFAULT_LENGTH = 1.0  # per cent of the diagonal, where nothing says what to stop at


class Parameter(NamedTuple):
    """A parameter of a filter."""

    kind: type
    """``int``, ``float``, ``bool``, ``str``, ``numpy.ndarray``, or ``PercentageValue`` for
    lengths, which may be given as ``PureValue`` too."""
    default: Any
    """None is "depends on the others", and is described by `note`."""
    option: str = ""
    """What the filter takes it as, mostly an option of the core. Without one it is fixed: known,
    as other filters have it, and refused with any other value than the default."""
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
        """The parameters that are not fixed."""
        return {name: each for name, each in self.parameters.items() if each.option}


def simplify_current_mesh(ms: pymeshlab.MeshSet, **parameters: Any) -> dict[str, Any]:
    """Contract edges of the current mesh in place, whatever its topology.

    This is the filter ``meshing_decimation_topology_preserving_edge_collapse`` as a function.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
        Its current mesh is changed in place and stays current under its id.
    targetfacenum : int
        So many faces are left; 0 is no target.
    targetperc : float
        The same as a part of the faces, from 0 to 1; goes before `targetfacenum` unless 0.
    maxedgelength : PercentageValue or PureValue
        Longer edges are left. Percentages are of the diagonal of the bounding box. When neither
        this nor a target nor an error is given, it is 1 %.
    maxerror, maxquadricerror : PercentageValue or PureValue
        `max_error` and `max_quadric_error` of :func:`tetsimplify.simplify`.
    qualitythr : float
        Triangles of worse shape are penalized, from 0 (none) to 1.
    preserveboundary : bool
        Boundaries stay the same curves.
    preservenormal : bool
        Faces keep within 90 degrees of the surface given.
    optimalplacement : bool
        New vertices go where the quadric error is least, or else where one end of the edge was.
    selected : bool
        Only selected faces change. By default where faces are selected, as in other filters.
    cost, blocked, placement, outer : str
        See :func:`tetsimplify.simplify`.
    featureangle : float
        Edges between faces whose normals differ by more are held, in degrees; 180 holds none.
    removallimit : PercentageValue or PureValue
        How far from its edge a contraction may remove vertices, 4 times `maxedgelength`, or the
        edge itself, if not given.
    foldover : float
        Largest change of a face normal in one contraction, in degrees; 180 is no limit.
    intersections : str
        See :func:`tetsimplify.simplify`.
    fit : bool
        Whether vertices are moved nearer to the surface given in the end; see
        :func:`tetsimplify.simplify`.
    customattributes : bool
        Interpolate the custom attributes of vertices too. Only for those that were made when the
        mesh was in the set: PyMeshLab dies of others.

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
    closed, regularise : bool
    refine : int
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
    writer = Writer(ms, expressions=options.pop("expressions"))
    given = from_pymeshlab(mesh, writer.custom, normals=False)
    wedges = {name: rows for name, rows in given.face_data.items() if name == WEDGES}
    if wedges and writer.is_held["f"]:
        raise PyMeshLabException(
            f"Failed to apply filter: {SIMPLIFY}\nDetails: PyMeshLab cannot write texture "
            "coordinates per wedge of a mesh that has custom attributes per face. Where these were "
            "made in this MeshSet, give customattributes=True."
        )
    if wedges and mesh.texture_number() > 1:
        wedges["texture"] = np.repeat(textures_of_faces(mesh)[:, None], 3, axis=1)

    selected = Selection(mesh.vertex_selection_array(), mesh.face_selection_array())
    ends = in_rows(mesh.edge_matrix())
    locked = np.zeros(len(given.vertices), np.bool_)
    locked[ends] = True
    if options.pop("selected"):
        locked[given.faces[~selected.faces]] = True
    if options["keep_ratio"] is not None:
        options["target_faces"] = None
    optimum = options.pop("optimum")
    if optimum is not None:
        options["placement"] = "quadric" if optimum else "endpoint"
    result = seams.simplify(
        given.vertices,
        given.faces,
        vertex_data={k: rows for k, rows in given.vertex_data.items() if _is_to_carry(k, rows)},
        # Faces stay those of PyMeshLab: with data of faces no edge is turned over.
        face_data={"face": np.arange(len(given.faces))},
        wedge_data=wedges,
        locked=locked,
        **options,
    )
    writer.replace(with_ends(result, given, ends), given, selected)
    return _figures(mesh, result.report)


def _is_to_carry(name: str, rows: NDArray[Any]) -> bool:
    """Whether values of vertices have to be interpolated, and can be written."""
    is_writable = not name.startswith(CUSTOM) or bool(np.isfinite(rows).all())
    return is_writable and not is_constant(rows)


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
        "stop": report.stop,
        "seconds": sum(report.seconds.values()),
    }


# --- parameters ------------------------------------------------------------------------------


def _unless(off: float) -> Callable[[Any], Any]:
    """None for the value that switches an option off."""
    return lambda value: None if value == off else value


def _guard(given: float | bool | None, value: float) -> float | str | None:
    """A guard as the core takes it: as it is by default, at a value, or off."""
    return "auto" if given is None else value if given else None


FILTERS = {
    SIMPLIFY: Filter(
        _simplify_in_place,
        {
            "targetfacenum": Parameter(int, 0, "target_faces", _unless(0)),
            "targetperc": Parameter(float, 0.0, "keep_ratio", _unless(0)),
            "maxedgelength": Parameter(
                PercentageValue, None, "max_edge_length", note="1% unless there is a target"
            ),
            "maxerror": Parameter(PercentageValue, None, "max_error", note="no limit"),
            "maxquadricerror": Parameter(
                PercentageValue, None, "max_quadric_error", note="no limit"
            ),
            "cost": Parameter(str, "auto", "cost", choices=COSTS),
            "qualitythr": Parameter(
                float,
                None,
                "shape",
                lambda value: _guard(value, value),
                note=f"{GUARDS_OF_QUADRICS['shape']:g} by quadric error, else 0",
            ),
            "preserveboundary": Parameter(
                bool, False, "boundary", lambda keep: "keep" if keep else "simplify"
            ),
            "boundaryweight": Parameter(float, 1.0),
            "preservenormal": Parameter(
                bool,
                None,
                "normal_deviation",
                lambda keep: _guard(keep, GUARDS_OF_QUADRICS["normal_deviation"]),
                note="True by quadric error, else False",
            ),
            "preservetopology": Parameter(bool, True),
            "optimalplacement": Parameter(bool, None, "optimum", note="as placement says"),
            "planarquadric": Parameter(bool, False),
            "planarweight": Parameter(float, 0.001),
            "qualityweight": Parameter(bool, False),
            "featureangle": Parameter(float, 180.0, "feature_angle", _unless(180)),
            "selected": Parameter(bool, None, "selected", note="whether faces are selected"),
            "blocked": Parameter(str, "contract", "blocked", choices=BLOCKED),
            "placement": Parameter(str, "auto", "placement", choices=("auto", *PLACEMENTS)),
            "removallimit": Parameter(
                PercentageValue, None, "removal_limit", note="4 * maxedgelength, or 4 * the edge"
            ),
            "outer": Parameter(str, "region", "outer", choices=OUTER),
            "foldover": Parameter(float, DEFAULT_FOLDOVER, "foldover", _unless(180)),
            "intersections": Parameter(str, "allow", "intersections", choices=INTERSECTIONS),
            "fit": Parameter(
                bool,
                None,
                "fit",
                lambda fit: "auto" if fit is None else bool(fit),
                note="True for a number of faces by quadric error, else False",
            ),
            "customattributes": Parameter(bool, False, "expressions"),
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
            "refine": Parameter(int, 1, "refine"),
            "regularise": Parameter(bool, False, "regularise"),
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
    """All parameters of a filter that are not fixed, checked, with the defaults filled in.

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
        if key not in live and _cast(key, parameters[key], given[key]) != parameters[key].default:
            raise PyMeshLabException(
                f"Parameter {key} of filter {name} can only be {parameters[key].default}."
            )
    values = {key: each.default for key, each in live.items()}
    values |= {key: _cast(key, live[key], given[key]) for key in given if key in live}
    criteria = [key for key, each in live.items() if each.option in CRITERIA]
    if criteria and not any(values[key] for key in criteria):
        values["maxedgelength"] = PercentageValue(DEFAULT_LENGTH)
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
