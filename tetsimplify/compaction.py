"""The live faces of a surface, put together."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import blocks, kernels, memory
from tetsimplify.crew import Crew

if TYPE_CHECKING:
    from tetsimplify.kernels.state import Surface


class Compacted(NamedTuple):
    """A surface without dead faces."""

    surface: Surface
    cost: NDArray[np.float32] | None
    face_origin: NDArray[np.int32]
    begin: NDArray[np.int64]
    """Where the live faces of each part of ``blocks.PART`` faces begin now."""


def compact(
    surface: Surface,
    cost: NDArray[np.float32] | None,
    face_origin: NDArray[np.int32],
    crew: Crew,
    *,
    linked: bool = True,
) -> Compacted:
    """Copy the live faces, in their order.

    Parameters
    ----------
    surface : Surface
    cost : ndarray, shape (4 m,), float32, optional
        Where costs are kept.
    face_origin : ndarray, shape (m,), int32
        Number of each face in the mesh given; see kernels/lists.py.
    crew : Crew
    linked : bool
        Whether the corners of the vertices are to be linked.
    """
    m = len(surface.face_state)

    def count(part: slice) -> int:
        return int(kernels.result.count_live_faces(surface.corner_vertex, part.start, part.stop))

    def copy(part: slice) -> None:
        kernels.result.copy_live_faces(
            *(surface, cost, face_origin, part.start, part.stop),
            *(begin[part.start // blocks.PART], place, live, live_cost, origin),
        )

    def link(part: slice) -> None:
        kernels.result.copy_links(surface, part.start, part.stop, place, live)

    begin = np.cumsum([0, *crew.share(count, m, blocks.PART)], dtype=np.int64)
    n = int(begin[-1])
    live_cost = None if cost is None else memory.empty(kernels.cost.COLUMNS * n, np.float32)
    place, origin = memory.empty(m, np.int32), memory.empty(n, np.int32)
    live = surface._replace(
        corner_vertex=memory.empty(3 * n, np.int32),
        next_corner=memory.empty(3 * n if linked else 0, np.int32),
        face_state=memory.empty(n, np.uint8),
        verdict=memory.empty(3 * n, np.uint8),
    )
    crew.share(copy, m, blocks.PART)
    if linked:
        crew.share(link, m, blocks.PART)
    return Compacted(live, live_cost, origin, begin)
