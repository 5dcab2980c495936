"""Vertices that a mesh has several times in one place, as on the two sides of a seam."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.cutting import edge_keys
from tetsimplify.report import Simplification

Array = NDArray[Any]
Indices = NDArray[np.int32]
Mask = NDArray[np.bool_]

MIXING = (0.2718281828459045, 0.3141592653589793, 0.1618033988749895)  # of x, y, z to one number
SPREADING = np.uint64(0x9E3779B97F4A7C15)  # odd, so that no two numbers become one
MOST_THROWS = 32  # far more than a hash that tells the places apart needs


class Seam(NamedTuple):
    """Which vertices of a mesh belong together."""

    place: Indices
    """Shape (n,): the same for vertices that are one when the mesh is welded."""
    on_seam: Mask
    """Shape (n,): vertices that are to stay where they are."""


def places(vertices: NDArray[np.float64]) -> Indices:
    """For each vertex one in exactly the same place, the same one for all that are there.

    The vertices are thrown into slots by a hash of their coordinates. The last one in a slot wins
    it; those in its place are found with it, and all others are thrown again.
    """
    x, y, z = vertices.T
    mixed = x * MIXING[0]
    mixed += y * MIXING[1]
    mixed += z * MIXING[2]
    mixed += 0.0  # makes -0.0 equal to 0.0
    keys = mixed.view(np.uint64)
    result = np.arange(len(vertices), dtype=np.int32)
    left = result
    for _ in range(MOST_THROWS):
        keys = keys * SPREADING
        n_bits = len(left).bit_length() + 1
        slots = (keys >> np.uint64(64 - n_bits)).view(np.int64)
        entries = np.arange(len(left), dtype=np.int32)
        winner_of_slot = np.empty(2**n_bits, np.int32)
        winner_of_slot[slots] = entries
        winners = winner_of_slot[slots]
        losers = np.flatnonzero(winners != entries)
        winners = winners[losers]
        same = keys[winners] == keys[losers]
        a, b = left[winners[same]], left[losers[same]]
        same[same] = found = (vertices[a] == vertices[b]).all(axis=1)
        result[b[found]] = a[found]
        losers = losers[~same]
        left, keys = left[losers], keys[losers]
        if len(left) == 0:
            return result
    # many places have one hash, as where coordinates differ by less than sums of them can show
    _, first, which = np.unique(vertices[left], axis=0, return_index=True, return_inverse=True)
    result[left] = left[first[which.reshape(-1)]]
    return result


def with_copies(seam: Seam, vertices: NDArray[np.float64], on_boundary: Mask) -> Seam:
    """The seam, and in addition the vertices on the boundary that have copies there."""
    rim = np.flatnonzero(on_boundary).astype(np.int32)
    first = places(vertices[rim])
    has_copies = (np.bincount(first, minlength=len(rim)) > 1)[first]
    place, on_seam = seam.place.copy(), seam.on_seam.copy()
    place[rim[has_copies]] = rim[first[has_copies]]
    on_seam[rim[has_copies]] = True
    return Seam(place, on_seam)


def _keys(faces: Indices) -> NDArray[np.int64]:
    """Both ends of each side of each face as one number."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    return edge_keys(ends.min(axis=1), ends.max(axis=1))


def followed(seam: Seam, result: Simplification) -> Seam:
    """The seam in the simplified mesh."""
    new = result.vertex_map[seam.on_seam]
    kept = new >= 0  # without faces a vertex is dropped even if it is locked
    n_vertices = len(result.vertices)
    place = len(seam.place) + np.arange(n_vertices, dtype=np.int32)
    place[new[kept]] = seam.place[seam.on_seam][kept]
    on_seam = np.zeros(n_vertices, np.bool_)
    on_seam[new[kept]] = True
    return Seam(place, on_seam)


def n_shared(faces: Indices, seam: Seam) -> tuple[int, int]:
    """How many edges and faces at the seam become one with others when it is welded."""
    edges, triangles = _at_seam(faces, seam)
    n_distinct = len(np.unique(edge_keys(*edges[edges[:, 0] != edges[:, 1]].T)))
    return len(edges) - n_distinct, len(triangles) - len(np.unique(triangles, axis=0))


def clashes(faces: Indices, seam: Seam, result: Simplification) -> Mask:
    """The vertices on the seam whose edges or faces newly become one with others in the result."""
    met = np.zeros(len(seam.place), np.bool_)
    given, made = _at_seam(faces, seam), _at_seam(result.faces, followed(seam, result))
    for before, after in zip(given, made, strict=True):
        rows, number = np.unique(np.concatenate([before, after]), axis=0, return_inverse=True)
        number = number.reshape(-1)
        old, new = (
            np.bincount(part, minlength=len(rows))
            for part in (number[: len(before)], number[len(before) :])
        )
        is_shared = (new > 1) | ((new > 0) & (rows[:, 0] == rows[:, 1]))
        ends = rows[is_shared & (new > old)]
        met[ends[ends < len(met)]] = True
    return met[seam.place] & seam.on_seam


def _at_seam(faces: Indices, seam: Seam) -> tuple[Indices, Indices]:
    """The edges, each once, and the faces at the seam, by the places of their vertices."""
    near = faces[seam.on_seam[faces].any(axis=1)]
    keys = np.unique(_keys(near))
    ends = seam.place[np.column_stack([keys >> 32, keys & 0xFFFFFFFF])]
    return np.sort(ends, axis=1), np.sort(seam.place[near], axis=1)
