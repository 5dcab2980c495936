"""Isosurfaces of volumes from files, simplified while they are read."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.io.surfaces import to_world
from tetsimplify.io.volume import Volume
from tetsimplify.streaming import SimplifiedIsosurface, extract_and_simplify

SKEW = 1e-9  # cosine of the angle between two axes that counts as a right one


def has_right_angles(volume: Volume) -> bool:
    """Whether lengths in the world are those on a grid with spacings: the axes are upright."""
    axes, _ = _axes(volume)
    return bool(np.abs(axes.T @ axes - np.eye(3)).max() < SKEW)


def simplified_isosurface_of(
    volume: Volume, level: float | str, **options: Any
) -> SimplifiedIsosurface:
    """Extract and simplify an isosurface, and place it in the world.

    Parameters
    ----------
    volume : Volume
        Whose axes have right angles in the world, see :func:`has_right_angles`.
    level, options
        See :func:`tetsimplify.extract_and_simplify`; `max_edge_length` is in units of the world.

    Returns
    -------
    SimplifiedIsosurface
        In world coordinates. Normals point to the side asked for, whether the transform mirrors or
        not.

    Raises
    ------
    VolumeError, OptionError
        See :func:`tetsimplify.extract_and_simplify`.
    """
    slowest_first = volume.slowest_first()
    axes, lengths = _axes(slowest_first)
    result = extract_and_simplify(slowest_first.data, level, spacing=lengths.tolist(), **options)
    placed = np.eye(4)
    placed[:3, :3], placed[:3, 3] = axes, slowest_first.affine[:3, 3]
    faces = result.faces
    if np.linalg.det(axes) < 0:
        faces = np.ascontiguousarray(faces[:, ::-1])
    return result._replace(vertices=to_world(result.vertices, placed), faces=faces)


def _axes(volume: Volume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The directions of the axes in the world, as columns, and the spacings along them."""
    columns = volume.affine[:3, :3]
    lengths: NDArray[np.float64] = np.linalg.norm(columns, axis=0)
    return columns / lengths, lengths
