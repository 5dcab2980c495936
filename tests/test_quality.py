"""The quality report against closed forms, the textbook formulas, exact arithmetic and others."""

import math
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshes
import models
import strategies
import tetsimplify
from data import data_dir, needs_data
from tetsimplify import MeshError, OptionError, io
from tetsimplify.quality import MEASURES, quality

FACE_MEASURES = [name for name, measure in MEASURES.items() if measure.element == "face"]
ARRAYS = [*MEASURES, "edges", "valence", "is_on_boundary", "zero_area_faces"]


def one_face(*corners):
    return quality(np.array(corners, float), [[0, 1, 2]])


def of_face(*corners):
    report = one_face(*corners)
    return {name: getattr(report, name).item() for name in FACE_MEASURES}


def close(value, rel):
    """Relative closeness alone: what `approx` adds by itself would hide slivers."""
    return pytest.approx(value, rel=rel, abs=0)


def soup(rng, n_vertices, n_faces):
    """Any triangles, some of them with a vertex twice."""
    return rng.random((n_vertices, 3)), rng.integers(0, n_vertices, (n_faces, 3))


# ---------------------------------------------------------------------------- the oracle


def slow_face(a, b, c):
    """Radii and angles as in the textbook; None where there is no area."""
    lengths = np.array([np.linalg.norm(c - b), np.linalg.norm(a - c), np.linalg.norm(b - a)])
    area = np.linalg.norm(np.cross(b - a, c - a)) / 2
    s = lengths.sum() / 2
    if area < 1e-12:
        return None
    r, big_r = area / s, lengths.prod() / (4 * area)
    cosines = [
        (lengths[i - 1] ** 2 + lengths[i - 2] ** 2 - lengths[i] ** 2)
        / (2 * lengths[i - 1] * lengths[i - 2])
        for i in range(3)
    ]
    angles = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
    return {
        "radius_ratio": 2 * r / big_r,
        "min_angle": angles.min(),
        "max_angle": angles.max(),
        "aspect_ratio": lengths.max() / (2 * np.sqrt(3) * r),
        "edge_ratio": lengths.max() / lengths.min(),
        "area": area,
    }


def slow_edges(faces):
    """The faces of each edge, each with whether it runs from the lower vertex to the upper."""
    found = defaultdict(list)
    for fi, (p, q, r) in enumerate(np.asarray(faces).tolist()):
        if len({p, q, r}) == 3:
            for v, u in ((p, q), (q, r), (r, p)):
                found[min(v, u), max(v, u)].append((fi, v < u))
    return found


def slow_dihedral(vertices, faces, first, second):
    normals = []
    for fi, upwards in (first, second):
        a, b, c = vertices[faces[fi]]
        normal = np.cross(b - a, c - a)
        normals.append(normal / np.linalg.norm(normal) * (1 if upwards else -1))
    return np.degrees(np.arccos(np.clip(-normals[0] @ normals[1], -1, 1)))


def assert_agrees(vertices, faces):
    vertices, faces = np.asarray(vertices), np.asarray(faces)
    report = quality(vertices, faces)
    flat = []
    for fi, face in enumerate(faces):
        slow = slow_face(*vertices[face])
        if slow is None:
            flat.append(fi)
            continue
        for name, value in slow.items():
            assert getattr(report, name)[fi] == pytest.approx(value, rel=1e-6, abs=1e-5), name
    assert report.zero_area_faces.tolist() == flat
    assert report.geometric_criterion == pytest.approx((1 - report.radius_ratio).mean() / 2)

    edges = slow_edges(faces)
    assert [tuple(edge) for edge in np.unique(report.edges, axis=0).tolist()] == sorted(edges)
    interior = report.edges[: len(report.dihedral_angle)].tolist()
    assert {tuple(edge) for edge in interior} == {e for e, at in edges.items() if len(at) == 2}
    for edge, angle in zip(interior, report.dihedral_angle, strict=False):
        slow = slow_dihedral(vertices, faces, *edges[tuple(edge)])
        assert angle == pytest.approx(slow, abs=1e-4)
    lengths = np.linalg.norm(np.diff(vertices[report.edges], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(report.edge_length, lengths, rtol=1e-14)

    neighbours, boundary = defaultdict(set), set()
    for (v, u), at in edges.items():
        neighbours[v].add(u)
        neighbours[u].add(v)
        boundary |= {v, u} if len(at) == 1 else set()
    assert report.valence.tolist() == [len(neighbours[v]) for v in range(len(vertices))]
    assert set(np.flatnonzero(report.is_on_boundary).tolist()) == boundary
    inside = [abs(len(near) - 6) for v, near in neighbours.items() if near and v not in boundary]
    outside = [abs(len(neighbours[v]) - 4) for v in boundary]
    assert (report.n_interior_vertices, report.n_boundary_vertices) == (len(inside), len(outside))
    assert report.topological_criterion == pytest.approx(sum(inside) / max(len(inside), 1))
    assert report.boundary_criterion == pytest.approx(sum(outside) / max(len(outside), 1))


def test_adversarial_surfaces():
    for seed in range(40):
        assert_agrees(*strategies.adversarial_mesh(seed))


@settings(max_examples=60, deadline=None)
@given(st.integers(3, 9), st.integers(1, 25), st.integers(0, 2**32 - 1))
def test_any_set_of_triangles(n_vertices, n_faces, seed):
    assert_agrees(*soup(np.random.default_rng(seed), n_vertices, n_faces))


@pytest.mark.parametrize(
    "mesh",
    [meshes.moebius_strip(), meshes.bow_tie(), meshes.three_pages(), meshes.flipped_face()]
    + [meshes.double_covered_triangle(), meshes.collapsed_face(), meshes.unused_vertices()],
)
def test_broken_meshes(mesh):
    assert_agrees(*mesh)


def test_edges_are_those_of_the_topology_report():
    mesh = meshes.disjoint_union(meshes.grid(5, 4), meshes.three_pages(), meshes.torus(5, 6))
    report, topology = quality(*mesh), tetsimplify.topology(*mesh)
    assert report.n_edges == len(report.edges) == topology.n_edges
    assert len(report.dihedral_angle) == topology.edge_degrees[2]


# ---------------------------------------------------------------------------- closed forms


def test_equilateral_triangle():
    found = of_face((0, 0, 0), (2, 0, 0), (1, math.sqrt(3), 0))
    assert found == pytest.approx(
        {"radius_ratio": 1, "min_angle": 60, "max_angle": 60, "aspect_ratio": 1, "edge_ratio": 1}
        | {"area": math.sqrt(3)}
    )


def test_right_isosceles_triangle():
    found = of_face((0, 0, 0), (3, 0, 0), (0, 0, 3))
    assert found == pytest.approx(
        {"radius_ratio": 2 * (math.sqrt(2) - 1), "min_angle": 45, "max_angle": 90, "area": 4.5}
        | {"edge_ratio": math.sqrt(2), "aspect_ratio": (1 + math.sqrt(2)) / math.sqrt(3)}
    )


@pytest.mark.parametrize("t", [1e-3, 1e-8, 1e-12, 1e-15])
def test_needles_and_caps_thinner_and_thinner(t):
    """Leading terms: a needle of width t has the ratio 2 t, a cap of height t has 2 t^2."""
    needle = of_face((1, t / 2, 0), (0, 0, 0), (1, -t / 2, 0))
    cap = of_face((0, 0, 0), (2, 0, 0), (1, t, 0))
    assert needle["radius_ratio"] == close(2 * t, t + 1e-14)
    assert math.radians(needle["min_angle"]) == close(t, t + 1e-14)
    assert needle["edge_ratio"] == close(1 / t, t + 1e-14)
    assert cap["radius_ratio"] == close(2 * t * t, t + 1e-14)
    assert math.radians(cap["min_angle"]) == close(t, t + 1e-14)
    assert cap["max_angle"] == pytest.approx(180 - 2 * math.degrees(t))


def test_regular_solids():
    corners = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    report = quality(corners, [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)])
    np.testing.assert_allclose(report.dihedral_angle, 180 - math.degrees(math.acos(1 / 3)))
    assert report.geometric_criterion == pytest.approx(0, abs=1e-15)
    assert report.topological_criterion == 3  # all valences are 3

    report = quality(*icosahedron())
    assert report.valence.tolist() == [5] * 12
    assert report.topological_criterion == 1
    inner = math.degrees(math.acos(-math.sqrt(5) / 3))
    np.testing.assert_allclose(report.dihedral_angle, 180 - inner)


def icosahedron():
    """`icosphere(0)` brought out of its general position."""
    golden = (1 + 5**0.5) / 2
    points = [(x, y * golden, 0) for x in (-1, 1) for y in (-1, 1)]
    return np.array([np.roll(p, k) for k in range(3) for p in points]), meshes.icosphere(0)[1]


def flat_grid(n):
    i, j = (g.ravel() for g in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    return np.stack([i, j, 0 * i], axis=1), meshes.quads_cut(n, n, (n + 1, n + 1))


def test_flat_grid():
    report = quality(*flat_grid(6))
    assert report.topological_criterion == 0  # six neighbours inside, four on the sides
    assert report.n_boundary_vertices == 24
    assert report.boundary_criterion == pytest.approx((2 * 2 + 2 * 1) / 24)  # 2, 2, 3, 3 in corners
    assert not report.dihedral_angle.any()
    assert report.radius_ratio == pytest.approx(2 * (math.sqrt(2) - 1))
    assert report.geometric_criterion == pytest.approx(1.5 - math.sqrt(2))


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("angle", [0, 1e-7, 30, 90, 150, 179, 180])
def test_a_hinge(angle, flip):
    """Folding one triangle about its edge, whichever way the faces are oriented."""
    t = math.radians(angle)
    vertices = [(0, 0, 0), (0, 1, 0), (1, 0.4, 0), (-math.cos(t), 0.6, math.sin(t))]
    report = quality(vertices, [(0, 1, 2), (0, 1, 3) if flip else (1, 0, 3)])
    assert report.edges[0].tolist() == [0, 1]
    assert report.dihedral_angle == pytest.approx([angle], rel=1e-8, abs=1e-14)


# ---------------------------------------------------------------------------- exact arithmetic


def exact_face(corners):
    """Radius ratio, sine of the smallest angle and area, to 60 digits from the floats given."""
    p, q, r = ([Fraction(float(x)) for x in corner] for corner in corners)
    sides = [[y - x for x, y in zip(*ends, strict=True)] for ends in ((p, q), (q, r), (r, p))]
    (ax, ay, az), (bx, by, bz) = sides[:2]
    normal = (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    with localcontext() as context:
        context.prec = 60

        def norm(vector):
            square = sum(x * x for x in vector)
            return (Decimal(square.numerator) / Decimal(square.denominator)).sqrt()

        a, b, c = sorted(map(norm, sides))
        double = norm(normal)
        ratio = 4 * double * double / (a * b * c * (a + b + c))
        return float(ratio), float(double / (b * c)), float(double / 2)


def assert_exact(corners, rel):
    found = of_face(*corners)
    ratio, sine, area = exact_face(corners)
    assert found["radius_ratio"] == close(ratio, rel)
    assert found["min_angle"] == close(math.degrees(math.asin(sine)), rel)
    assert found["area"] == close(area, rel)


@pytest.mark.parametrize("far", [0.0, 1e6])
@pytest.mark.parametrize("thin", [1e-2, 1e-5, 1e-9])
def test_needles_are_exact_wherever_they_are(thin, far):
    rng = np.random.default_rng(5)
    for _ in range(30):
        p, q, by = rng.normal(size=(3, 3))
        corners = np.array([p, q, q + thin * by]) + far
        assert_exact(corners, 1e-13)
        assert_exact(corners[::-1], 1e-13)


@pytest.mark.parametrize("thin", [1e-2, 1e-5, 1e-8])
def test_caps_are_as_exact_as_their_sides(thin):
    """Rounding of the sides alone moves the corner by 1e-16 against a height of `thin`."""
    rng = np.random.default_rng(6)
    for _ in range(30):
        p, q, by = rng.normal(size=(3, 3))
        assert_exact([p, q, (p + q) / 2 + thin * by], 1e-14 / thin)


# ---------------------------------------------------------------------------- invariance


def measured(mesh):
    report = quality(*mesh)
    return {name: getattr(report, name) for name in ARRAYS}


@pytest.mark.parametrize("seed", range(8))
def test_rotation_and_translation(seed):
    vertices, faces = strategies.adversarial_mesh(seed)
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    one, two = measured((vertices, faces)), measured((vertices @ turn.T + [3, -4, 5], faces))
    for name in ARRAYS:
        np.testing.assert_allclose(two[name], one[name], rtol=1e-8, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("exponent", [-1000, -400, -3, 5, 400, 1000])
def test_scaling_changes_no_bit_but_of_lengths(exponent):
    vertices, faces = meshes.torus(7, 9)
    one, two = measured((vertices, faces)), measured((np.ldexp(vertices, exponent), faces))
    for name in set(ARRAYS) - {"area", "edge_length"}:
        np.testing.assert_array_equal(two[name], one[name], err_msg=name)
    np.testing.assert_array_equal(two["edge_length"], np.ldexp(one["edge_length"], exponent))
    if abs(exponent) <= 400:  # squares of lengths are floats still
        np.testing.assert_array_equal(two["area"], np.ldexp(one["area"], 2 * exponent))


@pytest.mark.parametrize("seed", range(8))
def test_order_does_not_matter(seed):
    mesh = strategies.adversarial_mesh(seed)
    one, two = measured(mesh), measured(meshes.shuffled(mesh, np.random.default_rng(seed)))
    for name in set(ARRAYS) - {"edges", "zero_area_faces"}:
        np.testing.assert_allclose(np.sort(two[name]), np.sort(one[name]), rtol=1e-9, atol=1e-9)


def test_the_same_bytes_in_every_thread_and_no_input_changed():
    mesh = meshes.icosphere(3)
    vertices, faces = mesh[0].copy(), mesh[1].astype(np.int32)
    kept = vertices.tobytes(), faces.tobytes()
    one = measured((vertices, faces))
    with ThreadPoolExecutor(4) as pool:
        for other in pool.map(measured, [(vertices, faces)] * 8):
            assert all(other[name].tobytes() == one[name].tobytes() for name in ARRAYS)
    assert (vertices.tobytes(), faces.tobytes()) == kept


# ---------------------------------------------------------------------------- without area


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("corners", "edge_ratio"),
    [
        ([(0, 0, 0), (1, 2, 3), (3, 6, 9)], 3),  # on a line
        ([(0, 0, 0), (1, 0, 0), (1, 0, 0)], math.inf),  # two corners in one place
        ([(7, 7, 7)] * 3, math.inf),
    ],
)
def test_faces_without_area_have_defined_values(corners, edge_ratio):
    found = of_face(*corners)
    assert found == pytest.approx(
        {"radius_ratio": 0, "min_angle": 0, "max_angle": 180, "aspect_ratio": math.inf, "area": 0}
        | {"edge_ratio": edge_ratio}
    )
    report = one_face(*corners)
    assert report.zero_area_faces.tolist() == [0]
    assert report.geometric_criterion == 0.5


@pytest.mark.parametrize("at", range(3))
@pytest.mark.parametrize("reverse", [False, True])
def test_a_face_without_area_has_no_dihedral_angle(at, reverse):
    """Its normal is zero, with whatever signs."""
    vertices = np.array([(0, 0, 0), (2, 0, 0), (1, 0, 0), (1, -1, -1)], float)
    face = np.roll((0, 1, 2), at)
    report = quality(vertices, [face[::-1] if reverse else face, (0, 1, 3)])
    assert report.dihedral_angle.tolist() == [0]


COORDINATES = [0.0, 1.0, -1.0, 5e-324, 1e-310, 1e-200, 1e-30, 1e30, 1e200, 1.7e308, -1.7e308]


@pytest.mark.filterwarnings("error")
@settings(max_examples=100, deadline=None)
@given(
    st.lists(
        st.tuples(*[st.sampled_from(COORDINATES)] * 3),
        min_size=3,
        max_size=6,
    )
)
def test_nothing_is_ever_nan(points):
    faces = list(combinations(range(len(points)), 3))
    report = quality(points, faces)
    for name, measure in MEASURES.items():
        values = getattr(report, name)
        assert not np.isnan(values).any()
        assert (values >= measure.low).all() and (values <= measure.high).all()
        report.worst(name, 3), report.histogram(name)
    assert not np.isnan(list(report.as_dict().values())).any()


@pytest.mark.parametrize("size", [1e-310, 1e-200, 1e200, 1.7e308])
def test_sizes_at_the_ends_of_what_a_float_can_be(size):
    vertices, faces = icosahedron()
    report = quality(vertices / np.abs(vertices).max() * size, faces)
    assert report.radius_ratio == pytest.approx(1)
    assert report.dihedral_angle.std() < 1e-8


def test_no_faces_and_no_vertices():
    for vertices in ([], [(0, 0, 0)]):
        report = quality(vertices, [])
        assert report.n_faces == report.n_edges == report.topological_criterion == 0
        numbers = report.as_dict()
        assert numbers.pop("n_vertices") == len(vertices)
        assert set(numbers.values()) == {0}
        assert report.worst("area").tolist() == []
        assert report.histogram("aspect_ratio", 3).counts.tolist() == [0, 0, 0]


# ---------------------------------------------------------------------------- the report


def test_summary_is_of_the_values_of_elements():
    report = quality(*meshes.icosphere(2))
    for name in MEASURES:
        summary, values = report.summary(name), np.sort(getattr(report, name))
        assert (summary.n, summary.min, summary.max) == (len(values), values[0], values[-1])
        assert summary.mean == pytest.approx(values.mean())
        for percent, value in zip((1, 5, 50, 95, 99), (*summary[2:5], *summary[6:8]), strict=True):
            assert value == np.percentile(values, percent, method="inverted_cdf"), (name, percent)


def test_vertices_without_edges_are_not_counted():
    report = quality(*meshes.unused_vertices())
    assert report.summary("irregularity").n == 6
    assert report.histogram("irregularity", [0, 1, 2, 3]).counts.tolist() == [0, 0, 6]
    assert report.topological_criterion == 2


def test_histogram():
    report = quality(*meshes.torus(8, 9))
    for name, measure in MEASURES.items():
        counts, edges = report.histogram(name, 7)
        assert counts.sum() == len(getattr(report, name))
        assert edges[0] == measure.low
        if math.isfinite(measure.high):
            assert edges[-1] == measure.high
    low, high = report.histogram("min_angle", [0, 30, 60]).counts
    assert (low, high) == ((report.min_angle < 30).sum(), (report.min_angle >= 30).sum())


def test_histogram_of_values_that_differ_by_rounding():
    report = quality(*icosahedron())
    for name in MEASURES:
        assert report.histogram(name).counts.max() == len(getattr(report, name))


def test_histogram_counts_infinity_where_it_is_asked_for():
    report = quality([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2), (0, 1, 1)])
    assert report.histogram("aspect_ratio").counts.sum() == 1
    assert report.histogram("aspect_ratio", [1, 2, math.inf]).counts.tolist() == [1, 1]


@pytest.mark.parametrize("name", MEASURES)
def test_worst_come_first_and_equals_in_order(name):
    report = quality(*meshes.punched(meshes.torus(6, 6), np.random.default_rng(0), 3))
    values = getattr(report, name)
    order = sorted(
        range(len(values)),
        key=lambda i: (values[i] if MEASURES[name].worst == "least" else -values[i], i),
    )
    for k in (0, 1, 5, len(values), len(values) + 1):
        assert report.worst(name, k).tolist() == order[:k]


def test_as_dict_is_plain_numbers():
    report = quality(*meshes.grid(3, 3))
    numbers = report.as_dict()
    assert all(type(value) in (int, float) for value in numbers.values())
    assert numbers["n_faces"] == 18 and numbers["n_zero_area_faces"] == 0
    assert numbers["geometric_criterion"] == report.geometric_criterion
    assert numbers["min_angle_p5"] == report.summary("min_angle").p5


@pytest.mark.parametrize("bins", [0, -1, 2.5, "many", [1], [1, 1], [0, math.nan], [[0, 1]], None])
def test_bad_bins(bins):
    with pytest.raises(OptionError, match="bins must be"):
        quality(*meshes.triangle()).histogram("area", bins)


@pytest.mark.parametrize("k", [-1, 1.5, True, None])
def test_bad_number_of_worst(k):
    with pytest.raises(OptionError, match="k must be"):
        quality(*meshes.triangle()).worst("area", k)


def test_bad_names():
    report = quality(*meshes.triangle())
    for ask in (report.summary, report.histogram, report.worst):
        with pytest.raises(OptionError, match=r"name must be one of 'radius_ratio', .*'beauty'"):
            ask("beauty")


def test_bad_meshes():
    with pytest.raises(MeshError, match="finite"):
        quality([(0, 0, math.nan)] * 3, [(0, 1, 2)])
    with pytest.raises(MeshError, match="indices"):
        quality([(0, 0, 0)] * 3, [(0, 1, 3)])


# ---------------------------------------------------------------------------- large and foreign


def test_a_hub_of_many_faces():
    n = 50_000
    angle = 2 * np.pi * np.arange(n) / n
    ring = np.arange(1, n + 1)
    vertices = np.vstack([(0, 0, 0), np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)])
    report = quality(vertices, np.column_stack([np.zeros(n, int), ring, np.roll(ring, -1)]))
    assert report.topological_criterion == n - 6
    assert report.boundary_criterion == 1
    assert report.worst("irregularity", 1).tolist() == [0]
    assert math.radians(report.min_angle.mean()) == pytest.approx(2 * np.pi / n, rel=1e-9)


def isosurface():
    """Marching tetrahedra: slivers of all kinds."""
    return tetsimplify.extract_isosurface(models.gyroid(16), 0.05)


def test_simplification_makes_better_triangles():
    mesh = isosurface()
    result = tetsimplify.simplify(*mesh, max_edge_length=1.2)
    before, after = quality(*mesh), quality(result.vertices, result.faces)
    assert after.geometric_criterion < before.geometric_criterion
    assert after.summary("min_angle").p5 > before.summary("min_angle").p5
    assert after.summary("aspect_ratio").p99 < before.summary("aspect_ratio").p99


def test_pyvista_agrees():
    pyvista = pytest.importorskip("pyvista")
    mesh = isosurface()
    cells = np.insert(mesh.faces, 0, 3, axis=1).ravel()
    names = ["radius_ratio", "min_angle", "max_angle", "aspect_ratio", "area"]
    theirs = pyvista.PolyData(mesh.vertices, cells).cell_quality(names)
    ours = quality(*mesh)
    good = ours.radius_ratio > 1e-4  # theirs loses digits below
    assert good.mean() > 0.9
    np.testing.assert_allclose(1 / ours.radius_ratio[good], theirs["radius_ratio"][good], rtol=1e-6)
    for name in names[1:]:
        np.testing.assert_allclose(getattr(ours, name)[good], theirs[name][good], rtol=1e-5)


def test_trimesh_agrees():
    trimesh = pytest.importorskip("trimesh")
    mesh = isosurface()
    theirs = trimesh.Trimesh(*mesh, process=False)
    ours = quality(*mesh)
    np.testing.assert_allclose(ours.area, theirs.area_faces, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(ours.min_angle, np.degrees(theirs.face_angles.min(1)), atol=1e-5)
    faces_at_vertex = ours.valence - ours.is_on_boundary  # is what trimesh means by degree
    assert faces_at_vertex.tolist() == theirs.vertex_degree.tolist()
    flat = ours.radius_ratio < 1e-6  # trimesh has no normals of these
    angle_of = {
        tuple(edge): angle
        for edge, angle, faces in zip(
            theirs.face_adjacency_edges.tolist(),
            np.degrees(theirs.face_adjacency_angles),
            theirs.face_adjacency,
            strict=True,
        )
        if not flat[faces].any()
    }
    assert len(angle_of) > 0.9 * len(ours.dihedral_angle)
    for edge, angle in zip(ours.edges.tolist(), ours.dihedral_angle, strict=False):
        assert angle == pytest.approx(angle_of.get(tuple(edge), angle), abs=1e-4)


@needs_data
@pytest.mark.parametrize(
    ("name", "n_zero_area", "n_boundary_edges", "n_non_manifold"),
    [("dragon_vrip_full", 108, 4270, 0), ("windbuildings", 228, 0, 0), ("fly_AEDES", 0, 0, 329)],
)
def test_scans_and_buildings(name, n_zero_area, n_boundary_edges, n_non_manifold):
    mesh = io.read_mesh(data_dir() / "meshes" / f"{name}.ply")
    report = quality(mesh.vertices, mesh.faces)
    assert len(report.zero_area_faces) == n_zero_area
    assert report.n_edges - len(report.dihedral_angle) == n_boundary_edges + n_non_manifold
    assert not np.isnan(list(report.as_dict().values())).any()
