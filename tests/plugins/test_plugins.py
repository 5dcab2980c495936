"""What all plugins have in common."""

from __future__ import annotations

import doctest
import re
import subprocess
import sys

import numpy as np
import pytest

import tetsimplify
from test_docs import ROOT, examples

PLUGINS = ("open3d", "pymeshlab", "pyvista", "trimesh")
MODULES = sorted(path.stem for path in (ROOT / "plugins").glob("[!_]*.py"))


@pytest.fixture(params=PLUGINS)
def plugin(request):
    """The module of a plugin whose host is installed."""
    return pytest.importorskip(f"tetsimplify.plugins.{request.param}", exc_type=ImportError)


def name_of(plugin) -> str:
    return plugin.__name__.rpartition(".")[2]


def torus(plugin):
    """A torus as an object of the host."""
    x, y, z = np.mgrid[-1:1:24j, -1:1:24j, -1:1:24j]
    mesh = tetsimplify.extract_isosurface(0.3 - np.hypot(np.hypot(x, y) - 0.6, z), 0.0)
    return getattr(plugin, f"to_{name_of(plugin)}")(*mesh)


@pytest.mark.parametrize("name", PLUGINS)
def test_a_missing_host_names_the_extra(name, tmp_path):
    program = (
        f"import sys; sys.modules[{name!r}] = None\n"
        f"try: import tetsimplify.plugins.{name}\n"
        "except ImportError as error: print(error)"
    )
    command = [sys.executable, "-c", program]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert f'pip install "tetsimplify[{name}]"' in run.stdout, run.stderr


def test_the_core_takes_its_objects(plugin):
    mesh = torus(plugin)
    before = tetsimplify.topology(mesh)
    result = tetsimplify.simplify(mesh, max_edge_length=1.5)
    after = tetsimplify.topology(result)
    assert type(result) is type(mesh) and after.n_faces < before.n_faces / 2
    assert after.same_topology(before) and before.euler_characteristic == 0


def test_options_reach_the_core(plugin):
    _, report = plugin.simplify(
        torus(plugin), max_edge_length=1.5, placement="endpoint", return_report=True
    )
    assert report.options.placement == "endpoint"
    with pytest.raises(TypeError, match="nonsense"):
        plugin.simplify(torus(plugin), max_edge_length=1.5, nonsense=1)
    with pytest.raises(tetsimplify.OptionError, match="placement"):
        plugin.simplify(torus(plugin), max_edge_length=1.5, placement="nowhere")


@pytest.mark.parametrize(
    "target", [{"target_faces": 400}, {"keep_ratio": 0.2}, {"max_quadric_error": 0.05}]
)
def test_targets_reach_the_core(plugin, target):
    mesh = torus(plugin)
    before = tetsimplify.topology(mesh)
    result, report = plugin.simplify(mesh, **target, return_report=True)
    after = tetsimplify.topology(result)
    assert [report.stop] == list(target) and after.same_topology(before)
    wanted = target.get("target_faces", round(target.get("keep_ratio", 0) * before.n_faces))
    assert "max_quadric_error" in target or wanted <= after.n_faces <= wanted + 2
    assert tetsimplify.topology(tetsimplify.simplify(mesh, **target)).n_faces == after.n_faces


def test_the_page_shows_a_ratio(plugin):
    page = ROOT / "docs" / "plugins" / f"{name_of(plugin)}.md"
    assert re.search("keep_ratio=|targetperc=", examples(page))


def test_the_examples_on_the_page_run(plugin, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = ROOT / "docs" / "plugins" / f"{name_of(plugin)}.md"
    exec(compile(examples(page), str(page), "exec"), {"__name__": "example"})


@pytest.mark.parametrize("module", MODULES)
def test_doctests(module):
    found = pytest.importorskip(f"tetsimplify.plugins.{module}", exc_type=ImportError)
    result = doctest.testmod(found)
    assert not result.failed and (result.attempted or module not in PLUGINS)
