"""Vertices fitted to the surface given: the sums, the solution, what is held, what is kept."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import strategies
import tetsimplify
from test_quadrics import cube, flat_square, torus, tube
from test_simplify import assert_same_topology
from tetsimplify import kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.crew import Crew
from tetsimplify.fit import (
    COS_TURN,
    DOUBT,
    EXACT,
    HIGH,
    HIGHEST,
    LIFT,
    LIGHT,
    MEDIUM,
    PLANE,
    ROUGH,
    THOROUGH,
    Links,
    _Fit,
    fit_mesh,
)
from tetsimplify.mesh import Mesh
from tetsimplify.options import Options
from tetsimplify.topology import examine


def gyroid(n=40):
    x, y, z = np.mgrid[0 : 2 * np.pi : n * 1j, 0 : 2 * np.pi : n * 1j, 0 : 2 * np.pi : n * 1j]
    values = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return tetsimplify.extract_isosurface(values, 0.1)


def bumps():
    """A square with bumps that have tips."""
    vertices, faces = meshes.grid(120, 120)
    xy = np.array(vertices)[:, :2] / np.ptp(np.array(vertices)[:, 0])
    rng = np.random.default_rng(3)
    z = sum(
        0.05 * h * np.exp(-np.linalg.norm(xy - at, axis=1) / 0.02)
        for at, h in zip(rng.uniform(size=(60, 2)), rng.normal(size=60), strict=True)
    )
    return np.column_stack([xy, z]), faces


def dented():
    """A smooth graph, contracted, and the graph with dents that contraction knew nothing of."""
    vertices, faces = meshes.grid(60, 60)
    x, y = np.array(vertices)[:, :2].T / 60
    smooth = np.column_stack([x, y, 0.1 * np.sin(3 * x) * np.cos(2 * y)])
    with_dents, side = smooth.copy(), 1
    for i in range(10, 60, 13):
        for j in range(10, 60, 13):
            with_dents[61 * i + j, 2] += 0.002 * side
            side = -side
    return (with_dents, faces), contracted((smooth, faces), keep_ratio=0.25)


CURVED = {"sphere": lambda: meshes.icosphere(5), "torus": torus, "gyroid": gyroid}


def contracted(mesh, **options):
    return tetsimplify.simplify(*mesh, **{"fit": False, **options})


def fitted(mesh, result, *, held=None, threads=1, **more):
    """What becomes of the vertices of a result that were not fitted, and what was held."""
    made = Mesh(result.vertices, result.faces)
    _, loop, _, next_corner, first_corner = examine(made.faces.reshape(-1), len(made.vertices))
    held = (loop >= 0).astype(np.uint8) if held is None else held
    links = Links(first_corner, next_corner)
    return fit_mesh(as_mesh(*mesh), made, result.vertex_map, held, links, threads, **more).vertices


def mean_distance(mesh, vertices, faces):
    distance = tetsimplify.surface_distance((vertices, faces), mesh)
    return 0.5 * (distance.a_to_b.mean + distance.b_to_a.mean)


def cross_products(vertices, faces):
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def assert_faces_kept(before, after, faces, cosine=COS_TURN, least_area=0.5):
    """None turned too far or lost more than half of its area, but those that did not move."""
    assert np.isfinite(after).all()
    old, new = cross_products(before, faces), cross_products(after, faces)
    moved = (before != after).any(axis=1)[faces].any(axis=1)
    sizes, new_sizes = np.linalg.norm(old, axis=1), np.linalg.norm(new, axis=1)
    cosines = (old * new).sum(axis=1)[moved] / (sizes * new_sizes)[moved]
    assert (cosines >= cosine - 1e-6).all()
    assert (new_sizes[moved] >= least_area * sizes[moved] * (1 - 1e-6)).all()


# --- against a slow oracle ------------------------------------------------------------------------


def started(mesh, result, plan, **held):
    """The state of a fit when it has taken samples."""
    made = Mesh(result.vertices, result.faces)
    _, _, _, next_corner, first_corner = examine(made.faces.reshape(-1), len(made.vertices))
    box = made.vertices.min(axis=0), made.vertices.max(axis=0)
    nobody = np.zeros(len(made.vertices), np.uint8)
    fit = _Fit(made, nobody, Links(first_corner, next_corner), box, Crew(1))
    fit.measure()
    fit.take_samples(as_mesh(*mesh), result.vertex_map, plan, 0)
    return fit


def naive_samples(mesh, result, plan):
    """The samples that are of use: the face, the coordinates there and the height of each."""
    vertices, faces = mesh
    n_given, n_faces = len(faces), len(result.faces)
    stride = max(1, round(n_given / (plan.per_face * n_faces)))
    stars = [np.flatnonzero((result.faces == v).any(axis=1)) for v in range(len(result.vertices))]
    for i, f in enumerate(range(0, n_given, stride)):
        a, b, c = np.roll(faces[f], -(i % 3))
        point = 0.5 * (vertices[a] + vertices[b])
        normal = np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a])
        v = result.vertex_map[a] if result.vertex_map[a] >= 0 else result.vertex_map[b]
        for attempt in range(2):
            best = None
            for face in stars[v]:
                k = result.faces[face].tolist().index(v)
                p = np.roll(result.vertices[result.faces[face]], -k, axis=0)
                n = np.cross(p[1] - p[0], p[2] - p[0])
                double = np.linalg.norm(n)
                n = n / double
                one = np.cross(point - p[0], p[2] - p[0]) @ n / double
                other = np.cross(p[1] - p[0], point - p[0]) @ n / double
                beside = min(one, other, 0.0)
                longer = max(np.linalg.norm(p[1] - p[0]), np.linalg.norm(p[2] - p[0]))
                height = (point - p[0]) @ n
                distance2 = height**2 + (beside * double / longer) ** 2
                if best is None or distance2 < best[0]:
                    best = distance2, face, k, np.array([1 - one - other, one, other]), height, n, p
            _, face, k, weights, height, n, p = best
            if weights[0] >= 0.0 or attempt == 1:
                break
            v = np.roll(result.faces[face], -k)[1 if weights[1] > weights[2] else 2]
        inside = np.maximum(weights, 0.0) / np.maximum(weights, 0.0).sum()
        aside = np.linalg.norm((weights - inside) @ p)
        if normal @ n >= 0.0 and aside <= abs(height) + 1e-9:
            yield face, np.roll(inside, k), height


def naive_sums(samples, n_faces):
    """Sums of l l', of l r, of r^2, how many there are, and the weights."""
    products, rights = np.zeros((n_faces, 3, 3)), np.zeros((n_faces, 3))
    squares, counts = np.zeros(n_faces), np.zeros(n_faces)
    for face, weights, height in samples:
        products[face] += np.outer(weights, weights)
        rights[face] += weights * height
        squares[face] += height**2
        counts[face] += 1
    means = squares / np.maximum(counts, 1)
    return products, rights, squares, counts, (means + EXACT**2) ** -0.25


def test_sums_are_those_of_samples_one_by_one():
    vertices, faces = meshes.icosphere(4)
    noise = np.random.default_rng(2).normal(scale=1e-3, size=vertices.shape)
    mesh = vertices + noise, faces  # no two faces are as near by symmetry
    result = contracted(mesh, keep_ratio=0.1)
    fit = started(mesh, result, LIGHT)
    scale = fit._frame[1]
    expected = naive_sums(naive_samples(mesh, result, LIGHT), len(result.faces))
    products, rights, squares, counts, _ = expected
    weights = (squares * scale**2 / np.maximum(counts, 1) + EXACT**2) ** -0.25
    found = fit._sums
    columns = kernels.fit
    assert np.array_equal(found[:, columns.COUNT], counts)
    assert counts.sum() > 0.95 * 3 * len(result.faces)
    assert np.allclose(found[:, columns.R2], squares * scale**2, rtol=1e-4, atol=1e-12)
    assert np.allclose(found[:, columns.WEIGHT], weights * counts, rtol=1e-4)
    highest = np.zeros(len(result.faces))
    for face, _, height in naive_samples(mesh, result, LIGHT):
        highest[face] = max(highest[face], abs(height) * scale)
    assert np.allclose(found[:, columns.MOST2], highest**2, rtol=1e-4, atol=1e-12)
    assert np.allclose(fit._of_groups.sum(axis=0)[:2], found[:, [columns.R2, columns.COUNT]].sum(0))
    assert fit._of_groups[:, 2].max() == found[:, columns.MOST2].max()
    for k in range(3):
        got = found[:, columns.SQUARE + k] / weights
        assert np.allclose(got, products[:, k, k], atol=1e-3)
        got = found[:, columns.PRODUCT + k] / weights
        assert np.allclose(got, products[:, k, (k + 1) % 3], atol=1e-3)
        got = found[:, columns.RIGHT + k] / weights
        assert np.allclose(got, rights[:, k] * scale, atol=1e-3 * np.abs(rights).max() * scale)


def test_steps_solve_the_least_squares(monkeypatch):
    """After many sweeps, without the pull: the normal equations of all steps together."""
    monkeypatch.setattr("tetsimplify.fit.LIFT", np.inf)
    mesh = meshes.icosphere(4)
    result = contracted(mesh, keep_ratio=0.1)
    stiffness = 0.05
    plan = LIGHT._replace(sweeps=300, stiffness=stiffness, pull=0.0)
    fit = started(mesh, result, plan)
    n = len(result.vertices)
    matrix, right = np.zeros((3 * n, 3 * n)), np.zeros(3 * n)
    columns, normals = kernels.fit, fit._normals[:, :3]
    far2 = ((fit._places[result.faces] - fit._places[np.roll(result.faces, 1, axis=1)]) ** 2).sum(2)
    for v in range(n):
        star = np.flatnonzero((result.faces == v).any(axis=1))
        spokes = [far2[f, k] for f in star for k in range(3)
                  if v in (result.faces[f, k], result.faces[f, k - 1])]  # fmt: skip
        with_samples = star[fit._sums[star, columns.COUNT] > 0]
        means = fit._sums[with_samples, columns.R2] / fit._sums[with_samples, columns.COUNT]
        flat = 1e-3**2 * np.mean(spokes) / means.min()
        spring = stiffness * fit._sums[star, columns.WEIGHT].sum() * (1 + flat)
        matrix[3 * v : 3 * v + 3, 3 * v : 3 * v + 3] += spring * np.eye(3)
    for f, corners in enumerate(result.faces):
        for k, v in enumerate(corners):
            right[3 * v : 3 * v + 3] += fit._sums[f, columns.RIGHT + k] * normals[f]
            for j, u in enumerate(corners):
                product = (
                    columns.SQUARE + k
                    if j == k
                    else columns.PRODUCT + (k if j == (k + 1) % 3 else j)
                )
                block = fit._sums[f, product] * np.outer(normals[f], normals[f])
                matrix[3 * v : 3 * v + 3, 3 * u : 3 * u + 3] += block
    fit.solve(plan)
    expected = np.linalg.solve(matrix, right).reshape(-1, 3)
    assert np.abs(expected).max() > 1e-5
    assert np.allclose(fit._steps, expected, atol=1e-6 * np.abs(expected).max())


def test_steps_out_of_the_surface_are_no_longer_than_heights(monkeypatch):
    """They are cut short there, and not along the surface, if no vertex knows of others."""
    monkeypatch.setattr("tetsimplify.fit.VERTICES", 1)
    mesh, steps = bumps(), []
    result = contracted(mesh, keep_ratio=0.15)
    for lift in (LIFT, np.inf):
        monkeypatch.setattr("tetsimplify.fit.LIFT", lift)
        fit = started(mesh, result, LIGHT)
        fit.solve(LIGHT)
        steps.append(fit._steps)
    cut, whole = steps
    normals, limits = np.zeros_like(cut), np.zeros(len(cut))
    for v in range(len(cut)):
        star = np.flatnonzero((result.faces == v).any(axis=1))
        normals[v] = fit._normals[star, :3].sum(axis=0)
        squares, counts = fit._sums[star][:, [kernels.fit.R2, kernels.fit.COUNT]].sum(axis=0)
        limits[v] = LIFT * np.sqrt(squares / (counts + DOUBT))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    out = (whole * normals).sum(axis=1)
    assert 0.02 < (np.abs(out) > limits).mean() < 0.5
    expected = whole + (np.clip(out, -limits, limits) - out)[:, None] * normals
    assert np.allclose(cut, expected, atol=1e-6 * np.abs(whole).max())


def naive_ease(fit, faces):
    """The steps after the highest samples were eased, and how many; nothing is held."""
    columns, sums, steps = kernels.fit, fit._sums.astype(float), fit._steps.copy()
    highest = np.sqrt(sums[:, columns.MOST2])
    rights = sums[:, columns.RIGHT : columns.RIGHT + 3]
    sides = np.where(rights.sum(axis=1) < 0.0, -1.0, 1.0)
    rms = np.sqrt(sums[:, columns.R2].sum() / sums[:, columns.COUNT].sum())
    limit, normals = max(HIGH * rms, HIGHEST * highest.max()), fit._normals[:, :3]
    busy, n_eased = set(), 0
    for f in np.argsort(-highest, kind="stable"):
        shares = np.maximum(sides[f] * rights[f], 0.0)
        shares /= shares.sum() or 1.0
        height = highest[f] - sides[f] * shares @ steps[faces[f]] @ normals[f]
        stars = [np.flatnonzero((faces == v).any(axis=1)) for v in faces[f]]
        around = np.unique(np.concatenate(stars))
        certain = all(2 * (normals[star].mean(axis=0) ** 2).sum() - 1 > 0.3 for star in stars)
        against = highest[around][sides[around] != sides[f]].max(initial=0.0)
        ease = 0.5 * (height - against)
        if (
            busy & {*faces[f]}
            or highest[f] <= limit
            or not (certain and height > limit and ease > 0.1 * height)
        ):
            continue
        steps[faces[f]] += np.outer(shares, sides[f] * ease / (shares @ shares) * normals[f])
        busy |= {*faces[around].ravel()}
        n_eased += 1
    return steps, n_eased


def test_the_highest_samples_are_eased_one_by_one(monkeypatch):
    monkeypatch.setattr("tetsimplify.fit.GROUP_BITS", 6)
    mesh, result = dented()
    fit = started(mesh, result, LIGHT)
    fit.solve(LIGHT)
    before = fit._steps.copy()
    expected, n_eased = naive_ease(fit, result.faces)
    fit.ease_highest()
    assert n_eased > 2
    assert 6 < (before != fit._steps).any(axis=1).sum() <= 3 * n_eased
    assert np.allclose(fit._steps, expected, atol=1e-5 * np.abs(expected).max())


# --- what it is for -------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.15, 0.03])
@pytest.mark.parametrize("name", CURVED)
def test_curved_surfaces_come_nearer_and_keep_their_topology(name, ratio):
    mesh = CURVED[name]()
    before, after = (
        contracted(mesh, keep_ratio=ratio),
        tetsimplify.simplify(*mesh, keep_ratio=ratio),
    )
    stay = (before.faces == after.faces).all(axis=1)
    assert stay.mean() > 0.8
    assert_same_topology(mesh[1], after)
    least_area = 0.5 if ratio > 1 / 16 else 0.25
    assert_faces_kept(before.vertices, after.vertices, after.faces[stay], least_area=least_area)
    assert mean_distance(mesh, *after[:2]) < 0.97 * mean_distance(mesh, *before[:2])
    shapes = [tetsimplify.quality(*result[:2]).radius_ratio.mean() for result in (before, after)]
    assert shapes[1] > shapes[0]
    lengths = np.linalg.norm(
        after.vertices[after.faces] - after.vertices[np.roll(after.faces, 1, axis=1)], axis=2
    )
    assert after.report.shortest_edge_after == pytest.approx(lengths.min())
    assert after.report.seconds["fit"] > 0.0 and "fit" not in before.report.seconds


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_edges_are_turned_over_where_it_is_rough(noise):
    vertices, faces = meshes.icosphere(7)
    bumps = 1.0 + noise * np.random.default_rng(4).normal(size=len(vertices))
    mesh = vertices * bumps[:, None], faces
    before, after = contracted(mesh, keep_ratio=0.15), tetsimplify.simplify(*mesh, keep_ratio=0.15)
    fit = started(mesh, before, LIGHT)
    assert (fit.roughness > ROUGH) == (noise > 0.0)
    assert (before.faces != after.faces).any() == (noise > 0.0)


def test_triangles_of_planes_become_better():
    mesh = cube(24)
    before, after = contracted(mesh, keep_ratio=0.15), tetsimplify.simplify(*mesh, keep_ratio=0.15)
    assert started(mesh, before, LIGHT).roughness < PLANE
    assert mean_distance(mesh, *after[:2]) < 1e-9
    shapes = [tetsimplify.quality(*result[:2]).radius_ratio.mean() for result in (before, after)]
    assert shapes[1] > shapes[0] + 0.01


def test_tips_do_not_stick_out(monkeypatch):
    mesh = bumps()
    result = contracted(mesh, keep_ratio=0.15)
    distances = []
    for lift in (LIFT, np.inf):
        monkeypatch.setattr("tetsimplify.fit.LIFT", lift)
        after = fitted(mesh, result), result.faces
        distances.append(tetsimplify.surface_distance(after, mesh))
    less, more = distances
    assert np.sort(less.a_to_b.vertex_distances)[-20:].mean() < 0.95 * (
        np.sort(more.a_to_b.vertex_distances)[-20:].mean()
    )
    assert less.mean < more.mean


def test_the_largest_distance_becomes_less_where_single_samples_are_high(monkeypatch):
    (mesh, result), largest = dented(), []
    for eases in (True, False):
        monkeypatch.setattr("tetsimplify.fit.LIGHT", LIGHT._replace(eases=eases))
        after = fitted(mesh, result), result.faces
        distance = tetsimplify.surface_distance(after, mesh, tolerance=1e-5)
        largest.append((distance.lower, distance.mean))
    (less, mean), (more, mean_before) = largest
    assert less < 0.9 * more
    assert mean_before < mean < 0.05 * less  # what that costs


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_planes_and_creases_stay_exact(offset):
    for vertices, faces in (cube(24), flat_square(24)):
        result = tetsimplify.simplify(vertices + offset, faces, keep_ratio=0.1)
        before = contracted((vertices + offset, faces), keep_ratio=0.1)
        assert np.abs(result.vertices - before.vertices).max() < 2e-9
        assert mean_distance((vertices + offset, faces), *result[:2]) < 1e-9


@pytest.mark.parametrize(("plan", "part"), [(LIGHT, 1e-4), (MEDIUM, 1e-3)], ids=["light", "medium"])
def test_the_units_and_the_place_do_not_matter(plan, part, monkeypatch):
    """Other units by a power of two change no bit; else single samples on an edge may."""
    monkeypatch.setattr("tetsimplify.fit.MEDIUM", plan)
    mesh = torus()
    result = contracted(mesh, keep_ratio=0.1)
    vertices = fitted(mesh, result)
    size = np.abs(vertices - result.vertices).max()
    for scale, offset in ((2.0**40, 0.0), (2.0**-60, 0.0), (25.4, 0.0), (1.0, 1e6)):
        moved = fitted(
            (mesh.vertices * scale + offset, mesh.faces),
            result._replace(vertices=result.vertices * scale + offset),
        )
        off = np.abs((moved - offset) / scale - vertices)
        assert np.quantile(off, 0.95) < part * size
        if scale == 2.0 ** round(np.log2(scale)) and not offset:
            assert np.array_equal(moved, vertices * scale)


@pytest.mark.parametrize("ratio", [0.5, 0.04])
def test_any_number_of_threads_gives_the_same(ratio, monkeypatch):
    for name, size in (("VERTICES", 64), ("AT_ONCE", 100), ("SAMPLES", 512), ("GROUP_BITS", 7)):
        monkeypatch.setattr(f"tetsimplify.fit.{name}", size)
    mesh = gyroid()
    result = contracted(mesh, keep_ratio=ratio)
    one, two, three = (fitted(mesh, result, threads=n) for n in (1, 2, 3))
    assert np.array_equal(one, two) and np.array_equal(one, three)
    assert not np.array_equal(one, result.vertices)


# --- what is held ---------------------------------------------------------------------------------


def test_locked_and_boundary_vertices_keep_every_bit():
    mesh = tube(96, 48)
    locked = np.zeros(len(mesh[0]), bool)
    locked[::50] = True
    result = tetsimplify.simplify(*mesh, keep_ratio=0.2, locked=locked)
    before = contracted(mesh, keep_ratio=0.2, locked=locked)
    kept = result.vertex_map[locked]
    assert np.array_equal(result.vertices[kept], mesh[0][locked])
    loop = examine(result.faces.reshape(-1), len(result.vertices)).loop
    assert np.array_equal(result.vertices[loop >= 0], before.vertices[loop >= 0])
    assert not np.array_equal(result.vertices, before.vertices)


def test_seams_keep_every_bit():
    mesh = torus()
    part = (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 20).astype(int)
    result = tetsimplify.simplify(*mesh, keep_ratio=0.2, face_data={"part": part}, seams="part")

    def border(faces, part):
        return np.intersect1d(faces[part == 0], faces[part == 1])

    on_border = border(mesh.faces, part)
    kept = result.vertex_map[on_border]
    assert np.array_equal(result.vertices[kept], mesh.vertices[on_border])
    assert set(border(result.faces, result.face_data["part"])) == set(kept)
    assert result.report.seconds["fit"] > 0.0
    assert result.report.topology_after.same_topology(result.report.topology_before)


def test_vertices_on_features_stay():
    """Two halves of a cylinder that meet at a right angle."""
    x = np.linspace(-1.0, 1.0, 41)
    _, faces = meshes.grid(40, 40)
    u, v = np.meshgrid(x, x, indexing="ij")
    vertices = np.stack([u, v, 1.5 * np.abs(u) + 0.3 * v**2], axis=2).reshape(-1, 3)
    options = {"keep_ratio": 0.1, "feature_angle": 40.0}
    result = tetsimplify.simplify(vertices, faces, **options)
    before = contracted((vertices, faces), **options)
    on_ridge = np.abs(before.vertices[:, 0]) < 1e-3
    assert on_ridge.sum() > 3
    assert np.array_equal(before.vertices[on_ridge], result.vertices[on_ridge])
    assert not np.array_equal(before.vertices, result.vertices)


def test_vertices_without_samples_stay():
    """A part of the result that nothing was merged into."""
    mesh = meshes.icosphere(4)
    result = contracted(mesh, keep_ratio=0.1)
    n = len(result.vertices)
    twice = result._replace(
        vertices=np.concatenate([result.vertices, result.vertices + 3.0]),
        faces=np.concatenate([result.faces, result.faces + n]).astype(np.int32),
    )
    moved = fitted(mesh, twice)
    assert np.array_equal(moved[n:], twice.vertices[n:])
    assert not np.array_equal(moved[:n], twice.vertices[:n])
    nothing = result._replace(vertex_map=np.full(len(mesh[0]), -1, np.int32))
    assert np.array_equal(fitted(mesh, nothing), result.vertices)


def test_nothing_moves_where_nothing_was_contracted():
    mesh = torus()
    result = tetsimplify.simplify(*mesh, keep_ratio=1.0, fit=True)
    assert np.array_equal(result.vertices, mesh.vertices)


def test_where_many_faces_are_left_only_by_request():
    mesh = torus()
    free = contracted(mesh, keep_ratio=0.5)
    left_out = tetsimplify.simplify(*mesh, keep_ratio=0.5)
    asked_for = tetsimplify.simplify(*mesh, keep_ratio=0.5, fit=True)
    assert np.array_equal(left_out.vertices, free.vertices)
    assert not np.array_equal(asked_for.vertices, free.vertices)


# --- whatever the mesh ----------------------------------------------------------------------------


@pytest.mark.parametrize("mesh", [([], []), (np.eye(3), [[0, 1, 2]]), meshes.tetrahedron()])
def test_empty_and_tiny_meshes(mesh):
    result = tetsimplify.simplify(*mesh, target_faces=2, fit=True)
    assert len(result.vertices) == len(mesh[0])


@given(seed=st.integers(0, strategies.MAX_SEED))
@settings(max_examples=60, deadline=None)
def test_adversarial_meshes_keep_their_faces(seed):
    mesh = strategies.adversarial_mesh(seed)
    for ratio in (0.6, 0.2):
        before = contracted(mesh, keep_ratio=ratio)
        for foldover, cosine in ((75.0, COS_TURN), (20.0, np.cos(np.radians(20.0)))):
            moved = fitted(mesh, before, cos_turn=np.cos(np.radians(foldover)))
            assert_faces_kept(before.vertices, moved, before.faces, cosine)


def test_a_mesh_made_of_noise_keeps_its_faces():
    noise = np.random.default_rng(1).normal(size=(14, 14, 14))
    mesh = tetsimplify.extract_isosurface(noise, 0.0)
    for ratio in (0.5, 0.1):
        before = contracted(mesh, keep_ratio=ratio)
        after = tetsimplify.simplify(*mesh, keep_ratio=ratio, fit=True)
        stay = (before.faces == after.faces).all(axis=1)
        assert stay.mean() > 0.7
        assert_faces_kept(before.vertices, after.vertices, after.faces[stay])
        assert_same_topology(mesh[1], after)


def test_degenerate_faces_and_flat_boxes():
    """All in one place, on one line, and faces without height among others."""
    mesh = meshes.icosphere(2)
    result = contracted(mesh, keep_ratio=0.3)
    for squeezed in ([0, 0, 0], [1, 0, 0]):
        flat = result._replace(vertices=result.vertices * squeezed)
        assert np.array_equal(fitted((mesh[0] * squeezed, mesh[1]), flat), flat.vertices)
    vertices = result.vertices.copy()
    vertices[result.faces[0, 0]] = vertices[result.faces[0, 1]]
    moved = fitted(mesh, result._replace(vertices=vertices))
    assert np.isfinite(moved).all()
    assert np.array_equal(moved[result.faces[0]], vertices[result.faces[0]])


# --- the option -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"keep_ratio": 0.5, "fit": "yes"}, "fit must be True, False or 'auto'"),
        ({"keep_ratio": 0.5, "cost": "length"}, "fit=True needs cost='quadric'"),
        ({"keep_ratio": 0.5, "placement": "endpoint"}, "fit=True needs cost='quadric' and plac"),
        ({"max_quadric_error": 0.5}, "fit=True needs target_faces or keep_ratio"),
        ({"keep_ratio": 0.5, "max_error": 1.0}, "fit=True cannot be with max_error"),
        ({"keep_ratio": 0.5, "max_edge_length": 1.0}, "fit=True cannot be with max_edge_length"),
        ({"keep_ratio": 0.5, "intersections": "prevent"}, "cannot be with intersections='prevent'"),
        ({"keep_ratio": 0.5, "normal_deviation": 40.0}, "cannot be with a normal_deviation"),
        ({"keep_ratio": 0.5, "blocked": "violate"}, "not blocked='violate'"),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(tetsimplify.OptionError, match=message):
        tetsimplify.simplify(*meshes.tetrahedron(), **{"fit": True, **options})
    if options.get("fit") != "yes":
        assert not Options(**options).fits


def test_when_vertices_are_fitted():
    assert Options(target_faces=10).fits and Options(keep_ratio=0.1, normal_deviation=None).fits
    assert not Options(target_faces=10, fit=False).fits
    assert Options(target_faces=10, max_quadric_error=None, fit=True).fits


def test_progress_can_cancel():
    def cancel(stage, done):
        if stage == "fit" and done > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tetsimplify.simplify(*torus(), keep_ratio=0.1, progress=cancel)


def test_more_is_done_where_more_is_left_out():
    assert THOROUGH.rounds > MEDIUM.rounds > LIGHT.rounds
    assert THOROUGH.per_face * THOROUGH.rounds > MEDIUM.per_face > LIGHT.per_face
    assert THOROUGH.lowers and not MEDIUM.lowers
