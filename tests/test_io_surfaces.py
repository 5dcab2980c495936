"""Surfaces of volumes in the world with all options, and files that hold what vertices carry."""

from __future__ import annotations

import re

import numpy as np
import pytest

import models
import naive
from tetsimplify import OptionError, extract_isosurface, topology
from tetsimplify.errors import FileError, MeshError
from tetsimplify.io import MESH_FORMATS, Volume, isosurface_of, read_mesh, write_mesh, write_meshes
from tetsimplify.io import ply as ply_format
from tetsimplify.isosurface import Isosurface
from tetsimplify.mesh import Mesh
from volumes import ORIGIN, ROTATION, ball

SHEAR = np.array([[2.0, 0.3, 0.0], [0.0, 0.7, 0.2], [0.1, 0.0, 1.5]])
MIRROR = np.diag([1.0, -1.0, 1.0])


def affine(linear):
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = linear, ORIGIN
    return made


WORLDS = {
    "scaled": affine(np.diag([0.5, 0.7, 3.0])),
    "mirrored": affine(MIRROR @ np.diag([0.5, 0.7, 3.0])),
    "rotated": affine(ROTATION @ np.diag([0.5, 0.7, 3.0])),
    "sheared": affine(SHEAR),
    "sheared and mirrored": affine(MIRROR @ SHEAR),
    "axes swapped": affine(np.eye(3)[[1, 0, 2]]),
}
every_world = pytest.mark.parametrize("world", WORLDS.values(), ids=WORLDS)
every_order = pytest.mark.parametrize("order", ["C", "F"])


@every_world
@every_order
@pytest.mark.parametrize("side", ["lower", "higher"])
def test_normals_point_to_the_side_asked_for_in_every_world(world, order, side):
    volume = Volume(np.array(ball(), order=order), world)
    mesh = isosurface_of(volume, 0.0, vertex_normals=True, normals=side, lattice="bcc")
    sign = 1 if side == "lower" else -1
    assert sign * models.signed_volume(*mesh) > 0  # seen from outside, left-handed or not
    # on an ellipsoid the normal is the gradient of its equation in the world
    inverse = np.linalg.inv(world)
    index = mesh.vertices @ inverse[:3, :3].T + inverse[:3, 3]
    gradient = (index - [9, 10, 11]) * [1.0, 1.2, 1.5] @ inverse[:3, :3]
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    normals = mesh.vertex_data["normals"]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    assert (sign * normals * gradient).sum(axis=1).min() > 0.99
    flat = models.normals(*mesh)
    towards = (flat * normals[mesh.faces].sum(axis=1)).sum(axis=1)
    assert (towards > 0).mean() > 0.995


@every_order
def test_data_and_centres_have_the_axes_of_the_volume(order):
    rng = np.random.default_rng(0)
    data, centres = np.array(ball(), order=order), rng.normal(size=(19, 21, 23))
    x, y, _ = np.indices(data.shape).astype(float)
    volume = Volume(data, WORLDS["scaled"])
    fields = {"x": x, "y": Volume(np.asfortranarray(y), np.eye(4))}
    mesh = isosurface_of(volume, 0.0, vertex_data=fields)
    world = mesh.vertices - ORIGIN
    np.testing.assert_allclose(mesh.vertex_data["x"], world[:, 0] / 0.5, atol=1e-9)
    np.testing.assert_allclose(mesh.vertex_data["y"], world[:, 1] / 0.7, atol=1e-9)
    mesh = isosurface_of(volume, 0.0, lattice="bcc", centres=centres)
    expected = extract_isosurface(data, 0.0, lattice="bcc", centres=centres)
    assert len(mesh.faces) == len(expected.faces)


def test_several_levels_and_labels_are_lists():
    volume = Volume(ball(), WORLDS["mirrored"])
    found = isosurface_of(volume, [0.0, "otsu", 2.0])
    assert [type(one) for one in found] == [Isosurface] * 3
    assert [one.level for one in found[::2]] == [0.0, 2.0]
    assert -20 < found[1].level < 7
    labels = np.zeros((12, 8, 8), np.uint8)
    labels[2:5, 2:6, 2:6], labels[5:9, 2:6, 2:6] = 3, 7
    surfaces = isosurface_of(Volume(labels, WORLDS["mirrored"]), labels="all", closed=True)
    assert [one.label for one in surfaces] == [3, 7]
    for surface in surfaces:
        assert topology(*surface).is_closed
        assert models.signed_volume(*surface) > 0


@every_world
def test_regularised_surfaces_have_the_topology_of_the_plain_ones(world):
    volume = Volume(ball(), world)
    plain, regular = (
        isosurface_of(volume, 0.0, lattice="bcc", regularise=on, vertex_normals=True)
        for on in (False, True)
    )
    assert len(regular.faces) < 0.35 * len(plain.faces)
    assert naive.summary(regular.faces).components == naive.summary(plain.faces).components
    middle = [mesh.vertices.mean(axis=0) for mesh in (plain, regular)]
    np.testing.assert_allclose(*middle, atol=0.5)
    np.testing.assert_allclose(np.linalg.norm(regular.vertex_data["normals"], axis=1), 1)


def test_the_guard_against_folds_goes_by_angles_in_the_world():
    rng = np.random.default_rng(3)
    data, steps = rng.normal(size=(9, 9, 9)), (1.0, 2.0, 6.0)
    mesh = isosurface_of(Volume(data, np.diag([*steps, 1.0])), 0.0, regularise=True)
    expected = extract_isosurface(data, 0.0, regularise=True, spacing=steps)
    np.testing.assert_array_equal(mesh.faces, expected.faces)
    np.testing.assert_allclose(mesh.vertices, expected.vertices, atol=1e-9)
    in_grid = extract_isosurface(data, 0.0, regularise=True)
    assert len(in_grid.faces) != len(expected.faces)


def test_where_a_volume_lies_is_not_said_twice():
    with pytest.raises(OptionError, match="takes no spacing"):
        isosurface_of(Volume(ball(), np.eye(4)), 0.0, spacing=(1, 1, 1))


# ------------------------------------------------------------------------------- files with data


@pytest.fixture
def surface():
    return isosurface_of(
        Volume(ball(), WORLDS["scaled"]), 0.0, vertex_normals=True, vertex_data={"dose x": ball()}
    )


def only_normals(surface):
    return {"normals": surface.vertex_data["normals"]}


@pytest.mark.parametrize("suffix", [s for s, entry in MESH_FORMATS.items() if entry.data != ()])
def test_normals_do_not_change_the_mesh(tmp_path, surface, suffix):
    if MESH_FORMATS[suffix].require:
        pytest.importorskip({"glb": "trimesh"}.get(suffix[1:], "pyvista"))
    write_mesh(tmp_path / f"a{suffix}", surface, only_normals(surface))
    write_mesh(tmp_path / f"b{suffix}", surface)
    with_data, without = (read_mesh(tmp_path / f"{name}{suffix}") for name in "ab")
    np.testing.assert_array_equal(with_data.vertices, without.vertices)
    np.testing.assert_array_equal(with_data.faces, without.faces)


def test_ply_holds_normals_and_data(tmp_path, surface):
    path = tmp_path / "a.ply"
    write_mesh(path, surface, surface.vertex_data)
    with open(path, "rb") as file:
        _, elements = ply_format._read_header(file)
        body = np.fromfile(file, np.uint8)
    vertex = ply_format._read_tables(elements, body)["vertex"]
    assert list(vertex) == ["x", "y", "z", "nx", "ny", "nz", "dose_x"]
    normals = np.column_stack([vertex[name].values for name in ("nx", "ny", "nz")])
    np.testing.assert_array_equal(normals, surface.vertex_data["normals"])
    np.testing.assert_array_equal(vertex["dose_x"].values, surface.vertex_data["dose x"])


@pytest.mark.parametrize("suffix", ["ply", "obj"])
def test_pymeshlab_finds_the_normals(tmp_path, surface, suffix):
    pymeshlab = pytest.importorskip("pymeshlab")
    write_mesh(tmp_path / f"a.{suffix}", surface, only_normals(surface))
    found = pymeshlab.MeshSet(verbose=False)
    found.load_new_mesh(str(tmp_path / f"a.{suffix}"))
    normals = found.current_mesh().vertex_normal_matrix()
    np.testing.assert_allclose(normals, surface.vertex_data["normals"], atol=1e-6)


def test_trimesh_finds_the_normals(tmp_path, surface):
    trimesh = pytest.importorskip("trimesh")
    write_mesh(tmp_path / "a.glb", surface, only_normals(surface))
    (found,) = trimesh.load_scene(tmp_path / "a.glb", process=False).geometry.values()
    normals = found.vertex_normals
    np.testing.assert_allclose(normals, surface.vertex_data["normals"], atol=1e-6)


def test_normals_in_text_are_beside_their_vertices(tmp_path, surface):
    for suffix in ("off", "obj"):
        write_mesh(tmp_path / f"a.{suffix}", surface, only_normals(surface))
    a, b, c = surface.faces[0] + 1
    assert f"f {a}//{a} {b}//{b} {c}//{c}" in (tmp_path / "a.obj").read_text().splitlines()
    lines = (tmp_path / "a.off").read_text().splitlines()
    assert lines[0] == "NOFF"
    numbers = np.array(lines[2].split(), float)
    np.testing.assert_array_equal(numbers[3:], surface.vertex_data["normals"][0])


@pytest.mark.parametrize("suffix", ["vtp", "vtu", "vtk"])
def test_vtk_holds_normals_and_data(tmp_path, surface, suffix):
    pyvista = pytest.importorskip("pyvista")
    write_mesh(tmp_path / f"a.{suffix}", surface, surface.vertex_data)
    found = pyvista.read(tmp_path / f"a.{suffix}")
    np.testing.assert_allclose(found.point_data["Normals"], surface.vertex_data["normals"])
    assert found.point_data.active_normals_name == "Normals"
    (name,) = set(found.point_data.keys()) - {"Normals"}
    assert re.fullmatch("dose( |%20)x", name)
    np.testing.assert_allclose(found.point_data[name], surface.vertex_data["dose x"])


def test_what_a_format_does_not_hold_is_told(tmp_path, surface):
    with pytest.raises(FileError, match=r"STL does not hold normals .*; these do: .*\.obj"):
        write_mesh(tmp_path / "a.stl", surface, only_normals(surface))
    with pytest.raises(FileError, match=r"OBJ does not hold dose x .*; these do: \.ply \.vtk"):
        write_mesh(tmp_path / "a.obj", surface, surface.vertex_data)
    with pytest.raises(FileError, match="two properties of its vertices would be called x"):
        write_mesh(tmp_path / "a.ply", surface, {"x": np.zeros(len(surface.vertices))})
    with pytest.raises(OptionError, match="must have shape"):
        write_mesh(tmp_path / "a.ply", surface, {"w": np.zeros(3)})
    with pytest.raises(OptionError, match=r"normals must have shape \(n, 3\)"):
        write_mesh(tmp_path / "a.ply", surface, {"normals": np.zeros(len(surface.vertices))})
    assert not list(tmp_path.iterdir())


def test_several_files_are_written_all_or_none(tmp_path, surface, monkeypatch):
    before = b"as it was"
    (tmp_path / "b.ply").write_bytes(before)
    wrong = Mesh(surface.vertices, surface.faces + np.int32(10**6))
    with pytest.raises(MeshError):
        write_meshes([(tmp_path / "a.ply", surface, {}), (tmp_path / "b.ply", wrong, {})])

    def fail(path, mesh):
        raise OSError("disk full")

    monkeypatch.setitem(MESH_FORMATS, ".obj", MESH_FORMATS[".obj"]._replace(write=fail))
    with pytest.raises(FileError, match=r"cannot write .*c\.obj: disk full"):
        write_meshes([(tmp_path / f, surface, {}) for f in ("a.ply", "b.ply", "c.obj")])
    assert [path.name for path in tmp_path.iterdir()] == ["b.ply"]
    assert (tmp_path / "b.ply").read_bytes() == before
    write_meshes([(tmp_path / f, surface, {}) for f in ("a.ply", "b.ply")])
    assert read_mesh(tmp_path / "a.ply").faces.tobytes() == surface.faces.tobytes()
    assert read_mesh(tmp_path / "b.ply").faces.tobytes() == surface.faces.tobytes()
