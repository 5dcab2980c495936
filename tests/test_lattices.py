"""Lattices as data: they fill the cube, neighbours match, and the tables follow from them."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

import naive
from tetsimplify import OptionError
from tetsimplify.lattices import LATTICES, Lattice, lattice_tables

CORNERS = np.array([(c >> 2 & 1, c >> 1 & 1, c & 1) for c in range(8)])
SIDES = [(axis, high) for axis in range(3) for high in range(2)]

every_lattice = pytest.mark.parametrize("lattice", LATTICES.values(), ids=lambda found: found.name)


def faces_of_tetrahedra(lattice: Lattice) -> list[frozenset[int]]:
    return [frozenset(f) for t in lattice.tetrahedra for f in combinations(t, 3)]


def in_side(corners: frozenset[int], axis: int, high: int) -> bool:
    return all(CORNERS[corner][axis] == high for corner in corners)


def slot_corners(name: str, row: np.ndarray) -> tuple[int, int]:
    """The two corners of the cube, or one twice, that a triangle corner of the tables stands on."""
    anchor, slot = row
    low, high = lattice_tables(name).slot_ends[slot]
    return int(anchor | low), int(anchor | high)


def as_colouring(*inside: int) -> int:
    return sum(1 << corner for corner in inside)


# ---------------------------------------------------------------------------- the tetrahedra


@every_lattice
def test_names_are_keys_and_all_is_described(lattice: Lattice):
    assert LATTICES[lattice.name] is lattice
    assert lattice.description


@every_lattice
def test_tetrahedra_fill_the_cube(lattice: Lattice):
    volumes = [
        abs(np.linalg.det(CORNERS[list(t[1:])] - CORNERS[t[0]])) / 6 for t in lattice.tetrahedra
    ]
    assert min(volumes) > 0
    assert sum(volumes) == pytest.approx(1)


@every_lattice
def test_every_face_is_shared_by_two_tetrahedra_or_lies_in_a_side(lattice: Lattice):
    found = faces_of_tetrahedra(lattice)
    for face in set(found):
        on_sides = sum(in_side(face, axis, high) for axis, high in SIDES)
        assert found.count(face) == 2 - on_sides


@every_lattice
@pytest.mark.parametrize("axis", range(3))
def test_opposite_sides_match_when_cubes_are_stacked(lattice: Lattice, axis: int):
    step = 4 >> axis
    found = set(faces_of_tetrahedra(lattice))
    low = {face for face in found if in_side(face, axis, 0)}
    high = {face for face in found if in_side(face, axis, 1)}
    assert {frozenset(corner | step for corner in face) for face in low} == high


def test_kuhn_tetrahedra_run_around_the_main_diagonal():
    tetrahedra = LATTICES["kuhn"].tetrahedra
    assert len(tetrahedra) == 6
    assert all(t[0] == 0 and t[3] == 7 for t in tetrahedra)
    assert all(a & b == a for t in tetrahedra for a, b in pairwise(t))


# ---------------------------------------------------------------------------- the tables


@every_lattice
def test_slots_are_all_edges_once_and_the_lattice_point(lattice: Lattice):
    tables = lattice_tables(lattice.name)
    ends = [tuple(row) for row in tables.slot_ends.tolist()]
    assert ends[0] == (0, 0)
    assert len(set(ends)) == len(ends)
    assert all(a & b == 0 for a, b in ends), "a slot is relative to the lowest corner of its box"
    edges = {tuple(sorted(e)) for t in lattice.tetrahedra for e in combinations(t, 2)}
    assert {(a & ~(a & b), b & ~(a & b)) for a, b in edges} == set(ends[1:])


def test_kuhn_has_seven_edges_a_cube():
    assert len(lattice_tables("kuhn").slot_ends) == 1 + 7


@every_lattice
@pytest.mark.parametrize("colouring", range(256))
def test_triangles_stand_on_edges_from_inside_to_outside(lattice: Lattice, colouring: int):
    tables = lattice_tables(lattice.name)
    expected = 0
    for tetrahedron in lattice.tetrahedra:
        n_inside = sum(colouring >> corner & 1 for corner in tetrahedron)
        expected += {0: 0, 1: 1, 2: 2, 3: 1, 4: 0}[n_inside]
    triangles = tables.triangles[tables.first[colouring] : tables.first[colouring + 1]]
    assert len(triangles) == expected
    for row in triangles.reshape(-1, 2):
        a, b = slot_corners(lattice.name, row)
        assert (colouring >> a & 1) != (colouring >> b & 1)


@every_lattice
@pytest.mark.parametrize("colouring", range(256))
def test_surface_and_caps_of_one_cube_are_closed(lattice: Lattice, colouring: int):
    tables = lattice_tables(lattice.name)
    pieces = [tables.triangles[tables.first[colouring] : tables.first[colouring + 1]]]
    for first in tables.cap_first:
        pieces.append(tables.cap_triangles[first[colouring] : first[colouring + 1]])
    corners = [slot_corners(lattice.name, row) for row in np.concatenate(pieces).reshape(-1, 2)]
    number = {corner: vi for vi, corner in enumerate(sorted(set(corners)))}
    faces = np.array([number[corner] for corner in corners]).reshape(-1, 3)
    found = naive.summary(faces)
    assert found.is_sound
    assert found.is_closed
    assert (len(faces) == 0) == (colouring == 0)
    # where it is inside, and nowhere else, the cap covers a side
    for (axis, high), piece in zip(SIDES, pieces[1:], strict=True):
        ends = [slot_corners(lattice.name, row) for row in piece.reshape(-1, 2)]
        assert all(in_side(frozenset(end), axis, high) for end in ends)
        inside = {corner for corner in range(8) if colouring >> corner & 1}
        inside &= {corner for corner in range(8) if CORNERS[corner][axis] == high}
        assert inside == {a for a, b in ends if a == b}


@every_lattice
def test_no_triangle_where_nothing_crosses(lattice: Lattice):
    tables = lattice_tables(lattice.name)
    assert tables.first[0] == tables.first[1] == 0
    assert tables.first[255] == tables.first[256] == len(tables.triangles)


@every_lattice
def test_full_cube_has_caps_over_all_six_sides(lattice: Lattice):
    tables = lattice_tables(lattice.name)
    full = as_colouring(*range(8))
    per_side = tables.cap_first[:, full + 1] - tables.cap_first[:, full]
    assert per_side.tolist() == [2] * 6


@every_lattice
def test_complement_has_the_same_triangles_turned_over(lattice: Lattice):
    tables = lattice_tables(lattice.name)

    def turned(colouring: int, turn: int) -> set[tuple]:
        rows = tables.triangles[tables.first[colouring] : tables.first[colouring + 1]]
        faces = []
        for triangle in rows.tolist():
            corners = [tuple(corner) for corner in triangle[::turn]]
            start = corners.index(min(corners))
            faces.append(tuple(corners[start:] + corners[:start]))
        return set(faces)

    for colouring in range(256):
        assert turned(colouring, 1) == turned(255 - colouring, -1)


@every_lattice
def test_tables_are_made_once(lattice: Lattice):
    assert lattice_tables(lattice.name) is lattice_tables(lattice.name)


@pytest.mark.parametrize("name", ["cubes", "", None, 6, ["kuhn"]])
def test_unknown_lattice(name: object):
    with pytest.raises(OptionError, match=r"lattice must be one of .*kuhn.*, got"):
        lattice_tables(name)
