"""Regularised extraction beside simplification of the plain surface to as many faces."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import models
import tetsimplify.standard
from tetsimplify import OptionError
from tetsimplify.cli import app
from tetsimplify.compare import compare
from tetsimplify.comparison import inputs
from tetsimplify.comparison.tables import criterion_in_words
from tetsimplify.io import isosurface_of, read_volume

NAMES = ["tetsimplify-quadric", "tetsimplify-regularised"]


@pytest.fixture
def path(tmp_path):
    np.savez(tmp_path / "gyroid.npz", data=models.gyroid(24), spacing=[1.0, 2.0, 1.5])
    return tmp_path / "gyroid.npz"


@pytest.mark.parametrize("lattice", ["kuhn", "bcc"])
def test_others_get_as_many_faces_as_the_regularised_surface(path, tmp_path, lattice):
    options = {"methods": NAMES, "level": 0.1, "lattice": lattice, "repeats": 1}
    found = compare([path], regularised=True, output=tmp_path / "report", **options)
    volume = read_volume(path)
    plain = isosurface_of(volume, 0.1, lattice=lattice)
    expected = isosurface_of(volume, 0.1, lattice=lattice, regularise=True)
    assert found.results["inputs"][0]["n_faces"] == len(plain.faces)
    quadric, regular = found.runs
    for run in found.runs:
        assert run["status"] == "ok", run["message"]
        assert run["criterion"] == {"regularised": len(expected.faces)}
        assert run["target_faces"] == len(expected.faces)
        assert run["topology_kept"]
        assert run["distance"]["upper"] > 0
        assert run["seconds"]["median"] > 0
    assert regular["n_faces"] == len(expected.faces)
    assert abs(quadric["n_faces"] - len(expected.faces)) <= 2
    assert regular["message"].startswith("its time is that of extraction and all")
    assert quadric["message"] is None
    with np.load(tmp_path / "report" / regular["mesh"]) as arrays:
        np.testing.assert_array_equal(arrays["vertices"], expected.vertices)
        np.testing.assert_array_equal(arrays["faces"], expected.faces)
    if found.page is not None:
        assert "as regularised" in found.page.read_text()
    again = compare([path], regularised=True, output=tmp_path / "report", **options)
    assert again.runs == found.runs  # kept, not done again


def test_only_then_does_it_take_part(path):
    found = compare([path], keep_ratio=0.5, level=0.1, methods=["tetsimplify-length"], repeats=1)
    assert [run["method"] for run in found.runs] == ["tetsimplify-length"]
    for options in ({"keep_ratio": 0.5}, {"max_edge_length": 1.0}):
        with pytest.raises(OptionError, match="tetsimplify-regularised goes with regularised"):
            compare([path], methods=NAMES, level=0.1, **options)
    with pytest.raises(OptionError, match="either keep_ratio or max_edge_length or regularised"):
        compare([path], keep_ratio=0.5, regularised=True, level=0.1)


def test_all_methods_without_a_choice(path, monkeypatch):
    monkeypatch.setattr("tetsimplify.comparison.bench.run_apart", lambda *_: pytest.fail("no"))
    seen = []
    monkeypatch.setattr(
        "tetsimplify.comparison.bench.carry_out", lambda tasks, *_, **__: seen.append(tasks)
    )
    compare([path], keep_ratio=0.5, level=0.1)
    compare([path], regularised=True, level=0.1)
    by_ratio, regular = ([task.method.name for task in tasks] for tasks in seen)
    assert "tetsimplify-regularised" not in by_ratio
    assert "tetsimplify-regularised" in regular
    assert set(by_ratio) < set(regular)


@pytest.mark.parametrize("given", ["sphere:2000", "mesh"])
def test_what_is_no_volume_has_nothing_to_regularise(given):
    source = models.ball(8) if given == "mesh" else given
    if given == "mesh":
        source = tetsimplify.extract_isosurface(source, 0.0)
    with pytest.raises(OptionError, match="is no file of a volume"):
        compare([source], regularised=True, methods=NAMES)


def test_it_is_no_way_to_simplify_a_mesh():
    mesh = tetsimplify.extract_isosurface(models.ball(8), 0.0)
    with pytest.raises(OptionError, match="starts from a volume, not from a mesh"):
        tetsimplify.standard.simplify(*mesh, method="tetsimplify-regularised", keep_ratio=0.5)


def test_lattices_of_inputs(path):
    n_faces = [
        len(inputs.load([path], level=0.1, lattice=name)[0].mesh.faces) for name in ("kuhn", "bcc")
    ]
    assert n_faces[1] > 1.3 * n_faces[0]
    with pytest.raises(OptionError, match="lattice must be one of"):
        inputs.load([path], level=0.1, lattice="cubes")


def test_on_the_command_line(path):
    command = ["compare", str(path), "--level", "0.1", "--lattice", "bcc", "--regularised"]
    options = ["--methods", ",".join(NAMES), "--repeats", "1"]
    result = CliRunner().invoke(app, [*command, *options])
    assert result.exit_code == 0, result.output
    assert "faces of the regularised surface" in " ".join(result.stdout.split())
    assert all(name in result.stdout for name in NAMES)
    result = CliRunner().invoke(app, [*command, *options, "--json"])
    runs = json.loads(result.stdout)["runs"]
    assert runs[0]["target_faces"] == runs[1]["n_faces"]


def test_in_words():
    assert criterion_in_words({"regularised": 1234.0}) == (
        "cut to the 1,234 faces of the regularised surface"
    )
