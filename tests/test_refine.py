"""Finer lattices between the same samples, by trilinear interpolation."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from numpy.typing import NDArray

import models
from data import data_dir, needs_data
from tetsimplify import (
    Mesh,
    OptionError,
    VolumeError,
    extract_isosurface,
    march,
    surface_distance,
    topology,
)
from tetsimplify.lattices import LATTICES
from tetsimplify.sampling import Refined

every_lattice = pytest.mark.parametrize("lattice", LATTICES)


def trilinear(volume: NDArray, factor: int) -> NDArray:
    """The same samples and what lies between, point by point of the definition."""
    shape = [(n - 1) * factor + 1 for n in volume.shape]
    points = np.indices(shape).reshape(3, -1) / factor
    corner = np.minimum(points.astype(int), np.array(volume.shape)[:, None] - 2)
    part = points - corner
    values = np.zeros(points.shape[1])
    for offset in np.ndindex(2, 2, 2):
        at = corner + np.array(offset)[:, None]
        weights = np.prod(np.where(np.array(offset)[:, None] == 1, part, 1 - part), axis=0)
        values += weights * volume[tuple(at)]
    return values.reshape(shape)


@pytest.mark.parametrize("factor", [1, 2, 3, 5])
@pytest.mark.parametrize("at_once", [1, 2, 3, 7, 100])
def test_samples_are_trilinear_however_they_are_read(factor: int, at_once: int):
    volume = np.random.default_rng(0).normal(size=(4, 3, 5))
    refined = Refined(volume, factor)
    expected = trilinear(volume, factor)
    assert refined.shape == expected.shape
    blocks = [refined[k : k + at_once] for k in range(0, refined.shape[0], at_once)]
    np.testing.assert_allclose(np.concatenate(blocks), expected, atol=1e-14)
    samples = np.concatenate(blocks)[::factor, ::factor, ::factor]
    np.testing.assert_array_equal(samples, volume)


@pytest.mark.parametrize("factor", [2, 3])
def test_each_plane_is_read_once(factor: int):
    read = []

    class Watched:
        shape, dtype = (9, 4, 4), np.dtype(float)

        def __getitem__(self, planes: slice) -> NDArray:
            read.extend(range(planes.start, planes.stop))
            return np.zeros((planes.stop - planes.start, 4, 4))

    refined = Refined(Watched(), factor)
    for begin in range(0, refined.shape[0], 4):
        refined[begin : begin + 4]
    assert read == list(range(9))


@every_lattice
@pytest.mark.parametrize("closed", [False, True])
def test_surfaces_are_those_of_the_finer_volume(lattice: str, closed: bool):
    volume = np.random.default_rng(1).normal(size=(5, 6, 4))
    data = np.random.default_rng(2).normal(size=volume.shape)
    options = {"lattice": lattice, "closed": closed, "origin": (1, 2, 3)}
    mesh = extract_isosurface(
        volume, 0.1, refine=2, spacing=(2, 4, 6), vertex_data={"x": data}, **options
    )
    expected = extract_isosurface(
        trilinear(volume, 2),
        0.1,
        spacing=(1, 2, 3),
        vertex_data={"x": trilinear(data, 2)},
        **options,
    )
    np.testing.assert_array_equal(mesh.faces, expected.faces)
    np.testing.assert_allclose(mesh.vertices, expected.vertices, atol=1e-12)
    np.testing.assert_allclose(mesh.vertex_data["x"], expected.vertex_data["x"], atol=1e-12)
    assert topology(*mesh).is_manifold


def test_where_all_is_inside_what_lies_between_is_inside_too():
    volume = np.full((4, 4, 4), np.nextafter(0.1, 1))
    volume[1:3, 1:3, 1:3] = 0.3
    for factor in (2, 3, 7):
        assert len(extract_isosurface(volume, 0.1, refine=factor).faces) == 0


def test_the_number_of_blocks_does_not_matter(monkeypatch: pytest.MonkeyPatch):
    volume = models.gyroid(21).astype(np.float32)
    expected = extract_isosurface(volume, 0.2, refine=3, threads=1)
    monkeypatch.setattr(march, "BYTES_AT_ONCE", 8 * 61**2 * 7)
    for threads in (1, 3):
        other = extract_isosurface(volume, 0.2, refine=3, threads=threads)
        assert other.vertices.tobytes() == expected.vertices.tobytes()
        assert other.faces.tobytes() == expected.faces.tobytes()


def test_levels_are_chosen_by_the_samples_that_there_are():
    volume = np.random.default_rng(3).integers(0, 9, (6, 6, 6)).astype(np.uint8)
    fine, plain = (extract_isosurface(volume, "otsu", refine=k) for k in (2, 1))
    assert fine.level == plain.level


def test_the_finer_volume_is_never_whole_in_memory():
    volume = np.zeros((300, 60, 60), np.uint8)
    volume[100:110, 20:30, 20:30] = 1
    extract_isosurface(volume[:8], 0.5, refine=4)
    tracemalloc.start()
    mesh = extract_isosurface(volume, 0.5, refine=4)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert topology(*mesh).euler_characteristic == 2
    assert peak < 0.4 * 8 * 4**3 * volume.size


def test_wrong_samples_are_told_by_their_index():
    volume = np.zeros((4, 5, 6))
    volume[1, 2, 3] = np.nan
    with pytest.raises(VolumeError, match=r"volume must be finite, got nan at index \[1, 2, 3\]"):
        extract_isosurface(volume, 0.5, refine=2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"refine": 0}, "refine must be a positive integer, got 0"),
        ({"refine": 1.5}, "refine must be a positive integer, got 1.5"),
        ({"refine": True}, "refine must be a positive integer, got True"),
        ({"refine": 2, "lattice": "bcc", "centres": np.zeros((2, 2, 2))}, "refine is for samples"),
    ],
)
def test_wrong_options(options: dict, message: str):
    with pytest.raises(OptionError, match=message):
        extract_isosurface(np.zeros((3, 3, 3)), 0.5, **options)
    with pytest.raises(OptionError, match="refine is for samples alone"):
        extract_isosurface(lambda x, y, z: x, 0.5, bounds=[(0, 1)] * 3, shape=4, refine=2)


# ------------------------------------------------------------------------- how near it comes


def real(name: str, n: int = 40) -> tuple[NDArray, float]:
    """The middle of a volume, in units of its samples."""
    folder = data_dir()
    assert folder is not None
    with np.load(folder / "volumes" / f"{name}.npz") as file:
        data, level = file["data"], float(file["iso"])
    return data[tuple(slice(k // 2 - n // 2, k // 2 + n // 2) for k in data.shape)], level


@needs_data
@pytest.mark.parametrize("name", ["mni152_mri", "engine_ct", "cranium_ct"])
def test_half_a_voxel_of_the_trilinear_surface(name: str):
    """The surface of the trilinear function is that of ever finer cubes.

    With two cubes for one the largest distance is below half a sample both ways, with the samples
    alone it is not; the mean is small for both. A surface of scikit-image is no nearer.
    """
    measure = pytest.importorskip("skimage.measure")
    volume, level = real(name)
    true = extract_isosurface(volume, level, lattice="bcc", refine=4)
    theirs = measure.marching_cubes(volume.astype(np.float32), level)[:2]
    found = {
        refine: surface_distance(
            extract_isosurface(volume, level, lattice="bcc", refine=refine), true, tolerance=0.01
        )
        for refine in (1, 2)
    }
    mean = surface_distance(Mesh(*theirs), true, tolerance=0.01).mean
    assert found[2].upper < 0.5
    assert found[2].mean < 0.015
    assert found[1].upper < 0.7
    assert found[1].mean < 0.06
    assert found[2].mean < 0.4 * mean
    for one_way in (found[1].a_to_b, found[1].b_to_a):
        assert np.quantile(one_way.vertex_distances, 0.999) < 0.45
