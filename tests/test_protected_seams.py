"""The option `seams` of `simplify`: borders of labels, edges, texture seams stay as they are."""

from __future__ import annotations

import numpy as np
import pytest

import meshes
import naive
from strategies import adversarial_mesh
from tetsimplify import OptionError, cutting, extract_isosurface, self_intersections, simplify
from tetsimplify.mesh import Mesh

TO_THE_END = {"max_edge_length": 1e9, "foldover": None, "removal_limit": np.inf}
CRITERIA = {
    "length": {"max_edge_length": 0.3},
    "to the end": TO_THE_END,
    "faces": {"keep_ratio": 0.2},
    "error": {"max_error": 0.03},
    "without crossings": {"max_edge_length": 0.3, "intersections": "prevent"},
}


def open_surface() -> Mesh:
    z, y, x = np.mgrid[-3:3:17j, -3:3:17j, -3:3:17j]
    return extract_isosurface(np.sin(x) + np.sin(y) + np.sin(z), 0.1, spacing=[0.15] * 3)


SURFACES = {
    "sphere": lambda: meshes.icosphere(4),
    "torus": lambda: meshes.torus(48, 24),
    "open": open_surface,
}


def coloured(mesh: Mesh, n: int = 2) -> np.ndarray:
    """Labels of the faces: bands across an axis, jagged as the faces are."""
    x = mesh.vertices[mesh.faces].mean(axis=1) @ (1.0, 0.7, 0.1)
    return np.digitize(x, np.linspace(x.min(), x.max(), n + 1)[1:-1])


def charts(mesh: Mesh, seed: int) -> np.ndarray:
    """A label for each face, at random."""
    rng = np.random.default_rng(seed)
    sites = mesh.vertices[rng.integers(len(mesh.vertices), size=4)]
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    return np.argmin(np.linalg.norm(centres[:, None] - sites, axis=2), axis=1)


def border(vertices, faces, labels) -> set[tuple]:
    """The edges between faces of different labels: places of both ends, labels of both sides."""
    at_edge = naive.faces_at_edges(np.asarray(faces).tolist())
    return {
        (*sorted(tuple(vertices[v]) for v in edge), *sorted(str(labels[f]) for f in at))
        for edge, at in at_edge.items()
        if len({labels[f] for f in at}) > 1
    }


def assert_regions_kept(mesh, labels, result, new_labels):
    """Each region has its topology, and the border is the same polyline between the same."""
    assert np.array_equal(new_labels, labels[result.face_map])
    before, after = naive.summary(mesh.faces), naive.summary(result.faces)
    assert after.is_sound
    assert naive.has_same_topology(before, after)
    assert border(result.vertices, result.faces, new_labels) == border(*mesh, labels)
    for label in np.unique(labels):
        region, new = (
            naive.summary(f[x == label])
            for f, x in ((mesh.faces, labels), (result.faces, new_labels))
        )
        assert new.components == region.components
        assert new.euler_characteristic == region.euler_characteristic
        assert new.n_boundary_loops == region.n_boundary_loops


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("surface", SURFACES)
def test_regions_of_labels_are_kept(surface, criterion):
    mesh = Mesh(*SURFACES[surface]())
    labels = coloured(mesh)
    options = CRITERIA[criterion]
    result = simplify(*mesh, face_data={"colour": labels}, seams="colour", **options)
    assert len(result.faces) < 0.7 * len(mesh.faces)
    assert_regions_kept(mesh, labels, result, result.face_data["colour"])
    free = simplify(*mesh, face_data={"colour": labels}, **options)
    assert border(*free[:2], free.face_data["colour"]) != border(*mesh, labels)
    if criterion == "without crossings":
        assert self_intersections(*result[:2]).is_embedded


@pytest.mark.parametrize("seed", range(80))
def test_regions_are_kept_on_adversarial_surfaces(seed):
    mesh = Mesh(*adversarial_mesh(seed))
    labels = charts(mesh, seed)
    result = simplify(*mesh, face_data={"chart": labels}, seams=["chart"], **TO_THE_END)
    assert_regions_kept(mesh, labels, result, result.face_data["chart"])


def some_edges(mesh: Mesh, seed: int, part: float) -> np.ndarray:
    """A part of the edges at random, with their ends in any order."""
    rng = np.random.default_rng(seed)
    edges = np.array(naive.all_edges(mesh.faces))
    chosen = edges[rng.random(len(edges)) < part]
    return np.where(rng.random((len(chosen), 1)) < 0.5, chosen, chosen[:, ::-1])


@pytest.mark.parametrize("part", [0.01, 0.05, 0.2])
@pytest.mark.parametrize("seed", range(0, 200, 2))
def test_edges_stay_on_adversarial_surfaces(seed, part):
    mesh = Mesh(*adversarial_mesh(seed))
    edges = some_edges(mesh, seed, part)
    result = simplify(*mesh, seams=edges, **TO_THE_END)
    assert naive.summary(result.faces).is_sound
    assert naive.has_same_topology(naive.summary(mesh.faces), naive.summary(result.faces))
    kept = result.vertex_map[edges]
    assert np.array_equal(result.vertices[kept], mesh.vertices[edges])
    left = set(naive.all_edges(result.faces))
    assert {naive.edge(*pair) for pair in kept.tolist()} <= left


def test_the_boundary_is_not_pulled_onto_a_seam_beside_it():
    mesh = Mesh(*meshes.grid(12, 12))
    row = mesh.vertices[mesh.faces, 1].mean(axis=1) < 1
    result = simplify(*mesh, face_data={"row": row}, seams="row", **TO_THE_END)
    assert_regions_kept(mesh, row, result, result.face_data["row"])


def test_several_labels_of_any_kind_and_edges_of_a_path():
    mesh = Mesh(*meshes.torus(48, 24))
    names = np.array(["red", "green", "blue"])[coloured(mesh, 3)]
    left = mesh.vertices[mesh.faces, 1].mean(axis=1) < 0
    result = simplify(
        *mesh, face_data={"name": names, "left": left}, seams=["left", "name"], **TO_THE_END
    )
    assert_regions_kept(mesh, names, result, result.face_data["name"])
    assert_regions_kept(mesh, left, result, result.face_data["left"])


def test_values_at_corners_are_interpolated_and_their_seams_are_kept():
    mesh = Mesh(*meshes.grid(16, 16))
    right = mesh.vertices[mesh.faces, 0].mean(axis=1) > 8
    uv = mesh.vertices[mesh.faces, :2] + np.where(right, 100.0, 0.0)[:, None, None]
    result = simplify(*mesh, face_data={"side": right, "uv": uv}, seams="uv", max_edge_length=3)
    assert list(result.face_data) == ["side", "uv"]
    assert len(result.faces) < 0.5 * len(mesh.faces)
    assert_regions_kept(mesh, right, result, result.face_data["side"])
    expected = result.vertices[result.faces, :2]
    expected = expected + np.where(result.face_data["side"], 100.0, 0.0)[:, None, None]
    np.testing.assert_allclose(result.face_data["uv"], expected, atol=1e-9)


def opened_torus() -> tuple[Mesh, Mesh, np.ndarray]:
    """A torus, the same cut open along two seams of its texture, and that texture."""
    mesh = Mesh(*meshes.torus(40, 20))
    faces = np.arange(len(mesh.faces)) // 2
    wedges = np.repeat((faces // 20 < 20).astype(int)[:, None], 3, axis=1)
    parts = cutting.cut(mesh.faces, wedges, len(mesh.vertices))
    side = np.zeros(len(parts.origin))
    side[parts.faces] = wedges
    return mesh, Mesh(mesh.vertices[parts.origin], parts.faces), side


def welded(result) -> naive.Summary:
    """The topology with vertices in one place made one."""
    _, number = np.unique(result.vertices, axis=0, return_inverse=True)
    return naive.summary(number.reshape(-1)[result.faces])


@pytest.mark.parametrize("options", [{"keep_ratio": 0.1}, {"max_edge_length": 1.0}])
def test_copies_of_vertices_stay_together(options):
    mesh, opened, side = opened_torus()
    result = simplify(*opened, vertex_data={"u": side}, seams="u", **options)
    assert len(result.faces) < 0.7 * len(opened.faces)
    assert naive.has_same_topology(welded(result), naive.summary(mesh.faces))
    torn = simplify(*opened, vertex_data={"u": side}, **options)
    assert not welded(torn).is_closed


def test_seams_lead_through_repair():
    mesh = Mesh(*meshes.torus(24, 12))
    labels, faces = coloured(mesh), mesh.faces.copy()
    faces[7] = faces[7, ::-1]
    data = {"face_data": {"colour": labels}, "repair": True}
    result = simplify(mesh.vertices, faces, seams="colour", **data, **TO_THE_END)
    assert result.report.repairs.faces_flipped == 1
    assert_regions_kept(mesh, labels, result, result.face_data["colour"])
    at_edge = naive.faces_at_edges(faces.tolist())
    edges = [pair for pair, at in at_edge.items() if len({labels[f] for f in at}) > 1]
    result = simplify(mesh.vertices, faces, seams=edges, **data, **TO_THE_END)
    assert_regions_kept(mesh, labels, result, result.face_data["colour"])


def test_no_seams_change_nothing():
    mesh = Mesh(*meshes.icosphere(3))
    same = np.zeros(len(mesh.faces), int)
    plain = simplify(*mesh, max_edge_length=0.4)
    for seams in (None, [], np.empty((0, 2), int), "same", ["same"]):
        result = simplify(*mesh, face_data={"same": same}, seams=seams, max_edge_length=0.4)
        for a, b in zip(result[:4], plain[:4], strict=True):
            assert a.tobytes() == b.tobytes()


def test_input_is_not_changed():
    mesh = Mesh(*meshes.torus(16, 8))
    edges, labels = some_edges(mesh, 0, 0.1), coloured(mesh)
    for array in (*mesh, edges, labels):
        array.flags.writeable = False
    simplify(*mesh, seams=edges, max_edge_length=1.0)
    simplify(*mesh, face_data={"a": labels}, seams="a", max_edge_length=1.0)


def test_a_vertex_of_two_fans_is_refused_though_a_seam_would_part_it():
    vertices, faces = meshes.bow_tie()
    with pytest.raises(ValueError, match="more than one fan"):
        simplify(
            vertices, faces, face_data={"n": np.arange(len(faces))}, seams="n", max_edge_length=1
        )


@pytest.mark.parametrize(
    ("seams", "message"),
    [
        ("colour", "seams='colour' names no face_data and no vertex_data, given: 'f', 'xyz', 'v'"),
        (["xyz", "w"], "seams='w' names no face_data"),
        ("f", r"'f': labels of faces must be integers.* got float64 of shape \(8,\)"),
        ([0, 1], r"edges, integers of shape \(k, 2\); got int64 of shape \(2,\)"),
        ([[0.0, 1.0]], "got float64"),
        ([[0, 1, 2]], r"shape \(1, 3\)"),
        ([[0, 9]], "seams must hold vertex indices from 0 to 5, got 0 to 9"),
        ([[-1, 0]], "from 0 to 5, got -1 to 0"),
        ([[0, 1], [2, 2]], r"seams must hold edges of the mesh, got \[2, 2\]"),
        (3, "must be names of face_data"),
        (["xyz", 3], "must be names of face_data"),
    ],
)
def test_wrong_seams(seams, message):
    vertices, faces = meshes.octahedron()
    first = faces[0, :2]
    if isinstance(seams, list) and seams == [[0, 1], [2, 2]]:
        seams = [first.tolist(), [2, 2]]
    data = {"f": np.ones(8), "xyz": np.zeros((8, 3), int)}
    with pytest.raises(OptionError, match=message):
        simplify(
            vertices,
            faces,
            face_data=data,
            vertex_data={"v": vertices},
            seams=seams,
            max_edge_length=1,
        )


def test_seams_need_a_topology_that_is_kept():
    with pytest.raises(OptionError, match="seams need a topology that is kept"):
        simplify(*meshes.octahedron(), seams=[], blocked="violate", max_edge_length=1)
