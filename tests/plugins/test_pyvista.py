"""PyVista in and out."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import tetsimplify
from data import data_dir, needs_data
from tetsimplify import MeshError, OptionError, VolumeError, adapters

pyvista = pytest.importorskip("pyvista")
plugin = pytest.importorskip("tetsimplify.plugins.pyvista")


def ball(n_sub: int = 4) -> pyvista.PolyData:
    """A sphere around the origin with everything that a mesh can carry."""
    mesh = pyvista.Icosphere(nsub=n_sub, radius=1.0)
    mesh.clear_data()
    points = mesh.points
    mesh.point_data["height"] = (points @ [1.0, 2.0, 3.0] + 5).astype(np.float32)
    mesh.point_data["exact"] = points.astype(np.float64) @ [1.0, 2.0, 3.0]
    mesh.point_data["side"] = np.where(points[:, 0] > 0, 7, -3)
    mesh.point_data["is_top"] = points[:, 2] > 0
    mesh.point_data["rgb"] = np.rint(points * 100 + 120).astype(np.uint8)
    mesh.point_data["velocity"] = np.c_[points[:, 1], -points[:, 0], 0 * points[:, 0]]
    mesh.point_data["name"] = np.array([f"p{i}" for i in range(mesh.n_points)])
    mesh.point_data["wave"] = np.exp(1j * points[:, 0])
    mesh.point_data.active_normals = points
    mesh.point_data.active_texture_coordinates = points[:, :2]
    mesh.cell_data["id"] = np.arange(mesh.n_cells)
    mesh.cell_data["is_odd"] = np.arange(mesh.n_cells) % 2 == 1
    mesh.field_data["units"] = ["mm"]
    mesh.field_data["matrix"] = np.eye(4)
    mesh.user_dict["patient"] = {"age": 61}
    mesh.set_active_vectors("velocity")
    mesh.set_active_scalars("height")
    return mesh


def assert_same_data(a, b) -> None:
    """The same arrays of the same types."""
    assert list(a.keys()) == list(b.keys())
    for name, values in a.items():
        assert np.asarray(values).dtype == np.asarray(b[name]).dtype
        np.testing.assert_array_equal(values, b[name])


def assert_equal(a, b) -> None:
    """The same mesh with all that belongs to it."""
    assert a.points.dtype == b.points.dtype
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.regular_faces, b.regular_faces)
    for data in ("point_data", "cell_data", "field_data"):
        assert_same_data(getattr(a, data), getattr(b, data))
    assert_same_active(a, b)


def assert_same_active(a, b) -> None:
    assert a.active_scalars_info == b.active_scalars_info
    assert a.active_vectors_info == b.active_vectors_info
    for data in ("point_data", "cell_data"):
        for role in ("scalars", "vectors", "normals", "texture_coordinates"):
            name = f"active_{role}_name"
            assert getattr(getattr(a, data), name) == getattr(getattr(b, data), name)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_round_trip_is_exact(dtype):
    mesh = ball()
    mesh.points = mesh.points.astype(dtype)
    again = plugin.to_pyvista(*plugin.from_pyvista(mesh), like=mesh)
    assert_equal(again, mesh)
    again.points[:] = 0
    assert mesh.bounds != again.bounds


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_input_is_not_changed_and_all_is_kept(dtype):
    mesh = ball()
    mesh.points = mesh.points.astype(dtype)
    before = mesh.copy()
    result = mesh.tetsimplify.simplify(0.3)
    assert_equal(mesh, before)
    assert type(result) is pyvista.PolyData and result.n_cells < mesh.n_cells / 4
    assert result.points.dtype == dtype
    assert_same_data(result.field_data, mesh.field_data)
    assert result.user_dict["patient"]["age"] == 61
    assert_same_active(result, mesh)
    for data in ("point_data", "cell_data"):
        new, old = getattr(result, data), getattr(mesh, data)
        assert list(new.keys()) == list(old.keys())
        assert [values.dtype.kind for values in new.values()] == [
            values.dtype.kind for values in old.values()
        ]
    assert result.point_data["height"].dtype == np.float32


def test_linear_functions_stay_exact_and_labels_stay_labels():
    mesh = ball()
    mesh.points = mesh.points.astype(np.float64)
    result = mesh.tetsimplify.simplify(0.3, placement="midpoint")
    data, points = result.point_data, result.points
    np.testing.assert_allclose(data["exact"], points @ [1.0, 2.0, 3.0], atol=1e-6)
    np.testing.assert_allclose(data["height"], points @ [1.0, 2.0, 3.0] + 5, atol=1e-5)
    assert set(data["side"]) == {7, -3} and data["is_top"].dtype == bool
    assert np.abs(data["rgb"] - (points * 100 + 120)).max() < 1.1
    np.testing.assert_allclose(np.linalg.norm(result.active_normals, axis=1), 1, atol=1e-6)
    assert (np.sum(result.active_normals * points, axis=1) > 0.9).all()
    np.testing.assert_array_equal(result["is_odd"], result["id"] % 2 == 1)


@pytest.mark.parametrize("flip", [False, True])
def test_normals_of_cells_are_those_of_the_new_cells(flip):
    mesh = pyvista.Icosphere(nsub=4)
    mesh.compute_normals(point_normals=False, inplace=True, flip_normals=False)
    if flip:
        mesh.cell_data["Normals"] *= -1
    result = mesh.tetsimplify.simplify(0.2)
    a, b, c = result.points[result.regular_faces].transpose(1, 0, 2).astype(float)
    expected = np.cross(b - a, c - a)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(
        result.cell_data["Normals"], -expected if flip else expected, atol=1e-5
    )


def test_the_checks_of_pyvista_agree():
    for mesh, n_open in (
        (pyvista.ParametricTorus().triangulate().clean(), 0),
        (pyvista.Plane(i_resolution=30, j_resolution=30).triangulate(), 120),
    ):
        report = mesh.tetsimplify.topology()
        assert mesh.n_open_edges == n_open == report.n_boundary_edges
        result = mesh.tetsimplify.simplify(0.1)
        after = tetsimplify.topology(result)
        assert result.n_cells < mesh.n_cells and after.same_topology(report)
        assert result.is_manifold == mesh.is_manifold == after.is_closed
        assert result.n_open_edges == after.n_boundary_edges
        edges = result.extract_all_edges().n_cells
        assert result.n_points - edges + result.n_cells == after.euler_characteristic


def test_sharp_edges_with_normals_of_their_own_do_not_tear():
    mesh = pyvista.Cylinder(resolution=80).triangulate().subdivide(1)
    joined = mesh.clean(tolerance=0.0)
    result = mesh.tetsimplify.simplify(0.12)
    assert result.n_cells < mesh.n_cells
    assert tetsimplify.topology(result.clean(tolerance=0.0)).same_topology(
        tetsimplify.topology(joined)
    )


def test_a_texture_seam_neither_tears_nor_bleeds():
    sphere = pyvista.Sphere(theta_resolution=90, phi_resolution=60)
    sphere.clear_data()
    mesh = sphere.texture_map_to_sphere(prevent_seam=False)
    # cut along the half circle where u jumps, as exporters do
    faces, u = mesh.regular_faces.copy(), mesh.active_texture_coordinates[:, 0].copy()
    wide = np.ptp(u[faces], axis=1) > 0.5
    low = np.unique(faces[wide][u[faces[wide]] < 0.5])
    copy_of = np.arange(mesh.n_points)
    copy_of[low] = mesh.n_points + np.arange(len(low))
    faces[wide] = np.where(u[faces[wide]] < 0.5, copy_of[faces[wide]], faces[wide])
    cut = pyvista.PolyData.from_regular_faces(np.r_[mesh.points, mesh.points[low]], faces)
    uv = mesh.active_texture_coordinates
    cut.active_texture_coordinates = np.r_[uv, uv[low] + [1, 0]]
    result = cut.tetsimplify.simplify(0.06)
    assert result.n_cells < cut.n_cells / 2
    new_uv = result.active_texture_coordinates
    away = np.abs(result.points[result.regular_faces][..., 2]).max(axis=1) < 0.45  # from the poles
    assert np.ptp(new_uv[result.regular_faces, 0], axis=1)[away].max() < 0.2
    assert result.clean(tolerance=0.0).n_open_edges == cut.clean(tolerance=0.0).n_open_edges == 0


# --- volumes -------------------------------------------------------------------------------------


def wavelet(**options) -> pyvista.ImageData:
    """An image that is neither at the origin nor cubic nor right at index 0."""
    return pyvista.Wavelet(extent=(-9, 8, -7, 10, 3, 17), **options)


@pytest.mark.parametrize("mirrored", [False, True])
def test_isosurfaces_are_where_contours_are(mirrored):
    image = wavelet()
    image.spacing, image.origin = (0.5, 1.0, 2.0), (10.0, -3.0, 1.0)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, -1 if mirrored else 1]])
    image.direction_matrix = turn
    surface = image.tetsimplify.isosurface(150.0)
    contour = image.cast_to_structured_grid().contour([150.0])
    np.testing.assert_allclose(surface.bounds, contour.bounds, atol=0.2)
    assert abs(surface.compute_implicit_distance(contour)["implicit_distance"]).max() < 0.5
    np.testing.assert_allclose(surface.sample(image)["RTData"], 150, atol=12)
    closed = image.tetsimplify.isosurface(150.0, closed=True)
    inside = (image["RTData"] > 150).mean() * np.prod(np.array(image.dimensions) - 1)
    assert closed.is_manifold
    assert closed.volume == pytest.approx(inside, rel=0.2)
    a, b, c = closed.points[closed.regular_faces].transpose(1, 0, 2)
    assert np.einsum("ij,ij", a, np.cross(b, c)) / 6 == pytest.approx(closed.volume)  # outward


def test_several_levels_are_one_mesh_with_their_scalars():
    image = wavelet()
    both = image.tetsimplify.isosurface([130.0, 180.0], lattice="kuhn")
    single = [image.tetsimplify.isosurface(level) for level in (130.0, 180.0)]
    assert both.n_cells == sum(one.n_cells for one in single)
    assert set(both["RTData"]) == {130.0, 180.0}
    report = both.tetsimplify.topology()
    assert report.is_manifold
    result = both.tetsimplify.simplify(1.5)
    assert set(result["RTData"]) == {130.0, 180.0}
    assert result.tetsimplify.topology().same_topology(report)


def test_isosurfaces_carry_what_is_asked_for():
    image = wavelet()
    image.spacing, image.direction_matrix = (1.0, 2.0, 0.5), np.diag([1.0, -1.0, 1.0])
    image["double"] = 2 * image["RTData"]
    surface = image.tetsimplify.isosurface(
        [130.0, "otsu"], vertex_normals=True, vertex_data=["double"], lattice="bcc"
    )
    levels = surface["RTData"]
    assert len(set(levels)) == 2
    np.testing.assert_allclose(surface["double"], 2 * levels, rtol=1e-9)
    assert surface.active_scalars_name == "RTData"
    flat = surface.compute_normals(
        point_normals=False, consistent_normals=False, auto_orient_normals=False
    )["Normals"]
    at_faces = surface.point_data.active_normals[surface.regular_faces].sum(axis=1)
    assert ((flat * at_faces).sum(axis=1) > 0).mean() > 0.95
    with pytest.raises(VolumeError, match="no point array 'x', only"):
        image.tetsimplify.isosurface(130.0, vertex_data=["x"])


def test_labels_are_one_mesh_with_their_numbers():
    image = pyvista.ImageData(dimensions=(12, 8, 8), spacing=(1, 2, 3))
    labels = np.zeros((8, 8, 12), int)
    labels[2:6, 2:6, 2:5], labels[2:6, 2:6, 5:9] = 3, 7
    image["id"] = labels.ravel()
    surface = image.tetsimplify.isosurface(labels="all", closed=True)
    assert set(surface["id"]) == {3, 7}
    for label in (3, 7):
        part = surface.extract_points(surface["id"] == label).extract_surface()
        assert part.n_open_edges == 0
    assert image.tetsimplify.isosurface(labels=[3]).n_points < surface.n_points
    with pytest.raises(OptionError, match="level must be"):
        image.tetsimplify.isosurface()


def test_regularised_images():
    image = wavelet()
    plain, regular = (
        image.tetsimplify.isosurface(150.0, lattice="bcc", regularise=on) for on in (False, True)
    )
    assert regular.n_cells < 0.4 * plain.n_cells
    report = plain.tetsimplify.topology()
    assert regular.tetsimplify.topology().same_topology(report)


def test_images_without_fitting_scalars():
    image = wavelet()
    with pytest.raises(VolumeError, match=r"no point array 'x'.*RTData"):
        image.tetsimplify.isosurface(1.0, "x")
    with pytest.raises(VolumeError, match="cell_data_to_point_data"):
        image.point_data_to_cell_data().tetsimplify.isosurface(1.0)
    image["v"] = np.zeros((image.n_points, 3))
    with pytest.raises(VolumeError, match="one component"):
        image.tetsimplify.isosurface(1.0, "v")


# --- errors, pipelines ---------------------------------------------------------------------------


def test_errors_are_in_the_words_of_pyvista():
    with pytest.raises(pyvista.core.errors.NotAllTrianglesError, match="triangulate") as caught:
        pyvista.Plane().tetsimplify.simplify(1)
    assert isinstance(caught.value, MeshError)
    with pytest.raises(MeshError, match="extract_surface"):
        adapters.simplify(wavelet(), max_edge_length=1)
    with pytest.raises(MeshError, match="triangulate"):
        adapters.simplify(pyvista.Line(), max_edge_length=1)


def test_an_empty_mesh():
    assert pyvista.PolyData().tetsimplify.simplify(1).n_cells == 0
    assert pyvista.PolyData().tetsimplify.topology().n_faces == 0


def test_vtk_objects_are_known_too():
    vtk_core = pytest.importorskip("vtkmodules.vtkFiltersSources")
    source = vtk_core.vtkSphereSource()
    source.SetThetaResolution(60)
    source.SetPhiResolution(60)
    source.Update()
    result = tetsimplify.simplify(source.GetOutput(), max_edge_length=0.1)
    assert result.IsA("vtkPolyData") and result.is_manifold
    assert tetsimplify.topology(source.GetOutput()).euler_characteristic == 2


def test_the_accessor_needs_no_import(tmp_path):
    program = "import pyvista; print(pyvista.Sphere().tetsimplify.simplify(0.2).is_manifold)"
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.strip() == "True", done.stderr


@needs_data
def test_a_pipeline_on_a_real_volume(tmp_path):
    with np.load(data_dir() / "volumes" / "mni152_mri.npz") as file:
        data, spacing, level = file["data"], file["spacing"], float(file["iso"])
    image = pyvista.ImageData(dimensions=data.shape[::-1], spacing=spacing[::-1])
    image.point_data["t1"] = data.reshape(-1)
    crop = image.extract_subset((40, 110, 60, 130, 60, 120))
    surface = crop.tetsimplify.isosurface(level, closed=True)
    surface["height"] = surface.points[:, 2]
    before = surface.tetsimplify.topology()
    result, report = surface.tetsimplify.simplify(1.2, return_report=True)
    assert before.is_closed and result.n_open_edges == 0
    assert result.tetsimplify.topology().same_topology(before)
    assert result.n_cells < surface.n_cells / 3
    np.testing.assert_allclose(result["height"], result.points[:, 2], atol=1e-9)
    lengths = result.extract_all_edges().compute_cell_sizes()["Length"]
    assert (lengths < 1.2).sum() == len(report.remaining_edges)
    assert abs(result.volume / surface.volume - 1) < 0.02
    smooth = result.smooth_taubin(n_iter=10).compute_normals(split_vertices=False)
    smooth.save(tmp_path / "brain.vtp")
    assert pyvista.read(tmp_path / "brain.vtp").n_cells == result.n_cells
