"""The engine: a surface, the rules, and sweeps over it. One run has one engine."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import blocks, kernels, memory
from tetsimplify.compaction import compact
from tetsimplify.crew import Crew, part_size
from tetsimplify.data import VertexWeights
from tetsimplify.desks import Desks, Done, add_up
from tetsimplify.edges import edge_extremes
from tetsimplify.locality import IN_ORDER, Arrangement, as_given, by_locality
from tetsimplify.mesh import Mesh
from tetsimplify.options import Options, Progress
from tetsimplify.outcome import collect, vertex_errors
from tetsimplify.start import start_quadrics, start_scratch, start_surface

if TYPE_CHECKING:
    from tetsimplify.kernels.intersections import Watch
    from tetsimplify.kernels.state import Rules, Scratch, Surface

FACES_AT_ONCE = 2**20  # between two calls of `progress`, where there are no blocks
LEAST_BLOCKS = 4  # a surface of fewer is not divided
LEAST_TASKS = 8  # for threads, if there are as many blocks
LEAST_SPARE = 64  # faces a block on the average: with fewer to go the surface is not divided
MOST_SWEEPS = 8  # over a block below one length, before its edges to others have their turn
NOTHING = 1e-8  # of the diagonal: a quadric error or a length that is as good as none
SAMPLE = 2**14  # faces whose costs tell what the threshold is
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


class _Order(NamedTuple):
    """The order to work in."""

    arranged: Arrangement
    cells: blocks.Cells | None = None
    """Where the surface may be divided."""
    division: blocks.Division | None = None
    """The first one, where it is known."""
    vertex_block: NDArray[np.int32] | None = None
    """Shape (n,): the block of each vertex in that."""


def _arrange(mesh: Mesh, options: Options, crew: Crew) -> _Order:
    """That of the mesh where little is to be gained, else along a curve."""
    can_divide = options.blocked != "violate" and options.intersections == "allow"
    in_runs = options.has_one_threshold  # which is too quick for another order to pay, mostly
    in_lines = options.uses_quadrics
    least = LEAST_BLOCKS * (blocks.RUN if in_runs else blocks.FACES)
    if not can_divide or len(mesh.faces) < least:
        return _Order(as_given(mesh, crew, in_lines=in_lines))
    runs = blocks.runs(mesh, crew) if in_runs else None
    if runs is not None:
        return _Order(as_given(mesh, crew, in_lines=in_lines), *runs)
    arranged = by_locality(mesh, crew, in_lines=in_lines)
    return _Order(arranged, blocks.two_ways(arranged, crew))


class Engine:
    """Contracts edges of an oriented manifold.

    Parameters
    ----------
    mesh : Mesh
        Checked arrays; they are copied.
    options : Options
    locked : ndarray, shape (n,), bool or uint8
        Vertices that stay; 2 where they are not merged with others either.
    bound : ndarray, shape (n,), float64, optional
        Largest quadric error that each vertex may come to, instead of that of the options.
    threads : int, optional
        None for as many as the process may use. The result does not depend on it.

    Attributes
    ----------
    topology_before : TopologyReport
    n_threads : int
    min_faces : int
        So many faces are to be left.
    is_part : bool
        Whether this is a part of a surface, of which nothing need be told.

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold.
    """

    def __init__(
        self,
        mesh: Mesh,
        options: Options,
        locked: NDArray[np.bool_] | NDArray[np.uint8],
        bound: NDArray[np.float64] | None = None,
        threads: int | None = None,
    ) -> None:
        n, m = len(mesh.vertices), len(mesh.faces)
        self._crew = Crew(threads)
        self.n_threads = self._crew.n_threads
        self._arranged, self._cells, self._division, vertex_block = _arrange(
            mesh, options, self._crew
        )
        start = start_surface(mesh, self._arranged, options, locked, vertex_block, self.n_threads)
        self._surface, self.topology_before, _, self._on_loops = start
        self._quadrics = self._shortest_edge = None
        if options.uses_quadrics:
            arranged_bound = None if bound is None else bound[self._arranged.vertex_origin]
            self._quadrics, self._area, self._shortest_edge = start_quadrics(
                start, options, arranged_bound, self._crew
            )
        self._cost = None
        if not options.has_one_threshold:  # to be ranked first
            self._cost = memory.empty(kernels.cost.COLUMNS * m, np.float32)
        self._colour = kernels.state.MOVED_EVEN
        self._face_origin = self._arranged.face_origin
        self._room = np.empty(0, np.int32)  # for the faces of blocks
        self.options, self.rules = options, options.rules()
        if bound is not None:
            self.rules = self.rules._replace(is_bounded=True)
        self._outer = options.outer_code()
        self.min_faces = options.fewest_faces(m)
        self.is_part = False
        self.n_sweeps = 0
        self._watch = self._new_watch()
        n_coned = n + self.topology_before.n_boundary_loops
        self._scratch = start_scratch(m, n_coned, n_coned)
        self._scratch.tally[kernels.state.N_LIVE] = m
        self._desks = Desks(n_coned, keep_log=True)
        if self._division is not None and not self.is_divided:  # too little has to go
            self._unite()

    @property
    def n_faces(self) -> int:
        """Number of live faces."""
        return self.tally("N_LIVE")

    @property
    def _n_rows(self) -> int:
        """Number of faces, live and dead."""
        return len(self._surface.face_state)

    @property
    def has_enough(self) -> bool:
        """Whether one more contraction would leave fewer faces than are asked for."""
        return self.min_faces > 0 and self._n_spare < 2

    @property
    def is_divided(self) -> bool:
        """Whether sweeps go over blocks, and leave what lies between them to the next one."""
        if self._cells is None:
            return False
        n_blocks = self.n_faces // self._cells.least
        return n_blocks >= LEAST_BLOCKS and self._n_spare >= LEAST_SPARE * n_blocks

    @property
    def _n_spare(self) -> int:
        """How many faces may still go."""
        return self.n_faces - self.min_faces if self.min_faces else blocks.UNLIMITED

    def shortest_edge(self, mesh: Mesh) -> float:
        """The length of the shortest edge of the mesh given."""
        if self._shortest_edge is None:
            self._shortest_edge, _ = edge_extremes(mesh, self._crew)
        return self._shortest_edge

    @property
    def on_boundary(self) -> NDArray[np.bool_]:
        """Shape (n,): which vertices are on a boundary loop."""
        is_on: NDArray[np.bool_] = self._surface.loop[self._arranged.vertex_place] >= 0
        return is_on

    def lock(self, vertices: NDArray[np.bool_]) -> None:
        """Lock more vertices, before the run."""
        self._surface.locked[:] |= vertices[self._arranged.vertex_origin]

    def tally(self, name: str) -> int:
        """One of the counters of :mod:`tetsimplify.kernels.state`, by its name."""
        return int(self._scratch.tally[getattr(kernels.state, name)])

    def _new_watch(self) -> Watch | None:
        """Boxes around the faces as they are, for the guard against self-intersections."""
        if self.options.intersections == "allow":
            return None
        faces = self._surface.corner_vertex.reshape(-1, 3)
        watch: Watch = kernels.intersections.watch_over(self._surface.vertices, faces)
        return watch

    # --- below one length -------------------------------------------------------------------------

    def sweep(self, retry: bool = True, progress: Progress | None = None) -> int:
        """Sweep once over all faces; return the number of contractions.

        Parameters
        ----------
        retry : bool
            Try faces again all of whose short edges were refused before.
        progress : callable, optional
        """
        n_faces = self._n_rows
        parts = blocks.parts(n_faces, FACES_AT_ONCE)
        self._let_all_be_looked_at()
        n_contracted = 0
        for i in range(len(parts)):
            part = parts[i : i + 1]
            n_contracted += self._sweep(self._surface, self._scratch, IN_ORDER, part, 1, retry)
            if progress is not None:  # every sweep is half of what is still to do
                share = 1.0 - 0.5 * parts[i, 1] / max(1, n_faces)
                progress("contract", 1.0 - 0.5**self.n_sweeps * share)
        self.n_sweeps += 1
        return n_contracted + self._unblock_deferred()

    def sweep_divided(self, progress: Progress | None = None) -> int:
        """Sweep over blocks until little is left in them; return the number of contractions."""
        all_blocks, listed = self._divide()
        self._let_all_be_looked_at()

        def task(surface: Surface, scratch: Scratch, some: blocks.Blocks) -> int:
            return self._sweep(surface, scratch, listed, some, MOST_SWEEPS, False)

        begin = 1.0 - 0.5**self.n_sweeps
        n_contracted = self._share(task, all_blocks, progress, (begin, 0.5 * (1.0 + begin)))
        self.n_sweeps += 1
        return n_contracted + self._unblock_deferred()

    def _sweep(
        self,
        surface: Surface,
        scratch: Scratch,
        listed: NDArray[np.int32],
        some: blocks.Blocks,
        n_sweeps: int,
        retry: bool,
    ) -> int:
        bundles = surface, self._quadrics, self._watch, scratch, self.rules
        colour = kernels.state.STALE_EVEN
        return int(kernels.sweep.sweep(*bundles, listed, some, n_sweeps, colour, retry))

    def _let_all_be_looked_at(self) -> None:
        """Give all faces that wait for a sweep the colour that the next one does not have."""
        state = kernels.state
        self._surface.face_state[self._surface.face_state == state.STALE_EVEN] = state.STALE_ODD

    # --- by cost ----------------------------------------------------------------------------------

    def rank(self) -> None:
        """Bring the costs of the edges up to date."""
        self._rank(1)

    def _rank(self, step: int) -> None:
        """Bring the costs of every so many-th face up to date."""
        bundles, n_faces = (self._surface, self._quadrics, self.rules, self._cost), self._n_rows

        def task(part: slice) -> None:
            last = min(part.stop * step, n_faces)
            kernels.cost.rank(*bundles, start_scratch(0, 0, 0), part.start * step, last, step)

        n_ranked = -(-n_faces // step)
        self._crew.share(task, n_ranked, part_size(n_ranked))

    def sweep_ranked(
        self,
        thresholds: NDArray[np.float64],
        progress: Progress | None = None,
        done: float = 0.0,
        *,
        lenience: float = 1.0,
        divided: bool = False,
    ) -> int:
        """Sweep with each threshold in turn, and contract edges that cost less.

        Parameters
        ----------
        thresholds : ndarray, shape (k,), float64
            Ascending.
        progress : callable, optional
        done : float
            What to tell it.
        lenience : float
            So many times the threshold an edge may cost where it makes triangles worse.
        divided : bool
            Sweep over blocks. Each of them may lose its share of the faces that may go.

        Returns
        -------
        int
            Number of contractions.
        """
        all_blocks, listed = (
            self._divide() if divided else (blocks.whole(self._n_rows, self._n_spare), IN_ORDER)
        )

        def task(surface: Surface, scratch: Scratch, some: blocks.Blocks) -> int:
            bundles = surface, self._quadrics, self._watch, scratch, self.rules
            lists = self._cost, thresholds, lenience, listed
            return int(kernels.sweep.sweep_ranked(*bundles, *lists, some, self._colour))

        if divided:
            n_cheaper = self._count_cheaper(all_blocks, listed, thresholds[-1])
            blocks.allot(all_blocks, self._n_spare, n_cheaper)
            n_contracted = self._share(task, all_blocks, progress, (done, done))
        else:
            n_contracted = task(self._surface, self._scratch, all_blocks)
            if progress is not None:
                progress("contract", done)
        self._scratch.point[kernels.state.MAX_COST] = thresholds[-1]
        self._scratch.point[kernels.state.MAX_PRICE] = lenience * thresholds[-1]
        self.n_sweeps += 1
        if len(thresholds) % 2 == 0:
            self._change_colour()
        n_contracted += self._unblock_deferred()
        self._change_colour()
        return n_contracted

    def _count_cheaper(
        self, some: blocks.Blocks, listed: NDArray[np.int32], threshold: float
    ) -> NDArray[np.int64]:
        """About how many edges of each block cost less than a threshold."""
        n_cheaper = np.zeros(len(some), np.int64)

        def count(part: slice) -> None:
            kernels.cost.count_cheaper(self._cost, listed, some[part], threshold, n_cheaper[part])

        self._crew.share(count, len(some), blocks.AT_ONCE)
        return n_cheaper

    def _change_colour(self) -> None:
        """Take the other colour for the faces that are touched next, where costs are kept."""
        self._colour = kernels.state.MOVED_EVEN + kernels.state.MOVED_ODD - self._colour

    def negligible_cost(self) -> float:
        """A cost below which edges need no order: flat parts would take many sweeps otherwise."""
        box = self._arranged.box
        low, high = kernels.order.bounds(self._surface.vertices) if box is None else box
        nothing2 = NOTHING**2 * float(((high - low) ** 2).sum()) if self.n_faces else 0.0
        if self._quadrics is None or self.rules.by_length:
            return nothing2
        return nothing2 * self._area / max(1, self.n_faces)

    def sample_of_costs(self) -> NDArray[np.float32]:
        """Costs of some of the edges that may be contracted, ascending."""
        assert self._cost is not None
        n_faces = self._n_rows
        step = max(1, n_faces // SAMPLE)
        self._rank(step)
        costs = np.empty(3 * -(-n_faces // step), np.float32)
        n = kernels.cost.collect_costs(self._cost, self._surface.face_state, step, costs)
        return np.sort(costs[:n])

    def forget_refusals(self) -> None:
        """Let all edges be ranked and tried again."""
        state = kernels.state
        untouched = state.STALE_ODD if self._colour == state.MOVED_EVEN else state.STALE_EVEN
        is_ranked = self._surface.face_state == state.RANKED
        self._surface.face_state[is_ranked] = untouched
        assert self._cost is not None
        self._cost[kernels.cost.LEAST :: kernels.cost.COLUMNS][is_ranked] = -np.inf

    # --- threads ----------------------------------------------------------------------------------

    def _divide(self) -> blocks.Division:
        """Divide the live faces, in the one way and in the other in turn."""
        assert self._cells is not None
        surface, division, self._division = self._surface, self._division, None
        if division is None or self.n_sweeps > 0:
            if len(self._room) < self._n_rows:
                self._room = memory.empty(self._n_rows, np.int32)
            division = blocks.divide(
                *(self._cells, self.n_sweeps % 2, surface.corner_vertex, surface.vertex_block),
                *(self._room, self._crew),
            )
        on_loops = self._vertices_on_loops()
        kernels.loops.find_loop_homes(
            on_loops, surface.loop, surface.vertex_block, surface.loop_home
        )
        return division

    def _unite(self) -> None:
        """Make one block of all faces again."""
        surface, self._division = self._surface, None
        surface.vertex_block[:] = 0
        surface.loop_home[:] = 0
        on_loops = self._vertices_on_loops()
        kernels.loops.count_loop_edges(on_loops, surface.loop, surface.loop_size)

    def _vertices_on_loops(self) -> NDArray[np.int32]:
        """The boundary vertices that are left."""
        n = kernels.loops.follow_merges(self._surface.merged_into, self._on_loops)
        self._on_loops = self._on_loops[:n]
        return self._on_loops

    def _share(
        self,
        task: Callable[[Surface, Scratch, blocks.Blocks], int],
        all_blocks: blocks.Blocks,
        progress: Progress | None,
        span: tuple[float, float],
    ) -> int:
        """Do a task for blocks, some at once, each time with a tally and a log of its own.

        Returns the number of contractions.
        """
        assert self._cells is not None
        at_once = max(1, min(self._cells.at_once, len(all_blocks) // LEAST_TASKS))
        ends = all_blocks[at_once - 1 :: at_once, 1].tolist()
        ends = [*ends, int(all_blocks[-1, 1])]
        room = max(end - begin for begin, end in pairwise([0, *ends]))

        def do(part: slice) -> Done:
            def contract(surface: Surface, scratch: Scratch) -> int:
                return task(surface, scratch, all_blocks[part])

            return self._desks.do(contract, self._surface, room)

        def tell(name: str, done: float) -> None:
            assert progress is not None
            progress("contract", span[0] + (span[1] - span[0]) * done)

        crew = Crew(self.n_threads, None if progress is None else tell)
        all_done = crew.share(do, len(all_blocks), at_once)
        for done in all_done:
            add_up(done, self._surface, self._scratch)
        self._unite()
        return sum(done.n_contracted for done in all_done)

    def mesh(self) -> Mesh:
        """The live faces, with all vertices under their old numbers."""
        corner_vertex = self._surface.corner_vertex.reshape(-1, 3)
        live = corner_vertex[:, 0] != kernels.corners.DEAD
        arranged = self._arranged
        faces = arranged.vertex_origin[corner_vertex[live]]
        return Mesh(self._surface.vertices[arranged.vertex_place, :3], faces)

    def do_without_log(self) -> None:
        """Keep no log of the merges, before the run: nobody will ask for `vertex_weights`."""
        self._surface = self._surface._replace(merges=np.empty((0, 2)))
        self._desks = Desks(len(self._scratch.mark), keep_log=False)

    def vertex_weights(self) -> VertexWeights:
        """How the merged vertices are made of those given."""
        n = self.tally("N_SIMPLE") + self.tally("N_NESTED")
        origin, place = self._arranged.vertex_origin, self._arranged.vertex_place
        merged_into = np.append(origin, np.int32(-1))[self._surface.merged_into[place]]
        merges = self._surface.merges[:n].copy()
        merges[:, 0] = origin[merges[:, 0].astype(np.int64)]
        return VertexWeights(merged_into, merges)

    @cached_property
    def result(self) -> Result:
        """The live part, renumbered in the order given, and what is left in it. Ends the run."""
        edges, reasons = self._remaining_edges()
        self._compact(linked=False)
        crew = self._crew
        mesh, vertex_map, face_map, number = collect(
            self._surface, self._arranged, self._face_origin, crew
        )
        self._number = number
        shortest, longest = edge_extremes(mesh, crew)
        stop = self._stop(reasons, longest)
        return Result(*mesh, vertex_map, face_map, number[edges], reasons, shortest, stop)

    def let_go(self) -> None:
        """Keep nothing but the result and the counters: what follows needs memory, too."""
        self._scratch = start_scratch(0, 0, 0)._replace(tally=self._scratch.tally)
        del self._surface, self._quadrics, self._cost, self._watch, self._desks
        del self._arranged, self._cells, self._division, self._face_origin, self._room

    def vertex_errors(self) -> NDArray[np.float64]:
        """Root mean squared distances of the vertices of the result from the planes merged there.

        Shape (n,); empty without quadrics.
        """
        n_used = len(self.result.vertices)
        if self._quadrics is None:
            return np.empty(0)
        return vertex_errors(self._quadrics, self._number, n_used, self._crew)

    def _stop(self, reasons: NDArray[np.str_], longest_edge: float) -> str:
        """The criterion that ended the run; "exhausted" when all that is left is forbidden."""
        options, state = self.options, kernels.state
        if self.has_enough:
            return "target_faces" if options.target_faces == self.min_faces else "keep_ratio"
        is_open = np.repeat(self._surface.face_state != state.SETTLED, 3)
        is_held = is_open & (self._surface.verdict == state.ERROR_BOUND)
        if "error_bound" in reasons or (options.max_edge_length is None and is_held.any()):
            return "max_error" if options.max_error is not None else "max_quadric_error"
        length = options.max_edge_length
        return "max_edge_length" if length is not None and longest_edge >= length else "exhausted"

    def _remaining_edges(self) -> tuple[NDArray[np.int32], NDArray[np.str_]]:
        """The short edges that are left, and the reasons found when they were last tried."""
        surface, state = self._surface, kernels.state
        if self.options.max_edge_length is None or self.is_part:
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
        a, b = surface.vertices[edges.T, :3]
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
        self._unblock(rules, commit=False)

    def _unblock_deferred(self) -> int:
        """Contract blocked edges, where they are to be contracted at all."""
        n_contracted = 0
        if self.rules.blocked == kernels.state.CONTRACT and self.tally("N_DEFERRED"):
            n_contracted = self._unblock(self.rules, commit=True)
        self._scratch.tally[kernels.state.N_DEFERRED] = 0
        return n_contracted

    def _unblock(self, rules: Rules, *, commit: bool) -> int:
        state = kernels.state
        bundles = self._surface, self._quadrics, self._watch, self._scratch, rules, self._cost
        whole = blocks.whole(self._n_rows, self._n_spare)
        colour = state.STALE_ODD if self._cost is None else self._colour
        return int(kernels.sweep.unblock(*bundles, self._outer, whole, colour, commit))

    def compact_when_half(self) -> None:
        """Drop the dead faces when they are more than the live ones."""
        if 2 * self.n_faces < self._n_rows:
            self._compact()
            self._watch = self._new_watch()

    def _compact(self, *, linked: bool = True) -> None:
        """Drop the dead faces. The last time corners need not be linked."""
        crew = self._crew
        self._surface, self._cost, self._face_origin, source = compact(
            self._surface, self._cost, self._face_origin, crew, linked=linked
        )
        if linked and self._cells is not None:
            self._cells = blocks.copy_live(self._cells, source, crew)
