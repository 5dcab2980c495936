"""The topology of a triangle mesh: counts, Euler characteristic, genus, defects."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import adapters, kernels
from tetsimplify.arrays import as_mesh, listed

Indices = NDArray[np.int32]


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


def topology(vertices: Any, faces: ArrayLike | None = None) -> TopologyReport:
    """Tell the topology of a triangle mesh.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions; only their number matters here. Or, without faces, a mesh object of a package
        that an adapter is installed for.
    faces : array_like, shape (m, 3), integers
        Vertex indices.

    Returns
    -------
    TopologyReport

    Raises
    ------
    MeshError
        When the arrays have the wrong shape or dtype or indices are out of range.

    Examples
    --------
    >>> import tetsimplify
    >>> report = tetsimplify.topology([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> report.euler_characteristic, report.n_boundary_loops, report.edge_degrees
    (1, 1, {1: 3})
    """
    if faces is None:
        return adapters.topology(vertices)
    mesh = as_mesh(vertices, faces, finite=False)
    corner_vertex = mesh.faces.reshape(-1)
    corners = kernels.corners.link_corners(corner_vertex, len(mesh.vertices))
    return analyse(corner_vertex, *corners)[0]


def analyse(
    corner_vertex: Indices, first_corner: Indices, next_corner: Indices, longest_link: int
) -> tuple[TopologyReport, Indices]:
    """Report on a corner table, and number its boundary loops.

    Returns
    -------
    report : TopologyReport
    loop : ndarray, shape (n_vertices,), int32
        The boundary loop of each vertex, -1 inside.
    """
    found = kernels.surface.survey(corner_vertex, first_corner, next_corner, longest_link)
    irregular = np.flatnonzero(found.is_irregular).astype(np.int32)
    defects = kernels.defects.none()
    if len(irregular):
        defects = kernels.defects.inspect(
            corner_vertex, first_corner, next_corner, longest_link, found, irregular
        )
    n_loops = kernels.surface.number_loops(found.loop)
    components = kernels.surface.component_topology(
        found.component, found.euler, found.loop, n_loops
    )

    n_edges = found.n_edges + defects.n_edges
    n_boundary_edges = found.n_boundary_edges + defects.n_boundary_edges
    bad_edges = defects.non_manifold_edges[: defects.n_non_manifold_edges]
    degrees, counts = np.unique(bad_edges[:, 2], return_counts=True)
    edge_degrees = {
        1: n_boundary_edges,
        2: n_edges - n_boundary_edges - len(bad_edges),
        **dict(zip(degrees.tolist(), counts.tolist(), strict=True)),
    }
    a, b, c = corner_vertex.reshape(-1, 3).T
    report = TopologyReport(
        n_vertices=len(first_corner),
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
        degenerate_faces=np.flatnonzero((a == b) | (b == c) | (c == a)).astype(np.int32),
        unreferenced_vertices=np.flatnonzero(found.component < 0).astype(np.int32),
    )
    return report, found.loop
