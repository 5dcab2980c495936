"""Tetrahedral lattices as data: how the cubes of a volume are cut into tetrahedra.

The samples are the corners of cubes. Some lattices also have a point in the middle of every
cube. The points that the tetrahedra of one cube may join are numbered like this::

            2 ------- 3
           /|        /|         corner = 4 d0 + 2 d1 + d2, by the offsets along the axes:
          6 ------- 7 |         axis 0: 0 -> 4,  axis 1: 0 -> 2,  axis 2: 0 -> 1
          | 0 ------|-1
          |/        |/          8: the centre of the cube
          4 ------- 5           9, 10, 11: the centres of the next cubes along axes 0, 1, 2

All else follows from the tetrahedra: which edges the lattice has, and which triangles separate
the inside from the outside for every way to colour the points; see :mod:`tetsimplify.tables`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

from tetsimplify.errors import OptionError

Tetrahedron = tuple[int, int, int, int]

CENTRE = 8
NEXT_CENTRES = (9, 10, 11)


@dataclass(frozen=True)
class Piece:
    """Some tetrahedra, and which cubes have them.

    A side of the volume is ``2 * axis + high``: the low and the high side of axes 0, 1, 2.
    """

    tetrahedra: tuple[Tetrahedron, ...]
    parity: int | None = None
    """Of the sum of the indices of the cubes; None for all cubes."""
    at_side: int | None = None
    """The side of the volume that the cubes lie at; None for all cubes."""
    away_from_side: int | None = None
    """The side of the volume that the cubes do not lie at."""


@dataclass(frozen=True)
class Lattice:
    """A way to cut a volume into tetrahedra that match, and what it supports."""

    name: str
    description: str
    pieces: tuple[Piece, ...]
    has_centres: bool = False
    """Whether there are points in the middle of the cubes."""

    @property
    def is_alike(self) -> bool:
        """Whether all cubes are cut alike, so that a part of a volume is cut as the whole is."""
        return all(piece.parity is None for piece in self.pieces)


def _kuhn() -> tuple[Piece, ...]:
    """The six shortest paths from corner 0 to corner 7 along the edges of the cube."""
    return (Piece(tuple((0, a, a + b, 7) for a, b, _ in permutations((1, 2, 4)))),)


def _five() -> tuple[Piece, ...]:
    """A regular tetrahedron in the middle, and the four corners that it leaves.

    The diagonals of a side must be those of the next cube, so every other cube is the mirror
    image: corner c becomes c ^ 1.
    """
    even = ((0, 3, 5, 6), (0, 1, 3, 5), (0, 2, 3, 6), (0, 4, 5, 6), (3, 5, 6, 7))
    odd = tuple((a ^ 1, b ^ 1, c ^ 1, d ^ 1) for a, b, c, d in even)
    return Piece(even, parity=0), Piece(odd, parity=1)


def _body_centred() -> tuple[Piece, ...]:
    """Four tetrahedra around every line between the centres of two cubes that share a side.

    On the sides of the volume, where there is no next cube, pyramids from the centre are left;
    they are cut along the diagonal of their square that runs as those of `kuhn`.
    """
    pieces = []
    for axis in range(3):
        first, second = (4 >> other for other in range(3) if other != axis)
        for side, corner in ((2 * axis, 0), (2 * axis + 1, 4 >> axis)):
            a, b, c, d = (corner, corner | first, corner | first | second, corner | second)
            pyramid = ((CENTRE, a, b, c), (CENTRE, a, d, c))
            pieces.append(Piece(pyramid, at_side=side))
        rim = ((a, b), (b, c), (c, d), (d, a))  # of the high side
        across = tuple((CENTRE, NEXT_CENTRES[axis], p, q) for p, q in rim)
        pieces.append(Piece(across, away_from_side=2 * axis + 1))
    return tuple(pieces)


LATTICES = {
    lattice.name: lattice
    for lattice in (
        Lattice(
            "kuhn",
            "six tetrahedra a cube around its main diagonal (Kuhn 1960, Freudenthal 1942)",
            _kuhn(),
        ),
        Lattice(
            "five",
            "five tetrahedra a cube, every other cube mirrored (after Doi and Koide 1991)",
            _five(),
        ),
        Lattice(
            "bcc",
            "twelve tetrahedra a cube between centres and edges (Chan and Purisima 1998)",
            _body_centred(),
            has_centres=True,
        ),
    )
}


def lattice_named(name: str) -> Lattice:
    """A lattice by its name.

    Raises
    ------
    OptionError
        When there is no such lattice.
    """
    if not isinstance(name, str) or name not in LATTICES:
        raise OptionError(f"lattice must be one of {', '.join(LATTICES)}, got {name!r}")
    return LATTICES[name]
