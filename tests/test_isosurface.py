"""Isosurfaces: always a manifold, equal to the slow oracle, on any volume in any memory order."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy
from numpy.typing import NDArray

import meshes
import models
import naive
import naive_lattices
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

DTYPES = [
    *("bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"),
    *("float16", "float32", "float64", "longdouble"),
]

Volume = NDArray
LATTICE_NAMES = list(LATTICES)

every_lattice = pytest.mark.parametrize("lattice", LATTICE_NAMES)
any_lattice = st.sampled_from(LATTICE_NAMES)


# ---------------------------------------------------------------------------- what must hold


def boundary_of(mesh: Mesh) -> set[tuple[int, int]]:
    return set(meshes.boundary_edges(mesh.faces))


def in_sides(points: NDArray, shape: tuple[int, ...]) -> NDArray:
    """Which of the six sides of a volume each point lies in exactly; shape (n, 6)."""
    return np.concatenate([points == 0, points == np.array(shape) - 1], axis=1)


def assert_surface(mesh: Mesh, shape: tuple[int, ...], *, closed: bool = False) -> None:
    """Assert all that is promised of every surface at unit spacing."""
    assert mesh.vertices.dtype == np.float64
    assert mesh.faces.dtype == np.int32
    assert mesh.vertices.shape[1:] == mesh.faces.shape[1:] == (3,)
    assert mesh.vertices.flags.c_contiguous
    assert mesh.faces.flags.c_contiguous

    slow = naive.summary(mesh.faces)
    report = topology(*mesh)
    assert slow.is_sound
    assert report.is_manifold
    assert not len(report.unreferenced_vertices)
    assert report.euler_characteristic == slow.euler_characteristic
    assert report.n_components == slow.n_components
    assert report.n_boundary_loops == slow.n_boundary_loops
    assert sorted(map(tuple, report.components.tolist())) == list(slow.components)

    boundary = sorted(boundary_of(mesh))
    assert not (closed and boundary)
    if boundary:
        p, q = np.array(boundary).T
        sides = in_sides(mesh.vertices, shape)
        assert (sides[p] & sides[q]).any(axis=1).all(), "a boundary edge within the volume"

    if len(mesh.faces):
        assert (mesh.vertices >= 0).all()
        assert (mesh.vertices <= np.array(shape) - 1).all()
        assert models.lengths(*mesh).min() > models.CLEARANCE / 2
        assert models.areas(*mesh).min() > models.CLEARANCE**2 / 4


def faces_by_corner(faces: NDArray) -> list[tuple[int, ...]]:
    """Faces as tuples that start with their smallest vertex, sorted: equal for equal surfaces."""
    turned = [np.roll(face, -int(np.argmin(face))) for face in faces]
    return sorted(tuple(face.tolist()) for face in turned)


def assert_same_surface(one: Mesh, two: Mesh, *, tolerance: float = 1e-9) -> None:
    """Assert that two meshes are equal up to the numbers of vertices and faces."""
    assert one.vertices.shape == two.vertices.shape
    assert one.faces.shape == two.faces.shape
    if not len(one.vertices):
        return
    distances = np.abs(one.vertices[:, None] - two.vertices[None]).max(axis=2)
    match = distances.argmin(axis=1)
    assert distances[np.arange(len(match)), match].max() <= tolerance
    assert len(set(match.tolist())) == len(match)
    assert faces_by_corner(match[one.faces]) == faces_by_corner(two.faces)


# ---------------------------------------------------------------------------- random volumes


@st.composite
def volumes(draw, dtypes: list[str] = DTYPES, max_side: int = 5) -> tuple[Volume, float]:
    """Draw a volume and a level: anything goes, equal samples and constant regions too."""
    dtype = np.dtype(draw(st.sampled_from(dtypes)))
    shape = draw(st.tuples(*[st.integers(2, max_side)] * 3))
    if dtype.kind == "f":
        limit = 2.0**12 if dtype.itemsize == 2 else 2.0**100
        of_any_size = st.floats(-limit, limit, width=min(64, 8 * dtype.itemsize))
        elements = st.sampled_from([0.0, 0.25, 0.5, 1.0, -1.0]) | of_any_size
    elif dtype.kind == "b":
        elements = st.booleans()
    else:
        info = np.iinfo(dtype)
        elements = st.integers(0, 3) | st.integers(int(info.min), int(info.max))
    values = draw(st_numpy.arrays(dtype, shape, elements=elements, fill=elements))
    one_of_them = float(values[draw(st.tuples(*[st.integers(0, n - 1) for n in shape]))])
    level = draw(st.sampled_from([one_of_them, 0.0, 0.5, one_of_them / 2, one_of_them + 0.25]))
    return values, level


def random_volume(seed: int) -> tuple[Volume, float]:
    """A volume and a level from a seed, of every kind that has its own way to go wrong."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 7, 3))
    kind = rng.integers(4)
    if kind == 0:  # noise
        values = rng.uniform(-1, 1, shape)
    elif kind == 1:  # few values, often equal to the level
        values = rng.integers(-1, 2, shape).astype(float)
    elif kind == 2:  # constant with a few samples that differ
        values = np.full(shape, float(rng.integers(2)))
        for _ in range(int(rng.integers(1, 4))):
            values[tuple(rng.integers(shape))] = rng.uniform(-1, 2)
    else:  # next to the level
        values = rng.choice([-1e-9, -1e-300, 0.0, 1e-300, 1e-9, 1.0, -1.0], shape)
    level = 0.0 if kind == 3 else float(rng.choice([0.0, 0.5, rng.choice(values.ravel())]))
    return values, level


def rearranged(volume: Volume) -> list[Volume]:
    """The same volume in other memory orders and byte orders."""
    n0, n1, n2 = volume.shape
    wide = np.zeros((2 * n0, 3 * n1, 2 * n2), volume.dtype)
    wide[::2, ::3, 1::2] = volume
    read_only = volume.copy()
    read_only.flags.writeable = False
    unaligned = np.frombuffer(b"\0" + volume.tobytes(), np.uint8)[1:].view(volume.dtype)
    return [
        np.asfortranarray(volume),
        wide[::2, ::3, 1::2],
        volume[::-1, ::-1, ::-1].copy()[::-1, ::-1, ::-1],
        np.asfortranarray(volume[:, ::-1]).copy("K")[:, ::-1],
        volume.transpose(1, 2, 0).copy().transpose(2, 0, 1),
        volume.astype(volume.dtype.newbyteorder(">")),
        volume.astype(volume.dtype.newbyteorder("<")),
        read_only,
        unaligned.reshape(volume.shape),
    ]


@given(volumes(), any_lattice, st.booleans(), st.sampled_from(["lower", "higher"]))
@settings(max_examples=400, deadline=None)
def test_every_volume_gives_a_manifold(
    drawn: tuple[Volume, float], lattice: str, closed: bool, normals: str
):
    volume, level = drawn
    before = volume.copy()
    mesh = extract_isosurface(volume, level, lattice=lattice, closed=closed, normals=normals)
    assert volume.tobytes() == before.tobytes(), "the input has changed"
    assert_surface(mesh, volume.shape, closed=closed)


@every_lattice
@pytest.mark.parametrize("seed", range(60))
def test_random_volume(seed: int, lattice: str):
    check_random_volume(seed, lattice)


@pytest.mark.slow
@every_lattice
@pytest.mark.parametrize("hundred", range(10))
def test_a_thousand_random_volumes_against_the_oracle(hundred: int, lattice: str):
    for seed in range(100 * hundred, 100 * hundred + 100):
        check_random_volume(seed, lattice)


def check_random_volume(seed: int, lattice: str) -> None:
    volume, level = random_volume(seed)
    open_mesh = extract_isosurface(volume, level, lattice=lattice)
    closed_mesh = extract_isosurface(volume, level, lattice=lattice, closed=True)
    assert_surface(open_mesh, volume.shape)
    assert_surface(closed_mesh, volume.shape, closed=True)
    assert_same_surface(open_mesh, naive_lattices.isosurface(volume, level, lattice))
    assert_caps(open_mesh, closed_mesh, volume, level, lattice)


@given(volumes(max_side=4), any_lattice)
@settings(max_examples=100, deadline=None)
def test_equals_the_oracle(drawn: tuple[Volume, float], lattice: str):
    volume, level = drawn
    mesh = extract_isosurface(volume, level, lattice=lattice)
    assert_same_surface(mesh, naive_lattices.isosurface(volume, level, lattice))


# ---------------------------------------------------------------------------- values of centres


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("closed", [False, True])
def test_centres_may_have_values_of_their_own(seed: int, closed: bool):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 6, 3))
    volume = rng.integers(-1, 2, shape).astype(float)
    centres = rng.integers(-1, 2, np.subtract(shape, 1)) * rng.random(np.subtract(shape, 1))
    mesh = extract_isosurface(volume, 0.0, lattice="bcc", centres=centres, closed=closed)
    assert_surface(mesh, shape, closed=closed)
    if not closed:
        assert_same_surface(mesh, naive_lattices.isosurface(volume, 0.0, "bcc", centres))


def test_centres_are_means_when_not_given():
    volume = smooth_volume(2)
    octants = [volume[z : z + 5, y : y + 6, x : x + 4] for z, y, x in np.ndindex(2, 2, 2)]
    given_means = extract_isosurface(volume, 0.1, lattice="bcc", centres=np.mean(octants, axis=0))
    means = extract_isosurface(volume, 0.1, lattice="bcc")
    np.testing.assert_array_equal(given_means.faces, means.faces)
    np.testing.assert_allclose(given_means.vertices, means.vertices, atol=1e-12)


def test_a_surface_around_one_centre():
    volume, centres = np.zeros((4, 4, 4)), np.zeros((3, 3, 3))
    centres[1, 1, 1] = 1
    mesh = extract_isosurface(volume, 0.5, lattice="bcc", centres=centres)
    assert (len(mesh.vertices), len(mesh.faces)) == (14, 24)
    np.testing.assert_allclose(mesh.vertices.mean(axis=0), 1.5)


@pytest.mark.parametrize(
    ("centres", "lattice", "error", "message"),
    [
        (np.zeros((2, 3, 4)), "kuhn", OptionError, r"centres are for lattices that .* \(bcc\)"),
        (np.zeros((3, 4, 5)), "bcc", VolumeError, r"shape \(2, 3, 4\), got .*\(3, 4, 5\)"),
        (np.zeros((2, 3, 4), "U1"), "bcc", VolumeError, "must hold real numbers .* got <U1"),
        (np.full((2, 3, 4), np.nan), "bcc", VolumeError, r"centres must be finite, got nan at"),
    ],
)
def test_wrong_centres(centres: Volume, lattice: str, error: type, message: str):
    with pytest.raises(error, match=message):
        extract_isosurface(np.zeros((3, 4, 5)), 0.5, lattice=lattice, centres=centres)


# ---------------------------------------------------------------------------- ways to be read


@pytest.mark.parametrize("dtype", DTYPES)
def test_memory_order_does_not_matter(dtype: str):
    values = np.random.default_rng(3).integers(0, 2 if dtype == "bool" else 9, (5, 4, 6))
    volume = values.astype(dtype)
    level = 0.5 if dtype == "bool" else 4.0
    for closed in (False, True):
        expected = extract_isosurface(volume, level, closed=closed)
        assert len(expected.faces) > 50
        for other in rearranged(volume):
            np.testing.assert_array_equal(other, volume)
            mesh = extract_isosurface(other, level, closed=closed)
            assert mesh.vertices.tobytes() == expected.vertices.tobytes()
            assert mesh.faces.tobytes() == expected.faces.tobytes()


def test_dtype_does_not_matter():
    values = np.random.default_rng(4).integers(0, 100, (5, 5, 5))
    expected = extract_isosurface(values, 40)
    for dtype in DTYPES[1:]:
        mesh = extract_isosurface(values.astype(dtype), 40.0)
        assert mesh.vertices.tobytes() == expected.vertices.tobytes()
        assert mesh.faces.tobytes() == expected.faces.tobytes()


def test_nested_lists_are_volumes():
    volume = np.zeros((3, 3, 3), int)
    volume[1, 1, 1] = 2
    expected = extract_isosurface(volume, 1)
    assert_same_surface(extract_isosurface(volume.tolist(), 1), expected)


def test_only_a_few_planes_are_read_at_once():
    class OnDisk:
        """As the datasets of HDF5 and Zarr: a shape, a dtype, and slices."""

        def __init__(self, values: Volume) -> None:
            self._values = values
            self.shape, self.dtype = values.shape, values.dtype
            self.largest = 0

        def __getitem__(self, key: object) -> Volume:
            read = self._values[key]
            self.largest = max(self.largest, read.size)
            return read

    values = np.zeros((300, 100, 600), np.uint8)
    values[50:120, 20:70, 100:500] = 1
    volume = OnDisk(values)
    mesh = extract_isosurface(volume, 0.5)
    assert mesh.faces.tobytes() == extract_isosurface(values, 0.5).faces.tobytes()
    assert volume.largest < values.size / 4


# ---------------------------------------------------------------------------- orientation


def smooth_volume(seed: int, shape: tuple[int, int, int] = (6, 7, 5)) -> Volume:
    return np.random.default_rng(seed).uniform(-1, 1, shape)


@pytest.mark.parametrize("seed", range(20))
def test_normals_point_to_lower_values(seed: int):
    volume = smooth_volume(seed)
    mesh = extract_isosurface(volume, 0.1)
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    normals = models.normals(*mesh)
    # A face lies within a tetrahedron, in which the values are linear; small ones are too near to
    # its sides to tell.
    large = np.linalg.norm(normals, axis=1) > 0.05
    assert large.sum() > 100
    step = 1e-6 * normals[large]
    np.testing.assert_allclose(models.interpolated(volume, centres[large]), 0.1, atol=1e-9)
    assert (models.interpolated(volume, centres[large] + step) < 0.1).all()
    assert (models.interpolated(volume, centres[large] - step) > 0.1).all()


@pytest.mark.parametrize("seed", range(8))
def test_volume_enclosed_is_where_values_are_above_the_level(seed: int):
    volume = smooth_volume(seed, (5, 5, 5))
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 4, (100_000, 3))
    part = (models.interpolated(volume, points) > 0.1).mean()
    solid = models.signed_volume(*extract_isosurface(volume, 0.1, closed=True))
    hollow = extract_isosurface(volume, 0.1, closed=True, normals="higher")
    assert solid / 4**3 == pytest.approx(part, abs=0.01)
    assert models.signed_volume(*hollow) / 4**3 == pytest.approx(1 - part, abs=0.01)


@given(volumes(), any_lattice, st.booleans())
@settings(max_examples=80, deadline=None)
def test_higher_is_the_negative_volume(drawn: tuple[Volume, float], lattice: str, closed: bool):
    volume, level = drawn
    values = volume.astype(np.float64)
    mesh = extract_isosurface(values, level, normals="higher", closed=closed, lattice=lattice)
    expected = extract_isosurface(-values, -level, closed=closed, lattice=lattice)
    np.testing.assert_array_equal(mesh.vertices, expected.vertices)
    np.testing.assert_array_equal(mesh.faces, expected.faces)


@pytest.mark.parametrize("seed", range(20))
def test_higher_is_the_mirror_where_no_sample_equals_the_level(seed: int):
    volume = smooth_volume(seed)
    lower = extract_isosurface(volume, 0.1)
    higher = extract_isosurface(volume, 0.1, normals="higher")
    assert_same_surface(Mesh(higher.vertices, higher.faces[:, ::-1]), lower)


@pytest.mark.parametrize("seed", range(20))
def test_samples_equal_to_the_level_are_outside(seed: int):
    volume, level = random_volume(seed)
    values = np.where(volume == level, -1e9, volume)
    ours = extract_isosurface(volume, level)
    lowered = extract_isosurface(values, level)
    assert faces_by_corner(ours.faces) == faces_by_corner(lowered.faces)


# ---------------------------------------------------------------------------- caps


def assert_caps(
    open_mesh: Mesh, closed_mesh: Mesh, volume: Volume, level: float, lattice: str
) -> None:
    """Assert that a closed surface is the open one, and flat caps where the sides are inside."""
    shape = volume.shape
    is_corner = (closed_mesh.vertices == np.rint(closed_mesh.vertices)).all(axis=1)
    # the open surface is there, in order; what is added are inside lattice points and the caps
    np.testing.assert_array_equal(closed_mesh.vertices[~is_corner], open_mesh.vertices)
    number = np.cumsum(~is_corner) - 1
    has_corner = is_corner[closed_mesh.faces].any(axis=1)
    sides = in_sides(closed_mesh.vertices, shape)
    is_flat = sides[closed_mesh.faces].all(axis=1)  # (m, 6): the whole face in this side
    assert is_flat[has_corner].any(axis=1).all()
    corners = closed_mesh.vertices[is_corner].astype(int)
    assert all(volume[tuple(corner)] > level for corner in corners)

    rest = set(faces_by_corner(number[closed_mesh.faces[~has_corner]]))
    assert set(faces_by_corner(open_mesh.faces)) <= rest

    # the caps are what is inside of the sides, neither more nor less, and look outward
    normals = models.normals(*closed_mesh)
    for side in range(6):
        axis, sign = side % 3, -1 if side < 3 else 1
        flat = is_flat[:, side]
        assert (sign * normals[flat, axis] > 0).all()
        covered = models.areas(closed_mesh.vertices, closed_mesh.faces[flat]).sum()
        area = naive_lattices.inside_area(volume, level, 2 * axis + (sign > 0), lattice)
        assert covered == pytest.approx(area, rel=1e-9)


@every_lattice
def test_full_volume_closes_to_its_box(lattice: str):
    mesh = extract_isosurface(np.ones((3, 4, 5)), 0.5, lattice=lattice, closed=True)
    assert_surface(mesh, (3, 4, 5), closed=True)
    assert naive.summary(mesh.faces).components == ((2, 0),)
    assert models.signed_volume(*mesh) == pytest.approx(2 * 3 * 4)
    assert models.areas(*mesh).sum() == pytest.approx(2 * (6 + 8 + 12))


@every_lattice
def test_smallest_volumes_close(lattice: str):
    for colouring in range(256):
        volume = (colouring >> np.arange(8) & 1).reshape(2, 2, 2)
        mesh = extract_isosurface(volume, 0.5, lattice=lattice, closed=True)
        assert_surface(mesh, (2, 2, 2), closed=True)
        assert (len(mesh.faces) > 0) == (colouring > 0)
        assert_caps(extract_isosurface(volume, 0.5, lattice=lattice), mesh, volume, 0.5, lattice)


@pytest.mark.parametrize("lattice", ["kuhn", "five"])  # the others end in other tetrahedra
@pytest.mark.parametrize("seed", range(10))
def test_closing_is_padding_in_topology(seed: int, lattice: str):
    volume = smooth_volume(seed)
    padded = np.pad(volume, 2, constant_values=-9)  # two, so that cubes keep their parity
    closed = topology(*extract_isosurface(volume, 0.1, lattice=lattice, closed=True))
    assert closed.same_topology(topology(*extract_isosurface(padded, 0.1, lattice=lattice)))


def test_the_boundary_of_the_body_centred_lattice_is_that_of_kuhn():
    volume = smooth_volume(3)
    ends = []
    for lattice in ("kuhn", "bcc"):
        mesh = extract_isosurface(volume, 0.1, lattice=lattice)
        points = [mesh.vertices[list(edge)].tolist() for edge in boundary_of(mesh)]
        ends.append(sorted(sorted(pair) for pair in points))
    assert ends[0] == ends[1]
    assert len(ends[0]) > 100


@every_lattice
def test_closed_changes_nothing_where_no_side_is_inside(lattice: str):
    volume = models.ball(12)
    open_mesh = extract_isosurface(volume, 0.0, lattice=lattice)
    closed_mesh = extract_isosurface(volume, 0.0, lattice=lattice, closed=True)
    assert open_mesh.vertices.tobytes() == closed_mesh.vertices.tobytes()
    assert open_mesh.faces.tobytes() == closed_mesh.faces.tobytes()


# ---------------------------------------------------------------------------- geometry


@every_lattice
@pytest.mark.parametrize("seed", range(20))
def test_linear_fields_are_reproduced_exactly(seed: int, lattice: str):
    rng = np.random.default_rng(seed)
    gradient, offset = rng.normal(size=3), rng.normal()
    spacing, origin = rng.uniform(0.1, 3, 3), rng.normal(size=3)
    indices = np.moveaxis(np.indices((6, 7, 8)), 0, -1)
    volume = (origin + spacing * indices) @ gradient + offset
    level = float(np.median(volume)) + 1e-3
    mesh = extract_isosurface(volume, level, spacing=spacing, origin=origin, lattice=lattice)
    values = mesh.vertices @ gradient + offset
    # a vertex that is kept away from a sample is off by that clearance at most
    tolerance = models.CLEARANCE * np.abs(gradient * spacing).sum()
    on_plane = np.abs(values - level) < 1e-12 * max(1, np.abs(volume).max())
    assert np.abs(values - level).max() < tolerance
    assert on_plane.mean() > 0.99
    assert (models.normals(*mesh) @ gradient < 0).all()


def test_clearance_is_kept_from_samples_at_the_level():
    volume = np.zeros((3, 3, 3))
    volume[1, 1, 1] = 1
    mesh = extract_isosurface(volume, 0.0)  # all around are equal to the level
    towards = np.abs(mesh.vertices - 1).max(axis=1)
    np.testing.assert_allclose(towards, 1 - models.CLEARANCE, rtol=1e-12)
    assert len(mesh.vertices) == 14


@pytest.mark.parametrize("level", [-1.7e308, 0.0, 1.69e308])
def test_the_largest_numbers(level: float):
    volume = np.full((2, 2, 2), -1.7e308)
    volume[0, 0, 0] = 1.7e308
    mesh = extract_isosurface(volume, level)
    assert_surface(mesh, (2, 2, 2))
    t = np.clip((1.7e308 / 4 - level / 4) / (1.7e308 / 2), 1e-4, 1 - 1e-4)
    np.testing.assert_allclose(mesh.vertices.max(axis=1), t)


def test_the_smallest_numbers():
    volume = np.zeros((2, 2, 2))
    volume[0, 0, 0] = 5e-324  # half of it is zero
    assert_surface(extract_isosurface(volume, 0.0), (2, 2, 2))
    assert_surface(extract_isosurface(-volume, -5e-324), (2, 2, 2))


def test_neighbouring_large_integers_that_float64_cannot_tell_apart():
    volume = np.full((3, 3, 3), 2**62, np.int64)
    volume[1, 1, 1] += 1
    mesh = extract_isosurface(volume, float(2**62))
    assert len(mesh.faces) == 0
    volume[1, 1, 1] += 2**20
    assert_surface(extract_isosurface(volume, float(2**62)), (3, 3, 3))


@pytest.mark.parametrize("closed", [False, True])
def test_spacing_and_origin_scale_and_move(closed: bool):
    volume = smooth_volume(1)
    plain = extract_isosurface(volume, 0.1, closed=closed)
    spacing, origin = (0.5, 2.0, 3.25), (-7.0, 0.125, 100.0)
    mesh = extract_isosurface(volume, 0.1, spacing=spacing, origin=origin, closed=closed)
    np.testing.assert_array_equal(mesh.faces, plain.faces)
    np.testing.assert_allclose(mesh.vertices, origin + plain.vertices * spacing, rtol=1e-12)


@every_lattice
def test_sphere_converges_with_order_two(lattice: str):
    area, content, errors = 4 * np.pi * 0.8**2, 4 / 3 * np.pi * 0.8**3, []
    for n in (21, 41, 81):
        spacing = models.spacing_of((n, n, n))
        mesh = extract_isosurface(
            models.ball(n), 0.0, spacing=spacing, origin=(-1, -1, -1), lattice=lattice
        )
        radii = np.linalg.norm(mesh.vertices, axis=1)
        found = models.areas(*mesh).sum(), models.signed_volume(*mesh), radii.min()
        errors.append([1 - found[0] / area, 1 - found[1] / content, 1 - found[2] / 0.8])
    assert np.abs(errors[-1]).max() < 3e-3
    for coarse, fine in pairwise(errors):
        order = np.log2(np.divide(coarse, fine))
        assert (np.abs(order - 2) < 0.25).all(), order


@pytest.mark.parametrize(
    ("volume", "components"),
    [
        (models.ball(20), ((2, 0),)),
        (models.torus((30, 30, 14), (1.5, 1.5, 0.6), 0.35), ((0, 0),)),
        (models.two_sheets((24, 24, 24), (2, 2, 2)), ((1, 1), (1, 1))),
        (-models.two_sheets((24, 24, 24), (2, 2, 2)), ((1, 1), (1, 1))),
    ],
    ids=["sphere", "torus", "two sheets", "between two sheets"],
)
@every_lattice
def test_known_topology(volume: Volume, components: tuple, lattice: str):
    mesh = extract_isosurface(volume, 0.0, lattice=lattice)
    assert_surface(mesh, volume.shape)
    assert naive.summary(mesh.faces).components == components


def test_a_level_out_of_range_gives_an_empty_mesh():
    volume = np.arange(27.0).reshape(3, 3, 3)
    for level, closed in [(-1, False), (26, False), (26, True), (99, True)]:
        mesh = extract_isosurface(volume, level, closed=closed)
        assert mesh.vertices.shape == mesh.faces.shape == (0, 3)
        assert mesh.vertices.dtype == np.float64
        assert mesh.faces.dtype == np.int32
    assert len(extract_isosurface(volume, -1, closed=True).faces) == 6 * 8


def test_faces_and_vertices_come_in_memory_order():
    mesh = extract_isosurface(models.gyroid(24), 0.0)
    cubes = np.floor(mesh.vertices[mesh.faces].mean(axis=1))
    anchors = np.floor(mesh.vertices)
    for cells in (cubes, anchors):
        number = cells @ [10_000, 100, 1]
        assert (np.diff(number) >= 0).all()


@every_lattice
@pytest.mark.parametrize("closed", [False, True])
def test_the_number_of_threads_and_blocks_does_not_matter(
    lattice: str, closed: bool, monkeypatch: pytest.MonkeyPatch
):
    volume = models.gyroid(37)
    options = {"lattice": lattice, "closed": closed}
    one = extract_isosurface(volume, 0.2, threads=1, **options)
    monkeypatch.setattr(march, "BYTES_IN_PLACE", 8 * 37**2 * 5)
    monkeypatch.setattr(march, "BYTES_AT_ONCE", 8 * 37**2 * 7)
    for threads in (None, 1, 2, 3, 16):
        for values in (volume, np.asfortranarray(volume)):
            other = extract_isosurface(values, 0.2, threads=threads, **options)
            assert one.vertices.tobytes() == other.vertices.tobytes()
            assert one.faces.tobytes() == other.faces.tobytes()


def test_the_result_owns_no_more_than_it_needs():
    for array in extract_isosurface(models.gyroid(20), 0.2):
        assert array.base is None
        assert array.flags.writeable


# ---------------------------------------------------------------------------- progress


def test_progress_runs_to_one():
    calls: list[tuple[str, float]] = []
    volume = np.zeros((300, 40, 40))
    extract_isosurface(volume, 0.5, progress=lambda *call: calls.append(call))
    assert {stage for stage, _ in calls} == {"isosurface"}
    done = [part for _, part in calls]
    assert done == sorted(done)
    assert all(0 <= part <= 1 for part in done)
    assert done[-1] == 1
    assert len(done) > 4


def test_raising_from_progress_cancels():
    class CancelledError(Exception):
        pass

    def cancel(_stage: str, done: float) -> None:
        if done > 0.5:
            raise CancelledError

    for threads in (1, 2):
        with pytest.raises(CancelledError):
            extract_isosurface(models.ball(40), 0.0, threads=threads, progress=cancel)


# ---------------------------------------------------------------------------- wrong input


def with_one(value: float, dtype: str = "float64") -> Volume:
    volume = np.zeros((4, 5, 6), dtype)
    volume[1, 2, 3] = value
    return volume


@pytest.mark.parametrize(
    ("volume", "message"),
    [
        (with_one(np.nan), r"volume must be finite, got nan at index \[1, 2, 3\]"),
        (with_one(np.inf), r"volume must be finite, got inf at index \[1, 2, 3\]"),
        (with_one(-np.inf, "float16"), r"volume must be finite, got -inf at index \[1, 2, 3\]"),
        (with_one(np.nan, ">f4"), r"volume must be finite, got nan at index \[1, 2, 3\]"),
        (np.zeros((3, 3, 3), complex), "volume must hold real numbers, got dtype complex128"),
        (np.zeros((3, 3, 3), object), "volume must hold real numbers, got dtype object"),
        (np.zeros((3, 3, 3), "U1"), "volume must hold real numbers, got dtype <U1"),
        (np.zeros((3, 3, 3), "M8[s]"), "volume must hold real numbers, got dtype datetime64"),
        (np.zeros((3, 3)), r"shape \(n0, n1, n2\) with at least 2 samples.*got \(3, 3\)"),
        (np.zeros((3, 3, 3, 1)), r"got \(3, 3, 3, 1\)"),
        (np.zeros((3, 1, 3)), r"at least 2 samples along each axis, got \(3, 1, 3\)"),
        (np.zeros((3, 3, 0)), r"got \(3, 3, 0\)"),
        (7.0, r"got \(\)"),
        ([], r"got \(0,\)"),
        (None, r"got \(\)"),
    ],
)
def test_wrong_volumes(volume: object, message: str):
    with pytest.raises(VolumeError, match=message):
        extract_isosurface(volume, 0.5)


@pytest.mark.skipif(np.finfo(np.longdouble).max == np.finfo(float).max, reason="no wider float")
def test_numbers_too_large_for_float64():
    volume = np.zeros((3, 3, 3), np.longdouble)
    volume[0, 1, 2] = np.longdouble("1e400")
    with pytest.raises(VolumeError, match=r"volume must be finite, got .* at index \[0, 1, 2\]"):
        extract_isosurface(volume, 0.5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"spacing": (1, 0, 1)}, r"spacing must be positive, got \(1, 0, 1\)"),
        ({"spacing": (1, 1, -2)}, r"spacing must be positive, got \(1, 1, -2\)"),
        ({"spacing": (1, 1)}, r"spacing must be three finite numbers, got \(1, 1\)"),
        ({"spacing": 1}, "spacing must be three finite numbers, got 1"),
        ({"spacing": (1, 1, np.nan)}, "spacing must be three finite numbers"),
        ({"spacing": None}, "spacing must be three finite numbers, got None"),
        ({"origin": (0, 0, np.inf)}, "origin must be three finite numbers"),
        ({"origin": [[0, 0, 0]]}, "origin must be three finite numbers"),
        ({"lattice": "diamond"}, "lattice must be one of .*kuhn.*, got 'diamond'"),
        ({"lattice": None}, "lattice must be one of .*kuhn.*, got None"),
        ({"threads": 0}, "threads must be a positive integer, got 0"),
        ({"threads": 2.0}, "threads must be a positive integer, got 2.0"),
        ({"normals": "outward"}, "normals must be 'lower' or 'higher', got 'outward'"),
        ({"normals": None}, "normals must be 'lower' or 'higher', got None"),
        ({"level": np.nan}, "level must be a finite number.*, got nan"),
        ({"level": -np.inf}, "level must be a finite number.*, got -inf"),
        ({"level": None}, "level must be a finite number.*, got None"),
        ({"level": "high"}, "level must be a finite number.*, got 'high'"),
        ({"level": 1j}, "level must be a finite number.*, got 1j"),
        ({"level": np.array([0.5])}, r"level must be a finite number.*, got array\(\[0.5\]\)"),
    ],
)
def test_wrong_options(options: dict, message: str):
    with pytest.raises(OptionError, match=message):
        extract_isosurface(np.zeros((3, 3, 3)), **({"level": 0.5} | options))


def test_wrong_input_is_found_before_progress_begins():
    calls: list[object] = []
    with pytest.raises(OptionError):
        extract_isosurface(
            np.zeros((3, 3, 3)), 0.5, normals="up", progress=lambda *call: calls.append(call)
        )
    assert not calls


@pytest.mark.parametrize("level", [np.float32(0.5), np.array(0.5), np.int8(0), 0, 0.5])
def test_numbers_of_any_kind_are_levels(level: object):
    assert len(extract_isosurface(with_one(1), level).faces) == 24


# ---------------------------------------------------------------------------- memory

PEAK_SCRIPT = """
import numpy as np, tracemalloc
from tetsimplify import extract_isosurface

n = {n}
x = np.linspace(-12, 12, n)
rows = np.sin(x)[:, None] * np.cos(x)[None, :]
volume = np.empty((n, n, n), np.uint8)
for k in range(n):
    volume[k] = 127 + 60 * (np.sin(x[k]) * np.cos(x)[:, None] + rows + np.sin(x) * np.cos(x[k]))
extract_isosurface(volume[:4], 127.5)

def resident(name):
    for line in open("/proc/self/status"):
        if line.startswith(name):
            return 1024 * int(line.split()[1])

before = resident("VmRSS")
if {traced}:
    tracemalloc.start()
mesh = extract_isosurface(volume, 127.5)
peak = tracemalloc.get_traced_memory()[1] if {traced} else resident("VmHWM") - before
print(peak, mesh.vertices.nbytes + mesh.faces.nbytes)
"""

PLANES = 80 * 2**20
"""Allowance for the planes at work: each is read, cast to float64 and coloured."""


@pytest.mark.parametrize("traced", [True, False], ids=["allocated", "resident"])
def test_memory_is_that_of_the_result_and_a_few_planes(traced: bool):
    if not traced and not sys.platform.startswith("linux"):
        pytest.skip("the resident size is read from /proc")
    script = PEAK_SCRIPT.format(n=256, traced=traced)
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    peak, result = map(int, done.stdout.split())
    assert result > 100 * 2**20
    assert peak < 1.25 * result + PLANES


# ---------------------------------------------------------------------------- real volumes


def real_volume(name: str) -> dict[str, NDArray]:
    folder = data_dir()
    assert folder is not None
    with np.load(folder / "volumes" / f"{name}.npz") as file:
        return dict(file)


def assert_real(mesh: Mesh, volume: Volume, spacing: NDArray, *, closed: bool) -> None:
    report = topology(*mesh)
    assert report.is_manifold
    assert not len(report.unreferenced_vertices)
    if closed:
        assert report.is_closed
    assert models.lengths(*mesh).min() > models.CLEARANCE / 2 * spacing.min()
    assert models.areas(*mesh).min() > 0
    assert (mesh.vertices >= 0).all()
    assert (mesh.vertices <= spacing * (np.array(volume.shape) - 1)).all()
    after = np.roll(mesh.faces, -1, axis=1)
    keys = np.minimum(mesh.faces, after).astype(np.int64) << 32 | np.maximum(mesh.faces, after)
    keys, counts = np.unique(keys, return_counts=True)
    p, q = np.divmod(keys[counts == 1], 2**32)
    last = spacing * (np.array(volume.shape) - 1)
    sides = np.concatenate([mesh.vertices == 0, mesh.vertices == last], axis=1)
    assert (sides[p] & sides[q]).any(axis=1).all()
    assert len(p) == report.n_boundary_edges


@needs_data
@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize(
    "name",
    [
        "mni152_mri",
        "engine_ct",
        "cranium_ct",
        pytest.param("berea_sandstone", marks=pytest.mark.slow),
        pytest.param("frog_tissue_labels", marks=pytest.mark.slow),
        pytest.param("soma_mask", marks=pytest.mark.slow),
    ],
)
def test_real_volume(name: str, closed: bool):
    found = real_volume(name)
    volume, spacing = found["data"], found["spacing"].astype(float)
    level = 0.5 if np.isnan(found["iso"]) else float(found["iso"])
    mesh = extract_isosurface(volume, level, spacing=spacing, closed=closed)
    assert_real(mesh, volume, spacing, closed=closed)


@needs_data
@pytest.mark.parametrize("lattice", ["five", "bcc"])
def test_real_volume_by_other_lattices(lattice: str):
    found = real_volume("mni152_mri")
    volume, spacing = found["data"], found["spacing"].astype(float)
    mesh = extract_isosurface(volume, 80.5, spacing=spacing, lattice=lattice)
    assert_real(mesh, volume, spacing, closed=True)


@needs_data
@every_lattice
@pytest.mark.parametrize("name", ["mni152_mri", "cranium_ct"])
def test_surfaces_of_scikit_image_are_near(name: str, lattice: str):
    """Nearly everywhere within half a sample; not where a cube is ambiguous, and cut otherwise."""
    measure = pytest.importorskip("skimage.measure")
    found = real_volume(name)
    volume, spacing = found["data"][40:110, 60:180, 40:160], found["spacing"].astype(float)
    level = float(found["iso"])
    mesh = extract_isosurface(volume, level, spacing=spacing, lattice=lattice)
    theirs = measure.marching_cubes(volume.astype(np.float32), level, spacing=tuple(spacing))[:2]
    distance = surface_distance(mesh, theirs, tolerance=0.02)
    for side, part in ((distance.a_to_b, 0.98), (distance.b_to_a, 0.9999)):
        assert (side.vertex_distances < spacing.min() / 2).mean() > part
        assert side.mean < 0.1 * spacing.min()
    assert distance.upper < 1.2 * spacing.max()


@needs_data
def test_brain():
    found = real_volume("mni152_mri")
    mesh = extract_isosurface(found["data"], 80.5, spacing=found["spacing"])
    report = topology(*mesh)
    assert len(mesh.faces) == 925_212
    assert report.euler_characteristic == -10
    assert report.is_closed


@needs_data
def test_real_volume_with_samples_equal_to_the_level():
    found = real_volume("mni152_mri")
    volume = found["data"]
    assert (volume == 80).sum() > 1000
    for normals in ("lower", "higher"):
        mesh = extract_isosurface(volume, 80.0, normals=normals)
        assert_real(mesh, volume, np.ones(3), closed=False)


@needs_data
@pytest.mark.slow
def test_every_label_of_the_frog():
    found = real_volume("frog_tissue_labels")
    labels, spacing = found["data"], found["spacing"].astype(float)
    for label in np.unique(labels[labels > 0]):
        mask = labels == label
        mesh = extract_isosurface(mask, 0.5, spacing=spacing, closed=True)
        assert_real(mesh, mask, spacing, closed=True)
