"""Volumes on the command line: what is taken of a file that holds several."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from tetsimplify import surface_distance
from tetsimplify.cli import app
from tetsimplify.io import Volume, isosurface_of, read_mesh, read_volume
from volumes import ball, signed_volume


@pytest.fixture
def run(tmp_path):
    def run_here(*arguments, exit_code=0):
        target = tmp_path / "mesh.ply"
        command = [*map(str, arguments), "-o", str(target), "--json"]
        result = CliRunner().invoke(app, command)
        assert result.exit_code == exit_code, result.output
        return json.loads(result.stdout), target

    return run_here


@pytest.fixture
def times(tmp_path):
    """Two balls at different times, as z, y, x, with nothing that says so."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["raw"] = np.stack([ball(radius=5.0).T, ball(radius=7.0).T])
        file["flat"] = np.ones((4, 4))
    return tmp_path / "a.h5"


def test_key_in_path_and_time_and_axes(run, times):
    _, target = run("isosurface", f"{times}:/raw", "--level", 0, "--time", 1, "--axes", "tzyx")
    expected = isosurface_of(Volume(ball(radius=7.0).copy(order="F"), np.eye(4)), 0.0)
    np.testing.assert_array_equal(read_mesh(target).vertices, expected.vertices)
    np.testing.assert_array_equal(read_mesh(target).faces, expected.faces)


def test_what_is_missing_is_told(run, times):
    command = ("isosurface", times, "--level", 0, "--axes", "tzyx")
    result, _ = run(*command, exit_code=1)
    assert "it has 2 times, choose one by time, from 0 to 1" in result["error"]["message"]
    result, _ = run(*command, "--time", 2, exit_code=2)
    assert "time must be from 0 to 1, got 2" in result["error"]["message"]
    result, _ = run(*command, "--time", 1, "--channel", 1, exit_code=2)
    assert "channel must be 0" in result["error"]["message"]


def test_range_of_a_volume_in_a_file(run, times):
    command = ("isosurface", times, "--level", 99, "--axes", "tzyx", "--time", 0)
    result, _ = run(*command, exit_code=1)
    low, high = ball(radius=5.0).min(), ball(radius=5.0).max()
    assert f"go from {low} to {high}" in result["error"]["message"]


def test_what_is_read_whole_is_a_note(run, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    nibabel.save(nibabel.Nifti1Image(ball(), np.eye(4)), tmp_path / "a.nii.gz")
    result, _ = run("isosurface", tmp_path / "a.nii.gz", "--level", 0)
    assert result["notes"] == ["a.nii.gz cannot be read in parts, so all of it is read into memory"]


def test_options_of_volumes_are_not_for_meshes(run, times):
    _, mesh = run("isosurface", times, "--level", 0, "--axes", "tzyx", "--time", 0)
    options = ("--max-edge-length", 1, "--time", 0, "--axes", "zyx")
    result, _ = run("simplify", mesh, *options, exit_code=2)
    assert "--time, --axes: only for volumes" in result["error"]["message"]


AXES = np.array([[0.0, -0.6, 0.8], [0.0, 0.8, 0.6], [1.0, 0.0, 0.0]])  # upright, mirrored


def placed(axes):
    affine = np.eye(4)
    affine[:3, :3] = axes * (0.5, 0.5, 1.0)
    affine[:3, 3] = 7.0, -3.0, 2.0
    return affine


@pytest.fixture
def upright(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    path = tmp_path / "upright.nii"
    nibabel.Nifti1Image(ball().astype(np.float32), placed(AXES)).to_filename(path)
    return path


def test_a_volume_is_simplified_while_it_is_extracted(run, upright):
    command = ("simplify", upright, "--level", 0, "--max-edge-length")
    streamed, target = run(*command, 0.6)
    assert "stream" in streamed["seconds"]
    assert "extract" not in streamed["seconds"]
    mesh = read_mesh(target)
    volume = read_volume(upright)
    whole = isosurface_of(volume, 0.0)
    assert streamed["topology_before"]["n_faces"] == len(whole.faces)
    assert streamed["same_topology"]
    assert streamed["remaining"] == {}
    assert signed_volume(mesh) == pytest.approx(signed_volume(whole), rel=0.05)
    assert surface_distance(mesh, whole).upper < 0.5
    for other in (("140%",), (1.0, "--repair"), (1.0, "--target-faces", 100)):
        result, _ = run(*command, *other)
        assert "stream" not in result["seconds"]
        assert result["same_topology"]


def test_a_skewed_volume_is_simplified_as_a_whole(run, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    skewed = placed(AXES + [[0.2, 0, 0], [0, 0, 0], [0, 0, 0]])
    image = nibabel.Nifti1Image(ball().astype(np.float32), None)
    image.set_sform(skewed)
    image.to_filename(tmp_path / "skewed.nii")
    command = ("simplify", tmp_path / "skewed.nii", "--level", 0, "--max-edge-length", 1.0)
    result, _ = run(*command)
    assert "stream" not in result["seconds"]
    assert result["same_topology"]


def test_range_is_told_while_streaming(run, upright):
    command = ("simplify", upright, "--level", 99, "--max-edge-length", 1.0)
    result, _ = run(*command, exit_code=1)
    assert "nothing crosses the level 99" in result["error"]["message"]
