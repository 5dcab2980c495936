"""The topology of a triangle mesh: counts, Euler characteristic, genus, defects."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import adapters, kernels, memory
from tetsimplify.arrays import as_mesh, listed
from tetsimplify.crew import Crew
from tetsimplify.errors import OptionError

Indices = NDArray[np.int32]

LEAST_FACES = 2**16  # starting threads for fewer takes longer than the work


@dataclass(frozen=True, eq=False)
class TopologyReport:
    """What :func:`topology` finds.

    Edges, degrees and the Euler characteristic are those of the non-degenerate faces and
    the vertices that they use.
    """

    n_vertices: int
    """All vertices, referenced or not."""
    n_faces: int
    """All faces, degenerate or not."""
    n_edges: int
    euler_characteristic: int
    n_components: int
    """Pieces connected through shared vertices."""
    n_boundary_loops: int
    """Connected pieces of the boundary."""
    n_boundary_edges: int
    edge_degrees: dict[int, int]
    """How many edges have how many faces: ``{2: 1500}`` for a closed manifold."""
    components: NDArray[np.int64] = field(repr=False)
    """Shape (n_components, 2): Euler characteristic and number of boundary loops of each,
    sorted."""
    non_manifold_edges: Indices = field(repr=False)
    """Shape (k, 2): edges with more than two faces."""
    non_manifold_vertices: Indices = field(repr=False)
    """Shape (k,): vertices whose faces form more than one fan."""
    inconsistent_edges: Indices = field(repr=False)
    """Shape (k, 2): edges whose two faces run along them in the same direction."""
    duplicate_faces: Indices = field(repr=False)
    """Shape (k,): faces with the same vertices as an earlier face."""
    degenerate_faces: Indices = field(repr=False)
    """Shape (k,): faces with a vertex twice."""
    unreferenced_vertices: Indices = field(repr=False)
    """Shape (k,): vertices that no non-degenerate face uses."""

    @property
    def is_oriented(self) -> bool:
        """Whether neighbouring faces agree on which side is outside."""
        return not len(self.inconsistent_edges)

    @property
    def is_manifold(self) -> bool:
        """Whether this is a consistently oriented 2-manifold, with or without boundary."""
        return self.defects() is None

    @property
    def is_closed(self) -> bool:
        """Whether no edge is on a boundary."""
        return self.n_boundary_edges == 0

    @property
    def genus(self) -> int | None:
        """Number of handles of all components together; None where this is no manifold."""
        if not self.is_manifold:
            return None
        return self.n_components - (self.n_boundary_loops + self.euler_characteristic) // 2

    def same_topology(self, other: TopologyReport) -> bool:
        """Whether two manifolds are homeomorphic, component by component.

        Oriented surfaces are, exactly when they have the same Euler characteristics and
        numbers of boundary loops. Where one is no manifold the answer is False.
        """
        both = self.is_manifold and other.is_manifold
        return both and np.array_equal(self.components, other.components)

    def defects(self) -> str | None:
        """What keeps the mesh from being an oriented manifold, with the first offenders."""
        found = [
            f"{len(items):,} {name}: {listed(items)}"
            for name, items in (
                ("degenerate faces", self.degenerate_faces),
                ("duplicate faces", self.duplicate_faces),
                ("edges with more than two faces", self.non_manifold_edges),
                ("edges with inconsistently oriented faces", self.inconsistent_edges),
                ("vertices with more than one fan of faces", self.non_manifold_vertices),
            )
            if len(items)
        ]
        return "; ".join(found) or None


def topology(
    vertices: Any, faces: ArrayLike | None = None, *, threads: int | None = None
) -> TopologyReport:
    """Tell the topology of a triangle mesh.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions; only their number matters here. Or, without faces, a mesh object of a package
        that an adapter is installed for.
    faces : array_like, shape (m, 3), integers
        Vertex indices.
    threads : int, optional
        How many threads to use for more than 65,536 faces; all that the process may if not given.
        The report is the same.

    Returns
    -------
    TopologyReport

    Raises
    ------
    MeshError
        When the arrays have the wrong shape or dtype or indices are out of range.
    OptionError
        When `threads` is no positive integer, or goes with a mesh object.

    Examples
    --------
    >>> import tetsimplify
    >>> report = tetsimplify.topology([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> report.euler_characteristic, report.n_boundary_loops, report.edge_degrees
    (1, 1, {1: 3})
    """
    if faces is None:
        if threads is not None:
            raise OptionError("threads go with vertices and faces, not with a mesh object")
        return adapters.topology(vertices)
    mesh = as_mesh(vertices, faces, finite=False)
    return examine(mesh.faces.reshape(-1), len(mesh.vertices), threads=threads).report


class Examined(NamedTuple):
    """What :func:`examine` finds."""

    report: TopologyReport
    loop: Indices
    """Shape (n,): the number of the boundary loop of each vertex, -1 inside."""
    on_loops: Indices
    """Shape (k,): the boundary vertices."""
    next_corner: Indices
    """Shape (3 m,): the corner table, see `kernels.corners`."""
    first_corner: Indices
    """Shape (n,): a corner of each vertex, -1 where it has none."""


def examine(corner_vertex: Indices, n_vertices: int, *, threads: int | None = None) -> Examined:
    """Link the corners of a mesh, report on its topology and number its boundary loops.

    Parameters
    ----------
    corner_vertex : ndarray, shape (3 m,), int32
        The vertex of each corner, within range.
    n_vertices : int
    threads : int, optional
        As of :func:`topology`.
    """
    crew = Crew(threads)
    n_threads = crew.n_threads if len(corner_vertex) > 3 * LEAST_FACES else 1
    numbers = [memory.empty(n_vertices, np.int32) for _ in range(6)]
    first_corner, component, euler, loop, listed, lower = numbers
    found = kernels.surface.Survey(
        first_corner=first_corner,
        next_corner=memory.empty(len(corner_vertex), np.int32),
        component=component,
        euler=euler,
        loop=loop,
        listed=listed,
        lower=lower,
    )

    def survey(part: slice) -> tuple[int, int, int]:
        arcs = np.empty((3, kernels.surface.MOST_ARCS), np.int32)
        slots = np.full((3, kernels.surface.SLOTS), -1, np.int64)
        counts: tuple[int, int, int]
        counts = kernels.surface.survey_inside(
            corner_vertex, part.start, part.stop, found, arcs, slots
        )
        return counts

    def note_special(part: slice) -> int:
        return int(
            kernels.surface.list_special(component, loop, part.start, part.stop, found.listed)
        )

    at_once = max(1, -(-n_vertices // n_threads))
    counts = crew.share(survey, n_vertices, at_once)
    n_edges = sum(part[0] for part in counts)
    rest = _joined(listed, at_once, [part[1] for part in counts])
    longest = max((part[2] for part in counts), default=0)
    n_boundary = n_degenerate = 0
    defects = kernels.defects.none()
    if len(rest):
        arcs, slot = np.empty((4, longest + 1), np.int32), memory.empty(n_vertices, np.int32)
        n_more, n_boundary, n_degenerate, n_irregular = kernels.surface.survey_rest(
            corner_vertex, found, rest, arcs, slot
        )
        n_edges += n_more
        if n_irregular:
            irregular = rest[:n_irregular]
            defects = kernels.defects.inspect(corner_vertex, found, irregular, longest)
    special = _joined(listed, at_once, crew.share(note_special, n_vertices, at_once))
    report = _report(corner_vertex, found, special, defects, n_edges, n_boundary, n_degenerate)
    on_loops = special[loop[special] >= 0]
    return Examined(report, loop, on_loops, found.next_corner, first_corner)


def _joined(listed: Indices, at_once: int, counts: list[int]) -> Indices:
    """The first few items, so many each, of parts of a list."""
    parts = [listed[i * at_once : i * at_once + n] for i, n in enumerate(counts)]
    return np.concatenate(parts) if parts else np.empty(0, np.int32)


def _report(
    corner_vertex: Indices,
    found: Any,
    special: Indices,
    defects: Any,
    n_edges: int,
    n_boundary_edges: int,
    n_degenerate: int,
) -> TopologyReport:
    """Put the report together, and number the boundary loops in `found`."""
    n_edges += defects.n_edges
    n_boundary_edges += defects.n_boundary_edges
    n_loops = kernels.surface.number_loops(found.loop, special) if n_boundary_edges else 0
    components = kernels.surface.component_topology(
        found.component, found.euler, found.loop, n_loops, special
    )
    degenerate = np.empty(0, np.int32)
    if n_degenerate:
        a, b, c = corner_vertex.reshape(-1, 3).T
        degenerate = np.flatnonzero((a == b) | (b == c) | (c == a)).astype(np.int32)
    bad_edges = defects.non_manifold_edges[: defects.n_non_manifold_edges]
    degrees, counts = np.unique(bad_edges[:, 2], return_counts=True)
    edge_degrees = {
        1: n_boundary_edges,
        2: n_edges - n_boundary_edges - len(bad_edges),
        **dict(zip(degrees.tolist(), counts.tolist(), strict=True)),
    }
    return TopologyReport(
        n_vertices=len(found.component),
        n_faces=len(corner_vertex) // 3,
        n_edges=n_edges,
        euler_characteristic=int(components[:, 0].sum()),
        n_components=len(components),
        n_boundary_loops=n_loops,
        n_boundary_edges=n_boundary_edges,
        edge_degrees={degree: count for degree, count in edge_degrees.items() if count},
        components=components[np.lexsort(components.T)],
        non_manifold_edges=bad_edges[:, :2].copy(),
        non_manifold_vertices=defects.non_manifold_vertices[: defects.n_non_manifold_vertices],
        inconsistent_edges=defects.inconsistent_edges[: defects.n_inconsistent_edges],
        duplicate_faces=np.sort(defects.duplicate_faces[: defects.n_duplicate_faces]),
        degenerate_faces=degenerate,
        unreferenced_vertices=special[found.component[special] < 0],
    )
