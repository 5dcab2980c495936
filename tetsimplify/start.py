"""What an engine starts from: the corner table of a mesh, its quadrics, its scratch space."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels, memory
from tetsimplify.crew import Crew, part_size
from tetsimplify.errors import MeshError
from tetsimplify.locality import Arrangement
from tetsimplify.mesh import Mesh
from tetsimplify.options import BOUNDARY_WEIGHT, FEATURE_WEIGHT, Options
from tetsimplify.topology import TopologyReport, examine, topology

if TYPE_CHECKING:
    from tetsimplify.kernels.quadrics import Quadrics
    from tetsimplify.kernels.state import Scratch, Surface

STAMP_LIMIT = 2**30  # stamps are int32; they start anew beyond this
SAMPLE = 2**12  # faces whose areas tell the unit of the weights
STRAIGHT = 1e-6  # tangent of the angle by which a straight boundary may turn at a vertex


class Start(NamedTuple):
    """A surface before the first contraction."""

    surface: Surface
    topology: TopologyReport
    first_corner: NDArray[np.int32]
    """Shape (n,): a corner of each vertex, -1 where it has none."""
    on_loops: NDArray[np.int32]
    """The boundary vertices."""


def start_surface(
    given: Mesh,
    arranged: Arrangement,
    options: Options,
    locked: NDArray[np.bool_] | NDArray[np.uint8],
    vertex_block: NDArray[np.int32] | None = None,
    threads: int | None = None,
) -> Start:
    """The corner table of a mesh, and its topology.

    Parameters
    ----------
    given : Mesh
    arranged : Arrangement
        The same in another order. Its arrays are used, not copied. With quadrics its vertices are
        as those of `new_quadrics`.
    options : Options
    locked : ndarray, shape (n,), bool or uint8
        In the order given. 2 where edges may not be contracted either.
    vertex_block : ndarray, shape (n,), int32, optional
        Block of each vertex where the surface is divided.
    threads : int, optional
        How many threads to use.

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold.
    """
    vertices, corner_vertex = arranged.vertices, arranged.faces.reshape(-1)
    n, m = len(vertices), len(arranged.faces)
    report, loop, on_loops, next_corner, first_corner = examine(corner_vertex, n, threads=threads)
    if not report.is_manifold:
        defects = topology(*given).defects()  # which are told in the order given
        raise MeshError(
            f"the mesh is no consistently oriented 2-manifold: {defects}; repair=True repairs it"
        )
    unused = np.sort(arranged.vertex_origin[report.unreferenced_vertices])
    report = dataclasses.replace(report, unreferenced_vertices=unused)

    held = memory.full(n, 0, np.uint8)
    if locked.any():
        held[:] = locked[arranged.vertex_origin]
    if options.boundary != "simplify":
        is_held = _is_held(vertices, corner_vertex, next_corner, loop, on_loops, options.boundary)
        held[on_loops] = np.maximum(held[on_loops], is_held)
    n_loops = max(1, report.n_boundary_loops)
    surface: Surface = kernels.state.Surface(
        vertices=vertices,
        corner_vertex=corner_vertex,
        next_corner=next_corner,
        face_state=memory.full(m, kernels.state.STALE_ODD, np.uint8),
        verdict=memory.full(3 * m, 0, np.uint8),
        vertex_block=memory.full(n, 0, np.int32) if vertex_block is None else vertex_block,
        merged_into=np.arange(n, dtype=np.int32),
        loop=loop,
        loop_size=np.zeros(n_loops, np.int32),
        loop_home=np.zeros(n_loops, np.int32),
        locked=held,
        merges=memory.empty((n, 2)),
    )
    kernels.loops.count_loop_edges(on_loops, loop, surface.loop_size)
    return Start(surface, report, first_corner, on_loops)


def _is_held(
    vertices: NDArray[np.float64],
    corner_vertex: NDArray[np.int32],
    next_corner: NDArray[np.int32],
    loop: NDArray[np.int32],
    on_loops: NDArray[np.int32],
    boundary: str,
) -> NDArray[np.bool_]:
    """Which boundary vertices have to stay: all, or those where the boundary turns."""
    if boundary == "lock":
        return np.ones(len(on_loops), np.bool_)
    before, after = np.arange(len(loop)), np.arange(len(loop))
    kernels.rings.boundary_neighbours(corner_vertex, next_corner, loop, before, after)
    vertices = vertices[:, :3]
    here = vertices[on_loops]
    come, go = here - vertices[before[on_loops]], vertices[after[on_loops]] - here
    ahead = np.einsum("ij,ij->i", come, go)
    aside = np.linalg.norm(np.cross(come, go), axis=1)
    is_held: NDArray[np.bool_] = (ahead <= 0.0) | (aside > STRAIGHT * ahead)
    return is_held


def start_quadrics(
    start: Start,
    options: Options,
    bound: NDArray[np.float64] | None,
    crew: Crew,
) -> tuple[Quadrics, float, float]:
    """The quadrics of all faces, and of boundary and feature edges, beside the positions.

    See kernels/quadrics.py. With the area of all faces, in the unit of their weights, and the
    length of the shortest edge.

    Parameters
    ----------
    start : Start
    options : Options
    bound : ndarray, shape (n,), float64, optional
        Largest quadric error that each vertex may come to, instead of that of the options. None is
        small enough for a negative one.
    crew : Crew
    """
    surface, _, first_corner, on_loops = start
    n = len(surface.vertices)
    limit = np.inf if options.max_quadric_error is None else options.max_quadric_error
    quadrics = new_quadrics(n, surface.vertices)
    unit = _weight_unit(surface)
    planes = memory.empty((len(surface.face_state), 4))

    def find_planes(part: slice) -> tuple[float, float]:
        weight, shortest2 = kernels.quadrics.find_planes(
            surface.vertices, surface.corner_vertex, unit, part.start, part.stop, planes
        )
        return weight, shortest2

    def sum_planes(part: slice) -> None:
        largest = limit if bound is None else bound[part]
        quadrics.origin[part, kernels.quadrics.MAX_ERROR2] = largest * np.abs(largest)
        kernels.quadrics.sum_planes(
            *(planes, surface.next_corner, first_corner, part.start, part.stop, quadrics)
        )

    found = crew.share(find_planes, len(planes), part_size(len(planes)))
    crew.share(sum_planes, n, part_size(n))
    area = sum(weight for weight, _ in found)
    shortest = math.sqrt(min((shortest2 for _, shortest2 in found), default=math.inf))
    sharp = -1.0
    if options.feature_angle is not None:
        sharp = math.cos(math.radians(options.feature_angle))
    begins = on_loops if sharp == -1.0 else np.arange(n)
    weights = unit, BOUNDARY_WEIGHT, FEATURE_WEIGHT
    kernels.quadrics.add_creases(surface, first_corner, begins, quadrics.matrix, *weights, sharp)
    return quadrics, area, shortest


def _weight_unit(surface: Surface) -> float:
    """About the mean area of a face. A power of two: so a mesh twice as large gives the same."""
    step = max(1, len(surface.face_state) // SAMPLE)
    area = kernels.quadrics.mean_area(surface.vertices, surface.corner_vertex, step)
    return float(2.0 ** round(math.log2(area))) if 0.0 < area < math.inf else 1.0


def new_quadrics(n_vertices: int, vertices: NDArray[np.float64] | None = None) -> Quadrics:
    """Quadrics of so many vertices, not filled.

    Parameters
    ----------
    vertices : ndarray, shape (n, 8), float64, optional
        Lines of a cache that begin with the positions.
    """
    matrix = memory.cache_lines(n_vertices)
    places = memory.cache_lines(n_vertices) if vertices is None else vertices
    quadrics: Quadrics = kernels.quadrics.Quadrics(
        matrix=matrix, linear=matrix.view(np.float32), origin=places.view(np.float32)
    )
    return quadrics


def start_scratch(n_faces: int, n_coned: int, n_nodes: int) -> Scratch:
    """Scratch space for so many faces, real and virtual vertices, and as many or no nodes."""
    state = kernels.state
    room = 3 * state.AT_ONCE + state.LANES + kernels.cost.AHEAD  # for the edges PENDING
    scratch: Scratch = state.Scratch(
        tally=np.zeros(state.TALLY_SIZE, np.int64),
        mark=memory.full(n_coned, 0, np.int32),
        face_mark=memory.sparse_zeros(n_faces),
        nodes=memory.sparse_zeros(3, n_nodes),
        lists=memory.sparse_zeros(state.N_LISTS, max(n_faces + 2, room)),
        ring=memory.sparse_zeros(2, 2 * n_faces + 4),
        point=np.zeros(state.POINT_SIZE),
        lanes=np.zeros(state.N_ROWS * state.WIDTH),
    )
    scratch.tally[state.STAMP_LIMIT] = STAMP_LIMIT
    return scratch
