"""Interfaces between labels: each label's surface is a manifold, and all of them fit together."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from numpy.typing import NDArray

import meshes
import models
import naive
from data import data_dir, needs_data
from tetsimplify import OptionError, VolumeError, extract_isosurface, march, topology
from tetsimplify.interfaces import Interfaces, extract_interfaces, interface_tables


def random_labels(seed: int) -> NDArray:
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 7, 3))
    return rng.integers(0, rng.integers(2, 7), shape).astype(rng.choice(["u1", "i4", ">i8"]))


def check(volume: NDArray, closed: bool) -> None:
    found = extract_interfaces(volume, closed=closed)
    around = np.pad(volume, 1) if closed else volume
    assert (found.face_labels[:, 0] > found.face_labels[:, 1]).all()
    assert len(np.unique(found.faces)) == len(found.vertices)
    for label in np.unique(around):
        surface = found.surface(label)
        alone = extract_isosurface((around == label).astype(float), 0.5)
        ours, expected = naive.summary(surface.faces), naive.summary(alone.faces)
        assert ours.is_sound
        assert ours.components == expected.components
        assert ours.n_boundary_loops == expected.n_boundary_loops
    if closed and len(found.faces):
        assert sum_of_volumes(found) == pytest.approx(0, abs=1e-9)
    assert models.areas(found.vertices, found.faces).min(initial=1) > 0.01


def sum_of_volumes(found: Interfaces) -> float:
    """The background has the volume of all others, inside out."""
    return sum(models.signed_volume(*found.surface(label)) for label in found.labels)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("seed", range(60))
def test_random_labels(seed: int, closed: bool):
    check(random_labels(seed), closed)


@pytest.mark.slow
@pytest.mark.parametrize("hundred", range(30))
def test_random_labels_at_length(hundred: int):
    for seed in range(100 * hundred, 100 * hundred + 100):
        for closed in (False, True):
            check(random_labels(seed), closed)


@pytest.mark.parametrize("seed", range(20))
def test_faces_at_edges_are_as_many_as_labels_around(seed: int):
    volume = np.random.default_rng(seed).integers(0, 4, (4, 5, 6))
    found = extract_interfaces(volume)
    sharing = naive.faces_at_edges(naive.as_triangles(found.faces))
    for faces in sharing.values():
        labels = Counter(found.face_labels[list(faces)].ravel().tolist())
        assert len(faces) in (2, 3)
        assert len(labels) == len(faces)
        assert set(labels.values()) == {2}


def test_two_labels_are_an_isosurface():
    volume = models.gyroid(16) > 0.1
    found = extract_interfaces(volume, closed=False)
    mesh = extract_isosurface(volume, 0.5)
    np.testing.assert_array_equal(found.vertices, mesh.vertices)
    assert len(found.faces) == len(mesh.faces)  # squares may be cut along the other diagonal
    areas = [models.areas(*surface[:2]).sum() for surface in (found, mesh)]
    assert areas[0] == pytest.approx(areas[1], rel=0.01)
    assert (found.face_labels == (1, 0)).all()


def test_normals_point_away_from_each_label():
    volume = np.zeros((8, 8, 9), np.uint8)
    volume[2:6, 2:6, 1:4], volume[2:6, 2:6, 4:8] = 3, 7
    found = extract_interfaces(volume, spacing=(1, 2, 3), origin=(5, 5, 5))
    for label in (3, 7):
        surface = found.surface(label)
        assert topology(*surface).euler_characteristic == 2
        n_samples = (volume == label).sum()
        # a box with its edges and corners cut off
        content = models.signed_volume(*surface)
        assert 0.75 * 6 * n_samples < content < 6 * n_samples
    wall = found.face_labels == (7, 3)
    assert wall.all(axis=1).sum() > 10
    assert found.labels.tolist() == [0, 3, 7]


def test_neighbours_share_their_vertices():
    volume = np.random.default_rng(0).integers(0, 3, (6, 6, 6))
    found = extract_interfaces(volume)
    shared = found.faces[(found.face_labels == (2, 1)).all(axis=1)]
    corners = {tuple(v) for v in found.vertices[shared].reshape(-1, 3).tolist()}
    for label in (1, 2):
        assert corners <= {tuple(v) for v in found.surface(label).vertices.tolist()}


def test_labels_that_are_not_wanted_are_background():
    volume = np.random.default_rng(1).integers(0, 6, (6, 7, 8))
    found = extract_interfaces(volume, [2, 5])
    expected = extract_interfaces(np.where(np.isin(volume, [2, 5]), volume, 0))
    np.testing.assert_array_equal(found.faces, expected.faces)
    assert found.labels.tolist() == [0, 2, 5]
    assert len(extract_interfaces(volume, []).faces) == 0


def test_closed_surfaces_end_half_a_sample_outside():
    mesh = extract_interfaces(np.ones((3, 4, 5), int)).surface(1)
    np.testing.assert_array_equal(mesh.vertices.min(axis=0), -0.5)
    np.testing.assert_array_equal(mesh.vertices.max(axis=0), [2.5, 3.5, 4.5])
    assert not meshes.boundary_edges(mesh.faces)
    assert len(extract_interfaces(np.ones((3, 4, 5), int), closed=False).faces) == 0


def test_the_number_of_threads_and_blocks_does_not_matter(monkeypatch: pytest.MonkeyPatch):
    volume = (models.gyroid(30) * 2).astype(int)
    expected = extract_interfaces(volume, threads=1)
    monkeypatch.setattr(march, "BYTES_AT_ONCE", 1)
    monkeypatch.setattr("tetsimplify.interfaces.BYTES_AT_ONCE", 8 * 32**2 * 5)
    for threads in (1, 2, 5):
        found = extract_interfaces(np.asfortranarray(volume), threads=threads)
        for one, two in zip(found, expected, strict=True):
            assert one.tobytes() == two.tobytes()


def test_progress_runs_to_one():
    done: list[float] = []
    extract_interfaces(
        np.eye(3, dtype=int)[None].repeat(3, 0), progress=lambda _, p: done.append(p)
    )
    assert done[-1] == 1


def test_every_way_to_be_equal_is_in_the_tables():
    rows = interface_tables().rows
    assert ((rows[:, :, 1] - rows[:, :, 0]) > 0).sum(axis=1).tolist() == [14] * 6  # of 15


@pytest.mark.parametrize(
    ("volume", "labels", "error", "message"),
    [
        (np.zeros((3, 3, 3)), None, VolumeError, "must hold integers as labels, got dtype float64"),
        (np.zeros((3, 3), int), None, VolumeError, r"got \(3, 3\)"),
        (np.full((3, 3, 3), 2**60), None, VolumeError, "labels must not exceed"),
        (np.zeros((3, 3, 3), int), [0.5], OptionError, "labels must be a list of integers"),
        (np.zeros((3, 3, 3), int), 4, OptionError, "labels must be a list of integers"),
    ],
)
def test_wrong_input(volume: NDArray, labels: object, error: type, message: str):
    with pytest.raises(error, match=message):
        extract_interfaces(volume, labels)


@needs_data
@pytest.mark.slow
def test_the_frog():
    with np.load(data_dir() / "volumes" / "frog_tissue_labels.npz") as file:
        volume, spacing = file["data"], file["spacing"].astype(float)
    found = extract_interfaces(volume, spacing=spacing)
    assert found.labels.tolist() == np.unique(volume).tolist()
    for label in found.labels:
        report = topology(*found.surface(label))
        assert report.is_manifold
        assert report.is_closed


# ---------------------------------------------------------------------------- surfaces by label


def test_labels_of_an_isosurface_are_surfaces_of_interfaces():
    volume = np.random.default_rng(7).integers(0, 4, (6, 7, 5))
    found = extract_interfaces(volume, spacing=(1, 2, 3), origin=(4, 5, 6))
    options = {"closed": True, "spacing": (1, 2, 3), "origin": (4, 5, 6)}
    surfaces = extract_isosurface(volume, labels="all", **options)
    assert [surface.label for surface in surfaces] == [1, 2, 3]
    for surface in surfaces:
        vertices, faces = surface
        np.testing.assert_array_equal(vertices, found.surface(surface.label).vertices)
        np.testing.assert_array_equal(faces, found.surface(surface.label).faces)
        assert topology(*surface).is_closed
    inward = extract_isosurface(volume, labels="all", normals="higher", **options)
    np.testing.assert_array_equal(inward[0].faces, surfaces[0].faces[:, ::-1])


def test_labels_come_in_the_order_asked_for_and_end_on_the_sides():
    volume = np.random.default_rng(8).integers(0, 4, (6, 7, 5))
    expected = extract_interfaces(volume, [3, 1], closed=False)
    surfaces = extract_isosurface(volume, labels=[3, 1, 9])
    assert [surface.label for surface in surfaces] == [3, 1, 9]
    for surface in surfaces[:2]:
        np.testing.assert_array_equal(surface.faces, expected.surface(surface.label).faces)
    assert surfaces[2].faces.shape == (0, 3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"labels": "some"}, "labels must be 'all' or a list of integers, got 'some'"),
        ({"labels": [0, 1]}, "labels must not be 0, which is the background"),
        ({"labels": [1], "level": 0.5}, "labels do not go with level"),
        ({"labels": [1], "lattice": "bcc", "refine": 2}, "do not go with lattice, refine"),
        ({"labels": [1], "normals": "out"}, "normals must be 'lower' or 'higher'"),
        ({"labels": 4}, "labels must be"),
        ({}, "level must be a finite number"),
    ],
)
def test_wrong_labels(options: dict, message: str):
    with pytest.raises(OptionError, match=message):
        extract_isosurface(np.zeros((3, 3, 3), int), **options)


@needs_data
def test_every_label_of_the_frog_is_watertight():
    """Each has the topology of its isosurface alone, by the definition of what is connected."""
    with np.load(data_dir() / "volumes" / "frog_tissue_labels.npz") as file:
        volume, spacing = file["data"], file["spacing"].astype(float)
    surfaces = extract_isosurface(volume, labels="all", spacing=spacing, closed=True)
    assert [surface.label for surface in surfaces] == np.unique(volume[volume > 0]).tolist()
    for surface in surfaces:
        report = topology(*surface)
        assert report.is_manifold
        assert report.is_closed
        assert report.is_oriented
        alone = extract_isosurface(
            np.pad(volume == surface.label, 1), 0.5, spacing=spacing, closed=True
        )
        assert report.same_topology(topology(*alone))
        assert models.signed_volume(*surface) > 0
