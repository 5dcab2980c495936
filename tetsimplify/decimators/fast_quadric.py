"""The "fast quadric mesh simplification" of S. Forstmann, in its three Python packages."""

from __future__ import annotations

from typing import Any

from tetsimplify.decimators.method import Goal, Method
from tetsimplify.mesh import Mesh

AGGRESSION = 7  # the default of all three: how fast the threshold grows


def run_fast_simplification(mesh: Mesh, goal: Goal) -> Any:
    """With its defaults."""
    import fast_simplification

    return fast_simplification.simplify(
        mesh.vertices, mesh.faces, target_count=goal.target_faces, agg=AGGRESSION, lossless=False
    )


def prepare_pyfqmr(mesh: Mesh, goal: Goal) -> Any:
    """Its object holds the mesh."""
    import pyfqmr

    simplifier = pyfqmr.Simplify()
    simplifier.setMesh(mesh.vertices, mesh.faces)
    return simplifier


def run_pyfqmr(simplifier: Any, goal: Goal) -> Any:
    """With its defaults."""
    simplifier.simplify_mesh(
        target_count=goal.target_faces,
        aggressiveness=AGGRESSION,
        preserve_border=False,
        verbose=False,
    )
    return simplifier


def prepare_trimesh(mesh: Mesh, goal: Goal) -> Any:
    """As it is: vertices are not merged."""
    import trimesh

    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def run_trimesh(mesh: Any, goal: Goal) -> Any:
    """Its own call, which merges vertices at the end."""
    return mesh.simplify_quadric_decimation(face_count=goal.target_faces, aggression=AGGRESSION)


METHODS = (
    Method(
        "fast-simplification",
        "fast-simplification",
        ("fast-simplification",),
        "MIT",
        run_fast_simplification,
    ),
    Method(
        "pyfqmr",
        "pyfqmr",
        ("pyfqmr",),
        "MIT",
        run_pyfqmr,
        prepare_pyfqmr,
        lambda simplifier: simplifier.getMesh()[:2],
    ),
    Method(
        "trimesh",
        "trimesh (fast-simplification)",
        ("trimesh", "fast-simplification"),
        "MIT",
        run_trimesh,
        prepare_trimesh,
        lambda mesh: (mesh.vertices, mesh.faces),
    ),
)
