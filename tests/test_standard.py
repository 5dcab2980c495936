"""The decimators behind one signature."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import meshes
import naive
import tetsimplify
from tetsimplify import MeshError, MissingExtraError, OptionError, standard
from tetsimplify.comparison.models import model, on_grid
from tetsimplify.decimators import method as method_module
from tetsimplify.decimators import pymeshlab as with_pymeshlab
from tetsimplify.edges import edge_lengths
from tetsimplify.standard import METHODS, Goal

ratio = 0.25
every_method = pytest.mark.parametrize(
    "name", [name for name, method in METHODS.items() if "faces" in method.takes]
)


@pytest.fixture(scope="module")
def tangle():
    return model("tangle", 2500)


def installed(name):
    method = METHODS[name]
    if method.version is None:
        pytest.skip(f"{name} is not installed: {method.install}")
    return method


@every_method
def test_every_method_does_what_its_record_says(name, tangle):
    method = installed(name)
    before = [array.copy() for array in tangle]
    goal = Goal(target_faces=round(ratio * len(tangle.faces)))
    vertices, faces = method.finish(method.run(method.prepare(tangle, goal), goal))
    assert np.asarray(vertices).dtype == method.precision or name.startswith("meshlib")
    assert all(np.array_equal(*pair) for pair in zip(before, tangle, strict=True))
    n_faces = len(standard.as_result(vertices, faces).faces)
    assert n_faces == pytest.approx(goal.target_faces, rel=0.01 if method.meets_count else 0.7)
    result = standard.simplify(*tangle, method=name, keep_ratio=ratio)
    assert len(result.faces) == n_faces
    assert (result.vertices.dtype, result.faces.dtype) == (np.float64, np.int32)
    assert np.array_equal(np.unique(result.faces), np.arange(len(result.vertices)))
    distance = tetsimplify.surface_distance(tangle, result)
    assert distance.upper < 0.1 * np.linalg.norm(np.ptp(tangle.vertices, axis=0))


@pytest.mark.parametrize("name", ["meshlib-error", "meshlib-length"])
def test_meshlib_is_single_whatever_type_it_returns(name, tangle):
    installed(name)
    result = standard.simplify(*tangle, method=name, target_faces=len(tangle.faces))
    assert np.array_equal(result.vertices, result.vertices.astype(np.float32))


@pytest.mark.parametrize("name", [name for name, m in METHODS.items() if "length" in m.takes])
def test_methods_by_length_leave_few_shorter_edges(name, tangle):
    installed(name)
    length = 1.2 * float(np.median(edge_lengths(tangle)))
    result = standard.simplify(*tangle, method=name, max_edge_length=length)
    n_before, n_after = ((edge_lengths(mesh) < length).sum() for mesh in (tangle, result))
    assert n_after < 0.02 * n_before
    assert len(result.faces) < 0.6 * len(tangle.faces)


def test_own_modes_are_those_of_simplify(tangle):
    ours = standard.simplify(*tangle, method="tetsimplify-quadric", target_faces=900)
    assert np.array_equal(ours.faces, tetsimplify.simplify(*tangle, target_faces=900).faces)
    options = {"max_edge_length": 0.2, "outer": "path"}
    ours = standard.simplify(*tangle, method="tetsimplify-length", **options)
    assert np.array_equal(ours.faces, tetsimplify.simplify(*tangle, **options).faces)
    held = standard.simplify(
        *tangle, method="tetsimplify-length", max_edge_length=0.2, blocked="skip"
    )
    assert len(held.faces) > len(ours.faces)


def test_the_standard_contraction_breaks_what_ours_keeps():
    torus = on_grid("torus", 53)
    options = {"max_edge_length": 0.49 * 3.4 / 52}
    broken = naive.summary(standard.simplify(*torus, method="standard", **options).faces)
    kept = naive.summary(standard.simplify(*torus, method="tetsimplify-length", **options).faces)
    assert dict(broken.edge_degrees)[4] > 50
    assert not broken.is_manifold
    assert kept.is_sound
    assert kept.components == ((0, 0),)


class Recorder:
    """Takes the place of a set of meshes, and keeps what a filter is given."""

    def __getattr__(self, name):
        def call(**parameters):
            self.called = name
            self.parameters = parameters

        return call


@pytest.mark.parametrize("name", [n for n, m in METHODS.items() if "pymeshlab" in m.packages])
def test_pymeshlab_is_given_all_parameters(name):
    pymeshlab = pytest.importorskip("pymeshlab")
    recorder = Recorder()
    prepared = (recorder, 0.1) if "remeshing" in name else recorder
    METHODS[name].run(prepared, Goal(target_faces=10))
    known = with_pymeshlab.prepare(tetsimplify.Mesh(*meshes.octahedron()), Goal())
    assert isinstance(known, pymeshlab.MeshSet)
    assert recorder.parameters.keys() == known.filter_parameter_values(recorder.called).keys()
    if "remeshing" not in name:
        assert recorder.parameters["autoclean"] is False
        assert recorder.parameters["preservetopology"] is (name == "pymeshlab-topology")


def test_records_are_complete():
    for name, method in METHODS.items():
        assert method.name == name
        assert method.title and method.licence and method.packages
        assert method.install == f"pip install {' '.join(method.packages)}"
        assert set(method.takes) <= {"faces", "length", "volume"} and method.takes
    titles = [method.title for method in METHODS.values()]
    assert len(set(titles)) == len(titles)
    assert {n for n, m in METHODS.items() if m.is_own} == {
        "tetsimplify-quadric",
        "tetsimplify-length",
        "tetsimplify-embedded",
        "tetsimplify-regularised",
        "standard",
    }
    assert [n for n, m in METHODS.items() if "faces" not in m.takes] == ["tetsimplify-regularised"]
    assert METHODS["meshlib-error"].licence == "non-commercial"


def test_results_are_checked():
    vertices = [[9, 9, 9], [0, 0, 0], [1, 0, 0], [8, 8, 8], [0, 1, 0]]
    result = standard.as_result(vertices, np.array([[1, 2, 4]], np.uint32))
    assert result.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert result.faces.tolist() == [[0, 1, 2]]
    with pytest.raises(MeshError, match="from 0 to 4"):
        standard.as_result(vertices, [[1, 2, 5]])
    with pytest.raises(MeshError, match="finite"):
        standard.as_result(np.full((3, 3), np.nan), [[0, 1, 2]])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "best", "keep_ratio": 0.5}, "there is no method best; there are tetsimplify-"),
        ({"method": "pyfqmr"}, "exactly one of keep_ratio"),
        ({"method": "pyfqmr", "keep_ratio": 0.5, "target_faces": 4}, "exactly one of keep_ratio"),
        ({"method": "pyfqmr", "keep_ratio": 0.0}, "keep_ratio must be above 0"),
        ({"method": "pyfqmr", "keep_ratio": True}, "keep_ratio must be above 0"),
        ({"method": "pyfqmr", "max_edge_length": 1.0}, "these do: tetsimplify-length, standard"),
        ({"method": "pyfqmr", "keep_ratio": 0.5, "outer": "path"}, "takes no options .* outer"),
        ({"method": "standard", "keep_ratio": 0.5, "outer": "none"}, "outer must be one of"),
    ],
)
def test_wrong_options_are_refused(options, message):
    with pytest.raises(OptionError, match=message):
        standard.simplify(*meshes.octahedron(), **options)


def test_absent_packages_are_named(monkeypatch):
    monkeypatch.setattr(method_module, "version_of", lambda package: None)
    assert METHODS["trimesh"].version is None
    with pytest.raises(MissingExtraError, match=r"trimesh and fast-simplification.*\[compare\]"):
        standard.simplify(*meshes.octahedron(), method="trimesh", keep_ratio=0.5)


def test_import_loads_no_decimator():
    code = "import sys, tetsimplify.compare; print(*{m.split('.')[0] for m in sys.modules})"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(run.stdout.split())
    assert "tetsimplify" in loaded
    hosts = {"meshoptimizer", "fast_simplification", "pyfqmr", "trimesh", "meshlib", "igl"}
    assert not loaded & (hosts | {"open3d", "pyvista", "vtk", "pymeshlab", "CGAL", "plotly"})
    assert not loaded & {"numba", "rich", "typer"}
