"""Marching tetrahedra, plane by plane (Doi and Koide 1991).

The volume is read one plane of samples at a time. `scan_plane` numbers the surface vertices
on the lattice edges that are anchored in a plane and lists the active cubes above it;
`emit_triangles` then looks the numbers up. A vertex is known by its lattice edge, never by
its coordinates.

    plane z + 1   o-------o        numbered when plane z + 1 is scanned
                 /   cube /        listed when plane z is scanned
    plane z     o-------o          numbered when plane z is scanned
"""

import numpy as np

from tetsimplify.kernels.jit import kernel, part

# How near to a sample a vertex may come, as a part of the lattice edge: where a sample equals
# the level, edges keep a length and faces an area.
CLEARANCE = 1e-4


@kernel
def scan_plane(
    low, high, plane, n_planes, closed, tables, start, slot_vertex, edges, cubes, colours
):
    """Number the vertices anchored in a plane and list the active cubes above it.

    Parameters
    ----------
    low, high : bool (n1, n2)
        Which samples of the plane and of the next one are inside. After the last plane
        comes the last plane again.
    plane, n_planes : int
        Which plane this is.
    closed : bool
        Number the inside lattice points on the sides of the volume too.
    tables : Tables
        The lattice.
    start : int
        The first vertex number.
    slot_vertex : int32 (n1 * n2 * n_slots,), out
        Vertex number of each slot that carries one.
    edges : int32 (n1 * n2 * n_slots,), out
        Slots numbered, in order.
    cubes : int32 (n1 * n2,), out
        Anchors of active cubes.
    colours : uint8 (n1 * n2,), out
        Their colourings.

    Returns
    -------
    n_numbered, n_cubes : int
    """
    n1, n2 = low.shape
    n_slots = len(tables.slot_ends)
    n_numbered = 0
    n_cubes = 0
    is_last = plane == n_planes - 1
    for y in range(n1):
        y1 = min(y + 1, n1 - 1)
        colour = _column(low, high, y, y1, 0)
        for x in range(n2):
            # corners 1, 3, 5, 7 of one cube are corners 0, 2, 4, 6 of the next
            x1 = min(x + 1, n2 - 1)
            colour = (colour & 0b10101010) >> 1 | _column(low, high, y, y1, x1)
            if colour == 0:
                continue
            if colour == 255 and not (closed and _near_side(plane, y, x, n_planes, n1, n2, 2)):
                continue
            anchor = y * n2 + x
            is_cube = not is_last and y1 > y and x1 > x
            if is_cube:
                cubes[n_cubes] = anchor
                colours[n_cubes] = colour
                n_cubes += 1
            for slot in range(n_slots):
                a, b = tables.slot_ends[slot]
                if not is_cube:
                    span = a | b
                    if (span & 4 and is_last) or (span & 2 and y1 == y) or (span & 1 and x1 == x):
                        continue
                if slot == 0:
                    on_side = _near_side(plane, y, x, n_planes, n1, n2, 1)
                    is_vertex = closed and on_side and colour & 1 != 0
                else:
                    is_vertex = (colour >> a ^ colour >> b) & 1 != 0
                if is_vertex:
                    slot_vertex[anchor * n_slots + slot] = start + n_numbered
                    edges[n_numbered] = anchor * n_slots + slot
                    n_numbered += 1
    return n_numbered, n_cubes


@part
def _column(low, high, y, y1, x):
    """Colours of the corners 1, 3, 5, 7 of a cube."""
    near, far = np.int64(low[y, x]), np.int64(low[y1, x])
    near_above, far_above = np.int64(high[y, x]), np.int64(high[y1, x])
    return near << 1 | far << 3 | near_above << 5 | far_above << 7


@part
def _near_side(z, y, x, n0, n1, n2, last):
    """Whether an index is the first one of an axis or among the `last` ones."""
    return z == 0 or z >= n0 - last or y == 0 or y >= n1 - last or x == 0 or x >= n2 - last


@kernel
def place_vertices(low, high, level, plane, spacing, origin, tables, edges, vertices):
    """Interpolate the vertices on the numbered lattice edges of a plane linearly.

    Parameters
    ----------
    low, high : float64 (n1, n2)
        Samples of the plane and of the next one.
    vertices : float64 (n_numbered, 3), out
    """
    n2 = low.shape[1]
    n_slots = len(tables.slot_ends)
    for i in range(edges.size):
        anchor, slot = divmod(edges[i], n_slots)
        y, x = divmod(anchor, n2)
        a, b = tables.slot_ends[slot]
        value_a = _sample(low, high, y, x, a)
        value_b = _sample(low, high, y, x, b)
        t = 0.0
        if slot > 0:
            # halves, so that the difference of two large numbers stays finite; that of two
            # numbers next to zero may vanish
            rise = 0.5 * value_b - 0.5 * value_a
            t = (0.5 * level - 0.5 * value_a) / rise if rise != 0.0 else 0.5
            t = min(max(t, CLEARANCE), 1.0 - CLEARANCE)
        for axis, index, bit in ((0, plane, 4), (1, y, 2), (2, x, 1)):
            from_a = 1.0 if a & bit else 0.0
            from_b = 1.0 if b & bit else 0.0
            position = index + from_a + t * (from_b - from_a)
            vertices[i, axis] = origin[axis] + spacing[axis] * position


@part
def _sample(low, high, y, x, corner):
    row = y + (corner >> 1 & 1)
    column = x + (corner & 1)
    return high[row, column] if corner & 4 else low[row, column]


@kernel
def count_triangles(colours, first):
    """Number of triangles in cubes of the colourings given."""
    n = 0
    for colour in colours:
        n += first[colour + 1] - first[colour]
    return n


@kernel
def emit_triangles(cubes, colours, n2, first, triangles, slot_low, slot_high, n_slots, faces):
    """Write the triangles of cubes as vertex numbers.

    Parameters
    ----------
    cubes, colours : anchors and colourings
    first, triangles : the table of the lattice, or of the caps of one side
    slot_low, slot_high : vertex numbers of the slots of the plane and of the next one
    faces : int32 (count_triangles(colours, first), 3), out
    """
    n = 0
    for i in range(cubes.size):
        for t in range(first[colours[i]], first[colours[i] + 1]):
            for k in range(3):
                corner, slot = triangles[t, k]
                anchor = cubes[i] + (n2 if corner & 2 else 0) + (corner & 1)
                plane = slot_high if corner & 4 else slot_low
                faces[n, k] = plane[anchor * n_slots + slot]
            n += 1
