"""Distances between surfaces against closed forms and the oracle."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from dataclasses import fields
from fractions import Fraction

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import naive_distance as naive
import tetsimplify
from data import data_dir, needs_data
from tetsimplify import MeshError, OptionError, io, kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.distance import SurfaceDistance, exceeds, surface_distance
from tetsimplify.targets import Frame, Target

FOLDED = np.array([(0, 0, 0), (1, 0, 1), (1, 1, 0), (0, 1, 1)], np.float64)
CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
CUBE_FACES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6)]
    + [(0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
)
OTHER_CUBE_FACES = np.array(
    [(0, 1, 2), (1, 3, 2), (4, 6, 5), (6, 7, 5), (0, 4, 1), (4, 5, 1), (2, 3, 6), (3, 7, 6)]
    + [(0, 2, 4), (2, 6, 4), (1, 5, 3), (5, 7, 3)]
)


def diagonal(*surfaces):
    """Of the box around the faces of some surfaces."""
    corners = np.vstack([np.asarray(vertices)[np.unique(faces)] for vertices, faces in surfaces])
    return float(np.linalg.norm(np.ptp(corners, axis=0)))


def grid(n, rng, height=0.0):
    """A square of n * n cells, each cut along either diagonal, shuffled, with random heights."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    vertices = np.stack([x, y, height * rng.normal(size=x.shape)], axis=2).reshape(-1, 3)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    p, q = index[:-1, :-1].ravel(), index[1:, :-1].ravel()
    r, s = index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    one = rng.random(n * n)[:, None] < 0.5
    faces = [np.where(one, np.c_[p, q, r], np.c_[p, q, s])]
    faces += [np.where(one, np.c_[p, r, s], np.c_[q, r, s])]
    return vertices, rng.permutation(np.vstack(faces))


def together(*surfaces):
    """Several surfaces as one, all where they are."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in surfaces)])
    faces = [faces + k for (_, faces), k in zip(surfaces, first[:-1], strict=True)]
    return np.vstack([vertices for vertices, _ in surfaces]), np.vstack(faces)


def soup(n, rng):
    """Triangles that share vertices at random, some of them degenerate."""
    vertices = rng.random((max(3, n // 2), 3))
    return vertices, rng.integers(0, len(vertices), (n, 3))


def lattice_soup(n, rng):
    """Triangles between few lattice points: most distances are reached at several places."""
    return rng.integers(0, 3, (n, 3)).astype(np.float64), rng.integers(0, n, (n, 3))


def dented_sphere(n, rng):
    """A sphere that is neither round nor in its place."""
    vertices, faces = meshes.icosphere(n)
    return vertices * rng.uniform(0.95, 1.05, (len(vertices), 1)) + 0.02 * rng.normal(size=3), faces


def random_pair(seed):
    """Two surfaces, mostly of the same kind and near each other."""
    rng = np.random.default_rng(seed)
    kind = rng.integers(4)
    pair = []
    for _ in range(2):
        if kind == 0:
            pair.append(soup(rng.integers(1, 16), rng))
        elif kind == 1:
            pair.append(lattice_soup(rng.integers(3, 9), rng))
        elif kind == 2:
            pair.append(grid(rng.integers(1, 7), rng, 10.0 ** -rng.integers(0, 5)))
        else:
            pair.append(dented_sphere(rng.integers(0, 2), rng))
        if rng.random() < 0.1:
            kind = rng.integers(4)
    return pair[0], pair[1], rng


# ---------------------------------------------------------------------------- closed forms


def test_folded_quad_with_two_different_diagonals():
    """All vertices of each surface are on the other one, and yet they are 1 / sqrt(3) apart."""
    a, b = (FOLDED, [(0, 1, 2), (0, 2, 3)]), (FOLDED, [(0, 1, 3), (1, 2, 3)])
    distance = surface_distance(a, b, tolerance=1e-9)
    assert distance.upper == pytest.approx(1 / math.sqrt(3), rel=1e-12)
    assert distance.upper - 1e-9 <= distance.lower <= distance.upper
    for direction, other in ((distance.a_to_b, b), (distance.b_to_a, a)):
        assert not direction.vertex_distances.any()
        assert direction.point == pytest.approx([0.5, 0.5, direction.point[2]], abs=1e-8)
        mean, rms = naive.means(a, b, 64)
        assert (direction.mean, direction.rms) == pytest.approx((mean, rms), rel=2e-3)
        assert naive.distances(direction.point[None], other) == pytest.approx(direction.lower)


def test_concentric_polyhedra():
    """From a polyhedron to another, s times as large: its heights grow by the same everywhere."""
    vertices, faces = meshes.icosphere(0)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    golden = (1 + math.sqrt(5)) / 2
    regular = np.array(
        [np.roll((0, x, y * golden), k) for x in (-1, 1) for y in (-1, 1) for k in range(3)]
    ) / math.hypot(1, golden)
    vertices = regular[np.argmin(np.linalg.norm(vertices[:, None] - regular, axis=2), axis=1)]
    height = np.linalg.norm(vertices[faces[0]].mean(axis=0))  # radius of the inscribed sphere
    distance = surface_distance((vertices, faces), (1.25 * vertices, faces), tolerance=1e-9)
    inwards, outwards = distance.b_to_a, distance.a_to_b
    assert outwards.lower == pytest.approx(0.25 * height, rel=1e-12)
    assert (outwards.upper, outwards.mean, outwards.rms) == pytest.approx((outwards.lower,) * 3)
    assert inwards.lower == pytest.approx(0.25, rel=1e-12)
    assert inwards.upper <= 0.25 + 1e-9
    assert outwards.area * 1.25**2 == pytest.approx(inwards.area)


def test_sphere_and_its_refinement():
    """The cut of a face into four leaves its centre by as much as the chord leaves the circle."""
    vertices, faces = meshes.icosphere(2)
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    finer = meshes.cut_into_four(vertices, faces)
    rounder = (finer[0] / np.linalg.norm(finer[0], axis=1, keepdims=True), finer[1])
    flat = surface_distance((vertices, faces), finer)
    assert (flat.lower, flat.mean, flat.rms) == (0, 0, 0)
    assert flat.upper <= flat.tolerance
    round_ = surface_distance(rounder, (vertices, faces), tolerance=1e-7)
    sagitta = 1 - np.linalg.norm(finer[0], axis=1).min()
    assert round_.a_to_b.lower == pytest.approx(sagitta, rel=1e-12)
    assert round_.a_to_b.upper <= sagitta + 1e-7


@pytest.mark.parametrize("shift", [0.25, 1.5])
def test_shifted_cube(shift):
    moved = CUBE + (shift, 0, 0)
    distance = surface_distance((CUBE, CUBE_FACES), (moved, OTHER_CUBE_FACES), tolerance=1e-6)
    for direction in (distance.a_to_b, distance.b_to_a):
        assert direction.lower == pytest.approx(shift)
        assert direction.upper <= shift + 1e-6
        assert direction.area == pytest.approx(6)
    if shift < 0.5:  # of one face, of the four beside it, of the one that is inside
        inside = shift - 2 * shift**2 + 4 / 3 * shift**3
        mean = (shift + 2 * shift**2 + inside) / 6
        assert distance.mean == pytest.approx(mean, rel=2e-3)


def test_parallel_plates_and_a_patch():
    """The distance of a patch from a plate is that of their planes; the plate reaches farther."""
    rng = np.random.default_rng(1)
    plate, patch = grid(9, rng), grid(4, rng)
    patch[0][:] = 0.25 * patch[0] + (0.3, 0.4, 0.125)
    distance = surface_distance(patch, plate, tolerance=1e-9)
    near, far = distance.a_to_b, distance.b_to_a
    assert (near.lower, near.upper, near.mean, near.rms) == pytest.approx((0.125,) * 4, rel=1e-12)
    assert far.lower == pytest.approx(math.dist((1, 0, 0), (0.55, 0.4, 0.125)))
    assert distance.lower == far.lower
    assert near.nearest_point == pytest.approx([*near.point[:2], 0])
    areas = near.area, far.area
    assert areas == pytest.approx((1 / 16, 1))
    assert distance.mean == pytest.approx(np.average([near.mean, far.mean], weights=areas))
    assert distance.rms**2 == pytest.approx(np.average([near.rms**2, far.rms**2], weights=areas))


def test_bumps_between_the_samples():
    """Two faces against many: the mean has in it what stands where no simple rule samples."""
    n = 16
    vertices, faces = grid(n, np.random.default_rng(2))
    x, y = (n * vertices[:, :2]).T
    bumps = vertices + 0.02 * ((x % 2 == 1) & (y % 2 == 1))[:, None] * (0, 0, 1), faces
    plate = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)]), [(0, 1, 2), (0, 2, 3)]
    distance = surface_distance(plate, bumps, tolerance=1e-5)
    assert distance.b_to_a.lower == pytest.approx(0.02)
    for a, b, found, k in ((plate, bumps, distance.a_to_b, 61), (bumps, plate, distance.b_to_a, 4)):
        assert (found.mean, found.rms) == pytest.approx(naive.means(a, b, k), rel=0.02)


# ---------------------------------------------------------------------------- exactly nothing


@pytest.mark.parametrize("offset", [0, 1e6])
@pytest.mark.parametrize(
    ("a", "b"),
    [
        (meshes.torus(9, 7), meshes.torus(9, 7)),
        ((CUBE, CUBE_FACES), (CUBE, OTHER_CUBE_FACES)),
        (grid(7, np.random.default_rng(3)), grid(5, np.random.default_rng(4))),
        (grid(1, np.random.default_rng(5)), grid(40, np.random.default_rng(6))),
    ],
    ids=["same mesh", "cube", "plane", "plane of two faces"],
)
def test_identical_surfaces(a, b, offset):
    """Whatever the triangulation, nothing is left of rounding errors."""
    a, b = (a[0] + offset, a[1]), (b[0] + offset, b[1])
    distance = surface_distance(a, b)
    for direction in (distance.a_to_b, distance.b_to_a):
        assert direction.upper <= distance.tolerance
        assert (direction.lower, direction.mean, direction.rms) == (0, 0, 0)
        assert not direction.vertex_distances.any()
    if np.array_equal(a[0], b[0]):
        assert distance.upper == 0


def test_surfaces_that_are_segments_and_points():
    """Degenerate faces are the segment or the point that they are."""
    vertices = [(0, 0, 0), (1, 0, 0), (0.5, 0, 0), (0, 3, 4), (0, 3, 4), (2, 2, 2)]
    point, segment = (vertices, [(3, 4, 3)]), (vertices, [(0, 1, 2), (0, 0, 1)])
    distance = surface_distance(segment, point, tolerance=1e-9)
    assert distance.a_to_b.lower == pytest.approx(math.dist((1, 0, 0), (0, 3, 4)))
    assert distance.b_to_a.lower == distance.b_to_a.upper == distance.b_to_a.mean == 5
    assert distance.a_to_b.area == distance.b_to_a.area == 0
    assert distance.a_to_b.mean == pytest.approx(5, rel=0.02)
    assert distance.a_to_b.vertex_distances[5] == pytest.approx(math.dist((2, 2, 2), (0, 3, 4)))
    alone = surface_distance(point, point)
    assert (alone.lower, alone.upper, alone.mean) == (0, 0, 0)


def test_vertices_that_no_face_uses_do_not_count():
    vertices = np.vstack([CUBE, [(1e9, 0, 0)]])
    distance = surface_distance((vertices, CUBE_FACES), (CUBE, CUBE_FACES))
    assert distance.upper == 0
    assert distance.a_to_b.vertex_distances[-1] == pytest.approx(1e9)


def test_disjoint_components():
    ball = meshes.icosphere(1)
    two = together(ball, (ball[0] + (10, 0, 0), ball[1]))
    distance = surface_distance(two, ball)
    assert distance.b_to_a.upper == 0
    assert 10 <= distance.a_to_b.lower <= 10.1
    assert distance.a_to_b.face >= len(ball[1])


# ---------------------------------------------------------------------------- the oracle


def check_pair(a, b, tolerance, *, n=7, rounding=1e-11):
    """Compare with the oracle all that can be."""
    eps = rounding * diagonal(a, b)
    distance = surface_distance(a, b, tolerance=tolerance)
    for x, y, found in ((a, b, distance.a_to_b), (b, a, distance.b_to_a)):
        low, high = naive.largest(x, y, n)
        assert low - eps <= found.upper <= found.lower + tolerance + eps
        assert found.lower <= min(found.upper, high + eps)
        face, nearest_face = (
            (surface[0], np.asarray(surface[1])[[fi]])
            for surface, fi in ((x, found.face), (y, found.nearest_face))
        )
        assert naive.distances(found.point[None], y)[0] == pytest.approx(found.lower, abs=eps)
        assert naive.distances(found.point[None], face)[0] <= eps
        assert naive.distances(found.nearest_point[None], nearest_face)[0] <= eps
        assert math.dist(found.point, found.nearest_point) == pytest.approx(found.lower, abs=eps)
        assert found.vertex_distances == pytest.approx(naive.distances(x[0], y), abs=eps)
        assert 0 <= found.mean <= found.rms * (1 + 1e-9) <= found.upper * (1 + 1e-9) + eps
        if found.area > 0:
            means = naive.means(x, y, 10)  # a few per cent off itself
            assert (found.mean, found.rms) == pytest.approx(
                means, rel=0.1, abs=0.01 * found.upper + 100 * eps
            )
    return distance


def check_random_pair(seed):
    a, b, rng = random_pair(seed)
    size = diagonal(a, b)
    if size == 0:
        return
    tolerance = size * 10.0 ** -rng.integers(1, 9)
    there = check_pair(a, b, tolerance)
    if seed % 4 == 0:
        back = surface_distance(b, a, tolerance=tolerance)
        assert (there.lower, there.upper, there.mean) == pytest.approx(
            (back.lower, back.upper, back.mean)
        )
        moved = [(vertices + (1e6, -2e6, 3e6), faces) for vertices, faces in (a, b)]
        check_pair(*moved, tolerance, rounding=1e-8)


def test_random_pairs():
    for seed in range(12):
        check_random_pair(seed)


@pytest.mark.slow
def test_many_random_pairs():
    for seed in range(12, 500):
        check_random_pair(seed)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(*[st.integers(-2, 2)] * 3), min_size=6, max_size=12))
def test_few_triangles_between_lattice_points(points):
    vertices = np.array(points, np.float64)
    n = len(points) // 6
    a, b = np.arange(6 * n).reshape(2, n, 3)
    if diagonal((vertices, a), (vertices, b)) > 0:
        check_pair((vertices, a), (vertices, b), 1e-3)


def test_squeezed_surfaces():
    """Faces a million times as long as wide."""
    rng = np.random.default_rng(7)
    for scale in (1e-3, 1e-6, 1e-9):
        a, b = grid(4, rng, 0.3), grid(3, rng, 0.3)
        for surface in (a, b):
            surface[0][:] = surface[0] * (scale, 1, 1) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
        check_pair(a, b, 1e-4)


def test_sizes_of_all_magnitudes():
    """Powers of two change nothing but the units."""
    rng = np.random.default_rng(8)
    a, b = grid(5, rng, 0.1), grid(4, rng, 0.1)
    plain = surface_distance(a, b, tolerance=2.0**-10)
    for exponent in (-300, 300):
        unit = 2.0**exponent
        there = surface_distance((unit * a[0], a[1]), (unit * b[0], b[1]), tolerance=unit / 1024)
        assert (there.lower, there.upper) == (unit * plain.lower, unit * plain.upper)
        assert (there.mean, there.rms) == (unit * plain.mean, unit * plain.rms)


# ---------------------------------------------------------------------------- exceeds


def check_exceeds(a, b, limit, slack, hints=None):
    """Compare with the oracle: nothing is missed, and what is found is found with reason."""
    eps = 1e-11 * diagonal(a, b)
    a, b = as_mesh(*a), as_mesh(*b)
    found = exceeds(a, b, limit, slack=slack, hints=hints)
    assert (np.diff(found.faces) > 0).all()
    assert naive.distances(found.points, b) == pytest.approx(found.distances, abs=eps)
    assert (found.distances > limit - slack - eps).all()
    for fi in range(len(a.faces)):
        face = a.vertices, a.faces[[fi]]
        if fi in found.faces:
            point = found.points[found.faces == fi]
            assert naive.distances(point, face)[0] <= eps
        else:
            assert naive.largest(face, b, 12)[0] <= limit + eps
    return found


def test_exceeds_on_random_pairs():
    n_found = []
    for seed in range(1000, 1030):
        a, b, rng = random_pair(seed)
        if diagonal(a, b) == 0:
            continue
        distances = np.sort(naive.distances(naive.samples(a, 2)[0], b))
        limit = distances[rng.integers(len(distances) // 2, len(distances))] + 1e-3
        hints = rng.integers(-1, len(b[1]), len(a[1])).astype(np.int32) if seed % 2 else None
        found = check_exceeds(a, b, limit, limit * 10.0 ** -rng.integers(0, 4), hints)
        n_found.append(len(found.faces) / len(a[1]))
    assert 0.1 < np.mean(n_found) < 0.9


def test_a_hole_is_seen():
    """Nothing but the hole is far, and it is far from its rim only."""
    rng = np.random.default_rng(9)
    a, b = grid(8, rng, 1e-3), grid(10, rng, 1e-3)
    in_hole = (np.abs(b[0][b[1]].mean(axis=1)[:, :2] - 0.5) < 0.2).all(axis=1)
    rim = np.abs(b[0][np.unique(b[1][~in_hole]), :2] - 0.5).max(axis=1).min()
    assert rim > 0.1
    found = check_exceeds(a, (b[0], b[1][~in_hole]), 0.1, 0.01)
    centres = a[0][a[1][found.faces]].mean(axis=1)
    assert len(found.faces) > 5
    assert (np.abs(centres[:, :2] - 0.5) < 0.25).all()
    assert not len(check_exceeds(a, b, 0.1, 0.01).faces)


@pytest.mark.parametrize(
    "heights", [(0.01,), (0.01, 0.02), (-0.01, 0.02, 0.03), (0.05,), (0.05, -0.05)]
)
def test_sheets_over_a_face(heights):
    """A surface crosses the column on a face once, twice or three times, or not at all."""
    rng = np.random.default_rng(10)
    face = np.array([(0.3, 0.3, 0), (0.7, 0.35, 0), (0.45, 0.7, 0.0)]), np.array([(0, 1, 2)])
    sheets = []
    for height in heights:
        vertices, faces = grid(8, rng, 1e-4)
        sheets.append((vertices + (0, 0, height), faces))
    found = check_exceeds(face, together(*sheets), 0.04, 0.001)
    assert len(found.faces) == (min(np.abs(heights)) > 0.04)


def test_duplicate_and_reversed_faces():
    """Twice the same face is no cover in the sense of parity, but it is there."""
    rng = np.random.default_rng(11)
    a, b = grid(6, rng, 1e-3), grid(5, rng, 1e-3)
    twice = b[0], np.vstack([b[1], b[1][:, ::-1]])
    assert not len(check_exceeds(a, twice, 0.05, 0.01).faces)
    assert len(check_exceeds(a, (b[0], b[1][:20]), 0.05, 0.01).faces)


def test_a_target_can_be_kept():
    rng = np.random.default_rng(12)
    a, b = as_mesh(*grid(6, rng, 0.1)), as_mesh(*grid(5, rng, 0.1))
    target = Target(b)
    for limit in (0.05, 0.1):
        once, again = exceeds(a, b, limit, slack=0.01), exceeds(a, target, limit, slack=0.01)
        assert all(np.array_equal(x, y) for x, y in zip(once, again, strict=True))
    nothing = exceeds(as_mesh([], []), target, 0.1, slack=0.1)
    assert [len(part) for part in nothing] == [0, 0, 0]


# ---------------------------------------------------------------------------- threads, options


def as_bytes(distance: SurfaceDistance) -> list[bytes]:
    return [
        np.asarray(getattr(direction, field.name)).tobytes()
        for direction in (distance.a_to_b, distance.b_to_a)
        for field in fields(direction)
    ]


def test_any_number_of_threads_gives_the_same_bytes():
    rng = np.random.default_rng(13)
    a, b = grid(130, rng, 1e-3), grid(100, rng, 1e-3)
    results = [as_bytes(surface_distance(a, b, threads=threads)) for threads in (1, 2, 5, None)]
    assert all(result == results[0] for result in results)
    meshes_ = as_mesh(*a), as_mesh(*b)
    found = [exceeds(*meshes_, 2e-3, slack=1e-4, threads=threads) for threads in (1, 4)]
    assert all(x.tobytes() == y.tobytes() for x, y in zip(*found, strict=True))


def test_progress_and_cancelling():
    told = []
    a, b = (CUBE, CUBE_FACES), (CUBE + 0.1, CUBE_FACES)
    surface_distance(a, b, progress=lambda name, done: told.append((name, done)))
    assert {name for name, _ in told} == {"distance"}
    done = [fraction for _, fraction in told]
    assert done == sorted(done)
    assert 0 < done[0] < done[-1] == 1

    def cancel(name, done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        surface_distance(a, b, progress=cancel)


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        ((CUBE, CUBE_FACES), (CUBE, []), "surface b has no faces"),
        (([], []), (CUBE, CUBE_FACES), "surface a has no faces"),
        ((CUBE, CUBE_FACES), (CUBE * np.nan, CUBE_FACES), "surface b: vertices must be finite"),
        ((CUBE[:, :2], CUBE_FACES), (CUBE, CUBE_FACES), "surface a: vertices must have shape"),
        ((CUBE, CUBE_FACES), (CUBE, CUBE_FACES + 1), "surface b: faces must hold vertex indices"),
        (CUBE, (CUBE, CUBE_FACES), r"surface a must be a pair \(vertices, faces\), got ndarray"),
        ((CUBE, CUBE_FACES), None, "surface b must be a pair"),
    ],
)
def test_what_is_no_surface_is_refused(a, b, message):
    with pytest.raises(MeshError, match=message):
        surface_distance(a, b)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerance": 0}, "tolerance must be positive and finite, got 0"),
        ({"tolerance": -1.0}, "tolerance must be positive"),
        ({"tolerance": math.nan}, "tolerance must be positive and finite, got nan"),
        ({"tolerance": math.inf}, "tolerance must be positive and finite"),
        ({"tolerance": "fine"}, "tolerance must be a number, got 'fine'"),
        ({"tolerance": True}, "tolerance must be a number"),
        ({"tolerance": 1e-13}, "tolerance must be at least"),
        ({"threads": 0}, "threads must be a positive integer, got 0"),
        ({"threads": 1.5}, "threads must be a positive integer"),
    ],
)
def test_wrong_options_are_refused(options, message):
    with pytest.raises(OptionError, match=message):
        surface_distance((CUBE, CUBE_FACES), (CUBE, CUBE_FACES), **options)


@pytest.mark.parametrize(
    ("limit", "slack", "message"),
    [(0, 0, "limit must be"), (1, 0, "slack must be"), (1, 2, "slack must be at most the limit")],
)
def test_wrong_limits_are_refused(limit, slack, message):
    mesh = as_mesh(CUBE, CUBE_FACES)
    with pytest.raises(OptionError, match=message):
        exceeds(mesh, mesh, limit, slack=slack)


# ---------------------------------------------------------------------------- the parts


def from_python(part):
    """Make a part of kernels a function that Python can call."""

    @numba.njit
    def call(*args):
        return part(*args)

    return call


@pytest.fixture(scope="module")
def overlapping():
    return from_python(kernels.bvh.overlapping)


def random_boxes(n, rng, offset):
    """Many small triangles, some of them equal or points."""
    corners = rng.random((n, 1, 3)) + 0.1 * rng.random((n, 3, 3)) + offset
    corners[::5] = corners[::5, :1]
    corners[1::7] = corners[:1]
    vertices = corners.reshape(-1, 3)
    return vertices, np.arange(3 * n, dtype=np.int32).reshape(n, 3)


@pytest.mark.parametrize("n", [0, 1, 2, 7, 8, 9, 15, 16, 57, 64, 65, 449, 513, 585, 586, 4097])
def test_boxes_that_overlap(n, overlapping):
    bvh, rng = kernels.bvh, np.random.default_rng(n)
    offset = 1e6 * (n % 2)
    vertices, faces = random_boxes(n, rng, offset)
    tree = bvh.build(vertices, faces)
    assert np.array_equal(np.sort(tree.face), np.arange(n))
    assert np.array_equal(tree.face[tree.slot], np.arange(n))
    corners = vertices[faces].reshape(n, 3, 3)
    lows, highs = corners.min(axis=1), corners.max(axis=1)
    stack, found = np.empty(bvh.STACK_SIZE, np.int32), np.empty(max(n, 1), np.int32)
    enlarge = from_python(bvh.enlarge)
    for round_ in range(6):
        low = rng.random(3) + offset
        high = low + 0.4 * rng.random(3)
        n_found = overlapping(tree, np.concatenate([low, high]), stack, found)
        wanted = np.flatnonzero(((lows <= high) & (highs >= low)).all(axis=1))
        assert np.sort(found[:n_found]).tolist() == wanted.tolist()
        assert overlapping(tree, np.concatenate([low, high]), stack, found[:0]) == len(wanted)
        if round_ == 2:
            for fi in range(0, n, 3):
                lows[fi] -= rng.random(3)
                highs[fi] += 0.01
                enlarge(tree, fi, np.concatenate([lows[fi], highs[fi]]))


def test_faces_follow_a_hilbert_curve():
    """The cells of a cube are visited one after the other, each next to the one before."""
    cells = np.stack(np.meshgrid(*[np.arange(16.0)] * 3), axis=3).reshape(-1, 3)
    faces = np.repeat(np.arange(len(cells), dtype=np.int32)[:, None], 3, axis=1)
    order = kernels.bvh.along_curve(cells, faces)
    steps = np.abs(np.diff(cells[order], axis=0))
    assert (steps.sum(axis=1) == 1).all()


def test_the_sort_is_stable():
    rng = np.random.default_rng(14)
    for keys in (rng.integers(0, 2**63, 5000), rng.integers(0, 9, 5000) << 40, np.zeros(3, int)):
        order = kernels.bvh.order_of(keys)
        assert np.array_equal(order, np.argsort(keys, kind="stable"))


def exact_distance(point, triangle):
    """The distance of a point from a triangle in rational numbers, rounded once."""
    p, a, b, c = ([Fraction(float(x)) for x in q] for q in (point, *triangle))

    def dot(x, y):
        return sum(i * j for i, j in zip(x, y, strict=True))

    def minus(x, y):
        return [i - j for i, j in zip(x, y, strict=True)]

    squares = []
    for start, end in ((a, b), (b, c), (c, a)):
        along, from_start = minus(end, start), minus(p, start)
        length2 = dot(along, along)
        t = min(max(dot(from_start, along) / length2, 0), 1) if length2 else 0
        rest = [x - t * y for x, y in zip(from_start, along, strict=True)]
        squares.append(dot(rest, rest))
    u, v, w = minus(b, a), minus(c, a), minus(p, a)
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    area2 = uu * vv - uv * uv
    if area2:
        s, t = (vv * uw - uv * vw) / area2, (uu * vw - uv * uw) / area2
        if s >= 0 and t >= 0 and s + t <= 1:
            rest = [x - s * y - t * z for x, y, z in zip(w, u, v, strict=True)]
            squares.append(dot(rest, rest))
    return math.sqrt(min(squares))


def test_slivers_to_the_last_digits():
    """Triangles of all degrees of degeneracy, and points near them, far or on them."""
    nearest, rng = kernels.nearest, np.random.default_rng(15)
    distance2 = from_python(nearest.distance2_to_face)
    for case in range(1500):
        a, b, c = 0.3 * rng.normal(size=(3, 3))
        size = 10.0 ** -rng.integers(0, 18)
        if case % 5 == 1:
            c = a + rng.normal() * (b - a) + size * rng.normal(size=3)
        elif case % 5 == 2:
            c = b + size * rng.normal(size=3)
        elif case % 5 == 3:
            c = a
        elif case % 5 == 4:
            b = c = a
        vertices = rng.permutation(np.array([a, b, c]))
        faces = np.array([[0, 1, 2]], np.int32)
        tree = kernels.bvh.build(vertices, faces)
        target = nearest.Target(vertices, faces, tree, np.ones(1, bool))
        point = rng.dirichlet([0.5] * 3) @ vertices
        point += rng.integers(2) * 10.0 ** -rng.integers(0, 16) * rng.normal(size=3)
        found = math.sqrt(distance2(target, 0, *point))
        assert found == pytest.approx(exact_distance(point, vertices), abs=nearest.RESOLUTION)
        assert [distance2(target, 0, *vertex) for vertex in vertices] == [0, 0, 0]


FACE = np.array([(0.31, 0.33, 0), (0.72, 0.35, 0), (0.45, 0.71, 0.0)])


@pytest.fixture(scope="module")
def height_over_face():
    """What is proven of the distance of FACE to a surface, and the face over its centre."""
    cover_height = from_python(kernels.cover.cover_height)
    column, stack = kernels.cover.Column.new(), kernels.nearest.Stack.new()
    frame = Frame(np.zeros(3), 1.0, 1.0)

    def height(vertices, faces, limit=0.04, corners=FACE):
        target = Target(as_mesh(vertices, faces), frame)
        return cover_height(target.arrays, column, corners, limit, stack)

    return height


def test_a_sheet_over_a_face_bounds_its_distance(height_over_face):
    vertices, faces = grid(8, np.random.default_rng(16))
    centre = FACE.mean(axis=0)
    for offset in ((0, 0, 0.03), (0, 0, -0.03)):
        height, near = height_over_face(vertices + offset, faces)
        assert height == pytest.approx(0.03)
        assert naive.distances([centre + offset], (vertices + offset, faces[[near]])) < 1e-12
    far, higher = vertices + (0, 0, 0.05), vertices + (0, 0, 0.03)
    assert height_over_face(far, faces) == (math.inf, -1)
    assert height_over_face(far, faces, limit=0.06)[0] == pytest.approx(0.05)
    both = together((higher, faces), (far, faces))
    assert height_over_face(*both)[0] == pytest.approx(0.03)  # one of them is beyond the ends
    assert height_over_face(*both, limit=0.06)[0] == math.inf  # an even number
    thrice = together((vertices, faces), (higher, faces), (far, faces))
    assert height_over_face(*thrice, limit=0.06)[0] == pytest.approx(0.05)


def test_a_sheet_that_leaves_the_column_through_an_end_proves_nothing(height_over_face):
    highest = 0.1 * (0.72 - 0.2)
    for n in (3, 30):  # cells of a side of 1, and of 0.1
        vertices, faces = grid(n, np.random.default_rng(17))
        vertices = 3 * vertices - (1, 1, 0)
        vertices += 0.1 * (vertices[:, :1] - 0.2) * (0, 0, 1)
        assert height_over_face(vertices, faces, limit=0.04)[0] == math.inf
        height, _ = height_over_face(vertices, faces, limit=0.06)
        assert highest - 1e-12 <= height <= 0.06
        if n == 3:  # the corners of its two faces are beyond the ends, but not over the face
            assert height == pytest.approx(highest)


def test_a_sheet_with_a_boundary_in_the_column_proves_nothing(height_over_face):
    vertices, faces = grid(8, np.random.default_rng(18))
    centres = vertices[faces].mean(axis=1)
    over = np.flatnonzero(naive.distances(centres, (FACE, [(0, 1, 2)])) == 0)
    beside = np.flatnonzero(naive.distances(centres, (FACE, [(0, 1, 2)])) > 0.2)
    for fi in over:
        assert height_over_face(vertices, np.delete(faces, fi, axis=0))[0] == math.inf
    for fi in beside:
        assert height_over_face(vertices, np.delete(faces, fi, axis=0))[0] == 0


def test_what_cannot_be_told_is_not_proven(height_over_face):
    vertices, faces = grid(8, np.random.default_rng(19))
    sliver = FACE * (1, 1e-4, 1) + (0, 0.3, 0)
    assert height_over_face(vertices, faces, corners=sliver)[0] == math.inf
    centred = FACE - FACE.mean(axis=0) + (0.5, 0.5, 0)  # its centre is under a vertex
    assert height_over_face(vertices, faces, corners=centred)[0] == math.inf
    many = grid(40, np.random.default_rng(20))
    assert height_over_face(*many)[0] == math.inf  # more faces than are looked at


def test_kernels_run_in_python_too():
    """The same bytes without compilation, as one steps through it."""
    code = (
        "import numpy as np\n"
        "from tetsimplify.distance import surface_distance\n"
        "x, y = (i.ravel() / 3 for i in np.mgrid[:4, :4])\n"
        "cells = np.array([0, 1, 2, 4, 5, 6, 8, 9, 10])[:, None]\n"
        "faces = np.vstack([cells + (0, 1, 5), cells + (0, 5, 4)])\n"
        "bent = np.stack([x, y, 0.2 * np.sin(5 * x + 3 * y)], axis=1)\n"
        "distance = surface_distance((bent, faces), (bent[::-1] * (1, 1, 0.5), faces))\n"
        "print(distance, distance.a_to_b.point, distance.b_to_a.vertex_distances)\n"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-W", "ignore", "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "NUMBA_DISABLE_JIT": disabled},
        ).stdout
        for disabled in ("0", "1")
    }
    assert len(outputs) == 1


# ---------------------------------------------------------------------------- others, real data


def test_distances_of_vertices_are_those_of_vtk():
    pyvista = pytest.importorskip("pyvista")
    rng = np.random.default_rng(21)
    a, b = dented_sphere(3, rng), dented_sphere(2, rng)
    found = surface_distance(a, b).a_to_b.vertex_distances
    surface, other = (pyvista.PolyData.from_regular_faces(*mesh) for mesh in (a, b))
    implicit = surface.compute_implicit_distance(other)["implicit_distance"]
    assert found == pytest.approx(np.abs(implicit), abs=1e-6)


def spread_over(mesh, n, rng):
    """Points at random on a surface, everywhere alike."""
    corners = naive.corners_of(mesh)
    sides = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    chosen = corners[rng.choice(len(corners), n, p=areas / areas.sum())]
    return np.einsum("ik,ikx->ix", rng.dirichlet([1, 1, 1], n), chosen)


@needs_data
def test_a_simplified_scan():
    """The bounds hold for points all over the surface, and the mean is that of these points."""
    folder = data_dir()
    assert folder is not None
    scan = io.read_mesh(folder / "meshes" / "nefertiti.ply")
    size = diagonal(scan)
    result = tetsimplify.simplify(*scan, max_edge_length=0.012 * size)
    simple = result.vertices, result.faces
    rng = np.random.default_rng(22)
    surfaces = [  # with points that no face uses, but that distances are measured from
        (np.vstack([vertices, spread_over((vertices, faces), 100_000, rng)]), faces)
        for vertices, faces in (scan, simple)
    ]
    distance = surface_distance(*surfaces, tolerance=1e-5 * size)
    assert distance.upper - distance.lower <= 1e-5 * size
    assert 1e-4 * size < distance.mean < distance.rms < distance.lower < 0.02 * size
    for a, b, found in (
        (*surfaces, distance.a_to_b),
        (*surfaces[::-1], distance.b_to_a),
    ):
        distances = found.vertex_distances[-100_000:]
        assert distances.max() <= found.upper
        assert found.mean == pytest.approx(distances.mean(), rel=0.01)
        assert found.rms == pytest.approx(np.sqrt((distances**2).mean()), rel=0.01)
        for limit in (0.5 * found.lower, 1.02 * found.upper):
            exceeding = exceeds(as_mesh(*a), as_mesh(*b), limit, slack=0.01 * limit)
            assert bool(len(exceeding.faces)) == (limit < found.upper)
            assert exceeding.distances.max(initial=0) <= found.upper
