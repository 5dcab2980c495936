"""Edges turned over in the last fit: the topology, what stays, what is gained."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import naive
import strategies
import tetsimplify
from test_fit import contracted, cross_products, fitted, gyroid, mean_distance
from test_quadrics import cube, flat_square, torus
from tetsimplify import kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.fit import COS_TURN, Links, fit_mesh
from tetsimplify.mesh import Mesh
from tetsimplify.topology import examine, topology

THIN = kernels.flips.THIN


def links_of(faces, n):
    examined = examine(np.ascontiguousarray(faces).reshape(-1), n)
    return Links(examined.first_corner.copy(), examined.next_corner.copy())


def with_flips(mesh, result, *, held=None, threads=1, **more):
    """A result that was not fitted, when it has been."""
    made = Mesh(result.vertices, result.faces)
    examined = examine(made.faces.reshape(-1), len(made.vertices))
    held = (examined.loop >= 0).astype(np.uint8) if held is None else held
    links = Links(examined.first_corner, examined.next_corner)
    return fit_mesh(
        *(as_mesh(*mesh), made, result.vertex_map, held, links, threads), flips=True, **more
    )


def edges_of(faces):
    return {tuple(sorted(edge)) for face in np.asarray(faces).tolist()
            for edge in zip(face, face[1:] + face[:1], strict=True)}  # fmt: skip


def stars(corner_vertex, links):
    """The corners around each vertex in order, from the lowest one on."""
    for start in links.first_corner.tolist():
        if start < 0:
            yield []
            continue
        ring = [start]
        while (corner := int(links.next_corner[ring[-1]])) != start:
            ring.append(corner)
        k = ring.index(min(ring))
        yield ring[k:] + ring[:k]


def before_in_face(corner):
    return corner + 2 if corner % 3 == 0 else corner - 1


def after_in_face(corner):
    return corner - 2 if corner % 3 == 2 else corner + 1


# --- the topology ---------------------------------------------------------------------------------


def naively_turned_over(faces, order, first_ring):
    """The same one by one, with sets: what may be turned over, and what becomes of it."""
    faces, touched = [list(face) for face in faces.tolist()], set()
    for i in order:
        f, k = divmod(int(i), 3)
        a, p, b = (faces[f][(k + j) % 3] for j in range(3)) if f not in touched else (0, 0, 0)
        g = first_ring[i]
        if f in touched or g in touched:
            continue
        (r,) = set(faces[g]) - {a, b}
        edges = edges_of(faces)
        if (min(p, r), max(p, r)) in edges:
            continue
        at_edge = naive.faces_at_edges(faces)
        enough = True
        for v in (a, b):
            spokes = [edge for edge in edges if v in edge]
            is_inside = all(len(at_edge[edge]) == 2 for edge in spokes)
            enough &= sum(v in face for face in faces) > (3 if is_inside else 2)
        if enough:
            faces[f][(k + 2) % 3] = r
            faces[g][faces[g].index(a)] = p
            touched |= {f, g}
    return np.array(faces, np.int32)


def inner_edges(faces):
    """For a corner of each inner edge, before it, the face on the other side."""
    at = {}
    for f, face in enumerate(faces.tolist()):
        for k in range(3):
            at[face[k], face[(k + 1) % 3]] = f
    return {
        3 * f + k: at[face[k], face[k - 1]]
        for f, face in enumerate(faces.tolist())
        for k in range(3)
        if (face[k], face[k - 1]) in at and face[k] < face[k - 1]
    }


@given(seed=st.integers(0, strategies.MAX_SEED))
@settings(max_examples=150, deadline=None)
def test_any_edges_in_any_order_keep_the_topology(seed):
    """As few of them are kept from it as can be, and the corner table stays in order."""
    vertices, faces = strategies.adversarial_mesh(seed)
    rng = np.random.default_rng(seed)
    before, faces = topology(vertices, faces), np.array(faces, np.int32)
    for _ in range(4):
        links = links_of(faces, len(vertices))
        inside = inner_edges(faces)
        order = rng.permutation(np.array(list(inside), np.int64))
        expected = naively_turned_over(faces, order, inside)
        n_old = faces.copy()
        stale, normals = np.zeros(len(vertices), np.uint8), np.zeros((len(faces), 4))
        n = kernels.flips.turn_over(
            *(order, np.asarray(vertices, float), faces.reshape(-1), tuple(links)),
            *(np.zeros(len(faces), np.uint8), stale, normals),
        )
        assert np.array_equal(faces, expected)
        changed = (faces != n_old).any(axis=1)
        assert changed.sum() == 2 * n
        assert set(np.flatnonzero(stale)) == set(faces[changed].reshape(-1))
        crosses = cross_products(np.asarray(vertices, float), faces[changed])
        assert np.allclose(2.0 * normals[changed, :3] * normals[changed, 3:], crosses)
        after = topology(vertices, faces)
        assert after.is_manifold and after.same_topology(before)
        assert after.edge_degrees == before.edge_degrees
        fresh = links_of(faces, len(vertices))
        corner_vertex = faces.reshape(-1)
        found, wanted = stars(corner_vertex, links), stars(corner_vertex, fresh)
        for ring, other in zip(found, wanted, strict=True):
            assert set(ring) == set(other)
            gaps = sum(
                corner_vertex[before_in_face(c)] != corner_vertex[after_in_face(d)]
                for c, d in zip(ring, ring[1:] + ring[:1], strict=True)
            )
            assert gaps <= 1


@given(seed=st.integers(0, strategies.MAX_SEED))
@settings(max_examples=60, deadline=None)
def test_adversarial_meshes_stay_what_they_are(seed):
    """Whole fits, with flips wherever they gain something."""
    mesh = strategies.adversarial_mesh(seed)
    patch = pytest.MonkeyPatch()
    patch.setattr("tetsimplify.fit.FEW", 1.0)
    patch.setattr("tetsimplify.flips.FEW", 0.0)
    try:
        for ratio in (0.6, 0.2):
            before = contracted(mesh, keep_ratio=ratio)
            after = with_flips(mesh, before)
            report = topology(*after)
            assert report.is_manifold
            assert report.same_topology(before.report.topology_after)
            assert np.isfinite(after.vertices).all()
    finally:
        patch.undo()


def test_the_report_is_that_of_the_result():
    mesh = torus()
    result = tetsimplify.simplify(*mesh, keep_ratio=0.04)
    assert not np.array_equal(result.faces, contracted(mesh, keep_ratio=0.04).faces)
    told, found = result.report.topology_after, topology(result.vertices, result.faces)
    for name in ("n_vertices", "n_faces", "n_edges", "euler_characteristic", "edge_degrees"):
        assert getattr(told, name) == getattr(found, name)
    assert told.same_topology(found)
    lengths = np.linalg.norm(
        result.vertices[result.faces] - result.vertices[np.roll(result.faces, 1, axis=1)], axis=2
    )
    assert result.report.shortest_edge_after == pytest.approx(lengths.min())


# --- what is gained -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["torus", "gyroid"])
def test_surfaces_come_nearer_and_triangles_become_better(name):
    mesh = {"torus": torus, "gyroid": gyroid}[name]()
    before = contracted(mesh, keep_ratio=0.04)
    plain = Mesh(fitted(mesh, before), before.faces)
    after = with_flips(mesh, before)
    assert not np.array_equal(after.faces, plain.faces)
    assert mean_distance(mesh, *after) < mean_distance(mesh, *plain)
    shapes = [tetsimplify.quality(*made).radius_ratio.mean() for made in (plain, after)]
    assert shapes[1] > shapes[0]


def roof(n=60, height=0.2):
    """A square with a ridge from corner to corner, and nine cells for it, cut along the ridge.

    Returns the mesh, the vertices of the cells, the map to them, faces with the right cut
    everywhere, and faces with the wrong one in the middle.
    """

    def grid_points(k):
        x, y = np.divmod(np.arange((k + 1) ** 2), k + 1) / np.float64(k)
        return np.column_stack([x, y, height * (1.0 - np.abs(x - y))])

    fine, coarse = grid_points(n), grid_points(3)
    nearest = np.linalg.norm(fine[:, None] - coarse, axis=2).argmin(axis=1)
    a = np.array([0, 1, 2, 4, 5, 6, 8, 9, 10])
    b, c, d = a + 4, a + 5, a + 1
    right = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    wrong = right.copy()
    wrong[4], wrong[13] = [a[4], b[4], d[4]], [b[4], c[4], d[4]]
    a = np.flatnonzero(np.arange(n * (n + 1)) % (n + 1) < n)
    faces = np.concatenate(
        [np.stack([a, a + n + 1, a + n + 2], axis=1), np.stack([a, a + n + 2, a + 1], axis=1)]
    )
    return Mesh(fine, faces), coarse, nearest.astype(np.int32), right, wrong


def fitted_roof(faces, held=()):
    """Its cells after a fit in which no vertex moves far."""
    mesh, vertices, vertex_map, _, _ = roof()
    made, is_held = Mesh(vertices, np.array(faces, np.int32)), np.zeros(16, np.uint8)
    is_held[list(held)] = 1
    links = links_of(made.faces, 16)
    fit = fit_mesh(as_mesh(*mesh), made, vertex_map, is_held, links, 1, flips=True)
    assert (cross_products(*fit)[:, 2] > 0.0).all()
    assert np.array_equal(made.faces, faces)
    return {frozenset(face) for face in fit.faces.tolist()}


@pytest.mark.parametrize("which", ["right", "wrong"])
def test_a_ridge_comes_to_be_where_it_was_and_stays(which, monkeypatch):
    monkeypatch.setattr("tetsimplify.fit.REACH", 1e-9)
    *_, right, wrong = roof()
    faces = {"right": right, "wrong": wrong}[which]
    assert fitted_roof(faces) == {frozenset(face) for face in right.tolist()}


@pytest.mark.parametrize("held", [(5, 10), (6, 9)])
def test_no_edge_goes_or_comes_between_held_vertices(held, monkeypatch):
    monkeypatch.setattr("tetsimplify.fit.REACH", 1e-9)
    *_, wrong = roof()
    assert fitted_roof(wrong, held) == {frozenset(face) for face in wrong.tolist()}


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_planes_and_creases_stay_exact(offset):
    for vertices, faces in (cube(24), flat_square(48)):
        result = tetsimplify.simplify(vertices + offset, faces, keep_ratio=0.02)
        assert mean_distance((vertices + offset, faces), *result[:2]) < 2e-9
        assert not len(tetsimplify.quality(*result[:2]).zero_area_faces)


@pytest.mark.parametrize("ratio", [0.2, 0.04])
def test_caps_vanish(ratio):
    """Vertices in the middle of edges, with a face without height on the other side."""
    mesh = torus()
    result = contracted(mesh, keep_ratio=ratio)
    vertices, faces, n = result.vertices, result.faces.tolist(), len(result.vertices)
    middles, used = [], set()
    for f in range(0, len(faces), 9):
        a, b, c = faces[f]
        if used & {a, b, c}:
            continue
        used |= {a, b, c}
        m = n + len(middles)
        middles.append(0.5 * (vertices[a] + vertices[b]))
        faces[f] = [a, m, c]
        faces += [[m, b, c], [a, b, m]]
    with_caps = result._replace(
        vertices=np.concatenate([vertices, middles]), faces=np.array(faces, np.int32)
    )
    held = np.zeros(len(with_caps.vertices), np.uint8)
    held[n:] = 1
    assert len(tetsimplify.quality(*with_caps[:2]).zero_area_faces) > 3
    after = with_flips(mesh, with_caps, held=held)
    quality = tetsimplify.quality(*after)
    assert not len(quality.zero_area_faces) and quality.aspect_ratio.max() < 1 / THIN
    assert topology(*after).same_topology(topology(*with_caps[:2]))
    left = (after.faces == with_caps.faces).all(axis=1)
    assert left.mean() > 0.5


def test_no_new_face_turns_far():
    """Against the faces that were there before, of which it has parts."""
    mesh = gyroid()
    before = contracted(mesh, keep_ratio=0.04)
    after = with_flips(mesh, before)
    changed = (after.faces != before.faces).any(axis=1)
    assert 0 < changed.sum() < 0.5 * len(changed)
    new, old = cross_products(*after), cross_products(before.vertices, before.faces)
    assert (np.linalg.norm(new, axis=1) > 0.0).all()
    cosines = (new * old).sum(axis=1) / np.linalg.norm(new, axis=1) / np.linalg.norm(old, axis=1)
    assert (cosines > 2.0 * COS_TURN**2 - 1.0).all()  # the vertices move, too


# --- what stays -----------------------------------------------------------------------------------


def test_edges_between_locked_vertices_stay():
    mesh = gyroid()
    locked = np.zeros(len(mesh.vertices), bool)
    locked[np.unique(mesh.faces[:600])] = True
    result = tetsimplify.simplify(*mesh, keep_ratio=0.055, locked=locked)
    before = contracted(mesh, keep_ratio=0.055, locked=locked)
    assert not np.array_equal(result.faces, before.faces)
    kept = set(result.vertex_map[locked].tolist())

    def between(faces):
        return {edge for edge in edges_of(faces) if set(edge) <= kept}

    assert len(kept) > 100 and between(result.faces) == between(before.faces)


def test_feature_edges_stay():
    x = np.linspace(-1.0, 1.0, 61)
    _, faces = meshes.grid(60, 60)
    u, v = np.meshgrid(x, x, indexing="ij")
    vertices = np.stack([u, v, 0.6 * np.abs(u) + 0.3 * v**2 + 0.2 * u**2], axis=2).reshape(-1, 3)
    options = {"keep_ratio": 0.05, "feature_angle": 40.0}
    result = tetsimplify.simplify(vertices, faces, **options)
    before = contracted((vertices, faces), **options)
    ridge = set(np.flatnonzero(np.abs(before.vertices[:, 0]) < 1e-3).tolist())
    along = [{edge for edge in edges_of(r.faces) if set(edge) <= ridge} for r in (before, result)]
    assert len(ridge) > 3 and along[0] == along[1]
    assert not np.array_equal(result.faces, before.faces)


def test_with_data_of_faces_no_edge_is_turned_over():
    mesh = torus()
    plain = contracted(mesh, keep_ratio=0.04)
    free = tetsimplify.simplify(*mesh, keep_ratio=0.04)
    number = np.arange(len(mesh.faces))
    result = tetsimplify.simplify(*mesh, keep_ratio=0.04, face_data={"number": number})
    assert np.array_equal(result.faces, plain.faces)
    assert np.array_equal(result.face_data["number"], result.face_map)
    assert not np.array_equal(result.vertices, plain.vertices)
    assert not np.array_equal(free.faces, plain.faces)
    assert np.array_equal(free.face_map, plain.face_map)
    assert np.array_equal(free.vertex_map, plain.vertex_map)


def test_seams_stay_where_edges_are_turned_over():
    """Texture coordinates at corners: each side keeps its own, and the seam its edges."""
    mesh = torus()
    right = mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 20
    u = mesh.vertices[mesh.faces][:, :, 1] + np.where(right, 1000.0, 0.0)[:, None]
    uv = np.stack([u, u], axis=2)
    options = {"keep_ratio": 0.06, "face_data": {"uv": uv}, "seams": "uv"}
    result = tetsimplify.simplify(*mesh, **options)
    plain = contracted(mesh, **options)
    assert not np.array_equal(result.faces, plain.faces)
    assert result.report.topology_after.same_topology(result.report.topology_before)

    def seam(r):
        is_right = r.face_data["uv"][:, :, 0] > 500
        assert (is_right.all(axis=1) | ~is_right.any(axis=1)).all()
        return edges_of(r.faces[is_right[:, 0]]) & edges_of(r.faces[~is_right[:, 0]])

    assert seam(result) == seam(plain) and len(seam(result)) > 10


# --- threads, progress ----------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.2, 0.04])
def test_any_number_of_threads_gives_the_same(ratio, monkeypatch):
    for name, size in (("VERTICES", 64), ("AT_ONCE", 100)):
        monkeypatch.setattr(f"tetsimplify.fit.{name}", size)
        monkeypatch.setattr(f"tetsimplify.flips.{name}", size)
    monkeypatch.setattr("tetsimplify.fit.SAMPLES", 512)
    monkeypatch.setattr("tetsimplify.fit.GROUP_BITS", 7)
    mesh = gyroid()
    result = contracted(mesh, keep_ratio=ratio)
    one, two, three = (with_flips(mesh, result, threads=n) for n in (1, 2, 3))
    for other in (two, three):
        assert np.array_equal(one.vertices, other.vertices)
        assert np.array_equal(one.faces, other.faces)


def test_progress_ends_at_one():
    told = []
    result = tetsimplify.simplify(
        *torus(), keep_ratio=0.04, progress=lambda stage, done: told.append((stage, done))
    )
    done = [part for stage, part in told if stage == "fit"]
    assert done == sorted(done) and done[-1] == 1.0
    assert result.report.stop == "keep_ratio"
