"""Contraction against the oracle, on adversarial surfaces, in every mode."""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import naive
import strategies
import tetsimplify
from corner_tables import assert_engine_in_order
from tetsimplify import blocks, kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.engine import Engine
from tetsimplify.options import BLOCKED, OUTER, PLACEMENTS, Options

SEEDS = range(2_000)
MANY_SEEDS = range(2_000, 40_000)
KEEPING_TOPOLOGY = [mode for mode in BLOCKED if mode != "violate"]


def some_length(vertices, faces, rng):
    """A length that a good part of the edges is shorter than; at times all of them."""
    lengths = edge_lengths(vertices, faces)
    return float(np.quantile(lengths, rng.uniform(0.2, 1.0)) * rng.choice([1.001, 1.5, 20.0]))


def edge_lengths(vertices, faces):
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)


def assert_same_topology(faces, result):
    before, after = naive.summary(faces), naive.summary(result.faces)
    assert after.is_sound
    assert naive.has_same_topology(before, after)
    assert result.report.topology_after.same_topology(result.report.topology_before)


def assert_maps_fit(vertices, faces, result):
    """Every face of the result is an old face with its vertices renamed."""
    old = np.asarray(faces)[result.face_map]
    assert np.array_equal(result.vertex_map[old], result.faces)
    assert len(np.unique(result.face_map)) == len(result.faces)
    assert set(result.vertex_map.tolist()) - {-1} == set(range(len(result.vertices)))


def assert_remaining_listed(result, max_edge_length):
    """The report lists exactly the short edges of the result."""
    short = {
        edge
        for edge in naive.all_edges(result.faces)
        if math.dist(*result.vertices[list(edge)]) < max_edge_length
    }
    assert {tuple(edge) for edge in result.report.remaining_edges.tolist()} == short
    assert len(result.report.remaining_reasons) == len(short)


def check_against_oracle(seed):
    """No violation and no contractible short edge left, and every reason is the true one."""
    rng = np.random.default_rng(seed)
    vertices, faces = strategies.adversarial_mesh(seed)
    length = some_length(vertices, faces, rng)
    limit = 0.5 * length if seed % 4 == 1 else math.inf
    locked = rng.choice(len(vertices), min(3, len(vertices)), False) if seed % 4 == 2 else []
    result = tetsimplify.simplify(
        vertices,
        faces,
        max_edge_length=length,
        foldover=None,
        removal_limit=limit,
        locked=locked,
        outer=OUTER[seed % len(OUTER)] if seed % 4 == 3 else "region",
        placement=list(PLACEMENTS)[seed % len(PLACEMENTS)],
    )
    assert_same_topology(faces, result)
    assert_maps_fit(vertices, faces, result)
    assert_remaining_listed(result, length)
    kept = result.vertex_map[locked].tolist()
    assert np.array_equal(result.vertices[kept], vertices[locked])
    coned = naive.cone(result.faces)

    def is_contractible(edge, **limits):
        return naive.is_contractible(result.vertices, coned, *edge, **limits)

    report = result.report
    for edge, reason in zip(report.remaining_edges.tolist(), report.remaining_reasons, strict=True):
        if reason == "obstructed":
            assert not is_contractible(edge)
        elif reason == "removal_limit":
            assert is_contractible(edge)
            assert not is_contractible(edge, removal_limit=limit, limit_on="vanishing")
        else:
            assert reason == "locked"
            assert not is_contractible(edge, locked=tuple(kept))


@pytest.mark.parametrize("block", range(10))
def test_against_the_oracle(block):
    for seed in SEEDS[block::10]:
        check_against_oracle(seed)


@pytest.mark.slow
@pytest.mark.parametrize("block", range(100))
def test_against_the_oracle_at_length(block):
    for seed in MANY_SEEDS[block::100]:
        check_against_oracle(seed)


@pytest.mark.parametrize("blocked", BLOCKED)
@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("foldover", [None, 90.0, 30.0])
@pytest.mark.parametrize("outer", OUTER)
def test_invariants_after_every_sweep(blocked, placement, foldover, outer):
    for seed in range(0, 60, 3):
        rng = np.random.default_rng(seed)
        vertices, faces = strategies.adversarial_mesh(seed)
        before = naive.summary(faces)
        options = Options(
            max_edge_length=some_length(vertices, faces, rng),
            blocked=blocked,
            placement=placement,
            outer=outer,
            foldover=foldover,
        )
        engine = Engine(as_mesh(vertices, faces), options, np.zeros(len(vertices), bool))
        for _ in range(100):
            n_before = engine.n_faces
            n_contracted = engine.sweep()
            live = engine.mesh()
            assert engine.n_faces == len(live.faces)
            assert (engine.n_faces < n_before) == (n_contracted > 0)
            if blocked in KEEPING_TOPOLOGY:
                after = naive.summary(live.faces)
                assert after.is_sound
                assert naive.has_same_topology(before, after)
                assert_engine_in_order(engine)
            engine.compact_when_half()
            if n_contracted == 0:
                break
        else:
            pytest.fail("sweeps do not come to an end")


@settings(max_examples=150, deadline=None)
@given(strategies.surfaces(), st.floats(0.01, 10.0), st.sampled_from(KEEPING_TOPOLOGY))
def test_topology_is_kept_with_the_default_guards(mesh, length, blocked):
    vertices, faces = mesh
    result = tetsimplify.simplify(vertices, faces, max_edge_length=length, blocked=blocked)
    assert_same_topology(faces, result)
    assert_maps_fit(vertices, faces, result)
    assert_remaining_listed(result, length)
    reasons = {"obstructed", "removal_limit", "foldover"}
    assert set(result.report.remaining) <= reasons | {"skipped"}


def test_only_obstructed_edges_remain_without_guards():
    for seed in range(100):
        vertices, faces = strategies.adversarial_mesh(seed)
        result = tetsimplify.simplify(
            vertices, faces, max_edge_length=1e6, foldover=None, removal_limit=np.inf
        )
        assert set(result.report.remaining) <= {"obstructed"}


def test_skip_contracts_no_blocked_edge():
    vertices, faces = meshes.stack_of_spikes(4)
    result = tetsimplify.simplify(
        vertices, faces, max_edge_length=1e6, blocked="skip", foldover=None
    )
    assert result.report.n_nested == 0
    assert "skipped" in result.report.remaining


def test_violate_breaks_the_topology_where_contract_keeps_it():
    vertices, faces = meshes.two_balloons_on_a_neck(meshes.icosphere(0), meshes.icosphere(1))
    options = {"max_edge_length": 1e6, "foldover": None}
    broken = tetsimplify.simplify(vertices, faces, blocked="violate", **options)
    kept = tetsimplify.simplify(vertices, faces, removal_limit=np.inf, **options)
    assert not broken.report.topology_after.same_topology(broken.report.topology_before)
    assert kept.report.topology_after.same_topology(kept.report.topology_before)


def test_tetrahedron_stays():
    vertices, faces = meshes.tetrahedron()
    result = tetsimplify.simplify(vertices, faces, max_edge_length=1e6, foldover=None)
    assert np.array_equal(result.vertices, vertices)
    assert np.array_equal(result.faces, faces)
    assert result.report.remaining == {"obstructed": 6}


@pytest.mark.parametrize("mesh", [meshes.octahedron(), meshes.icosphere(1)])
def test_sphere_becomes_a_tetrahedron(mesh):
    result = tetsimplify.simplify(*mesh, max_edge_length=1e6, foldover=None)
    assert len(result.faces) == 4
    assert result.report.topology_after.euler_characteristic == 2


def test_tip_of_a_spike_beyond_the_limit_stays():
    """The tip is on no lens's inside but vanishes all the same."""
    vertices, faces = meshes.spike(50.0)
    vertices[0] = vertices[1] + 0.2 * (vertices[0] - vertices[1])
    length = 1.01 * math.dist(vertices[0], vertices[1])
    options = {"max_edge_length": length, "foldover": None}
    limited = tetsimplify.simplify(vertices, faces, removal_limit=5.0, **options)
    free = tetsimplify.simplify(vertices, faces, removal_limit=np.inf, **options)
    assert limited.report.remaining == {"removal_limit": 1}
    assert limited.vertex_map[6] >= 0
    assert free.report.n_lens_vertices == 1
    assert free.vertex_map[6] == -1


def test_hole_in_a_torus_with_interleaved_rims():
    """An inside vertex next to the rim of another lens: the 3-cycle does not separate.

    The smallest mesh for which growing regions that never met were taken for discs.
    """
    faces = np.array(
        [[6, 1, 2], [0, 5, 1], [0, 1, 4], [1, 3, 4], [3, 2, 4], [0, 4, 6], [5, 4, 2], [5, 2, 1]]
        + [[2, 0, 6]]
    )
    vertices = np.random.default_rng(0).normal(size=(7, 3))
    result = tetsimplify.simplify(
        vertices, faces, max_edge_length=1e6, foldover=None, removal_limit=np.inf
    )
    assert_same_topology(faces, result)
    assert not naive.remaining_contractible(result.vertices, result.faces, 1e6)


def test_foldover_guard_bounds_the_turn_of_every_face():
    volume = np.random.default_rng(1).normal(size=(5, 5, 5))
    vertices, faces = tetsimplify.extract_isosurface(volume, 0.0)
    options = Options(max_edge_length=0.6, foldover=40.0)
    engine = Engine(as_mesh(vertices, faces), options, np.zeros(len(vertices), bool))
    turned = 0
    previous = normals_of(engine)
    listed = np.arange(len(faces), dtype=np.int32)
    for first in range(len(faces)):
        bundles = engine._surface, None, None, engine._scratch, engine.rules, listed
        one_face = blocks.parts(len(faces), 1)[first : first + 1]
        if kernels.sweep.sweep(*bundles, one_face, 1, kernels.state.STALE_EVEN, True) == 0:
            continue  # one contraction at a time, because two may turn the same face
        current = normals_of(engine)
        for face in current.keys() & previous.keys():
            cosine = float(current[face] @ previous[face])
            assert cosine >= math.cos(math.radians(40.0)) - 1e-9
            turned += cosine < 1.0 - 1e-12
        previous = current
    assert turned > 100


def normals_of(engine):
    """Unit normals of the live faces by their old numbers; of those that have one."""
    surface = engine._surface
    corner_vertex = surface.corner_vertex.reshape(-1, 3)
    normals = {}
    for face in np.flatnonzero(corner_vertex[:, 0] >= 0):
        a, b, c = surface.vertices[corner_vertex[face]]
        normal = np.cross(b - a, c - a)
        if np.linalg.norm(normal) > 1e-12:
            normals[face] = normal / np.linalg.norm(normal)
    return normals


def test_boundary_vertices_stay_on_the_boundary():
    vertices, faces = meshes.grid(12, 12)
    flat = np.column_stack([vertices[:, :2], np.zeros(len(vertices))])
    flat[:, 0] = np.repeat(np.linspace(0, 1, 13), 13)
    flat[:, 1] = np.tile(np.linspace(0, 1, 13), 13)
    result = tetsimplify.simplify(flat, faces, max_edge_length=0.3, foldover=None)
    ends = tetsimplify.topology(result.vertices, result.faces)
    assert ends.n_boundary_loops == 1
    degree = {edge: len(at) for edge, at in naive.faces_at_edges(result.faces.tolist()).items()}
    rim = {v for edge, count in degree.items() if count == 1 for v in edge}
    old_rim = {0, 12} | set(range(13)) | {13 * i for i in range(13)}
    old_rim |= {13 * i + 12 for i in range(13)} | set(range(156, 169))
    assert {int(result.vertex_map[v]) for v in old_rim} - {-1} == rim


def test_endpoint_placement_invents_no_vertex():
    vertices, faces = meshes.icosphere(3)
    result = tetsimplify.simplify(vertices, faces, max_edge_length=0.5, placement="endpoint")
    assert {tuple(v) for v in result.vertices} <= {tuple(v) for v in vertices}
    assert len(result.faces) < len(faces) / 2


def test_vertex_and_face_data_are_carried():
    vertices, faces = meshes.icosphere(3)
    gradient = np.array([[1.0, 2.0], [-3.0, 0.5], [0.25, 4.0]])
    label = (vertices[:, 0] > 0).astype(np.uint8) * 7
    result = tetsimplify.simplify(
        vertices,
        faces,
        max_edge_length=0.4,
        vertex_data={
            "field": vertices @ gradient + 1.0,
            "single": vertices.astype(np.float32),
            "label": label,
            "name": np.where(label > 0, "right", "left"),
        },
        face_data={"number": np.arange(len(faces)), "normal": np.ones((len(faces), 3))},
    )
    assert np.allclose(result.vertex_data["field"], result.vertices @ gradient + 1.0, atol=1e-12)
    assert result.vertex_data["single"].dtype == np.float32
    assert set(np.unique(result.vertex_data["label"])) == {0, 7}
    assert result.vertex_data["label"].dtype == np.uint8
    assert set(result.vertex_data["name"]) == {"left", "right"}
    assert np.array_equal(result.face_data["number"], result.face_map)
    assert result.face_data["normal"].shape == (len(result.faces), 3)


def test_data_and_maps_lead_through_repair():
    vertices, faces = meshes.bow_tie()
    result = tetsimplify.simplify(
        vertices,
        faces,
        max_edge_length=0.0,
        repair=True,
        vertex_data={"old": np.arange(len(vertices))},
        face_data={"old": np.arange(len(faces))},
    )
    assert result.report.repairs.vertices_split == 1
    assert np.array_equal(result.vertices, vertices[result.vertex_data["old"]])
    assert np.array_equal(result.face_data["old"], result.face_map)
    assert (result.vertex_map >= 0).all()


def test_nothing_given_is_changed():
    vertices, faces = meshes.icosphere(2)
    locked = np.zeros(len(vertices), bool)
    data = {"x": vertices[:, 0].copy()}
    copies = vertices.copy(), faces.copy(), locked.copy(), data["x"].copy()
    tetsimplify.simplify(vertices, faces, max_edge_length=0.5, locked=locked, vertex_data=data)
    for given_array, copy in zip((vertices, faces, locked, data["x"]), copies, strict=True):
        assert np.array_equal(given_array, copy)
        given_array.flags.writeable = False
    tetsimplify.simplify(vertices, faces, max_edge_length=0.5, locked=locked, vertex_data=data)


def test_same_input_same_bytes():
    vertices, faces = tetsimplify.extract_isosurface(
        np.random.default_rng(0).normal(size=(20, 20, 20)), 0.0
    )
    first = tetsimplify.simplify(vertices, faces, max_edge_length=0.8)
    second = tetsimplify.simplify(
        np.asfortranarray(vertices).astype(">f8"), faces.astype(np.uint64), max_edge_length=0.8
    )
    for a, b in zip(first[:4], second[:4], strict=True):
        assert a.tobytes() == b.tobytes()


def test_short_edge_is_one_shorter_than_the_limit():
    vertices, faces = meshes.octahedron()
    shortest = edge_lengths(vertices, faces).min()
    same = tetsimplify.simplify(vertices, faces, max_edge_length=shortest)
    fewer = tetsimplify.simplify(
        vertices, faces, max_edge_length=np.nextafter(shortest, 9.0) * 1.01
    )
    assert np.array_equal(same.faces, faces)
    assert len(fewer.faces) < len(faces)


@pytest.mark.parametrize(
    "mesh",
    [
        (np.empty((0, 3)), np.empty((0, 3), int)),
        ([], []),
        (np.eye(3), np.empty((0, 3), int)),
        (np.eye(3), [[0, 1, 2]]),
    ],
)
def test_empty_and_tiny_meshes(mesh):
    result = tetsimplify.simplify(*mesh, max_edge_length=1.0)
    assert result.faces.shape == (len(mesh[1]), 3)
    assert result.report.topology_after.is_manifold


def test_unreferenced_vertices_are_dropped_and_told():
    vertices, faces = meshes.unused_vertices()
    result = tetsimplify.simplify(vertices, faces, max_edge_length=0.0)
    unused = result.report.topology_before.unreferenced_vertices
    assert len(unused) > 0
    assert (result.vertex_map[unused] == -1).all()


def test_progress_rises_to_the_end_and_can_cancel():
    vertices, faces = meshes.icosphere(3)
    calls = []
    tetsimplify.simplify(
        vertices,
        faces,
        max_edge_length=0.5,
        progress=lambda stage, done: calls.append((stage, done)),
    )
    for stage in {name for name, _ in calls}:
        done = [value for name, value in calls if name == stage]
        assert done == sorted(done)
        assert 0.0 <= done[0] and done[-1] <= 1.0
    assert calls[-1][1] == 1.0

    def cancel(stage, done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tetsimplify.simplify(vertices, faces, max_edge_length=0.5, progress=cancel)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("max_edge_length", -1.0, "max_edge_length must be at least 0, got -1"),
        ("max_edge_length", float("nan"), "max_edge_length must be"),
        ("max_edge_length", "long", "max_edge_length must be a number, got 'long'"),
        ("blocked", "keep", "blocked must be one of 'contract', 'skip', 'violate', got 'keep'"),
        ("placement", "optimal", "placement must be one of"),
        ("outer", "nearest", "outer must be one of 'region', 'path', 'distance'"),
        ("removal_limit", -1, "removal_limit must be at least 0"),
        ("foldover", 200.0, "foldover must be from 0 to 180"),
        ("locked", [99], "locked must hold vertex indices from 0 to 5, got 99 to 99"),
        ("locked", [True], r"locked must have shape \(6,\), got \(1,\)"),
        ("locked", [0.5], "locked must be a boolean mask or a list of vertex indices"),
        ("vertex_data", {"t": [1.0]}, r"vertex_data\['t'\] must have shape \(6, ...\), got \(1,\)"),
        ("face_data", {"t": 3}, r"face_data\['t'\] must have shape \(8, ...\)"),
    ],
)
def test_wrong_options(option, value, message):
    options = {"max_edge_length": 1.0, option: value}
    with pytest.raises(tetsimplify.OptionError, match=message):
        tetsimplify.simplify(*meshes.octahedron(), **options)


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (meshes.bow_tie(), "1 vertices with more than one fan of faces: 0"),
        (meshes.three_pages(), r"1 edges with more than two faces: \[0, 1\]"),
        (meshes.flipped_face(), "edges with inconsistently oriented faces"),
        (meshes.moebius_strip(), "inconsistently oriented"),
        (meshes.double_covered_triangle(), "1 duplicate faces: 1"),
        (meshes.collapsed_face(), "degenerate faces"),
    ],
)
def test_what_is_no_manifold_is_refused_and_repaired(mesh, message):
    with pytest.raises(tetsimplify.MeshError, match=message):
        tetsimplify.simplify(*mesh, max_edge_length=0.0)
    result = tetsimplify.simplify(*mesh, max_edge_length=0.0, repair=True)
    assert result.report.topology_after.is_manifold
    assert result.report.repairs is not None


def test_lens_marks_start_anew(monkeypatch):
    """Stamps are int32; a run that would give too many of them goes on all the same."""
    options = {"max_edge_length": 1e6, "foldover": None, "removal_limit": np.inf}
    for seed in range(40):
        mesh = strategies.adversarial_mesh(seed)
        monkeypatch.setattr("tetsimplify.start.STAMP_LIMIT", 2**30)
        expected = tetsimplify.simplify(*mesh, **options)
        monkeypatch.setattr("tetsimplify.start.STAMP_LIMIT", 5)
        assert np.array_equal(tetsimplify.simplify(*mesh, **options).faces, expected.faces)


def test_pieces_of_a_sweep_make_no_difference(monkeypatch):
    vertices, faces = meshes.icosphere(4)
    expected = tetsimplify.simplify(vertices, faces, max_edge_length=0.3)
    monkeypatch.setattr("tetsimplify.engine.FACES_AT_ONCE", 17)
    pieces = tetsimplify.simplify(vertices, faces, max_edge_length=0.3)
    assert np.array_equal(pieces.faces, expected.faces)
    assert np.array_equal(pieces.vertices, expected.vertices)


def test_several_threads_at_once():
    volume = np.random.default_rng(5).normal(size=(24, 24, 24))
    mesh = tetsimplify.extract_isosurface(volume, 0.0)
    expected = tetsimplify.simplify(*mesh, max_edge_length=0.8)
    with ThreadPoolExecutor(8) as pool:
        runs = [pool.submit(tetsimplify.simplify, *mesh, max_edge_length=0.8) for _ in range(16)]
        for run in runs:
            assert np.array_equal(run.result().vertices, expected.vertices)
            assert np.array_equal(run.result().faces, expected.faces)
