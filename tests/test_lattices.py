"""Lattices as data: they fill the volume, cubes match, and the tables follow from them."""

from __future__ import annotations

from collections import Counter
from itertools import combinations, pairwise, product
from pathlib import Path

import numpy as np
import pytest

import naive_lattices
from tetsimplify import OptionError
from tetsimplify.lattices import LATTICES, Lattice, lattice_named
from tetsimplify.tables import (
    FIRST,
    LAST,
    LAST_CUBE,
    N_PLACES,
    PARITY,
    SITES,
    Tables,
    lattice_tables,
)

SHAPES = [(2, 2, 2), (2, 3, 4), (4, 2, 3), (3, 3, 5)]
Point = tuple[int, int, int]  # twice the coordinates in the volume

every_lattice = pytest.mark.parametrize("lattice", LATTICES.values(), ids=lambda found: found.name)
every_shape = pytest.mark.parametrize("shape", SHAPES, ids=str)


def bits_of_place(index: int, n: int) -> int:
    return FIRST * (index == 0) + LAST_CUBE * (index == n - 2) + LAST * (index == n - 1)


def place_of(site: tuple[int, ...], shape: tuple[int, ...]) -> int:
    bits = (bits_of_place(site[axis], shape[axis]) << 3 * axis for axis in range(3))
    return sum(bits) + PARITY * (sum(site) % 2)


def point_at(site: tuple[int, ...], point: int) -> Point:
    corner = SITES[point]
    offset = corner >> 2 & 1, corner >> 1 & 1, corner & 1
    z, y, x = (2 * (i + d) + (point >= 8) for i, d in zip(site, offset, strict=True))
    return z, y, x


def tetrahedra(lattice: Lattice, shape: tuple[int, int, int]) -> list[tuple[Point, ...]]:
    """Those of the data, in a volume."""
    found = []
    for cube in naive_lattices.cubes(shape):
        for piece in lattice.pieces:
            sides = [
                (a, h) for a, h in product(range(3), range(2)) if cube[a] == h * (shape[a] - 2)
            ]
            if (
                piece.parity in (None, sum(cube) % 2)
                and (piece.at_side is None or divmod(piece.at_side, 2) in sides)
                and (piece.away_from_side is None or divmod(piece.away_from_side, 2) not in sides)
            ):
                found += [tuple(point_at(cube, p) for p in t) for t in piece.tetrahedra]
    return found


# ---------------------------------------------------------------------------- the tetrahedra


@every_lattice
def test_names_are_keys_and_all_is_described(lattice: Lattice):
    assert LATTICES[lattice.name] is lattice
    assert lattice_named(lattice.name) is lattice
    assert lattice.description


@every_lattice
@every_shape
def test_tetrahedra_are_those_written_down_slowly(lattice: Lattice, shape: Point):
    slow = Counter(frozenset(t) for t in naive_lattices.LATTICES[lattice.name](shape))
    assert Counter(frozenset(t) for t in tetrahedra(lattice, shape)) == slow


@every_lattice
@every_shape
def test_tetrahedra_fill_the_volume(lattice: Lattice, shape: Point):
    found = np.array(tetrahedra(lattice, shape)) / 2
    volumes = np.abs(np.linalg.det(found[:, 1:] - found[:, :1])) / 6
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(np.prod(np.subtract(shape, 1)))


@every_lattice
@every_shape
def test_every_face_is_shared_by_two_tetrahedra_or_lies_in_a_side(lattice: Lattice, shape: Point):
    found = Counter(frozenset(f) for t in tetrahedra(lattice, shape) for f in combinations(t, 3))
    for face, count in found.items():
        points = np.array(list(face))
        in_side = (
            (points == 0).all(axis=0) | (points == 2 * np.array(shape) - 2).all(axis=0)
        ).any()
        assert count == 2 - in_side


def test_kuhn_tetrahedra_run_around_the_main_diagonal():
    (piece,) = LATTICES["kuhn"].pieces
    assert len(piece.tetrahedra) == 6
    assert all(t[0] == 0 and t[3] == 7 for t in piece.tetrahedra)
    assert all(a & b == a for t in piece.tetrahedra for a, b in pairwise(t))


def test_five_tetrahedra_of_two_kinds():
    for piece in LATTICES["five"].pieces:
        found = np.array([[point_at((0, 0, 0), p) for p in t] for t in piece.tetrahedra]) / 2
        volumes = np.abs(np.linalg.det(found[:, 1:] - found[:, :1])) / 6
        np.testing.assert_allclose(sorted(volumes), [1 / 6] * 4 + [1 / 3])


def test_body_centred_tetrahedra_are_alike():
    """Four edges of length sqrt(3) / 2 and two of length 1: all equal, but on the sides."""
    for piece in LATTICES["bcc"].pieces:
        for t in piece.tetrahedra if piece.at_side is None else ():
            points = np.array([point_at((0, 0, 0), p) for p in t]) / 2
            lengths = sorted(float(np.linalg.norm(p - q)) for p, q in combinations(points, 2))
            np.testing.assert_allclose(lengths, [np.sqrt(0.75)] * 4 + [1] * 2)


def row_of(lattice: Lattice) -> str:
    """The row of a lattice in the table of the page on isosurfaces."""
    inner = [p for p in lattice.pieces if p.at_side is None and p.parity in (None, 0)]
    n_tetrahedra = sum(len(piece.tetrahedra) for piece in inner)
    n_edges = int(lattice_tables(lattice.name).exists[0]).bit_count()
    has = ["yes" if answer else "no" for answer in (lattice.is_alike, lattice.has_centres)]
    columns = [f"`{lattice.name}`", n_tetrahedra, n_edges, *has, lattice.description]
    return f"| {' | '.join(map(str, columns))} |"


def test_the_page_says_what_lattices_support():
    page = Path(__file__).parents[1] / "docs" / "isosurface.md"
    assert "\n".join(map(row_of, LATTICES.values())) in page.read_text(encoding="utf-8")


def test_what_lattices_support():
    has = {name: (entry.has_centres, entry.is_alike) for name, entry in LATTICES.items()}
    assert has == {"kuhn": (False, True), "five": (False, False), "bcc": (True, True)}


# ---------------------------------------------------------------------------- the tables


@every_lattice
@every_shape
def test_every_edge_has_one_site_and_slot(lattice: Lattice, shape: Point):
    tables = lattice_tables(lattice.name)
    found = []
    for site in np.ndindex(*shape):
        exists = int(tables.exists[place_of(site, shape)])
        for slot, (a, b) in enumerate(tables.slot_ends.tolist()):
            if exists >> slot & 1:
                found.append(frozenset((point_at(site, a), point_at(site, b))))
    assert len(set(found)) == len(found)
    edges = {frozenset(e) for t in tetrahedra(lattice, shape) for e in combinations(t, 2)}
    assert set(found) == edges


def test_edges_of_each_inner_site():
    per_site = {name: int(lattice_tables(name).exists[0]).bit_count() for name in LATTICES}
    assert per_site == {"kuhn": 7, "five": 6, "bcc": 14}


@every_lattice
@pytest.mark.parametrize("closed", [False, True])
def test_lattice_points_are_vertices_on_the_sides_of_closed_surfaces(
    lattice: Lattice, closed: bool
):
    tables = lattice_tables(lattice.name, closed)
    on_side = np.arange(N_PLACES) & (FIRST | LAST) * (1 | 8 | 64) != 0
    np.testing.assert_array_equal(tables.exists & 1, on_side & closed)


def corners_of(tables: Tables, triangle: np.ndarray) -> list[tuple[Point, Point]]:
    """The ends of the lattice edges that a triangle of the tables stands on."""
    ends = []
    for corner, slot in triangle.tolist():
        site = corner >> 2 & 1, corner >> 1 & 1, corner & 1
        a, b = tables.slot_ends[slot].tolist()
        ends.append((point_at(site, a), point_at(site, b)))
    return ends


@every_lattice
def test_triangles_stand_on_edges_from_inside_to_outside(lattice: Lattice):
    tables = lattice_tables(lattice.name)
    points = {point_at((0, 0, 0), p): p for p in range(12)}
    rng = np.random.default_rng(0)
    for part, piece in enumerate(lattice.pieces):
        n_colourings = tables.crossing.size
        for colouring in rng.permutation(n_colourings)[:300].tolist():
            expected = 0
            for tetrahedron in piece.tetrahedra:
                n_inside = sum(colouring >> point & 1 for point in tetrahedron)
                expected += {0: 0, 1: 1, 2: 2, 3: 1, 4: 0}[n_inside]
            begin, end = tables.rows[part, colouring]
            assert end - begin == expected
            for triangle in tables.triangles[begin:end]:
                for p, q in corners_of(tables, triangle):
                    assert (colouring >> points[p] & 1) != (colouring >> points[q] & 1)


@every_lattice
def test_complement_has_the_same_triangles_turned_over(lattice: Lattice):
    tables = lattice_tables(lattice.name)
    everything = tables.crossing.size - 1

    def turned(part: int, colouring: int, turn: int) -> set[tuple]:
        begin, end = tables.rows[part, colouring]
        faces = []
        for triangle in tables.triangles[begin:end].tolist():
            corners = [tuple(corner) for corner in triangle[::turn]]
            start = corners.index(min(corners))
            faces.append(tuple(corners[start:] + corners[:start]))
        return set(faces)

    for part in range(len(lattice.pieces)):
        for colouring in range(0, everything + 1, 7):
            assert turned(part, colouring, 1) == turned(part, everything - colouring, -1)


@every_lattice
def test_no_triangle_where_nothing_crosses(lattice: Lattice):
    tables = lattice_tables(lattice.name)
    for colouring in (0, tables.crossing.size - 1):
        assert (tables.rows[:, colouring, 0] == tables.rows[:, colouring, 1]).all()


@every_lattice
def test_full_cube_has_caps_over_all_six_sides(lattice: Lattice):
    tables = lattice_tables(lattice.name, closed=True)
    place = (FIRST | LAST_CUBE) * (1 | 8 | 64)
    parts = tables.parts[tables.first_part[place] : tables.first_part[place + 1]]
    counts = tables.rows[parts, -1, 1] - tables.rows[parts, -1, 0]
    assert counts.sum() == 6 * 2


@every_lattice
def test_tables_are_made_once(lattice: Lattice):
    assert lattice_tables(lattice.name) is lattice_tables(lattice.name)


@pytest.mark.parametrize("name", ["cubes", "", None, 6, ["kuhn"]])
def test_unknown_lattice(name: object):
    with pytest.raises(OptionError, match=r"lattice must be one of .*kuhn.*, got"):
        lattice_tables(name)
