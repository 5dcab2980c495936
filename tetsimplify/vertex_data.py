"""Data of the vertices of isosurfaces: gradient normals and values of other volumes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.errors import OptionError
from tetsimplify.march import Block, March, Rows
from tetsimplify.mesh import NORMALS
from tetsimplify.planes import Planes, as_sliceable
from tetsimplify.workers import Workers

N_VERTICES_OF_PART = 2**16


def as_fields(
    vertex_data: Mapping[str, Any] | None, shape: tuple[int, int, int], has_normals: bool
) -> dict[str, Any]:
    """Check volumes whose values are wanted at the vertices.

    Raises
    ------
    OptionError
        When one has another shape than the volume, holds no real numbers or has the name of the
        normals.
    """
    fields = {name: as_sliceable(field) for name, field in (vertex_data or {}).items()}
    for name, field in fields.items():
        if tuple(field.shape) != tuple(shape) or np.dtype(field.dtype).kind not in "biuf":
            raise OptionError(
                f"vertex_data[{name!r}] must hold real numbers and have the shape of the volume, "
                f"{tuple(shape)}, got {field.dtype} and {tuple(field.shape)}"
            )
    if has_normals and NORMALS in fields:
        raise OptionError(f"vertex_data[{NORMALS!r}] is what vertex_normals makes")
    return fields


class VertexData:
    """Data of the vertices of one or several surfaces, block by block."""

    def __init__(self, fields: dict[str, Any], has_normals: bool, workers: Workers) -> None:
        self._fields = {name: Planes(field, name) for name, field in fields.items()}
        self._has_normals, self._workers = has_normals, workers

    @property
    def is_wanted(self) -> bool:
        """Whether there are any."""
        return self._has_normals or bool(self._fields)

    def rows(self) -> dict[str, Rows]:
        """Where the data of a surface go."""
        rows = {name: Rows(np.float64) for name in self._fields}
        return {NORMALS: Rows(np.float64, 3), **rows} if self._has_normals else rows

    def take(self, block: Block) -> dict[str, NDArray[np.float64]]:
        """The planes of a block from all volumes."""
        planes = block.first, block.first + len(block.samples)
        return {name: field.take(*planes, self._workers) for name, field in self._fields.items()}

    def add(
        self,
        block: Block,
        fields: dict[str, NDArray[np.float64]],
        march: March,
        is_new: slice,
        rows: dict[str, Rows],
    ) -> None:
        """Interpolate the data of vertices that are new."""
        edges, ratios = march.edges.rows, march.ratios.rows
        for of_name in rows.values():
            of_name.extend(is_new.stop)

        def interpolate(part: tuple[int, int]) -> None:
            own = slice(*part)
            where = march.tables, edges[own], ratios[own]
            for name, of_name in rows.items():
                if name == NORMALS and self._has_normals:
                    kernels.vertex_data.gradient_normals(
                        block.samples,
                        block.first,
                        block.n_planes,
                        *where,
                        march.frame,
                        march.above,
                        of_name.rows[own],
                    )
                else:
                    kernels.vertex_data.interpolate(
                        fields[name], block.first, *where, of_name.rows[own]
                    )

        parts = range(is_new.start, is_new.stop, N_VERTICES_OF_PART)
        pairs = [(k, min(k + N_VERTICES_OF_PART, is_new.stop)) for k in parts]
        self._workers.map(interpolate, pairs)
