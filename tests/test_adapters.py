"""How adapters are found, without importing what they adapt."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import EntryPoint

import numpy as np
import pytest

import tetsimplify
from test_docs import ROOT, examples
from tetsimplify import MeshError, MissingExtraError, OptionError, adapters

HOSTS = ("open3d", "pymeshlab", "pyvista", "trimesh", "vtk", "vtkmodules")


class Mesh:
    """A mesh of some package: what it is given is what it is."""

    def __init__(self, *arrays) -> None:
        self.arrays = arrays


class SpecialMesh(Mesh):
    """The same, by a subclass."""


ADAPTER = adapters.Adapter(
    "test_adapters",
    simplify=lambda mesh, **options: Mesh(*tetsimplify.simplify(*mesh.arrays, **options)[:2]),
    topology=lambda mesh: tetsimplify.topology(*mesh.arrays),
)

TRIANGLE = (np.eye(3), [[0, 1, 2]])


@pytest.fixture
def installed(monkeypatch):
    """One adapter, for the classes of this file."""
    package = Mesh.__module__.partition(".")[0]
    entries = {package: EntryPoint(package, f"{Mesh.__module__}:ADAPTER", adapters.GROUP)}
    monkeypatch.setattr(adapters, "_installed", lambda: entries)
    monkeypatch.setitem(sys.modules, Mesh.__module__, sys.modules[__name__])


@pytest.mark.parametrize("kind", [Mesh, SpecialMesh])
def test_objects_are_known_by_the_package_of_their_class_or_a_base(installed, kind):
    assert adapters.find(kind()) is ADAPTER
    assert tetsimplify.topology(kind(*TRIANGLE)).edge_degrees == {1: 3}
    result = tetsimplify.simplify(kind(*TRIANGLE), max_edge_length=0.5)
    assert isinstance(result, Mesh)
    np.testing.assert_array_equal(result.arrays[0], np.eye(3))


@pytest.mark.parametrize("thing", [3, "mesh.ply", np.eye(3), None])
def test_an_unknown_object_is_refused_with_the_names_of_the_installed(installed, thing):
    with pytest.raises(MeshError, match="no faces") as caught:
        tetsimplify.simplify(thing, max_edge_length=1)
    assert isinstance(caught.value, TypeError)
    assert adapters.names()[0] in str(caught.value)
    assert type(thing).__name__ in str(caught.value)
    with pytest.raises(MeshError, match="no faces"):
        tetsimplify.topology(thing)


@pytest.mark.parametrize("option", ["vertex_data", "face_data"])
def test_data_go_with_arrays_only(installed, option):
    with pytest.raises(OptionError, match="carries its own"):
        adapters.simplify(Mesh(*TRIANGLE), max_edge_length=1, **{option: {"a": [1, 2, 3]}})


def test_a_missing_package_names_the_extra():
    with (
        pytest.raises(MissingExtraError, match=r'pip install "tetsimplify\[some_host\]"'),
        adapters.needs("some_host"),
    ):
        import some_host  # noqa: F401
    with pytest.raises(ModuleNotFoundError) as caught, adapters.needs("some_host"):
        import something_that_the_host_needs  # noqa: F401
    assert not isinstance(caught.value, MissingExtraError)


def test_importing_and_asking_imports_no_host():
    program = (
        "import sys, tetsimplify, tetsimplify.adapters as adapters\n"
        "adapters.names()\n"
        "try: adapters.find(object())\n"
        "except tetsimplify.MeshError: pass\n"
        f"print([name for name in {HOSTS} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


def test_the_plugins_are_installed():
    assert {"open3d", "pymeshlab", "pyvista", "trimesh"} <= set(adapters.names())


def test_the_page_on_writing_an_adapter_is_true():
    page = ROOT / "docs" / "plugins" / "writing-an-adapter.md"
    exec(compile(examples(page), str(page), "exec"), {"__name__": "example"})
