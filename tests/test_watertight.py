"""Isosurfaces of ten thousand small volumes by each lattice: watertight, all of them.

`test_isosurface.py` compares with a slow oracle one by one. Here the same is asked of very many:
the surfaces of a hundred volumes are laid beside each other as one mesh, and each property is one
operation on arrays, which shares nothing with the package.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

import models
from test_isosurface import random_volume
from tetsimplify import Mesh, extract_isosurface
from tetsimplify.lattices import LATTICES

sparse = pytest.importorskip("scipy.sparse")
pytest.importorskip("scipy.sparse.csgraph")

every_lattice = pytest.mark.parametrize("lattice", LATTICES)

N_VOLUMES = 10_000
N_AT_ONCE = 100
N_QUICK = 1_000  # of the ten thousand, in the default run


def test_the_volumes_are_of_every_kind():
    """Among the first: samples equal to the level, constant regions, and neither."""
    kinds = set()
    for seed in range(N_AT_ONCE):
        volume, level = random_volume(seed)
        has_level = bool((volume == level).any())
        values, counts = np.unique(volume, return_counts=True)
        is_flat = len(values) <= 4 and counts.max() > volume.size / 2
        kinds.add((has_level, is_flat))
    assert kinds == {(False, False), (False, True), (True, False), (True, True)}


@every_lattice
@pytest.mark.parametrize("begin", range(0, N_QUICK, N_AT_ONCE))
def test_random_volumes_are_watertight(begin: int, lattice: str):
    check(range(begin, begin + N_AT_ONCE), lattice)


@pytest.mark.slow
@every_lattice
@pytest.mark.parametrize("thousand", range(N_QUICK // 1000, N_VOLUMES // 1000))
def test_ten_thousand_random_volumes_are_watertight(thousand: int, lattice: str):
    for begin in range(1000 * thousand, 1000 * thousand + 1000, N_AT_ONCE):
        check(range(begin, begin + N_AT_ONCE), lattice)


def check(seeds: range, lattice: str) -> None:
    """Assert that the surfaces of some volumes are manifolds, closed or open on the sides only."""
    volumes = [random_volume(seed) for seed in seeds]
    for closed in (False, True):
        surfaces = [
            extract_isosurface(volume, level, lattice=lattice, closed=closed, threads=1)
            for volume, level in volumes
        ]
        if not closed:
            n_expected = sum(crosses(*pair) for pair in volumes)
            assert sum(len(surface.faces) > 0 for surface in surfaces) >= n_expected
        all_of_them = side_by_side(surfaces)
        shapes = np.concatenate(
            [
                np.tile(volume.shape, (len(surface.vertices), 1))
                for (volume, _), surface in zip(volumes, surfaces, strict=True)
            ]
        )
        assert_watertight(all_of_them, shapes, closed=closed)


def crosses(volume: NDArray, level: float) -> bool:
    """Whether there are samples on both sides, and so a surface between them."""
    inside = volume > level
    return bool(inside.any() and not inside.all())


def side_by_side(surfaces: list[Mesh]) -> Mesh:
    """One mesh of all."""
    first = np.cumsum([0] + [len(surface.vertices) for surface in surfaces[:-1]])
    faces = [surface.faces + n for surface, n in zip(surfaces, first, strict=True)]
    return Mesh(np.concatenate([each.vertices for each in surfaces]), np.concatenate(faces))


def assert_watertight(mesh: Mesh, shapes: NDArray, *, closed: bool) -> None:
    """Assert all that makes an oriented manifold whose boundary lies on the sides of its volume.

    Parameters
    ----------
    shapes : (n, 3) int array
        Shape of the volume of each vertex.
    """
    vertices, faces = mesh
    n, m = len(vertices), len(faces)
    np.testing.assert_array_equal(np.unique(faces), np.arange(n))  # every vertex is used
    directed = np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)]).astype(np.int64)
    assert (directed[:, 0] != directed[:, 1]).all()
    codes = directed[:, 0] * n + directed[:, 1]
    order = np.argsort(codes)
    assert (np.diff(codes[order]) > 0).all(), "an edge is used twice in one direction"

    back = directed[:, 1] * n + directed[:, 0]
    place = np.minimum(np.searchsorted(codes, back, sorter=order), 3 * m - 1)
    twin = order[place]
    has_twin = codes[twin] == back
    if closed:
        assert has_twin.all(), "a boundary edge"
    else:
        sides = np.concatenate([vertices == 0, vertices == shapes - 1], axis=1)
        p, q = directed[~has_twin].T
        assert (sides[p] & sides[q]).any(axis=1).all(), "a boundary edge within a volume"

    # all corners of a vertex are one fan: joined across the edges between their faces
    corner = np.arange(3 * m)
    begins = corner % m + corner // m * m  # corner k m + f is where directed edge k m + f begins
    ends = (corner // m + 1) % 3 * m + corner % m
    one = np.concatenate([begins[has_twin], ends[has_twin]])
    other = np.concatenate([ends[twin[has_twin]], begins[twin[has_twin]]])
    joined = sparse.coo_matrix((np.ones(len(one)), (one, other)), (3 * m, 3 * m))
    n_fans, fan = sparse.csgraph.connected_components(joined, directed=False)
    assert n_fans == n, "a vertex of several fans"
    of_fan = np.full(n_fans, -1)
    of_fan[fan] = directed[:, 0]
    np.testing.assert_array_equal(of_fan[fan], directed[:, 0])

    assert models.lengths(*mesh).min() > models.CLEARANCE / 2
    assert models.areas(*mesh).min() > models.CLEARANCE**2 / 4
    assert (vertices >= 0).all()
    assert (vertices <= shapes - 1).all()


# ---------------------------------------------------------------------------- the check itself


def _broken() -> Iterator[tuple[str, NDArray]]:
    """A surface from which all is right but one thing."""
    volume = np.zeros((4, 4, 4))
    volume[1:3, 1:3, 1:3] = 1
    faces = extract_isosurface(volume, 0.5).faces
    yield "a hole", faces[1:]
    yield "a face turned over", np.concatenate([faces[:1, ::-1], faces[1:]])
    yield "a face twice", np.concatenate([faces, faces[:1]])
    yield "two vertices made one", np.where(faces == faces.max(), 0, faces)


BROKEN = list(_broken())


@pytest.mark.parametrize(("what", "faces"), BROKEN, ids=[what for what, _ in BROKEN])
def test_the_check_finds_what_is_wrong(what: str, faces: NDArray):
    volume = np.zeros((4, 4, 4))
    volume[1:3, 1:3, 1:3] = 1
    mesh = extract_isosurface(volume, 0.5)
    shapes = np.full((len(mesh.vertices), 3), 4)
    assert_watertight(mesh, shapes, closed=True)
    used, faces = np.unique(faces, return_inverse=True)
    other = Mesh(mesh.vertices[used], faces.reshape(-1, 3).astype(np.int32))
    with pytest.raises(AssertionError):
        assert_watertight(other, shapes[: len(used)], closed=False)
