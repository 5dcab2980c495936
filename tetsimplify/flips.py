"""Edges of a simplified mesh turned over: nearer to the mesh given, better triangles, no caps.

Of the two faces abc and bad at an edge ab, the faces adc and dbc are made, where that gains
something: see kernels/flips.py. It is looked for in parts that depend on the mesh alone. Then edges
are turned over one after the other, those first that gain most, each only if the topology allows it
as it is by then: its new ends have no edge yet, its old ones keep enough faces. So the result is
the same for any number of threads.

An edge stays where both of its ends are held, and none comes to be between two vertices that are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels, memory
from tetsimplify.crew import Crew

if TYPE_CHECKING:
    from tetsimplify.kernels.flips import Flipper
    from tetsimplify.kernels.samples import Samples

Array = NDArray[np.float64]
Indices = NDArray[np.int32]
Numbers = NDArray[np.int64]
Mask = NDArray[np.uint8]

VERTICES = 2**12  # in a part
AT_ONCE = 2**15  # corners or faces in a part, where little is to be done

SHAPE = 0.5  # weight of the sum of 2 r/R, beside the change of the error: -1 to 1
LEAST = 0.03  # gain
LEAST_FLAT = 0.01  # 2 r/R that two faces in a plane must gain
WORST = 0.3  # 2 r/R below which no triangle may become worse than the worse one was
FEW = 3.0  # samples of both faces: with fewer nothing is known of the error
DOUBT = 3.0  # with so many samples the change of the error counts by half
RISE = 2.0  # how many times the squared error may be what it was, for a better shape
MOST_ROUNDS = 6  # in which edges of flat faces and of caps are turned over


class Table(NamedTuple):
    """A mesh and its corner table, see kernels/corners.py. It is changed in place."""

    faces: Indices
    """Shape (m, 3)."""
    first_corner: Indices
    """Shape (n,)."""
    next_corner: Indices
    """Shape (3 m,), corners in order."""


class Taken(NamedTuple):
    """The samples of a round, and what has happened since they were taken."""

    samples: Samples
    ends: NDArray[np.int64]
    """Shape (n_parts, n_groups + 1): where those of each group begin in each part."""
    group_size: int
    """Faces in a group."""
    normals: Array
    """Shape (m, 4): of the faces when the samples were taken."""
    steps: Array
    """Shape (n, 3): how far the vertices went since then."""


class Flips:
    """What is needed to turn edges over.

    Parameters
    ----------
    table : Table
    held : ndarray, shape (n,), uint8
    cos_turn : float
        Cosine of the largest angle between a new face and each of the old ones.
    exact : float
        Height that is as good as none.
    threads : int
    """

    def __init__(
        self, table: Table, held: Mask, *, cos_turn: float, exact: float, threads: int
    ) -> None:
        m = len(table.faces)
        self._table, self._held, self._crew = table, held, Crew(threads)
        self._sums = memory.cache_lines(m).view(np.float32)
        self._edges = memory.empty((3 * m, kernels.flips.N_OF_EDGE), np.float32)
        self._flipper: Flipper = kernels.flips.Flipper(
            *(cos_turn, SHAPE, LEAST, WORST, FEW, RISE, DOUBT, exact**2)
        )

    def by_samples(self, places: Array, taken: Taken, normals: Array) -> int:
        """Turn over where samples or the shape of flat faces say so; tell how many.

        Parameters
        ----------
        places : ndarray, shape (n, 3), float64
        taken : Taken
        normals : ndarray, shape (m, 4), float64
            Normals and areas, which are brought up to date.
        """

        def add_up(part: slice) -> None:
            kernels.flips.sum_tents(
                *(taken.samples, taken.ends, self._table.faces, taken.normals, taken.steps),
                *(part.start // taken.group_size, part.start, part.stop, self._sums),
            )

        stale, corners = np.ones(len(places), np.uint8), np.arange(len(self._edges))
        self._look(places, stale, corners, self._flipper)
        self._crew.share(add_up, len(self._table.faces), taken.group_size)
        n = self._turn_over(places, stale, corners, self._flipper, normals)
        flat = self._flipper._replace(shape=1.0, least=LEAST_FLAT)
        return n + self._without_samples(places, stale, flat, normals)

    def of_caps(self, places: Array, stale: Mask, normals: Array) -> int:
        """Turn over the longest sides of caps; tell how many.

        Parameters
        ----------
        places : ndarray, shape (n, 3), float64
        stale : ndarray, shape (n,), uint8
            The vertices of caps are marked, as of `find_thin`.
        normals : ndarray, shape (m, 4), float64
            As of `by_samples`.
        """
        caps = self._flipper._replace(least=0.5 * kernels.flips.CAP_GAIN)
        return self._without_samples(places, stale, caps, normals)

    def _without_samples(self, places: Array, stale: Mask, flipper: Flipper, normals: Array) -> int:
        """Turn over around marked vertices as long as something is gained."""
        total = 0
        for _ in range(MOST_ROUNDS):
            corners = np.flatnonzero(stale[self._table.faces])
            if not len(corners):
                break
            self._look(places, stale, corners, flipper)
            self._sums[corners // 3, kernels.flips.COUNT] = 0.0
            total += self._turn_over(places, stale, corners, flipper, normals)
        return total

    def _look(self, places: Array, stale: Mask, corners: Numbers, flipper: Flipper) -> None:
        """Tell what turning over edges of marked vertices would do; `corners` are those of all."""
        faces, *links = self._table

        def look(part: slice) -> None:
            kernels.flips.look_at_edges(
                *(places, faces.reshape(-1), tuple(links), self._held, stale, flipper),
                *(part.start, part.stop, self._sums, self._edges),
            )

        self._edges[corners, kernels.flips.LIFT] = kernels.flips.NO_EDGE
        self._crew.share(look, len(places), VERTICES)

    def _turn_over(
        self, places: Array, stale: Mask, corners: Numbers, flipper: Flipper, normals: Array
    ) -> int:
        """Turn over what gains something, and mark the vertices of what has changed."""
        faces, *links = self._table
        gains = memory.empty(len(corners), np.float32)

        def find_gains(part: slice) -> None:
            kernels.flips.find_gains(
                *(corners, self._edges, self._table.next_corner, self._sums, flipper),
                *(part.start, part.stop, gains),
            )

        self._crew.share(find_gains, len(gains), AT_ONCE)
        found = np.flatnonzero(gains)
        order = corners[found[np.argsort(-gains[found], kind="stable")]]
        stale.fill(0)
        touched = np.zeros(len(faces), np.uint8)
        return int(
            kernels.flips.turn_over(
                order, places, faces.reshape(-1), tuple(links), touched, stale, normals
            )
        )


def find_thin(places: Array, faces: Indices, crew: Crew) -> Mask:
    """Mark the vertices of faces whose normal cannot be told; shape (n,), uint8.

    Parameters
    ----------
    places : ndarray, shape (n, 3), float64
    faces : ndarray, shape (m, 3), int32
    crew : Crew
    """
    thin = np.zeros(len(places), np.uint8)

    def mark(part: slice) -> None:
        kernels.flips.mark_thin(places, faces, part.start, part.stop, thin)

    crew.share(mark, len(faces), AT_ONCE)
    return thin
