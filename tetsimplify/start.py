"""What an engine starts from: the corner table of a mesh, its quadrics, its scratch space."""

from __future__ import annotations

import dataclasses
import math
import mmap
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.crew import Crew
from tetsimplify.errors import MeshError
from tetsimplify.locality import Arrangement
from tetsimplify.mesh import Mesh
from tetsimplify.options import BOUNDARY_WEIGHT, FEATURE_WEIGHT, Options
from tetsimplify.topology import TopologyReport, examine, topology

if TYPE_CHECKING:
    from tetsimplify.kernels.quadrics import Quadrics
    from tetsimplify.kernels.state import Scratch, Surface

STAMP_LIMIT = 2**30  # stamps are int32; they start anew beyond this
CACHE_LINE = 64  # bytes
LARGE = 2**20  # bytes: arrays for which it pays to ask for small pages
SAMPLE = 2**12  # faces whose areas tell the unit of the weights
AT_ONCE = 2**16  # vertices in a task for a thread
STRAIGHT = 1e-6  # tangent of the angle by which a straight boundary may turn at a vertex


def start_surface(
    given: Mesh,
    arranged: Arrangement,
    options: Options,
    locked: NDArray[np.bool_] | NDArray[np.uint8],
    threads: int | None = None,
) -> tuple[Surface, TopologyReport, NDArray[np.int32]]:
    """The corner table of a mesh, its topology, and a corner of each vertex.

    Parameters
    ----------
    given : Mesh
    arranged : Arrangement
        The same in another order. Its arrays are used, not copied.
    options : Options
    locked : ndarray, shape (n,), bool or uint8
        In the order given. 2 where edges may not be contracted either.
    threads : int, optional
        How many threads to use.

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold.
    """
    mesh = arranged.mesh
    n, m = len(mesh.vertices), len(mesh.faces)
    corner_vertex = mesh.faces.reshape(-1)
    report, loop, next_corner, first_corner = examine(corner_vertex, n, threads=threads)
    if not report.is_manifold:
        defects = topology(*given).defects()  # which are told in the order given
        raise MeshError(
            f"the mesh is no consistently oriented 2-manifold: {defects}; repair=True repairs it"
        )
    unused = np.sort(arranged.vertex_origin[report.unreferenced_vertices])
    report = dataclasses.replace(report, unreferenced_vertices=unused)

    held = _held_boundary(mesh.vertices, corner_vertex, next_corner, loop, options.boundary)
    n_loops = max(1, report.n_boundary_loops)
    surface: Surface = kernels.state.Surface(
        vertices=mesh.vertices,
        corner_vertex=corner_vertex,
        next_corner=next_corner,
        face_state=np.full(m, kernels.state.STALE_ODD, np.uint8),
        verdict=np.zeros(3 * m, np.uint8),
        vertex_block=np.zeros(n, np.int32),
        merged_into=np.arange(n, dtype=np.int32),
        loop=loop,
        loop_size=np.zeros(n_loops, np.int32),
        loop_home=np.zeros(n_loops, np.int32),
        locked=np.maximum(locked[arranged.vertex_origin], held).astype(np.uint8),
        merges=np.empty((n, 2)),
    )
    kernels.loops.count_loop_edges(surface.loop, surface.merged_into, surface.loop_size)
    return surface, report, first_corner


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
    surface: Surface,
    first_corner: NDArray[np.int32],
    options: Options,
    bound: NDArray[np.float64] | None,
    crew: Crew,
) -> Quadrics:
    """The quadrics of all faces, and of boundary and feature edges; see kernels/quadrics.py.

    Parameters
    ----------
    surface : Surface
    first_corner : ndarray, shape (n,), int32
        A corner of each vertex, -1 where it has none.
    options : Options
    bound : ndarray, shape (n,), float64, optional
        Largest quadric error that each vertex may come to, instead of that of the options. None is
        small enough for a negative one.
    crew : Crew
    """
    n = len(surface.vertices)
    limit = np.inf if options.max_quadric_error is None else options.max_quadric_error
    quadrics = new_quadrics(n)
    max_error2 = quadrics.origin[:, kernels.quadrics.MAX_ERROR2]
    max_error2[:] = limit if bound is None else bound
    max_error2 *= np.abs(max_error2)
    unit = _weight_unit(surface)

    def sum_faces(part: slice) -> None:
        kernels.quadrics.sum_faces(
            *(surface.vertices, surface.corner_vertex, surface.next_corner, first_corner),
            *(unit, part.start, part.stop, quadrics),
        )

    crew.share(sum_faces, n, AT_ONCE)
    sharp = -1.0
    if options.feature_angle is not None:
        sharp = math.cos(math.radians(options.feature_angle))
    begins = np.flatnonzero((surface.loop >= 0) | (sharp > -1.0)).astype(np.int32)
    weights = unit, BOUNDARY_WEIGHT, FEATURE_WEIGHT
    kernels.quadrics.add_creases(surface, first_corner, begins, quadrics.matrix, *weights, sharp)
    return quadrics


def _weight_unit(surface: Surface) -> float:
    """About the mean area of a face. A power of two: so a mesh twice as large gives the same."""
    step = max(1, len(surface.face_state) // SAMPLE)
    area = kernels.quadrics.mean_area(surface.vertices, surface.corner_vertex, step)
    return float(2.0 ** round(math.log2(area))) if 0.0 < area < math.inf else 1.0


def new_quadrics(n_vertices: int) -> Quadrics:
    """Quadrics of so many vertices, all zero, each in one line of a cache."""
    width = CACHE_LINE // 8
    memory = np.zeros((n_vertices + 1) * width)
    first = -(memory.ctypes.data // 8) % width
    matrix = memory[first : first + n_vertices * width].reshape(n_vertices, width)
    quadrics: Quadrics = kernels.quadrics.Quadrics(
        matrix=matrix,
        linear=matrix.view(np.float32),
        origin=np.zeros((n_vertices, 8), np.float32),
    )
    return quadrics


def new_costs(n_faces: int) -> NDArray[np.float32]:
    """Rows of costs of the edges of so many faces, none of them up to date."""
    costs = np.full((n_faces, kernels.cost.COLUMNS), np.inf, np.float32)
    costs[:, kernels.cost.LEAST] = -np.inf
    return costs.reshape(-1)


def start_scratch(n_faces: int, n_coned: int, n_nodes: int) -> Scratch:
    """Scratch space for so many faces, real and virtual vertices, and as many or no nodes."""
    state = kernels.state
    room = 3 * state.AT_ONCE + state.LANES + kernels.cost.AHEAD  # for the edges PENDING
    scratch: Scratch = state.Scratch(
        tally=np.zeros(state.TALLY_SIZE, np.int64),
        mark=np.zeros(n_coned, np.int32),
        face_mark=_sparse_zeros(n_faces),
        nodes=_sparse_zeros(3, n_nodes),
        lists=_sparse_zeros(state.N_LISTS, max(n_faces + 2, room)),
        ring=_sparse_zeros(2, 2 * n_faces + 4),
        point=np.zeros(state.POINT_SIZE),
        lanes=np.zeros(state.N_ROWS * state.WIDTH),
    )
    scratch.tally[state.STAMP_LIMIT] = STAMP_LIMIT
    return scratch


def _sparse_zeros(*shape: int) -> NDArray[np.int32]:
    """Zeros (int32) that take memory only where they are touched, and that in small pages.

    NumPy asks for large pages for large arrays. Of those in which only a few places are touched,
    far apart, these would take all the memory, and the time to clear it.
    """
    size = 4 * math.prod(shape)
    if size < LARGE:
        return np.zeros(shape, np.int32)
    return np.frombuffer(mmap.mmap(-1, size), np.int32).reshape(shape)
