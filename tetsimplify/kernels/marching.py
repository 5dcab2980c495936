"""Marching tetrahedra on slabs of a volume (Doi and Koide 1991).

A *site* is the index of a sample. It stands for the sample, for the cube that begins there, and
for the surface vertices on the lattice edges that are anchored there; see
:mod:`tetsimplify.tables`. A vertex is known by its lattice edge, never by its coordinates.

Vertices are numbered in the order of their sites, so a slab can number its own when it knows how
many there are in the slabs before. The triangles of its last cubes need those of one plane more:
it numbers these again, as the next slab does::

    plane z1    o-------o-------o      numbered, to be looked up
               /  cube /       /
    plane      o-------o-------o       numbered and placed; the triangles of the cubes
    ...                                written when the plane above is numbered
    plane z0   o-------o-------o

Which samples are inside is kept as bits, 32 samples of a row a word, so that whole words without
surface are passed over. The last bit of a row is repeated to the end of its last word.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.bits import lowest_bit, n_bits
from tetsimplify.kernels.jit import cold_part, kernel_in_place, part
from tetsimplify.kernels.prefetch import prefetch_row

# How near to a lattice point a vertex may come, as a part of the lattice edge: where a sample
# equals the level, edges keep a length and faces an area.
CLEARANCE = 1e-4

WORD = 32  # bits
ALL = 2**WORD - 1


class Window(NamedTuple):
    """Some planes of a volume, and which of its points are inside."""

    samples: np.ndarray
    """(p, n1, n2) float64 or float32."""
    inside: np.ndarray
    """(p, n1, n_words) uint32: of the samples."""
    centres: np.ndarray
    """(p, n1 - 1, n2 - 1) float64 values in the middle of the cubes; none for their means."""
    inside_centres: np.ndarray
    """(p, n1, n_words) uint32: of the centres of the cubes; none where the lattice has none."""
    first: int
    """The number of the first plane."""
    n_planes: int
    """Planes of the volume."""
    level: float
    above: bool
    """Whether inside is above the level."""


class Output(NamedTuple):
    """Where a slab writes to."""

    vertices: np.ndarray
    """(n, 3) float64."""
    faces: np.ndarray
    """(m, 3) int32."""
    edges: np.ndarray
    """(n,) int64: the site of each vertex times 32, and its slot; none when not asked for."""
    ratios: np.ndarray
    """(n,) float64: where each vertex is on its lattice edge; none when not asked for."""


# ---------------------------------------------------------------------------- colouring


@kernel_in_place
def colour_samples(samples, level, above, row, inside):
    """Set the bits of the samples that are inside; return whether all are finite.

    Short loops of one kind of step each, which the compiler makes vector instructions of: a fifth
    of the time of a single loop.

    Parameters
    ----------
    samples : float64 or float32 (p, n1, n2)
    row : uint8 (n2,)
        Scratch space.
    inside : uint32 (p, n1, n_words), out
    """
    n0, n1, n2 = samples.shape
    n_finite = 0
    for z in range(n0):
        for y in range(n1):
            values = samples[z, y]
            if above:
                for x in range(n2):
                    row[x] = values[x] > level
            else:
                for x in range(n2):
                    row[x] = values[x] < level
            for x in range(n2):
                n_finite += values[x] - values[x] == 0.0
            for k in range(n2 // WORD):
                word = np.uint32(0)
                for i in range(WORD):
                    word |= np.uint32(row[k * WORD + i]) << np.uint32(i)
                inside[z, y, k] = word
            if n2 % WORD:
                word = np.uint32(0)
                for x in range(n2 - n2 % WORD, n2):
                    word |= np.uint32(row[x]) << np.uint32(x % WORD)
                inside[z, y, n2 // WORD] = word
            _repeat_last_bit(inside[z, y], n2)
    return n_finite == samples.size


@part
def _repeat_last_bit(row, n2):
    last = (n2 - 1) % WORD
    if row[-1] >> last & 1:
        row[-1] |= ALL & ~((1 << last) - 1)


@kernel_in_place
def colour_centres(window, z0, z1):
    """Set the bits of the centres that are inside, of the cubes above planes z0 to z1.

    The mean of eight samples is inside where all are, and outside where none is.
    """
    n1 = window.samples.shape[1]
    n_cubes = window.samples.shape[2] - 1
    bits = window.inside_centres
    for z in range(z0 - window.first, z1 - window.first):
        for y in range(n1):
            for k in range(bits.shape[2]):
                bits[z, y, k] = 0
            if z + window.first >= window.n_planes - 1 or y >= n1 - 1:
                continue
            for k in range(bits.shape[2]):
                some, every = _around(window.inside, z, y, z + 1, y + 1, k)
                undecided = ALL if len(window.centres) else some & ~every
                word = every & ~undecided
                while undecided:
                    bit = lowest_bit(undecided)
                    undecided &= undecided - 1
                    x = k * WORD + bit
                    if x < n_cubes:
                        value = _centre(window, z, y, x)
                        is_inside = value > window.level if window.above else value < window.level
                        word |= np.int64(is_inside) << bit
                bits[z, y, k] = word


@part
def _around(bits, z, y, z1, y1, k):
    """Of 32 sites: where some, and where all of the eight samples of the cube are inside."""
    a, b = np.int64(bits[z, y, k]), np.int64(bits[z, y1, k])
    c, d = np.int64(bits[z1, y, k]), np.int64(bits[z1, y1, k])
    some, every = a | b | c | d, a & b & c & d
    some |= _next(bits, z, y, k) | _next(bits, z, y1, k)
    some |= _next(bits, z1, y, k) | _next(bits, z1, y1, k)
    every &= _next(bits, z, y, k) & _next(bits, z, y1, k)
    every &= _next(bits, z1, y, k) & _next(bits, z1, y1, k)
    return some, every


@part
def _next(bits, z, y, k):
    """A word of a row, moved by one sample; after the last one it comes again."""
    word = np.int64(bits[z, y, k])
    following = np.int64(bits[z, y, k + 1]) if k + 1 < bits.shape[2] else word >> (WORD - 1)
    return word >> 1 | (following & 1) << (WORD - 1)


# ---------------------------------------------------------------------------- active sites


@cold_part
def _active_sites(window, tables, z, y, out):
    """List the sites of a row where something may cross, and the colours of their points.

    Returns
    -------
    int
        How many there are; `out` holds their third index and their colours.
    """
    bits = window.inside
    n1, n2 = window.samples.shape[1:]
    z1 = min(z + 1, window.n_planes - 1 - window.first)
    y1 = min(y + 1, n1 - 1)
    has_points = tables.exists[1] & 1  # where lattice points on the sides are vertices too
    on_side = z + window.first == 0 or z1 + window.first == window.n_planes - 1
    on_side = on_side or y == 0 or y1 == n1 - 1
    n_active = 0
    for k in range(bits.shape[2]):
        some, every = _around(bits, z, y, z1, y1, k)
        if len(window.inside_centres):
            centre = window.inside_centres
            of_centres = np.int64(centre[z, y, k])
            some |= of_centres | np.int64(centre[z1, y, k]) | np.int64(centre[z, y1, k])
            some |= _next(centre, z, y, k)
            every &= of_centres & np.int64(centre[z1, y, k]) & np.int64(centre[z, y1, k])
            every &= _next(centre, z, y, k)
        active = some & ~every
        if has_points and every:
            active |= every & (ALL if on_side else _ends_of_row(k, n2))
        a, b = np.int64(bits[z, y, k]), np.int64(bits[z, y1, k])
        c, d = np.int64(bits[z1, y, k]), np.int64(bits[z1, y1, k])
        a1, b1 = _next(bits, z, y, k), _next(bits, z, y1, k)
        c1, d1 = _next(bits, z1, y, k), _next(bits, z1, y1, k)
        while active:
            i = lowest_bit(active)
            active &= active - 1
            x = k * WORD + i
            if x >= n2:
                break
            colour = (a >> i & 1) | (a1 >> i & 1) << 1 | (b >> i & 1) << 2 | (b1 >> i & 1) << 3
            colour |= (c >> i & 1) << 4 | (c1 >> i & 1) << 5
            colour |= (d >> i & 1) << 6 | (d1 >> i & 1) << 7
            if len(window.inside_centres):
                centre = window.inside_centres
                colour |= (np.int64(centre[z, y, k]) >> i & 1) << 8
                colour |= (np.int64(centre[z1, y, k]) >> i & 1) << 9
                colour |= (np.int64(centre[z, y1, k]) >> i & 1) << 10
                colour |= (_next(centre, z, y, k) >> i & 1) << 11
            out[0, n_active] = x
            out[1, n_active] = colour
            n_active += 1
    return n_active


@part
def _ends_of_row(k, n2):
    """The bits of a word that stand for the first, the last but one and the last site."""
    word = 0
    for x in (0, n2 - 2, n2 - 1):
        if x // WORD == k:
            word |= 1 << x % WORD
    return word


@part
def _place_of_row(window, z, y):
    """The place of the inner sites of a row, see :mod:`tetsimplify.tables`."""
    plane = z + window.first
    n1 = window.samples.shape[1]
    place = _bits_of_place(plane, window.n_planes) | _bits_of_place(y, n1) << 3
    return place | (plane + y & 1) << 9


@part
def _place_in_row(row_place, x, n2):
    return (row_place ^ (x & 1) << 9) | _bits_of_place(x, n2) << 6


@part
def _bits_of_place(index, n):
    return np.int64(index == 0) | np.int64(index == n - 2) << 1 | np.int64(index == n - 1) << 2


# ---------------------------------------------------------------------------- a slab


@kernel_in_place
def count_slab(window, tables, z0, z1, active):
    """Count the vertices and the triangles of planes z0 to z1.

    Parameters
    ----------
    window : Window
        With planes z0 to z1 and the next one; one more for a lattice with centres.
    active : int32 (2, n2)
        Scratch space.

    Returns
    -------
    n_vertices, n_triangles : int
    """
    n1, n2 = window.samples.shape[1:]
    n_vertices = 0
    n_triangles = 0
    for z in range(z0 - window.first, z1 - window.first):
        for y in range(n1):
            row_place = _place_of_row(window, z, y)
            for i in range(_active_sites(window, tables, z, y, active)):
                place = _place_in_row(row_place, active[0, i], n2)
                colour = active[1, i]
                n_vertices += n_bits(np.int64(tables.crossing[colour] & tables.exists[place]))
                for k in range(tables.first_part[place], tables.first_part[place + 1]):
                    row = tables.rows[tables.parts[k], colour]
                    n_triangles += row[1] - row[0]
    return n_vertices, n_triangles


@kernel_in_place
def fill_slab(window, tables, z0, z1, start, frame, numbers, active, out):
    """Place the vertices and write the triangles of planes z0 to z1.

    Parameters
    ----------
    window : Window
        With planes z0 to z1 and the next two; one more for a lattice with centres.
    start : int
        The number of the first vertex.
    frame : float64 (2, 3)
        Spacing and origin.
    numbers : int64 (2, n1 * n2)
        Scratch space, for planes with even and odd numbers: the number of the first vertex of
        each site, times 2^32, and the slots that have one.
    active : int32 (2, n2)
        Scratch space.
    out : Output
        As long as was counted; or with room for the vertices of plane z1 too, which are placed
        then.
    """
    n1, n2 = window.samples.shape[1:]
    n_vertices = 0
    n_triangles = 0
    last = min(z1, window.n_planes - 1)
    for plane in range(z0, last + 1):
        z = plane - window.first
        for y in range(n1):
            row_place = _place_of_row(window, z, y)
            later = window.samples[min(z + 2, len(window.samples) - 1), y]
            for i in range(_active_sites(window, tables, z, y, active)):
                x, colour = np.int64(active[0, i]), active[1, i]
                prefetch_row(later, x)  # where the surface goes on, most likely
                place = _place_in_row(row_place, x, n2)
                slots = np.int64(tables.crossing[colour] & tables.exists[place])
                if slots == 0:
                    continue
                numbers[z & 1, y * n2 + x] = (start + n_vertices) << WORD | slots
                if n_vertices < len(out.vertices):
                    _place_vertices(window, tables, z, y, x, slots, n_vertices, frame, out)
                n_vertices += n_bits(slots)
        if plane == z0:
            continue
        low, high = numbers[z + 1 & 1], numbers[z & 1]
        for y in range(n1 - 1):
            row_place = _place_of_row(window, z - 1, y)
            for i in range(_active_sites(window, tables, z - 1, y, active)):
                x, colour = np.int64(active[0, i]), active[1, i]
                place = _place_in_row(row_place, x, n2)
                for k in range(tables.first_part[place], tables.first_part[place + 1]):
                    begin, end = tables.rows[tables.parts[k], colour]
                    for t in range(begin, end):
                        for j in range(3):
                            corner, slot = tables.triangles[t, j]
                            site = y * n2 + x + (n2 if corner & 2 else 0) + (corner & 1)
                            number = high[site] if corner & 4 else low[site]
                            rank = n_bits(number & (1 << slot) - 1)
                            out.faces[n_triangles, j] = (number >> WORD) + rank
                        n_triangles += 1


@part
def _place_vertices(window, tables, z, y, x, slots, first, frame, out):
    """Interpolate the vertices of a site linearly along their lattice edges."""
    n = first
    while slots:
        slot = lowest_bit(slots)
        slots &= slots - 1
        a, b = tables.slot_ends[slot]
        t = 0.0
        if slot > 0:
            value_a = _value(window, z, y, x, a)
            value_b = _value(window, z, y, x, b)
            # halves, so that the difference of two large numbers stays finite; that of two
            # numbers next to zero may vanish
            rise = 0.5 * value_b - 0.5 * value_a
            t = (0.5 * window.level - 0.5 * value_a) / rise if rise != 0.0 else 0.5
            t = min(max(t, CLEARANCE), 1.0 - CLEARANCE)
        for axis, index in ((0, window.first + z), (1, y), (2, x)):
            from_a, from_b = tables.points[a, axis], tables.points[b, axis]
            position = index + from_a + t * (from_b - from_a)
            out.vertices[n, axis] = frame[1, axis] + frame[0, axis] * position
        if len(out.edges):
            n1, n2 = window.samples.shape[1:]
            site = ((window.first + z) * n1 + y) * n2 + x
            out.edges[n] = site * WORD + slot
            out.ratios[n] = t
        n += 1


@part
def _value(window, z, y, x, point):
    """The value at a point of a site."""
    if point < 8:
        return window.samples[z + (point >> 2), y + (point >> 1 & 1), x + (point & 1)]
    return _centre(window, z + (point == 9), y + (point == 10), x + (point == 11))


@part
def _centre(window, z, y, x):
    """The value given for the centre of a cube, or else the mean of its eight samples."""
    if len(window.centres):
        return window.centres[z, y, x]
    v = window.samples
    low = 0.125 * v[z, y, x] + 0.125 * v[z, y, x + 1]
    low += 0.125 * v[z, y + 1, x] + 0.125 * v[z, y + 1, x + 1]
    high = 0.125 * v[z + 1, y, x] + 0.125 * v[z + 1, y, x + 1]
    high += 0.125 * v[z + 1, y + 1, x] + 0.125 * v[z + 1, y + 1, x + 1]
    return low + high
