"""The modes of tetsimplify itself, and the standard contraction that breaks the topology.

References
----------
Ya. S. Pepko and V. V. Borisenko. Topology-preserving triangulation simplification algorithm by
edge contraction. Fundamentalnaya i prikladnaya matematika 24(3), 2023, 153-169 (in Russian).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tetsimplify.decimators.method import FACES, LENGTH, Goal, Method
from tetsimplify.mesh import Mesh


def contraction(**options: Any) -> Callable[[Mesh, Goal], Any]:
    """:func:`tetsimplify.simplify` with options, which those of the goal override."""

    def run(mesh: Mesh, goal: Goal) -> Any:
        from tetsimplify.simplify import simplify

        asked = {"target_faces": goal.target_faces, "max_edge_length": goal.max_edge_length}
        return simplify(*mesh, **{**options, **goal.options, **asked})

    return run


def method(name: str, title: str, *takes: str, **options: Any) -> Method:
    """One mode, by its options."""
    return Method(
        name=name,
        title=title,
        packages=("tetsimplify",),
        licence="MIT",
        run=contraction(**options),
        finish=lambda result: (result.vertices, result.faces),
        takes=takes,
        is_own=True,
    )


METHODS = (
    method("tetsimplify-quadric", "tetsimplify, quadric error", FACES, cost="quadric"),
    method("tetsimplify-length", "tetsimplify, edge length", FACES, LENGTH, cost="length"),
    method(
        "tetsimplify-embedded",
        "tetsimplify, quadric error, no self-intersections",
        FACES,
        cost="quadric",
        intersections="prevent",
    ),
    method(
        "standard",
        "standard contraction of short edges",
        FACES,
        LENGTH,
        cost="length",
        blocked="violate",
        foldover=None,
    ),
)
