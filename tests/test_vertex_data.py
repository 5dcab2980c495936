"""Data of the vertices of isosurfaces: normals from gradients, values of other volumes."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from numpy.typing import NDArray

import models
from tetsimplify import Mesh, OptionError, extract_isosurface, simplify
from tetsimplify.isosurface import Isosurface
from tetsimplify.lattices import LATTICES

every_lattice = pytest.mark.parametrize("lattice", LATTICES)
SPACING, ORIGIN = np.array([0.5, 1.0, 2.0]), np.array([3.0, -1.0, 0.0])


def world(shape: tuple[int, ...]) -> NDArray:
    """Coordinates of all samples, shape (n0, n1, n2, 3)."""
    return ORIGIN + SPACING * np.moveaxis(np.indices(shape), 0, -1)


@every_lattice
@pytest.mark.parametrize("closed", [False, True])
def test_linear_fields_are_reproduced(lattice: str, closed: bool):
    rng = np.random.default_rng(1)
    volume = rng.normal(size=(6, 7, 8))
    fields = {name: world(volume.shape) @ rng.normal(size=3) + 5 for name in "ab"}
    surface = extract_isosurface(
        volume,
        0.2,
        spacing=SPACING,
        origin=ORIGIN,
        lattice=lattice,
        closed=closed,
        vertex_data={**fields, "x": world(volume.shape)[..., 0]},
    )
    assert list(surface.vertex_data) == ["a", "b", "x"]
    np.testing.assert_allclose(surface.vertex_data["x"], surface.vertices[:, 0], atol=1e-12)
    matrix = np.column_stack([surface.vertices, np.ones(len(surface.vertices))])
    for name in "ab":
        values = surface.vertex_data[name]
        assert values.dtype == np.float64
        fit = matrix @ np.linalg.lstsq(matrix, values, rcond=None)[0]
        np.testing.assert_allclose(values, fit, atol=1e-9)


@every_lattice
def test_the_volume_itself_has_the_level(lattice: str):
    volume = models.gyroid(16)
    surface = extract_isosurface(volume, 0.3, lattice=lattice, vertex_data={"itself": volume})
    is_free = np.abs(surface.vertex_data["itself"] - 0.3) < 1e-12
    assert is_free.mean() > 0.99  # others are held away from a lattice point
    np.testing.assert_allclose(surface.vertex_data["itself"], 0.3, atol=2e-4)


@every_lattice
@pytest.mark.parametrize("side", ["lower", "higher"])
def test_normals_of_a_linear_volume(lattice: str, side: str):
    gradient = np.array([0.3, -2.0, 0.7])
    volume = world((5, 6, 7)) @ gradient
    surface = extract_isosurface(
        volume,
        float(volume.mean()),
        spacing=SPACING,
        origin=ORIGIN,
        lattice=lattice,
        normals=side,
        vertex_normals=True,
    )
    expected = gradient / np.linalg.norm(gradient) * (-1 if side == "lower" else 1)
    normals = surface.vertex_data["normals"]
    assert normals.shape == surface.vertices.shape
    np.testing.assert_allclose(normals, np.broadcast_to(expected, normals.shape), atol=1e-9)
    assert (models.normals(*surface) @ expected > 0).all()


@every_lattice
def test_normals_of_a_sphere(lattice: str):
    for n, tolerance in ((20, 9e-3), (40, 2.3e-3)):
        volume = 0.8 - np.sqrt(0.64 - models.ball(n))
        surface = extract_isosurface(
            volume,
            0.0,
            spacing=models.spacing_of((n,) * 3),
            origin=(-1,) * 3,
            lattice=lattice,
            vertex_normals=True,
        )
        outward = surface.vertices / np.linalg.norm(surface.vertices, axis=1)[:, None]
        normals = surface.vertex_data["normals"]
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
        assert np.linalg.norm(normals - outward, axis=1).max() < tolerance


def test_normals_where_the_gradient_vanishes_follow_the_lattice_edge():
    volume = np.zeros((2, 2, 3))
    volume[:, :, 1] = 1.0
    surface = extract_isosurface(volume, 0.5, vertex_normals=True)
    normals = surface.vertex_data["normals"]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    away = np.sign(surface.vertices[:, 2] - 1)
    assert (normals[:, 2] * away > 0.5).all()


@pytest.mark.parametrize("seed", range(10))
@every_lattice
def test_normals_agree_with_faces_on_smooth_volumes(seed: int, lattice: str):
    rng = np.random.default_rng(seed)
    x, y, z = models.axes((14, 15, 16), 2.0)
    (k, m, n), (a, b, c) = rng.uniform(1, 2, 3), rng.normal(size=3)
    volume = np.sin(k * x + a) + np.sin(m * y + b) + np.sin(n * z + c)
    surface = extract_isosurface(volume, 0.1, lattice=lattice, vertex_normals=True)
    flat = models.normals(*surface)
    mean = surface.vertex_data["normals"][surface.faces].mean(axis=1)
    cosines = (flat * mean).sum(axis=1) / np.linalg.norm(flat, axis=1)
    assert (cosines > 0.5).mean() > 0.99


def test_data_go_on_into_simplification():
    volume = models.ball(20)
    x = np.indices(volume.shape)[0].astype(np.float32)
    surface = extract_isosurface(volume, 0.0, vertex_data={"x": x})
    result = simplify(*surface, max_edge_length=2.0, vertex_data=surface.vertex_data)
    assert np.abs(result.vertex_data["x"] - result.vertices[:, 0]).max() < 0.5


def test_a_surface_is_a_mesh_that_can_be_copied():
    surface = extract_isosurface(models.ball(9), 0.1, vertex_normals=True)
    assert isinstance(surface, Mesh)
    vertices, faces = surface
    assert vertices is surface.vertices
    assert faces is surface.faces
    for other in (pickle.loads(pickle.dumps(surface)), copy.deepcopy(surface), copy.copy(surface)):
        assert isinstance(other, Isosurface)
        assert other.level == 0.1
        np.testing.assert_array_equal(other.vertices, vertices)
        np.testing.assert_array_equal(other.vertex_data["normals"], surface.vertex_data["normals"])


def test_nothing_asked_for_and_nothing_there():
    assert extract_isosurface(models.ball(9), 0.1).vertex_data == {}
    empty = extract_isosurface(
        np.zeros((3, 3, 3)), 1, vertex_normals=True, vertex_data={"a": np.zeros((3,) * 3)}
    )
    assert empty.vertex_data["normals"].shape == (0, 3)
    assert empty.vertex_data["a"].shape == (0,)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"vertex_data": {"a": np.zeros((3, 3, 4))}}, r"'a'\] must .*\(3, 3, 3\), got .*\(3, 3, 4"),
        ({"vertex_data": {"a": np.zeros((3, 3, 3), complex)}}, "must hold real numbers"),
        (
            {"vertex_data": {"normals": np.zeros((3, 3, 3))}, "vertex_normals": True},
            "'normals'. is what vertex_normals makes",
        ),
    ],
)
def test_wrong_vertex_data(options: dict, message: str):
    with pytest.raises(OptionError, match=message):
        extract_isosurface(np.zeros((3, 3, 3)), 0.5, **options)
