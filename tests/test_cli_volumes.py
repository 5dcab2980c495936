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


# ---------------------------------------------------------------------------- several surfaces


@pytest.fixture
def ball_path(tmp_path):
    np.savez(tmp_path / "ball.npz", data=ball(), spacing=[1.0, 2.0, 3.0])
    return tmp_path / "ball.npz"


@pytest.fixture
def label_path(tmp_path):
    labels = np.zeros((9, 9, 12), np.int16)
    labels[2:6, 2:6, 1:5], labels[2:6, 2:6, 5:11], labels[7, 7, 0] = 3, 12, -4
    np.save(tmp_path / "labels.npy", labels)
    return tmp_path / "labels.npy"


def test_several_levels_are_several_files(run, ball_path, tmp_path):
    options = ("--level", "0,-2.5", "--level", "otsu")
    result, target = run("isosurface", ball_path, *options)
    files = [tmp_path / f"mesh-{word}.ply" for word in ("0", "-2.5", "otsu")]
    assert result["outputs"] == [str(path) for path in files]
    assert not target.exists()
    expected = isosurface_of(Volume(ball(), np.diag([1.0, 2, 3, 1])), [0.0, -2.5, "otsu"])
    for path, surface, told in zip(files, expected, result["surfaces"], strict=True):
        np.testing.assert_array_equal(read_mesh(path).vertices, surface.vertices)
        np.testing.assert_array_equal(read_mesh(path).faces, surface.faces)
        assert told["output"] == str(path)
        assert told["level"] == surface.level
        assert told["topology"]["n_faces"] == len(surface.faces)


def test_one_level_that_is_found_is_told(run, ball_path):
    result, target = run("isosurface", ball_path, "--level", "otsu")
    expected = isosurface_of(Volume(ball(), np.diag([1.0, 2, 3, 1])), "otsu")
    assert result["level"] == expected.level
    np.testing.assert_array_equal(read_mesh(target).faces, expected.faces)


def test_labels_are_files_of_their_own(run, label_path, tmp_path):
    result, _ = run("isosurface", label_path, "--labels", "all", "--closed")
    assert [told["label"] for told in result["surfaces"]] == [-4, 3, 12]
    for label in (-4, 3, 12):
        assert len(read_mesh(tmp_path / f"mesh-{label}.ply").faces)
    assert all(told["topology"]["is_closed"] for told in result["surfaces"])
    result, _ = run("isosurface", label_path, "--labels", "12")
    assert result["outputs"] == [str(tmp_path / "mesh-12.ply")]


def test_options_of_extraction(run, ball_path):
    surface = ("isosurface", ball_path, "--level", 0)
    n_faces = {}
    for name, options in {
        "kuhn": (),
        "bcc": ("--lattice", "bcc"),
        "regular": ("--lattice", "bcc", "--regularise"),
        "fine": ("--refine", "2"),
    }.items():
        result, target = run(*surface, *options)
        n_faces[name] = len(read_mesh(target).faces)
        assert result["topology"]["euler_characteristic"] == 2
    assert n_faces["bcc"] > 1.3 * n_faces["kuhn"]
    assert n_faces["regular"] < 0.35 * n_faces["bcc"]
    assert n_faces["fine"] > 3.5 * n_faces["kuhn"]


def test_normals_and_data_are_written(run, ball_path, tmp_path):
    np.savez(tmp_path / "other.npz", data=2 * ball())
    options = ("--vertex-normals", "--vertex-data", f"dose={tmp_path / 'other.npz'}")
    _, target = run("isosurface", ball_path, "--level", 1, *options)
    head = target.read_bytes()[:600]
    assert b"property double nx" in head
    assert b"property double dose" in head
    begin = target.read_bytes().index(b"end_header\n") + len(b"end_header\n")
    vertices = read_mesh(target).vertices
    rows = np.fromfile(target, "<f8", 7 * len(vertices), offset=begin).reshape(-1, 7)
    np.testing.assert_array_equal(rows[:, :3], vertices)
    np.testing.assert_allclose(np.linalg.norm(rows[:, 3:6], axis=1), 1)
    np.testing.assert_allclose(rows[:, 6], 2.0, atol=0.05)


def test_simplify_takes_the_same_options(run, ball_path):
    options = ("--level", "otsu", "--lattice", "bcc", "--regularise", "--target-faces", 400)
    result, target = run("simplify", ball_path, *options)
    assert len(read_mesh(target).faces) in (400, 401, 402)
    assert result["same_topology"]
    result, _ = run("simplify", ball_path, "--level", "1,2", "--target-faces", 4, exit_code=2)
    assert "give one --level, got 1.0, 2.0" in result["error"]["message"]
    options = ("--refine", 2, "--regularise", "--target-faces", 4)
    result, _ = run("simplify", target, *options, exit_code=2)
    assert "--refine, --regularise: only for volumes" in result["error"]["message"]


@pytest.mark.parametrize(
    ("options", "exit_code", "message"),
    [
        ((), 2, "give either --level or --labels"),
        (("--level", "1", "--labels", "all"), 2, "give either --level or --labels"),
        (("--level", "high"), 2, "--level must be a number or otsu, got 'high'"),
        (("--level", "1,inf"), 2, "--level must be a number or otsu, got 'inf'"),
        (("--level", "1", "--level", "1.0"), 2, "--level 1.0 is given twice"),
        (("--labels", "1,x"), 2, "--labels must be all, or integers such as 1,4, got '1,x'"),
        (("--labels", "1,1"), 2, "--labels 1,1 has one of them twice"),
        (("--labels", "3,8"), 1, "there is no label 8 in"),
        (("--labels", "3", "--lattice", "bcc"), 2, "labels do not go with lattice"),
        (("--level", "1,99"), 1, "nothing crosses the level 99"),
        (("--level", "1", "--vertex-data", "dose"), 2, "--vertex-data must be NAME=VOLUME"),
        (("--level", "1", "--lattice", "cubes"), 2, "lattice must be one of kuhn, five, bcc"),
        (("--level", "1", "--refine", "0"), 2, "refine must be a positive integer"),
    ],
)
def test_wrong_usage_writes_nothing(run, label_path, tmp_path, options, exit_code, message):
    before = set(tmp_path.iterdir())
    result, _ = run("isosurface", label_path, *options, exit_code=exit_code)
    assert message in result["error"]["message"]
    assert set(tmp_path.iterdir()) == before


def test_what_a_format_does_not_hold_is_found_before_any_work(ball_path, tmp_path):
    command = ["isosurface", str(ball_path), "--level", "0", "--vertex-normals"]
    result = CliRunner().invoke(app, [*command, "-o", str(tmp_path / "a.stl"), "--json"])
    assert result.exit_code == 1
    assert "STL does not hold normals" in result.stderr
    assert "read" not in json.loads(result.stdout)


def test_no_label_but_background(run, tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((3, 3, 3), int))
    result, _ = run("isosurface", tmp_path / "a.npy", "--labels", "all", exit_code=1)
    assert "there is no label in" in result["error"]["message"]


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
