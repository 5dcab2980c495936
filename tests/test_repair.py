"""Repair: any set of triangles becomes an oriented manifold, and no sound one is changed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import strategies
import tetsimplify
from tetsimplify.report import RepairReport


def assert_repaired(vertices, faces):
    repaired = tetsimplify.repair(vertices, faces)
    assert tetsimplify.topology(repaired.vertices, repaired.faces).is_manifold
    # no vertex moves, no face changes but for its orientation
    origin = repaired.vertex_origin
    assert np.array_equal(repaired.vertices, np.asarray(vertices, float)[origin])
    old = np.sort(np.asarray(faces)[repaired.face_map], axis=1)
    assert np.array_equal(np.sort(origin[repaired.faces], axis=1), old)
    kept = repaired.vertex_map[repaired.vertex_map >= 0]
    assert np.array_equal(repaired.vertex_map[origin[kept]], kept)
    report = repaired.report
    dropped = report.degenerate_faces_dropped + report.duplicate_faces_dropped
    assert len(repaired.faces) == len(faces) - dropped
    assert len(repaired.vertices) == (
        len(vertices) - report.unreferenced_vertices_dropped + report.vertices_added
    )
    return repaired


@settings(max_examples=300, deadline=None)
@given(st.integers(3, 9), st.integers(0, 25), st.integers(0, 2**32 - 1))
def test_any_set_of_triangles(n_vertices, n_faces, seed):
    rng = np.random.default_rng(seed)
    assert_repaired(rng.normal(size=(n_vertices, 3)), rng.integers(0, n_vertices, (n_faces, 3)))


@settings(max_examples=100, deadline=None)
@given(strategies.surfaces())
def test_sound_meshes_are_left_alone(mesh):
    repaired = assert_repaired(*mesh)
    assert repaired.report == RepairReport()
    assert np.array_equal(repaired.faces, mesh[1])


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (meshes.bow_tie(), {"vertices_split": 1, "vertices_added": 1}),
        (meshes.collapsed_face(), {"degenerate_faces_dropped": 1}),
        (meshes.double_covered_triangle(), {"duplicate_faces_dropped": 1}),
        (meshes.flipped_face(), {"faces_flipped": 1}),
        (meshes.three_pages(), {"edges_split": 1}),
        (meshes.moebius_strip(), {"edges_split": 1}),
    ],
)
def test_each_fault_is_counted(mesh, expected):
    report = assert_repaired(*mesh).report
    assert {name: getattr(report, name) for name in expected} == expected


def test_the_majority_keeps_its_orientation():
    vertices, faces = meshes.icosphere(1)
    inside_out = faces.copy()
    inside_out[:60] = inside_out[:60, ::-1]
    repaired = assert_repaired(vertices, inside_out)
    assert repaired.report.faces_flipped == len(faces) - 60
    assert np.array_equal(repaired.faces[:60], inside_out[:60])


def test_nothing_given_is_changed():
    vertices, faces = meshes.three_pages()
    copies = vertices.copy(), faces.copy()
    tetsimplify.repair(vertices, faces)
    assert np.array_equal(vertices, copies[0])
    assert np.array_equal(faces, copies[1])
