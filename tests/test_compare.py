"""The comparative evaluation."""

from __future__ import annotations

import csv
import json
import math
import os
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import meshes
import misbehaving
import naive
import strategies
import tetsimplify
from data import data_dir, needs_data
from tetsimplify import FileError, Mesh, MeshError, OptionError
from tetsimplify.cli import app
from tetsimplify.compare import compare
from tetsimplify.comparison import inputs, measuring, models
from tetsimplify.comparison.table1 import ALGORITHMS, PAPER, rows_of, table1
from tetsimplify.decimators import METHODS
from tetsimplify.edges import edge_lengths
from tetsimplify.io import write_mesh

BALL = models.on_grid("sphere", 16)


def methods(*names):
    return [misbehaving.METHODS[name] for name in names]


@pytest.fixture(autouse=True)
def other_processes_find_the_tests(monkeypatch):
    here = str(Path(misbehaving.__file__).parent)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([here, *sys.path]))


def as_input(mesh, name="mesh"):
    return inputs.load({name: mesh})[0]


# --- the models ----------------------------------------------------------------------------

COMPONENTS = {
    "sphere": [[2, 0]],
    "torus": [[0, 0]],
    "hyperboloid": [[1, 1], [1, 1]],
    "tangle": [[-8, 0]],
}


@pytest.mark.parametrize("name", models.MODELS)
def test_models_have_their_topology_and_size(name):
    mesh = models.model(name, 4000)
    report = tetsimplify.topology(*mesh)
    assert report.is_manifold
    assert len(mesh.vertices) == pytest.approx(4000, rel=0.07)
    if name in COMPONENTS:
        assert report.components.tolist() == COMPONENTS[name]
    else:
        assert report.n_boundary_loops > 0


@pytest.mark.parametrize("name", models.MODELS)
def test_models_lie_on_their_surfaces(name):
    n_samples = 60
    vertices, faces = models.on_grid(name, n_samples)
    field, spacing = models.MODELS[name].field, models.spacing_of(name, n_samples)
    gradient = [
        (field(*(vertices + d).T) - field(*(vertices - d).T)) / 2e-4 for d in 1e-4 * np.eye(3)
    ]
    distances = np.abs(field(*vertices.T)) / np.linalg.norm(gradient, axis=0)
    assert np.quantile(distances, 0.99) < 0.2 * spacing
    corners = vertices[faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ji->i", outward, np.array(gradient)[:, faces[:, 0]]) < 0).mean() > 0.99


@pytest.mark.parametrize(
    ("name", "n", "message"),
    [
        ("cube", 1000, "there is no model 'cube'; there are sphere"),
        ("torus", 0, "positive integer"),
        ("torus", True, "positive integer"),
        ("torus", 12, "too few or too many"),
        ("torus", 10**9, "too few or too many"),
    ],
)
def test_wrong_models_are_refused(name, n, message):
    with pytest.raises(OptionError, match=message):
        models.model(name, n)


# --- the inputs ----------------------------------------------------------------------------


def test_inputs_of_all_kinds(tmp_path):
    write_mesh(tmp_path / "ball.ply", BALL)
    x, y, z = np.mgrid[-1:1:20j, -1:1:20j, -1:1:20j]
    np.savez(tmp_path / "volume.npz", data=0.8 - np.sqrt(x**2 + y**2 + z**2), spacing=[1, 1, 1])
    sources = [tmp_path / "ball.ply", str(tmp_path / "volume.npz"), "torus:2000", BALL, BALL]
    found = inputs.load(sources, level=0.1)
    assert [one.name for one in found] == ["ball", "volume", "torus-2000", "mesh", "mesh-2"]
    assert [one.kind for one in found] == ["mesh", "volume", "model", "mesh", "mesh"]
    assert [one.topology.euler_characteristic for one in found] == [2, 2, 0, 2, 2]
    assert found[0].digest == found[3].digest != found[2].digest
    assert found[0].median_edge == np.median(edge_lengths(BALL))


def test_broken_inputs_are_refused_or_repaired():
    pages = meshes.three_pages()
    with pytest.raises(MeshError, match=r"pages is no oriented manifold.*more than two faces"):
        inputs.load({"pages": pages})
    mended = inputs.load({"pages": pages}, repair=True)[0]
    assert mended.topology.is_manifold
    assert sum(mended.repairs.values()) > 0
    with pytest.raises(MeshError, match="has no faces"):
        inputs.load([([[0, 0, 0]], [])])


@pytest.mark.parametrize(
    ("sources", "options", "error", "message"),
    [
        ([], {}, OptionError, "at least one input"),
        (["nothing.ply"], {}, FileError, "there is no file"),
        (["cube"], {}, FileError, "neither a file of a known suffix nor a model"),
        (["torus:many"], {}, OptionError, "number of vertices"),
        ([3], {}, MeshError, "a pair of vertices and faces"),
        (["torus"], {"level": [1.0, 2.0]}, OptionError, "one for each of the 0; got 2"),
        (["a.npz"], {}, OptionError, "one for each of the 1; got 0"),
    ],
)
def test_wrong_inputs_are_refused(sources, options, error, message):
    with pytest.raises(error, match=message):
        inputs.load(sources, **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "either keep_ratio or max_edge_length or regularised"),
        (
            {"keep_ratio": 0.5, "max_edge_length": 1.0},
            "either keep_ratio or max_edge_length or regularised",
        ),
        ({"keep_ratio": [0.5, 2.0]}, "keep_ratio must be above 0 and at most 1, got 2"),
        ({"keep_ratio": []}, "at least one"),
        ({"max_edge_length": "wide"}, "a percentage of the median edge"),
        ({"max_edge_length": -1.0}, "positive length"),
        ({"keep_ratio": 0.5, "methods": ["magic"]}, "there is no method magic"),
        ({"keep_ratio": 0.5, "repeats": 0}, "repeats must be a positive integer"),
        ({"keep_ratio": 0.5, "time_limit": 0}, "time_limit must be a positive number"),
        ({"keep_ratio": 0.5, "tolerance": math.nan}, "tolerance must be a positive number"),
        ({"keep_ratio": 0.5, "clock": "sun"}, "clock must be one of wall, cpu"),
    ],
)
def test_wrong_options_are_refused_before_any_work(options, message, tmp_path):
    with pytest.raises(OptionError, match=message):
        compare([tmp_path / "not read.ply"], output=tmp_path / "report", **options)
    assert not (tmp_path / "report").exists()


# --- the figures, beside slow ones -----------------------------------------------------------


def slow_violating_edges(faces, has_boundary):
    at_edge = naive.faces_at_edges(t for t in naive.as_triangles(faces) if len(set(t)) == 3)
    allowed = {1, 2} if has_boundary else {2}
    return sorted(edge for edge, around in at_edge.items() if len(around) not in allowed)


def check_topology(before, after):
    """All that is told of the topology of a result, by sets and dictionaries."""
    reference = measuring.Reference(as_input(before))
    result = Mesh(*meshes.compacted(*after)) if len(after[1]) else None
    assert result is not None
    result = Mesh(result.vertices, result.faces.astype(np.int32))
    told = reference._topology(result)
    was, found = naive.summary(before[1]), naive.summary(result.faces)
    slow = slow_violating_edges(result.faces, not was.is_closed)
    assert told["edge_degrees"] == {str(k): n for k, n in found.edge_degrees}
    assert told["euler_characteristic"] == found.euler_characteristic
    assert told["n_components"] == found.n_components
    if not found.non_manifold_vertices:  # else it is open what a loop is
        assert told["n_boundary_loops"] == found.n_boundary_loops
    assert told["n_nonmanifold_vertices"] == len(found.non_manifold_vertices)
    assert told["n_duplicate_faces"] == found.n_duplicate_faces
    assert told["n_violating_edges"] == len(slow)
    places = [[*result.vertices[p], *result.vertices[q]] for p, q in slow]
    assert told["violating_edges"] == places[: measuring.MOST_EDGES]
    kept = found.is_sound and found.components == was.components
    assert told["topology_kept"] == kept
    assert (told["why_not"] == []) == kept
    return told


@settings(deadline=None, max_examples=60)
@given(strategies.surfaces(), st.integers(0, 2**16), st.integers(1, 12))
def test_the_verdict_of_broken_surfaces(mesh, seed, n_broken):
    """Vertices are identified at random, and faces dropped: anything can come of it."""
    rng = np.random.default_rng(seed)
    faces = mesh[1].copy()
    for _ in range(n_broken):
        p, q = rng.choice(faces.reshape(-1), 2)
        faces[faces == p] = q
    faces = faces[rng.random(len(faces)) > 0.05 * rng.integers(0, 3)]
    if len(faces):
        check_topology(mesh, (mesh[0], faces))


@settings(deadline=None, max_examples=40)
@given(strategies.surfaces(), st.floats(0.05, 0.9), st.sampled_from(["contract", "violate"]))
def test_the_verdict_of_contractions(mesh, ratio, blocked):
    result = tetsimplify.simplify(
        *mesh, keep_ratio=ratio, cost="length", blocked=blocked, foldover=None
    )
    if len(result.faces):
        told = check_topology(mesh, (result.vertices, result.faces))
        assert told["topology_kept"] or blocked == "violate"


def phrases(before, after):
    return measuring.differences(tetsimplify.topology(*before), tetsimplify.topology(*after))


def test_what_was_broken_is_said():
    ball, pages = meshes.octahedron(), meshes.three_pages()
    assert phrases(ball, ball) == []
    assert phrases(ball, pages)[:2] == ["6 edges of degree 1", "1 edge of degree 3"]
    assert "6 edges of degree 1" not in phrases(meshes.triangle(), pages)
    assert phrases(ball, meshes.torus(4, 5)) == ["Euler characteristic 2 -> 0"]
    assert "1 non-manifold vertex" in phrases(meshes.triangle(), meshes.bow_tie())
    assert "1 face with a vertex twice" in phrases(meshes.triangle(), meshes.collapsed_face())
    assert "1 duplicate face" in phrases(ball, meshes.double_covered_triangle())
    spheres = meshes.disjoint_union(meshes.torus(4, 5), ball, ball)
    others = meshes.disjoint_union(meshes.two_tori_on_a_neck(), ball, ball, ball)
    assert phrases(others, others) == []
    assert "components 3 -> 4" in phrases(spheres, others)


def test_components_count_one_by_one():
    torus, ball = meshes.torus(4, 5), meshes.octahedron()
    double = meshes.two_tori_on_a_neck()
    before = meshes.disjoint_union(torus, torus)
    after = meshes.disjoint_union(double, ball)
    assert phrases(before, after) == ["Euler characteristics of the components"]


def measured(before, after, **options):
    options = {"short_length": 0.5, "tolerance": 1e-4} | options
    result = Mesh(np.asarray(after[0], float), np.asarray(after[1], np.int32))
    return measuring.Reference(as_input(before)).measure(result, **options)


def test_the_figures_of_a_sphere():
    told = measured(BALL, (1.1 * BALL.vertices, BALL.faces))
    assert told["volume_change"] == pytest.approx(1.1**3 - 1)
    assert told["area_change"] == pytest.approx(1.1**2 - 1)
    assert told["distance"]["lower"] <= 0.1 <= told["distance"]["upper"] * 1.001
    assert told["distance"]["mean"] == pytest.approx(0.1, rel=0.03)
    assert told["topology_kept"] and told["n_flipped_faces"] == 0
    lengths = 1.1 * edge_lengths(BALL)
    assert told["shortest_edge"] == pytest.approx(lengths.min())
    assert measured(BALL, BALL, short_length=0.1)["n_short_edges"] == (lengths < 0.11).sum()
    assert sum(told["quality"]["histogram"]["counts"]) == len(BALL.faces)
    assert len(told["quality"]["histogram"]["edges"]) == measuring.HISTOGRAM_BINS + 1
    inside_out = measured(BALL, (BALL.vertices, BALL.faces[:, ::-1]))
    assert inside_out["n_flipped_faces"] == len(BALL.faces)
    assert inside_out["volume_change"] == pytest.approx(-2)


def test_faces_that_are_folded_over_count_as_flipped():
    before = meshes.grid(4, 4)
    flat = (before[0] * [1, 1, 0], before[1])
    after = flat[0].copy()
    inner = int(np.bincount(before[1].reshape(-1)).argmax())
    after[inner] += [1.7, 0, 0]
    corners = after[flat[1]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    up = np.sign(np.median(normals))
    told = measured(flat, (after, flat[1]))
    assert told["n_flipped_faces"] == (up * normals < 0).sum() > 0
    assert told["n_self_intersections"] > 0
    assert told["volume_change"] is None


def test_violating_edges_are_limited():
    many = measuring.MOST_EDGES + 10
    vertices = np.random.default_rng(0).random((3 * many, 3))
    told = measured(BALL, (vertices, np.arange(3 * many).reshape(-1, 3)))
    assert told["n_violating_edges"] == 3 * many
    assert len(told["violating_edges"]) == measuring.MOST_EDGES


# --- runs in processes of their own --------------------------------------------------------


def statuses(found):
    return {run["method"]: run["status"] for run in found.runs}


def test_whatever_happens_is_a_row():
    names = ("crash", "leave", "raise", "nothing", "all", "nan", "index", "chatty", "absent")
    found = compare([BALL], methods=methods(*names), keep_ratio=0.5, repeats=1)
    assert statuses(found) == {
        "crash": "crashed",
        "leave": "crashed",
        "raise": "error",
        "nothing": "wrong count",
        "all": "error",
        "nan": "error",
        "index": "error",
        "chatty": "ok",
    }
    messages = {run["method"]: run["message"] for run in found.runs}
    assert "SIGABRT" in messages["crash"] or sys.platform == "win32"
    assert messages["leave"] == "exit code 7"
    assert messages["raise"] == "ValueError: no such mesh"
    assert messages["all"] == "no face is left"
    assert messages["nan"].startswith("MeshError: vertices must be finite")
    assert [one["method"] for one in found.results["absent"]] == ["absent"]
    assert found.results["absent"][0]["install"] == "pip install no-such-package"
    for run in found.runs:
        has_mesh = run["status"] in ("ok", "wrong count")
        assert ("edge_degrees" in run) == ("mesh" in run) == has_mesh
    json.dumps(found.results, allow_nan=False)


def test_a_hang_is_stopped():
    found = compare([BALL], methods=methods("hang"), keep_ratio=0.5, time_limit=1.5)
    assert statuses(found) == {"hang": "timeout"}
    assert found.runs[0]["message"] == "stopped after 1.5 s"


def test_conversions_do_not_count():
    found = compare([BALL], methods=methods("slow"), keep_ratio=0.5, repeats=2)
    run = found.runs[0]
    assert run["seconds"] == run["clocks"]["wall"]
    assert run["seconds"]["max"] < misbehaving.PAUSE
    assert len(run["seconds"]["all"]) == 2
    assert run["seconds"]["min"] <= run["seconds"]["median"] <= run["seconds"]["max"]


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="memory: only on Linux")
def test_memory_is_that_of_the_run_alone():
    found = compare([BALL], methods=methods("memory", "slow"), keep_ratio=0.5, repeats=1)
    memory = {run["method"]: run["peak_memory_bytes"] for run in found.runs}
    assert 0.9 * misbehaving.BLOCK < memory["memory"] < 1.3 * misbehaving.BLOCK
    assert memory["slow"] < 0.2 * misbehaving.BLOCK


def test_runs_are_warm_and_kept(tmp_path, monkeypatch):
    calls = tmp_path / "calls.txt"
    monkeypatch.setenv(misbehaving.CALLS, str(calls))
    report = tmp_path / "new" / "report"

    def n_calls(**options):
        before = len(calls.read_text().split()) if calls.exists() else 0
        given = {"methods": methods("count", "raise"), "keep_ratio": 0.5, "output": report}
        found = compare([BALL], **(given | {"repeats": 2} | options))
        return len(calls.read_text().split()) - before, found

    n_first, first = n_calls()
    assert n_first == 4  # warm-up, one that does not count, two that do
    assert calls.read_text().split()[0] == "warm-up"
    n_second, second = n_calls()
    assert n_second == 0
    assert second.runs[0] == first.runs[0]
    n_third, third = n_calls(clock="cpu")
    assert n_third == 0
    assert third.runs[0]["seconds"] == first.runs[0]["clocks"]["cpu"]
    assert statuses(second) == {"count": "ok", "raise": "error"}
    assert n_calls(repeats=1)[0] == 3
    assert n_calls(keep_ratio=[0.5, 0.4])[0] == 4  # the new one alone
    assert n_calls()[0] == 0
    (report / first.runs[0]["mesh"]).unlink()
    assert n_calls()[0] == 4


def test_finished_runs_outlive_an_interruption(tmp_path):
    def interrupt(stage, done):
        if "nothing" in stage:
            raise KeyboardInterrupt

    names = ("count", "nothing")
    with pytest.raises(KeyboardInterrupt):
        compare(
            [BALL], methods=methods(*names), keep_ratio=0.5, output=tmp_path, progress=interrupt
        )
    assert len(list((tmp_path / "runs").iterdir())) == 1
    assert not (tmp_path / "results.json").exists()


def test_the_report_is_whole(tmp_path):
    stages = []
    found = compare(
        {"ball": BALL, "a/b": meshes.octahedron()},
        methods=methods("chatty", "nothing", "raise"),
        keep_ratio=[0.5, 0.25],
        repeats=1,
        output=tmp_path,
        progress=lambda stage, done: stages.append((stage, done)),
    )
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["runs"] == json.loads(json.dumps(found.runs))
    assert len(told["runs"]) == 12
    assert {"version", "created", "machine", "inputs", "absent", "runs"} <= told.keys()
    with (tmp_path / "results.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["method"] for row in rows] == [run["method"] for run in told["runs"]]
    assert float(rows[0]["distance.upper"]) == told["runs"][0]["distance"]["upper"]
    assert "violating_edges" not in rows[0]
    for entry in (*told["inputs"], *told["runs"]):
        if entry.get("status") == "error":
            continue
        with np.load(tmp_path / entry["mesh"]) as arrays:
            report = tetsimplify.topology(arrays["vertices"], arrays["faces"])
        assert (report.n_vertices, report.n_faces) == (entry["n_vertices"], entry["n_faces"])
    assert stages[0] == ("ball, 50 %: chatty", 0.0)
    assert [done for _, done in stages] == sorted(done for _, done in stages)
    assert found.page is None or found.page.is_file()
    assert (found.page is None) == bool(found.notes)


def test_by_length_others_get_the_number_of_faces():
    both = [METHODS["tetsimplify-length"], *methods("chatty")]
    found = compare([BALL], methods=both, max_edge_length="130%", repeats=1)
    length, other = found.runs
    asked = 1.3 * float(np.median(edge_lengths(BALL)))
    assert length["criterion"] == {"max_edge_length": asked}
    ours = tetsimplify.simplify(*BALL, max_edge_length=asked)
    assert length["n_faces"] == len(ours.faces)
    assert length["target_faces"] is length["message"] is None
    assert other["target_faces"] == other["n_faces"] == len(ours.faces)
    assert other["message"] == f"asked for the {len(ours.faces):,} faces of tetsimplify-length"
    assert length["short_length"] == other["short_length"] == asked
    assert length["n_short_edges"] == len(ours.report.remaining_edges)


# --- table 1 -------------------------------------------------------------------------------


def test_table_1(tmp_path):
    found = table1(output=tmp_path, repeats=1)
    rows = list(rows_of(found.results))
    assert len(rows) == len(PAPER) == len(found.runs) == 4
    inputs_by_name = {one["name"]: one for one in found.results["inputs"]}
    for run, paper in rows:
        assert run["status"] == "ok"
        assert inputs_by_name[run["input"]]["n_faces"] == pytest.approx(paper["n_faces"], rel=0.01)
        assert run["n_faces"] == pytest.approx(paper["n_faces_after"], rel=0.03)
        assert run["topology_kept"] == (run["method"] == ALGORITHMS["improved"].name)
        assert (run["n_violating_edges"] > 50) == (run["method"] == "standard")
        with np.load(tmp_path / run["mesh"]) as arrays:
            slow = naive.summary(arrays["faces"])
        assert run["edge_degrees"] == {str(k): n for k, n in slow.edge_degrees}
        assert run["euler_characteristic"] == slow.euler_characteristic
        assert run["topology_kept"] == slow.is_sound
    assert json.loads((tmp_path / "results.json").read_text())["table1"]["inferred"]


# --- the command ---------------------------------------------------------------------------


def run(*arguments, exit_code=0):
    result = CliRunner().invoke(app, ["compare", *map(str, arguments)])
    assert result.exit_code == exit_code, result.output
    return result


def test_command_prints_tables(tmp_path):
    given = ["torus:1500", "--methods", "standard", "--repeats", 1, "-o", tmp_path / "report"]
    told = run(*given, "--keep-ratio", "50%").stdout
    assert "cut to 50 %" in told and "standard" in told
    assert "results.csv" in told.replace("\n", "")
    as_json = json.loads(run(*given, "--keep-ratio", "50%", "--json").stdout)
    assert [run["method"] for run in as_json["runs"]] == ["standard"]
    assert "edges below" in run(*given, "--max-edge-length", "150%").stdout


def test_command_lists_methods():
    told = run("--list").stdout
    assert all(name in told for name in METHODS)
    assert "pip install" in run("--list", "--json").stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give at least one input"),
        (["torus:1500"], "either keep_ratio or max_edge_length or regularised"),
        (["torus:1500", "--keep-ratio", "a lot"], "--keep-ratio must be"),
        (["torus:1500", "--max-edge-length", "1,x"], "--max-edge-length must be"),
        (["torus:1500", "--keep-ratio", "0.5", "--methods", "x"], "there is no method x"),
        (["torus:1500", "--table1"], "--table1 has its own inputs"),
        (["torus:1500", "--keep-ratio", "0.5", "--tolerance", "1"], "--tolerance must be"),
    ],
)
def test_wrong_usage(arguments, message):
    assert message in run(*arguments, exit_code=2).stderr


# --- violations that are found --------------------------------------------------------------


@pytest.mark.slow
@needs_data
def test_a_real_mesh_and_a_real_volume(tmp_path):
    folder = data_dir()
    found = compare(
        [folder / "meshes" / "nefertiti.ply", folder / "volumes" / "mni152_mri.npz"],
        level=80.5,
        keep_ratio=0.15,
        repeats=1,
        output=tmp_path,
    )
    by_input = defaultdict(list)
    for each in found.runs:
        assert each["status"] in ("ok", "wrong count"), each["message"]
        by_input[each["input"]].append(each)
        ours = METHODS[each["method"]].is_own and each["method"] != "standard"
        assert each["topology_kept"] or not ours
    assert len(by_input["mni152_mri"]) >= 8
    assert any(each["n_violating_edges"] for each in by_input["mni152_mri"])
