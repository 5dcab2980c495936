"""Regularised marching tetrahedra: fewer, better triangles, and the same topology always."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy
from numpy.typing import NDArray

import models
import naive
from tetsimplify import OptionError, extract_isosurface, quality, regularise, topology
from tetsimplify.lattices import LATTICES
from tetsimplify.regularise import contracted

every_lattice = pytest.mark.parametrize("lattice", LATTICES)


def nearest_lattice_point(points: NDArray) -> NDArray:
    """Twice the nearest point of the body-centred lattice."""
    corner, centre = 2 * np.rint(points), 2 * np.floor(points) + 1
    to_corner, to_centre = (np.linalg.norm(points - p / 2, axis=1) for p in (corner, centre))
    return np.where((to_corner < to_centre)[:, None], corner, centre)


def check(volume: NDArray, level: float, lattice: str, closed: bool) -> None:
    options = {"lattice": lattice, "closed": closed}
    plain = extract_isosurface(volume, level, **options)
    surface = extract_isosurface(volume, level, regularise=True, **options)
    before, after = naive.summary(plain.faces), naive.summary(surface.faces)
    assert after.is_sound
    assert after.components == before.components
    assert after.n_boundary_loops == before.n_boundary_loops
    assert len(np.unique(surface.faces)) == len(surface.vertices)
    assert len(surface.faces) <= len(plain.faces)
    for axis, n in enumerate(volume.shape):  # what lay in a side lies there still
        for side in (0.0, n - 1.0):
            was, now = ((mesh.vertices[:, axis] == side).any() for mesh in (plain, surface))
            assert was == now
    assert (surface.vertices >= 0).all()
    assert (surface.vertices <= np.subtract(volume.shape, 1)).all()


def random_volume(seed: int) -> NDArray:
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 9, 3))
    if seed % 3 == 0:
        return rng.normal(size=shape)
    if seed % 3 == 1:
        return rng.integers(-1, 2, shape).astype(float)
    smooth = rng.normal(size=shape)
    for axis in range(3):
        smooth = smooth + np.roll(smooth, 1, axis)
    return smooth


@every_lattice
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("seed", range(40))
def test_topology_stays(seed: int, closed: bool, lattice: str):
    check(random_volume(seed), 0.0, lattice, closed)


@pytest.mark.slow
@every_lattice
@pytest.mark.parametrize("hundred", range(50))
def test_topology_stays_at_length(hundred: int, lattice: str):
    for seed in range(100 * hundred, 100 * hundred + 100):
        for closed in (False, True):
            check(random_volume(seed), 0.0, lattice, closed)


@given(
    st_numpy.arrays(
        np.float64,
        st.tuples(*[st.integers(2, 5)] * 3),
        elements=st.sampled_from([-1.0, -0.9, -0.1, 0.0, 0.1, 0.9, 1.0]),
    ),
    st.sampled_from(list(LATTICES)),
    st.booleans(),
)
@settings(max_examples=150, deadline=None)
def test_topology_stays_on_any_volume(volume: NDArray, lattice: str, closed: bool):
    check(volume, 0.0, lattice, closed)


@every_lattice
def test_topology_of_all_patterns_of_a_block_stays(lattice: str):
    for pattern in range(2**8):
        volume = (pattern >> np.arange(8) & 1).reshape(2, 2, 2) - 0.3
        check(volume, 0.0, lattice, closed=True)


@every_lattice
def test_smooth_surfaces_get_fewer_and_better_triangles(lattice: str):
    volume = models.gyroid(40)
    plain = extract_isosurface(volume, 0.1, lattice=lattice)
    surface = extract_isosurface(volume, 0.1, lattice=lattice, regularise=True)
    assert len(surface.faces) < 0.35 * len(plain.faces)
    assert topology(*surface).same_topology(topology(*plain))
    ratios = [quality(*mesh).radius_ratio.mean() for mesh in (plain, surface)]
    assert ratios[1] > ratios[0] + 0.05
    assert lattice != "bcc" or ratios[1] > 0.9


def test_vertices_are_means_of_those_around_a_lattice_point():
    volume = models.ball(16) + 1e-3
    plain = extract_isosurface(volume, 0.0, lattice="bcc")
    surface = extract_isosurface(volume, 0.0, lattice="bcc", regularise=True)
    around = defaultdict(list)
    nearest = nearest_lattice_point(plain.vertices)
    for point, vertex in zip(nearest, plain.vertices, strict=True):
        around[tuple(point)].append(vertex)
    means = np.array([np.mean(group, axis=0) for group in around.values()])
    gaps = np.linalg.norm(surface.vertices[:, None] - means, axis=2).min(axis=1)
    assert (gaps < 1e-9).mean() > 0.9


@every_lattice
def test_a_sphere_stays_near_the_sphere(lattice: str):
    volume = models.ball(40)
    spacing = models.spacing_of((40,) * 3)
    surface = extract_isosurface(
        volume, 0.0, spacing=spacing, origin=(-1,) * 3, lattice=lattice, regularise=True
    )
    radii = np.linalg.norm(surface.vertices, axis=1)
    assert np.abs(radii - 0.8).max() < spacing[0] ** 2
    assert models.areas(*surface).sum() == pytest.approx(4 * np.pi * 0.64, rel=0.01)


@every_lattice
def test_data_of_vertices_are_means_too(lattice: str):
    volume = models.gyroid(20)
    x = np.indices(volume.shape)[0]
    surface = extract_isosurface(
        volume,
        0.1,
        lattice=lattice,
        regularise=True,
        vertex_normals=True,
        vertex_data={"x": x},
    )
    np.testing.assert_allclose(surface.vertex_data["x"], surface.vertices[:, 0], atol=1e-9)
    normals = surface.vertex_data["normals"]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    flat = models.normals(*surface)
    assert ((flat[:, None] * normals[surface.faces]).sum(axis=2) > 0).mean() > 0.99


def turns(faces: NDArray, cluster: NDArray, vertices: NDArray) -> NDArray:
    """By how many degrees each face that is left turns, one by one."""
    found = []
    for face in faces:
        groups = cluster[face]
        if len(set(groups.tolist())) == 3 and (groups != face).any():
            means = np.array([vertices[cluster == group].mean(axis=0) for group in groups])
            p, q = models.normals(vertices, face[None])[0], models.normals(means, [[0, 1, 2]])[0]
            cosine = p @ q / np.linalg.norm(p) / np.linalg.norm(q)
            found.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return np.array(found)


@every_lattice
@pytest.mark.parametrize("foldover", [30.0, 90.0, None])
def test_no_face_turns_by_more_than_the_guard_allows(
    lattice: str, foldover: float | None, monkeypatch: pytest.MonkeyPatch
):
    """A noisy volume, where without the guard faces fold over."""
    seen = []

    def watched(faces: NDArray, cluster: NDArray, rows: dict) -> object:
        seen.append((faces, cluster, rows[""]))
        return contracted(faces, cluster, rows)

    monkeypatch.setattr(regularise, "contracted", watched)
    volume = np.random.default_rng(5).normal(size=(7, 7, 7))
    surface = extract_isosurface(
        volume, 0.0, lattice=lattice, regularise=True, foldover=foldover, spacing=(1, 2, 3)
    )
    assert naive.summary(surface.faces).is_sound
    largest = turns(*seen[0]).max()
    assert largest > 90 if foldover is None else largest <= foldover + 1e-6


@every_lattice
def test_the_guard_costs_little_on_smooth_surfaces(lattice: str):
    volume = models.gyroid(40)
    guarded, free = (
        extract_isosurface(volume, 0.1, lattice=lattice, regularise=True, foldover=foldover)
        for foldover in (90, None)
    )
    assert len(free.faces) <= len(guarded.faces) < 1.02 * len(free.faces)


def test_the_guard_is_on_by_default():
    volume = np.random.default_rng(5).normal(size=(9, 9, 9))
    counts = [
        len(extract_isosurface(volume, 0.0, regularise=True, **options).faces)
        for options in ({}, {"foldover": 90.0}, {"foldover": None})
    ]
    assert counts[0] == counts[1] > counts[2]


@pytest.mark.parametrize("foldover", [0, -5, 181, "off", True, np.nan])
def test_wrong_guards(foldover: object):
    with pytest.raises(OptionError, match="foldover must be above 0 and up to 180, or None, got"):
        extract_isosurface(np.zeros((3, 3, 3)), 0.5, regularise=True, foldover=foldover)


def test_nothing_becomes_nothing():
    surface = extract_isosurface(np.zeros((3, 3, 3)), 1, regularise=True, vertex_normals=True)
    assert surface.vertices.shape == surface.faces.shape == (0, 3)
    assert surface.vertex_data["normals"].shape == (0, 3)


@pytest.mark.parametrize("threads", [1, 3])
def test_same_bytes_for_any_number_of_threads(threads: int):
    volume = models.gyroid(40)
    expected = extract_isosurface(volume, 0.1, regularise=True)
    surface = extract_isosurface(volume, 0.1, regularise=True, threads=threads)
    assert surface.vertices.tobytes() == expected.vertices.tobytes()
    assert surface.faces.tobytes() == expected.faces.tobytes()
