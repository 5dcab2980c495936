"""What comes out of :func:`tetsimplify.simplify` and :func:`tetsimplify.repair`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.options import Options
from tetsimplify.topology import TopologyReport


@dataclass(frozen=True)
class RepairReport:
    """How often :func:`tetsimplify.repair` had to do what."""

    degenerate_faces_dropped: int = 0
    duplicate_faces_dropped: int = 0
    unreferenced_vertices_dropped: int = 0
    edges_split: int = 0
    """Edges whose faces were taken apart: of more than two faces, or not orientable."""
    vertices_split: int = 0
    """Vertices that had to be given copies."""
    vertices_added: int = 0
    """These copies."""
    faces_flipped: int = 0


class Repaired(NamedTuple):
    """A repaired mesh; see :func:`tetsimplify.repair`."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    vertex_map: NDArray[np.int32]
    """Shape (old n,): new index of each old vertex, the first copy where it was split, -1 where
    it was dropped."""
    face_map: NDArray[np.int32]
    """Shape (new m,): old index of each new face."""
    vertex_origin: NDArray[np.int32]
    """Shape (new n,): old index of each new vertex."""
    report: RepairReport


@dataclass(frozen=True, eq=False)
class SimplificationReport:
    """What :func:`tetsimplify.simplify` did."""

    options: Options
    stop: str
    """The criterion that was reached: ``"target_faces"``, ``"keep_ratio"``, ``"max_error"``,
    ``"max_quadric_error"`` or ``"max_edge_length"``; ``"exhausted"`` where none was, and topology
    and guards allow no more."""
    n_simple: int
    """Contractions of edges that the link condition allows."""
    n_nested: int
    """Contractions that had to remove the inside of nested 3-cycles."""
    n_lens_vertices: int
    """Vertices removed inside nested 3-cycles."""
    n_lens_faces: int
    """Faces removed in nested contractions."""
    n_sweeps: int
    """In the last round."""
    n_rounds: int
    """How often all was done, with ever tighter bounds; 1 without ``max_error``."""
    seconds: dict[str, float]
    """Time of each stage."""
    topology_before: TopologyReport
    """Of the mesh given, after repair where that was asked for."""
    topology_after: TopologyReport
    shortest_edge_before: float
    """Infinite for a mesh without faces."""
    shortest_edge_after: float
    remaining_edges: NDArray[np.int32] = field(repr=False)
    """Shape (k, 2): every edge of the result that is shorter than ``max_edge_length``, none where
    that is not given."""
    remaining_reasons: NDArray[np.str_] = field(repr=False)
    """Shape (k,): why each is left: ``"obstructed"`` (proven impossible), ``"removal_limit"``,
    ``"foldover"``, ``"normal_deviation"``, ``"shape"``, ``"intersection"``, ``"locked"``,
    ``"error_bound"``, ``"target_faces"`` (there were few enough), or ``"skipped"`` with
    ``blocked="skip"``."""
    repairs: RepairReport | None = None
    """What was repaired, None where repair was not asked for."""

    @property
    def remaining(self) -> dict[str, int]:
        """How many short edges are left for which reason."""
        reasons, counts = np.unique(self.remaining_reasons, return_counts=True)
        return dict(zip(reasons.tolist(), counts.tolist(), strict=True))

    @property
    def n_contractions(self) -> int:
        """Contractions of both kinds."""
        return self.n_simple + self.n_nested


class Simplification(NamedTuple):
    """A simplified mesh; see :func:`tetsimplify.simplify`."""

    vertices: NDArray[np.float64]
    """Shape (n, 3)."""
    faces: NDArray[np.int32]
    """Shape (m, 3)."""
    vertex_map: NDArray[np.int32]
    """Shape (old n,): new index of the vertex that each old one became, -1 where removed."""
    face_map: NDArray[np.int32]
    """Shape (m,): old index of each new face."""
    report: SimplificationReport
    vertex_data: dict[str, NDArray[Any]]
    """Shapes (n, ...): the vertex data given, carried over."""
    face_data: dict[str, NDArray[Any]]
    """Shapes (m, ...): the face data given, carried over."""
