"""The topology report against the oracle."""

import dataclasses
import importlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import naive
import strategies
import tetsimplify
from corner_tables import assert_in_order
from tetsimplify import kernels
from tetsimplify.topology import examine

MODULE = importlib.import_module("tetsimplify.topology")  # the name is that of its verb

BROKEN = [
    meshes.moebius_strip(),
    meshes.bow_tie(),
    meshes.three_pages(),
    meshes.flipped_face(),
    meshes.double_covered_triangle(),
    meshes.collapsed_face(),
    meshes.unused_vertices(),
]


def assert_agrees(vertices, faces):
    report = tetsimplify.topology(vertices, faces)
    slow = naive.summary(faces)
    assert report.edge_degrees == dict(slow.edge_degrees)
    assert report.euler_characteristic == slow.euler_characteristic
    assert report.n_components == slow.n_components
    assert len(report.duplicate_faces) == slow.n_duplicate_faces
    assert len(report.degenerate_faces) == slow.n_degenerate_faces
    assert report.non_manifold_vertices.tolist() == sorted(slow.non_manifold_vertices)
    assert report.is_oriented == slow.is_consistently_oriented or not slow.is_manifold
    assert report.is_manifold == slow.is_sound
    if slow.is_sound:
        assert report.n_boundary_loops == slow.n_boundary_loops
        assert sorted(map(tuple, report.components.tolist())) == sorted(slow.components)
        assert report.is_closed == slow.is_closed
    assert report.n_edges == sum(report.edge_degrees.values())
    used = np.zeros(len(vertices), bool)
    proper = np.array([f for f in np.asarray(faces).tolist() if len(set(f)) == 3], int)
    used[proper.reshape(-1)] = True
    assert report.unreferenced_vertices.tolist() == np.flatnonzero(~used).tolist()


@pytest.mark.parametrize("mesh", BROKEN)
def test_broken_meshes(mesh):
    assert_agrees(*mesh)


def test_adversarial_surfaces():
    for seed in range(300):
        assert_agrees(*strategies.adversarial_mesh(seed))


@settings(max_examples=300, deadline=None)
@given(st.integers(3, 9), st.integers(1, 25), st.integers(0, 2**32 - 1))
def test_any_set_of_triangles(n_vertices, n_faces, seed):
    rng = np.random.default_rng(seed)
    assert_agrees(np.zeros((n_vertices, 3)), rng.integers(0, n_vertices, (n_faces, 3)))


@settings(max_examples=100, deadline=None)
@given(strategies.surfaces(), st.integers(0, 2**32 - 1))
def test_surfaces_with_a_few_faults(mesh, seed):
    vertices, faces = mesh
    rng = np.random.default_rng(seed)
    faces = faces.copy()
    for fault in rng.integers(0, 4, 2):
        at = rng.integers(len(faces))
        if fault == 0:
            faces[at] = faces[at][::-1]
        elif fault == 1:
            faces = np.vstack([faces, rng.permutation(faces[at])])
        elif fault == 2:
            faces[at] = rng.integers(0, len(vertices), 3)
        else:
            faces = np.delete(faces, at, axis=0)
            if not len(faces):
                return
    assert_agrees(vertices, faces)


@pytest.mark.parametrize(
    ("mesh", "genus", "loops", "components"),
    [
        (meshes.tetrahedron(), 0, 0, 1),
        (meshes.minimal_torus(), 1, 0, 1),
        (meshes.two_tori_on_a_neck(), 2, 0, 1),
        (meshes.annulus(5), 0, 2, 1),
        (meshes.triangle(), 0, 1, 1),
        (meshes.disjoint_union(meshes.minimal_torus(), meshes.annulus(3)), 1, 2, 2),
    ],
)
def test_known_surfaces(mesh, genus, loops, components):
    report = tetsimplify.topology(*mesh)
    assert (report.genus, report.n_boundary_loops, report.n_components) == (
        genus,
        loops,
        components,
    )


def test_genus_is_undefined_where_there_is_no_manifold():
    assert tetsimplify.topology(*meshes.bow_tie()).genus is None


def test_same_topology_looks_at_components():
    """Two tori and a sphere have the totals of a double torus and two spheres."""
    sphere, torus = meshes.octahedron(), meshes.minimal_torus()
    one = tetsimplify.topology(*meshes.disjoint_union(torus, torus, sphere))
    other = tetsimplify.topology(
        *meshes.disjoint_union(meshes.two_tori_on_a_neck(), sphere, sphere)
    )
    assert one.euler_characteristic == other.euler_characteristic
    assert one.n_components == other.n_components
    assert not one.same_topology(other)
    assert one.same_topology(tetsimplify.topology(*meshes.disjoint_union(sphere, torus, torus)))


def test_a_hub_of_many_faces():
    n = 5000
    ring = np.arange(1, n + 1)
    faces = np.column_stack([np.zeros(n, int), ring, np.roll(ring, -1)])
    report = tetsimplify.topology(np.zeros((n + 1, 3)), faces)
    assert report.is_manifold
    assert report.n_boundary_edges == n


def test_an_edge_of_many_faces():
    n = 3000
    faces = np.column_stack([np.zeros(n, int), np.ones(n, int), np.arange(2, n + 2)])
    report = tetsimplify.topology(np.zeros((n + 2, 3)), faces)
    assert report.edge_degrees == {1: 2 * n, n: 1}
    assert report.non_manifold_edges.tolist() == [[0, 1]]


def test_positions_do_not_matter():
    vertices, faces = meshes.octahedron()
    vertices[:] = np.nan
    assert tetsimplify.topology(vertices, faces).is_manifold


# --- threads --------------------------------------------------------------------------------------


@pytest.fixture
def threads_for_all(monkeypatch):
    """Threads for small meshes too."""
    monkeypatch.setattr(MODULE, "LEAST_FACES", 0)


def as_bytes(examined):
    """All that is found, to the last bit."""
    report = examined.report
    fields = {
        name: value.tobytes() if isinstance(value, np.ndarray) else value
        for name, value in dataclasses.asdict(report).items()
    }
    return fields, *(part.tobytes() for part in (examined.loop, examined.next_corner))


def assert_linked(corner_vertex, examined):
    """All corners of a vertex form one circle, in a manifold anticlockwise with a gap at most."""
    report, loop, on_loops, next_corner, first_corner = examined
    assert on_loops.tolist() == np.flatnonzero(loop >= 0).tolist()
    if report.is_manifold:
        assert_in_order(corner_vertex, next_corner, loop >= 0)
    valence = np.bincount(corner_vertex, minlength=len(first_corner))
    for v in np.flatnonzero(valence):
        corner, seen = first_corner[v], set()
        while corner not in seen:
            assert corner_vertex[corner] == v
            seen.add(corner)
            corner = next_corner[corner]
        assert corner == first_corner[v] and len(seen) == valence[v]


def assert_threads_make_no_difference(vertices, faces):
    corner_vertex = np.ascontiguousarray(faces, np.int32).reshape(-1)
    expected = examine(corner_vertex, len(vertices), threads=1)
    if len(corner_vertex):
        assert (expected.next_corner >= 0).all()
    assert_linked(corner_vertex, expected)
    for threads in (2, 3, 8):
        found = examine(corner_vertex, len(vertices), threads=threads)
        assert as_bytes(found) == as_bytes(expected)


@pytest.mark.parametrize("mesh", BROKEN)
def test_threads_make_no_difference_to_broken_meshes(threads_for_all, mesh):
    assert_threads_make_no_difference(*mesh)


def test_threads_make_no_difference_to_adversarial_surfaces(threads_for_all):
    """As they are, and with vertices in any order, so that ranges are tied together everywhere."""
    for seed in range(200):
        vertices, faces = strategies.adversarial_mesh(seed)
        assert_threads_make_no_difference(vertices, faces)
        rng = np.random.default_rng(seed)
        assert_threads_make_no_difference(vertices, rng.permutation(len(vertices))[faces])


@settings(max_examples=200, deadline=None)
@given(st.integers(3, 9), st.integers(0, 25), st.integers(0, 2**32 - 1))
def test_threads_make_no_difference_to_any_set_of_triangles(n_vertices, n_faces, seed):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MODULE, "LEAST_FACES", 0)
        faces = np.random.default_rng(seed).integers(0, n_vertices, (n_faces, 3))
        assert_threads_make_no_difference(np.zeros((n_vertices, 3)), faces)


def test_ranges_are_tied_together_and_agree_with_the_oracle(threads_for_all):
    """Many pieces, with handles and boundaries, whose vertices are all over the ranges."""
    pieces = [meshes.minimal_torus(), meshes.annulus(5), meshes.icosphere(1)] * 6
    vertices, faces = meshes.disjoint_union(*pieces)
    for seed in range(20):
        place = np.random.default_rng(seed).permutation(len(vertices))
        assert_agrees(vertices, place[faces])


def test_tails_that_share_a_slot(threads_for_all):
    """Neighbours whose numbers have the same last bits put one another out; no fault is found."""
    vertices, faces = meshes.icosphere(2)
    place = kernels.surface.SLOTS * np.arange(len(vertices)) + 1
    report = tetsimplify.topology(np.zeros((place[-1] + 1, 3)), place[faces])
    assert report.is_manifold and report.euler_characteristic == 2
    assert report.edge_degrees == {2: 3 * len(faces) // 2}


@pytest.mark.parametrize("valence", [63, 64, 65, 200])
def test_vertices_of_many_faces(threads_for_all, valence):
    """A double cone: more faces at its tips than there is room for are no fault."""
    ring = np.arange(1, valence + 1)
    after = np.roll(ring, -1)
    tip = np.zeros(valence, int)
    cone = np.column_stack([tip, ring, after])
    closed = np.vstack([cone, np.column_stack([tip + valence + 1, after, ring])])
    vertices = np.zeros((valence + 2, 3))
    assert_threads_make_no_difference(vertices, closed)
    assert tetsimplify.topology(vertices, closed).components.tolist() == [[2, 0]]
    # one face turned round: the cycle is broken at both its ends and at the tip
    closed[0] = closed[0, ::-1]
    assert len(tetsimplify.topology(vertices, closed).inconsistent_edges) == 3


def test_two_fans_of_as_many_faces_are_no_cycle(threads_for_all):
    """Two octahedra that meet in a point: each of its two cycles comes back too early."""
    vertices, faces = meshes.octahedron()
    other = np.where(faces == 0, 0, faces + len(vertices))
    both = np.vstack([faces, other])
    report = tetsimplify.topology(np.zeros((2 * len(vertices), 3)), both)
    assert report.non_manifold_vertices.tolist() == [0]
    assert_threads_make_no_difference(np.zeros((2 * len(vertices), 3)), both)


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2"])
def test_wrong_numbers_of_threads_are_refused(threads):
    with pytest.raises(tetsimplify.OptionError, match="threads must be a positive integer"):
        tetsimplify.topology(*meshes.octahedron(), threads=threads)


def test_threads_go_with_arrays():
    with pytest.raises(tetsimplify.OptionError, match="vertices and faces"):
        tetsimplify.topology(object(), threads=2)
