"""Open3D meshes in and out."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import tetsimplify
from data import data_dir, needs_data
from tetsimplify.errors import MeshError, MissingExtraError

plugin = pytest.importorskip("tetsimplify.plugins.open3d", exc_type=ImportError)
import open3d as o3d  # noqa: E402

Legacy, Tensors = o3d.geometry.TriangleMesh, o3d.t.geometry.TriangleMesh
LINEAR = np.array([[1.0, 2.0, -3.0], [0.5, 0.0, 1.0], [-1.0, 0.25, 0.0]])


def legacy(vertices, faces):
    return Legacy(
        o3d.utility.Vector3dVector(np.asarray(vertices, float)),
        o3d.utility.Vector3iVector(np.asarray(faces, np.int32)),
    )


def torus():
    return Legacy.create_torus(radial_resolution=60, tubular_resolution=40)


def textured_grid(n=24):
    """A square whose halves belong to two charts, 10 apart in u, and to two materials."""
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    a = np.flatnonzero((x < n) & (y < n))
    faces = np.concatenate([np.c_[a, a + 1, a + n + 2], np.c_[a, a + n + 2, a + n + 1]])
    right = x[faces].mean(axis=1) > n / 2
    uv = np.stack([x[faces] + 10.0 * right[:, None], y[faces]], axis=-1) / n
    return np.c_[x, y, 0 * x] / n, faces, uv, right.astype(np.int32)


def same(a, b):
    return all(
        np.array_equal(x, y) and x.dtype == y.dtype for x, y in zip(a[:2], b[:2], strict=True)
    ) and all(
        d.keys() == e.keys()
        and all(np.array_equal(d[k], e[k]) and d[k].dtype == e[k].dtype for k in d)
        for d, e in zip(a[2:], b[2:], strict=True)
    )


def copied(arrays):
    return tetsimplify.adapters.MeshArrays(
        arrays.vertices.copy(),
        arrays.faces.copy(),
        {k: x.copy() for k, x in arrays.vertex_data.items()},
        {k: x.copy() for k, x in arrays.face_data.items()},
    )


def rich_legacy():
    vertices, faces, uv, material = textured_grid()
    mesh = legacy(vertices, faces).compute_vertex_normals()
    mesh.compute_triangle_normals()
    mesh.vertex_colors = o3d.utility.Vector3dVector(vertices)
    mesh.triangle_uvs = o3d.utility.Vector2dVector(uv.reshape(-1, 2))
    mesh.triangle_material_ids = o3d.utility.IntVector(material)
    mesh.textures = [o3d.geometry.Image(np.full((4, 4, 3), k, np.uint8)) for k in (7, 9)]
    return mesh


def rich_tensors(dtype=np.float32):
    vertices, faces, uv, material = textured_grid()
    mesh = Tensors(o3d.core.Tensor(vertices.astype(dtype)), o3d.core.Tensor(faces))
    mesh.vertex["field"] = o3d.core.Tensor(vertices @ LINEAR.T)
    mesh.vertex["label"] = o3d.core.Tensor((vertices[:, 0] > 0.5).astype(np.uint8) * 200)
    mesh.vertex["colors"] = o3d.core.Tensor(np.rint(255 * vertices).astype(np.uint8))
    mesh.triangle["texture_uvs"] = o3d.core.Tensor(uv.astype(np.float32))
    mesh.triangle["material_ids"] = o3d.core.Tensor(material)
    mesh.triangle["source"] = o3d.core.Tensor(np.arange(len(faces)).astype(np.int16))
    mesh.material.material_name = "defaultLit"
    image = o3d.t.geometry.Image(o3d.core.Tensor(np.full((4, 4, 3), 7, np.uint8)))
    mesh.material.texture_maps["albedo"] = image
    return mesh


# --- conversions -----------------------------------------------------------------------------


@pytest.mark.parametrize("make", [rich_legacy, rich_tensors, torus, Legacy, Tensors])
def test_round_trip_is_exact(make):
    mesh = make()
    arrays = plugin.from_open3d(mesh)
    again = plugin.to_open3d(*arrays, like=mesh)
    assert type(again) is type(mesh)
    assert same(arrays, plugin.from_open3d(again))


@pytest.mark.parametrize("make", [rich_legacy, rich_tensors])
def test_input_is_not_mutated(make):
    mesh = make()
    before = copied(plugin.from_open3d(mesh))
    plugin.simplify(mesh, max_edge_length=0.2)
    assert same(before, plugin.from_open3d(mesh))


def test_result_is_that_of_the_core():
    mesh = torus()
    arrays = plugin.from_open3d(mesh)
    expected = tetsimplify.simplify(arrays.vertices, arrays.faces, max_edge_length=0.3)
    result = plugin.simplify(mesh, max_edge_length=0.3)
    assert np.array_equal(np.asarray(result.vertices), expected.vertices)
    assert np.array_equal(np.asarray(result.triangles), expected.faces)


# --- attributes ------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_tensor_attributes_and_dtypes_are_kept(dtype):
    mesh = rich_tensors(dtype)
    result = plugin.simplify(mesh, max_edge_length=0.2)
    before, after = plugin.from_open3d(mesh), plugin.from_open3d(result)
    assert len(after.faces) < len(before.faces) / 4
    assert after.vertices.dtype == dtype and after.faces.dtype == before.faces.dtype
    for old, new in ((before[2], after[2]), (before[3], after[3])):
        assert {k: x.dtype for k, x in old.items()} == {k: x.dtype for k, x in new.items()}
    assert result.device == mesh.device

    field = after.vertex_data["field"] - after.vertices.astype(float) @ LINEAR.T
    assert np.abs(field).max() < 1e-6
    assert set(np.unique(after.vertex_data["label"])) == {0, 200}
    error = after.vertex_data["colors"] - 255 * after.vertices
    assert np.abs(error).max() < 1.5
    source = after.face_data["source"]
    assert np.array_equal(after.face_data["material_ids"], before.face_data["material_ids"][source])
    assert result.material.material_name == "defaultLit"
    assert int(result.material.texture_maps["albedo"].as_tensor().numpy().max()) == 7


def test_legacy_attributes_are_kept():
    mesh = rich_legacy()
    result = plugin.simplify(mesh, max_edge_length=0.2)
    assert len(result.triangles) < len(mesh.triangles) / 4
    assert np.allclose(np.asarray(result.vertex_colors), np.asarray(result.vertices), atol=1e-12)
    assert np.allclose(np.asarray(result.vertex_normals), (0, 0, 1))
    assert np.allclose(np.asarray(result.triangle_normals), (0, 0, 1))
    assert [int(np.asarray(image).max()) for image in result.textures] == [7, 9]


@pytest.mark.parametrize("make", [rich_legacy, rich_tensors])
def test_texture_seam_neither_tears_nor_bleeds(make):
    vertices, faces, _, face_data = plugin.from_open3d(plugin.simplify(make(), max_edge_length=0.2))
    uv = face_data["uvs" if "uvs" in face_data else "texture_uvs"]
    right = vertices[faces, 0].mean(axis=1) > 0.5
    expected = vertices[faces][:, :, :2] + np.where(right[:, None, None], (10 / 24, 0), 0)
    assert np.abs(uv - expected).max() < 1e-6
    assert np.array_equal(face_data["material_ids"], right)
    assert tetsimplify.topology(vertices, faces).euler_characteristic == 1  # still welded


# --- a pipeline, and the checks of the host ----------------------------------------------------


@needs_data
@pytest.mark.parametrize("name", ["face_libigl", "elephant_refined"])
def test_pipeline_on_a_real_mesh(name):
    mesh = o3d.io.read_triangle_mesh(str(data_dir() / "meshes" / f"{name}.ply"))
    mesh = mesh.remove_unreferenced_vertices().compute_vertex_normals()
    length = 0.01 * np.linalg.norm(mesh.get_max_bound() - mesh.get_min_bound())
    result = plugin.simplify(mesh, max_edge_length=length).compute_vertex_normals()
    result = result.filter_smooth_taubin(number_of_iterations=2).compute_vertex_normals()
    assert len(result.triangles) < len(mesh.triangles)
    for each in (mesh, result):
        report = plugin.topology(each)
        assert each.is_edge_manifold() and each.is_vertex_manifold() and each.is_orientable()
        assert report.is_manifold
        assert each.euler_poincare_characteristic() == report.euler_characteristic
        assert len(each.get_non_manifold_edges(False)) == report.n_boundary_edges
    assert plugin.topology(mesh).same_topology(plugin.topology(result))


def test_checks_agree_that_a_mesh_is_bad():
    bad = legacy(np.eye(5, 3), [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    assert not bad.is_edge_manifold() and not plugin.topology(bad).is_manifold
    moebius = Legacy.create_mobius()
    assert not moebius.is_orientable() and not plugin.topology(moebius).is_oriented


def test_volume_to_mesh_in_one_call():
    x, y, z = np.mgrid[-1:1:30j, -1:1:30j, -1:1:30j]
    volume = 0.8 - np.sqrt(x**2 + y**2 + z**2)
    mesh = plugin.volume_to_open3d(volume, 0.0, spacing=(2 / 29,) * 3, origin=(-1, -1, -1))
    assert mesh.is_edge_manifold(allow_boundary_edges=False)
    assert mesh.euler_poincare_characteristic() == 2
    assert np.abs(np.linalg.norm(np.asarray(mesh.vertices), axis=1) - 0.8).max() < 0.01
    tensors = plugin.volume_to_open3d(volume, 0.0, tensor=True)
    assert isinstance(tensors, Tensors)
    assert tensors.triangle.indices.shape[0] == len(mesh.triangles)


# --- errors ----------------------------------------------------------------------------------


def test_bad_mesh_is_an_error_of_both():
    with pytest.raises(RuntimeError, match="inconsistently oriented") as caught:
        plugin.simplify(Legacy.create_mobius(), max_edge_length=0.1)
    assert isinstance(caught.value, MeshError)
    assert "is_orientable()" in str(caught.value)


@pytest.mark.parametrize("thing", [o3d.geometry.PointCloud(), 3, None])
def test_other_things_are_refused(thing):
    with pytest.raises(MeshError, match=r"expected an open3d\.geometry\.TriangleMesh"):
        plugin.simplify(thing, max_edge_length=0.1)


def test_missing_libusb_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "libusb_package", None)
    with pytest.raises(MissingExtraError, match=r"tetsimplify\[open3d\]"):
        plugin._load_libusb(ImportError("libusb-1.0.so.0: cannot open shared object file"))
