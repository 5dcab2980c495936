"""The engine: a surface, the rules, and sweeps over it. One run has one engine."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.data import VertexWeights
from tetsimplify.errors import MeshError
from tetsimplify.mesh import Mesh
from tetsimplify.options import Options, Progress
from tetsimplify.topology import TopologyReport, analyse

if TYPE_CHECKING:
    from tetsimplify.kernels.state import Rules, Scratch

FACES_AT_ONCE = 2**20  # between two calls of `progress`
STAMP_LIMIT = 2**30  # stamps are int32; they start anew beyond this
FULL_SWEEP = 100  # a sweep that contracts less than one in so many faces lets all be retried
DECISION_STEPS = (100_000, 2)  # steps of region growing to tell obstructed from too large:
# so many, and so many for each face


class Result(NamedTuple):
    """The live part of the surface, renumbered."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    vertex_map: NDArray[np.int32]
    face_map: NDArray[np.int32]
    remaining_edges: NDArray[np.int32]
    remaining_reasons: NDArray[np.str_]


class Engine:
    """Contracts edges of an oriented manifold.

    Parameters
    ----------
    mesh : Mesh
        Checked arrays; they are copied.
    options : Options
    locked : ndarray, shape (n,), bool

    Attributes
    ----------
    topology_before : TopologyReport

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold.
    """

    def __init__(self, mesh: Mesh, options: Options, locked: NDArray[np.bool_]) -> None:
        n, m = len(mesh.vertices), len(mesh.faces)
        corner_vertex = mesh.faces.reshape(-1).copy()
        corners = kernels.corners.link_corners(corner_vertex, n)
        self.topology_before, loop = analyse(corner_vertex, *corners)
        _refuse(self.topology_before)
        self.rules = options.rules()
        self._outer = options.outer_code()
        self.n_sweeps = 0
        n_loops = self.topology_before.n_boundary_loops
        self._surface = kernels.state.Surface(
            vertices=mesh.vertices.copy(),
            corner_vertex=corner_vertex,
            next_corner=corners[1],
            face_state=np.full(m, kernels.state.STALE_ODD, np.uint8),
            verdict=np.zeros(3 * m, np.uint8),
            merged_into=np.arange(n, dtype=np.int32),
            loop=loop,
            loop_size=kernels.result.count_loop_edges(loop, n_loops),
            locked=locked.copy(),
            merges=np.empty((n, 2)),
        )
        self._face_origin = np.arange(m, dtype=np.int32)
        self._scratch = _scratch(m, n + n_loops)

    @property
    def n_faces(self) -> int:
        """Number of live faces."""
        return int(self._scratch.tally[kernels.state.N_LIVE])

    def tally(self, name: str) -> int:
        """One of the counters of :mod:`tetsimplify.kernels.state`, by its name."""
        return int(self._scratch.tally[getattr(kernels.state, name)])

    def run(self, progress: Progress | None = None) -> None:
        """Sweep until no edge is left that the rules let go."""
        retry = False
        while True:
            n_contracted = self.sweep(retry, progress)
            if n_contracted == 0 and retry:
                break
            retry = n_contracted * FULL_SWEEP <= self.n_faces
            if 2 * self.n_faces < len(self._face_origin):
                self._compact()
        if progress is not None:
            progress("contract", 1.0)

    def sweep(self, retry: bool = True, progress: Progress | None = None) -> int:
        """Sweep once over all faces; return the number of contractions.

        Parameters
        ----------
        retry : bool
            Try faces again all of whose short edges were refused before.
        progress : callable, optional
        """
        state = kernels.state
        colour = state.STALE_EVEN if self.n_sweeps % 2 == 0 else state.STALE_ODD
        n_faces = len(self._face_origin)
        n_contracted = 0
        for first in range(0, n_faces, FACES_AT_ONCE):
            last = min(first + FACES_AT_ONCE, n_faces)
            n_contracted += kernels.sweep.sweep(
                self._surface, self._scratch, self.rules, first, last, colour, retry
            )
            if progress is not None:  # every sweep is half of what is still to do
                progress("contract", 1.0 - 0.5**self.n_sweeps * (1.0 - 0.5 * last / n_faces))
        if self.rules.blocked == state.CONTRACT and self.tally("N_DEFERRED"):
            n_contracted += self._unblock(self.rules, colour, commit=True)
        self._scratch.tally[state.N_DEFERRED] = 0
        self.n_sweeps += 1
        return n_contracted

    def mesh(self) -> Mesh:
        """The live faces, with all vertices under their old numbers."""
        corner_vertex = self._surface.corner_vertex.reshape(-1, 3)
        live = corner_vertex[:, 0] != kernels.corners.DEAD
        return Mesh(self._surface.vertices.copy(), corner_vertex[live])

    def vertex_weights(self) -> VertexWeights:
        """How the merged vertices are made of those given."""
        n = self.tally("N_SIMPLE") + self.tally("N_NESTED")
        surface = self._surface
        return VertexWeights(surface.merged_into.copy(), surface.merges[:n].copy())

    def result(self) -> Result:
        """The live part, renumbered, and the short edges left in it. Ends the run."""
        edges, reasons = self._remaining_edges()
        self._compact()
        surface = self._surface
        number = np.empty(len(surface.merged_into), np.int32)
        n_used = kernels.result.number_vertices(surface.corner_vertex, surface.merged_into, number)
        vertices = np.empty((n_used, 3))
        kernels.result.copy_vertices(
            surface.vertices, number, surface.merged_into, surface.corner_vertex, vertices
        )
        faces = surface.corner_vertex.reshape(-1, 3)
        return Result(vertices, faces, number, self._face_origin, number[edges], reasons)

    def _remaining_edges(self) -> tuple[NDArray[np.int32], NDArray[np.str_]]:
        """The short edges that are left, and the reasons found when they were last tried."""
        surface, state = self._surface, kernels.state
        faces = np.flatnonzero(surface.face_state != state.SETTLED)
        held = surface.verdict.reshape(-1, 3)[faces] == state.REMOVAL_LIMIT
        self._tell_obstructed_from_too_large(faces[held.any(axis=1)])
        begins = (3 * faces[:, None] + np.arange(3)).reshape(-1)
        ends = (3 * faces[:, None] + (1, 2, 0)).reshape(-1)
        edges = np.column_stack([surface.corner_vertex[begins], surface.corner_vertex[ends]])
        a, b = surface.vertices[edges.T]
        is_short = ((a - b) ** 2).sum(axis=1) < self.rules.max_length2
        edges, first = np.unique(np.sort(edges[is_short]), axis=0, return_index=True)
        return edges, np.array(state.OUTCOMES)[surface.verdict[begins[is_short][first]]]

    def _tell_obstructed_from_too_large(self, faces: NDArray[np.intp]) -> None:
        """Try the edges that the removal limit holds without it, as far as steps allow."""
        if not len(faces):
            return
        state = kernels.state
        self._scratch.lists[state.DEFERRED, : len(faces)] = faces
        self._scratch.tally[state.N_DEFERRED] = len(faces)
        most_steps = DECISION_STEPS[0] + DECISION_STEPS[1] * self.n_faces
        rules = self.rules._replace(
            removal_limit2=np.inf, max_steps=self.tally("N_STEPS") + most_steps
        )
        self._unblock(rules, state.SETTLED, commit=False)

    def _unblock(self, rules: Rules, colour: int, *, commit: bool) -> int:
        arguments = self._surface, self._scratch, rules, self._outer, colour, commit
        return int(kernels.sweep.unblock(*arguments))

    def _compact(self) -> None:
        """Drop the dead faces."""
        corner_vertex = np.empty(3 * self.n_faces, np.int32)
        face_state = np.empty(self.n_faces, np.uint8)
        verdict = np.empty(3 * self.n_faces, np.uint8)
        origin = np.empty(self.n_faces, np.int32)
        surface = self._surface
        kernels.result.copy_live_faces(
            *(surface.corner_vertex, surface.face_state, surface.verdict, self._face_origin),
            *(corner_vertex, face_state, verdict, origin),
        )
        next_corner = kernels.corners.link_corners(corner_vertex, len(surface.vertices))[1]
        self._face_origin = origin
        self._surface = surface._replace(
            corner_vertex=corner_vertex,
            next_corner=next_corner,
            face_state=face_state,
            verdict=verdict,
        )
        self._scratch.face_mark.fill(0)


def _scratch(n_faces: int, n_coned: int) -> Scratch:
    """Scratch space for so many faces, and real and virtual vertices."""
    state = kernels.state
    scratch: Scratch = state.Scratch(
        tally=np.zeros(state.TALLY_SIZE, np.int64),
        mark=np.zeros(n_coned, np.int32),
        face_mark=np.zeros(n_faces, np.int32),
        nodes=np.zeros((3, n_coned), np.int32),
        lists=np.empty((state.N_LISTS, n_faces + 2), np.int32),
        point=np.zeros(4),
    )
    scratch.tally[state.N_LIVE] = n_faces
    scratch.tally[state.STAMP_LIMIT] = STAMP_LIMIT
    return scratch


def _refuse(report: TopologyReport) -> None:
    """Raise when a mesh is no consistently oriented 2-manifold."""
    defects = report.defects()
    if defects is not None:
        raise MeshError(
            f"the mesh is no consistently oriented 2-manifold: {defects}; repair=True repairs it"
        )
