"""The only place where input arrays are cast and checked.

Everything behind this border may rely on C-contiguous native arrays: vertices (n, 3)
float64, faces (m, 3) int32 with indices in range.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify.errors import MeshError, OptionError, VolumeError
from tetsimplify.mesh import Mesh

MAX_CORNERS = 2**31 - 1  # corners and vertices are indexed by int32


def as_mesh(vertices: ArrayLike, faces: ArrayLike, *, finite: bool = True) -> Mesh:
    """Cast and check a mesh.

    Parameters
    ----------
    vertices : array_like, shape (n, 3), any real dtype
        Positions.
    faces : array_like, shape (m, 3), any integer dtype
        Vertex indices.
    finite : bool
        Refuse NaN and infinite positions.

    Returns
    -------
    Mesh
        The arrays given where they have the right type already, copies otherwise.

    Raises
    ------
    MeshError
        When a shape, a dtype, a position or an index is wrong. The message says which.
    """
    positions = _as_array("vertices", vertices, "real numbers", "biuf")
    indices = _as_array("faces", faces, "integers", "iu")
    if len(positions) > MAX_CORNERS or 3 * len(indices) > MAX_CORNERS:
        raise MeshError(
            f"at most {MAX_CORNERS:,} vertices and as many face corners can be indexed, "
            f"got {len(positions):,} and {3 * len(indices):,}"
        )
    if len(indices):
        low, high = int(indices.min()), int(indices.max())
        if low < 0 or high >= len(positions):
            wrong = np.flatnonzero(((indices < 0) | (indices >= len(positions))).any(axis=1))
            raise MeshError(
                f"faces must hold vertex indices from 0 to {len(positions) - 1}, got {low} to "
                f"{high} (faces {listed(wrong)})"
            )
    positions = np.ascontiguousarray(positions, dtype=np.float64)
    if finite and not np.isfinite(positions).all():
        wrong = np.flatnonzero(~np.isfinite(positions).all(axis=1))
        raise MeshError(f"vertices must be finite, got NaN or infinity at vertices {listed(wrong)}")
    return Mesh(positions, np.ascontiguousarray(indices, dtype=np.int32))


def _as_array(name: str, values: ArrayLike, kind: str, dtype_kinds: str) -> NDArray[Any]:
    array = np.asarray(values)
    if array.size == 0 and array.ndim <= 2:  # [] has no shape and no integer dtype
        array = array.reshape(0, 3).astype(np.int32)
    if array.ndim != 2 or array.shape[1] != 3:
        letter = "n" if name == "vertices" else "m"
        raise MeshError(f"{name} must have shape ({letter}, 3), got {array.shape}")
    if array.dtype.kind not in dtype_kinds:
        raise MeshError(f"{name} must be {kind}, got dtype {array.dtype}")
    return array


def as_vertex_mask(name: str, vertices: ArrayLike | None, n_vertices: int) -> NDArray[np.bool_]:
    """Cast a choice of vertices, a boolean mask or indices, to a mask of shape (n_vertices,)."""
    mask = np.zeros(n_vertices, np.bool_)
    if vertices is None:
        return mask
    chosen = np.asarray(vertices)
    if chosen.dtype == np.bool_:
        if chosen.shape != (n_vertices,):
            raise OptionError(f"{name} must have shape ({n_vertices},), got {chosen.shape}")
        return chosen.copy()
    if chosen.size == 0:
        return mask
    if chosen.ndim != 1 or chosen.dtype.kind not in "iu":
        raise OptionError(
            f"{name} must be a boolean mask or a list of vertex indices, got an array of "
            f"dtype {chosen.dtype} and shape {chosen.shape}"
        )
    low, high = int(chosen.min()), int(chosen.max())
    if low < 0 or high >= n_vertices:
        raise OptionError(
            f"{name} must hold vertex indices from 0 to {n_vertices - 1}, got {low} to {high}"
        )
    mask[chosen] = True
    return mask


def listed(items: NDArray[Any], limit: int = 5) -> str:
    """The first of some indices or pairs of indices, for a message."""
    text = ", ".join(str(item) for item in items[:limit].tolist())
    return text if len(items) <= limit else f"{text}, ... ({len(items):,} in all)"


def as_volume(volume: Any) -> Any:
    """Check that a volume has three axes of at least two real samples each.

    Anything with ``shape``, ``dtype`` and slices is taken as it is, other things as arrays.
    """
    if not all(hasattr(volume, name) for name in ("shape", "dtype", "__getitem__")):
        volume = np.asarray(volume)
    if len(volume.shape) != 3 or min(volume.shape) < 2:
        raise VolumeError(
            "volume must have shape (n0, n1, n2) with at least 2 samples along each axis, got "
            f"{tuple(volume.shape)}"
        )
    if np.dtype(volume.dtype).kind not in "biuf":
        raise VolumeError(f"volume must hold real numbers, got dtype {volume.dtype}")
    return volume


def as_triple(name: str, values: ArrayLike, *, positive: bool = False) -> NDArray[np.float64]:
    """Cast three finite numbers, one for each axis."""
    try:
        triple = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise OptionError(f"{name} must be three finite numbers, got {values!r}") from error
    if triple.shape != (3,) or not np.isfinite(triple).all():
        raise OptionError(f"{name} must be three finite numbers, got {values!r}")
    if positive and not (triple > 0).all():
        raise OptionError(f"{name} must be positive, got {values!r}")
    return triple


def as_data(
    name: str, data: Mapping[str, ArrayLike] | None, n_elements: int
) -> dict[str, NDArray[Any]]:
    """Cast named arrays that have one row for each vertex or face."""
    if not isinstance(data, Mapping | None):
        raise OptionError(f"{name} must be a dict of arrays by name, got {type(data).__name__}")
    arrays = {key: np.asarray(values) for key, values in (data or {}).items()}
    for key, array in arrays.items():
        if array.ndim == 0 or len(array) != n_elements:
            raise OptionError(
                f"{name}[{key!r}] must have shape ({n_elements}, ...), got {array.shape}"
            )
    return arrays
