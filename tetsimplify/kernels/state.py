"""What the contraction kernels work on: the surface, the rules and the scratch space.

Arrays are bundled in few, because every array that a kernel is given has to be compiled in.
"""

from typing import NamedTuple

import numpy as np

# States of a face. A sweep passes over settled faces, and over the faces that it has touched
# itself: these carry its own colour and are its freeze; the next sweep has the other colour.
# Where costs are kept, faces whose costs are up to date are RANKED; of those with the state
# MOVED_... + k only the two edges at the k-th corner are to be ranked anew.
SETTLED, BLOCKED, STALE_EVEN, STALE_ODD, RANKED, MOVED_EVEN, MOVED_ODD = 0, 1, 2, 3, 4, 5, 8

# What becomes of an edge that is to be contracted. NESTED: the link condition blocks it. ENOUGH:
# there would be fewer faces than asked for. TOO_DEAR: it costs more than the sweep allows. OUTSIDE:
# a face at one of its ends is in another block.
CONTRACTIBLE, OBSTRUCTED, REMOVAL_LIMIT, LOCKED, NESTED, ENOUGH, TOO_DEAR = 0, 1, 2, 3, 4, 5, 6
ERROR_BOUND, FOLDOVER, NORMAL_DEVIATION, SHAPE, INTERSECTION, OUTSIDE = 7, 8, 9, 10, 11, 12
# What is told of an edge that is left. One that could be contracted is left when there were few
# enough faces, one that the link condition blocks when those are skipped.
REASONS = (
    *("target_faces", "obstructed", "removal_limit", "locked", "skipped", "target_faces"),
    *("target_faces", "error_bound", "foldover", "normal_deviation", "shape", "intersection"),
)

# What to do with an edge that the link condition blocks.
CONTRACT, SKIP, VIOLATE = 0, 1, 2

# How to tell the outer triangles of a nested edge, where not by region growing.
PATH, DISTANCE = 0, 1


class Surface(NamedTuple):
    """The mesh while it is being contracted: a corner table and what goes with it."""

    vertices: np.ndarray  # float64 (n, 3 or more): positions first, see quadrics.py
    corner_vertex: np.ndarray  # int32 (3 m,): vertex of each corner, DEAD of a dead face
    next_corner: np.ndarray  # int32 (3 m,): circular lists of the corners of each vertex
    face_state: np.ndarray  # uint8 (m,)
    verdict: np.ndarray  # uint8 (3 m,): outcome for the edge from each corner, when last tried
    vertex_block: np.ndarray  # int32 (n,): block that has all faces of the vertex, or SHARED
    merged_into: np.ndarray  # int32 (n,): vertex that this one was merged into, -1 when removed
    loop: np.ndarray  # int32 (n,): boundary loop of the vertex, -1 inside
    loop_size: np.ndarray  # int32 (n_loops,): edges of each boundary loop
    loop_home: np.ndarray  # int32 (n_loops,): block that has all faces at it, or SHARED
    locked: np.ndarray  # uint8 (n,): 1 where the vertex may neither move nor vanish, 2 where its
    # edges may not be contracted either
    merges: np.ndarray  # float64 (n, 2): vertices merged, in order, each with its PLACE; no rows
    # where nobody asks for them


class Rules(NamedTuple):
    """The policies of a run."""

    max_length2: float  # edges shorter than the root of this are contracted
    by_length: bool  # where costs are kept: they are squared lengths, not quadric errors
    is_bounded: bool  # whether there are bounds on the quadric error
    blocked: int  # CONTRACT, SKIP or VIOLATE
    removal_limit2: float  # how far from the edge vertices may be removed, squared
    removal_edges2: float  # the same in lengths of the edge; the larger one counts
    cos_foldover: float  # smallest cosine between the normals of a face before and after
    cos_deviation: float  # the same for the normals of the faces given
    shape: float  # triangles worse than this, and than those around were, make an edge dearer
    optimum: bool  # try where the quadric is least first
    places: np.ndarray  # float64 (k,): placements to try, as parameters along the edge
    max_steps: int  # steps of region growing after which `removal_limit` is the answer


class Scratch(NamedTuple):
    """Working memory. Virtual vertices, which cone the boundary loops, follow the real ones.

    Arrays are as long as they could ever need to be; what is not touched costs nothing.
    """

    tally: np.ndarray  # int64: counters, below
    mark: np.ndarray  # int32 (n + n_loops,): stamps of vertices
    face_mark: np.ndarray  # int32 (m,): stamps of faces
    nodes: np.ndarray  # int32 (3, n + n_loops): what is known of vertices for a while, below
    lists: np.ndarray  # int32 (N_LISTS, m + 2): lists, below
    ring: np.ndarray  # int32 (2, 2 m + 4): the vertices around the edge in order, see link.py
    point: np.ndarray  # float64: middle of the edge, then the new vertex; and more, below
    lanes: np.ndarray  # float64 (N_ROWS * WIDTH,): rows of what is computed side by side


# Places in `Scratch.tally`: what has been done, and what is at hand.
N_SIMPLE, N_NESTED, N_LENS_VERTICES, N_LENS_FACES, N_LIVE = 0, 1, 2, 3, 4
N_DONE = 5  # so many of the counters come first
STAMP, N_STEPS, N_DEFERRED = 5, 6, 7  # last stamp given, steps of region growing, faces put off
LENS_STAMP, N_LENSES, CONE = 8, 9, 10  # of the lenses at hand, see lens.py
STAMP_LIMIT = 11  # stamps are int32; they start anew beyond this
BLOCK, N_SPARE = 12, 13  # the block at hand, see blocks.py; faces that may still go
RING_V, RING_ALL, N_GAPS = 14, 15, 16  # steps of the ring, see link.py
TALLY_SIZE = 17

# In `Scratch.point`: parameter of the new vertex along its edge; quadric error at it; factor for
# the shapes of the triangles there; cost of it all; how far vertices may be removed, squared;
# where costs are kept, what an edge may cost in this sweep, and with the factor for the shapes.
PLACE, ERROR, FACTOR, COST, REMOVAL2, MAX_COST, MAX_PRICE = 3, 4, 5, 6, 7, 8, 9
POINT_SIZE = 10

# So many edges, or faces around an edge, are computed side by side, in the wide registers of the
# processor: a multiple of what they hold. Rows of `Scratch.lanes` are WIDTH apart.
LANES, WIDTH, N_ROWS = 8, 16, 16
AT_ONCE = 2**11  # faces whose edges are ranked before the first of them is contracted

# Rows of `Scratch.nodes`.
SLOT = 0  # sparse set: place of a vertex in some list
FOLLOWER = 1  # next vertex in a linked list
ENTRY = 2  # a corner of the vertex

# Rows of `Scratch.lists`.
STAR = 0  # corners of the two ends that survive the contraction, first those of v
DOOMED = 2  # faces that the contraction removes
LINK_V, LINK_U = 3, 4  # links of the two ends in order
FAN_V, FAN_U = 5, 6  # corners of the two ends in order
CUT_V, CUT_U = 7, 8  # places of the common neighbours in the links
FIRST, LAST, CURSOR = 9, 10, 11  # inner vertices of each lens: list, and the last one visited
N_VERTICES, N_FACES = 12, 13  # numbers of inner vertices and faces of each lens
STATUS = 14  # of each lens
VOTES, LENGTHS_A, LENGTHS_B = 15, 16, 17  # of the common neighbours, see outer.py
DEFERRED = 18  # faces with a blocked edge, put off to the end of the sweep
WAITING = 19  # faces that a sweep has to look at
PENDING = 20  # edges that are to be ranked: where their costs are, then both their vertices
N_LISTS = 23
