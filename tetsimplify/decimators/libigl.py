"""libigl: ``qslim`` by quadric error, ``decimate`` by edge length to midpoints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tetsimplify.decimators.method import Goal, Method
from tetsimplify.mesh import Mesh


def prepare(mesh: Mesh, goal: Goal) -> Any:
    """Columns one after the other, as it keeps them."""
    return np.asfortranarray(mesh.vertices), np.asfortranarray(mesh.faces)


def decimation(name: str) -> Callable[[Any, Goal], Any]:
    """One of its functions; both check the link condition."""

    def run(prepared: Any, goal: Goal) -> Any:
        import igl

        assert goal.target_faces is not None
        vertices, faces, *_ = getattr(igl, name)(*prepared, goal.target_faces, False)
        return vertices, faces

    return run


METHODS = tuple(
    Method(f"libigl-{name}", f"libigl, {name}", ("libigl",), "MPL-2.0", decimation(name), prepare)
    for name in ("qslim", "decimate")
)
