"""The engine: a surface, the rules, and sweeps over it. One run has one engine."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.data import VertexWeights
from tetsimplify.errors import MeshError
from tetsimplify.mesh import Mesh
from tetsimplify.options import BOUNDARY_WEIGHT, FEATURE_WEIGHT, Options, Progress
from tetsimplify.topology import TopologyReport, analyse

if TYPE_CHECKING:
    from tetsimplify.kernels.intersections import Watch
    from tetsimplify.kernels.state import Quadrics, Rules, Scratch

FACES_AT_ONCE = 2**20  # between two calls of `progress`
STAMP_LIMIT = 2**30  # stamps are int32; they start anew beyond this
FULL_SWEEP = 100  # a sweep that contracts less than one in so many faces lets all be retried
SHARES = (0.1, 0.02)  # of the edges are below the threshold of a sweep; the second near the end
NOTHING = 1e-8  # of the diagonal: a quadric error or a length that is as good as none
SAMPLE = 2**14  # faces whose costs tell what the threshold is
STRAIGHT = 1e-6  # tangent of the angle by which a straight boundary may turn at a vertex
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
    shortest_edge: float
    stop: str
    vertex_errors: NDArray[np.float64]
    """Shape (n,): root mean squared distance of each vertex from the planes of the faces that were
    merged into it; empty without quadrics."""


class Engine:
    """Contracts edges of an oriented manifold.

    Parameters
    ----------
    mesh : Mesh
        Checked arrays; they are copied.
    options : Options
    locked : ndarray, shape (n,), bool
    bound : ndarray, shape (n,), float64, optional
        Largest quadric error that each vertex may come to, instead of that of the options.

    Attributes
    ----------
    topology_before : TopologyReport

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold.
    """

    def __init__(
        self,
        mesh: Mesh,
        options: Options,
        locked: NDArray[np.bool_],
        bound: NDArray[np.float64] | None = None,
    ) -> None:
        n, m = len(mesh.vertices), len(mesh.faces)
        corner_vertex = mesh.faces.reshape(-1).copy()
        corners = kernels.corners.link_corners(corner_vertex, n)
        self.topology_before, loop = analyse(corner_vertex, *corners)
        _refuse(self.topology_before)
        self.options, self.rules = options, options.rules(m)
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
            locked=locked | self._held_boundary(mesh.vertices, corner_vertex, corners[1], loop),
            merges=np.empty((n, 2)),
        )
        self._quadrics = self._build_quadrics(bound) if options.uses_quadrics else None
        self._cost = None if options.has_one_threshold else np.empty(3 * m, np.float32)
        self._watch = self._new_watch()
        self._face_origin = np.arange(m, dtype=np.int32)
        self._scratch = _scratch(m, n + n_loops)

    @property
    def n_faces(self) -> int:
        """Number of live faces."""
        return int(self._scratch.tally[kernels.state.N_LIVE])

    def tally(self, name: str) -> int:
        """One of the counters of :mod:`tetsimplify.kernels.state`, by its name."""
        return int(self._scratch.tally[getattr(kernels.state, name)])

    def _held_boundary(
        self,
        vertices: NDArray[np.float64],
        corner_vertex: NDArray[np.int32],
        next_corner: NDArray[np.int32],
        loop: NDArray[np.int32],
    ) -> NDArray[np.bool_]:
        """Boundary vertices that have to stay: all, or those where the boundary turns."""
        held: NDArray[np.bool_] = loop >= 0
        if self.options.boundary == "simplify" or not held.any():
            return np.zeros_like(held)
        if self.options.boundary == "keep":
            before, after = np.arange(len(loop)), np.arange(len(loop))
            kernels.rings.boundary_neighbours(corner_vertex, next_corner, loop, before, after)
            come, go = vertices - vertices[before], vertices[after] - vertices
            ahead = np.einsum("ij,ij->i", come, go)
            aside = np.linalg.norm(np.cross(come, go), axis=1)
            held &= (ahead <= 0.0) | (aside > STRAIGHT * ahead)
        return held

    def _build_quadrics(self, bound: NDArray[np.float64] | None) -> Quadrics:
        """The quadrics of all faces, and of boundary and feature edges."""
        options, surface = self.options, self._surface
        n = len(surface.vertices)
        limit = np.inf if options.max_quadric_error is None else options.max_quadric_error
        quadrics: Quadrics = kernels.state.Quadrics(
            terms=np.zeros((n, kernels.quadrics.N_TERMS)),
            normals=np.zeros((n, 4)),
            max_error2=np.full(n, float(limit)) if bound is None else bound.copy(),
        )
        quadrics.max_error2[:] *= np.abs(quadrics.max_error2)  # negative ones stay negative
        kernels.quadrics.add_faces(
            surface.vertices, surface.corner_vertex, quadrics.terms, quadrics.normals
        )
        sharp = -1.0
        if options.feature_angle is not None:
            sharp = math.cos(math.radians(options.feature_angle))
        if sharp > -1.0 or len(surface.loop_size):
            kernels.quadrics.add_creases(
                surface, quadrics.terms, BOUNDARY_WEIGHT, FEATURE_WEIGHT, sharp
            )
        return quadrics

    def _new_watch(self) -> Watch | None:
        """Boxes around the faces as they are, for the guard against self-intersections."""
        if self.options.intersections == "allow":
            return None
        faces = self._surface.corner_vertex.reshape(-1, 3)
        watch: Watch = kernels.intersections.watch_over(self._surface.vertices, faces)
        return watch

    def run(self, progress: Progress | None = None) -> None:
        """Sweep until a criterion is reached, or no edge is left that the rules let go."""
        if self._cost is None:
            self._run_below_length(progress)
        else:
            self._run_by_cost(progress)
        if progress is not None:
            progress("contract", 1.0)

    def _run_below_length(self, progress: Progress | None) -> None:
        """Contract every edge below one length."""
        retry = False
        while True:
            n_contracted = self.sweep(retry, progress)
            if n_contracted == 0 and retry:
                return
            retry = n_contracted * FULL_SWEEP <= self.n_faces
            self._compact_when_half()

    def _run_by_cost(self, progress: Progress | None) -> None:
        """Contract the cheapest edges first: sweeps with a threshold that grows."""
        state = kernels.state
        n_given, threshold, n_barren, retry = self.n_faces, self._smallest_threshold(), 0, False
        self.rank()
        while not self.has_enough:
            threshold = self.next_threshold(threshold, n_barren)
            n_contracted = self.sweep_ranked(threshold)
            n_barren = 0 if n_contracted else n_barren + 1
            if progress is not None:
                n_most = max(1, n_given - self.rules.min_faces)
                progress("contract", (n_given - self.n_faces) / n_most)
            if threshold == np.inf:
                if retry and n_barren:
                    return
                states = self._surface.face_state
                states[states == state.RANKED] = state.STALE_ODD  # ask all edges again
                retry = True
            self._compact_when_half()
            self.rank()

    @property
    def has_enough(self) -> bool:
        """Whether one more contraction would leave fewer faces than are asked for."""
        return self.rules.min_faces > 0 and self.n_faces - 2 < self.rules.min_faces

    def rank(self) -> None:
        """Bring the costs of the edges up to date."""
        n_faces = len(self._face_origin)
        kernels.cost.rank(self._surface, self._quadrics, self.rules, self._cost, 0, n_faces)

    def _smallest_threshold(self) -> float:
        """A cost below which edges need no order: flat parts would take many sweeps otherwise."""
        vertices = self._surface.vertices
        nothing2 = (
            NOTHING**2 * float((np.ptp(vertices, axis=0) ** 2).sum()) if self.n_faces else 0.0
        )
        if self._quadrics is None or self.rules.by_length:
            return nothing2
        mean_area = float(self._quadrics.normals[:, 3].sum()) / (3 * max(1, self.n_faces))
        return nothing2 * mean_area

    def next_threshold(self, threshold: float, n_barren: int = 0) -> float:
        """A cost that some share of the edges are below, and no more than have to go.

        Parameters
        ----------
        threshold : float
            The one of the sweep before, which is not gone below.
        n_barren : int
            The number of sweeps before that have contracted nothing.
        """
        state = kernels.state
        step = max(1, len(self._face_origin) // SAMPLE)
        is_ranked = self._surface.face_state[::step] == state.RANKED
        costs = self._costs.reshape(-1, 3)[::step][is_ranked]
        costs = np.sort(costs[costs < np.inf])
        min_faces = self.rules.min_faces
        share = SHARES[0] if self.n_faces > 2 * min_faces else SHARES[1]
        if min_faces:
            share = min(share, (self.n_faces - min_faces) / (3 * self.n_faces))
        share = max(share, 1.0 / max(1, len(costs))) * 2.0**n_barren
        if not len(costs) or share > 1.0:
            return np.inf
        cheap = costs[min(int(share * len(costs)), len(costs) - 1)]
        return max(threshold, float(np.nextafter(cheap, np.float32(np.inf))))

    @property
    def _costs(self) -> NDArray[np.float32]:
        assert self._cost is not None
        return self._cost

    def sweep_ranked(self, threshold: float) -> int:
        """Sweep once over all faces and contract edges that cost less than a threshold.

        Returns the number of contractions.
        """
        state = kernels.state
        rules = self.rules._replace(max_cost=threshold)
        n_contracted = kernels.sweep.sweep_ranked(
            *(self._surface, self._quadrics, self._watch, self._scratch, rules, self._cost),
            *(0, len(self._face_origin), state.STALE_ODD),
        )
        n_contracted += self._unblock_deferred(rules, state.STALE_ODD)
        self.n_sweeps += 1
        return int(n_contracted)

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
                self._surface,
                self._quadrics,
                self._watch,
                self._scratch,
                self.rules,
                first,
                last,
                colour,
                retry,
            )
            if progress is not None:  # every sweep is half of what is still to do
                progress("contract", 1.0 - 0.5**self.n_sweeps * (1.0 - 0.5 * last / n_faces))
        n_contracted += self._unblock_deferred(self.rules, colour)
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

    @cached_property
    def result(self) -> Result:
        """The live part, renumbered, and what is left in it. Ends the run."""
        edges, reasons = self._remaining_edges()
        self._compact()
        surface = self._surface
        number = np.empty(len(surface.merged_into), np.int32)
        merged_into = surface.merged_into.copy()  # whose paths are shortened
        n_used = kernels.result.number_vertices(surface.corner_vertex, merged_into, number)
        vertices = np.empty((n_used, 3))
        kernels.result.copy_vertices(
            surface.vertices, number, merged_into, surface.corner_vertex, vertices
        )
        faces = surface.corner_vertex.reshape(-1, 3)
        shortest, longest = kernels.result.edge_extremes(vertices, surface.corner_vertex)
        stop = self._stop(reasons, longest)
        return Result(
            *(vertices, faces, number, self._face_origin, number[edges], reasons),
            *(shortest, stop, self._vertex_errors(number)),
        )

    def _vertex_errors(self, number: NDArray[np.int32]) -> NDArray[np.float64]:
        """The quadric errors of the vertices that are left, as distances."""
        if self._quadrics is None:
            return np.empty(0)
        is_left = (self._surface.merged_into == np.arange(len(number))) & (number >= 0)
        terms = self._quadrics.terms[is_left]
        weight = terms[:, 0] + terms[:, 3] + terms[:, 5]
        errors: NDArray[np.float64] = np.sqrt(terms[:, 9] / np.where(weight > 0.0, weight, 1.0))
        return errors

    def _stop(self, reasons: NDArray[np.str_], longest_edge: float) -> str:
        """The criterion that ended the run; "exhausted" when all that is left is forbidden."""
        options, state = self.options, kernels.state
        if self.has_enough:
            return "target_faces" if options.target_faces == self.rules.min_faces else "keep_ratio"
        is_open = np.repeat(self._surface.face_state != state.SETTLED, 3)
        is_held = is_open & (self._surface.verdict == state.ERROR_BOUND)
        if "error_bound" in reasons or (options.max_edge_length is None and is_held.any()):
            return "max_error" if options.max_error is not None else "max_quadric_error"
        length = options.max_edge_length
        return "max_edge_length" if length is not None and longest_edge >= length else "exhausted"

    def _remaining_edges(self) -> tuple[NDArray[np.int32], NDArray[np.str_]]:
        """The short edges that are left, and the reasons found when they were last tried."""
        surface, state = self._surface, kernels.state
        if self.options.max_edge_length is None:
            return np.empty((0, 2), np.int32), np.empty(0, np.str_)
        is_open = surface.corner_vertex[::3] != kernels.corners.DEAD
        if self._cost is None:
            is_open &= surface.face_state != state.SETTLED
        faces = np.flatnonzero(is_open)
        held = surface.verdict.reshape(-1, 3)[faces] == state.REMOVAL_LIMIT
        self._tell_obstructed_from_too_large(faces[held.any(axis=1)])
        begins = (3 * faces[:, None] + np.arange(3)).reshape(-1)
        ends = (3 * faces[:, None] + (1, 2, 0)).reshape(-1)
        edges = np.column_stack([surface.corner_vertex[begins], surface.corner_vertex[ends]])
        a, b = surface.vertices[edges.T]
        is_told = ((a - b) ** 2).sum(axis=1) < self.rules.max_length2
        if self._cost is not None:  # only one corner of an edge knows
            low, high = edges.T
            is_told &= (low < high) | (
                (surface.loop[low] >= 0) & (surface.loop[low] == surface.loop[high])
            )
        edges, first = np.unique(np.sort(edges[is_told]), axis=0, return_index=True)
        return edges, np.array(state.REASONS)[surface.verdict[begins[is_told][first]]]

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

    def _unblock_deferred(self, rules: Rules, colour: int) -> int:
        """Contract blocked edges, where they are to be contracted at all."""
        n_contracted = 0
        if rules.blocked == kernels.state.CONTRACT and self.tally("N_DEFERRED"):
            n_contracted = self._unblock(rules, colour, commit=True)
        self._scratch.tally[kernels.state.N_DEFERRED] = 0
        return n_contracted

    def _unblock(self, rules: Rules, colour: int, *, commit: bool) -> int:
        bundles = self._surface, self._quadrics, self._watch, self._scratch, rules, self._cost
        return int(kernels.sweep.unblock(*bundles, self._outer, colour, commit))

    def _compact_when_half(self) -> None:
        if 2 * self.n_faces < len(self._face_origin):
            self._compact()
            self._watch = self._new_watch()

    def _compact(self) -> None:
        """Drop the dead faces."""
        corner_vertex = np.empty(3 * self.n_faces, np.int32)
        face_state = np.empty(self.n_faces, np.uint8)
        verdict = np.empty(3 * self.n_faces, np.uint8)
        origin = np.empty(self.n_faces, np.int32)
        surface = self._surface
        if self._cost is not None:
            live = surface.corner_vertex[::3] != kernels.corners.DEAD
            self._cost = self._cost.reshape(-1, 3)[live].reshape(-1)
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
        point=np.zeros(8),
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
