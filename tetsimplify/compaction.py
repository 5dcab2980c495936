"""The live faces of a surface, put together."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels, memory
from tetsimplify.crew import Crew, part_size

if TYPE_CHECKING:
    from tetsimplify.kernels.state import Surface


class Compacted(NamedTuple):
    """A surface without dead faces."""

    surface: Surface
    cost: NDArray[np.float32] | None
    face_origin: NDArray[np.int32]
    source: NDArray[np.int32]
    """Shape (n,): where each face was before."""


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
        which = part.start // at_once
        first, last = int(begin[which]), int(begin[which + 1])
        kernels.result.list_live_faces(
            surface.corner_vertex, part.start, part.stop, first, last, place, source
        )
        kernels.result.copy_live_faces(
            *(surface, cost, face_origin, source, first, last), *(live, live_cost, origin)
        )

    def link(part: slice) -> None:
        kernels.result.copy_links(
            *(surface.next_corner, source, place, part.start, part.stop), live.next_corner
        )

    at_once = part_size(m)
    begin = np.cumsum([0, *crew.share(count, m, at_once)])
    n = int(begin[-1])
    live_cost = None if cost is None else memory.empty(kernels.cost.COLUMNS * n, np.float32)
    place = memory.empty(m, np.int32)
    source, origin = memory.empty(n, np.int32), memory.empty(n, np.int32)
    live = surface._replace(
        corner_vertex=memory.empty(3 * n, np.int32),
        next_corner=memory.empty(3 * n if linked else 0, np.int32),
        face_state=memory.empty(n, np.uint8),
        verdict=memory.empty(3 * n, np.uint8),
    )
    crew.share(copy, m, at_once)
    if linked:
        crew.share(link, n, part_size(n))
    return Compacted(live, live_cost, origin, source)
