"""What vertices carry through the contractions: normals keep unit length."""

import numpy as np
import pytest

import meshes
from tetsimplify import simplify
from tetsimplify.data import VertexWeights


def carried(values, merges, name="normals"):
    """Data of vertices after some merges (vertex merged, into which, where between them)."""
    merged_into = np.arange(len(values), dtype=np.int32)
    for u, v, _ in merges:
        merged_into[u] = v
    steps = np.array([(u, place) for u, _, place in merges], dtype=float).reshape(-1, 2)
    vertex_map = np.full(len(values), -1, np.int32)
    kept = merged_into == np.arange(len(values))
    vertex_map[kept] = np.arange(kept.sum())
    return VertexWeights(merged_into, steps).carry({name: values}, vertex_map)[name]


@pytest.mark.parametrize("name", ["normal", "normals", "Normals", "NORMAL"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_interpolated_normals_have_unit_length(name, dtype):
    vertices, faces = meshes.icosphere(3)
    data = {name: vertices.astype(dtype), "shorter": vertices}
    result = simplify(vertices, faces, max_edge_length=0.5, vertex_data=data)
    normals = result.vertex_data[name]
    assert normals.dtype == dtype
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
    directions = result.vertices / np.linalg.norm(result.vertices, axis=1, keepdims=True)
    assert ((normals * directions).sum(axis=1) > 0.99).all()
    assert np.linalg.norm(result.vertex_data["shorter"], axis=1).min() < 0.99


def test_normals_that_were_not_interpolated_are_the_same_bytes():
    vertices, faces = meshes.icosphere(2)
    given = 3.0 * vertices.astype(np.float32)
    result = simplify(vertices, faces, max_edge_length=0.0, vertex_data={"normals": given})
    assert result.vertex_data["normals"].tobytes() == given.tobytes()
    ends = simplify(
        vertices, faces, max_edge_length=0.5, placement="endpoint", vertex_data={"normal": given}
    )
    assert {tuple(row) for row in ends.vertex_data["normal"]} <= {tuple(row) for row in given}


def test_the_mean_direction_of_several():
    values = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 5]])
    rows = carried(values, [(1, 0, 0.5), (2, 0, 0.2)])
    mean = np.array([0.4, 0.4, 0.2])
    np.testing.assert_allclose(rows[0], mean / np.linalg.norm(mean))
    np.testing.assert_array_equal(rows[1], values[3])


@pytest.mark.parametrize(("place", "expected"), [(0.5, 0), (0.5 + 1e-9, 1)])
def test_normals_that_cancel_out_are_those_of_the_nearer_end(place, expected):
    values = np.array([[0.0, 0, 1], [0, 0, -1]])
    np.testing.assert_array_equal(carried(values, [(1, 0, place)]), values[[expected]])


def test_no_normals_stay_none():
    rows = carried(np.zeros((3, 3)), [(1, 0, 0.5)])
    np.testing.assert_array_equal(rows, np.zeros((2, 3)))
    labels = np.array([[1, 0, 0], [0, 7, 0]])
    np.testing.assert_array_equal(carried(labels, [(1, 0, 0.5)]), labels[:1])
    np.testing.assert_array_equal(carried(np.array([[2.0], [4.0]]), [(1, 0, 0.5)]), [[3.0]])


def test_normals_at_corners_have_unit_length():
    vertices, faces = meshes.torus(24, 12)
    at_corners = vertices[faces] / np.linalg.norm(vertices[faces], axis=2, keepdims=True)
    result = simplify(
        vertices, faces, max_edge_length=1.0, face_data={"normals": at_corners}, seams="normals"
    )
    assert len(result.faces) < 0.5 * len(faces)
    lengths = np.linalg.norm(result.face_data["normals"], axis=2)
    np.testing.assert_allclose(lengths, 1.0, atol=1e-12)
