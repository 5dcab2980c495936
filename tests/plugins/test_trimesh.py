"""trimesh in and out."""

from __future__ import annotations

import copy

import numpy as np
import pytest

import tetsimplify
from data import data_dir, needs_data
from tetsimplify import MeshError, adapters

trimesh = pytest.importorskip("trimesh")
plugin = pytest.importorskip("tetsimplify.plugins.trimesh")

TextureVisuals = trimesh.visual.TextureVisuals


def sphere(**options):
    """A sphere of 1280 faces; edges are 0.1 to 0.2 long."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    return trimesh.Trimesh(ball.vertices, ball.faces, process=False, **options)


def textured_cylinder(n_around: int = 60, n_up: int = 40):
    """An open cylinder around z with a texture once around: vertices at the seam are doubled."""
    j, i = np.divmod(np.arange((n_around + 1) * (n_up + 1)), n_around + 1)
    angle = 2 * np.pi * (i % n_around) / n_around
    vertices = np.c_[np.cos(angle), np.sin(angle), 3 * j / n_up]
    image = pytest.importorskip("PIL.Image").new("RGB", (8, 8), (200, 10, 10))
    a = np.flatnonzero((i < n_around) & (j < n_up))
    w = n_around + 1
    faces = np.concatenate([np.c_[a, a + 1, a + w + 1], np.c_[a, a + w + 1, a + w]])
    uv = np.c_[i / n_around, j / n_up]
    visual = TextureVisuals(uv=uv, image=image)
    return trimesh.Trimesh(vertices, faces, visual=visual, process=False)


def merged_topology(mesh):
    """Topology after merging vertices in the same place."""
    _, number = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return tetsimplify.topology(mesh.vertices, number.reshape(-1)[mesh.faces])


def assert_equal(a, b):
    """The same mesh with all that belongs to it."""
    np.testing.assert_array_equal(a.vertices, b.vertices)
    np.testing.assert_array_equal(a.faces, b.faces)
    for name in ("vertex_attributes", "face_attributes", "metadata"):
        x, y = getattr(a, name), getattr(b, name)
        assert list(x) == list(y)
        for key in x:
            np.testing.assert_array_equal(x[key], y[key])
            assert np.asarray(x[key]).dtype == np.asarray(y[key]).dtype
    assert type(a.visual) is type(b.visual) and a.visual.kind == b.visual.kind
    if a.visual.kind == "texture":
        np.testing.assert_array_equal(a.visual.uv, b.visual.uv)
        np.testing.assert_array_equal(
            a.visual.material.to_color(a.visual.uv), b.visual.material.to_color(b.visual.uv)
        )
    elif a.visual.kind is not None:
        name = f"{a.visual.kind}_colors"
        np.testing.assert_array_equal(getattr(a.visual, name), getattr(b.visual, name))


def with_everything(name):
    """A mesh with a kind of visuals, and attributes of all types."""
    if name == "texture":
        return textured_cylinder()
    plain = sphere(metadata={"units": "mm", "note": ["a", {"b": 1}]})
    plain.vertex_attributes.update(
        temperature=plain.vertices[:, 0].astype(np.float32),
        label=np.arange(len(plain.vertices), dtype=np.int16),
        name=np.array([f"v{i}" for i in range(len(plain.vertices))]),
        is_top=plain.vertices[:, 2] > 0,
        tensor=np.ones((len(plain.vertices), 3, 3)),
        anything={"not": "an array"},
    )
    plain.face_attributes.update(part=np.arange(len(plain.faces)), source="scanner")
    plain.density = 7.8
    colours = np.random.default_rng(1).integers(0, 255, (len(plain.faces), 4), np.uint8)
    if name == "vertex":
        plain.visual.vertex_colors = colours[: len(plain.vertices)]
    elif name == "face":
        plain.visual.face_colors = colours
    return plain


@pytest.mark.parametrize("name", ["plain", "vertex", "face", "texture"])
def test_round_trip_is_exact(name):
    mesh = with_everything(name)
    assert_equal(plugin.to_trimesh(*plugin.from_trimesh(mesh), like=mesh), mesh)


@pytest.mark.parametrize("name", ["plain", "vertex", "face", "texture"])
def test_the_input_is_not_changed_and_all_is_kept(name):
    if name == "face":
        pytest.importorskip("scipy")  # which trimesh copies colours of faces with
    mesh = with_everything(name)
    before = mesh.copy()
    result = tetsimplify.simplify(mesh, max_edge_length=0.4)
    assert_equal(mesh, before)
    assert type(result) is trimesh.Trimesh and len(result.faces) < len(mesh.faces) / 2
    assert list(result.vertex_attributes) == list(mesh.vertex_attributes)
    assert list(result.face_attributes) == list(mesh.face_attributes)
    assert result.metadata == mesh.metadata and result.units == mesh.units
    assert result.density == mesh.density
    assert result.visual.kind == mesh.visual.kind
    for key, values in result.vertex_attributes.items():
        if key != "anything":
            assert len(values) == len(result.vertices)
            assert values.dtype == mesh.vertex_attributes[key].dtype
    if name != "texture":
        result.metadata["note"][1]["b"] = 2
        assert mesh.metadata["note"][1]["b"] == 1  # not shared


def test_linear_functions_stay_exact_and_labels_stay_labels():
    mesh = sphere()
    mesh.vertex_attributes["height"] = mesh.vertices @ [1.0, 2.0, 3.0] + 5
    mesh.vertex_attributes["side"] = np.where(mesh.vertices[:, 0] > 0, 7, -3)
    mesh.face_attributes["id"] = np.arange(len(mesh.faces))
    colours = np.c_[np.rint(mesh.vertices * 100 + 120), np.full(len(mesh.vertices), 255)]
    mesh.visual.vertex_colors = colours.astype(np.uint8)
    result, report = plugin.simplify(mesh, max_edge_length=0.5, return_report=True)
    height = result.vertices @ [1.0, 2.0, 3.0] + 5
    np.testing.assert_allclose(result.vertex_attributes["height"], height, atol=1e-12)
    assert set(result.vertex_attributes["side"]) == {7, -3}
    colours = result.visual.vertex_colors
    assert np.abs(colours[:, :3] - (result.vertices * 100 + 120)).max() <= 1.01
    assert (colours[:, 3] == 255).all()
    assert len(np.unique(result.face_attributes["id"])) == len(result.faces)
    assert report.topology_after.n_faces == len(result.faces)


def test_the_checks_of_trimesh_agree():
    pytest.importorskip("scipy")  # which trimesh counts bodies with
    mesh = trimesh.creation.torus(2.0, 0.7, major_sections=90, minor_sections=40)
    result = tetsimplify.simplify(mesh, max_edge_length=0.3)
    assert result.is_watertight and result.is_winding_consistent and result.is_volume
    assert result.euler_number == mesh.euler_number == 0
    report = tetsimplify.topology(result)
    assert report.is_closed and report.euler_characteristic == result.euler_number
    assert result.body_count == report.n_components == 1
    assert "vertex_normals" not in result.metadata
    assert (np.sum(result.vertex_normals * mesh.vertex_normals[0], axis=1) <= 1 + 1e-9).all()


# --- texture seams -------------------------------------------------------------------------------


def test_a_texture_seam_neither_tears_nor_bleeds():
    mesh = textured_cylinder()
    result = tetsimplify.simplify(mesh, max_edge_length=0.4)
    assert len(result.faces) < len(mesh.faces) / 3
    assert merged_topology(result).same_topology(merged_topology(mesh))
    assert merged_topology(result).n_boundary_loops == 2
    uv = result.visual.uv
    assert np.ptp(uv[result.faces, 0], axis=1).max() < 0.25  # no face has the whole texture
    angle = np.arctan2(result.vertices[:, 1], result.vertices[:, 0]) / (2 * np.pi) % 1
    off = np.abs((uv[:, 0] - angle + 0.5) % 1 - 0.5)
    assert off.max() < 0.02
    np.testing.assert_allclose(uv[:, 1] * 3, result.vertices[:, 2], atol=1e-12)
    at_seam = {tuple(p) for p in mesh.vertices[np.isin(mesh.visual.uv[:, 0], (0, 1))]}
    assert at_seam <= {tuple(p) for p in result.vertices}
    assert result.visual.material.image.getpixel((0, 0)) == (200, 10, 10)
    assert result.visual.material is not mesh.visual.material


def test_borders_of_materials_stay():
    mesh = textured_cylinder()
    upper = mesh.triangles_center[:, 2] > 1.5
    mesh.visual.face_materials = upper.astype(int)
    result = tetsimplify.simplify(mesh, max_edge_length=0.4)
    materials = np.asarray(result.visual.face_materials)
    np.testing.assert_array_equal(materials, result.triangles_center[:, 2] > 1.5)


def test_borders_of_labels_stay_when_they_are_named():
    mesh = textured_cylinder()
    mesh.face_attributes["side"] = mesh.triangles_center[:, 1] > 0
    border = {
        tuple(p) for p in mesh.vertices[np.unique(mesh.faces[mesh.face_attributes["side"]])]
    } & {tuple(p) for p in mesh.vertices[np.unique(mesh.faces[~mesh.face_attributes["side"]])]}
    result = tetsimplify.simplify(mesh, max_edge_length=0.4, seams="side")
    assert len(result.faces) < len(mesh.faces) / 2
    assert border <= {tuple(p) for p in result.vertices}
    assert merged_topology(result).same_topology(merged_topology(mesh))
    free = tetsimplify.simplify(mesh, max_edge_length=0.4)
    assert not border <= {tuple(p) for p in free.vertices}


def test_copies_of_vertices_without_attributes_stay_together_too():
    """A box whose sides have vertices of their own, as for sharp edges."""
    pytest.importorskip("scipy")  # which trimesh subdivides with
    box = trimesh.creation.box().subdivide_loop(0).subdivide().subdivide().subdivide()
    faces_of_side = [
        np.flatnonzero((box.face_normals @ n) > 0.9) for n in np.r_[np.eye(3), -np.eye(3)]
    ]
    sides = trimesh.util.concatenate([box.submesh([f], append=True) for f in faces_of_side])
    assert not sides.is_watertight and merged_topology(sides).is_closed
    result = tetsimplify.simplify(sides, max_edge_length=0.3)
    assert len(result.faces) < len(sides.faces)
    assert merged_topology(result).same_topology(merged_topology(sides))
    result.merge_vertices()
    assert result.is_watertight and abs(result.volume - 1) < 1e-9


# --- scenes, errors, pipelines -------------------------------------------------------------------


def test_every_geometry_of_a_scene_is_simplified_in_place_of_its_node():
    move = trimesh.transformations.translation_matrix([5, 0, 0])
    scene = trimesh.Scene(metadata={"units": "m"})
    scene.add_geometry(sphere(), geom_name="ball", node_name="near")
    scene.graph.update("far", geometry="ball", matrix=move)
    scene.add_geometry(textured_cylinder(), geom_name="tube", node_name="tube", transform=move)
    scene.add_geometry(trimesh.load_path([[[0, 0, 0], [1, 1, 1]]]), geom_name="line")
    before = copy.deepcopy({name: len(g.vertices) for name, g in scene.geometry.items()})
    result, reports = plugin.simplify(scene, max_edge_length=0.4, return_report=True)
    assert set(reports) == {"ball", "tube"}
    assert isinstance(result, trimesh.Scene) and list(result.geometry) == list(scene.geometry)
    assert before == {name: len(g.vertices) for name, g in scene.geometry.items()}
    assert len(result.geometry["ball"].faces) < 700
    assert set(result.graph.nodes) == set(scene.graph.nodes)
    for node in scene.graph.nodes_geometry:
        assert result.graph[node][1] == scene.graph[node][1]
        np.testing.assert_array_equal(result.graph[node][0], scene.graph[node][0])
    assert result.metadata == scene.metadata and result.units == scene.units
    assert np.abs(result.bounds - scene.bounds).max() < 0.1
    assert tetsimplify.topology(scene).n_components == 3
    assert tetsimplify.topology(result).same_topology(tetsimplify.topology(scene))


def test_errors_are_in_the_words_of_trimesh():
    with pytest.raises(MeshError, match=r"trimesh\.Trimesh or trimesh\.Scene.*PointCloud"):
        adapters.simplify(trimesh.PointCloud(np.eye(3)), max_edge_length=1)
    crowded = trimesh.Trimesh(np.eye(5, 3), [[0, 1, 2], [1, 0, 3], [0, 1, 4]], process=False)
    with pytest.raises(MeshError, match="repair=True"):
        adapters.simplify(crowded, max_edge_length=1)
    assert len(adapters.simplify(crowded, max_edge_length=1, repair=True).faces) == 3


def test_an_empty_mesh():
    assert tetsimplify.simplify(trimesh.Trimesh(), max_edge_length=1).is_empty


@needs_data
def test_a_pipeline_on_a_real_mesh(tmp_path):
    pytest.importorskip("scipy")  # which trimesh splits with
    mesh = trimesh.load(data_dir() / "meshes" / "elephant_refined.ply", process=False)
    mesh.apply_scale(100 / mesh.extents.max())
    mesh.vertex_attributes["height"] = mesh.vertices[:, 1].copy()
    mesh.visual.face_colors = np.abs(mesh.face_normals) * 255
    length = 1.5 * np.median(mesh.edges_unique_length)
    result, report = plugin.simplify(mesh, max_edge_length=length, return_report=True)
    assert result.is_watertight and result.euler_number == mesh.euler_number == -4
    assert result.edges_unique_length.min() == pytest.approx(report.shortest_edge_after)
    left = np.sort(result.edges_unique[result.edges_unique_length < length], axis=1)
    assert {tuple(e) for e in left} == {tuple(sorted(e)) for e in report.remaining_edges}
    np.testing.assert_allclose(result.vertex_attributes["height"], result.vertices[:, 1], atol=1e-9)
    assert abs(result.volume / mesh.volume - 1) < 0.01
    assert len(result.split()) == 1
    result.export(tmp_path / "elephant.ply")
    assert trimesh.load(tmp_path / "elephant.ply").is_watertight
