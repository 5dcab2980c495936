r"""Bounding volumes: a hierarchy of boxes over triangles, eight boxes in a group.

Faces are put in the order of a Hilbert curve through their centres, in which those that follow
one another are near each other, and then packed from left to right into a heap of eight
children a node, without pointers::

                            0                        node 0 is the root
              /       /          \       \
            1       2      ...      7       8        parent of node i: (i - 1) // 8
          / | \   / | \                              children of i: 8 i + 1 ... 8 i + 8
         9 .. 16 17 .. 24 ...

The last ``n_faces`` nodes are the faces: node ``n_groups + s`` is the face in *slot* s. The
nodes before them have children, and these are a *group*: their boxes stand side by side in
``boxes[i]``, so that one pass over eight numbers tests all of them. Places that have no node
have a box that nothing meets.

Boxes may be larger than what is in them, never smaller. Who moves a vertex calls `enlarge` for
the faces around it, and all queries stay right.

References
----------
I. Kamel and C. Faloutsos. On packing R-trees. Proc. CIKM, 1993, 490-499,
doi:10.1145/170088.170403.
J. Skilling. Programming the Hilbert curve. AIP Conf. Proc. 707, 2004, 381-387,
doi:10.1063/1.1751381.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.jit import kernel, part

WIDTH = 8  # children of a node
STACK_SIZE = 128  # more than 7 nodes for each of the 11 levels of 2**31 faces

BITS = 21  # of each coordinate along the Hilbert curve
CELLS = 2**BITS - 1
BLOCK = 1024  # cells whose places on the curve are found together
DIGIT = 8  # bits of a place that one pass of the sort looks at
DIGIT_MASK = 2**DIGIT - 1


class Tree(NamedTuple):
    """A hierarchy of boxes over the faces of a mesh."""

    boxes: np.ndarray  # float64 (n_groups, 6, 8): low x, y, z and high x, y, z of the children
    face: np.ndarray  # int32 (n_faces,): the face in each slot
    slot: np.ndarray  # int32 (n_faces,): the slot of each face


@kernel
def build(vertices, faces):
    """Build the hierarchy over all faces.

    Parameters
    ----------
    vertices : float64 (n, 3)
        Finite.
    faces : int32 (m, 3)
        Degenerate and equal ones have boxes like others. There may be none.

    Returns
    -------
    Tree
    """
    n_faces = len(faces)
    n_groups = max(1, (n_faces + WIDTH - 3) // (WIDTH - 1))
    face = along_curve(vertices, faces)
    # Nodes are numbered level by level, and the faces may stand on two levels: those on the
    # deeper one come first along the curve, but have the last numbers.
    deepest = 0
    while WIDTH * deepest + 1 < n_groups + n_faces:
        deepest = WIDTH * deepest + 1
    n_shallow = max(0, deepest - n_groups)
    face = np.concatenate((face[n_faces - n_shallow :], face[: n_faces - n_shallow]))

    slot = np.empty(n_faces, np.int32)
    boxes = np.empty((n_groups, 6, WIDTH))
    boxes[:, :3] = np.inf
    boxes[:, 3:] = -np.inf
    for node in range(n_groups + n_faces - 1, 0, -1):
        group, lane = (node - 1) // WIDTH, (node - 1) % WIDTH
        if node < n_groups:
            for axis in range(3):
                boxes[group, axis, lane] = boxes[node, axis].min()
                boxes[group, 3 + axis, lane] = boxes[node, 3 + axis].max()
        else:
            fi = face[node - n_groups]
            slot[fi] = node - n_groups
            for axis in range(3):
                a = vertices[faces[fi, 0], axis]
                b = vertices[faces[fi, 1], axis]
                c = vertices[faces[fi, 2], axis]
                boxes[group, axis, lane] = min(a, b, c)
                boxes[group, 3 + axis, lane] = max(a, b, c)
    return Tree(boxes, face, slot)


@part
def enlarge(tree, fi, box):
    """Enlarge the boxes from a face up to the root where they do not hold `box` yet.

    Parameters
    ----------
    tree : Tree
        Its boxes are changed in place.
    fi : int
        A face that has changed.
    box : float64 (6,)
        Low x, y, z and high x, y, z of the face as it is now.
    """
    node = len(tree.boxes) + tree.slot[fi]
    while node > 0:
        group, lane = (node - 1) // WIDTH, (node - 1) % WIDTH
        is_inside = True
        for axis in range(3):
            if box[axis] < tree.boxes[group, axis, lane]:
                tree.boxes[group, axis, lane] = box[axis]
                is_inside = False
            if box[3 + axis] > tree.boxes[group, 3 + axis, lane]:
                tree.boxes[group, 3 + axis, lane] = box[3 + axis]
                is_inside = False
        if is_inside:
            break  # and so it is inside the boxes above
        node = group


@part
def overlapping(tree, box, stack, found):
    """Find the faces whose boxes meet a box, touching included.

    Parameters
    ----------
    tree : Tree
    box : float64 (6,)
        Low x, y, z and high x, y, z.
    stack : int32 (STACK_SIZE,)
        Working memory.
    found : int32 (k,)
        Receives the faces, in the order of their slots on each level; as many as it has room for.

    Returns
    -------
    int
        How many there are, which may be more than there is room for.
    """
    n_groups = len(tree.boxes)
    n_found = 0
    n_waiting = 1
    stack[0] = 0
    while n_waiting > 0:
        n_waiting -= 1
        group = stack[n_waiting]
        boxes = tree.boxes[group]
        for lane in range(WIDTH):
            if (
                boxes[0, lane] <= box[3]
                and boxes[1, lane] <= box[4]
                and boxes[2, lane] <= box[5]
                and box[0] <= boxes[3, lane]
                and box[1] <= boxes[4, lane]
                and box[2] <= boxes[5, lane]
            ):
                node = WIDTH * group + 1 + lane
                if node < n_groups:
                    stack[n_waiting] = node
                    n_waiting += 1
                else:
                    if n_found < len(found):
                        found[n_found] = tree.face[node - n_groups]
                    n_found += 1
    return n_found


@kernel
def along_curve(vertices, faces):
    """Order the faces along a Hilbert curve through their centres.

    Returns
    -------
    int32 (n_faces,)
        Faces with the same place on the curve stay in memory order.
    """
    n_faces = len(faces)
    low_x = low_y = low_z = np.inf
    high_x = high_y = high_z = -np.inf
    for fi in range(n_faces):
        for k in range(3):
            v = faces[fi, k]
            x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
            low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
            high_x, high_y, high_z = max(high_x, x), max(high_y, y), max(high_z, z)
    size = max(high_x - low_x, high_y - low_y, high_z - low_z)
    scale = CELLS / size if size > 0.0 else 0.0

    keys = np.empty(n_faces, np.int64)
    cells = np.zeros((3, BLOCK), np.int32)
    for first in range(0, n_faces, BLOCK):
        n = min(BLOCK, n_faces - first)
        for i in range(n):
            a, b, c = faces[first + i, 0], faces[first + i, 1], faces[first + i, 2]
            x = (vertices[a, 0] + vertices[b, 0] + vertices[c, 0]) / 3.0 - low_x
            y = (vertices[a, 1] + vertices[b, 1] + vertices[c, 1]) / 3.0 - low_y
            z = (vertices[a, 2] + vertices[b, 2] + vertices[c, 2]) / 3.0 - low_z
            cells[0, i], cells[1, i], cells[2, i] = x * scale, y * scale, z * scale
        unfold(cells)
        for i in range(n):
            keys[first + i] = gray_rank(cells[0, i], cells[1, i], cells[2, i])
    return order_of(keys)


@part
def unfold(cells):
    """Undo the turns of the Hilbert curve, so that what is left is a Gray code.

    Works bit by bit on a block of cells, as the loop over the cells then takes many at once.
    """
    x, y, z = cells[0], cells[1], cells[2]
    for bit in range(BITS - 1, 0, -1):
        below = np.int32((1 << bit) - 1)
        one, shift = np.int32(1), np.int32(bit)
        for i in range(BLOCK):
            xi, yi, zi = x[i], y[i], z[i]
            xi ^= below & -(xi >> shift & one)
            is_set = -(yi >> shift & one)  # all bits or none
            swap = (xi ^ yi) & below & ~is_set
            xi ^= swap | below & is_set
            yi ^= swap
            is_set = -(zi >> shift & one)
            swap = (xi ^ zi) & below & ~is_set
            xi ^= swap | below & is_set
            zi ^= swap
            x[i], y[i], z[i] = xi, yi, zi


@part
def gray_rank(x, y, z):
    """Rank of three coordinates, interleaved bit by bit, in the Gray code."""
    x, y, z = np.int64(x), np.int64(y), np.int64(z)
    y ^= x
    z ^= y
    parity = z >> 1
    for shift in (1, 2, 4, 8, 16):
        parity ^= parity >> shift
    return spread(x ^ parity) << 2 | spread(y ^ parity) << 1 | spread(z ^ parity)


@part
def spread(x):
    """Put two zeros between the bits of a number of up to 21 bits."""
    x = (x | x << 32) & 0x1F00000000FFFF
    x = (x | x << 16) & 0x1F0000FF0000FF
    x = (x | x << 8) & 0x100F00F00F00F00F
    x = (x | x << 4) & 0x10C30C30C30C30C3
    return (x | x << 2) & 0x1249249249249249


@kernel
def order_of(keys):
    """Indices that sort keys of 3 BITS bits, equal ones in memory order: a radix sort."""
    n = len(keys)
    keys, sorted_keys = keys.copy(), np.empty_like(keys)
    order, sorted_order = np.arange(n).astype(np.int32), np.empty(n, np.int32)
    place = np.empty(1 << DIGIT, np.int64)
    for shift in range(0, 3 * BITS, DIGIT):
        place[:] = 0
        for i in range(n):
            place[keys[i] >> shift & DIGIT_MASK] += 1
        n_below = 0
        for digit in range(1 << DIGIT):
            n_below, place[digit] = n_below + place[digit], n_below
        for i in range(n):
            digit = keys[i] >> shift & DIGIT_MASK
            sorted_keys[place[digit]] = keys[i]
            sorted_order[place[digit]] = order[i]
            place[digit] += 1
        keys, sorted_keys = sorted_keys, keys
        order, sorted_order = sorted_order, order
    return order
