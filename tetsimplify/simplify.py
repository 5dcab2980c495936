"""Topology-preserving simplification by edge contraction (Pepko and Borisenko 2023)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import ArrayLike

from tetsimplify import adapters
from tetsimplify.arrays import as_data, as_mesh, as_vertex_mask
from tetsimplify.contract import Clock, after_repair, contract
from tetsimplify.engine import Engine
from tetsimplify.mesh import Mesh
from tetsimplify.options import DEFAULT_FOLDOVER, Options, Progress
from tetsimplify.repair import repair as repair_mesh
from tetsimplify.report import Simplification
from tetsimplify.seams import simplify as simplify_with_seams


def simplify(
    vertices: Any,
    faces: ArrayLike | None = None,
    *,
    max_edge_length: float | None = None,
    target_faces: int | None = None,
    keep_ratio: float | None = None,
    max_error: float | None = None,
    max_quadric_error: float | None = None,
    cost: str = "auto",
    placement: str = "auto",
    blocked: str = "contract",
    removal_limit: float | None = None,
    outer: str = "region",
    boundary: str = "simplify",
    feature_angle: float | None = None,
    foldover: float | None = DEFAULT_FOLDOVER,
    normal_deviation: float | str | None = "auto",
    shape: float | str | None = "auto",
    intersections: str = "allow",
    fit: bool | str = "auto",
    locked: ArrayLike | None = None,
    seams: ArrayLike | str | Sequence[str] | None = None,
    repair: bool = False,
    vertex_data: Mapping[str, ArrayLike] | None = None,
    face_data: Mapping[str, ArrayLike] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Simplification:
    """Contract edges without changing the topology.

    Every edge that is shorter than `max_edge_length`, or the edges that cost least until so many
    faces are left or so much error is made. Where the ends of an edge have more common neighbours
    than the apexes of its two faces, the inside of the nested 3-cycles is removed with the edge.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions, finite. Or, without faces, a mesh object of a package that an adapter is
        installed for: pymeshlab, Open3D, trimesh, PyVista; see :mod:`tetsimplify.adapters`.
    faces : array_like, shape (m, 3), integers
        A consistently oriented 2-manifold, with or without boundary, of any genus and any
        number of components.
    max_edge_length : float, optional
        Longer edges are left; in the units of the vertices. At least one of the criteria has to
        be given: this one or one of the next four. The first that is reached stops.
    target_faces : int, optional
        So many faces are left, or one or two more.
    keep_ratio : float, optional
        The same as a part of the faces given.
    max_error : float, optional
        Distance: no point of the result is farther from the surface given, and no point of the
        surface given farther from the result. This is proven afterwards; where it does not
        hold, the contractions are done again with tighter bounds there.
    max_quadric_error : float, optional
        Distance: no vertex has a larger root mean squared distance from the planes of the faces
        that were merged into it. Much faster than `max_error`, and no bound of the distance.
    cost : {"auto", "length", "quadric"}
        What makes an edge cheap: that it is short, or that the quadric error increases little
        (Garland and Heckbert 1997). "auto" is "length" when `max_edge_length` is the only
        criterion, else "quadric".
    placement : {"auto", "midpoint", "quadric", "endpoint"}
        Where the new vertex goes; "quadric" is the place of the least quadric error. "auto" is
        "midpoint" when edges are judged by their length, else "quadric". Boundary vertices stay
        where they are when the other end of the edge is inside, unless that is locked. With
        "endpoint" all vertices of the result are vertices of the input.
    blocked : {"contract", "skip", "violate"}
        What to do with an edge that the link condition blocks: contract it with the inside of
        its nested 3-cycles; leave it, as other programs do; or contract it and break the
        topology, the "standard" algorithm of the paper, which shows what goes wrong.
    removal_limit : float, optional
        How far from the middle of its edge a nested contraction may remove vertices; in the
        units of the vertices. None is 4 times `max_edge_length`, or where that is not given 4
        times the edge itself; ``inf`` is the paper's behaviour, which may remove a balloon on a
        thin neck. By quadric error, what is removed counts with its whole distance.
    outer : {"region", "path", "distance"}
        How to tell what is outside of nested 3-cycles: by the number of vertices (growing
        regions in step), by the shortest paths along edges, by the Euclidean distance. The
        topology is kept with each of them; only the first is fast.
    boundary : {"simplify", "keep", "lock"}
        Boundary edges are contracted like others, and held by planes through them where there
        are quadrics; or only where the boundary is straight, so that it stays the same curve;
        or not at all.
    feature_angle : float, optional
        Edges between faces whose normals differ by more than this, in degrees, are held by planes
        through them.
    foldover : float, optional
        Largest change of a face normal in one contraction, in degrees. Other places along the
        edge are tried before it is left. None is no limit. Faces without height, which have no
        normal, may turn.
    normal_deviation : float, optional
        Largest angle between the normal of a face and the mean normal of the faces given that were
        merged into its vertices, in degrees, so that small turns do not add up. None is no
        limit; "auto" is 90 by quadric error and None by length.
    shape : float, optional
        From 0 to 1, where 1 is an equilateral triangle. Triangles worse than this make an edge
        dearer if they are worse than those around it were, and then they may not be needles.
        None is no such thing; "auto" is 0.9 by quadric error and None by length.
    intersections : {"allow", "prevent"}
        With "prevent" no two faces come to cross that did not cross before, told exactly; slower.
    fit : {"auto", True, False}
        Whether the vertices are moved a little in the end, so that the faces are nearer to the
        surface given (Hoppe et al. 1993). "auto" does so by quadric error, with that placement,
        where a number of faces is asked for, at most a third of them is left, and nothing is asked
        for that it could break: no largest edge or error, no number for `normal_deviation`,
        ``intersections="prevent"`` or ``blocked="violate"``. Vertices on the boundary,
        locked ones, those on seams and, with `feature_angle`, on features stay where they are.
        Edges between others may be turned over, without `face_data`: where something is gained,
        unless the surface is smooth and many faces are left, and beside faces without height.
    locked : array_like, optional
        Vertices that may neither move nor vanish: a boolean mask of shape (n,), or indices.
    seams : array_like or str or sequence of str, optional
        Borders that stay exactly as they are, with all their vertices and edges: edges as pairs
        of vertex indices, shape (k, 2); or names of data. Of `face_data` with labels (integers,
        booleans, strings): every edge between faces with different labels, so that each region
        of a label keeps its topology too. Of `face_data` of shape (m, 3, ...), which are taken
        as values at the corners of the faces, such as texture coordinates, and interpolated:
        every edge on whose sides they differ. Of `vertex_data`: vertices on the boundary that
        are in exactly the same place as others there, as programs have them that hold one
        texture coordinate for each vertex; welded afterwards they give the topology that they
        would have given before.
    repair : bool
        Repair a mesh that is no oriented 2-manifold first; see :func:`tetsimplify.repair`.
    vertex_data, face_data : mapping of names to arrays, optional
        Shapes (n, ...) and (m, ...). Floats at vertices are interpolated along contracted edges
        (at the foot of the new vertex on the edge, so that linear functions of the position stay
        exact where the new vertex is on the edge); all other types are labels, taken from the
        nearer end of the edge and never averaged. Floats of shape (n, 3) named ``"normal"`` or
        ``"normals"``, in small letters or capitals, have unit length again where they were
        interpolated.
    threads : int, optional
        None for as many as the process may use. The result does not depend on it.
    progress : callable, optional
        Called as ``progress(stage, done)`` with `done` from 0 to 1. Raise from it to cancel.

    Returns
    -------
    Simplification
        `vertices`, `faces`, `vertex_map` (old to new), `face_map` (new to old), `report`,
        `vertex_data`, `face_data`. For a mesh object, an object of the same kind. What stopped it
        is in ``report.stop``.

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold, or not a mesh at all. The message
        says what is wrong where.
    OptionError
        When an option has a wrong value, no criterion is given, or `seams` holds what is no edge
        and names no such data.

    Notes
    -----
    Topology is kept exactly when the kept side is bounded by one 4-cycle and all that is
    removed is a disc; see the page on theory. Every edge shorter than `max_edge_length` that is
    left is listed in ``report.remaining_edges`` with its reason. With ``foldover=None,
    removal_limit=inf`` and no other criterion only edges remain whose contraction is proven
    impossible.

    References
    ----------
    Ya. S. Pepko and V. V. Borisenko. Topology-preserving triangulation simplification
    algorithm by edge contraction. Fundamentalnaya i prikladnaya matematika 24(3), 2023,
    153-169.

    T. K. Dey, H. Edelsbrunner, S. Guha and D. V. Nekhayev. Topology preserving edge
    contraction. Publ. Inst. Math. (Beograd) 66(80), 1999, 23-45.

    M. Garland and P. S. Heckbert. Surface simplification using quadric error metrics.
    SIGGRAPH 1997, 209-216. https://doi.org/10.1145/258734.258849

    H. Hoppe, T. DeRose, T. Duchamp, J. McDonald and W. Stuetzle. Mesh optimization.
    SIGGRAPH 1993, 19-26. https://doi.org/10.1145/166117.166119

    Examples
    --------
    >>> import numpy as np
    >>> import tetsimplify
    >>> x, y, z = np.mgrid[-1:1:40j, -1:1:40j, -1:1:40j]
    >>> tube = 0.3 - np.hypot(np.hypot(x, y) - 0.6, z)
    >>> mesh = tetsimplify.extract_isosurface(tube, 0.0)
    >>> result = tetsimplify.simplify(*mesh, max_edge_length=1.0)
    >>> result.report.topology_after.same_topology(result.report.topology_before)
    True
    >>> result = tetsimplify.simplify(*mesh, target_faces=1000)
    >>> len(result.faces), result.report.stop
    (1000, 'target_faces')
    """
    given_options: dict[str, Any] = {
        "max_edge_length": max_edge_length,
        "target_faces": target_faces,
        "keep_ratio": keep_ratio,
        "max_error": max_error,
        "max_quadric_error": max_quadric_error,
        "cost": cost,
        "placement": placement,
        "blocked": blocked,
        "removal_limit": removal_limit,
        "outer": outer,
        "boundary": boundary,
        "feature_angle": feature_angle,
        "foldover": foldover,
        "normal_deviation": normal_deviation,
        "shape": shape,
        "intersections": intersections,
        "fit": fit,
    }
    data: dict[str, Any] = {"vertex_data": vertex_data, "face_data": face_data}
    more: dict[str, Any] = {
        "locked": locked,
        "repair": repair,
        "threads": threads,
        "progress": progress,
    }
    if seams is not None:
        more["seams"] = seams
    if faces is None:
        return adapters.simplify(vertices, **data, **more, **given_options)
    if seams is not None:
        seamed = simplify_with_seams(
            vertices, faces, copies=False, colours=(), **data, **more, **given_options
        )
        of_faces = seamed.face_data | seamed.wedge_data
        return Simplification(*seamed[:6], {name: of_faces[name] for name in face_data or {}})

    clock, options = Clock(), Options(**given_options)
    with clock.stage("check"):
        given = as_mesh(vertices, faces)
        held = as_vertex_mask("locked", locked, len(given.vertices))
        of_vertices = as_data("vertex_data", vertex_data, len(given.vertices))
        of_faces = as_data("face_data", face_data, len(given.faces))
        repaired = repair_mesh(*given) if repair else None
        if repaired is not None:
            held = held[repaired.vertex_origin]
            of_vertices = {k: rows[repaired.vertex_origin] for k, rows in of_vertices.items()}
            of_faces = {k: rows[repaired.face_map] for k, rows in of_faces.items()}
            given = Mesh(repaired.vertices, repaired.faces)
        engine = Engine(given, options, held, threads=threads)
    result = contract(
        engine,
        given,
        locked=held,
        vertex_data=of_vertices,
        face_data=of_faces,
        progress=progress,
        clock=clock,
    )
    return result if repaired is None else after_repair(result, repaired)
