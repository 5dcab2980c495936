"""What vertices carry besides their position, through the contractions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels


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
                rows = rows[survives].astype(values.dtype)
                carried[name] = rows.reshape(-1, *values.shape[1:])
            else:
                carried[name] = values[nearest[survives]]
        return carried
