"""The one mesh type: an indexed triangle set."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

NORMALS = "normals"
"""What data of vertices are called that are their normals."""


class Mesh(NamedTuple):
    """A triangle mesh as two arrays.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3), float64
        Positions.
    faces : ndarray, shape (m, 3), int32
        Vertex indices, counter-clockwise as seen from outside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
