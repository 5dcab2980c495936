"""The standard decimators behind one signature."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tetsimplify.arrays import as_mesh
from tetsimplify.decimators import LENGTH, METHODS, Goal, Method
from tetsimplify.errors import MissingExtraError, OptionError
from tetsimplify.mesh import Mesh

__all__ = ["METHODS", "Goal", "Method", "chosen", "run", "simplify"]


def simplify(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    method: str | Method,
    keep_ratio: float | None = None,
    target_faces: int | None = None,
    max_edge_length: float | None = None,
    **options: Any,
) -> Mesh:
    """Simplify a mesh with one of the decimators in :data:`METHODS`.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions, finite.
    faces : array_like, shape (m, 3), integers
        Vertex indices. What a mesh must be is for the method to say.
    method : str or Method
        A name in :data:`METHODS`: one of our modes, ``"standard"``, or a program of others. Or one
        of your own.
    keep_ratio, target_faces, max_edge_length : float, int, float, optional
        A part of the faces, a number of faces, or a length in the units of the vertices: exactly
        one of them. Lengths are taken by the methods whose `takes` has ``"length"``.
    **options
        Further options of :func:`tetsimplify.simplify`, for the methods that are its own.

    Returns
    -------
    Mesh
        As the method left it, in float64 and int32, without vertices that no face uses. Its
        topology may be broken, and the number of faces may be another than that asked for.

    Raises
    ------
    OptionError
        When there is no such method, when it does not take the criterion or the options, or when
        not exactly one criterion is given.
    MeshError
        When the arrays are no mesh, or what the method returns is none.
    MissingExtraError
        When the package of the method is not installed.

    Examples
    --------
    >>> import tetsimplify.standard
    >>> from tetsimplify.comparison.models import model
    >>> sphere = model("sphere", 2000)
    >>> result = tetsimplify.standard.simplify(*sphere, method="standard", target_faces=500)
    >>> len(result.faces)
    500
    """
    found = chosen([method])[0]
    mesh = as_mesh(vertices, faces)
    given = (keep_ratio, target_faces, max_edge_length)
    if sum(criterion is not None for criterion in given) != 1:
        raise OptionError("give exactly one of keep_ratio, target_faces, max_edge_length")
    if options and not found.is_own:
        raise OptionError(f"{found.name} takes no options of tetsimplify, got {', '.join(options)}")
    if keep_ratio is not None:
        target_faces = faces_to_keep(keep_ratio, len(mesh.faces))
    goal = Goal(target_faces, max_edge_length, options)
    if goal.kind not in found.takes and goal.kind != LENGTH:
        raise OptionError(f"{found.name} starts from a volume, not from a mesh")
    if goal.kind not in found.takes:
        able = ", ".join(name for name, other in METHODS.items() if goal.kind in other.takes)
        raise OptionError(f"{found.name} does not go by edge length; these do: {able}")
    if found.version is None:
        raise MissingExtraError(f"the method {found.name}", " and ".join(found.packages), "compare")
    return run(found, mesh, goal)


def run(method: Method, mesh: Mesh, goal: Goal) -> Mesh:
    """Prepare, run and finish one method; what comes of it is checked."""
    return as_result(*method.finish(method.run(method.prepare(mesh, goal), goal)))


def as_result(vertices: Any, faces: Any) -> Mesh:
    """The arrays of a decimator as a mesh without unreferenced vertices.

    Raises
    ------
    MeshError
        When they are no mesh.
    """
    mesh = as_mesh(vertices, np.asarray(faces, np.int64))
    is_used = np.zeros(len(mesh.vertices), np.bool_)
    is_used[mesh.faces] = True
    number = np.cumsum(is_used, dtype=np.int32) - np.int32(1)
    return Mesh(mesh.vertices[is_used], number[mesh.faces])


def chosen(methods: Sequence[str | Method] | None) -> list[Method]:
    """The methods of some names, or all of them.

    Raises
    ------
    OptionError
        When a name is unknown.
    """
    if methods is None:
        return list(METHODS.values())
    unknown = [each for each in methods if isinstance(each, str) and each not in METHODS]
    if unknown:
        raise OptionError(
            f"there is no method {', '.join(unknown)}; there are {', '.join(METHODS)}"
        )
    found = [METHODS[each] if isinstance(each, str) else each for each in methods]
    return list({method.name: method for method in found}.values())


def faces_to_keep(keep_ratio: float, n_faces: int) -> int:
    """The number of faces that a part of them makes.

    Raises
    ------
    OptionError
        When the part is not above 0 and at most 1.
    """
    is_number = isinstance(keep_ratio, (int, float)) and not isinstance(keep_ratio, bool)
    if not is_number or not 0.0 < keep_ratio <= 1.0:
        raise OptionError(f"keep_ratio must be above 0 and at most 1, got {keep_ratio!r}")
    return math.ceil(keep_ratio * n_faces)
