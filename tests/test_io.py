"""Meshes in and out of files: round trips, and what can go wrong."""

from __future__ import annotations

import builtins
import os
import subprocess
import sys

import numpy as np
import pytest

from data import data_dir, needs_data
from io_meshes import POINTS, TRIANGLES, assert_same, nasty_mesh, sphere
from tetsimplify.errors import FileError, MeshError, MissingExtraError
from tetsimplify.io import MESH_FORMATS, check_target, files, read_mesh, write_mesh
from tetsimplify.mesh import Mesh

EXACT = [suffix for suffix, entry in MESH_FORMATS.items() if entry.precision is np.float64]
PACKAGES = {".vtk": "pyvista", ".vtp": "pyvista", ".vtu": "pyvista", ".glb": "trimesh"}


def needs_package_of(suffix: str) -> None:
    """Skip the test when the package for a format is missing."""
    if suffix in PACKAGES:
        pytest.importorskip(PACKAGES[suffix])


def leftovers(folder) -> list[str]:
    """Names of temporary files."""
    return [name for name in os.listdir(folder) if name.startswith(".")]


# --- round trips ---------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", EXACT)
@pytest.mark.parametrize("make", [nasty_mesh, sphere])
def test_double_precision_and_order_survive(tmp_path, suffix, make):
    needs_package_of(suffix)
    mesh = make()
    write_mesh(tmp_path / f"a{suffix}", mesh)
    assert_same(read_mesh(tmp_path / f"a{suffix}"), *mesh)


def test_glb_keeps_order_in_single_precision(tmp_path):
    pytest.importorskip("trimesh")
    for mesh in (nasty_mesh(), sphere()):
        write_mesh(tmp_path / "a.glb", mesh)
        assert_same(read_mesh(tmp_path / "a.glb"), mesh.vertices.astype(np.float32), mesh.faces)


def test_stl_keeps_the_surface_in_single_precision(tmp_path):
    mesh = sphere()
    write_mesh(tmp_path / "a.stl", mesh)
    back = read_mesh(tmp_path / "a.stl")
    assert len(back.vertices) == len(mesh.vertices)
    rounded = mesh.vertices.astype(np.float32)
    np.testing.assert_array_equal(back.vertices[back.faces], rounded[mesh.faces])


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_same_mesh_makes_same_bytes(tmp_path, suffix):
    needs_package_of(suffix)
    for name in "ab":
        write_mesh(tmp_path / f"{name}{suffix}", sphere())
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_mesh_without_faces(tmp_path, suffix):
    needs_package_of(suffix)
    empty = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))
    if suffix in PACKAGES:
        with pytest.raises(FileError, match="without faces"):
            write_mesh(tmp_path / "a.glb", empty)
        return
    write_mesh(tmp_path / f"a{suffix}", empty)
    assert_same(read_mesh(tmp_path / f"a{suffix}"), *empty)


@pytest.mark.parametrize("suffix", [".PLY", ".Obj", ".OFF", ".StL"])
def test_suffixes_in_capitals(tmp_path, suffix):
    write_mesh(tmp_path / f"a{suffix}", sphere())
    assert len(read_mesh(tmp_path / f"a{suffix}").faces) == len(sphere().faces)


@needs_data
@pytest.mark.parametrize("name", ["tray_bottom", "cheese", "car", "dragon_vrip_res2"])
def test_real_meshes(tmp_path, name):
    mesh = read_mesh(data_dir() / "meshes" / f"{name}.ply")
    for suffix in (".ply", ".obj", ".off"):
        write_mesh(tmp_path / f"a{suffix}", mesh)
        assert_same(read_mesh(tmp_path / f"a{suffix}"), *mesh)


def test_lists_are_accepted_as_a_mesh(tmp_path):
    write_mesh(tmp_path / "a.ply", (POINTS, TRIANGLES))
    assert_same(read_mesh(tmp_path / "a.ply"), POINTS, TRIANGLES)


def test_what_is_no_mesh_is_refused(tmp_path):
    with pytest.raises(MeshError, match="from 0 to 6"):
        write_mesh(tmp_path / "a.ply", Mesh(np.array(POINTS), np.array([[0, 1, 7]], np.int32)))
    assert not os.listdir(tmp_path)


# --- what can go wrong ---------------------------------------------------------------------


def test_unknown_suffix(tmp_path):
    for name in ("a.xyz", "ply", "a.ply.gz"):
        with pytest.raises(FileError, match=r"\.ply \.stl \.obj"):
            read_mesh(tmp_path / name)
        with pytest.raises(FileError, match=r"\.ply \.stl \.obj"):
            write_mesh(tmp_path / name, sphere())


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(FileError, match="there is no file"):
        read_mesh(tmp_path / "a.ply")
    (tmp_path / "b.ply").mkdir()
    with pytest.raises(FileError, match="is not a file"):
        read_mesh(tmp_path / "b.ply")
    with pytest.raises(FileError, match="it is a folder"):
        check_target(tmp_path / "b.ply")
    with pytest.raises(FileError, match="there is no folder"):
        check_target(tmp_path / "no" / "a.ply")
    with pytest.raises(OSError, match="there is no folder"):
        write_mesh(tmp_path / "no" / "a.ply", sphere())


@pytest.mark.parametrize(("suffix", "package"), PACKAGES.items())
def test_missing_package(tmp_path, monkeypatch, suffix, package):
    imported = builtins.__import__

    def no_such_package(name, *rest, **more):
        if name.partition(".")[0] == package:
            raise ModuleNotFoundError(name)
        return imported(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", no_such_package)
    (tmp_path / f"a{suffix}").write_bytes(b"before")
    for attempt in (read_mesh, check_target, lambda path: write_mesh(path, sphere())):
        with pytest.raises(MissingExtraError, match=rf'tetsimplify\[{package}\]"'):
            attempt(tmp_path / f"a{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == b"before"
    assert not leftovers(tmp_path)


@pytest.mark.parametrize("failure", [OSError("disk full"), ValueError("x"), KeyboardInterrupt()])
@pytest.mark.parametrize("exists", [True, False])
def test_failure_in_the_middle_leaves_nothing(tmp_path, monkeypatch, failure, exists):
    target = tmp_path / "a.ply"
    if exists:
        target.write_bytes(b"before")

    def fail(path, mesh):
        path.write_bytes(b"half")
        raise failure

    monkeypatch.setitem(MESH_FORMATS, ".ply", MESH_FORMATS[".ply"]._replace(write=fail))
    expected = KeyboardInterrupt if isinstance(failure, KeyboardInterrupt) else FileError
    with pytest.raises(expected):
        write_mesh(target, sphere())
    assert os.listdir(tmp_path) == (["a.ply"] if exists else [])
    if exists:
        assert target.read_bytes() == b"before"


def test_killed_writer_leaves_the_target_whole(tmp_path):
    target = tmp_path / "a.ply"
    target.write_bytes(b"before")
    code = (
        "import os, sys\nfrom tetsimplify.io import files\n"
        "with files.replacing(sys.argv[1]) as path:\n"
        "    path.write_bytes(b'half'); os._exit(9)\n"
    )
    assert subprocess.run([sys.executable, "-c", code, str(target)], check=False).returncode == 9
    assert target.read_bytes() == b"before"


def test_replaced_file_keeps_its_mode_and_its_link(tmp_path):
    target, link = tmp_path / "a.ply", tmp_path / "link.ply"
    target.write_bytes(b"before")
    target.chmod(0o640)
    link.symlink_to(target)
    write_mesh(link, sphere())
    assert link.is_symlink()
    assert target.stat().st_mode & 0o777 == 0o640
    assert len(read_mesh(target).faces) == len(sphere().faces)


def test_new_file_has_the_usual_mode(tmp_path):
    (tmp_path / "usual").write_bytes(b"")
    with files.replacing(tmp_path / "a.ply") as temporary:
        temporary.write_bytes(b"x")
    assert (tmp_path / "a.ply").stat().st_mode == (tmp_path / "usual").stat().st_mode
    assert not leftovers(tmp_path)
