"""Edges of a mesh and their lengths."""

from __future__ import annotations

import numpy as np
import pytest

from tetsimplify import crew
from tetsimplify.crew import Crew
from tetsimplify.edges import edge_extremes, edge_lengths
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


@pytest.mark.parametrize("threads", [1, 3])
def test_extremes_are_those_of_all_edges(threads, monkeypatch):
    monkeypatch.setattr(crew, "LARGEST_PART", 7)
    rng = np.random.default_rng(0)
    mesh = Mesh(rng.random((30, 3)), rng.integers(0, 30, (50, 3)).astype(np.int32))
    mesh.faces[:, 1] = (mesh.faces[:, 0] + 1) % 30  # no degenerate faces
    mesh.faces[:, 2] = (mesh.faces[:, 0] + 2) % 30
    lengths = edge_lengths(mesh)
    extremes = edge_extremes(mesh, Crew(threads))
    assert extremes == pytest.approx((lengths.min(), lengths.max()), rel=1e-12)


def test_extremes_of_nothing():
    mesh = Mesh(POINTS, np.empty((0, 3), np.int32))
    assert edge_extremes(mesh, Crew(1)) == (np.inf, 0.0)
