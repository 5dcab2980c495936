"""What an engine starts from: the corner table of a mesh, its quadrics, its scratch space."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.errors import MeshError
from tetsimplify.locality import Arrangement
from tetsimplify.mesh import Mesh
from tetsimplify.options import BOUNDARY_WEIGHT, FEATURE_WEIGHT, Options
from tetsimplify.topology import TopologyReport, analyse, topology

if TYPE_CHECKING:
    from tetsimplify.kernels.state import Scratch, Surface

STAMP_LIMIT = 2**30  # stamps are int32; they start anew beyond this
CACHE_LINE = 64  # bytes
STRAIGHT = 1e-6  # tangent of the angle by which a straight boundary may turn at a vertex


def start_surface(
    given: Mesh,
    arranged: Arrangement,
    options: Options,
    locked: NDArray[np.bool_] | NDArray[np.uint8],
) -> tuple[Surface, TopologyReport]:
    """The corner table of a mesh, and its topology.

    Parameters
    ----------
    given : Mesh
    arranged : Arrangement
        The same in another order. Its arrays are used, not copied.
    options : Options
    locked : ndarray, shape (n,), bool or uint8
        In the order given. 2 where edges may not be contracted either.

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold.
    """
    mesh = arranged.mesh
    n, m = len(mesh.vertices), len(mesh.faces)
    corner_vertex = mesh.faces.reshape(-1)
    corners = kernels.corners.link_corners(corner_vertex, n)
    report, loop = analyse(corner_vertex, *corners)
    if not report.is_manifold:
        defects = topology(*given).defects()  # which are told in the order given
        raise MeshError(
            f"the mesh is no consistently oriented 2-manifold: {defects}; repair=True repairs it"
        )
    unused = np.sort(arranged.vertex_origin[report.unreferenced_vertices])
    report = dataclasses.replace(report, unreferenced_vertices=unused)

    held = _held_boundary(mesh.vertices, corner_vertex, corners[1], loop, options.boundary)
    n_loops = max(1, report.n_boundary_loops)
    surface: Surface = kernels.state.Surface(
        vertices=mesh.vertices,
        corner_vertex=corner_vertex,
        next_corner=corners[1],
        face_state=np.full(m, kernels.state.STALE_ODD, np.uint8),
        face_block=np.zeros(m, np.int32),
        verdict=np.zeros(3 * m, np.uint8),
        merged_into=np.arange(n, dtype=np.int32),
        loop=loop,
        loop_size=np.zeros(n_loops, np.int32),
        loop_home=np.zeros(n_loops, np.int32),
        locked=np.maximum(locked[arranged.vertex_origin], held).astype(np.uint8),
        merges=np.empty((n, 2)),
    )
    kernels.loops.count_loop_edges(surface.loop, surface.merged_into, surface.loop_size)
    return surface, report


def _held_boundary(
    vertices: NDArray[np.float64],
    corner_vertex: NDArray[np.int32],
    next_corner: NDArray[np.int32],
    loop: NDArray[np.int32],
    boundary: str,
) -> NDArray[np.bool_]:
    """Boundary vertices that have to stay: all, or those where the boundary turns."""
    held: NDArray[np.bool_] = loop >= 0
    if boundary == "simplify" or not held.any():
        return np.zeros_like(held)
    if boundary == "keep":
        before, after = np.arange(len(loop)), np.arange(len(loop))
        kernels.rings.boundary_neighbours(corner_vertex, next_corner, loop, before, after)
        come, go = vertices - vertices[before], vertices[after] - vertices
        ahead = np.einsum("ij,ij->i", come, go)
        aside = np.linalg.norm(np.cross(come, go), axis=1)
        held &= (ahead <= 0.0) | (aside > STRAIGHT * ahead)
    return held


def start_quadrics(
    surface: Surface, options: Options, bound: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """The quadrics of all faces, and of boundary and feature edges; see kernels/quadrics.py.

    Parameters
    ----------
    surface : Surface
    options : Options
    bound : ndarray, shape (n,), float64, optional
        Largest quadric error that each vertex may come to, instead of that of the options. None is
        small enough for a negative one.
    """
    n = len(surface.vertices)
    limit = np.inf if options.max_quadric_error is None else options.max_quadric_error
    quadrics = _aligned_rows(n, kernels.quadrics.WIDTH)
    quadrics[:, kernels.quadrics.MAX_ERROR2] = limit if bound is None else bound
    quadrics[:, kernels.quadrics.MAX_ERROR2] *= np.abs(quadrics[:, kernels.quadrics.MAX_ERROR2])
    kernels.quadrics.add_faces(surface.vertices, surface.corner_vertex, quadrics)
    sharp = -1.0
    if options.feature_angle is not None:
        sharp = math.cos(math.radians(options.feature_angle))
    if sharp > -1.0 or surface.loop_size.any():
        kernels.quadrics.add_creases(surface, quadrics, BOUNDARY_WEIGHT, FEATURE_WEIGHT, sharp)
    return quadrics


def _aligned_rows(n: int, width: int) -> NDArray[np.float64]:
    """Zeros, with every row in as few lines of a cache as can be."""
    line = CACHE_LINE // 8
    memory = np.zeros(n * width + line)
    first = -(memory.ctypes.data // 8) % line
    return memory[first : first + n * width].reshape(n, width)


def start_scratch(n_faces: int, n_coned: int, n_nodes: int) -> Scratch:
    """Scratch space for so many faces, real and virtual vertices, and as many or no nodes."""
    state = kernels.state
    scratch: Scratch = state.Scratch(
        tally=np.zeros(state.TALLY_SIZE, np.int64),
        mark=np.zeros(n_coned, np.int32),
        face_mark=np.zeros(n_faces, np.int32),
        nodes=np.zeros((3, n_nodes), np.int32),
        lists=np.empty((state.N_LISTS, n_faces + 2), np.int32),
        point=np.zeros(state.POINT_SIZE),
    )
    scratch.tally[state.STAMP_LIMIT] = STAMP_LIMIT
    return scratch
