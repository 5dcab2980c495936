"""The topology report against the oracle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import naive
import strategies
import tetsimplify

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
