"""Edges of a mesh and their lengths."""

from __future__ import annotations

import numpy as np

from tetsimplify.edges import edge_lengths
from tetsimplify.mesh import Mesh

POINTS = np.array([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0.0]])


def test_every_edge_once():
    mesh = Mesh(POINTS, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    assert sorted(edge_lengths(mesh)) == [3, 3, 4, 4, 5]


def test_duplicate_and_degenerate_faces():
    mesh = Mesh(POINTS, np.array([[0, 1, 2], [2, 1, 0], [0, 0, 3], [1, 1, 1]], np.int32))
    assert sorted(edge_lengths(mesh)) == [3, 4, 4, 5]


def test_no_faces():
    assert len(edge_lengths(Mesh(POINTS, np.empty((0, 3), np.int32)))) == 0
    assert len(edge_lengths(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)))) == 0
