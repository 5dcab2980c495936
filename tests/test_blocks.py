"""Blocks: threads that contract side by side, and what lies between them."""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.spatial import cKDTree

import meshes
import models
import naive
import strategies
import tetsimplify
from test_simplify import assert_maps_fit, assert_same_topology
from tetsimplify import blocks, crew, kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.crew import Crew
from tetsimplify.edges import edge_lengths
from tetsimplify.engine import Engine
from tetsimplify.locality import by_locality
from tetsimplify.options import Options

OFF = {"foldover": None, "removal_limit": np.inf}


@pytest.fixture
def small_blocks(monkeypatch):
    """Blocks of so few faces that small meshes have many."""
    monkeypatch.setattr(blocks, "FACES", 120)
    monkeypatch.setattr(blocks, "RUN", 120)
    monkeypatch.setattr(blocks, "LONGEST_RUN", 120)
    monkeypatch.setattr(crew, "LARGEST_PART", 100)
    monkeypatch.setattr(blocks, "MOST_SHARED", 1.0)
    monkeypatch.setattr(blocks, "CELL_BITS", 5)
    monkeypatch.setattr(blocks, "AT_ONCE", 4)
    monkeypatch.setattr("tetsimplify.engine.LEAST_SPARE", 1)


def grid_of_tubes(n=70):
    """A surface with handles and holes all over, and boundaries at the sides of a box."""
    return tetsimplify.extract_isosurface(models.gyroid(n), 0.0, spacing=(4 * np.pi / n,) * 3)


def engine_of(mesh, threads=None, **options):
    vertices, faces = as_mesh(*mesh)
    locked = np.zeros(len(vertices), bool)
    return Engine(as_mesh(vertices, faces), Options(**options), locked, threads=threads)


# --- dividing -------------------------------------------------------------------------------------


MODES_OF_DIVISION = ({"keep_ratio": 0.1}, {"max_edge_length": 1.0})  # along a curve, in runs


def faces_listed(engine, division):
    """The faces block by block."""
    in_order = np.arange(len(engine._surface.face_state))
    return division.listed[: engine.n_faces] if len(division.listed) else in_order


def blocks_of_vertices(engine, division):
    """The blocks of the faces around every vertex, from the lists of faces alone."""
    faces = engine._surface.corner_vertex.reshape(-1, 3)
    listed = faces_listed(engine, division)
    around = [set() for _ in range(len(engine._surface.vertices))]
    for first, last, _, block in division.blocks:
        for v in faces[listed[first:last]].flat:
            if v != kernels.corners.DEAD:
                around[v].add(int(block))
    return around


def is_between_blocks(engine):
    """Which vertices have faces in several blocks."""
    return np.array([len(some) > 1 for some in blocks_of_vertices(engine, engine._divide())])


@pytest.mark.parametrize("mode", MODES_OF_DIVISION, ids=lambda mode: next(iter(mode)))
@pytest.mark.parametrize("threads", (1, 3))
def test_every_face_is_in_one_block(small_blocks, mode, threads):
    engine = engine_of(meshes.icosphere(3), threads=threads, **mode)
    in_runs = "max_edge_length" in mode
    for way in range(2):
        engine.n_sweeps = way
        division = engine._divide()
        divided = division.blocks
        assert len(divided) > 8
        assert divided[0, 0] == 0 and divided[-1, 1] == engine.n_faces
        assert (divided[1:, 0] == divided[:-1, 1]).all()
        sizes = divided[:, 1] - divided[:, 0]
        assert (sizes[1:-1] >= 120).all()
        assert (60 <= sizes[0] < 120) if in_runs and way else sizes[0] >= 120
        listed = faces_listed(engine, division)
        assert np.array_equal(np.sort(listed), np.arange(engine.n_faces))
        assert not in_runs or np.array_equal(listed, np.arange(engine.n_faces))
        for of_vertex, around in zip(
            engine._surface.vertex_block, blocks_of_vertices(engine, division), strict=True
        ):
            assert {int(of_vertex)} == (around if len(around) == 1 else {kernels.blocks.SHARED})


def test_what_lies_between_blocks_is_inside_of_those_of_the_other_way():
    """Where both ways have a border no edge can be contracted: only few may be there."""
    mesh = grid_of_tubes(80)
    engine = engine_of(mesh, keep_ratio=0.1)
    borders = []
    for way in range(2):
        engine.n_sweeps = way
        borders.append(is_between_blocks(engine))
    assert 0.02 < borders[0].mean() < 0.2
    assert 0.02 < borders[1].mean() < 0.2
    assert (borders[0] & borders[1]).mean() < 0.02


def test_faces_in_no_order_are_not_divided_in_runs(small_blocks, monkeypatch):
    """Much would lie between runs of them; they are put in order, too."""
    monkeypatch.setattr(blocks, "MOST_SHARED", 0.2)
    monkeypatch.setattr(blocks, "RUN", 8000)
    monkeypatch.setattr(blocks, "LONGEST_RUN", 8000)
    vertices, faces = grid_of_tubes(60)
    shuffled = faces[np.random.default_rng(0).permutation(len(faces))]
    assert engine_of((vertices, faces), max_edge_length=1.0)._arranged.is_as_given
    assert not engine_of((vertices, shuffled), max_edge_length=1.0)._arranged.is_as_given
    result = tetsimplify.simplify(vertices, shuffled, max_edge_length=0.4)
    assert_maps_fit(vertices, shuffled, result)
    assert len(result.faces) < 0.6 * len(faces)
    assert_same_topology(shuffled, result)


def test_shuffled_meshes_are_put_in_order(small_blocks):
    """Neighbours in memory are neighbours in space, and results keep the order given."""
    rng = np.random.default_rng(0)
    vertices, faces = meshes.icosphere(4)
    place = rng.permutation(len(vertices))
    shuffled = np.empty_like(vertices)
    shuffled[place] = vertices
    mesh = as_mesh(shuffled, place[faces][rng.permutation(len(faces))])
    arranged = by_locality(mesh, Crew(2))
    assert np.array_equal(mesh.vertices[arranged.vertex_origin], arranged.vertices)
    assert np.array_equal(
        arranged.vertex_origin[arranged.vertex_place], np.arange(len(mesh.vertices))
    )
    origin = arranged.vertex_origin[arranged.faces]
    assert np.array_equal(origin, mesh.faces[arranged.face_origin])
    a, b, _ = arranged.faces.T
    assert np.median(np.abs(a - b)) < len(vertices) / 20 < np.median(np.abs(origin[:, 0] - b))
    assert_maps_fit(*mesh, tetsimplify.simplify(*mesh, max_edge_length=0.3))


@pytest.mark.parametrize("size", [1e-310, 1e-300, 1e300, 1.7e308])
@pytest.mark.parametrize("mode", MODES_OF_DIVISION, ids=lambda mode: next(iter(mode)))
def test_the_curve_stays_in_its_cells_whatever_the_size(small_blocks, mode, size):
    vertices, faces = meshes.icosphere(3)
    options = {name: value * (size if "length" in name else 1) for name, value in mode.items()}
    with np.errstate(over="ignore"):
        result = tetsimplify.simplify(vertices * size, faces[::-1], **options)
    assert_same_topology(faces, result)


# --- the promises ---------------------------------------------------------------------------------


def same(one, two):
    return (
        one.vertices.tobytes() == two.vertices.tobytes()
        and one.faces.tobytes() == two.faces.tobytes()
        and one.vertex_map.tobytes() == two.vertex_map.tobytes()
        and one.face_map.tobytes() == two.face_map.tobytes()
        and one.report.stop == two.report.stop
        and np.array_equal(one.report.remaining_edges, two.report.remaining_edges)
        and np.array_equal(one.report.remaining_reasons, two.report.remaining_reasons)
    )


MODES = (
    {"max_edge_length": 0.7},
    {"keep_ratio": 0.1},
    {"keep_ratio": 0.2, "cost": "length"},
    {"max_quadric_error": 0.05},
    {"keep_ratio": 0.3, "boundary": "keep", "feature_angle": 20.0},
)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: "-".join(mode))
def test_threads_make_no_difference(small_blocks, mode):
    vertices, faces = grid_of_tubes(24)
    data = {"height": vertices[:, 2].copy(), "label": np.arange(len(vertices))}
    run = lambda threads: tetsimplify.simplify(  # noqa: E731
        vertices, faces, **mode, threads=threads, vertex_data=data
    )
    expected = run(1)
    assert len(expected.faces) < 0.6 * len(faces)
    for threads in (1, 2, 3, 8, None):
        result = run(threads)
        assert same(expected, result)
        for name in data:
            assert np.array_equal(expected.vertex_data[name], result.vertex_data[name])


def test_runs_side_by_side_make_no_difference(small_blocks):
    vertices, faces = grid_of_tubes(24)
    expected = tetsimplify.simplify(vertices, faces, keep_ratio=0.1, threads=1)
    with ThreadPoolExecutor(4) as pool:
        results = pool.map(
            lambda threads: tetsimplify.simplify(vertices, faces, keep_ratio=0.1, threads=threads),
            (1, 2, 3, 1),
        )
        assert all(same(expected, result) for result in results)


@pytest.mark.parametrize("seed", range(60))
def test_topology_is_kept_and_nothing_contractible_is_left(small_blocks, monkeypatch, seed):
    monkeypatch.setattr(blocks, "FACES", 8)
    monkeypatch.setattr(blocks, "RUN", 8)
    monkeypatch.setattr(blocks, "LONGEST_RUN", 8)
    monkeypatch.setattr(blocks, "CELL_BITS", 1)
    vertices, faces = strategies.adversarial_mesh(seed)
    result = tetsimplify.simplify(vertices, faces, max_edge_length=1e6, threads=2, **OFF)
    assert_same_topology(faces, result)
    assert_maps_fit(vertices, faces, result)
    assert not naive.remaining_contractible(result.vertices, result.faces, 1e6)
    for mode in MODES[1:4]:
        result = tetsimplify.simplify(vertices, faces, threads=2, **mode)
        assert_same_topology(faces, result)
        least = math.ceil(mode.get("keep_ratio", 0.0) * len(faces))
        assert len(result.faces) >= min(least, len(faces))


@pytest.mark.slow
@pytest.mark.parametrize("block", range(10))
def test_topology_is_kept_in_blocks_at_length(small_blocks, monkeypatch, block):
    monkeypatch.setattr(blocks, "FACES", 8)
    monkeypatch.setattr(blocks, "RUN", 8)
    monkeypatch.setattr(blocks, "LONGEST_RUN", 8)
    monkeypatch.setattr(blocks, "CELL_BITS", 1)
    for seed in range(block, 4_000, 10):
        vertices, faces = strategies.adversarial_mesh(seed)
        result = tetsimplify.simplify(vertices, faces, max_edge_length=1e6, threads=2, **OFF)
        assert_same_topology(faces, result)
        assert not naive.remaining_contractible(result.vertices, result.faces, 1e6)


def test_boundary_loops_across_blocks_keep_three_edges(small_blocks):
    """Punched sheets, everything contracted that can be: loops of three edges are left."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        vertices, faces = meshes.grid(24, 24)
        centres = vertices[faces].mean(axis=1)
        holes = rng.uniform(2.0, 22.0, (5, 2))
        is_hole = (np.linalg.norm(centres[:, None, :2] - holes, axis=2) < 2.2).any(axis=1)
        repaired = tetsimplify.repair(vertices, faces[~is_hole])
        mesh = repaired.vertices, repaired.faces
        for mode in ({"max_edge_length": 1e6, **OFF}, {"target_faces": 1, "foldover": None}):
            result = tetsimplify.simplify(*mesh, threads=2, **mode)
            assert_same_topology(mesh[1], result)


def test_invariants_after_every_sweep_over_blocks(small_blocks):
    mesh = grid_of_tubes(24)
    before = naive.summary(mesh.faces)
    engine = engine_of(mesh, max_edge_length=1.0)
    assert engine.is_divided
    n_contracted = 0
    for _ in range(6):
        n_contracted += engine.sweep_divided()
        surface, live = engine._surface, engine.mesh()
        assert len(live.faces) == engine.n_faces
        assert naive.has_same_topology(before, naive.summary(live.faces))
        assert (surface.vertex_block == 0).all() and (surface.loop_home == 0).all()
        is_on = (surface.loop >= 0) & (surface.merged_into == np.arange(len(surface.loop)))
        sizes = np.bincount(surface.loop[is_on], minlength=len(surface.loop_size))
        assert np.array_equal(surface.loop_size, sizes)
        engine.compact_when_half()
    assert n_contracted > 1000


# --- seams ----------------------------------------------------------------------------------------


QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def borders_of(mesh, options, way):
    """Where the blocks of a way meet, to be asked for the distance of points."""
    engine = engine_of(mesh, **options)
    engine.n_sweeps = way
    assert len(engine._divide().blocks) > 50
    is_between = engine._surface.vertex_block == kernels.blocks.SHARED
    return cKDTree(engine._surface.vertices[is_between, :3])


def sizes(result, borders, length):
    """Quantiles of edge lengths and of roots of face areas, near borders and far from them."""
    a, b, c = result.vertices[result.faces.T]
    for sizes, middles in (
        (np.linalg.norm(b - a, axis=1), (a + b) / 2),
        (np.sqrt(np.linalg.norm(np.cross(b - a, c - a), axis=1)), (a + b + c) / 3),
    ):
        away = borders.query(middles, distance_upper_bound=2 * length)[0]
        for there in (away < length / 2, away > 2 * length):
            assert there.sum() > 1_000
            yield np.quantile(sizes[there], QUANTILES)


@pytest.mark.parametrize("mode", ["max_edge_length", "keep_ratio"])
def test_no_seams_are_left_between_blocks(mode, monkeypatch):
    """Edges and faces where a border was are as large as where there never was one.

    Those of the same places are compared, since some places have larger faces than others: with the
    surface as it comes out in one piece. Inside of blocks hardly anything may differ.
    """
    monkeypatch.setattr(blocks, "RUN", blocks.FACES)
    monkeypatch.setattr(blocks, "LONGEST_RUN", blocks.FACES)
    monkeypatch.setattr(blocks, "MOST_SHARED", 1.0)
    mesh = grid_of_tubes(100)
    length = 1.5 * float(np.median(edge_lengths(mesh)))
    options = {"max_edge_length": length} if mode == "max_edge_length" else {"keep_ratio": 0.15}
    borders = [borders_of(mesh, options, way) for way in range(2)]
    divided = tetsimplify.simplify(*mesh, **options)
    monkeypatch.setattr("tetsimplify.engine.LEAST_BLOCKS", 2**40)
    whole = tetsimplify.simplify(*mesh, **options)
    assert not same(divided, whole)
    for there in borders:
        for k, (found, expected) in enumerate(
            zip(sizes(divided, there, length), sizes(whole, there, length), strict=True)
        ):
            most = 0.1 if k % 2 == 0 else 0.03
            assert np.abs(found / expected - 1.0).max() < most
