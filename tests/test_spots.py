"""Spots where a simplified mesh is far from the one given: finding them and lowering them."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import strategies
import tetsimplify
from test_fit import assert_faces_kept, bumps, contracted, gyroid
from test_quadrics import cube, torus, tube
from test_simplify import assert_same_topology
from tetsimplify import kernels, spots
from tetsimplify.arrays import as_mesh
from tetsimplify.crew import Crew
from tetsimplify.fit import COS_TURN, EXACT
from tetsimplify.kernels.boxes import IN_BOX, WIDTH
from tetsimplify.mesh import Mesh
from tetsimplify.spots import Spots, new_boxes
from tetsimplify.topology import examine


@numba.njit
def near_face(patches, v, p, q, point, search):
    return kernels_near_face(patches, v, p, q, point, search)


@numba.njit
def nearest_face(patches, v, point, search):
    return kernels_nearest_face(patches, v, point, search, np.int32(-1), np.inf)


@numba.njit
def nearest_of_all(patches, point, search):
    return kernels_nearest_of_all(patches, point, 0.0, search, np.int32(-1), np.inf)


@numba.njit
def measure_exactly(made, patches, candidates, limits, desk):
    kernels_measure_exactly(made, patches, candidates, limits, desk)


@numba.njit
def measure_one_by_one(surface, points, out):
    for i in range(len(points)):
        for f in range(len(surface.faces)):
            out[i, f] = distance2_to_face(surface, f, points[i, 0], points[i, 1], points[i, 2])


distance2_to_face = kernels.nearest.distance2_to_face
kernels_measure_exactly = kernels.lowering._measure_exactly
kernels_near_face = kernels.patches.near_face
kernels_nearest_face = kernels.patches.nearest_face
kernels_nearest_of_all = kernels.patches.nearest_of_all


def made_of(result, held=None, cosine=COS_TURN):
    """A result as the kernels have it."""
    n, m = len(result.vertices), len(result.faces)
    _, _, _, next_corner, first_corner = examine(result.faces.reshape(-1), n)
    normals = np.empty((m, 4))
    kernels.samples.find_normals(result.vertices, result.faces, 0, m, normals)
    held = np.zeros(n, np.uint8) if held is None else held
    surface = kernels.patches.Surface(result.vertices.copy(), result.faces)
    return kernels.spots.Made(
        surface, first_corner, next_corner, held, normals, cosine, new_boxes(m)
    )


def spots_of(mesh, result, threads=1, **more):
    """The spots of a result, and the surface that they move."""
    made = made_of(result, **more)
    return Spots(made, as_mesh(*mesh), result.vertex_map, Crew(threads)), made


def lowered(mesh, result, **more):
    """The result with its worst spots lowered, without samples, and how many were."""
    of_result, made = spots_of(mesh, result, **more)
    n = of_result.lower(np.zeros(len(result.faces), np.float32), EXACT)
    return result._replace(vertices=made.surface.vertices), n


def largest(mesh, result):
    """The largest distance from the result to the mesh given, and back."""
    distance = tetsimplify.surface_distance(result[:2], mesh, tolerance=1e-5)
    return distance.a_to_b.lower, distance.b_to_a.lower


def unit(mesh):
    """A mesh in a box of size one around the origin."""
    vertices = np.asarray(mesh[0], float)
    low, size = vertices.min(axis=0), np.ptp(vertices, axis=0).max()
    return Mesh((vertices - low) / size - 0.5, np.asarray(mesh[1], np.int32))


CASES = {
    "gyroid": lambda: unit(gyroid(24)),
    "torus": lambda: unit(torus()),
    "tube": lambda: unit(tube(96, 48)),
    "noise": lambda: unit(
        tetsimplify.extract_isosurface(np.random.default_rng(1).normal(size=(12, 12, 12)), 0.0)
    ),
}


# --- patches --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_each_face_is_in_the_patch_of_what_it_was_merged_into(name):
    mesh = CASES[name]()
    result = contracted(mesh, keep_ratio=0.1)
    patches = spots_of(mesh, result)[0]._patches
    n, corners = len(result.vertices), mesh.vertices[mesh.faces]
    owners = result.vertex_map[mesh.faces]
    has_owner = (owners >= 0).any(axis=1)
    owner = owners[np.arange(len(owners)), (owners >= 0).argmax(axis=1)]
    assert np.array_equal(np.sort(patches.face), np.flatnonzero(has_owner))
    middles, centre = patches.middle[:, : len(patches.face)].T, corners.mean(axis=1)
    assert np.allclose(middles, centre[patches.face], atol=1e-6)
    assert np.isinf(patches.middle[:, len(patches.face) :]).all()
    assert patches.first[0] == 0 and patches.first[n] == len(patches.face)
    for v in range(n):
        listed = patches.face[patches.first[v] : patches.first[v + 1]]
        assert np.array_equal(listed, np.flatnonzero(has_owner & (owner == v)))
        reach = np.linalg.norm(corners[listed] - centre[listed][:, None], axis=2).max(initial=0.0)
        assert np.sqrt(patches.reach2[v]) == pytest.approx(reach, abs=1e-6)
        box = patches.boxes[v // (IN_BOX * WIDTH), :, v // IN_BOX % WIDTH]
        assert (corners[listed] >= box[:3]).all() and (corners[listed] <= box[3:]).all()


def distances_to(mesh, points):
    """Distances of points from all faces, one by one."""
    out = np.empty((len(points), len(mesh.faces)))
    measure_one_by_one(kernels.patches.Surface(*mesh), np.ascontiguousarray(points), out)
    return np.sqrt(out)


@pytest.mark.parametrize("name", CASES)
def test_the_nearest_face_is_found_among_patches_and_among_all(name):
    mesh = CASES[name]()
    result = contracted(mesh, keep_ratio=0.1)
    patches = spots_of(mesh, result)[0]._patches
    search = kernels.patches.Search.new(0)
    rng = np.random.default_rng(5)
    faces = rng.integers(len(result.faces), size=60)
    points = result.vertices[result.faces[faces]].mean(axis=1)
    points += rng.normal(scale=0.02, size=points.shape)
    n_same = 0
    for f, point, distances in zip(faces, points, distances_to(mesh, points), strict=True):
        nearest, found2 = nearest_of_all(patches, point, search)
        assert np.sqrt(found2) == pytest.approx(distances.min(), abs=1e-12)
        assert distances[nearest] == pytest.approx(distances.min(), abs=1e-12)
        v, p, q = result.faces[f]
        of_patches = []
        for w in (v, p, q):
            listed = patches.face[patches.first[w] : patches.first[w + 1]]
            of_patches.append(distances[listed].min(initial=np.inf))
            nearest, found2 = nearest_face(patches, w, point, search)
            assert np.sqrt(found2) == pytest.approx(of_patches[-1], abs=1e-12)
            assert (nearest < 0) == (len(listed) == 0)
        nearest, found2 = near_face(patches, v, p, q, point, search)
        if nearest >= 0:
            assert np.sqrt(found2) == pytest.approx(distances[nearest], abs=1e-12)
        n_same += np.sqrt(found2) <= min(of_patches) + 1e-12
    assert n_same > 0.6 * len(points)
    assert search.left[0] < 0  # what it took


# --- measuring ------------------------------------------------------------------------------------


def points_of(result, v):
    """The points that belong to a vertex: itself, on edges to later ones, and in faces."""
    places, faces = result.vertices, result.faces
    around = faces[(faces == v).any(axis=1)]
    points = [places[v]] if len(around) else []
    for w in np.unique(around[around > v]):
        points += [(1 - k / 8) * places[v] + k / 8 * places[w] for k in range(1, 8)]
    points += [places[face].mean(axis=0) for face in around if face.min() == v]
    return np.array(points).reshape(-1, 3)


def exactly(mesh, result, of_patches, known=0.0, least=0.0):
    """The largest distance of the points of each vertex, and of its patches."""
    of_result, made = spots_of(mesh, result)
    n, kernel = len(result.vertices), kernels.spots
    candidates = kernels.lowering.Candidates(
        np.arange(n), np.full(n, np.inf), np.full(n, of_patches), np.empty(n)
    )
    limits, desk = kernels.lowering.Limits(known**2, least, 0.0, 0), kernel.Desk.new(10**9)
    measure_exactly(made, of_result._patches, candidates, limits, desk)
    return np.sqrt(candidates.exact2)


@pytest.mark.parametrize("name", CASES)
def test_points_of_all_vertices_are_measured(name):
    mesh = CASES[name]()
    result = contracted(mesh, keep_ratio=0.05)
    of_result, made = spots_of(mesh, result)
    n, exact, most = len(result.vertices), exactly(mesh, result, False), 0.0
    about2, desk = np.empty(n), kernels.spots.Desk.new()
    kernels.spots.measure_about(made, of_result._patches, 0, n, desk, about2)
    for v in range(n):
        distances = distances_to(mesh, points_of(result, v)).min(axis=1)
        most = max(most, distances.max(initial=0.0))
        assert exact[v] == pytest.approx(distances.max(initial=0.0), abs=1e-9)
    assert most > 1e-4
    assert (np.sqrt(about2) >= 0.5 * exact).mean() > 0.8  # of fewer points

    back = distances_to(Mesh(*result[:2]), mesh.vertices[np.unique(mesh.faces)]).min(axis=1)
    both, with_patches = max(most, back.max()), exactly(mesh, result, True)
    assert (with_patches >= exact - 1e-12).all()
    assert 0.9 * both < with_patches.max() < both + 1e-9


def test_what_is_too_near_to_count_is_not_measured():
    mesh = CASES["gyroid"]()
    result = contracted(mesh, keep_ratio=0.05)
    every = exactly(mesh, result, False)
    some = exactly(mesh, result, False, known=every.max(), least=0.75)
    high, found = every > 0.75 * every.max(), some > 0.0
    assert 0 < high.sum() < 0.5 * len(every)
    assert found[every.argmax()] and not (found & ~high).any()
    assert np.array_equal(some[found], every[found])


# --- lowering -------------------------------------------------------------------------------------


def hollow():
    """A valley, and what is left of it: two faces side by side lie across."""
    vertices, faces = meshes.grid(40, 40)
    x, y = np.array(vertices)[:, :2].T / 40
    z = 0.15 * np.exp(-(((x - 0.5) / 0.2) ** 2 + ((y - 0.5) / 0.2) ** 2))
    return unit((np.column_stack([x, y, -z]), faces))


@pytest.mark.parametrize("case", [CASES["gyroid"], CASES["torus"], lambda: unit(bumps())])
def test_the_largest_distance_becomes_less(case):
    mesh = case()
    result = contracted(mesh, keep_ratio=0.05)
    after, n = lowered(mesh, result)
    assert 0 < n <= spots.TRIES
    assert largest(mesh, after)[0] < 0.99 * largest(mesh, result)[0]
    assert max(largest(mesh, after)) < 1.001 * max(largest(mesh, result))
    assert_faces_kept(result.vertices, after.vertices, after.faces, least_area=0.25)
    moved = (after.vertices != result.vertices).any(axis=1)
    assert 0 < moved.sum() <= 3 * n


def test_a_vertex_that_sticks_out_comes_back():
    mesh = hollow()
    result = contracted(mesh, keep_ratio=0.1)
    v = int(np.linalg.norm(result.vertices - [0.1, 0.2, 0.4], axis=1).argmin())
    result.vertices[v, 2] += 0.04
    after, n = lowered(mesh, result)
    assert n >= 1
    assert largest(mesh, after)[0] < 0.7 * largest(mesh, result)[0]


def test_a_peak_that_no_face_is_near_to_is_found_by_its_samples():
    vertices, faces = meshes.grid(40, 40)
    flat = unit((np.column_stack([np.array(vertices)[:, :2], np.zeros(len(vertices))]), faces))
    wavy = flat.vertices + [[0, 0, 1]] * np.sin(9 * flat.vertices[:, :1]) * 0.01
    result = contracted((wavy, flat.faces), keep_ratio=0.1)
    with_peak = Mesh(wavy.copy(), flat.faces)
    v = int(np.linalg.norm(wavy[:, :2] - [0.05, 0.05], axis=1).argmin())
    with_peak.vertices[v, 2] += 0.03
    near = np.linalg.norm(
        result.vertices[result.faces].mean(axis=1)[:, :2] - wavy[v, :2], axis=1
    ).argmin()
    heights2 = np.zeros(len(result.faces), np.float32)
    heights2[near] = 0.03**2
    of_result, made = spots_of(with_peak, result)
    before = largest(with_peak, result)
    assert before[1] > 0.02 > before[0]
    assert of_result.lower(heights2, EXACT) > 0
    after = largest(with_peak, result._replace(vertices=made.surface.vertices))
    assert max(after) < 0.9 * before[1]


def test_held_vertices_stay():
    mesh = CASES["gyroid"]()
    result = contracted(mesh, keep_ratio=0.05)
    free, _ = lowered(mesh, result)
    moved = (free.vertices != result.vertices).any(axis=1)
    after, _ = lowered(mesh, result, held=moved.astype(np.uint8))
    assert np.array_equal(after.vertices[moved], result.vertices[moved])
    after, n = lowered(mesh, result, held=np.ones(len(moved), np.uint8))
    assert n == 0 and np.array_equal(after.vertices, result.vertices)


def test_no_face_turns_farther_than_it_may():
    mesh = CASES["noise"]()
    result = contracted(mesh, keep_ratio=0.05)
    cosine = np.cos(np.radians(3.0))
    after, _ = lowered(mesh, result, cosine=cosine)
    assert_faces_kept(result.vertices, after.vertices, after.faces, cosine, least_area=0.25)


def test_boxes_keep_the_faces_that_move():
    mesh = CASES["gyroid"]()
    of_result, made = spots_of(mesh, contracted(mesh, keep_ratio=0.05))
    assert of_result.lower(np.zeros(len(made.surface.faces), np.float32), EXACT) > 0
    for f, corners in enumerate(made.surface.vertices[made.surface.faces]):
        box = made.boxes[f // (IN_BOX * WIDTH), :, f // IN_BOX % WIDTH]
        assert (corners >= box[:3]).all() and (corners <= box[3:]).all()


def test_the_work_is_limited(monkeypatch):
    """When as much has been done as may be, all stays as it is by then."""
    mesh, per_given = CASES["gyroid"](), [0, 0.02, 0.2, spots.PER_GIVEN]
    result, moved = contracted(mesh, keep_ratio=0.05), []
    before = max(largest(mesh, result))
    for limit in per_given:
        monkeypatch.setattr("tetsimplify.spots.PER_GIVEN", limit)
        after, n = lowered(mesh, result)
        moved.append(n)
        assert max(largest(mesh, after)) < 1.001 * before
    assert moved[0] == 0 < moved[-1] and moved == sorted(moved)


def test_any_number_of_threads_gives_the_same(monkeypatch):
    monkeypatch.setattr("tetsimplify.spots.VERTICES", 50)
    mesh = CASES["gyroid"]()
    result = contracted(mesh, keep_ratio=0.05)
    one, two, three = (lowered(mesh, result, threads=n)[0].vertices for n in (1, 2, 3))
    assert np.array_equal(one, two) and np.array_equal(one, three)
    assert not np.array_equal(one, result.vertices)


def test_nothing_is_done_where_nothing_is_known():
    mesh = CASES["torus"]()
    result = contracted(mesh, keep_ratio=0.05)
    nothing = result._replace(vertex_map=np.full(len(mesh.vertices), -1, np.int32))
    after, n = lowered(mesh, nothing)
    assert n == 0 and np.array_equal(after.vertices, result.vertices)


def test_what_is_exact_stays():
    for mesh, ratio in ((unit(torus()), 1.0), (unit(cube(24)), 0.05)):
        result = contracted(mesh, keep_ratio=ratio)
        after, n = lowered(mesh, result)
        assert n == 0 and np.array_equal(after.vertices, result.vertices)


@given(seed=st.integers(0, strategies.MAX_SEED))
@settings(max_examples=40, deadline=None)
def test_adversarial_meshes_keep_their_faces(seed):
    mesh = strategies.adversarial_mesh(seed)
    result = contracted(mesh, keep_ratio=0.3)
    if not len(result.faces):
        return
    vertices = np.asarray(mesh[0], float)
    low, size = vertices.min(axis=0), max(np.ptp(vertices, axis=0).max(), 1e-300)
    framed = result._replace(vertices=(result.vertices - low) / size)
    after, _ = lowered(((vertices - low) / size, mesh[1]), framed)
    assert_faces_kept(framed.vertices, after.vertices, after.faces, least_area=0.25)


def test_simplify_lowers_them_where_few_faces_are_left(monkeypatch):
    mesh = as_mesh(*bumps())
    assert len(mesh.faces) > 16 * 1000
    lower, results = Spots.lower, []
    for does in (True, False):
        monkeypatch.setattr(Spots, "lower", lower if does else lambda *_: 0)
        results.append(tetsimplify.simplify(*mesh, target_faces=1000))
        assert_same_topology(mesh.faces, results[-1])
    with_spots, without = (max(largest(mesh, result)) for result in results)
    assert with_spots < 0.97 * without
