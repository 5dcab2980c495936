"""Edge lengths and numbers of faces, one from the other."""

from __future__ import annotations

import math

import numpy as np

from tetsimplify.decimators.method import Goal
from tetsimplify.mesh import Mesh


def area_of(mesh: Mesh) -> float:
    """The area of all faces."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def equilateral_edge(area: float, n_faces: int) -> float:
    """The edge length of equilateral triangles, of which so many have this area together."""
    return math.sqrt(4.0 / math.sqrt(3.0) * area / max(n_faces, 1))


def length_for(mesh: Mesh, goal: Goal) -> float:
    """The edge length to remesh to, so that about the number of faces of the goal results."""
    assert goal.target_faces is not None
    return equilateral_edge(area_of(mesh), goal.target_faces)
