"""Self-intersections against rational arithmetic, where every kind of contact occurs."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import naive_intersections as naive
import strategies
import tetsimplify
from data import data_dir, needs_data
from tetsimplify import blocks, intersections, io
from tetsimplify.arrays import as_mesh
from tetsimplify.engine import Engine
from tetsimplify.intersections import self_intersections
from tetsimplify.kernels.corners import DEAD, ahead
from tetsimplify.kernels.crossing import faces_cross
from tetsimplify.kernels.geometry import squared_length
from tetsimplify.kernels.intersections import watch_over
from tetsimplify.kernels.lens import keep_one_lens
from tetsimplify.kernels.link import list_ring
from tetsimplify.kernels.placement import find_place
from tetsimplify.kernels.predicates import orient2d, orient3d
from tetsimplify.kernels.state import (
    BLOCKED,
    CONTRACTIBLE,
    DEFERRED,
    N_DEFERRED,
    NESTED,
    OBSTRUCTED,
    SETTLED,
    STAR,
)
from tetsimplify.kernels.sweep import unblock
from tetsimplify.kernels.watch import follow, star_crosses
from tetsimplify.options import Options

FOLDER = data_dir()
MESHES = [
    pytest.param(path, id=path.stem, marks=pytest.mark.slow if path.stat().st_size > 5e6 else ())
    for path in (sorted((FOLDER / "meshes").glob("*.ply")) if FOLDER else [])
]

# ------------------------------------------------------------------------------- predicates


@numba.njit
def signs_2d(points):
    found = np.empty(len(points), np.int64)
    for i in range(len(points)):
        a, b, c = points[i, 0], points[i, 1], points[i, 2]
        found[i] = orient2d((a[0], a[1]), (b[0], b[1]), (c[0], c[1]))
    return found


@numba.njit
def signs_3d(points):
    found = np.empty(len(points), np.int64)
    for i in range(len(points)):
        a, b, c, d = points[i, 0], points[i, 1], points[i, 2], points[i, 3]
        found[i] = orient3d(
            (a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2]), (d[0], d[1], d[2])
        )
    return found


def assert_exact(points):
    for signs, n_points, n_axes in ((signs_2d, 3, 2), (signs_3d, 4, 3)):
        some = np.ascontiguousarray(points[:, :n_points, :n_axes])
        expected = [naive.orientation(*map(naive.exactly, p)) for p in some]
        assert signs(some).tolist() == expected


def nearly_flat(rng, n):
    """Four points in a plane but for rounding."""
    points = rng.normal(size=(n, 4, 3))
    points[:, 2] = points[:, 0] + rng.random((n, 1)) * (points[:, 1] - points[:, 0])
    points[:, 3] = np.einsum("ni,nij->nj", rng.dirichlet(np.ones(3), n), points[:, :3])
    return points


def whole(rng, n, top=3):
    return rng.integers(-top, top + 1, (n, 4, 3)).astype(float)


POINTS = {
    "general": lambda rng, n: rng.normal(size=(n, 4, 3)),
    "whole": whole,
    "tenths": lambda rng, n: whole(rng, n) * 0.1 + 0.3,
    "nearly flat": nearly_flat,
    "nearly flat and far away": lambda rng, n: nearly_flat(rng, n) + 1e6,
    "an ulp apart": lambda rng, n: np.nextafter(
        whole(rng, n) + 5, rng.choice((-np.inf, np.inf), (n, 4, 3))
    ),
    "specks far away": lambda rng, n: 1.0 + whole(rng, n) * 2.0**-50,
    "all magnitudes": lambda rng, n: rng.normal(size=(n, 4, 3)) * 10.0 ** rng.integers(
        -60, 60, (n, 4, 3)
    ),
    "the limits": lambda rng, n: whole(rng, n) * rng.choice(
        (1.0, intersections.SMALLEST, intersections.LARGEST / 3), (n, 4, 3)
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", POINTS)
def test_predicates(kind):
    assert_exact(POINTS[kind](np.random.default_rng(0), 400))


@pytest.mark.slow
@pytest.mark.parametrize("kind", POINTS)
def test_predicates_at_length(kind):
    assert_exact(POINTS[kind](np.random.default_rng(1), 20_000))


def test_predicates_near_a_line():
    """Points within 32 ulps of a line, where plain determinants are wrong (Shewchuk 1997)."""
    near = 0.5 + np.arange(32) * 2.0**-53
    points = np.empty((32, 32, 4, 3))
    points[:] = (0, 0, 0), (12, 12, 0), (24, 24, 0), (6, 6, 1)
    points[:, :, 0, 0], points[:, :, 0, 1] = near[:, None], near
    assert_exact(points.reshape(-1, 4, 3))


# --------------------------------------------------------------------------- two faces


@numba.njit
def cross(vertices, a, b):
    found = np.empty(len(vertices), np.bool_)
    for i in range(len(vertices)):
        found[i] = faces_cross(
            vertices[i], (a[i, 0], a[i, 1], a[i, 2]), (b[i, 0], b[i, 1], b[i, 2])
        )
    return found


SHARED = (0, 1, 2, 3, "any")


def pairs_on_a_grid(seed, top, n_shared, n):
    """Pairs of faces on a grid so coarse that all kinds of contact are frequent."""
    rng = np.random.default_rng(seed)
    vertices = rng.integers(0, top, (n, 6, 3)).astype(float)
    if n_shared == "any":  # vertices twice in a face as well
        a, b = rng.integers(0, 6, (2, n, 3)).astype(np.int32)
        return vertices, a, b
    first = np.arange(3, dtype=np.int32)
    second = np.where(first < n_shared, first, first + 3)
    return (vertices, *(rng.permuted(np.tile(x, (n, 1)), axis=1) for x in (first, second)))


def assert_as_clipped(vertices, a, b):
    expected = [naive.faces_cross(*pair) for pair in zip(vertices, a, b, strict=True)]
    assert cross(vertices, a, b).tolist() == expected
    return np.mean(expected)


@pytest.mark.parametrize("n_shared", SHARED)
@pytest.mark.parametrize("top", [2, 3, 4])
def test_faces_on_a_grid(top, n_shared):
    vertices, a, b = pairs_on_a_grid(top, top, n_shared, 500)
    part_that_crosses = assert_as_clipped(vertices, a, b)
    assert 0.04 < part_that_crosses < 0.8 or n_shared == 3


@pytest.mark.slow
@pytest.mark.parametrize("n_shared", SHARED)
@pytest.mark.parametrize("top", [2, 3, 4, 6])
def test_faces_on_a_grid_at_length(top, n_shared):
    vertices, a, b = pairs_on_a_grid(10 + top, top, n_shared, 10_000)
    assert_as_clipped(vertices, a, b)


@pytest.mark.parametrize("n_shared", (0, 1, 2))
def test_faces_in_a_tilted_plane(n_shared):
    """Coplanar to the last bit or not quite: no coordinate is the same."""
    vertices, a, b = pairs_on_a_grid(0, 4, n_shared, 500)
    vertices[:, :, 2] = 3 * vertices[:, :, 0] - 2 * vertices[:, :, 1]
    assert_as_clipped(vertices, a, b)
    assert_as_clipped(vertices * 0.1 + 0.7, a, b)


@pytest.mark.parametrize("n_shared", (0, 1, 2))
def test_no_order_matters(n_shared):
    vertices, a, b = pairs_on_a_grid(1, 3, n_shared, 5000)
    expected = cross(vertices, a, b)
    assert np.array_equal(cross(vertices, b, a), expected)
    assert np.array_equal(cross(vertices, a[:, ::-1].copy(), b), expected)
    assert np.array_equal(cross(vertices, np.roll(a, 1, axis=1), b), expected)
    assert np.array_equal(cross(vertices[:, :, ::-1].copy() * -0.25, a, b), expected)


# a face at 0 1 2, in the plane z = 0, and what it may meet
FLOOR = [(0, 0, 0), (4, 0, 0), (0, 4, 0)]
CONTACTS = {
    # nothing is shared
    "apart": ([(0, 0, 1), (4, 0, 1), (0, 4, 1)], (3, 4, 5), False),
    "pierced": ([(1, 1, -1), (1, 1, 1), (9, 9, 1)], (3, 4, 5), True),
    "touched inside by a vertex": ([(1, 1, 0), (1, 1, 1), (1, 2, 1)], (3, 4, 5), True),
    "touched along an edge by an edge": ([(1, 0, 0), (3, 0, 0), (2, -1, 1)], (3, 4, 5), True),
    "a vertex in the place of a vertex": ([(0, 0, 0), (-1, 0, 1), (0, -1, 1)], (3, 4, 5), True),
    "inside, in the plane": ([(1, 1, 0), (2, 1, 0), (1, 2, 0)], (3, 4, 5), True),
    "beside, in the plane": ([(5, 0, 0), (9, 0, 0), (5, 4, 0)], (3, 4, 5), False),
    "a needle through it": ([(1, 1, -1), (1, 1, 2), (1, 1, 3)], (3, 4, 5), True),
    "a needle beside it": ([(3, 3, -1), (3, 3, 2), (3, 3, 3)], (3, 4, 5), False),
    "a point on it": ([(1, 1, 0), (1, 1, 0), (1, 1, 0)], (3, 4, 5), True),
    # a vertex is shared
    "a bow tie": ([(-1, 0, 0), (0, -1, 1), (0, 0, 0)], (0, 3, 4), False),
    "a page through it": ([(1, 1, 1), (1, 1, -1), (0, 0, 0)], (0, 3, 4), True),
    "a page beside it": ([(-1, 1, 1), (-1, 1, -1), (0, 0, 0)], (0, 3, 4), False),
    "an edge on it": ([(1, 1, 0), (1, 1, 1), (0, 0, 0)], (0, 3, 4), True),
    "edges on each other": ([(9, 0, 0), (1, 0, 1), (0, 0, 0)], (0, 3, 4), True),
    "edges in line": ([(-9, 0, 0), (1, 0, 1), (0, 0, 0)], (0, 3, 4), False),
    # an edge is shared
    "a neighbour": ([(4, -4, 1), (0, 0, 0), (0, 0, 0)], (1, 0, 3), False),
    "a flat neighbour": ([(4, -4, 0), (0, 0, 0), (0, 0, 0)], (1, 0, 3), False),
    "a right angle": ([(1, 0, 5), (0, 0, 0), (0, 0, 0)], (1, 0, 3), False),
    "folded onto each other": ([(9, 1, 0), (0, 0, 0), (0, 0, 0)], (1, 0, 3), True),
    "a neighbour without area": ([(9, 0, 0), (0, 0, 0), (0, 0, 0)], (1, 0, 3), False),
    # all is shared
    "back to back": ([(0, 0, 0), (0, 0, 0), (0, 0, 0)], (2, 1, 0), True),
}


@pytest.mark.parametrize("name", CONTACTS)
def test_contacts(name):
    others, face, expected = CONTACTS[name]
    vertices = np.array(FLOOR + others, float)
    assert naive.faces_cross(vertices, (0, 1, 2), face) == expected
    report = self_intersections(vertices, [(0, 1, 2), face])
    assert report.is_embedded == (not expected)
    assert report.pairs.tolist() == [[0, 1]] * expected
    assert report.faces.tolist() == [0, 1] * expected


# --------------------------------------------------------------------------- whole meshes


def coarse(mesh, top, rng):
    """A mesh on a coarse grid, much of which touches, overlaps and has no area."""
    vertices, faces = mesh
    size = np.abs(vertices).max()
    return np.round(vertices / size * top + rng.uniform(-0.3, 0.3, vertices.shape)), faces


@settings(max_examples=40, deadline=None)
@given(strategies.surfaces(), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_surfaces_against_all_pairs(mesh, top, seed):
    vertices, faces = coarse(mesh, top, np.random.default_rng(seed))
    faces = faces[:16]  # the oracle is slow
    report = self_intersections(vertices, faces)
    pairs = naive.crossing_pairs(vertices, faces)
    assert report.pairs.tolist() == [list(pair) for pair in pairs]
    assert report.faces.tolist() == sorted({f for pair in pairs for f in pair})
    assert (report.n_pairs, report.n_faces) == (len(report.pairs), len(report.faces))


def test_triangles_at_random():
    rng = np.random.default_rng(0)
    vertices, faces = rng.random((150, 3)), rng.permutation(150).reshape(50, 3)
    pairs = naive.crossing_pairs(vertices, faces)
    assert len(pairs) > 50
    assert self_intersections(vertices, faces).pairs.tolist() == [list(pair) for pair in pairs]


def test_shuffled_faces_give_the_same_pairs():
    rng = np.random.default_rng(0)
    vertices, faces = coarse(meshes.icosphere(2), 3, rng)
    report = self_intersections(vertices, faces)
    order = rng.permutation(len(faces))
    shuffled = self_intersections(vertices, faces[order])
    renamed = np.unique(np.sort(order[shuffled.pairs], axis=1), axis=0)
    assert np.array_equal(renamed, report.pairs)
    assert np.array_equal(self_intersections(vertices, faces).pairs, report.pairs)


@pytest.mark.parametrize("name", ["icosphere", "torus", "tetrahedron", "grid"])
def test_embedded_surfaces(name):
    arguments = {"icosphere": (3,), "torus": (12, 7), "tetrahedron": (), "grid": (9, 9)}[name]
    assert self_intersections(*getattr(meshes, name)(*arguments)).is_embedded


def test_two_spheres_that_cut_each_other():
    vertices, faces = meshes.icosphere(3)
    moved = np.vstack([vertices, vertices + (0.7, 0.1, 0.2)])
    both = np.vstack([faces, faces + len(vertices)])
    report = self_intersections(moved, both)
    assert (report.pairs[:, 0] < len(faces)).all()
    assert (report.pairs[:, 1] >= len(faces)).all()
    # the spheres of radius 1 meet in a circle half way
    offset = np.array((0.7, 0.1, 0.2))
    middles = moved[both[report.faces]].mean(axis=1) @ offset / np.linalg.norm(offset)
    assert np.abs(middles - np.linalg.norm(offset) / 2).max() < 0.2


def test_room_for_the_pairs_of_one_face_is_enough(monkeypatch):
    """Faces all in one place, so that every face has as many pairs as there can be."""
    monkeypatch.setattr(intersections, "LEAST_ROOM", 1)
    vertices = np.tile(np.eye(3), (40, 1))
    report = self_intersections(vertices, np.arange(120).reshape(40, 3))
    assert report.pairs.tolist() == [[f, g] for f in range(40) for g in range(f + 1, 40)]


@pytest.mark.parametrize("n_vertices", [0, 3])
def test_no_faces(n_vertices):
    report = self_intersections(np.zeros((n_vertices, 3)), np.zeros((0, 3), int))
    assert report.is_embedded
    assert report.pairs.shape == (0, 2)
    assert report.pairs.dtype == report.faces.dtype == np.int32


def test_nothing_given_is_changed():
    vertices, faces = meshes.icosphere(1)
    vertices[0] = 1e-200
    copies = vertices.copy(), faces.copy()
    self_intersections(vertices, faces)
    assert np.array_equal(vertices, copies[0])
    assert np.array_equal(faces, copies[1])


@pytest.mark.parametrize("scale", [1e-70, 1e-20, 1e20, 1e74])
def test_tiny_and_huge_meshes(scale):
    vertices, faces = coarse(meshes.icosphere(2), 2, np.random.default_rng(0))
    expected = self_intersections(vertices, faces)
    assert expected.n_pairs > 0
    exponent = np.round(np.log2(scale))
    assert np.array_equal(self_intersections(vertices * 2.0**exponent, faces).pairs, expected.pairs)


def test_too_huge_meshes_are_refused():
    with pytest.raises(tetsimplify.MeshError, match="at most 1e\\+75 in size, got 1e\\+80"):
        self_intersections(np.eye(3) * 1e80, [[0, 1, 2]])


# ------------------------------------------------------------------------------- real data


@needs_data
@pytest.mark.parametrize("path", MESHES)
def test_real_pairs(path):
    """The oracle agrees on some of the pairs found, and on some neighbours of these faces."""
    vertices, faces = io.read_mesh(path)
    report = self_intersections(vertices, faces)
    rng = np.random.default_rng(0)
    found = {tuple(pair) for pair in report.pairs.tolist()}
    for f, g in rng.permutation(report.pairs)[:50].tolist():
        assert naive.faces_cross(vertices, faces[f], faces[g])
    lowest, highest = vertices[faces].min(axis=1), vertices[faces].max(axis=1)
    some = rng.permutation(report.faces)[:5] if report.n_faces else rng.integers(0, len(faces), 5)
    for f in some.tolist():
        near = (lowest <= highest[f]).all(axis=1) & (highest >= lowest[f]).all(axis=1)
        for g in np.flatnonzero(near)[:50].tolist():
            if f != g:
                crossing = naive.faces_cross(vertices, faces[f], faces[g])
                assert ((min(f, g), max(f, g)) in found) == crossing


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("path", MESHES)
def test_beside_pymeshlab(path):
    """What pymeshlab selects, which computes in floating point, and no faces that just touch."""
    pymeshlab = pytest.importorskip("pymeshlab")
    vertices, faces = io.read_mesh(path)
    theirs = pymeshlab.MeshSet()
    theirs.add_mesh(pymeshlab.Mesh(vertices, faces))
    theirs.compute_selection_by_self_intersections_per_face()
    selected = np.flatnonzero(theirs.current_mesh().face_selection_array())
    ours = self_intersections(vertices, faces).faces
    lowest, highest = vertices[faces].min(axis=1), vertices[faces].max(axis=1)
    for f in np.setdiff1d(selected, ours).tolist():  # a few, and wrong
        near = (lowest <= highest[f]).all(axis=1) & (highest >= lowest[f]).all(axis=1)
        for g in np.flatnonzero(near).tolist():
            assert f == g or not naive.faces_cross(vertices, faces[f], faces[g])
    if path.stem in ("counter", "fly_AEDES", "self_intersectA", "tower_holes", "skull_yj"):
        assert np.array_equal(selected, ours)


# ------------------------------------------------------------------------------- contractions


WHOLE = blocks.whole(0)


@numba.njit
def find_crossing(watch, surface, scratch, rules, corner):
    """1 or 0, whether contracting an edge makes faces cross; -1 where it cannot be contracted."""
    v, u = surface.corner_vertex[corner], surface.corner_vertex[ahead(corner)]
    lens = keep_one_lens(surface, scratch, rules, None, corner)
    if lens.outcome != CONTRACTIBLE:
        return -1
    list_ring(surface, scratch, lens.n_v, lens.n_u)
    placed = find_place(surface, None, scratch, rules, v, u)
    if placed != CONTRACTIBLE:
        return -1
    return int(star_crosses(watch, surface, scratch, v, u, lens.n_v, lens.n_u, lens.n_doomed))


@numba.njit
def contract(watch, surface, scratch, rules, corner):
    """Contract one edge, as a sweep does with one that the link condition blocks."""
    face = corner // 3
    surface.face_state[face] = BLOCKED
    surface.verdict[3 * face : 3 * face + 3] = OBSTRUCTED
    surface.verdict[corner] = NESTED
    scratch.lists[DEFERRED, 0] = face
    scratch.tally[N_DEFERRED] = 1
    unblock(surface, None, None, scratch, rules, None, None, WHOLE, SETTLED, True)
    star = scratch.lists[STAR]
    n = 1
    corner = surface.next_corner[star[0]]
    while corner != star[0]:
        n += 1
        corner = surface.next_corner[corner]
    follow(watch, surface, star, n)


@numba.njit
def contract_all(watch, surface, scratch, rules, is_guarded):
    """Contract all short edges, face by face; return how many the guard refused."""
    n_refused = 0
    for corner in range(len(surface.corner_vertex)):
        v, u = surface.corner_vertex[corner], surface.corner_vertex[ahead(corner)]
        if v == DEAD or squared_length(surface.vertices, v, u) >= rules.max_length2:
            continue
        crossing = find_crossing(watch, surface, scratch, rules, corner)
        n_refused += crossing == 1
        if crossing == 0 or (crossing == 1 and not is_guarded):
            contract(watch, surface, scratch, rules, corner)
    return n_refused


class Run:
    """A surface that is contracted edge by edge."""

    def __init__(self, mesh, *, max_edge_length=np.inf, places=(0.5,)):
        vertices, faces = as_mesh(*mesh)
        options = Options(max_edge_length=max_edge_length, removal_limit=np.inf, foldover=None)
        engine = Engine(as_mesh(vertices, faces), options, np.zeros(len(vertices), bool))
        self.surface, self.scratch = engine._surface, engine._scratch
        self.rules = engine.rules._replace(places=np.array(places))
        self.watch = watch_over(vertices, faces)

    @property
    def state(self):
        return self.watch, self.surface, self.scratch, self.rules

    def live(self):
        return np.flatnonzero(self.surface.corner_vertex[::3] != DEAD)

    def mesh(self):
        return self.surface.vertices, self.surface.corner_vertex.reshape(-1, 3)[self.live()]

    def crossing(self):
        """Pairs of faces that cross, by their old numbers."""
        return set(map(tuple, self.live()[self_intersections(*self.mesh()).pairs].tolist()))


def check_guard(mesh, rng, *, n_edges, place):
    """Contract some edges, crossing or not, and compare the guard with what then is."""
    run = Run(mesh, places=(place,))
    outcomes = {0: 0, 1: 0}
    crossing = run.crossing()
    for _ in range(n_edges):
        corner = int(3 * rng.choice(run.live()) + rng.integers(3))
        vertices = run.surface.vertices.copy()
        expected = find_crossing(*run.state, corner)
        assert np.array_equal(run.surface.vertices, vertices)
        if expected < 0:
            continue
        contract(*run.state, corner)
        after = run.crossing()
        assert expected == bool(after - crossing)
        outcomes[expected] += 1
        crossing = after
    return outcomes


@pytest.mark.parametrize("place", [0.5, 0.0, 1.0, 0.3])
def test_guard_tells_new_crossings(place):
    outcomes = np.zeros(2, int)
    for seed in range(60):
        rng = np.random.default_rng(seed)
        vertices, faces = strategies.adversarial_mesh(seed)
        vertices = (
            coarse((vertices, faces), 3, rng)[0]  # much touches and overlaps before
            if seed % 2
            else vertices + rng.normal(size=vertices.shape) * 0.02 * (seed % 3)
        )
        found = check_guard((vertices, faces), rng, n_edges=12, place=place)
        outcomes += found[0], found[1]
    assert outcomes.min() > 50


def ring(degrees, radii, heights):
    angles = np.radians(degrees)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles), heights])


def assert_guard_objects(vertices, faces, edge, place):
    """Contracting an edge makes faces cross, and the guard tells so."""
    run = Run((vertices, np.array(faces)), places=(place,))
    corner_vertex = run.surface.corner_vertex.reshape(-1, 3)
    f, k = np.argwhere((corner_vertex == edge[0]) & (np.roll(corner_vertex, -1, 1) == edge[1]))[0]
    before = run.crossing()
    assert find_crossing(*run.state, 3 * f + k) == 1
    contract(*run.state, 3 * f + k)
    assert run.crossing() - before


@pytest.mark.parametrize("turned", range(0, 360, 30))
@pytest.mark.parametrize("is_open", [False, True])
def test_guard_sees_a_vertex_whose_faces_go_around_it_twice(turned, is_open):
    """All turn the same way, seen from above, in two rounds. The second had a vertex below."""
    n = 12
    degrees = np.arange(n) * 720 / n + turned + 10
    heights = np.concatenate([np.zeros(6), np.linspace(1, -1, 6)])
    outside = ring(degrees, np.repeat((1.0, 2.0), 6), heights)
    v, u = n, n + 1
    faces = [(v, i, i + 1) for i in range(6)] + [(u, i, i + 1) for i in range(6, n - 1)]
    faces += [(v, 6, u)]
    if not is_open:
        faces += [(u, n - 1, 0), (v, u, 0)]
    vertices = np.vstack([outside, (0, 0, 0), (0, 0, -10)])
    assert_guard_objects(vertices, faces, (u, v), 1.0)


@pytest.mark.parametrize("turned", range(0, 360, 30))
def test_guard_sees_a_neighbour_whose_faces_go_around_it_twice(turned):
    """A spiral staircase; a vertex of its upper floor comes to lie below the lower one."""
    n = 10
    degrees = np.arange(n) * 60 + turned + 10
    stairs = ring(degrees, np.repeat((1.0, 2.0), 5), np.repeat((0.0, 1.0), 5))
    w, v, u = n, 8, n + 1
    below = ring(degrees[v : v + 1], 3.0, -1.0)
    faces = [(w, i, i + 1) for i in range(n - 1)] + [(v, v - 1, u), (v + 1, v, u)]
    assert_guard_objects(np.vstack([stairs, (0, 0, 0), below]), faces, (v, u), 1.0)


def thin_shell():
    """Two sheets one voxel apart, with holes from one to the other."""
    x, y, z = np.mgrid[-1:1:16j, -1:1:16j, -1:1:16j]
    return tetsimplify.extract_isosurface(0.08 - abs(np.sqrt(x**2 + y**2 + z**2) - 0.8), 0.0)


def test_guarded_runs_make_no_crossings():
    mesh = thin_shell()
    assert self_intersections(*mesh).is_embedded
    for is_guarded in (False, True):
        run = Run(mesh, max_edge_length=2.0, places=(0.5, 0.0, 1.0))
        n_refused = sum(contract_all(*run.state, is_guarded) for _ in range(3))
        assert n_refused > 500
        assert len(run.live()) < 0.06 * len(mesh.faces)
        assert len(run.crossing()) == 0 if is_guarded else len(run.crossing()) > 500


def test_crossings_that_are_there_do_not_block():
    """Two tubes through each other are contracted, and no other faces come to cross."""
    vertices, faces = meshes.torus(12, 12)
    both = np.vstack([vertices, vertices[:, [2, 0, 1]] + 0.4]), np.vstack([faces, faces + 144])
    run = Run(both, max_edge_length=1.5)
    before = run.crossing()
    assert before
    contract_all(*run.state, True)
    assert len(run.live()) < len(both[1])
    assert run.crossing() <= before
