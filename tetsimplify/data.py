"""What vertices carry besides their position, through the contractions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels

NORMALS = ("normal", "normals")
"""Names of vertex data, capitals aside, that are directions: they are given unit length again."""

WEDGE = "\0"
"""Before the names of data of face corners among vertex data, which may have the same names."""

SHORTEST = 1e-6  # of its length: what is left of a normal that has a direction still


class VertexWeights(NamedTuple):
    """How the vertices of a result are made of those given."""

    merged_into: NDArray[np.int32]
    """Shape (n,): the vertex that each one was merged into, itself where it was not."""
    merges: NDArray[np.float64]
    """Shape (k, 2): the vertices merged, in order, and where the new vertex lies: from 0, at the
    vertex that stays, to 1, at the one that is merged."""

    def carry(
        self, data: dict[str, NDArray[Any]], vertex_map: NDArray[np.int32]
    ) -> dict[str, NDArray[Any]]:
        """Data of the result: floats interpolated, all else from the nearer end.

        Interpolated normals are shorter than what they are made of. They get unit length again;
        where they cancel out it is the normal from the nearer end.

        Parameters
        ----------
        data : dict of ndarray, shapes (n, ...)
        vertex_map : ndarray, shape (n,), int32
            New index of each old vertex, -1 where removed.
        """
        n = len(self.merged_into)
        survives = (self.merged_into == np.arange(n)) & (vertex_map >= 0)
        nearest = np.arange(n, dtype=np.int32)
        kernels.carry.follow(self.merges, self.merged_into, nearest)
        carried = {}
        for name, values in data.items():
            if values.dtype.kind == "f":
                rows = values.reshape(n, -1).astype(np.float64)
                kernels.carry.interpolate(self.merges, self.merged_into, rows)
                rows = rows[survives]
                if is_normals(name, values):
                    _restore_length(rows, values[nearest[survives]])
                carried[name] = rows.astype(values.dtype).reshape(-1, *values.shape[1:])
            else:
                carried[name] = values[nearest[survives]]
        return carried


def is_normals(name: str, values: NDArray[Any]) -> bool:
    """Whether data of a name are normals."""
    has_shape = values.dtype.kind == "f" and values.ndim == 2 and values.shape[1] == 3
    return has_shape and name.removeprefix(WEDGE).lower() in NORMALS


def _restore_length(rows: NDArray[np.float64], nearest: NDArray[Any]) -> None:
    """Give the rows that are not those of the nearest vertex unit length."""
    mixed = np.flatnonzero((rows != nearest).any(axis=1))
    lengths = np.linalg.norm(rows[mixed], axis=1)
    cancelled = lengths < SHORTEST * np.linalg.norm(nearest[mixed], axis=1)
    rows[mixed[cancelled]] = nearest[mixed[cancelled]]
    lengths = np.linalg.norm(rows[mixed], axis=1)
    rows[mixed] /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
