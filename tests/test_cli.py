"""The command line."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from typer.testing import CliRunner

import tetsimplify
from tetsimplify.cli import app, values
from tetsimplify.cli.session import Session, as_plain
from tetsimplify.errors import MissingExtraError, OptionError
from tetsimplify.io import Volume, isosurface_of, read_mesh, write_mesh
from tetsimplify.mesh import Mesh

TOPOLOGY_KEYS = {
    "n_vertices",
    "n_faces",
    "n_edges",
    "euler_characteristic",
    "n_components",
    "genus",
    "n_boundary_loops",
    "n_boundary_edges",
    "edge_degrees",
    "is_manifold",
    "is_closed",
    "is_oriented",
    "defects",
}


def tube():
    """Samples of a torus, 0 on the surface."""
    x, y, z = np.mgrid[-1:1:30j, -1:1:30j, -0.5:0.5:16j]
    return (0.3 - np.hypot(np.hypot(x, y) - 0.6, z)).astype(np.float32)


@pytest.fixture
def volume_path(tmp_path):
    path = tmp_path / "torus.npz"
    np.savez(path, data=tube(), spacing=[0.1, 0.1, 0.1], origin=[-1.0, 2.0, 3.0], other=np.ones(3))
    return path


@pytest.fixture
def mesh_path(tmp_path):
    path = tmp_path / "torus.ply"
    write_mesh(path, isosurface_of(Volume(tube(), np.eye(4)), 0.0))
    return path


def run(*arguments, exit_code=0):
    """Run the command line in this process."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == exit_code, result.output
    return result


def run_json(*arguments, exit_code=0):
    """Run a command with --json; the standard output must be one JSON object."""
    return json.loads(run(*arguments, "--json", exit_code=exit_code).stdout)


def run_apart(*arguments):
    """Run the command line in a process of its own."""
    command = [sys.executable, "-m", "tetsimplify", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, encoding="utf-8", check=False, timeout=300)


# --- isosurface ----------------------------------------------------------------------------


def test_isosurface(volume_path, tmp_path):
    target = tmp_path / "out.ply"
    result = run_json("isosurface", volume_path, "--level", 0.05, "-o", target)
    mesh = read_mesh(target)
    expected = tetsimplify.extract_isosurface(
        tube(), 0.05, spacing=(0.1, 0.1, 0.1), origin=(-1, 2, 3)
    )
    np.testing.assert_allclose(mesh.vertices, expected.vertices)
    np.testing.assert_array_equal(mesh.faces, expected.faces)
    assert set(result) == {
        "command", "version", "input", "outputs", "level", "topology", "seconds", "notes",
    }  # fmt: skip
    assert set(result["topology"]) == TOPOLOGY_KEYS
    assert result["topology"]["genus"] == 1
    assert result["outputs"] == [str(target)]
    assert set(result["seconds"]) == {"read", "extract", "topology", "write"}


def test_isosurface_options(volume_path, tmp_path):
    common = ("isosurface", volume_path, "--level", 0.0)
    run(*common, "-o", tmp_path / "a.ply", "--spacing", "1,2,3", "--lattice", "kuhn")
    extent = np.ptp(read_mesh(tmp_path / "a.ply").vertices, axis=0)
    np.testing.assert_allclose(extent, [26.1, 52.2, 27.0], atol=0.7)

    run(*common, "-o", tmp_path / "b.ply", "--normals", "higher")
    faces = [read_mesh(tmp_path / f"{name}.ply").faces for name in "ab"]
    assert len(faces[0]) == len(faces[1])
    assert not np.array_equal(*faces)

    low = ("isosurface", volume_path, "--level", -0.25, "-o", tmp_path / "c.ply")
    assert not run_json(*low)["topology"]["is_closed"]
    assert run_json(*low, "--closed")["topology"]["is_closed"]

    message = run(*common, "-o", tmp_path / "d.ply", "--key", "other", exit_code=1).stderr
    assert "shape (3,)" in message
    assert "--spacing must be" in run(
        *common, "-o", tmp_path / "d.ply", "--spacing", "1,2", exit_code=2
    ).stderr  # fmt: skip


def test_level_outside_the_range_tells_the_range(volume_path, tmp_path):
    command = ("isosurface", volume_path, "--level", 7, "-o", tmp_path / "a.ply")
    message = " ".join(run(*command, exit_code=1).stderr.split())
    low, high = tube().min(), tube().max()
    assert (
        f"nothing crosses the level 7: the values of {volume_path} go from {low} to {high}"
        in message
    )
    assert not (tmp_path / "a.ply").exists()


def test_volume_with_nan(tmp_path):
    data = tube()
    data[2, 3, 4] = np.nan
    np.save(tmp_path / "a.npy", data)
    command = ("isosurface", tmp_path / "a.npy", "--level", 0, "-o", tmp_path / "a.ply")
    assert "nan at index [2, 3, 4]" in run(*command, exit_code=1).stderr


# --- simplify ------------------------------------------------------------------------------

SIMPLIFY_KEYS = {
    "command", "version", "input", "outputs", "options", "topology_before", "topology_after",
    "same_topology", "shortest_edge_before", "shortest_edge_after", "n_simple", "n_nested",
    "n_lens_vertices", "n_lens_faces", "n_sweeps", "n_rounds", "stop", "remaining", "repairs",
    "seconds", "notes",
}  # fmt: skip


def test_simplify_mesh(mesh_path, tmp_path):
    target = tmp_path / "out.obj"
    result = run_json("simplify", mesh_path, "-o", target, "--max-edge-length", 1.0)
    assert set(result) == SIMPLIFY_KEYS
    assert result["options"]["max_edge_length"] == 1.0
    assert result["stop"] == "max_edge_length"
    assert result["same_topology"]
    assert result["repairs"] is None
    mesh = read_mesh(target)
    assert result["topology_after"]["n_faces"] == len(mesh.faces)
    assert len(mesh.faces) < len(read_mesh(mesh_path).faces)
    expected = tetsimplify.simplify(*read_mesh(mesh_path), max_edge_length=1.0)
    np.testing.assert_array_equal(mesh.vertices, expected.vertices)
    np.testing.assert_array_equal(mesh.faces, expected.faces)


def test_simplify_volume(volume_path, tmp_path):
    command = ("simplify", volume_path, "-o", tmp_path / "a.ply", "--max-edge-length", "120%")
    assert "so --level is needed" in run(*command, exit_code=2).stderr
    result = run_json(*command, "--level", 0)
    assert result["topology_after"]["genus"] == 1
    assert {"read", "extract", "check", "contract", "report", "write"} <= set(result["seconds"])


def test_percentage_is_of_the_median_edge(mesh_path, tmp_path):
    median = run_json("info", mesh_path)["edge_lengths"]["median"]
    command = ("simplify", mesh_path, "-o", tmp_path / "a.ply", "--max-edge-length")
    assert run_json(*command, "80%")["options"]["max_edge_length"] == pytest.approx(0.8 * median)


def test_simplify_options(mesh_path, tmp_path):
    result = run_json(
        "simplify", mesh_path, "-o", tmp_path / "a.ply", "--max-edge-length", 0.8,
        "--blocked", "skip", "--placement", "endpoint", "--outer", "path",
        "--removal-limit", "2x", "--foldover", "off", "--repair",
    )  # fmt: skip
    expected = {"max_edge_length": 0.8, "blocked": "skip", "placement": "endpoint",
                "outer": "path", "removal_limit": 1.6, "foldover": None}  # fmt: skip
    assert {name: result["options"][name] for name in expected} == expected
    assert result["repairs"]["degenerate_faces_dropped"] == 0
    command = ("simplify", mesh_path, "-o", tmp_path / "a.ply", "--max-edge-length", 0.8)
    result = run_json(*command, "--removal-limit", "inf", "--foldover", 30)
    assert (result["options"]["removal_limit"], result["options"]["foldover"]) == ("inf", 30)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--target-faces", 200], {"target_faces": 200}),
        (["--keep-ratio", "15%"], {"keep_ratio": 0.15}),
        (["--keep-ratio", "0.15"], {"keep_ratio": 0.15}),
        (["--max-error", "0.5"], {"max_error": 0.5}),
        (["--max-quadric-error", "0.5"], {"max_quadric_error": 0.5}),
        (
            ["--max-edge-length", "1", "--target-faces", 3000],
            {"max_edge_length": 1.0, "target_faces": 3000},
        ),
    ],
)
def test_simplify_until_a_criterion_is_reached(mesh_path, tmp_path, options, expected):
    target = tmp_path / "a.ply"
    result = run_json("simplify", mesh_path, "-o", target, *options)
    given = {name: value for name, value in result["options"].items() if value is not None}
    assert expected.items() <= given.items()
    assert result["stop"] == list(expected)[-1]
    library = tetsimplify.simplify(*read_mesh(mesh_path), **expected)
    np.testing.assert_array_equal(read_mesh(target).vertices, library.vertices)
    text = run("simplify", mesh_path, "-o", target, *options).stdout
    assert result["stop"].replace("_", " ") in text
    assert ("Edges shorter than" in text) == ("max_edge_length" in expected)


def test_percentage_of_an_error_is_of_the_diagonal(mesh_path, tmp_path):
    mesh = read_mesh(mesh_path)
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    far = Mesh(np.concatenate([mesh.vertices, [[1e6, 0, 0]]]), mesh.faces)  # in no face
    write_mesh(tmp_path / "far.ply", far)
    for name in ("max-error", "max-quadric-error"):
        for path in (mesh_path, tmp_path / "far.ply"):
            command = ("simplify", path, "-o", tmp_path / "a.ply", "--repair", f"--{name}", "1%")
            expected = pytest.approx(0.01 * diagonal)
            assert run_json(*command)["options"][name.replace("-", "_")] == expected


def test_simplify_without_end_says_what_is_in_the_way(mesh_path, tmp_path):
    command = ("simplify", mesh_path, "-o", tmp_path / "a.ply", "--target-faces", 2)
    assert run_json(*command)["stop"] == "exhausted"
    assert "topology and guards" in run(*command).stdout


def test_options_by_quadric_error(mesh_path, tmp_path):
    result = run_json(
        "simplify", mesh_path, "-o", tmp_path / "a.ply", "--keep-ratio", 0.5, "--cost", "length",
        "--placement", "quadric", "--boundary", "keep", "--feature-angle", 40,
        "--normal-deviation", 60, "--shape", "off", "--removal-limit", "inf", "--no-fit",
    )  # fmt: skip
    expected = {"keep_ratio": 0.5, "cost": "length", "placement": "quadric", "boundary": "keep",
                "feature_angle": 40, "normal_deviation": 60, "shape": None,
                "removal_limit": "inf", "fit": False}  # fmt: skip
    assert {name: result["options"][name] for name in expected} == expected


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--max-edge-length", "five"], "a length such as 0.5 or a percentage"),
        (["--max-edge-length", "-1"], "a length such as 0.5 or a percentage"),
        (["--max-edge-length", "1", "--removal-limit", "4y"], "--removal-limit must be"),
        (["--max-edge-length", "1", "--foldover", "much"], "--foldover must be"),
        (["--max-edge-length", "1", "--blocked", "maybe"], "'contract', 'skip', 'violate'"),
        (["--max-edge-length", "1", "--level", "3"], "--level: only for volumes"),
        (["--max-edge-length", "1", "--closed"], "--closed: only for volumes"),
        (["--max-edge-length", "1", "--unknown"], "No such option"),
        ([], "give at least one of --max-edge-length, --target-faces, --keep-ratio, --max-error"),
        (["--placement", "quadric"], "give at least one of"),
        (["--target-faces", "many"], "--target-faces"),
        (["--target-faces", "-1"], "target_faces must be at least 0"),
        (["--keep-ratio", "150%"], "a number from 0 to 1 or a percentage"),
        (["--max-error", ""], "--max-error must be a length"),
        (["--max-error", "1%", "--removal-limit", "4x"], "a multiple of --max-edge-length"),
        (["--max-error", "1%", "--normal-deviation", "much"], "an angle in degrees, or off"),
        (["--max-error", "1%", "--fit"], "fit=True needs target_faces or keep_ratio"),
        (["--max-error", "1%", "--shape", "2"], "shape must be from 0 to 1"),
    ],
)
def test_wrong_usage(mesh_path, tmp_path, options, message):
    stderr = run("simplify", mesh_path, "-o", tmp_path / "a.ply", *options, exit_code=2).stderr
    assert message in " ".join(stderr.split())
    assert not (tmp_path / "a.ply").exists()


def test_mesh_that_is_no_manifold(tmp_path):
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]], np.int32)
    points = np.random.default_rng(0).random((6, 3))
    write_mesh(tmp_path / "fan.ply", Mesh(points, faces))
    command = ("simplify", tmp_path / "fan.ply", "-o", tmp_path / "a.ply", "--max-edge-length", 0)
    assert "edges with more than two faces" in " ".join(run(*command, exit_code=1).stderr.split())
    assert run_json(*command, "--repair")["repairs"]["edges_split"] > 0

    result = run_json("info", tmp_path / "fan.ply")
    defects = result["topology"]["defects"]
    assert defects["non_manifold_edges"] == {"count": 1, "first": [[0, 1]]}
    assert defects["unreferenced_vertices"] == {"count": 1, "first": [5]}
    assert result["topology"]["genus"] is None
    text = run("info", tmp_path / "fan.ply").stdout
    assert "edges of more than two faces" in text
    assert "0-1" in text


# --- info, demo and what all commands share ------------------------------------------------


def test_info(mesh_path):
    result = run_json("info", mesh_path)
    assert set(result) == {
        "command",
        "version",
        "input",
        "topology",
        "edge_lengths",
        "quality",
        "seconds",
        "notes",
    }
    assert set(result["topology"]) == TOPOLOGY_KEYS
    assert result["edge_lengths"]["min"] <= result["edge_lengths"]["median"]
    quality = tetsimplify.quality(*read_mesh(mesh_path))
    assert result["quality"] == as_plain(quality.as_dict())
    text = run("info", mesh_path).stdout
    for words in ("Euler characteristic", "genus", "edges of degree 2", "median"):
        assert words in text
    for words in ("mean radius ratio", "smallest angle", "topological criterion"):
        assert words in text
    assert f"{quality.min_angle.min():.6g}" in text
    assert "Defects" not in text


def test_info_without_faces(tmp_path):
    write_mesh(tmp_path / "empty.ply", Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)))
    assert run_json("info", tmp_path / "empty.ply")["quality"]["n_faces"] == 0
    assert "Quality" in run("info", tmp_path / "empty.ply").stdout


def test_distance(mesh_path, tmp_path):
    target = tmp_path / "a.ply"
    run("simplify", mesh_path, "-o", target, "--max-error", "1%")
    result = run_json("distance", mesh_path, target, "--tolerance", "0.01%")
    found = result["distance"]
    expected = tetsimplify.surface_distance(
        read_mesh(mesh_path), read_mesh(target), tolerance=found["tolerance"]
    )
    assert found["tolerance"] == pytest.approx(1e-4 * result["diagonal"])
    assert (found["lower"], found["upper"]) == (expected.lower, expected.upper)
    assert found["b_to_a"]["mean"] == expected.b_to_a.mean
    assert 0 < found["upper"] <= 0.01 * result["diagonal"] + found["tolerance"]
    text = run("distance", mesh_path, target).stdout
    for words in ("from A to B", "at most", "root mean square", "% of diagonal"):
        assert words in text
    message = run("distance", mesh_path, target, "--tolerance", "x", exit_code=2).stderr
    assert "--tolerance must be" in message


def test_notes_are_told(tmp_path, mesh_path):
    write_mesh(tmp_path / "a.stl", read_mesh(mesh_path))
    assert "note: STL holds no connectivity" in run("info", tmp_path / "a.stl").stderr
    assert "STL holds no connectivity" in run_json("info", tmp_path / "a.stl")["notes"][0]
    assert not run("info", tmp_path / "a.stl", "--quiet").output


def test_demo(tmp_path):
    pytest.importorskip("matplotlib")
    result = run_json("demo", "--output-dir", tmp_path)
    assert result["outputs"] == [str(tmp_path / name) for name in ("brain.ply", "brain.png")]
    assert result["topology_before"]["n_faces"] == 925_212
    assert result["topology_before"]["euler_characteristic"] == -10
    assert result["same_topology"]
    assert len(read_mesh(tmp_path / "brain.ply").faces) == result["topology_after"]["n_faces"]
    assert (tmp_path / "brain.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(os.listdir(tmp_path)) == ["brain.ply", "brain.png"]


def test_demo_without_matplotlib_or_folder(tmp_path, monkeypatch):
    from tetsimplify import demo

    def no_matplotlib(*arguments):
        raise MissingExtraError("drawing a picture", "matplotlib", "demo")

    small = isosurface_of(Volume(tube(), np.eye(4)), 0.0)
    monkeypatch.setattr(demo, "extract_brain", lambda progress: small)
    monkeypatch.setattr(demo, "save_picture", no_matplotlib)
    result = run("demo", "--output-dir", tmp_path)
    assert 'needs matplotlib: pip install "tetsimplify[demo]"' in " ".join(result.stderr.split())
    assert os.listdir(tmp_path) == ["brain.ply"]
    assert "there is no folder" in run("demo", "--output-dir", tmp_path / "no", exit_code=1).stderr


def test_target_and_options_are_checked_before_any_work(volume_path, tmp_path):
    command = ("simplify", tmp_path / "nothing.ply", "-o", tmp_path / "a.ply")
    assert "give at least one of" in run(*command, exit_code=2).stderr
    assert "blocked must" in run(
        *command, "--target-faces", 9, "--blocked", "maybe", exit_code=2
    ).stderr  # fmt: skip
    command = ("isosurface", tmp_path / "nothing.npz", "--level", 0, "-o")
    assert "there is no folder" in run(*command, tmp_path / "no" / "a.ply", exit_code=1).stderr
    assert "no suffix of a mesh format" in run(*command, tmp_path / "a.xyz", exit_code=1).stderr
    assert "there is no file" in run(*command, tmp_path / "a.ply", exit_code=1).stderr


def test_source_of_unknown_kind(tmp_path):
    command = ("simplify", tmp_path / "a.txt", "-o", tmp_path / "a.ply", "--max-edge-length", 1)
    message = " ".join(run(*command, exit_code=1).stderr.split())
    assert "meshes have .ply" in message
    assert "volumes .nii" in message


def test_errors_as_json(tmp_path):
    result = run_json("info", tmp_path / "no.ply", exit_code=1)
    assert result["command"] == "info"
    assert result["error"]["type"] == "FileError"
    assert "there is no file" in result["error"]["message"]


def test_unexpected_error_is_one_line(mesh_path, monkeypatch):
    def broken(*arguments):
        raise ZeroDivisionError("oh")

    monkeypatch.setattr("tetsimplify.cli.commands.edge_lengths", broken)
    stderr = run("info", mesh_path, exit_code=1).stderr
    assert stderr.strip() == (
        "tetsimplify: unexpected ZeroDivisionError: oh (--debug shows where it came from)"
    )
    stderr = run("info", mesh_path, "--debug", exit_code=1).stderr
    assert "Traceback" in stderr
    assert "in broken" in stderr


def test_version_and_help():
    assert run("--version").stdout == f"tetsimplify {tetsimplify.__version__}\n"
    assert "isosurface" in run("--help").stdout
    text = run("simplify", "-h").stdout
    assert "--max-edge-length" in text
    for panel in ("What stops it", "Which edges go", "What is held", "Volumes"):
        assert panel in text


def test_progress_is_drawn_on_a_terminal_only():
    this = Session("info", as_json=False, quiet=False, debug=False)
    this.progress("contract", 0.5)
    assert this._progress is None
    this._errors._force_terminal = True
    this.progress("contract", 0.5)
    this.progress("contract", 1.0)
    assert this._progress is not None
    this.stop()
    assert this._progress is None


def test_plain_values():
    value = {1: (np.float64(1.5), np.int32(2), float("inf")), "a": np.array([[1, 2]]), "b": None}
    assert as_plain(value) == {"1": [1.5, 2, "inf"], "a": [[1, 2]], "b": None}


def test_values():
    assert values.parse_length("--max-error", "0.5") == (0.5, False)
    assert values.parse_length("--max-error", "50%") == (0.5, True)
    assert values.parse_ratio("--keep-ratio", "100%") == 1
    assert values.parse_removal_limit("4x", 0.5) == 2.0
    assert values.parse_removal_limit("inf", 0.5) == np.inf
    assert values.parse_or_off("--shape", "OFF", expected="a number") is None
    assert values.parse_or_off("--shape", "0.5", expected="a number") == 0.5
    assert values.parse_spacing("1, 2,0.5") == (1, 2, 0.5)
    for text in ("1,2", "1,2,0", "1,2,x", "1,2,inf"):
        with pytest.raises(OptionError):
            values.parse_spacing(text)


# --- processes of their own ----------------------------------------------------------------


def test_streams_and_exit_codes_of_a_process(mesh_path, tmp_path):
    done = run_apart("info", mesh_path, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["topology"]["genus"] == 1
    failed = run_apart("info", tmp_path / "no.ply")
    assert (failed.returncode, failed.stdout) == (1, "")
    assert failed.stderr == f"tetsimplify: there is no file {tmp_path / 'no.ply'}\n"
    assert run_apart("info").returncode == 2


def test_help_does_not_load_numba():
    code = (
        "import sys\nfrom tetsimplify.cli import main\nsys.argv = ['tetsimplify', '--help']\n"
        "try:\n    main()\nfinally:\n    assert 'numba' not in sys.modules\n"
        "    assert not {'pyvista', 'vtk', 'trimesh', 'matplotlib'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)


SLOW_WRITER = """
import sys, time
from tetsimplify.cli import main
from tetsimplify.io import MESH_FORMATS

def write(path, mesh):
    path.write_bytes(b"half")
    print("writing", flush=True)
    time.sleep(60)

MESH_FORMATS[".ply"] = MESH_FORMATS[".ply"]._replace(write=write)
main()
"""
SLOW_WORK = """
import sys, time
from tetsimplify import isosurface
from tetsimplify.cli import main

def extract_isosurface(*arguments, progress, **options):
    print("working", flush=True)
    for _ in range(6000):
        progress("isosurface", 0.5)
        time.sleep(0.01)

isosurface.extract_isosurface = extract_isosurface
main()
"""


@pytest.mark.skipif(os.name == "nt", reason="needs POSIX signals")
@pytest.mark.parametrize("exists", [True, False])
@pytest.mark.parametrize("code", [SLOW_WRITER, SLOW_WORK], ids=["writing", "working"])
@pytest.mark.parametrize(
    ("number", "exit_code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["int", "term"]
)
def test_interrupt_leaves_nothing_behind(volume_path, tmp_path, code, exists, number, exit_code):
    folder = tmp_path / "out"
    folder.mkdir()
    if exists:
        (folder / "a.ply").write_bytes(b"before")
    command = ["isosurface", volume_path, "--level", "0", "-o", folder / "a.ply"]
    process = subprocess.Popen(
        [sys.executable, "-c", code, *map(str, command)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    )
    assert process.stdout is not None
    assert process.stdout.readline() in ("writing\n", "working\n")
    time.sleep(0.2)
    process.send_signal(number)
    _, stderr = process.communicate(timeout=30)
    assert process.returncode == exit_code
    if number == signal.SIGINT:
        assert stderr == "tetsimplify: interrupted; no file was written\n"
    assert os.listdir(folder) == (["a.ply"] if exists else [])
    if exists:
        assert (folder / "a.ply").read_bytes() == b"before"
