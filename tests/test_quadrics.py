"""Quadric mode: a face count, a ratio or an error to reach; costs, placements, guards, stops."""

import math

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import models
import naive
import naive_quadrics
import strategies
import tetsimplify
from corner_tables import assert_engine_in_order
from test_simplify import assert_maps_fit, assert_remaining_listed, assert_same_topology
from tetsimplify import kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.edges import edge_lengths
from tetsimplify.engine import Engine
from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.cost import COLUMNS, LEAST, _ranked_cost, is_ranked
from tetsimplify.kernels.quadrics import CONSTANT, LINEAR
from tetsimplify.options import BLOCKED, BOUNDARIES, PLACEMENTS, Options
from tetsimplify.schedule import next_thresholds, run
from tetsimplify.start import new_quadrics

OFF = {"foldover": None, "normal_deviation": None, "shape": None}
MODES = [
    {"cost": cost, "placement": placement, "boundary": boundary}
    for cost in ("length", "quadric")
    for placement in PLACEMENTS
    for boundary in BOUNDARIES
]


def torus():
    x, y, z = np.mgrid[-1.1:1.1:40j, -1.1:1.1:40j, -0.5:0.5:18j]
    return tetsimplify.extract_isosurface(0.3 - np.hypot(np.hypot(x, y) - 0.6, z), 0.0)


def flat_square(n=12):
    """A unit square in a plane that no axis is normal to, and the directions of its sides."""
    _, faces = meshes.grid(n, n)
    s, t = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    along = np.array([2.0, 1.0, 2.0]) / 3.0
    across = np.array([-2.0, 2.0, 1.0]) / 3.0
    return s.reshape(-1, 1) * along + t.reshape(-1, 1) * across, faces


def cube(n):
    """A cube of side 2 with flat sides of n x n squares, closed."""
    x, y, z = np.mgrid[0 : n + 1, 0 : n + 1, 0 : n + 1].reshape(3, -1)
    number = np.full((n + 1) ** 3, -1)
    outer = np.flatnonzero(
        (np.minimum.reduce([x, y, z]) == 0) | (np.maximum.reduce([x, y, z]) == n)
    )
    number[outer] = np.arange(len(outer))

    def at(p):
        return number[(p[0] * (n + 1) + p[1]) * (n + 1) + p[2]]

    faces = []
    for axis in range(3):
        for side in (0, n):
            for i in range(n):
                for j in range(n):
                    ring = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        point = [0, 0, 0]
                        point[axis] = side
                        point[(axis + 1) % 3], point[(axis + 2) % 3] = i + di, j + dj
                        ring.append(at(point))
                    ring = ring if side else ring[::-1]
                    faces += [[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]]
    points = np.stack([x, y, z], axis=1)[outer] * 2.0 / n - 1.0
    return points, np.array(faces)


def tube(n_around=48, n_along=24):
    """An open cylinder of radius 1."""
    faces = meshes.quads_cut(n_around, n_along, (n_around, n_along + 1))
    angle = 2 * np.pi * np.arange(n_around) / n_around
    height = np.linspace(0, 2, n_along + 1)
    points = [[math.cos(a), math.sin(a), h] for a in angle for h in height]
    return np.array(points), faces


# --- the quadrics themselves ----------------------------------------------------------------------


def zero_quadrics(n):
    """Quadrics that stand for no planes."""
    quadrics = new_quadrics(n)
    quadrics.matrix[:] = quadrics.origin[:] = 0.0
    return quadrics


def quadrics_of(vertices, faces):
    mesh = as_mesh(vertices, faces)
    n = len(mesh.vertices)
    quadrics = new_quadrics(n)
    quadrics.matrix[:] = quadrics.origin[:] = np.nan  # all of it is to be filled
    corner_vertex = mesh.faces.reshape(-1)
    first_corner, next_corner, _ = kernels.corners.link_corners(corner_vertex, n)
    planes = np.full((len(mesh.faces), 4), np.nan)
    kernels.quadrics.find_planes(mesh.vertices, corner_vertex, 1.0, 0, len(planes), planes)
    kernels.quadrics.sum_planes(planes, next_corner, first_corner, 0, n, quadrics)
    return quadrics


def matrix(q):
    """The symmetric matrix of a quadric."""
    return np.array([[q[0], q[1], q[2]], [q[1], q[3], q[4]], [q[2], q[4], q[5]]])


def error_at(quadrics, vertices, v, u, point):
    """The quadric of two vertices at a point, as the kernels accumulate it."""
    q = kernels.quadrics.sum_at.py_func(quadrics, vertices, v, u)
    y = point - vertices[v]
    return float(y @ matrix(q) @ y + 2.0 * np.dot(q[6:9], y) + q[9])


def test_a_sample_of_costs_is_that_of_ranked_edges_that_may_go():
    vertices, faces = meshes.grid(60, 60)
    locked = np.random.default_rng(0).random(len(vertices)) < 0.3
    engine = Engine(as_mesh(vertices, faces), Options(keep_ratio=0.2), locked)
    for share in (0.05, 0.3):
        costs = engine.sample_of_costs()
        rows = engine._cost.reshape(-1, COLUMNS)[:, :LEAST]
        rows = rows[engine._surface.face_state == kernels.state.RANKED]
        assert costs.tolist() == sorted(rows[rows < np.inf].tolist())
        assert len(costs) < rows.size  # locked ends, and edges seen from the other face
        engine.sweep_ranked(costs[[int(share * len(costs))]].astype(np.float64))


@pytest.mark.parametrize("scale", [1e-70, 1.0, 1e70])
def test_planes_of_faces_of_any_size(scale):
    vertices, faces = meshes.icosphere(2)
    vertices = vertices * scale
    faces = np.vstack([faces, [[3, 3, 5]]]).astype(np.int32)  # and one without an area
    planes = np.full((len(faces), 4), np.nan)
    weight, shortest2 = kernels.quadrics.find_planes(
        vertices, faces.reshape(-1), scale**2, 0, len(faces), planes
    )
    normal = np.cross(*(vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2)))
    area = 0.5 * np.linalg.norm(normal, axis=1) / scale**2
    assert weight == pytest.approx(area.sum())
    assert shortest2 == 0.0  # of the last face
    assert planes[:, 3] ** 2 == pytest.approx(area)
    assert planes[:-1, :3] ** 2 == pytest.approx(
        (normal / np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-300))[:-1] ** 2
        * area[:-1, None]
    )
    assert not planes[-1].any()


def test_the_shortest_edge_is_told_by_error_as_by_length():
    vertices, faces = meshes.icosphere(3)
    vertices = vertices + 0.01 * np.random.default_rng(0).random(vertices.shape)
    by_error, by_length = (
        tetsimplify.simplify(vertices, faces, **criterion).report.shortest_edge_before
        for criterion in ({"keep_ratio": 0.5}, {"max_edge_length": 0.1})
    )
    assert by_error == by_length == edge_lengths(as_mesh(vertices, faces)).min()


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_the_quadric_of_an_edge_is_the_sum_over_its_planes(offset):
    rng = np.random.default_rng(3)
    vertices, faces = meshes.icosphere(2)
    vertices = vertices + offset
    quadrics = quadrics_of(vertices, faces)
    planes = naive_quadrics.planes_of(vertices, faces)
    for v, u in naive.all_edges(faces)[:40]:
        point = 0.5 * (vertices[v] + vertices[u]) + rng.normal(scale=0.1, size=3)
        expected = naive_quadrics.quadric_error(planes[v] + planes[u], point)
        assert error_at(quadrics, vertices, v, u, point) == pytest.approx(expected, rel=1e-9)


def test_the_optimum_is_where_the_planes_meet():
    """Three planes at right angles: whatever the place where it is looked for."""
    for offset in (0.0, 1e6):
        corner = np.array([0.3, -0.2, 0.7])
        vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]) + offset
        quadrics = zero_quadrics(2)
        for axis in range(3):
            quadrics.matrix[0, (0, 3, 5)[axis]] += 1.0
            quadrics.linear[0, LINEAR + axis] -= corner[axis]
        quadrics.linear[0, CONSTANT] = corner @ corner
        q = kernels.quadrics.sum_at.py_func(quadrics, vertices, 0, 1)
        found = np.array(kernels.quadrics.optimum.py_func(q, 0.5, 0.0, 0.0))
        assert np.allclose(found, corner, atol=1e-3)


def test_the_optimum_is_the_middle_where_the_planes_do_not_decide():
    """One plane: the middle of the edge, dropped on the plane. None: no place is told."""
    quadrics = zero_quadrics(2)
    vertices = np.array([[0.0, 0.0, 0.0], [2.0, 2.0, 0.0]])
    q = kernels.quadrics.sum_at.py_func(quadrics, vertices, 0, 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        nothing = tuple(np.float64(x) for x in q)
        assert np.isnan(kernels.quadrics.optimum.py_func(nothing, 1.0, 1.0, 0.0)).all()
    quadrics.matrix[0, 5] = 1.0  # the plane z = 1/4
    quadrics.linear[0, [LINEAR + 2, CONSTANT]] = -0.25, 0.0625
    q = kernels.quadrics.sum_at.py_func(quadrics, vertices, 0, 1)
    x, y, z = kernels.quadrics.optimum.py_func(q, 1.0, 1.0, 0.0)
    assert (x, y) == (1.0, 1.0)
    assert z == pytest.approx(0.25, rel=1e-3)


@numba.njit
def costs_one_by_one(surface, quadrics, rules):
    """The costs of all edges by the slow way, each alone, in rows as the engine keeps them."""
    costs = np.full((len(surface.face_state), 3), np.inf, np.float32)
    for f in range(len(surface.face_state)):
        for k in range(3):
            a, b = surface.corner_vertex[3 * f + k], surface.corner_vertex[3 * f + (k + 1) % 3]
            if is_ranked(surface.loop, a, b):
                costs[f, k] = _ranked_cost(surface, quadrics, rules, a, b)[0]
    return costs


@pytest.mark.parametrize(
    "criteria",
    [{}, {"max_edge_length": 0.12}, {"max_quadric_error": 0.002}, {"cost": "length"}],
    ids=["plain", "edges are too long", "errors are too large", "by length"],
)
def test_costs_side_by_side_are_those_of_edges_alone(criteria):
    """Of edges that have been merged, on a surface with locked and with boundary vertices."""
    for seed in range(30):
        vertices, faces = strategies.adversarial_mesh(seed)
        options = Options(target_faces=0, **{"placement": "quadric", **criteria})
        locked = np.random.default_rng(seed).random(len(vertices)) < 0.1
        engine = Engine(as_mesh(vertices, faces), options, locked)
        for _ in range(3):
            engine.rank()
            engine.forget_refusals()
            engine.rank()
            rows = engine._cost.reshape(-1, COLUMNS)
            live = engine._surface.corner_vertex[::3] != DEAD
            expected = costs_one_by_one(engine._surface, engine._quadrics, engine.rules)
            assert np.array_equal(rows[live, :3], expected[live])
            assert np.array_equal(rows[live, LEAST], expected[live].min(axis=1))
            engine.sweep_ranked(next_thresholds(engine, 0.0).thresholds)


def test_errors_of_the_result_are_those_of_the_planes_merged():
    """Accumulated through thousands of contractions, and the same as from the list of planes."""
    for offset in (0.0, 1e6):
        vertices, faces = torus()
        vertices = vertices + offset
        options = Options(keep_ratio=0.1)
        engine = Engine(as_mesh(vertices, faces), options, np.zeros(len(vertices), bool))
        run(engine)
        assert engine.tally("N_NESTED") == 0
        expected = naive_quadrics.rms_errors(vertices, faces, engine.result)
        assert expected.max() > 0.01
        assert np.allclose(engine.vertex_errors(), expected, rtol=1e-4, atol=1e-6)


# --- topology, in every mode ----------------------------------------------------------------------


def some_criteria(rng, vertices, faces):
    """Criteria as users combine them."""
    diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
    all_of_them = {
        "target_faces": int(rng.integers(0, len(faces) + 2)),
        "keep_ratio": float(rng.random()),
        "max_quadric_error": float(diagonal * 10.0 ** rng.uniform(-4, 0)),
        "max_edge_length": float(diagonal * 10.0 ** rng.uniform(-2, 0.3)),
    }
    names = rng.permutation(list(all_of_them))[: rng.integers(1, 4)]
    return {name: all_of_them[name] for name in names}


def check_mode(seed, mode, **options):
    rng = np.random.default_rng(seed)
    vertices, faces = strategies.adversarial_mesh(seed)
    criteria = some_criteria(rng, vertices, faces)
    result = tetsimplify.simplify(vertices, faces, **criteria, **mode, **options)
    assert_same_topology(faces, result)
    if "fit" not in result.report.seconds:  # in which edges may be turned over
        assert_maps_fit(vertices, faces, result)
    if "max_edge_length" in criteria:
        assert_remaining_listed(result, criteria["max_edge_length"])
    else:
        assert len(result.report.remaining_edges) == 0
    least = max(
        criteria.get("target_faces", 0), math.ceil(criteria.get("keep_ratio", 0.0) * len(faces))
    )
    assert len(result.faces) >= min(least, len(faces))
    if result.report.stop in ("target_faces", "keep_ratio"):
        assert len(result.faces) <= max(least + 1, 2) or len(result.faces) == len(faces)
    else:
        assert result.report.stop in {*criteria, "exhausted"}


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: "-".join(mode.values()))
def test_topology_is_kept_in_every_mode(mode):
    for seed in range(60):
        guards = OFF if seed % 3 == 0 else {}
        blocked = "skip" if seed % 5 == 0 else "contract"
        check_mode(
            seed, mode, blocked=blocked, removal_limit=np.inf if seed % 4 else None, **guards
        )


@pytest.mark.slow
@pytest.mark.parametrize("block", range(20))
def test_topology_is_kept_in_every_mode_at_length(block):
    for seed in range(1_000 + block, 21_000, 20):
        check_mode(seed, MODES[seed % len(MODES)], **(OFF if seed % 3 == 0 else {}))


@pytest.mark.parametrize("blocked", BLOCKED)
@pytest.mark.parametrize("cost", ["length", "quadric"])
def test_invariants_after_every_sweep(cost, blocked):
    for seed in range(40):
        vertices, faces = strategies.adversarial_mesh(seed)
        before = naive.summary(faces)
        options = Options(target_faces=0, cost=cost, blocked=blocked)
        engine = Engine(as_mesh(vertices, faces), options, np.zeros(len(vertices), bool))
        threshold, n_barren = 0.0, 0
        for _ in range(400):
            engine.rank()
            thresholds = next_thresholds(engine, threshold, n_barren).thresholds
            threshold = thresholds[-1]
            n_before = engine.n_faces
            n_contracted = engine.sweep_ranked(thresholds)
            live = engine.mesh()
            assert engine.n_faces == len(live.faces)
            assert (engine.n_faces < n_before) == (n_contracted > 0)
            if blocked != "violate":
                after = naive.summary(live.faces)
                assert after.is_sound
                assert naive.has_same_topology(before, after)
                assert_engine_in_order(engine)
            engine.compact_when_half()
            n_barren = 0 if n_contracted else n_barren + 1
            if threshold == np.inf and n_contracted == 0:
                break
        else:
            pytest.fail("sweeps do not come to an end")


@settings(max_examples=100, deadline=None)
@given(strategies.surfaces(), st.floats(0.0, 1.0), st.sampled_from(["length", "quadric"]))
def test_topology_is_kept_with_the_default_guards(mesh, keep_ratio, cost):
    vertices, faces = mesh
    for fit in ("auto", False):  # "auto" may turn edges over
        result = tetsimplify.simplify(vertices, faces, keep_ratio=keep_ratio, cost=cost, fit=fit)
        assert_same_topology(faces, result)
        assert len(result.faces) >= math.ceil(keep_ratio * len(faces))
    assert_maps_fit(vertices, faces, result)


def test_only_obstructed_edges_remain_without_guards():
    for seed in range(60):
        vertices, faces = strategies.adversarial_mesh(seed)
        result = tetsimplify.simplify(
            vertices, faces, max_edge_length=1e6, cost="quadric", removal_limit=np.inf, **OFF
        )
        assert set(result.report.remaining) <= {"obstructed"}
        assert not naive.remaining_contractible(result.vertices, result.faces, 1e6)


def test_nested_contraction_waits_until_what_it_removes_is_cheap():
    """A balloon on a thin neck stays, however far vertices may be removed."""
    vertices, faces = meshes.two_balloons_on_a_neck(meshes.icosphere(2), meshes.icosphere(3))
    result = tetsimplify.simplify(vertices, faces, keep_ratio=0.2, removal_limit=np.inf)
    assert result.report.n_nested == 0
    before, after = (models.signed_volume(*mesh) for mesh in ((vertices, faces), result[:2]))
    assert after == pytest.approx(before, rel=0.1)


def test_nested_contractions_are_done_by_quadric_error_too():
    n_nested = 0
    for seed in range(60):
        mesh = strategies.adversarial_mesh(seed)
        result = tetsimplify.simplify(*mesh, target_faces=1, removal_limit=np.inf)
        n_nested += result.report.n_nested
    assert n_nested > 5


# --- criteria -------------------------------------------------------------------------------------


@pytest.mark.parametrize("cost", ["length", "quadric"])
@pytest.mark.parametrize("target", [4, 5, 100, 999, 1000, 1001, 2**40])
def test_target_faces_is_reached_and_not_overshot(target, cost):
    vertices, faces = meshes.icosphere(4)
    result = tetsimplify.simplify(vertices, faces, target_faces=target, cost=cost)
    assert len(result.faces) == min(len(faces), target + target % 2)  # of closed surfaces even
    assert result.report.stop == "target_faces"


def test_keep_ratio_is_the_part_that_is_left():
    vertices, faces = meshes.icosphere(4)
    result = tetsimplify.simplify(vertices, faces, keep_ratio=0.25)
    assert len(result.faces) == len(faces) / 4
    assert result.report.stop == "keep_ratio"


def test_a_target_that_topology_forbids_is_not_reached():
    result = tetsimplify.simplify(*torus(), target_faces=2, **OFF)
    assert 14 <= len(result.faces) < 30  # no torus has fewer than 14
    assert result.report.stop == "exhausted"
    assert result.report.topology_after.genus == 1


def test_the_first_criterion_that_is_reached_stops():
    mesh = torus()
    fine = tetsimplify.simplify(*mesh, target_faces=1000, max_quadric_error=1e-3)
    coarse = tetsimplify.simplify(*mesh, target_faces=1000, max_quadric_error=1e3)
    short = tetsimplify.simplify(*mesh, target_faces=10, max_edge_length=2.0)
    assert (fine.report.stop, coarse.report.stop) == ("max_quadric_error", "target_faces")
    assert short.report.stop == "max_edge_length"
    assert len(fine.faces) > len(coarse.faces)
    assert set(short.report.remaining) <= {"obstructed", "removal_limit", "foldover"}


@pytest.mark.parametrize("cost", ["length", "quadric"])
def test_no_vertex_exceeds_the_quadric_error(cost):
    vertices, faces = torus()
    result = tetsimplify.simplify(vertices, faces, max_quadric_error=0.05, cost=cost)
    errors = naive_quadrics.rms_errors(vertices, faces, result)
    assert 0.03 < errors.max() <= 0.05 * (1 + 1e-9)
    assert len(result.faces) < len(faces) / 3
    assert result.report.stop == "max_quadric_error"


def test_edges_that_the_error_holds_are_told():
    mesh = torus()
    result = tetsimplify.simplify(*mesh, max_edge_length=3.0, max_quadric_error=0.02, cost="length")
    assert_remaining_listed(result, 3.0)
    assert result.report.remaining["error_bound"] > 100
    assert result.report.stop == "max_quadric_error"


def test_edges_left_because_there_are_few_enough_faces_are_told():
    result = tetsimplify.simplify(*torus(), max_edge_length=3.0, target_faces=3000)
    assert_remaining_listed(result, 3.0)
    assert result.report.stop == "target_faces"
    assert result.report.remaining["target_faces"] > 100


# --- the shape is kept ----------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_flat_parts_stay_flat_and_keep_their_outline(offset):
    vertices, faces = flat_square(16)
    vertices = vertices + offset
    result = tetsimplify.simplify(vertices, faces, target_faces=2)
    assert len(result.faces) <= 4
    assert models.areas(*result[:2]).sum() == pytest.approx(1.0, rel=1e-6)
    normal = np.cross([2.0, 1.0, 2.0], [-2.0, 2.0, 1.0]) / 9.0
    heights = (result.vertices - offset) @ normal
    assert np.abs(heights).max() < 1e-6 if offset else 1e-12


def test_a_cube_becomes_twelve_faces():
    vertices, faces = cube(8)
    result = tetsimplify.simplify(vertices, faces, target_faces=12)
    assert len(result.faces) == 12
    assert np.allclose(np.sort(np.abs(result.vertices), axis=None), 1.0, atol=1e-6)
    assert models.signed_volume(*result[:2]) == pytest.approx(8.0, rel=1e-6)


def test_cylinders_get_no_spikes():
    vertices, faces = tube()
    result = tetsimplify.simplify(vertices, faces, keep_ratio=0.1)
    radius = np.hypot(result.vertices[:, 0], result.vertices[:, 1])
    assert 0.95 < radius.min() and radius.max() < 1.05
    assert -1e-9 < result.vertices[:, 2].min() and result.vertices[:, 2].max() < 2.0 + 1e-9


def test_spheres_keep_their_radius():
    vertices, faces = meshes.icosphere(5)
    for offset in (0.0, 1e6):
        result = tetsimplify.simplify(vertices + offset, faces, keep_ratio=0.02)
        radius = np.linalg.norm(result.vertices - offset, axis=1)
        assert 0.98 < radius.min() and radius.max() < 1.03


def test_feature_edges_are_held():
    """A cube with rounded noise on its sides: its edges stay where they are."""
    vertices, faces = cube(16)
    rng = np.random.default_rng(0)
    inner = np.sort(np.abs(vertices), axis=1)[:, 1] < 1.0 - 1e-9  # not on an edge of the cube
    noisy = vertices + np.where(inner[:, None], rng.normal(scale=0.01, size=vertices.shape), 0.0)

    def edge_error(**options):
        result = tetsimplify.simplify(noisy, faces, keep_ratio=0.05, **options)
        creases = vertices[~inner]
        distances = np.linalg.norm(creases[:, None] - result.vertices[None], axis=2)
        return distances.min(axis=1).mean(), result

    _, free = edge_error()
    _, held = edge_error(feature_angle=45.0)
    for result in (free, held):
        assert len(result.faces) <= 0.05 * len(faces) + 2
    on_crease = np.sort(np.abs(held.vertices), axis=1)[:, 1] > 0.97
    off = np.abs(np.sort(np.abs(held.vertices[on_crease]), axis=1)[:, 1:] - 1.0)
    off_free = np.sort(np.abs(free.vertices), axis=1)
    off_free = np.abs(off_free[off_free[:, 1] > 0.97][:, 1:] - 1.0)
    assert on_crease.sum() >= 20
    assert off.mean() < off_free.mean()


@pytest.mark.parametrize("criteria", [{"keep_ratio": 0.1}, {"max_edge_length": 0.5}])
def test_boundary_can_be_kept_or_locked(criteria):
    vertices, faces = flat_square(16)
    rim = sorted({v for edge in meshes.boundary_edges(faces) for v in edge})
    corners = [0, 16, 17 * 16, 17 * 17 - 1]
    locked = tetsimplify.simplify(vertices, faces, boundary="lock", **criteria)
    assert np.array_equal(locked.vertices[locked.vertex_map[rim]], vertices[rim])
    kept = tetsimplify.simplify(vertices, faces, boundary="keep", **criteria)
    assert np.array_equal(kept.vertices[kept.vertex_map[corners]], vertices[corners])
    assert models.areas(*kept[:2]).sum() == pytest.approx(1.0, rel=1e-9)
    assert kept.report.topology_after.n_boundary_edges < len(rim) / 2


def test_a_round_boundary_is_kept_whole():
    vertices, faces = tube()
    rim = sorted({v for edge in meshes.boundary_edges(faces) for v in edge})
    result = tetsimplify.simplify(vertices, faces, keep_ratio=0.2, boundary="keep")
    assert np.array_equal(result.vertices[result.vertex_map[rim]], vertices[rim])


# --- guards ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("limit", [15.0, 25.0])
def test_no_face_deviates_from_the_normals_given(limit):
    vertices, faces = tetsimplify.extract_isosurface(models.gyroid(24, 1.5), 0.0)
    options = {"foldover": None, "removal_limit": 0.0}
    result = tetsimplify.simplify(
        vertices, faces, keep_ratio=0.05, normal_deviation=limit, **options
    )
    free = tetsimplify.simplify(vertices, faces, keep_ratio=0.05, normal_deviation=None, **options)
    assert result.report.n_nested == free.report.n_nested == 0
    n_merged = np.bincount(result.vertex_map, minlength=len(result.vertices))
    is_new = (n_merged[result.faces] > 1).any(axis=1)  # some of those given deviate themselves
    assert np.count_nonzero(is_new) > 100
    assert naive_quadrics.deviations(vertices, faces, result)[is_new].max() <= limit + 1e-6
    assert naive_quadrics.deviations(vertices, faces, free).max() > limit


def test_normal_deviation_guards_edge_length_too():
    vertices, faces = tetsimplify.extract_isosurface(models.gyroid(24, 1.5), 0.0)
    result = tetsimplify.simplify(vertices, faces, max_edge_length=5.0, normal_deviation=30.0)
    assert naive_quadrics.deviations(vertices, faces, result).max() <= 30.0 + 1e-6
    assert result.report.remaining["normal_deviation"] > 10


def test_no_needle_appears_where_there_was_none():
    vertices, faces = meshes.icosphere(4)
    noisy = vertices * np.random.default_rng(2).uniform(0.97, 1.03, (len(vertices), 1))
    needle = kernels.guards.NEEDLE
    assert naive_quadrics.shapes(noisy, faces).min() > needle
    guarded = tetsimplify.simplify(noisy, faces, keep_ratio=0.1)
    free = tetsimplify.simplify(noisy, faces, keep_ratio=0.1, shape=None)
    assert naive_quadrics.shapes(*guarded[:2]).min() >= needle
    assert naive_quadrics.shapes(*guarded[:2]).mean() > naive_quadrics.shapes(*free[:2]).mean()


@pytest.mark.parametrize(
    "options",
    [
        {"max_edge_length": 3.0, "removal_limit": np.inf, **OFF},
        {"max_edge_length": 1.5},
        {"keep_ratio": 0.1},
        {"keep_ratio": 0.1, "placement": "endpoint"},
    ],
)
def test_what_does_not_cut_itself_stays_so(options):
    """An isosurface of noise: thin sheets everywhere, and no two faces cross."""
    mesh = tetsimplify.extract_isosurface(np.random.default_rng(0).normal(size=(12, 12, 12)), 0.0)
    assert tetsimplify.self_intersections(*mesh).is_embedded
    free = tetsimplify.simplify(*mesh, **options)
    held = tetsimplify.simplify(*mesh, intersections="prevent", **options)
    assert not tetsimplify.self_intersections(*free[:2]).is_embedded
    assert tetsimplify.self_intersections(*held[:2]).is_embedded
    assert_same_topology(mesh.faces, held)
    assert len(held.faces) < 1.3 * len(free.faces)
    if "max_edge_length" in options:
        assert held.report.remaining["intersection"] > 0


def test_what_cuts_itself_already_cuts_itself_nowhere_else():
    for seed in range(30):
        vertices, faces = strategies.adversarial_mesh(seed)
        before = {
            tuple(pair) for pair in tetsimplify.self_intersections(vertices, faces).pairs.tolist()
        }
        result = tetsimplify.simplify(
            vertices, faces, target_faces=1, intersections="prevent", removal_limit=np.inf
        )
        assert_same_topology(faces, result)
        pairs = result.face_map[tetsimplify.self_intersections(*result[:2]).pairs]
        assert {tuple(pair) for pair in pairs.tolist()} <= before


# --- manners --------------------------------------------------------------------------------------


def test_same_input_same_bytes_and_nothing_is_changed():
    vertices, faces = torus()
    copies = vertices.copy(), faces.copy()
    first = tetsimplify.simplify(vertices, faces, keep_ratio=0.2)
    second = tetsimplify.simplify(
        np.asfortranarray(vertices).astype(">f8"), faces.astype(np.uint64), keep_ratio=0.2
    )
    for a, b in zip(first[:4], second[:4], strict=True):
        assert a.tobytes() == b.tobytes()
    assert np.array_equal(vertices, copies[0]) and np.array_equal(faces, copies[1])


def test_data_are_carried():
    vertices, faces = meshes.icosphere(4)
    label = (vertices[:, 0] > 0).astype(np.int16)
    result = tetsimplify.simplify(
        vertices,
        faces,
        keep_ratio=0.2,
        vertex_data={"position": vertices, "label": label},
        face_data={"number": np.arange(len(faces))},
    )
    off = np.linalg.norm(result.vertex_data["position"] - result.vertices, axis=1)
    lengths = models.lengths(*result[:2])
    assert off.max() < 0.5 * np.median(lengths)
    assert set(result.vertex_data["label"]) == {0, 1}
    assert np.array_equal(result.face_data["number"], result.face_map)


def test_progress_rises_to_the_end_and_can_cancel():
    calls = {}
    mesh = torus()
    tetsimplify.simplify(
        *mesh,
        keep_ratio=0.05,
        progress=lambda stage, done: calls.setdefault(stage, []).append(done),
    )
    assert list(calls) == ["contract", "fit"]
    for done in calls.values():
        assert done == sorted(done)
        assert len(done) > 5 and done[-1] == 1.0

    def cancel(stage, done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tetsimplify.simplify(*mesh, keep_ratio=0.2, progress=cancel)


@pytest.mark.parametrize("mesh", [([], []), (np.eye(3), [[0, 1, 2]]), meshes.tetrahedron()])
@pytest.mark.parametrize("cost", ["length", "quadric"])
def test_empty_and_tiny_meshes(mesh, cost):
    result = tetsimplify.simplify(*mesh, target_faces=1, cost=cost)
    assert len(result.faces) == len(mesh[1])
    assert result.report.stop == ("exhausted" if len(mesh[1]) == 4 else "target_faces")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "give at least one of max_edge_length, target_faces, keep_ratio, max_error"),
        ({"target_faces": -1}, "target_faces must be at least 0, got -1"),
        ({"target_faces": 10.0}, "target_faces must be a whole number, got 10.0"),
        ({"target_faces": True}, "target_faces must be a whole number"),
        ({"keep_ratio": 15}, "keep_ratio must be from 0 to 1, got 15"),
        ({"max_error": -0.1}, "max_error must be at least 0"),
        ({"max_quadric_error": math.nan}, "max_quadric_error must be"),
        ({"keep_ratio": 0.5, "cost": "curvature"}, "cost must be one of 'auto', 'length'"),
        ({"keep_ratio": 0.5, "boundary": "free"}, "boundary must be one of 'simplify', 'keep'"),
        ({"keep_ratio": 0.5, "intersections": "fix"}, "intersections must be one of 'allow'"),
        (
            {"keep_ratio": 0.5, "intersections": "prevent", "blocked": "violate"},
            "intersections='prevent' needs a topology that is kept",
        ),
        ({"keep_ratio": 0.5, "shape": 1.5}, "shape must be from 0 to 1"),
        ({"keep_ratio": 0.5, "normal_deviation": "off"}, "normal_deviation must be a number"),
        (
            {"max_edge_length": 1.0, "feature_angle": 30.0, "placement": "midpoint"},
            "feature_angle needs cost='quadric' or placement='quadric'",
        ),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(tetsimplify.OptionError, match=message):
        tetsimplify.simplify(*meshes.octahedron(), **options)


@pytest.mark.parametrize("scale", [2.0**-40, 2.0**60])
def test_the_unit_of_length_makes_no_difference(scale):
    """Nor for nanometres in metres, though b and c are kept in single precision."""
    vertices, faces = torus()
    expected = tetsimplify.simplify(vertices, faces, keep_ratio=0.2)
    result = tetsimplify.simplify(scale * vertices, faces, keep_ratio=0.2)
    assert np.array_equal(result.faces, expected.faces)
    assert np.array_equal(result.vertices, scale * expected.vertices)
