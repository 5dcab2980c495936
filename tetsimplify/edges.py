"""Edges of a mesh and their lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.crew import Crew, part_size
from tetsimplify.mesh import Mesh


def edge_lengths(mesh: Mesh) -> NDArray[np.float64]:
    """Lengths of all edges, each taken once.

    Parameters
    ----------
    mesh : Mesh
        Degenerate faces count as the one edge that they have.

    Returns
    -------
    ndarray, shape (k,), float64
        In the units of the mesh.
    """
    a, b = (
        mesh.faces[:, corners].reshape(-1).astype(np.int64) for corners in ([0, 1, 2], [1, 2, 0])
    )
    keys = np.minimum(a, b) * len(mesh.vertices) + np.maximum(a, b)
    low, high = np.divmod(np.unique(keys[a != b]), max(len(mesh.vertices), 1))
    return np.linalg.norm(mesh.vertices[low] - mesh.vertices[high], axis=1)


def edge_extremes(mesh: Mesh, crew: Crew) -> tuple[float, float]:
    """Lengths of the shortest and of the longest edge; infinite and 0 when there is none."""

    def find(part: slice) -> tuple[float, float]:
        shortest, longest = kernels.result.edge_extremes(
            mesh.vertices, mesh.faces[part].reshape(-1)
        )
        return float(shortest), float(longest)

    found = crew.share(find, len(mesh.faces), part_size(len(mesh.faces)))
    return min((pair[0] for pair in found), default=np.inf), max(
        (pair[1] for pair in found), default=0.0
    )
