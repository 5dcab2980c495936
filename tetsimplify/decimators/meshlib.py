"""MeshLib: ``decimateMesh`` by error and by edge length. Its licence is for non-commercial use."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tetsimplify.decimators.method import FACES, LENGTH, Goal, Method
from tetsimplify.mesh import Mesh

LICENCE = "non-commercial"


def prepare(mesh: Mesh, goal: Goal) -> Any:
    """A mesh of its own."""
    from meshlib import mrmeshnumpy

    return mrmeshnumpy.meshFromFacesVerts(mesh.faces, mesh.vertices)


def decimation(strategy: str) -> Callable[[Any, Goal], Any]:
    """In one part and one thread, by one of its strategies."""

    def run(mesh: Any, goal: Goal) -> Any:
        from meshlib import mrmeshpy

        settings = mrmeshpy.DecimateSettings()
        settings.strategy = getattr(mrmeshpy.DecimateStrategy, strategy)
        settings.subdivideParts = 1
        if goal.max_edge_length is not None:
            settings.maxError = goal.max_edge_length
        else:
            assert goal.target_faces is not None
            n_faces = mesh.topology.numValidFaces()
            settings.maxDeletedFaces = max(0, n_faces - goal.target_faces)
        mrmeshpy.decimateMesh(mesh, settings)
        return mesh

    return run


def finish(mesh: Any) -> tuple[Any, Any]:
    """The arrays of what is valid."""
    from meshlib import mrmeshnumpy

    mesh.pack()
    return mrmeshnumpy.getNumpyVerts(mesh), mrmeshnumpy.getNumpyFaces(mesh.topology)


METHODS = (
    Method(
        "meshlib-error",
        "MeshLib, least error",
        ("meshlib",),
        LICENCE,
        decimation("MinimizeError"),
        prepare,
        finish,
        precision="float32",
    ),
    Method(
        "meshlib-length",
        "MeshLib, shortest edge",
        ("meshlib",),
        LICENCE,
        decimation("ShortestEdgeFirst"),
        prepare,
        finish,
        takes=(FACES, LENGTH),
        precision="float32",
    ),
)
