"""meshoptimizer: ``simplify``, by quadric error, to vertices of the input."""

from __future__ import annotations

from typing import Any

import numpy as np

from tetsimplify.decimators.method import Goal, Method
from tetsimplify.mesh import Mesh

NO_LIMIT = 1e9  # of the error, so that the number of faces decides


def prepare(mesh: Mesh, goal: Goal) -> Any:
    """Single precision and unsigned indices are all that it takes."""
    return mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32).reshape(-1)


def run(prepared: Any, goal: Goal) -> Any:
    """Without options."""
    import meshoptimizer

    vertices, indices = prepared
    out = np.empty_like(indices)
    assert goal.target_faces is not None
    n_indices = meshoptimizer.simplify(
        out,
        indices,
        vertices,
        target_index_count=3 * goal.target_faces,
        target_error=NO_LIMIT,
        options=0,
    )
    return vertices, out[:n_indices].reshape(-1, 3)


METHODS = (
    Method(
        "meshoptimizer",
        "meshoptimizer",
        ("meshoptimizer",),
        "MIT",
        run,
        prepare,
        precision="float32",
    ),
)
