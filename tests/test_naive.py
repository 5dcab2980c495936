"""The oracles agree with each other and with what is known by hand; generators keep promises."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings

import meshes
import naive
import strategies
from meshes import Mesh

SPHERE, DISC, TORUS, ANNULUS = (2, 0), (1, 1), (0, 0), (0, 2)

HANDLE, HOLE, PINCH, LOOP, TETRAHEDRON = (
    f"obstructed by {what}" for what in ("handle", "hole", "pinch", "loop_of_three", "tetrahedron")
)

NAMED: dict[str, tuple[Callable[[], Mesh], tuple[int, int], dict[str, int]]] = {
    # name: (mesh, (Euler characteristic, boundary loops), edges of each kind)
    "tetrahedron": (meshes.tetrahedron, SPHERE, {TETRAHEDRON: 6}),
    "bipyramid": (lambda: meshes.bipyramid(3), SPHERE, {TETRAHEDRON: 3, "simple": 6}),
    "octahedron": (meshes.octahedron, SPHERE, {"simple": 12}),
    "high valence": (lambda: meshes.bipyramid(12), SPHERE, {"simple": 36}),
    "every lens a tetrahedron": (
        lambda: meshes.every_lens_a_tetrahedron(5),
        SPHERE,
        {TETRAHEDRON: 1, "simple": 8, "nested": 6},
    ),
    "icosphere": (lambda: meshes.icosphere(1), SPHERE, {"simple": 120}),
    "torus": (lambda: meshes.torus(4, 5), TORUS, {"simple": 60}),
    "thin torus": (lambda: meshes.torus(5, 3), TORUS, {"simple": 30, HANDLE: 15}),
    "thinnest torus": (lambda: meshes.torus(3, 3), TORUS, {HANDLE: 27}),
    "minimal torus": (meshes.minimal_torus, TORUS, {HANDLE: 21}),
    "open tube": (lambda: meshes.prism_tube(4), ANNULUS, {HOLE: 12, "simple": 18}),
    "capped tube": (
        lambda: meshes.prism_tube(4, "capped"),
        SPHERE,
        {"nested": 6, "simple": 24},
    ),
    "joined tube": (lambda: meshes.prism_tube(4, "joined"), TORUS, {HANDLE: 12, "simple": 24}),
    "balloons on a neck": (meshes.two_balloons_on_a_neck, SPHERE, {"nested": 3, "simple": 18}),
    "balloons on a long neck": (
        lambda: meshes.two_balloons_on_a_neck(prism_layers=2),
        SPHERE,
        {"nested": 9, "simple": 30},
    ),
    "tori on a neck": (meshes.two_tori_on_a_neck, (-2, 0), {HANDLE: 25, "simple": 44}),
    "handle with a throat": (
        meshes.handle_with_triangular_throat,
        TORUS,
        {HANDLE: 3, "simple": 114},
    ),
    "handle with a long throat": (
        lambda: meshes.handle_with_triangular_throat(prism_layers=2),
        TORUS,
        {HANDLE: 9, "simple": 126},
    ),
    "spike": (meshes.spike, SPHERE, {"nested": 3, "simple": 12}),
    "stack of spikes": (lambda: meshes.stack_of_spikes(4), SPHERE, {"nested": 9, "simple": 15}),
    "triangle": (meshes.triangle, DISC, {LOOP: 3}),
    "two triangles": (meshes.two_triangles, DISC, {LOOP: 1, "simple": 4}),
    "half fan": (lambda: meshes.fan(4), DISC, {"ear": 3, "simple": 6}),
    "cone": (lambda: meshes.fan(6, full=True), DISC, {"simple": 12}),
    "smallest cone": (lambda: meshes.fan(3, full=True), DISC, {LOOP: 3, "simple": 3}),
    "grid": (lambda: meshes.grid(3, 2), DISC, {"ear": 2, "simple": 21}),
    "thin annulus": (lambda: meshes.annulus(5), ANNULUS, {PINCH: 10, "simple": 10}),
    "thinnest annulus": (lambda: meshes.annulus(3), ANNULUS, {PINCH: 6, HOLE: 6}),
    "annulus": (lambda: meshes.annulus(5, 2), ANNULUS, {"simple": 35}),
    "pinched ear": (meshes.ear_with_a_pinched_rest, DISC, {"ear": 7, "simple": 10}),
    "loop between lenses": (
        meshes.loop_between_two_lenses,
        DISC,
        {LOOP: 1, "nested": 4, "simple": 6},
    ),
}


def signed_volume(mesh: Mesh) -> float:
    """Return the volume within a closed surface, negative when it is inside out."""
    p, q, r = np.swapaxes(mesh[0][mesh[1]], 0, 1)
    return float(np.einsum("ij,ij->", p, np.cross(q, r)) / 6)


def kinds(faces: np.ndarray) -> Counter[str]:
    """Count the edges of each kind."""
    coned = naive.cone(faces)
    return Counter(naive.edge_kind(coned, v, u) for v, u in naive.all_edges(faces))


# ---------------------------------------------------------------------------- summary


@pytest.mark.parametrize("name", NAMED)
def test_named_meshes_are_what_they_are_called(name):
    make, shape, _ = NAMED[name]
    vertices, faces = make()
    found = naive.summary(faces)
    assert found.is_sound
    assert meshes.is_surface(faces)
    assert found.components == (shape,)
    assert (found.euler_characteristic, found.n_boundary_loops) == shape
    assert set(faces.ravel().tolist()) == set(range(len(vertices)))
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    if found.is_closed:
        assert signed_volume((vertices, faces)) > 0


def test_summary_of_an_octahedron():
    assert naive.summary(meshes.octahedron()[1]) == naive.Summary(
        edge_degrees=((2, 12),),
        euler_characteristic=2,
        n_components=1,
        n_boundary_loops=0,
        components=(SPHERE,),
        n_duplicate_faces=0,
        n_degenerate_faces=0,
        non_manifold_vertices=(),
        is_consistently_oriented=True,
    )


def test_summary_of_nothing():
    found = naive.summary(np.empty((0, 3), dtype=np.int64))
    assert (found.components, found.euler_characteristic, found.is_sound) == ((), 0, True)


def test_summary_sees_a_bow_tie():
    found = naive.summary(meshes.bow_tie()[1])
    assert found.non_manifold_vertices == (0,)
    assert found.components == ((1, 2),)
    assert not found.is_manifold


def test_summary_sees_three_pages():
    found = naive.summary(meshes.three_pages()[1])
    assert found.edge_degrees == ((1, 6), (3, 1))
    assert not found.is_manifold
    assert not found.is_consistently_oriented


def test_summary_sees_a_flipped_face():
    found = naive.summary(meshes.flipped_face()[1])
    assert found.is_manifold
    assert not found.is_consistently_oriented


def test_summary_sees_that_a_moebius_strip_cannot_be_oriented():
    found = naive.summary(meshes.moebius_strip()[1])
    assert found.components == ((0, 1),)
    assert found.is_manifold
    assert not found.is_consistently_oriented


def test_summary_sees_a_face_twice():
    found = naive.summary(meshes.double_covered_triangle()[1])
    assert (found.n_duplicate_faces, found.edge_degrees) == (1, ((2, 3),))
    assert not found.is_manifold


def test_summary_sees_a_degenerate_face():
    found = naive.summary(meshes.collapsed_face()[1])
    assert found.n_degenerate_faces == 1
    assert not found.is_manifold
    assert found.components == (DISC,)


def test_summary_does_not_count_unused_vertices():
    found = naive.summary(meshes.unused_vertices()[1])
    assert found == naive.summary(meshes.octahedron()[1])


def test_summary_of_several_components():
    parts = [meshes.torus(3, 4), meshes.triangle(), meshes.octahedron(), meshes.annulus(3)]
    found = naive.summary(meshes.disjoint_union(*parts)[1])
    assert found.components == tuple(sorted([TORUS, DISC, SPHERE, ANNULUS]))
    assert (found.n_components, found.n_boundary_loops) == (4, 3)
    assert found.euler_characteristic == 3


# ---------------------------------------------------------------------------- by hand


@pytest.mark.parametrize("name", NAMED)
def test_edges_of_named_meshes_are_of_the_kinds_drawn(name):
    make, _, expected = NAMED[name]
    assert kinds(make()[1]) == expected


def test_boundary_loops_get_a_virtual_vertex_each():
    coned = naive.cone(meshes.disjoint_union(meshes.annulus(3), meshes.triangle())[1])
    assert {vi for vi in coned.neighbours if vi < 0} == {-1, -2, -3}
    found = naive.summary(coned.triangles)
    assert found.components == (SPHERE, SPHERE)
    assert found.is_sound


def test_what_is_no_edge_is_refused():
    faces = meshes.octahedron()[1]
    with pytest.raises(ValueError, match=r"\(4, 5\) is no edge"):
        naive.lenses(faces, 4, 5)
    with pytest.raises(ValueError, match="3 faces"):
        naive.lenses(meshes.three_pages()[1], 0, 1)


def test_a_simple_edge_has_one_lens_of_everything_else():
    faces = meshes.octahedron()[1]
    (lens,) = naive.lenses(faces, 0, 1)
    assert lens.is_disc
    assert len(lens.faces) == len(faces) - 2
    assert lens.rim == ((0, 4), (0, 5), (1, 4), (1, 5))
    assert lens.inside == {2, 3}


def test_a_stack_of_spikes_is_nested_lenses_of_two_faces():
    faces = meshes.stack_of_spikes(4)[1]
    assert sorted(len(lens.faces) for lens in naive.lenses(faces, 0, 1)) == [2, 2, 2, 2, 6]
    (kept,) = naive.kept_lens_candidates(faces, 0, 1)
    left = naive.contract(faces, 0, 1, kept)
    assert naive.vanishing_vertices(faces, 0, 1, kept) == {6, 7, 8, 9}
    # The stack is gone and the edge is contracted: what the bare octahedron would have become.
    bare = meshes.octahedron()[1]
    (whole,) = naive.lenses(bare, 0, 1)
    as_sets = [
        {frozenset(t) for t in f.tolist()} for f in (left, naive.contract(bare, 0, 1, whole))
    ]
    assert as_sets[0] == as_sets[1]


def test_the_neck_takes_the_smaller_balloon_along():
    vertices, faces = meshes.two_balloons_on_a_neck(meshes.icosphere(0), meshes.octahedron())
    neck = next(e for e in naive.all_edges(faces) if naive.edge_kind(faces, *e) == "nested")
    larger, smaller = naive.kept_lens_candidates(faces, *neck)
    assert (len(larger.faces), len(smaller.faces)) == (19 - 1, 7 - 1)
    for kept in (larger, smaller):
        left = naive.contract(faces, *neck, kept)
        assert naive.summary(left).components == (SPHERE,)
        assert len(left) == len(kept.faces)
    assert naive.is_contractible(vertices, faces, *neck)


def test_a_lens_with_a_hole_or_a_handle_is_kept_though_it_be_smaller():
    ball = meshes.icosphere(0)
    for small in (meshes.fan(4, full=True), meshes.minimal_torus()):
        faces = meshes.connected_sum(ball, small, face_b=0, prism_layers=1)[1]
        ring = next(e for e in naive.all_edges(faces) if naive.edge_kind(faces, *e) == "nested")
        (kept,) = naive.kept_lens_candidates(faces, *ring)
        (other,) = (lens for lens in naive.lenses(faces, *ring) if lens != kept)
        assert len(kept.vertices) < len(other.vertices)
        after = naive.summary(naive.contract(faces, *ring, kept))
        assert naive.has_same_topology(naive.summary(faces), after)


def test_removal_limit_spares_the_balloon():
    vertices, faces = meshes.two_balloons_on_a_neck(meshes.icosphere(0), meshes.octahedron())
    v, u = next(e for e in naive.all_edges(faces) if naive.edge_kind(faces, *e) == "nested")
    larger, smaller = naive.kept_lens_candidates(faces, v, u)
    reach = max(naive.distances_to_midpoint(vertices, v, u, smaller.inside))
    assert reach < max(naive.distances_to_midpoint(vertices, v, u, larger.inside))
    found = naive.kept_lens_candidates(faces, v, u, vertices=vertices, removal_limit=reach)
    assert found == [larger]
    assert not naive.is_contractible(vertices, faces, v, u, removal_limit=0.99 * reach)
    with pytest.raises(ValueError, match="needs vertices"):
        naive.is_contractible(None, faces, v, u, removal_limit=1.0)


def test_removal_limit_on_what_is_inside_lets_a_spike_go():
    vertices, faces = meshes.spike(height=50)
    limit = {"removal_limit": 2.0}
    assert naive.is_contractible(vertices, faces, 0, 1, **limit)
    assert not naive.is_contractible(vertices, faces, 0, 1, **limit, limit_on="vanishing")
    assert naive.is_contractible(vertices, faces, 0, 1, limit_on="vanishing")


def test_locked_vertices_neither_go_nor_move():
    vertices, faces = meshes.spike()
    tip = 6
    assert naive.is_contractible(vertices, faces, 0, 1, locked=[0])
    assert naive.is_contractible(vertices, faces, 0, 1, locked=[1, 2, 3])
    assert not naive.is_contractible(vertices, faces, 0, 1, locked=[0, 1])
    assert not naive.is_contractible(vertices, faces, 0, 1, locked=[tip])


def test_a_chord_takes_its_ear_along():
    faces = meshes.fan(4)[1]  # chord 0 2 cuts off the face 0 1 2
    small, large = sorted(naive.lenses(faces, 0, 2), key=lambda lens: len(lens.faces))
    assert (small.faces, len(large.faces)) == (frozenset(), 2)
    assert naive.obstacles(faces, 0, 2)[small] >= {"loop_of_three"}
    left = naive.contract(faces, 0, 2, large)
    assert naive.summary(left).components == (DISC,)
    assert len(left) == 2


def test_what_is_left_of_an_ear_may_be_pinched():
    _, faces = meshes.ear_with_a_pinched_rest()
    rest, kept = sorted(naive.lenses(faces, 1, 2), key=lambda lens: len(lens.faces))
    assert rest.is_disc
    assert naive.summary(faces[sorted(rest.faces)]).non_manifold_vertices == (0,)
    assert not naive.obstacles(faces, 1, 2)[kept]
    assert naive.summary(naive.contract(faces, 1, 2, kept)).components == (DISC,)


def test_a_loop_may_vanish_between_two_discs():
    faces = meshes.loop_between_two_lenses()[1]
    for kept, against in naive.obstacles(faces, 3, 4).items():
        others = [lens for lens in naive.lenses(faces, 3, 4) if lens != kept]
        assert all(lens.is_disc for lens in others)
        if kept.faces:
            assert against == {"hole"}
            assert not any(lens.faces for lens in others)
            assert naive.summary(naive.contract(faces, 3, 4, kept)).components == (SPHERE,)
        else:
            assert "loop_of_three" in against


def test_a_neck_with_a_handle_on_both_sides_separates_and_is_obstructed():
    faces = meshes.two_tori_on_a_neck()[1]
    separating = 0
    for v, u in naive.all_edges(faces):
        found = naive.lenses(faces, v, u)
        if len(found) == 2 and all(lens.has_plain_rim for lens in found):
            separating += 1
            assert {lens.euler_characteristic for lens in found} == {-1}
            assert not naive.is_contractible(None, faces, v, u)
    assert separating >= 1


def test_contraction_takes_no_more_from_other_components():
    pair = meshes.disjoint_union(meshes.octahedron(), meshes.annulus(4))
    (kept,) = naive.kept_lens_candidates(pair[1], 0, 1)
    left = naive.contract(*pair[1:], 0, 1, kept)
    assert naive.summary(left).components == naive.summary(pair[1]).components
    assert len(left) == len(pair[1]) - 2
    assert 1 not in left


def test_remaining_contractible_is_strict():
    vertices, faces = meshes.spike()
    lengths = {e: math.dist(*vertices[list(e)]) for e in naive.all_edges(faces)}
    longest = max(lengths.values())
    assert len(naive.remaining_contractible(vertices, faces, math.inf)) == 15
    left_out = set(lengths) - set(naive.remaining_contractible(vertices, faces, longest))
    assert {lengths[e] for e in left_out} == {longest}
    assert naive.remaining_contractible(vertices, faces, min(lengths.values())) == []
    assert naive.remaining_contractible(*meshes.minimal_torus(), math.inf) == []
    assert naive.remaining_contractible(vertices, faces, math.inf, locked=range(7)) == []


# ---------------------------------------------------------------------------- the oracles agree


def assert_oracles_agree(faces: np.ndarray, *, also_everything: bool) -> None:
    """Compare the oracles at every edge, and the surface before and after each contraction."""
    before = naive.summary(faces)
    coned = naive.cone(faces)
    for v, u in naive.all_edges(faces):
        candidates = naive.kept_lens_candidates(coned, v, u)
        verdict = bool(candidates)
        assert naive.is_contractible(None, coned, u, v) == verdict
        assert naive.is_contractible_by_trying(faces, v, u) == verdict, (v, u)
        if also_everything and len(naive.lenses(coned, v, u)) < 5:
            found = naive.is_contractible_by_trying_everything(faces, v, u)
            assert found == verdict, (v, u)
        for kept in candidates:
            after = naive.summary(naive.contract(faces, v, u, kept))
            assert naive.has_same_topology(before, after)


@pytest.mark.parametrize("name", NAMED)
def test_oracles_agree_on_named_meshes(name):
    assert_oracles_agree(NAMED[name][0]()[1], also_everything=len(NAMED[name][2]) < 50)


@pytest.mark.parametrize("first", range(0, 400, 40))
def test_oracles_agree_on_adversarial_meshes(first):
    for seed in range(first, first + 40):
        faces = strategies.adversarial_mesh(seed)[1]
        if len(faces) <= 40:
            assert_oracles_agree(faces, also_everything=len(faces) <= 25)


def test_oracles_agree_on_densely_flipped_spheres():
    # Few vertices and random flips: nearly every edge has more than two common neighbours.
    rng = np.random.default_rng(0)
    for n in (3, 4, 5, 6):
        mesh = meshes.bipyramid(n)
        for _ in range(6):
            mesh = meshes.flipped_edges(mesh, rng, 20)
            assert_oracles_agree(mesh[1], also_everything=True)


def test_an_edge_between_two_boundary_loops_is_never_contractible():
    n_seen = 0
    for seed in range(150):
        coned = naive.cone(strategies.adversarial_mesh(seed)[1])
        for v, u in coned.at_edge:
            if min(v, u) < 0:
                continue
            if len({vi for vi in coned.neighbours[v] | coned.neighbours[u] if vi < 0}) > 1:
                n_seen += 1
                assert all("pinch" in found for found in naive.obstacles(coned, v, u).values())
    assert n_seen > 100


# ---------------------------------------------------------------------------- the generators


def test_adversarial_meshes_have_edges_of_every_kind():
    found: Counter[str] = Counter()
    for seed in range(200):
        found += kinds(strategies.adversarial_mesh(seed)[1])
    for kind in ("simple", "nested", "ear", HANDLE, HOLE, PINCH, LOOP, TETRAHEDRON):
        assert found[kind] > 20, found
    assert sum(n for kind, n in found.items() if kind != "simple") > 0.25 * found.total()


def test_adversarial_meshes_are_sound_and_in_general_position():
    shapes = set()
    for seed in range(400):
        vertices, faces = strategies.adversarial_mesh(seed)
        found = naive.summary(faces)
        assert found.is_sound, seed
        assert 1 <= len(faces) <= strategies.MAX_FACES
        assert len(np.unique(vertices, axis=0)) == len(vertices) == len(np.unique(faces))
        lengths = [math.dist(vertices[p], vertices[q]) for p, q in naive.all_edges(faces)]
        assert min(lengths) > 1e-4 * max(lengths) or len(faces) > 1
        assert len(set(lengths)) == len(lengths)
        shapes.add(found.components)
    assert len(shapes) > 50


def test_adversarial_meshes_depend_on_the_seed_alone():
    for p, q in zip(strategies.adversarial_mesh(7), strategies.adversarial_mesh(7), strict=True):
        assert np.array_equal(p, q)


@settings(max_examples=30, deadline=None)
@given(strategies.surfaces(max_operations=4))
def test_surfaces_are_sound(mesh):
    assert naive.summary(mesh[1]).is_sound


@settings(max_examples=30, deadline=None)
@given(strategies.closed_surfaces(max_operations=4))
def test_closed_surfaces_are_closed(mesh):
    found = naive.summary(mesh[1])
    assert found.is_sound
    assert found.is_closed


@settings(max_examples=60, deadline=None)
@given(strategies.surfaces_with_an_edge(max_parts=1, max_operations=4))
def test_oracles_agree_on_an_edge(mesh_and_edge):
    (vertices, faces), (v, u) = mesh_and_edge
    verdict = naive.is_contractible(vertices, faces, v, u)
    assert naive.is_contractible_by_trying(faces, v, u) == verdict


def test_operations_do_to_the_topology_what_they_say():
    rng = np.random.default_rng(1)
    ball = meshes.icosphere(1)
    opposite = 60
    assert not set(ball[1][0]) & set(ball[1][opposite])
    for layers in range(4):
        handle = meshes.add_handle(ball, 0, opposite, prism_layers=layers)
        assert naive.summary(handle[1]).components == (TORUS,)
        double = meshes.connected_sum(handle, handle, face_a=9, face_b=9, prism_layers=layers)
        assert naive.summary(double[1]).components == ((-2, 0),)
        assert signed_volume(double) > 0
    stacked = meshes.insert_degree_3(ball, rng, 2, 3)
    assert naive.summary(stacked[1]).components == (SPHERE,)
    assert len(stacked[1]) == len(ball[1]) + 2 * 3 * 2
    holed = meshes.punched(ball, rng, 1, max_size=1)
    assert naive.summary(holed[1]).components == (DISC,)
    flipped = meshes.flipped_edges(ball, rng, 50)
    assert naive.summary(flipped[1]).components == (SPHERE,)
    strip = meshes.grid(3, 1)
    ends = [e for e in meshes.boundary_edges(strip[1]) if set(e) in ({0, 1}, {6, 7})]
    assert naive.summary(meshes.bridged(strip, *ends)[1]).components == (ANNULUS,)


def test_operations_refuse_what_would_be_no_surface():
    mesh = meshes.octahedron()
    with pytest.raises(ValueError, match="apart from each other"):
        meshes.add_handle(mesh, 0, 0)
    with pytest.raises(ValueError, match="no surface"):
        meshes.add_handle(mesh, 0, 5, prism_layers=0)
    with pytest.raises(ValueError, match="no surface"):
        meshes.connected_sum(meshes.triangle(), meshes.triangle(), face_a=0, face_b=0)


def test_shuffling_changes_numbers_only():
    vertices, faces = meshes.two_tori_on_a_neck()
    points, triangles = meshes.shuffled((vertices, faces), np.random.default_rng(2))
    assert naive.summary(triangles) == naive.summary(faces)
    assert kinds(triangles) == kinds(faces)
    assert sorted(map(tuple, points)) == sorted(map(tuple, vertices))
    assert not np.array_equal(triangles, faces)
    assert signed_volume((points, triangles)) == pytest.approx(signed_volume((vertices, faces)))
