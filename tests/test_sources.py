"""Where isosurfaces come from: arrays on disk, functions, levels that are found or several."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import models
from tetsimplify import Mesh, OptionError, VolumeError, extract_isosurface, march
from tetsimplify.lattices import LATTICES
from tetsimplify.levels import otsu_level

every_lattice = pytest.mark.parametrize("lattice", LATTICES)


def assert_same_bytes(one: Mesh, two: Mesh) -> None:
    assert one.vertices.tobytes() == two.vertices.tobytes()
    assert one.faces.tobytes() == two.faces.tobytes()


# ---------------------------------------------------------------------------- slices


class Slices:
    """A shape, a dtype, and slices along the first axis; it notes which planes were read."""

    def __init__(self, values: NDArray, chunk: int | None = None) -> None:
        self._values = values
        self.shape, self.dtype = values.shape, values.dtype
        self.chunks = None if chunk is None else (chunk, *values.shape[1:])
        self.read: list[tuple[int, int]] = []

    def __getitem__(self, planes: slice) -> NDArray:
        assert isinstance(planes, slice)
        self.read.append((planes.start, planes.stop))
        return self._values[planes]


def assert_read_once(volume: Slices) -> None:
    position = 0
    for begin, end in volume.read:
        assert begin == position
        position = end
    assert position == volume.shape[0]


@every_lattice
@pytest.mark.parametrize("dtype", ["uint8", "float32", "float64"])
def test_every_plane_is_read_once(lattice: str, dtype: str, monkeypatch: pytest.MonkeyPatch):
    values = (100 + 40 * models.gyroid(41)).astype(dtype)
    options = {"lattice": lattice, "vertex_normals": True, "vertex_data": {"itself": values}}
    expected = extract_isosurface(values, 101.5, **options)
    monkeypatch.setattr(march, "BYTES_AT_ONCE", 8 * 41**2 * 6)
    volume, field = Slices(values), Slices(values)
    mesh = extract_isosurface(volume, 101.5, **options | {"vertex_data": {"itself": field}})
    assert_same_bytes(mesh, expected)
    for name, array in expected.vertex_data.items():
        assert mesh.vertex_data[name].tobytes() == array.tobytes()
    most = 6 if dtype == "float64" else 12  # the others are held as float32
    for sliced in (volume, field):
        assert_read_once(sliced)
        assert max(end - begin for begin, end in sliced.read) <= most


def test_chunks_are_read_whole(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(march, "BYTES_AT_ONCE", 8 * 30**2 * 14)
    volume = Slices(models.gyroid(30), chunk=5)
    mesh = extract_isosurface(volume, 0.1)
    assert volume.read == [(0, 10), (10, 20), (20, 30)]
    assert_same_bytes(mesh, extract_isosurface(models.gyroid(30), 0.1))


@pytest.mark.parametrize("n_planes", range(2, 16))
@every_lattice
def test_blocks_of_any_size(n_planes: int, lattice: str, monkeypatch: pytest.MonkeyPatch):
    values = np.random.default_rng(n_planes).normal(size=(n_planes, 4, 5))
    expected = extract_isosurface(values, 0.1, lattice=lattice, vertex_normals=True)
    for at_once in (4, 5, 7):
        monkeypatch.setattr(march, "BYTES_AT_ONCE", 8 * 20 * at_once)
        mesh = extract_isosurface(Slices(values), 0.1, lattice=lattice, vertex_normals=True)
        assert_same_bytes(mesh, expected)
        np.testing.assert_array_equal(mesh.vertex_data["normals"], expected.vertex_data["normals"])


def test_arrays_of_other_packages(tmp_path: Path):
    values = (100 + 40 * models.gyroid(24)).astype(np.uint8)
    expected = extract_isosurface(values, 99.5)
    np.save(tmp_path / "a.npy", values)
    assert_same_bytes(extract_isosurface(np.load(tmp_path / "a.npy", "r"), 99.5), expected)
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        dataset = file.create_dataset("volume", data=values, chunks=(7, 8, 9))
        assert_same_bytes(extract_isosurface(dataset, 99.5), expected)


def test_zarr_arrays(tmp_path: Path):
    zarr = pytest.importorskip("zarr")
    values = (100 + 40 * models.gyroid(24)).astype(np.uint8)
    array = zarr.create_array(tmp_path / "a.zarr", shape=values.shape, chunks=(5,) * 3, dtype="u1")
    array[:] = values
    assert_same_bytes(extract_isosurface(array, 99.5), extract_isosurface(values, 99.5))


def test_dask_arrays():
    dask = pytest.importorskip("dask.array")
    values = models.gyroid(24)
    array = dask.from_array(values, chunks=(7, 9, 24))
    assert_same_bytes(extract_isosurface(array, 0.1), extract_isosurface(values, 0.1))


def test_slices_of_a_wrong_shape_are_refused():
    class Short(Slices):
        def __getitem__(self, planes: slice) -> NDArray:
            return super().__getitem__(planes)[:-1]

    with pytest.raises(VolumeError, match=r"volume\[0:9\] must have shape \(9, 9, 9\), got \(8,"):
        extract_isosurface(Short(models.ball(9)), 0.0)


# ---------------------------------------------------------------------------- larger than memory

LARGE = """
import resource, sys
import numpy as np
import tetsimplify

class OnDisk:
    dtype = np.dtype(np.uint8)
    shape = {shape}
    def __getitem__(self, planes):
        size = self.shape[1] * self.shape[2]
        count = (planes.stop - planes.start) * size
        flat = np.fromfile({path!r}, np.uint8, count, offset=planes.start * size)
        return flat.reshape(-1, *self.shape[1:])

def address_space():
    for line in open("/proc/self/status"):
        if line.startswith("VmSize"):
            return 1024 * int(line.split()[1])

def work(volume):
    mesh = tetsimplify.extract_isosurface(volume, 100.5, threads=1)
    result = tetsimplify.simplify(*mesh, max_edge_length=3.0)
    return mesh, result

work(np.random.default_rng(0).integers(0, 255, (8, 9, 10)).astype(np.uint8))  # loads the kernels
limit = {limit}
resource.setrlimit(resource.RLIMIT_AS, (address_space() + limit,) * 2)
if {whole}:
    np.fromfile({path!r}, np.uint8)
mesh, result = work(OnDisk())
np.savez({target!r}, *mesh, *result[:2])
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs limits of memory")
def test_a_volume_of_four_times_the_memory_allowed(tmp_path: Path):
    shape, limit = (1540, 512, 512), 96 * 2**20
    assert np.prod(shape) > 4 * limit
    path = tmp_path / "volume.raw"
    volume = np.memmap(path, np.uint8, "w+", shape=shape)
    x, y = np.ogrid[-25:25, -25:25]
    for z in range(20, 500):
        distance = np.hypot(x, y) - 4 - 2 * np.sin(z / 90)
        volume[z, 200:250, 300:350] = np.clip(100 - 8 * distance, 0, 255)
    volume.flush()

    names = {"shape": shape, "path": str(path), "target": str(tmp_path / "a.npz"), "limit": limit}
    run = [sys.executable, "-c", LARGE.format(**names, whole=False)]
    done = subprocess.run(run, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    whole = [sys.executable, "-c", LARGE.format(**names, whole=True)]
    failed = subprocess.run(whole, capture_output=True, text=True)
    assert "MemoryError" in failed.stderr, "the limit holds"

    mesh = extract_isosurface(volume, 100.5)
    with np.load(tmp_path / "a.npz") as found:
        vertices, faces, fewer_vertices, fewer_faces = found.values()
    assert len(faces) > 50_000
    assert_same_bytes(Mesh(vertices, faces), mesh)
    assert len(fewer_faces) < len(faces) / 4
    assert np.isfinite(fewer_vertices).all()


# ---------------------------------------------------------------------------- functions


def ball(x: NDArray, y: NDArray, z: NDArray) -> NDArray:
    return 1.0 - x**2 - y**2 - z**2


@every_lattice
def test_functions_are_sampled(lattice: str):
    bounds, shape = [(-2, 2), (-1.5, 1.5), (-1.25, 1.5)], (20, 21, 22)
    mesh = extract_isosurface(ball, 0.0, bounds=bounds, shape=shape, lattice=lattice)
    low, high = np.transpose(bounds)
    spacing = (high - low) / np.subtract(shape, 1)
    index = np.indices(shape)
    x, y, z = low[:, None, None, None] + spacing[:, None, None, None] * index
    options = {"spacing": spacing, "origin": low, "lattice": lattice}
    if lattice == "bcc":
        half = (
            part[:-1, :-1, :-1] + step / 2 for part, step in zip((x, y, z), spacing, strict=True)
        )
        options["centres"] = ball(*half)
    expected = extract_isosurface(ball(x, y, z), 0.0, **options)
    np.testing.assert_array_equal(mesh.faces, expected.faces)
    np.testing.assert_allclose(mesh.vertices, expected.vertices, atol=1e-12)
    assert len(mesh.faces) > 1000


def test_functions_are_called_with_a_few_planes(monkeypatch: pytest.MonkeyPatch):
    calls = []

    def noted(x: NDArray, y: NDArray, z: NDArray) -> NDArray:
        calls.append((x.shape, y.shape, z.shape))
        return ball(x, y, z)

    monkeypatch.setattr(march, "BYTES_AT_ONCE", 8 * 20**2 * 5)
    extract_isosurface(noted, 0.0, bounds=[(-2, 2)] * 3, shape=20)
    assert sum(shape[0] for shape, *_ in calls) == 20
    assert {call[1:] for call in calls} == {((1, 20, 1), (1, 1, 20))}
    assert max(call[0][0] for call in calls) <= 5


def test_functions_may_return_less_than_they_are_asked_for():
    mesh = extract_isosurface(lambda x, y, z: z, 0.3, bounds=[(0, 1)] * 3, shape=5)
    np.testing.assert_allclose(mesh.vertices[:, 2], 0.3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "a function needs bounds and shape"),
        ({"bounds": [(0, 1)] * 3}, "a function needs bounds and shape"),
        ({"bounds": [(0, 1)] * 2, "shape": 5}, "bounds must be three pairs"),
        ({"bounds": [(1, 0)] * 3, "shape": 5}, "bounds must be three pairs .* lower one first"),
        ({"bounds": "abc", "shape": 5}, "bounds must be three pairs"),
        ({"bounds": [(0, 1)] * 3, "shape": 1}, "shape must be one or three integers"),
        ({"bounds": [(0, 1)] * 3, "shape": (5, 5)}, "shape must be one or three integers"),
        ({"bounds": [(0, 1)] * 3, "shape": 5.0}, "shape must be one or three integers"),
        ({"bounds": [(0, 1)] * 3, "shape": 5, "spacing": (2, 2, 2)}, "instead of spacing"),
    ],
)
def test_wrong_bounds_and_shapes(options: dict, message: str):
    with pytest.raises(OptionError, match=message):
        extract_isosurface(ball, 0.0, **options)


def test_bounds_are_not_for_volumes():
    with pytest.raises(OptionError, match="bounds and shape are for functions"):
        extract_isosurface(models.ball(5), 0.0, bounds=[(0, 1)] * 3)


def test_functions_that_return_a_wrong_shape():
    with pytest.raises(VolumeError, match=r"broadcasts .* \(5, 5, 5\), got \(2,\)"):
        extract_isosurface(lambda x, y, z: np.zeros(2), 0.0, bounds=[(0, 1)] * 3, shape=5)


# ---------------------------------------------------------------------------- levels


def test_several_levels_give_several_surfaces():
    volume = models.gyroid(20)
    levels = [0.3, -0.2, 0.3]
    surfaces = extract_isosurface(volume, levels, lattice="five", closed=True)
    assert [surface.level for surface in surfaces] == levels
    for level, surface in zip(levels, surfaces, strict=True):
        assert_same_bytes(surface, extract_isosurface(volume, level, lattice="five", closed=True))
    assert extract_isosurface(volume, []) == []


def test_progress_over_several_levels_runs_to_one():
    done: list[float] = []
    extract_isosurface(
        models.ball(40), [0.1, 0.2], threads=1, progress=lambda _, part: done.append(part)
    )
    assert done == sorted(done)
    assert done[-1] == 1


def two_kinds(dtype: str) -> NDArray:
    rng = np.random.default_rng(0)
    values = np.where(models.ball(20) > 0, rng.normal(150, 10, (20,) * 3), rng.normal(60, 10, 20))
    return values.clip(0, 255).astype(dtype)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "int32", "float32", "float64"])
def test_otsu_is_that_of_scikit_image(dtype: str):
    filters = pytest.importorskip("skimage.filters")
    values = two_kinds(dtype)
    theirs = float(filters.threshold_otsu(values))
    width = 1.0 if values.dtype.itemsize <= 2 else float(np.ptp(values)) / 256
    assert otsu_level(values) == pytest.approx(theirs + width / 2, abs=0.51 * width)
    if values.dtype.itemsize <= 2:
        np.testing.assert_array_equal(values > otsu_level(values), values > theirs)


def test_otsu_parts_two_kinds():
    volume = two_kinds("uint8")
    surface = extract_isosurface(volume, "otsu")
    assert 65 < surface.level < 130
    assert_same_bytes(surface, extract_isosurface(volume, surface.level))
    assert otsu_level(models.ball(20) > 0) == 0.5


@pytest.mark.parametrize("seed", range(10))
def test_otsu_has_the_least_variance(seed: int):
    values = np.random.default_rng(seed).integers(0, 12, (4, 5, 6)).astype(np.uint8)

    def variance(level: float) -> float:
        parts = values[values < level], values[values > level]
        return sum(part.size * part.var() for part in parts if part.size)

    least = min(variance(level) for level in np.arange(0.5, 11))
    assert variance(otsu_level(values)) == pytest.approx(least)


@pytest.mark.parametrize(
    ("volume", "message"),
    [
        (np.ones((3, 3, 3)), "nothing to part, all samples are 1"),
        (np.full((3, 3, 3), np.nan), "volume must be finite"),
    ],
)
def test_otsu_of_what_has_no_classes(volume: NDArray, message: str):
    with pytest.raises(VolumeError, match=message):
        extract_isosurface(volume, "otsu")
