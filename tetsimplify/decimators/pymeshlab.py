"""pymeshlab: decimation by quadric error, and isotropic remeshing.

All parameters are given: those that are not would have the values of the last call.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tetsimplify.decimators.length import length_for
from tetsimplify.decimators.method import Goal, Method
from tetsimplify.mesh import Mesh


def prepare(mesh: Mesh, goal: Goal) -> Any:
    """Its set holds the mesh."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.faces))
    return meshes


def finish(meshes: Any) -> tuple[Any, Any]:
    """The arrays of what is not deleted."""
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def decimation(preserve_topology: bool) -> Callable[[Any, Goal], Any]:
    """By quadric error, without cleaning up afterwards."""

    def run(meshes: Any, goal: Goal) -> Any:
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=goal.target_faces,
            targetperc=0.0,
            qualitythr=0.3,
            preserveboundary=False,
            boundaryweight=1.0,
            preservenormal=False,
            preservetopology=preserve_topology,
            optimalplacement=True,
            planarquadric=False,
            planarweight=0.001,
            qualityweight=False,
            autoclean=False,
            selected=False,
        )
        return meshes

    return run


def prepare_remeshing(mesh: Mesh, goal: Goal) -> Any:
    """The set, and the edge length that should give the number of faces."""
    return prepare(mesh, goal), length_for(mesh, goal)


def remesh(prepared: Any, goal: Goal) -> Any:
    """Splits, collapses, flips, smoothing and projection, ten times."""
    import pymeshlab

    meshes, length = prepared
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=10,
        adaptive=False,
        selectedonly=False,
        targetlen=pymeshlab.PureValue(length),
        featuredeg=30.0,
        checksurfdist=False,
        maxsurfdist=pymeshlab.PureValue(length),
        splitflag=True,
        collapseflag=True,
        swapflag=True,
        smoothflag=True,
        reprojectflag=True,
    )
    return meshes


METHODS = (
    Method(
        "pymeshlab-quadric",
        "pymeshlab, quadric",
        ("pymeshlab",),
        "GPL-3.0",
        decimation(preserve_topology=False),
        prepare,
        finish,
    ),
    Method(
        "pymeshlab-topology",
        "pymeshlab, quadric, preservetopology",
        ("pymeshlab",),
        "GPL-3.0",
        decimation(preserve_topology=True),
        prepare,
        finish,
    ),
    Method(
        "pymeshlab-remeshing",
        "pymeshlab, isotropic remeshing",
        ("pymeshlab",),
        "GPL-3.0",
        remesh,
        prepare_remeshing,
        finish,
        meets_count=False,
    ),
)
