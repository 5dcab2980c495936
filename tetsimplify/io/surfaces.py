"""Surfaces out of volumes, in the world."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import OptionError
from tetsimplify.io.volume import Volume
from tetsimplify.mesh import NORMALS

GIVEN_BY_VOLUME = ("spacing", "origin", "bounds", "shape")


def isosurface_of(
    volume: Volume,
    level: float | str | Sequence[float | str] | None = None,
    *,
    vertex_data: Mapping[str, Any] | None = None,
    centres: Any = None,
    **options: Any,
) -> Any:
    """Extract an isosurface and place it in the world.

    Parameters
    ----------
    volume : Volume
        Samples and their transform to the world. The cubes are taken along the axis that
        is slowest in the file, so that a file is read once from start to end.
    level : float, "otsu", or a list of these
        See :func:`tetsimplify.extract_isosurface`; not given where the options have `labels`.
    vertex_data : dict of str to Volume or array_like, optional
        Other volumes of the same shape, whose values at the vertices are wanted. Arrays have
        their axes in the order of those of ``volume.data``.
    centres : array_like, optional
        Likewise.
    **options
        The other ones of :func:`tetsimplify.extract_isosurface`: `labels`, `lattice`, `closed`,
        `normals`, `refine`, `regularise`, `foldover`, `vertex_normals`, `threads`, `progress`.

    Returns
    -------
    Isosurface, or list of Isosurface or LabelSurface
        As :func:`tetsimplify.extract_isosurface` returns them, in world coordinates. Normals, of
        faces and in ``vertex_data["normals"]``, point to the side asked for, whether the
        transform mirrors or not.

    Raises
    ------
    VolumeError, OptionError
        See :func:`tetsimplify.extract_isosurface`.
    """
    from tetsimplify.isosurface import extract_isosurface

    if wrong := [name for name in GIVEN_BY_VOLUME if name in options]:
        raise OptionError(f"a volume that knows where it lies takes no {', '.join(wrong)}")
    order = volume.slowest_order()
    data, affine, _ = volume.slowest_first()
    if vertex_data:
        options["vertex_data"] = {
            name: _reordered(values, order) for name, values in vertex_data.items()
        }
    if centres is not None:
        options["centres"] = _reordered(centres, order)
    spacing = np.ones(3)
    if options.get("regularise"):  # whose guard goes by angles, as they are in the world
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
    placed = _Placed(affine, spacing)
    found = extract_isosurface(data, level, spacing=spacing.tolist(), **options)
    return [placed(one) for one in found] if isinstance(found, list) else placed(found)


def _reordered(values: Any, order: Sequence[int]) -> Any:
    samples = values.data if isinstance(values, Volume) else values
    if not hasattr(samples, "transpose"):
        samples = np.asarray(samples)
    return samples.transpose(order) if len(samples.shape) == 3 else samples


class _Placed:
    """Takes surfaces from the grid to the world.

    Parameters
    ----------
    affine : ndarray, shape (4, 4), float64
        From indices to the world.
    spacing : ndarray, shape (3,), float64
        Of the grid that the surfaces are in.
    """

    def __init__(self, affine: NDArray[np.float64], spacing: NDArray[np.float64]) -> None:
        self._affine = affine.copy()
        self._affine[:3, :3] /= spacing
        self._mirrors = np.linalg.det(affine[:3, :3]) < 0

    def __call__(self, surface: Any) -> Any:
        """The same surface, in the world."""
        from tetsimplify.isosurface import Isosurface

        vertices, faces = to_world(surface.vertices, self._affine), surface.faces
        if self._mirrors:
            faces = np.ascontiguousarray(faces[:, ::-1])
        if not isinstance(surface, Isosurface):
            return type(surface)(vertices, faces, surface.label)
        data = dict(surface.vertex_data)
        if NORMALS in data:
            data[NORMALS] = self._normals(data[NORMALS])
        return Isosurface(vertices, faces, surface.level, data)

    def _normals(self, normals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gradients go the other way than points: by the transpose of the inverse."""
        inverse = np.linalg.inv(self._affine[:3, :3])
        world = np.zeros_like(normals)
        for axis in range(3):
            for index in range(3):
                world[:, axis] += inverse[index, axis] * normals[:, index]
        lengths = np.linalg.norm(world, axis=1, keepdims=True)
        return np.divide(world, lengths, where=lengths > 0, out=world)


def to_world(points: NDArray[np.float64], affine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points of a grid, shape (n, 3), in the world; the same bytes on every machine."""
    # Spelled out, since a matrix product adds up in another order on another machine.
    world = np.empty_like(points)
    for axis in range(3):
        world[:, axis] = affine[axis, 3]
        for index in range(3):
            if affine[axis, index]:
                world[:, axis] += affine[axis, index] * points[:, index]
    return world
