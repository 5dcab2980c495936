"""House rules: layering, lazy compilation, the cache key, style, types."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import tetsimplify

ROOT = Path(tetsimplify.__file__).parent
CHECKOUT = ROOT.parent
MODULES = sorted(ROOT.rglob("*.py"))

# Lower numbers may not import higher ones.
LAYERS = {"kernels": 0, "errors": 1, "mesh": 1, "cli": 9, "plugins": 9, "__main__": 10}
HOSTS = {"pymeshlab", "open3d", "trimesh", "pyvista", "vtk"}


def imports_of(path):
    """Dotted names that a file imports anywhere, those for type checking aside."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in {path}"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def layer_of(name):
    parts = name.split(".")
    return LAYERS.get(parts[1] if len(parts) > 1 else "", 5)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_downward(path):
    own = ".".join(["tetsimplify", *path.relative_to(ROOT).with_suffix("").parts])
    for name in imports_of(path):
        if name.split(".")[0] == "tetsimplify" and name != "tetsimplify":
            assert layer_of(name) <= layer_of(own), f"{own} imports {name}"
    if own.startswith("tetsimplify.kernels"):
        outside = {name.split(".")[0] for name in imports_of(path)} - {"tetsimplify", "__future__"}
        assert outside <= {"numpy", "numba", *sys.stdlib_module_names}


def loaded_by(statement):
    code = f"import sys; {statement}; print(*sorted({{m.split('.')[0] for m in sys.modules}}))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_import_loads_neither_numba_nor_a_host():
    loaded = loaded_by("import tetsimplify")
    assert "tetsimplify" in loaded
    assert not loaded & (HOSTS | {"numba", "typer", "rich"})


def test_functions_are_not_hidden_by_their_modules():
    """``tetsimplify.simplify`` is the function however its module is loaded first."""
    for name in ("simplify", "topology", "repair", "quality", "compare"):
        code = f"import tetsimplify.{name}; import tetsimplify; print(callable(tetsimplify.{name}))"
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert run.stdout.strip() == "True"


def test_every_kernel_is_cached_under_the_digest_of_all():
    from tetsimplify import kernels

    stamps = set()
    for path in sorted((ROOT / "kernels").glob("[!_]*.py")):
        module = getattr(kernels, path.stem)
        for value in vars(module).values():
            cache = getattr(value, "_cache", None)
            if cache is not None and getattr(value, "__module__", None) == module.__name__:
                stamps.add(cache._cache_file._source_stamp)
    assert stamps == {kernels.jit.KERNELS_DIGEST}


def test_there_is_no_kernel_module_of_another_name():
    from tetsimplify import kernels

    with pytest.raises(AttributeError, match="there is no kernel module 'nothing'"):
        kernels.nothing  # noqa: B018


def test_kernels_run_in_python_too():
    """By length and by error without compilation, as one steps through it."""
    code = (
        "import tetsimplify, numpy as np\n"
        "x, y, z = np.mgrid[-1:1:7j, -1:1:7j, -1:1:7j]\n"
        "mesh = tetsimplify.extract_isosurface(0.8 - np.sqrt(x**2 + y**2 + z**2), 0.0)\n"
        "for options in ({'max_edge_length': 0.4}, {'target_faces': 60}, {'target_faces': 16}):\n"
        "    result = tetsimplify.simplify(*mesh, **options)\n"
        "    print(len(mesh.faces), len(result.faces), f'{np.abs(result.vertices).sum():.3f}')\n"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-W", "ignore", "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "NUMBA_DISABLE_JIT": disabled},
        ).stdout
        for disabled in ("0", "1")
    }
    assert len(outputs) == 1


def test_public_names_are_documented():
    for name in tetsimplify.__all__:
        item = getattr(tetsimplify, name)
        assert item.__doc__, name
        if name == "hand_back_memory":  # which takes and gives nothing
            assert "Examples" in item.__doc__
        elif callable(item) and not isinstance(item, type):
            for section in ("Parameters", "Returns", "Raises", "Examples"):
                assert re.search(rf"^\s*{section}\n\s*-+", item.__doc__, re.M), (name, section)


def test_version_is_told():
    assert re.fullmatch(r"\d+\.\d+\.\d+", tetsimplify.__version__)


def in_checkout():
    return (CHECKOUT / "pyproject.toml").is_file()


@pytest.mark.skipif(not in_checkout(), reason="needs the checkout, this is an installed package")
@pytest.mark.parametrize("command", ["ruff check", "ruff format --check", "mypy"])
def test_style_and_types(command):
    pytest.importorskip(command.split()[0])
    run = subprocess.run(
        [sys.executable, "-m", *command.split()], cwd=CHECKOUT, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stdout + run.stderr
