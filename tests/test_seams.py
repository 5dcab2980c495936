"""Seams: cut open, kept in place, welded again."""

from __future__ import annotations

import numpy as np
import pytest

import meshes
from strategies import adversarial_mesh
from tetsimplify import MeshError, copies, cutting, extract_isosurface, seams, topology
from tetsimplify.mesh import Mesh


def square(n: int) -> Mesh:
    """A flat square of n by n cells, jagged a little so that no lengths tie."""
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    a = np.flatnonzero((x < n) & (y < n))
    faces = np.concatenate([np.c_[a, a + 1, a + n + 2], np.c_[a, a + n + 2, a + n + 1]])
    inner = (x % n > 0) & (y % n > 0)
    jitter = 0.2 * inner[:, None] * np.random.default_rng(1).uniform(-1, 1, (len(x), 2))
    jitter[x == n // 2, 0] = 0.0
    return Mesh(np.c_[np.c_[x, y] + jitter, 0.0 * x], faces.astype(np.int32))


def charts(mesh: Mesh, seed: int, n_charts: int = 4) -> np.ndarray:
    """A label for each face: that of the nearest of a few random vertices."""
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    sites = mesh.vertices[np.random.default_rng(seed).integers(len(mesh.vertices), size=n_charts)]
    return np.argmin(np.linalg.norm(centres[:, None] - sites, axis=2), axis=1)


def merged(vertices, faces) -> Mesh:
    """The mesh with vertices in the same place made one."""
    unique, number = np.unique(np.asarray(vertices), axis=0, return_inverse=True)
    return Mesh(unique, number.reshape(-1)[faces])


def same_values_at_each_vertex(faces, wedges) -> bool:
    """Whether all corners of each vertex have the same value."""
    low, high = np.full(faces.max() + 1, np.inf), np.full(faces.max() + 1, -np.inf)
    np.minimum.at(low, faces.reshape(-1), wedges.reshape(-1))
    np.maximum.at(high, faces.reshape(-1), wedges.reshape(-1))
    return bool((low >= high).all())


# --- cutting and welding -------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(30))
def test_cut_leaves_one_value_at_each_vertex_and_can_be_undone(seed):
    mesh = Mesh(*adversarial_mesh(seed))
    wedges = np.repeat(charts(mesh, seed)[:, None], 3, axis=1).astype(float)
    parts = cutting.cut(mesh.faces, wedges, len(mesh.vertices))
    assert same_values_at_each_vertex(parts.faces, wedges)
    np.testing.assert_array_equal(parts.origin[parts.faces], mesh.faces)
    np.testing.assert_array_equal(parts.origin[: len(mesh.vertices)], np.arange(len(mesh.vertices)))
    assert topology(mesh.vertices[parts.origin], parts.faces).is_manifold
    opened = set(meshes.boundary_edges(parts.faces)) != set(meshes.boundary_edges(mesh.faces))
    assert opened == (len(np.unique(wedges)) > 1 and parts.on_seam.any())


def test_a_mesh_without_seams_is_not_cut():
    mesh = square(6)
    u = mesh.vertices[mesh.faces, 0]
    u[:3] = np.nan  # as values that nobody has set: no seam between NaN and NaN
    u[np.isin(mesh.faces, mesh.faces[:3])] = np.nan
    parts = cutting.cut(mesh.faces, u, len(mesh.vertices))
    assert parts.faces is not None and len(parts.origin) == len(mesh.vertices)
    assert not parts.on_seam.any()


def test_the_end_of_a_seam_is_on_it_but_not_copied():
    mesh = square(8)
    x = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    at_seam = (mesh.vertices[mesh.faces, 0] == 4) & (mesh.vertices[mesh.faces, 1] < 3.5)
    wedges = np.where(at_seam & (x > 4)[:, None], 1.0, 0.0)
    parts = cutting.cut(mesh.faces, wedges, len(mesh.vertices))
    ends = np.flatnonzero(parts.on_seam[: len(mesh.vertices)])
    assert len(ends) == len(parts.origin) - len(mesh.vertices) + 1
    assert topology(mesh.vertices[parts.origin], parts.faces).n_boundary_loops == 1


def many_places() -> dict[str, np.ndarray]:
    """Vertices of which some are in one place."""
    rng = np.random.default_rng(3)
    signed = rng.integers(-3, 3, (400, 3)) / 7
    signed[5], signed[9] = -0.0, 0.0
    fine = 1e16 * np.ones((400, 3))
    fine[:, 1:] = rng.integers(0, 15, (400, 2))  # too fine to show beside the first coordinate
    return {
        "few": signed,
        "all in one": np.ones((300, 3)),
        "all apart": rng.random((500, 3)),
        "grid": np.indices((8, 9, 10)).reshape(3, -1).T.astype(float),
        "fine": fine,
        "tiny": rng.integers(0, 9, (400, 3)) * 5e-324,
        "none": np.empty((0, 3)),
    }


@pytest.mark.parametrize("name", many_places())
def test_places_finds_exactly_equal_positions(name):
    vertices = many_places()[name]
    found = copies.places(vertices)
    np.testing.assert_array_equal(vertices[found], vertices)
    assert len(np.unique(found)) == len(np.unique(vertices, axis=0))


# --- simplification ------------------------------------------------------------------------------


@pytest.mark.parametrize("length", [0.4, 2.0, 1e9])
@pytest.mark.parametrize("seed", [*range(40), 56, 78])  # the last two: faces on both sides alike
def test_topology_and_charts_are_kept(seed, length):
    mesh = Mesh(*adversarial_mesh(seed))
    chart = charts(mesh, seed)
    result = seams.simplify(
        *mesh,
        face_data={"chart": chart},
        wedge_data={"chart": np.repeat(chart[:, None], 3, axis=1)},
        max_edge_length=length,
        foldover=None,
        removal_limit=np.inf,
    )
    before, after = topology(*mesh), topology(result.vertices, result.faces)
    assert after.same_topology(before)
    assert result.report.topology_before.same_topology(before)
    assert result.report.topology_after.n_vertices == len(result.vertices)
    np.testing.assert_array_equal(
        result.wedge_data["chart"], np.repeat(result.face_data["chart"][:, None], 3, axis=1)
    )
    np.testing.assert_array_equal(result.face_data["chart"], chart[result.face_map])
    lengths = np.linalg.norm(
        np.diff(result.vertices[result.report.remaining_edges], axis=1), axis=2
    )
    assert (lengths < length).all()


@pytest.mark.parametrize("seed", range(40))
def test_copies_of_vertices_stay_together(seed):
    mesh = Mesh(*adversarial_mesh(seed))
    wedges = np.repeat(charts(mesh, seed)[:, None], 3, axis=1)
    parts = cutting.cut(mesh.faces, wedges, len(mesh.vertices))
    vertices = mesh.vertices[parts.origin]
    result = seams.simplify(
        vertices,
        parts.faces,
        vertex_data={"place": vertices},
        max_edge_length=1e9,
        foldover=None,
        removal_limit=np.inf,
    )
    assert topology(result.vertices, result.faces).same_topology(topology(vertices, parts.faces))
    assert topology(*merged(result.vertices, result.faces)).same_topology(topology(*mesh))
    np.testing.assert_allclose(result.vertex_data["place"], result.vertices, atol=1e-12)


def test_the_neighbours_of_a_seam_are_locked_when_both_sides_would_meet():
    """Two fans around a seam of two edges: each side alone comes to have the same chord."""
    vertices = [[-2, 0, 0], [0, 0, 0], [2, 0, 0], [0, 1, 0], [0, -1, 0], [0, 3, 0], [0, -3, 0]]
    upper = [[0, 1, 3], [1, 2, 3], [3, 2, 5], [0, 3, 5]]
    lower = [[1, 0, 4], [2, 1, 4], [2, 4, 6], [4, 0, 6]]
    faces = np.array(upper + lower)
    wedges = np.repeat([[1.0]] * 4 + [[2.0]] * 4, 3, axis=1)
    given = topology(vertices, faces)
    result = seams.simplify(
        vertices, faces, wedge_data={"u": wedges}, max_edge_length=9, foldover=None
    )
    assert given.is_manifold and result.report.topology_after.same_topology(given)


def test_both_sides_of_a_seam_stay_in_place_and_keep_their_values():
    mesh = square(20)
    right = mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 10
    u = mesh.vertices[mesh.faces, :2] + np.where(right, 100.0, 0.0)[:, None, None]
    result = seams.simplify(*mesh, wedge_data={"uv": u}, max_edge_length=2.5)
    assert len(result.faces) < len(mesh.faces) / 2
    kept = result.vertex_map[mesh.vertices[:, 0] == 10]
    np.testing.assert_array_equal(result.vertices[kept], mesh.vertices[mesh.vertices[:, 0] == 10])
    is_right = right[result.face_map]
    expected = result.vertices[result.faces, :2] + np.where(is_right, 100.0, 0.0)[:, None, None]
    np.testing.assert_allclose(result.wedge_data["uv"], expected, atol=1e-11)
    centres = result.vertices[result.faces].mean(axis=1)[:, 0]
    np.testing.assert_array_equal(centres > 10, is_right)  # nothing bleeds over


def test_colours_are_averaged_and_labels_are_not():
    mesh = square(16)
    colour = np.rint(np.c_[mesh.vertices[:, :2] * 10, 0 * mesh.vertices[:, :1]]).astype(np.uint8)
    label = (mesh.vertices[:, 0] > 8) * 7
    result = seams.simplify(
        *mesh, vertex_data={"rgb": colour, "label": label, "x10": colour}, max_edge_length=3
    )
    assert result.vertex_data["rgb"].dtype == np.uint8
    assert np.abs(result.vertex_data["rgb"][:, :2] - result.vertices[:, :2] * 10).max() <= 1.0
    assert set(np.unique(result.vertex_data["label"])) == {0, 7}
    only = seams.simplify(*mesh, vertex_data={"rgb": colour}, colours=(), max_edge_length=3)
    assert {tuple(row) for row in only.vertex_data["rgb"]} <= {tuple(row) for row in colour}


def test_wedge_and_vertex_data_may_have_the_same_name():
    mesh = square(6)
    x = mesh.vertices[:, 0]
    result = seams.simplify(
        *mesh, vertex_data={"a": x}, wedge_data={"a": -x[mesh.faces]}, max_edge_length=2
    )
    np.testing.assert_array_equal(result.wedge_data["a"], -result.vertex_data["a"][result.faces])


def test_repair_turns_the_wedges_of_flipped_faces():
    mesh = square(6)
    faces = mesh.faces.copy()
    faces[7] = faces[7, ::-1]
    wedges = mesh.vertices[faces, :2]
    with pytest.raises(MeshError, match="repair=True"):
        seams.simplify(mesh.vertices, faces, wedge_data={"uv": wedges}, max_edge_length=0.0)
    result = seams.simplify(
        mesh.vertices, faces, wedge_data={"uv": wedges}, repair=True, max_edge_length=0.0
    )
    assert result.report.repairs.faces_flipped == 1
    np.testing.assert_array_equal(result.wedge_data["uv"], result.vertices[result.faces, :2])


def test_input_is_not_changed():
    mesh = square(6)
    wedges = mesh.vertices[mesh.faces, :2]
    colour = np.zeros((len(mesh.vertices), 3), np.uint8)
    for array in (*mesh, wedges, colour):
        array.flags.writeable = False
    seams.simplify(
        *mesh, wedge_data={"uv": wedges}, vertex_data={"c": colour}, max_edge_length=2, repair=True
    )


def test_a_mesh_without_faces():
    result = seams.simplify(
        np.zeros((2, 3)), np.empty((0, 3), int), vertex_data={"a": [1, 2]}, max_edge_length=1
    )
    assert len(result.faces) == 0


def test_one_seam_on_an_isosurface():
    z, y, x = np.mgrid[-1:1:40j, -1:1:40j, -1:1:40j]
    mesh = extract_isosurface(0.35 - np.hypot(np.hypot(x, y) - 0.6, z), 0.0, spacing=[2 / 39] * 3)
    angle = np.arctan2(mesh.vertices[:, 1] - 1, mesh.vertices[:, 2] - 1)[mesh.faces]
    across = np.ptp(angle, axis=1) > np.pi
    angle[across] %= 2 * np.pi
    result = seams.simplify(*mesh, wedge_data={"u": angle}, max_edge_length=0.12)
    assert result.report.topology_after.same_topology(topology(*mesh))
    assert (np.ptp(result.wedge_data["u"], axis=1) < 2.0).all()  # none spans the whole texture
