"""The worst spots of a simplified mesh, where it is far from the mesh given, are lowered.

Samples of the surface given tell where it is far from the faces that are left, not where one of
these is far from it: across a hollow the samples are near to its other faces. So points on all
faces are measured, too, about at first, exactly where they may be among the worst. Then the corners
of the face with the worst spot move, so that it comes nearer to the other surface, if everything
around stays nearer than the spot was; then those of the next one. See kernels/spots.py and
kernels/lowering.py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels, memory
from tetsimplify.crew import Crew
from tetsimplify.mesh import Mesh

if TYPE_CHECKING:
    from tetsimplify.kernels.patches import Patches
    from tetsimplify.kernels.spots import Made

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

VERTICES = 2**10  # in a part
PER_GIVEN = 6  # faces that are looked at for each one given, at most
CANDIDATES = 2**7  # vertices that are measured exactly, at most
TRIES = 12  # at lowering a spot, at most
LEAST = 0.75  # of the largest distance: what is worth it
LEAST_HIGH = 0.4  # of the largest height of samples: from there on points given are looked at
HIGHER = 1.5  # times as far as the samples there, at most, are other points


class Spots:
    """Spots of a simplified mesh, and what is near to them of the mesh given.

    Parameters
    ----------
    made : Made
        Its vertices are moved.
    given : Mesh
        In the frame of the fit.
    vertex_map : ndarray, shape (n given,), int32
    crew : Crew
    """

    def __init__(self, made: Made, given: Mesh, vertex_map: Indices, crew: Crew) -> None:
        kernel, n = kernels.patches, len(made.surface.vertices)
        self._made, self._crew = made, crew
        first = np.zeros(n + 2, np.int32)
        n_listed = kernel.count_faces(given.faces, vertex_map, first)
        self._patches: Patches = kernel.Patches(
            given=kernel.Surface(*given),
            first=first,
            face=memory.empty(n_listed, np.int32),
            middle=memory.empty((3, n_listed + kernel.LANES), np.float32),
            reach2=np.zeros(n),
            boxes=new_boxes(n),
        )
        kernel.list_faces(vertex_map, self._patches)
        kernel.find_boxes(self._patches)
        kernels.spots.find_boxes(made)

    def lower(self, heights2: NDArray[np.float32], exact: float) -> int:
        """Lower the worst ones; return how many times one was.

        Parameters
        ----------
        heights2 : ndarray, shape (m,), float32
            The largest squared height of the samples of each face.
        exact : float
            A distance that is as good as none.
        """
        kernel, n = kernels.spots, len(self._made.surface.vertices)
        far2 = memory.empty(n)

        def measure(part: slice) -> None:
            desk = kernel.Desk.new()
            kernel.measure_about(self._made, self._patches, part.start, part.stop, desk, far2)

        self._crew.share(measure, n, VERTICES)
        of_patches = np.zeros(n, np.bool_)
        most_heights2 = float(heights2.max(initial=0.0))
        high = np.flatnonzero(heights2 > LEAST_HIGH**2 * most_heights2)
        vertices = self._made.surface.faces[high, 0]
        of_patches[vertices] = True
        np.maximum.at(far2, vertices, HIGHER**2 * heights2[high])

        n_candidates = min(CANDIDATES, n)
        worst = np.argpartition(-far2, n_candidates - 1)[:n_candidates]
        worst = worst[np.lexsort((worst, -far2[worst]))]
        candidates = kernels.lowering.Candidates(
            worst, far2[worst], of_patches[worst], np.empty(n_candidates)
        )
        limits = kernels.lowering.Limits(0.5 * most_heights2, LEAST, exact**2, TRIES)
        desk = kernel.Desk.new(PER_GIVEN * len(self._patches.given.faces))
        return int(
            kernels.lowering.lower_spots(self._made, self._patches, candidates, limits, desk)
        )


def new_boxes(n: int) -> Array:
    """Boxes around n things."""
    return np.empty((kernels.boxes.n_groups(n), 6, kernels.boxes.WIDTH))
