"""What is told of a result: topology, shape, distances, quality."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.comparison.inputs import Input
from tetsimplify.decimators.length import area_of
from tetsimplify.distance import DirectedDistance, surface_distance
from tetsimplify.intersections import self_intersections
from tetsimplify.mesh import Mesh
from tetsimplify.quality import quality
from tetsimplify.targets import Target
from tetsimplify.topology import TopologyReport, topology

MOST_EDGES = 1000  # that are listed with their places
HISTOGRAM_BINS = 40

Floats = NDArray[np.float64]


class Reference:
    """An input, with all that results are compared to."""

    def __init__(self, given: Input) -> None:
        self.given = given
        self.target = Target(given.mesh)
        self.normals = normals(given.mesh)
        self.area = area_of(given.mesh)
        self.volume = signed_volume(given.mesh)

    def measure(self, result: Mesh, short_length: float, tolerance: float) -> dict[str, Any]:
        """All figures of a result.

        Parameters
        ----------
        result : Mesh
            Checked, without unreferenced vertices, with one face at least.
        short_length : float
            Shorter edges are counted.
        tolerance : float
            Of the bounds of the largest distance, in diagonals of the input.
        """
        return {
            **self._topology(result),
            **self._shape(result, short_length),
            "n_flipped_faces": n_flipped(result, self.target, self.normals),
            "n_self_intersections": self_intersections(*result).n_pairs,
            "distance": self._distance(result, tolerance * self.given.diagonal),
            "volume_change": self._volume_change(result),
            "area_change": area_of(result) / self.area - 1.0 if self.area else None,
        }

    def _topology(self, result: Mesh) -> dict[str, Any]:
        before, after = self.given.topology, topology(*result)
        violating = violating_edges(result, has_boundary=not before.is_closed)
        return {
            "n_vertices": after.n_vertices,
            "n_faces": after.n_faces,
            "edge_degrees": {str(k): n for k, n in sorted(after.edge_degrees.items())},
            "n_violating_edges": len(violating),
            "violating_edges": result.vertices[violating[:MOST_EDGES]].reshape(-1, 6).tolist(),
            "n_nonmanifold_vertices": len(after.non_manifold_vertices),
            "euler_characteristic": after.euler_characteristic,
            "n_components": after.n_components,
            "n_boundary_loops": after.n_boundary_loops,
            "n_duplicate_faces": len(after.duplicate_faces),
            "topology_kept": after.same_topology(before),
            "why_not": differences(before, after),
        }

    def _shape(self, result: Mesh, short_length: float) -> dict[str, Any]:
        found = quality(*result)
        histogram = found.histogram("radius_ratio", HISTOGRAM_BINS)
        return {
            "n_degenerate_faces": len(found.zero_area_faces),
            "shortest_edge": float(found.edge_length.min(initial=np.inf)),
            "short_length": short_length,
            "n_short_edges": int((found.edge_length < short_length).sum()),
            "quality": {
                "mean_ratio": float(found.radius_ratio.mean()),
                "min_angle_degrees": float(found.min_angle.min()),
                "mean_valence_deviation": found.topological_criterion,
                "histogram": {
                    "edges": histogram.edges.tolist(),
                    "counts": histogram.counts.tolist(),
                },
            },
        }

    def _distance(self, result: Mesh, tolerance: float) -> dict[str, Any]:
        found = surface_distance(result, self.given.mesh, tolerance=tolerance)
        return {
            "to_input": directed(found.a_to_b),
            "from_input": directed(found.b_to_a),
            "mean": found.mean,
            "rms": found.rms,
            "lower": found.lower,
            "upper": found.upper,
        }

    def _volume_change(self, result: Mesh) -> float | None:
        """Of what a closed surface encloses; None of others."""
        if not self.given.topology.is_closed or self.volume == 0.0:
            return None
        return signed_volume(result) / self.volume - 1.0


def directed(distance: DirectedDistance) -> dict[str, float]:
    """One direction."""
    return {name: getattr(distance, name) for name in ("mean", "rms", "lower", "upper")}


def violating_edges(mesh: Mesh, *, has_boundary: bool) -> NDArray[np.int32]:
    """Edges of degree other than 2, or 1 where there was a boundary before.

    Faces that name a vertex twice do not count.

    Returns
    -------
    ndarray, shape (k, 2), int32
        Vertices, the lower one first; sorted.
    """
    a, b, c = mesh.faces.T
    faces = mesh.faces[(a != b) & (b != c) & (c != a)]
    ends = np.sort(np.concatenate([faces[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]), axis=1)
    keys = ends[:, 0].astype(np.int64) * len(mesh.vertices) + ends[:, 1]
    found, degrees = np.unique(keys, return_counts=True)
    violating = found[(degrees > 2) | ((degrees == 1) & (not has_boundary))]
    return np.column_stack(np.divmod(violating, len(mesh.vertices))).astype(np.int32)


def differences(before: TopologyReport, after: TopologyReport) -> list[str]:
    """What has become of the topology, each in a short phrase; empty where it was kept."""
    found = []
    for degree, n in sorted(after.edge_degrees.items()):
        if degree > 2 or (degree == 1 and before.is_closed):
            found.append(f"{n:,} {'edge' if n == 1 else 'edges'} of degree {degree}")
    for name, one, several in (
        ("non_manifold_vertices", "non-manifold vertex", "non-manifold vertices"),
        ("inconsistent_edges", "edge of clashing orientation", "edges of clashing orientation"),
        ("duplicate_faces", "duplicate face", "duplicate faces"),
        ("degenerate_faces", "face with a vertex twice", "faces with a vertex twice"),
    ):
        if n := len(getattr(after, name)):
            found.append(f"{n:,} {one if n == 1 else several}")
    for name, words in (
        ("euler_characteristic", "Euler characteristic"),
        ("n_components", "components"),
        ("n_boundary_loops", "boundary loops"),
    ):
        old, new = getattr(before, name), getattr(after, name)
        if old != new:
            found.append(f"{words} {old:,} -> {new:,}")
    if not found and not after.same_topology(before):
        found.append("Euler characteristics of the components")
    return found


def normals(mesh: Mesh) -> Floats:
    """Normals of all faces, as long as twice their areas."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def signed_volume(mesh: Mesh) -> float:
    """What a closed surface encloses, seen from the middle of its vertices."""
    if not len(mesh.faces):
        return 0.0
    middle = mesh.vertices.mean(axis=0)
    first = mesh.vertices[mesh.faces[:, 0]] - middle
    return float(np.einsum("ij,ij->", first, normals(mesh)) / 6.0)


def n_flipped(result: Mesh, target: Target, given: Floats) -> int:
    """Number of faces whose normal is opposite to that of the input nearest to their centre.

    Parameters
    ----------
    result : Mesh
    target : Target
        The input.
    given : ndarray, shape (m, 3), float64
        Normals of the faces of the input, of any length.
    """
    centres = target.frame.enter(result.vertices[result.faces].mean(axis=1))
    nearest = np.empty(len(centres), np.int32)
    source = kernels.distance.Source(
        vertices=centres,
        faces=result.faces,
        vertex_distance=np.empty(len(centres)),
        vertex_nearest=nearest,
        centre_distance=np.empty(0),
        centre_nearest=np.empty(0, np.int32),
    )
    every = np.arange(len(centres), dtype=np.int32)
    stack = kernels.nearest.Stack.new()
    kernels.distance.measure_vertices(target.arrays, source, every, stack)
    return int((np.einsum("ij,ij->i", normals(result), given[nearest]) < 0.0).sum())
