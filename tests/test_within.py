"""Simplification within a distance, checked by sampling, which shares nothing with the proof."""

import math

import numpy as np
import pytest

import meshes
import models
import naive
import strategies
import tetsimplify
from data import data_dir, needs_data
from test_simplify import assert_maps_fit, assert_same_topology
from tetsimplify import io

MOST_PAIRS = 2_000_000  # of points and triangles; of more points some are left out


def points_on(vertices, faces, n):
    """The points of a grid on every face, corners and sides among them."""
    i, j = np.mgrid[0 : n + 1, 0 : n + 1].reshape(2, -1)
    keep = i + j <= n
    weights = np.stack([i, j, n - i - j], axis=1)[keep] / n
    return np.einsum("kw,fwx->fkx", weights, vertices[faces]).reshape(-1, 3)


def distances_to_triangles(points, triangles):
    """Distance of points from a set of triangles, every pair looked at."""
    a, b, c = (triangles[None, :, k] for k in range(3))
    p = points[:, None]

    def to_segment(u, v):
        along = v - u
        square = np.maximum((along * along).sum(-1), 1e-300)
        t = np.clip(((p - u) * along).sum(-1) / square, 0.0, 1.0)
        return np.linalg.norm(p - u - t[..., None] * along, axis=-1)

    nearest = np.minimum(np.minimum(to_segment(a, b), to_segment(b, c)), to_segment(c, a))
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=-1), 1e-300)
    height = ((p - a) * normal).sum(-1) / length
    is_inside = np.ones(height.shape, bool)
    for u, v in ((a, b), (b, c), (c, a)):
        is_inside &= (np.cross(v - u, p - u) * normal).sum(-1) >= 0.0
    return np.where(is_inside, np.abs(height), nearest).min(axis=1)


def sampled_distance(a, b, n=3):
    """A lower bound of the two-sided distance of two small meshes."""
    farthest = 0.0
    for one, other in ((a, b), (b, a)):
        points = points_on(one[0], one[1], n)
        points = points[:: math.ceil(len(points) * len(other[1]) / MOST_PAIRS)]
        for block in np.array_split(points, math.ceil(len(points) * len(other[1]) / 2e6)):
            distances = distances_to_triangles(block, other[0][other[1]])
            farthest = max(farthest, float(distances.max()))
    return farthest


@pytest.mark.parametrize("part", [0.1, 0.01, 0.001])
def test_no_point_is_farther_than_the_limit(part):
    n_fewer = 0
    for seed in range(12):
        vertices, faces = strategies.adversarial_mesh(seed)
        limit = part * float(np.linalg.norm(np.ptp(vertices, axis=0)))
        result = tetsimplify.simplify(vertices, faces, max_error=limit)
        assert_same_topology(faces, result)
        assert_maps_fit(vertices, faces, result)
        assert sampled_distance((vertices, faces), result[:2]) <= limit * (1 + 1e-9)
        n_fewer += len(faces) - len(result.faces)
    assert n_fewer > 0 or part < 0.01


def test_a_quadric_error_is_no_distance_and_a_proven_one_is():
    """A bumpy sphere: mean distances hide the tips, the proof does not."""
    vertices, faces = meshes.icosphere(4)
    rng = np.random.default_rng(0)
    vertices = vertices * np.where(rng.random((len(vertices), 1)) < 0.05, 1.15, 1.0)
    mean = tetsimplify.simplify(vertices, faces, max_quadric_error=0.04)
    proven = tetsimplify.simplify(vertices, faces, max_error=0.04)
    assert sampled_distance((vertices, faces), mean[:2], 1) > 0.04
    assert sampled_distance((vertices, faces), proven[:2]) <= 0.04
    assert proven.report.n_rounds > 1
    assert proven.report.stop == "max_error"
    assert len(proven.faces) < len(faces)


def test_flat_and_smooth_parts_get_few_faces():
    vertices, faces = meshes.icosphere(5)
    result = tetsimplify.simplify(vertices, faces, max_error=0.01)
    assert len(result.faces) < len(faces) / 20
    assert sampled_distance((vertices, faces), result[:2], 1) <= 0.01


def test_the_target_may_be_reached_first():
    vertices, faces = meshes.icosphere(4)
    result = tetsimplify.simplify(vertices, faces, max_error=0.5, target_faces=1000)
    assert (len(result.faces), result.report.stop) == (1000, "target_faces")


def test_edge_length_with_an_error_bound():
    vertices, faces = tetsimplify.extract_isosurface(models.gyroid(16, 1.0), 0.0)
    result = tetsimplify.simplify(
        vertices, faces, max_edge_length=3.0, max_error=0.05, cost="length"
    )
    assert sampled_distance((vertices, faces), result[:2], 1) <= 0.05
    assert result.report.remaining["error_bound"] > 0
    assert naive.summary(result.faces).is_sound


def test_an_error_that_allows_nothing_leaves_the_mesh():
    vertices, faces = tetsimplify.extract_isosurface(
        np.random.default_rng(0).normal(size=(6, 6, 6)), 0.0
    )
    result = tetsimplify.simplify(vertices, faces, max_error=1e-7)
    assert sampled_distance((vertices, faces), result[:2], 1) <= 1e-7
    with pytest.raises(tetsimplify.OptionError, match="max_error must be at least"):
        tetsimplify.simplify(vertices, faces, max_error=0.0)


def test_empty_and_tiny_meshes():
    assert len(tetsimplify.simplify([], [], max_error=1.0).faces) == 0
    assert len(tetsimplify.simplify(*meshes.tetrahedron(), max_error=1.0).faces) == 4


@needs_data
def test_a_real_mesh():
    from scipy.spatial import cKDTree

    mesh = io.read_mesh(data_dir() / "meshes" / "skull_yj.ply")
    limit = 1e-3 * float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    result = tetsimplify.simplify(*mesh, max_error=limit)
    assert len(result.faces) < len(mesh.faces) / 3
    assert result.report.topology_after.same_topology(result.report.topology_before)
    # of both surfaces: samples near triangles, those around the nearest few samples
    for one, other in ((mesh, result[:2]), (result[:2], mesh)):
        triangles = other[0][other[1]]
        samples = points_on(*other, 4)
        tree = cKDTree(samples)
        points = points_on(*one, 1 if len(one[1]) > len(other[1]) else 4)[::29]
        near = tree.query(points, 24)[1] // (len(samples) // len(triangles))
        for point, candidates in zip(points, near, strict=True):
            assert distances_to_triangles(point[None], triangles[candidates])[0] <= limit
