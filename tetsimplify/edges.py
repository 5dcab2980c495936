"""Edges of a mesh and their lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
