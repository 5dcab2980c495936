"""Surfaces that are simplified while they are extracted: as if they had been there as a whole."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest

import naive
from tetsimplify import (
    OptionError,
    VolumeError,
    chunks,
    extract_and_simplify,
    extract_isosurface,
    simplify,
    streaming,
    topology,
)
from tetsimplify.edges import edge_lengths
from tetsimplify.lattices import LATTICES

SEEDS = range(60)
MANY_SEEDS = range(1000, 3000)
COUNTED = (
    *("n_vertices", "n_faces", "n_edges", "euler_characteristic", "n_components"),
    *("n_boundary_loops", "n_boundary_edges", "edge_degrees"),
)


@pytest.fixture
def thin_blocks(monkeypatch):
    """Blocks of so many planes, however small these are."""

    def make(n_planes):
        monkeypatch.setattr(streaming, "SAMPLES_AT_ONCE", 1)
        monkeypatch.setattr(streaming, "LEAST_PLANES_AT_ONCE", n_planes)

    return make


def gyroid(n, n_planes=None):
    angle = 4.0 * np.pi * np.arange(n) / n
    x, y, z = np.meshgrid(
        angle[:n_planes] + 0.1, angle + 0.2, angle + 0.3, indexing="ij", sparse=True
    )
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def random_case(rng):
    """A volume with much surface, a level, and how to extract it."""
    shape = (int(rng.integers(2, 14)), *rng.integers(2, 7, 2).tolist())
    volume = rng.random(shape)
    if rng.random() < 0.3:
        volume = np.round(4.0 * volume)  # sheets that nearly touch
    level = float(np.quantile(volume, rng.uniform(0.2, 0.8)))
    return (
        volume,
        level,
        {"lattice": str(rng.choice(list(LATTICES))), "closed": bool(rng.random() < 0.4)},
    )


def check_against_the_whole(seed, thin_blocks):
    """The topology is that of the surface as a whole, and no edge is left that could go."""
    rng = np.random.default_rng(seed)
    volume, level, how = random_case(rng)
    length = float(rng.choice([0.4, 0.8, 1.5, 4.0, 100.0]))
    thin_blocks(int(rng.integers(1, 6)))
    before = volume.copy()
    result = extract_and_simplify(
        *(volume, level), max_edge_length=length, foldover=None, removal_limit=math.inf, **how
    )
    assert np.array_equal(volume, before)

    whole = extract_isosurface(volume, level, **how)
    expected, report = topology(*whole), result.report
    for name in COUNTED:
        assert getattr(report.topology_before, name) == getattr(expected, name), name
    assert (
        report.shortest_edge_before
        == simplify(*whole, max_edge_length=1e-9).report.shortest_edge_before
    )
    assert naive.has_same_topology(naive.summary(whole.faces), naive.summary(result.faces))
    assert topology(*result[:2]).same_topology(report.topology_before)

    assert naive.remaining_contractible(result.vertices, result.faces, length) == []
    short = {
        edge
        for edge in naive.all_edges(result.faces)
        if math.dist(*result.vertices[list(edge)]) < length
    }
    assert {tuple(edge) for edge in report.remaining_edges.tolist()} == short
    assert set(report.remaining) <= {"obstructed"}
    assert report.shortest_edge_after == (edge_lengths(result).min() if short else np.inf) or (
        not short
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_against_the_whole(seed, thin_blocks):
    check_against_the_whole(seed, thin_blocks)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(20))
def test_against_the_whole_at_length(block, thin_blocks):
    for seed in MANY_SEEDS[block::20]:
        check_against_the_whole(seed, thin_blocks)


@pytest.mark.parametrize("lattice", list(LATTICES))
@pytest.mark.parametrize("n_planes", [1, 2, 3, 5, 8, 40])
def test_blocks_of_any_height(lattice, n_planes, thin_blocks):
    volume = gyroid(40)
    thin_blocks(n_planes)
    result = extract_and_simplify(volume, 0.0, lattice=lattice, max_edge_length=1.5)
    whole = extract_isosurface(volume, 0.0, lattice=lattice)
    assert topology(*result[:2]).same_topology(topology(*whole))
    assert result.report.topology_before.n_faces == len(whole.faces)
    at_once = simplify(*whole, max_edge_length=1.5)
    assert len(result.faces) == pytest.approx(len(at_once.faces), rel=0.1)
    assert set(result.report.remaining) <= {"obstructed", "foldover", "removal_limit"}
    assert result.report.stop == "max_edge_length"


@pytest.mark.parametrize(
    "options",
    [
        {"blocked": "skip"},
        {"boundary": "lock"},
        {"boundary": "keep"},
        {"placement": "endpoint"},
        {"outer": "distance"},
        {"outer": "path"},
        {"removal_limit": 0.5},
        {"foldover": 30.0},
    ],
)
def test_options_reach_every_block(options, thin_blocks):
    volume = np.random.default_rng(5).random((16, 9, 9))
    thin_blocks(3)
    whole = extract_isosurface(volume, 0.5)
    result = extract_and_simplify(volume, 0.5, max_edge_length=1.5, **options)
    at_once = simplify(*whole, max_edge_length=1.5, **options)
    assert topology(*result[:2]).same_topology(topology(*whole))
    usual = {"obstructed", "foldover", "removal_limit"}
    assert set(result.report.remaining) <= usual | set(at_once.report.remaining)
    assert len(result.faces) == pytest.approx(len(at_once.faces), rel=0.1)
    if options.get("boundary") == "lock":
        on_boundary = ((whole.vertices == 0) | (whole.vertices == (15, 8, 8))).any(axis=1)
        kept = {tuple(point) for point in result.vertices.tolist()}
        assert {tuple(point) for point in whole.vertices[on_boundary].tolist()} <= kept
    if options.get("placement") == "endpoint":
        given = {tuple(point) for point in whole.vertices.tolist()}
        assert {tuple(point) for point in result.vertices.tolist()} <= given
    if options.get("blocked") == "skip":
        assert result.report.n_nested == 0


@pytest.mark.parametrize("length", [1.5, 2.5])
def test_no_dense_seams(length, thin_blocks, monkeypatch):
    """Edges are as long, and vertices as many, where blocks met as elsewhere or in one piece."""
    monkeypatch.setattr("tetsimplify.blocks.RUN", 2**40)
    volume = gyroid(96)
    thin_blocks(12)
    ends = np.array(streaming.block_ends(volume.shape)[:-1])
    assert len(ends) == 7
    seams, within = [], []
    for mesh in (
        extract_and_simplify(volume, 0.0, max_edge_length=length),
        simplify(*extract_isosurface(volume, 0.0), max_edge_length=length),
    ):
        a, b = mesh.vertices[np.array(naive.all_edges(mesh.faces)).T]
        lengths, middles = np.linalg.norm(a - b, axis=1), 0.5 * (a + b)[:, 0]
        distances = np.abs(middles[:, None] - ends).min(axis=1)
        seams.append(lengths[distances < length])
        within.append(lengths[distances > 2.0 * length])
    streamed, at_once = seams
    assert len(streamed) > 1000
    quantiles = np.linspace(0.05, 0.95, 10)
    for other in (within[0], at_once):
        np.testing.assert_allclose(
            np.quantile(streamed, quantiles), np.quantile(other, quantiles), rtol=0.1
        )
    assert len(streamed) == pytest.approx(len(at_once), rel=0.1)


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_same_bytes_for_any_number_of_threads(threads, thin_blocks):
    volume = np.random.default_rng(3).random((40, 12, 12))
    thin_blocks(4)
    one = extract_and_simplify(volume, 0.5, max_edge_length=1.2, threads=1)
    many = extract_and_simplify(volume, 0.5, max_edge_length=1.2, threads=threads)
    assert one.vertices.tobytes() == many.vertices.tobytes()
    assert one.faces.tobytes() == many.faces.tobytes()
    assert one.report.n_contractions == many.report.n_contractions
    assert one.report.topology_before.n_edges == many.report.topology_before.n_edges


class Slices:
    """A volume of which one can have slices only, and that notes them."""

    def __init__(self, volume, chunks=None):
        self._volume, self.shape, self.dtype = volume, volume.shape, volume.dtype
        self.taken = []
        if chunks is not None:
            self.chunks = chunks

    def __getitem__(self, planes):
        self.taken.append((planes.start, planes.stop))
        return self._volume[planes]


def test_same_bytes_however_the_volume_is_stored(tmp_path, thin_blocks):
    volume = gyroid(24).astype(np.float32)
    thin_blocks(5)
    expected = extract_and_simplify(volume, 0.0, max_edge_length=1.2)
    np.save(tmp_path / "volume.npy", volume)
    for other in (
        np.load(tmp_path / "volume.npy", mmap_mode="r"),
        volume.astype(np.float64),
        np.asfortranarray(volume),
        volume.astype(">f4"),
        Slices(volume, (7, 24, 24)),
        volume.tolist(),
    ):
        result = extract_and_simplify(other, 0.0, max_edge_length=1.2)
        assert result.vertices.tobytes() == expected.vertices.tobytes()
        assert result.faces.tobytes() == expected.faces.tobytes()


def test_planes_are_read_once_and_in_order(thin_blocks):
    source = Slices(gyroid(30))
    thin_blocks(4)
    extract_and_simplify(source, 0.0, max_edge_length=1.2, threads=1)
    begins, ends = zip(*source.taken, strict=True)
    assert (0, *ends[:-1]) == begins
    assert ends[-1] == 30
    assert max(np.subtract(ends, begins)) <= 4 + 1 + 2


def test_chunks_are_read_whole_and_once(thin_blocks):
    source = Slices(gyroid(30), (7, 30, 30))
    thin_blocks(4)
    extract_and_simplify(source, 0.0, max_edge_length=1.2)
    assert source.taken == [(0, 7), (7, 14), (14, 21), (21, 28), (28, 30)]


def test_large_chunks_are_read_in_parts(thin_blocks, monkeypatch):
    source = Slices(gyroid(30), (30, 30, 30))
    thin_blocks(4)
    monkeypatch.setattr(chunks, "MOST_BYTES", 10 * 30 * 30 * 8)
    extract_and_simplify(source, 0.0, max_edge_length=1.2)
    assert len(source.taken) > 5


def test_functions_centres_and_places():
    def ball(x, y, z):
        return 1.0 - x**2 - y**2 - z**2

    for lattice in LATTICES:
        result = extract_and_simplify(
            *(ball, 0.0), bounds=[(-2, 2)] * 3, shape=24, lattice=lattice, max_edge_length=0.3
        )
        radii = np.linalg.norm(result.vertices, axis=1)
        assert radii.min() > 0.9
        assert radii.max() < 1.01
        assert result.report.topology_after.genus == 0
    x, y, z = np.mgrid[-2:2:24j, -2:2:24j, -2:2:24j]
    step = 4 / 23
    volume = ball(x, y, z)
    moved = {"spacing": [step] * 3, "origin": [-2.0] * 3}
    other = extract_and_simplify(volume, 0.0, max_edge_length=0.3, **moved)
    assert np.linalg.norm(other.vertices, axis=1).max() < 1.01
    middles = np.zeros((23, 23, 23)) - 1.0  # holes in the middle of every cube
    holes = extract_and_simplify(
        volume, 0.0, lattice="bcc", centres=middles, max_edge_length=0.3, **moved
    )
    whole = extract_isosurface(volume, 0.0, lattice="bcc", centres=middles, **moved)
    assert topology(*holes[:2]).same_topology(topology(*whole))
    assert topology(*whole).n_faces > other.report.topology_before.n_faces


def test_normals_point_to_the_side_asked_for():
    x, y, z = np.mgrid[-1:1:20j, -1:1:20j, -1:1:20j]
    for normals, sign in (("lower", 1.0), ("higher", -1.0)):
        result = extract_and_simplify(
            0.8 - np.sqrt(x**2 + y**2 + z**2), 0.0, normals=normals, max_edge_length=2.0
        )
        a, b, c = (result.vertices - 9.5)[result.faces].transpose(1, 0, 2)
        assert sign * np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0


def test_level_by_otsu():
    volume = gyroid(20)
    result = extract_and_simplify(volume, "otsu", max_edge_length=1.0)
    assert result.level == extract_isosurface(volume, "otsu").level


def test_nothing_crosses_the_level():
    result = extract_and_simplify(np.zeros((9, 9, 9)), 0.5, max_edge_length=1.0)
    assert result.vertices.shape == result.faces.shape == (0, 3)
    assert result.report.topology_before.n_components == 0
    assert result.report.shortest_edge_before == np.inf


def test_the_whole_surface_is_never_there(thin_blocks):
    """Memory is that of a few blocks, whatever the number of blocks."""
    volume = gyroid(160).astype(np.float32)
    whole = extract_isosurface(volume, 0.0)
    n_bytes = whole.vertices.nbytes + whole.faces.nbytes
    assert n_bytes > 2**24
    del whole
    thin_blocks(8)
    tracemalloc.start()
    try:
        extract_and_simplify(volume, 0.0, max_edge_length=2.0, threads=1)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < n_bytes


def test_progress_rises_to_the_end_and_can_cancel(thin_blocks):
    thin_blocks(4)
    told = []
    extract_and_simplify(
        gyroid(24), 0.0, max_edge_length=1.0, progress=lambda *stage: told.append(stage)
    )
    for stage in ("isosurface", "contract"):
        parts = [done for name, done in told if name == stage]
        assert parts == sorted(parts)
        assert parts[-1] == 1.0
    assert [name for name, _ in told] == sorted((name for name, _ in told), reverse=True)

    def cancel(stage, done):
        if done > 0.4:
            raise KeyboardInterrupt

    for threads in (1, 2):
        with pytest.raises(KeyboardInterrupt):
            extract_and_simplify(
                gyroid(24), 0.0, max_edge_length=1.0, progress=cancel, threads=threads
            )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "give at least one of"),
        ({"target_faces": 100}, "target_faces needs the whole surface"),
        ({"keep_ratio": 0.1}, "keep_ratio needs the whole surface"),
        ({"max_error": 0.1}, "max_error needs the whole surface"),
        ({"max_edge_length": 1.0, "intersections": "prevent"}, "intersections='prevent' needs"),
        ({"max_edge_length": 1.0, "blocked": "violate"}, "not with blocked='violate'"),
        ({"max_quadric_error": 0.1}, "quadrics need the whole surface"),
        ({"max_edge_length": 1.0, "normal_deviation": 60.0}, "quadrics need the whole surface"),
        ({"max_edge_length": -1.0}, "max_edge_length must be at least 0"),
        ({"max_edge_length": 1.0, "normals": "up"}, "normals must be"),
        ({"max_edge_length": 1.0, "bounds": [(0, 1)] * 3}, "bounds and shape are for functions"),
        ({"max_edge_length": 1.0, "threads": 0}, "threads must be a positive integer"),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(OptionError, match=message):
        extract_and_simplify(gyroid(8), 0.0, **options)


def test_unknown_options():
    with pytest.raises(TypeError, match="no option 'max_length'"):
        extract_and_simplify(gyroid(8), 0.0, max_length=1.0)


def test_several_levels_are_refused():
    with pytest.raises(OptionError, match="level must be one number"):
        extract_and_simplify(gyroid(8), [0.0, 0.1], max_edge_length=1.0)


@pytest.mark.parametrize("threads", [1, 2])
def test_samples_that_are_not_finite(threads, thin_blocks):
    volume = gyroid(20)
    volume[17, 3, 4] = np.nan
    thin_blocks(4)
    with pytest.raises(VolumeError, match=r"got nan at index \[17, 3, 4\]"):
        extract_and_simplify(volume, 0.0, max_edge_length=1.0, threads=threads)
