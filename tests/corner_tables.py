"""What a corner table has to be, see ``kernels/corners.py``."""

import numpy as np

from tetsimplify.kernels.corners import DEAD


def assert_in_order(corner_vertex, next_corner, on_boundary):
    """The live corners of each vertex are one circle, anticlockwise with a gap on a boundary."""
    live = np.flatnonzero(corner_vertex != DEAD)
    following = next_corner.copy()
    while (dead := corner_vertex[following] == DEAD)[live].any():
        following[dead] = next_corner[following[dead]]
    vertex, to = corner_vertex[live], following[live]
    assert np.array_equal(corner_vertex[to], vertex)
    assert len(np.unique(to)) == len(live)

    faces = corner_vertex.reshape(-1, 3)
    ahead, behind = np.roll(faces, -1, axis=1).reshape(-1), np.roll(faces, 1, axis=1).reshape(-1)
    n_gaps = np.bincount(vertex[behind[live] != ahead[to]], minlength=len(on_boundary))
    has_corners = np.bincount(vertex, minlength=len(on_boundary)) > 0
    assert np.array_equal(n_gaps[has_corners], on_boundary[has_corners].astype(int))

    first = np.full(len(on_boundary), -1)
    first[vertex] = live
    corner, n_steps = following[first[vertex]], np.ones(len(live), int)
    while (underway := corner != first[vertex]).any():
        corner[underway] = following[corner[underway]]
        n_steps += underway
    assert np.array_equal(n_steps, np.bincount(vertex)[vertex])


def assert_engine_in_order(engine):
    """The same of the surface that an engine works on."""
    surface = engine._surface
    assert_in_order(surface.corner_vertex, surface.next_corner, surface.loop >= 0)
