r"""Drawing triangles into a depth buffer.

A pixel belongs to the triangle that is nearest to the eye at its centre::

        c
       / \          weights of a, b, c at p: the areas of the triangles opposite to them,
      / p \         p b c : p c a : p a b, so they add up to one
     a-----b
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tetsimplify.kernels.jit import kernel


@kernel
def draw_triangles(
    points: NDArray[np.float64],
    faces: NDArray[np.int32],
    depth: NDArray[np.float64],
    face_at: NDArray[np.int32],
    weight_at: NDArray[np.float32],
) -> None:
    """Draw the triangles that turn their front to the eye.

    Parameters
    ----------
    points : ndarray, shape (n, 3), float64
        Column, row and depth of each vertex in pixels; depth grows away from the eye.
    faces : ndarray, shape (m, 3), int32
        Triangles; those with negative area in (column, row) face the eye, as rows go down.
    depth : ndarray, shape (rows, columns), float64
        Depth of each pixel so far; lowered where a triangle is nearer.
    face_at : ndarray, shape (rows, columns), int32
        Receives the triangle seen in each pixel.
    weight_at : ndarray, shape (rows, columns, 2), float32
        Receives the weights of its first two corners.
    """
    n_rows, n_columns = depth.shape
    for fi in range(len(faces)):
        a, b, c = points[faces[fi, 0]], points[faces[fi, 1]], points[faces[fi, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= 0:
            continue
        first_column = max(int(np.ceil(min(a[0], b[0], c[0]))), 0)
        last_column = min(int(np.floor(max(a[0], b[0], c[0]))), n_columns - 1)
        first_row = max(int(np.ceil(min(a[1], b[1], c[1]))), 0)
        last_row = min(int(np.floor(max(a[1], b[1], c[1]))), n_rows - 1)
        for row in range(first_row, last_row + 1):
            for column in range(first_column, last_column + 1):
                wa = ((b[0] - column) * (c[1] - row) - (b[1] - row) * (c[0] - column)) / area
                wb = ((c[0] - column) * (a[1] - row) - (c[1] - row) * (a[0] - column)) / area
                wc = 1.0 - wa - wb
                if wa < 0 or wb < 0 or wc < 0:
                    continue
                z = wa * a[2] + wb * b[2] + wc * c[2]
                if z < depth[row, column]:
                    depth[row, column] = z
                    face_at[row, column] = fi
                    weight_at[row, column, 0] = wa
                    weight_at[row, column, 1] = wb
