"""Tiny meshes, each drawn and named for the failure it shows, and the tools to make more of them.

A mesh is a pair `(vertices, faces)`: (n, 3) float64 and (m, 3) int64. All surfaces are
consistently oriented, with normals that point outward where they are closed, save those in the
last section, which are broken on purpose. Coordinates are in general position: no two vertices
coincide and lengths do not tie.

The operations (`punched`, `connected_sum`, `add_handle`, ...) return new meshes and raise
`ValueError` when the result would be no surface.
"""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]

JITTER = 0.03
"""Noise that brings named meshes into general position, in units of their shortest edge."""


def as_mesh(vertices: ArrayLike, faces: ArrayLike, *, jitter: float = JITTER) -> Mesh:
    """Return a mesh in general position; the noise depends on the number of vertices only."""
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if jitter:
        sides = points[triangles] - points[np.roll(triangles, 1, axis=1)]
        shortest = np.linalg.norm(sides, axis=2).min()
        noise = np.random.default_rng(len(points)).uniform(-1, 1, points.shape)
        points += jitter * shortest * noise
    return points, triangles


def compacted(vertices: NDArray[np.float64], faces: ArrayLike) -> Mesh:
    """Drop the vertices that no face uses."""
    used, faces = np.unique(np.asarray(faces, dtype=np.int64), return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)


def is_surface(faces: ArrayLike) -> bool:
    """Whether the faces form a consistently oriented 2-manifold: every vertex has just one fan."""
    triangles = np.asarray(faces).tolist()
    if len({frozenset(t) for t in triangles}) < len(triangles) or not triangles:
        return False
    # follow[v][a] = b for every face v a b: around v, the edge to b comes after the edge to a
    follow: dict[int, dict[int, int]] = defaultdict(dict)
    for p, q, r in triangles:
        if p == q or q == r or r == p:
            return False
        for v, a, b in ((p, q, r), (q, r, p), (r, p, q)):
            if a in follow[v]:
                return False
            follow[v][a] = b
    for after in follow.values():
        starts = after.keys() - after.values()
        if len(starts) > 1 or len(set(after.values())) < len(after):
            return False
        start = at = next(iter(starts or after))
        n_faces = 0
        while at in after:
            at = after[at]
            n_faces += 1
            if at == start:
                break
        if n_faces < len(after):
            return False
    return True


def checked(mesh: Mesh, what: str) -> Mesh:
    """Return the mesh, or raise ValueError when it is no surface."""
    if not is_surface(mesh[1]):
        raise ValueError(f"{what} would leave something that is no surface")
    return mesh


def directed_edges(faces: ArrayLike) -> dict[tuple[int, int], int]:
    """Map every directed edge to the face that runs along it."""
    found = {}
    for fi, (p, q, r) in enumerate(np.asarray(faces).tolist()):
        found[p, q] = found[q, r] = found[r, p] = fi
    return found


def boundary_edges(faces: ArrayLike) -> list[tuple[int, int]]:
    """Return the directed edges that no face runs along in the other direction."""
    found = directed_edges(faces)
    return [(p, q) for p, q in found if (q, p) not in found]


# ---------------------------------------------------------------------------- closed surfaces


def tetrahedron() -> Mesh:
    r"""Fold flat: |C| = 2 at every edge, and yet no edge can be contracted.

    ::

             0
           / | \
          1--|--2        contracting 0 1 leaves the face 0 2 3 twice, back to back
           \ | /
             3
    """
    corners = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
    return as_mesh(corners, [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)])


def bipyramid(n: int) -> Mesh:
    r"""A double cone over an n-gon: two vertices of valence n, n of valence 4.

    ::

             n              n = 3: the edges of the 3-cycle 0 1 2 cannot be contracted, for it
           / | \            leaves a tetrahedron in disguise on both sides. The spokes can.
          0--1--2 ...       n = 4: an octahedron.
           \ | /            n large: a needle's eye, two vertices of very high valence.
            n+1
    """
    angles = 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    faces = []
    for i in range(n):
        faces += [(i, (i + 1) % n, n), ((i + 1) % n, i, n + 1)]
    return as_mesh(np.vstack([ring, [(0, 0, 1), (0, 0, -1)]]), faces)


def octahedron() -> Mesh:
    """The smallest closed surface of which every edge is simple to contract."""
    return bipyramid(4)


def every_lens_a_tetrahedron(n: int) -> Mesh:
    r"""A sphere with an edge that cannot be contracted, |C| = n: all its lenses have two faces.

    ::

                 n
              / /|\ \            A bipyramid whose ring edge from n-1 to 0 has been flipped to
            0--1--2--3            the edge n, n+1. Each lens lies between two neighbours of the
              \ \|/ /            ring 0 1 2 ... n-1 and has two faces, equal once n and n+1 are.
                n+1   and the edge n, n+1 around the back
    """
    vertices, faces = bipyramid(n)
    flipped = [t for t in faces.tolist() if not {0, n - 1} <= set(t)]
    return vertices, np.array([*flipped, (n, n - 1, n + 1), (n, n + 1, 0)])


def icosphere(n: int) -> Mesh:
    """An icosahedron whose faces have been cut into four n times."""
    golden = (1 + 5**0.5) / 2
    points = [(x, y * golden, 0) for x in (-1, 1) for y in (-1, 1)]
    vertices = np.array([np.roll(p, k) for k in range(3) for p in points], dtype=np.float64)
    faces = []
    for p in range(12):  # faces are the triples of vertices at distance 2
        for q in range(p + 1, 12):
            for r in range(q + 1, 12):
                trio = vertices[[p, q, r]]
                if np.allclose(np.linalg.norm(trio - np.roll(trio, 1, axis=0), axis=1), 2):
                    faces.append((p, q, r) if np.linalg.det(trio) > 0 else (p, r, q))
    triangles = np.array(faces)
    for _ in range(n):
        vertices, triangles = cut_into_four(vertices, triangles)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return as_mesh(vertices, triangles)


def cut_into_four(vertices: NDArray[np.float64], faces: ArrayLike) -> Mesh:
    """Put a vertex in the middle of each edge and cut every face into four."""
    points = list(vertices)
    middles: dict[tuple[int, int], int] = {}

    def middle(p: int, q: int) -> int:
        side = (min(p, q), max(p, q))
        if side not in middles:
            middles[side] = len(points)
            points.append((points[p] + points[q]) / 2)
        return middles[side]

    quarters = []
    for p, q, r in np.asarray(faces).tolist():
        pq, qr, rp = middle(p, q), middle(q, r), middle(r, p)
        quarters += [(p, pq, rp), (pq, q, qr), (rp, qr, r), (pq, qr, rp)]
    return np.array(points), np.array(quarters)


def torus(nu: int, nv: int) -> Mesh:
    """A torus of nu by nv cells, 3 by 3 at least; with 3 either way, throats are 3-cycles."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(nu), np.arange(nv), indexing="ij"))
    a, b = 2 * np.pi * i / nu, 2 * np.pi * j / nv
    vertices = [(2 + np.cos(b)) * np.cos(a), (2 + np.cos(b)) * np.sin(a), np.sin(b)]
    return as_mesh(np.stack(vertices, axis=1), quads_cut(nu, nv, (nu, nv)))


def quads_cut(nu: int, nv: int, wrap: tuple[int, int]) -> NDArray[np.int64]:
    """Cut nu by nv cells in two each; vertex (i, j) is number j + i * (vertices in a row)."""
    row = wrap[1]
    faces = []
    for i in range(nu):
        for j in range(nv):
            i2, j2 = (i + 1) % wrap[0], (j + 1) % wrap[1]
            p, q, r, s = i * row + j, i2 * row + j, i2 * row + j2, i * row + j2
            faces += [(p, q, r), (p, r, s)]
    return np.array(faces)


def minimal_torus() -> Mesh:
    r"""The torus of seven vertices (Moebius, Csaszar): all are neighbours of all, |C| = 5.

    No edge can be contracted, as no torus has fewer vertices.

    ::

          1---5---2---6---3       a row; the next row up begins with 4 above 1 and
         / \ / \ / \ / \ / \      everything repeats: faces i, i+1, i+3 and i, i+3, i+2 mod 7
        0---4---1---5---2---6
    """
    # Csaszar's polyhedron: with these coordinates no two faces intersect.
    corners = [(3, -3, 0), (3, 3, 1), (1, 2, 3), (-1, -2, 3), (-3, -3, 1), (-3, 3, 0), (0, 0, 15)]
    faces = [((i, (i + 1) % 7, (i + 3) % 7), (i, (i + 3) % 7, (i + 2) % 7)) for i in range(7)]
    return as_mesh(corners, np.reshape(faces, (-1, 3)))


def prism_tube(
    n_rings: int, ends: Literal["open", "capped", "joined"] = "open", *, height: float = 0.8
) -> Mesh:
    r"""A tube of 3-cycles.

    ::

        2---5---8---        open:    an annulus, both boundary loops of length 3
        |\  |\  |           capped:  a sphere; every ring within is a neck
        | \ | \ |           joined:  a torus; no ring separates, a ring edge is obstructed by
        1---4---7---                 the handle
        0---3---6---
    """
    ring, along = np.arange(3 * n_rings) % 3, np.arange(3 * n_rings) // 3
    a = 2 * np.pi * (ring / 3 + 0.02 * along)
    cells = n_rings if ends == "joined" else n_rings - 1
    faces = quads_cut(cells, 3, (n_rings, 3))
    if ends == "joined":
        b = 2 * np.pi * along / n_rings
        radius = 2.5 + np.cos(a)
        vertices = np.stack([radius * np.cos(b), radius * np.sin(b), np.sin(a)], axis=1)
        return as_mesh(vertices, faces)
    vertices = np.stack([np.cos(a), np.sin(a), -height * along], axis=1)
    if ends == "capped":
        last = 3 * n_rings - 3
        faces = np.vstack([faces, [(0, 1, 2), (last + 2, last + 1, last)]])
    return as_mesh(vertices, faces)


def two_balloons_on_a_neck(
    first: Mesh | None = None, second: Mesh | None = None, *, prism_layers: int = 0
) -> Mesh:
    r"""A balloon is a lens too: contract an edge of the neck, and one of the two goes.

    ::

           ___           ___         The neck is one 3-cycle, or a tube of several. Contracting
          /   \--     --/   \        an edge of it removes the smaller balloon, if that is a
         |      3-cycle      |       sphere; with a torus on both sides (see
          \___/--     --\___/        `two_tori_on_a_neck`) there is no lens to keep.
    """
    first = octahedron() if first is None else first
    second = octahedron() if second is None else second
    return connected_sum(first, second, prism_layers=prism_layers)


def two_tori_on_a_neck(*, prism_layers: int = 0) -> Mesh:
    """The neck separates and is obstructed all the same: either side has a handle to lose."""
    return two_balloons_on_a_neck(torus(3, 4), torus(4, 3), prism_layers=prism_layers)


def handle_with_triangular_throat(*, prism_layers: int = 0) -> Mesh:
    r"""A sphere with one handle; its throat, a 3-cycle, does not separate.

    ::

          ____              A lens grown from either side of the throat comes out on the other:
         /    \  ___        there is one lens, its rim is no 4-cycle, and a flood fill that is
        |      \/   \       not told so eats the whole surface.
        |   throat   |
         \____/\____/
    """
    mesh = icosphere(1)
    centres = mesh[0][mesh[1]].mean(axis=1)
    opposite = int(np.argmin(centres @ centres[0]))
    return add_handle(mesh, 0, opposite, prism_layers=prism_layers)


def spike(height: float = 3.0) -> Mesh:
    r"""An octahedron with a vertex of valence 3: the tip of a spike. The last vertex is the tip.

    ::

            c              Contracting v u (vertices 0 and 1) takes the tip t along. The lens that
           /|\             goes, v t u c, has no vertex inside: t is on its rim, however far away.
          / t \
         / / \ \
        v-------u
    """
    vertices, faces = octahedron()
    p, q, r = faces[0]
    tip = vertices[[p, q, r]].mean(axis=0) * (1 + height)
    faces = np.vstack([faces[1:], [(p, q, 6), (q, r, 6), (r, p, 6)]])
    return np.vstack([vertices, tip]), faces


def stack_of_spikes(depth: int) -> Mesh:
    r"""An octahedron with `depth` vertices of valence 3, each put into a face at the edge 0 1.

    ::

              c            At the edge v u there are depth + 2 common neighbours, nested one in
            / | \          the other; all lenses but the one around the back have two faces.
           / .2. \
          / / 1 \ \
         v---------u
    """
    vertices, faces = octahedron()
    for _ in range(depth):
        at = directed_edges(faces)[0, 1]
        weights = [0.3, 0.3, 0.4]
        corners = np.roll(faces[at], -faces[at].tolist().index(0))
        vertices, faces = inserted(vertices, faces, at, vertices[corners].T @ weights)
    return vertices, faces


# ---------------------------------------------------------------------------- with boundary


def triangle() -> Mesh:
    """One face: coned, it is a tetrahedron. The loop would be left with two edges."""
    return as_mesh([(0, 0, 0), (1, 0, 0), (0.3, 0.8, 0)], [(0, 1, 2)])


def two_triangles() -> Mesh:
    """The chord 0 2 is obstructed, its loop too short on both sides; the boundary edges go.

    ::

        3---2
        | / |
        0---1
    """
    return as_mesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])


def fan(n: int, *, full: bool = False) -> Mesh:
    r"""Faces around vertex 0: a half-disc, or with `full` an open cone with vertex 0 inside.

    ::

          3---2            half: the spokes within are chords of the boundary loop, and what
         / \ / \                 they cut off is an ear
        4---0---1          full: a vertex of high valence; n = 3 is a tetrahedron with a hole
    """
    angles = (2 * np.pi / n if full else np.pi / n) * np.arange(n if full else n + 1)
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    faces = [(0, i, i + 1) for i in range(1, n + (not full))]
    if full:
        faces.append((0, n, 1))
    return as_mesh(np.vstack([(0, 0, 0.6 * full), *ring]), faces)


def grid(nx: int, ny: int) -> Mesh:
    """A rectangle of nx by ny cells, each cut in two."""
    i, j = (g.ravel() for g in np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij"))
    vertices = np.stack([i, j, 0.1 * np.sin(i) * np.cos(j)], axis=1)
    return as_mesh(vertices, quads_cut(nx, ny, (nx + 1, ny + 1)))


def annulus(n: int, n_layers: int = 1) -> Mesh:
    r"""A ring of n cells around, n_layers across.

    ::

        o---o---o---     n_layers = 1: every edge across joins the two boundary loops, and its
        | \ | \ |        contraction pinches them together. n = 3: loops of length 3.
        o---o---o---
    """
    i = np.arange(n * (n_layers + 1)) % n
    j = np.arange(n * (n_layers + 1)) // n
    a, radius = 2 * np.pi * i / n, 1 + 0.7 * j
    vertices = np.stack([radius * np.cos(a), radius * np.sin(a), 0 * a], axis=1)
    faces = quads_cut(n_layers, n, (n_layers + 1, n))
    return as_mesh(vertices, faces)


def ear_with_a_pinched_rest() -> Mesh:
    r"""A chord whose ear falls apart when its face is taken away.

    ::

        3-----1-----------5-----7     The chord v u = 1 2 cuts off the ear 1 3 0 4 2. Its face
         \   / \  .       |\   /      1 0 2 touches the loop in 0, and the rest of the ear, the
          \ /   |   .     | \ /       faces 3 0 1 and 0 4 2, hangs together in that vertex only.
           0    |     .   |  8        The rest is no disc, and yet the ear as a whole is one, and
          / \   |       . | / \       may go.
         /   \ /         .|/   \
        4-----2-----------6-----9
    """
    points = [(0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1), (3, 1), (3, -1), (5, 1), (4, 0), (5, -1)]
    faces = [(1, 0, 2), (3, 0, 1), (0, 4, 2), (1, 2, 6), (1, 6, 5)]
    faces += [(5, 6, 8), (5, 8, 7), (8, 6, 9)]
    return as_mesh([(*point, 0) for point in points], faces)


def loop_between_two_lenses() -> Mesh:
    r"""A disc whose boundary loop goes, though no real face does but those of its chord 3 4.

    ::

               3             `every_lens_a_tetrahedron(4)` with the star of a ring vertex taken out,
            / / \ \          that is the hole in ( ), and a vertex inserted in a face between 1
           0 ( ) 1--2        and 2. At v u = 3 4 there are the lenses 0-hole, hole-1, and 1-2. Keep
            \ \ / /          the last: the other two are discs and have no real face, yet the loop
               4             between them is gone, and a disc has become a sphere.
    """
    vertices, faces = every_lens_a_tetrahedron(4)
    faces = faces[~(faces == 1).any(axis=1)]
    at = next(fi for fi, t in enumerate(faces.tolist()) if set(t) == {2, 3, 4})
    return compacted(*inserted(vertices, faces, at, vertices[faces[at]].mean(axis=0)))


# ---------------------------------------------------------------------------- operations


def inserted(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], at: int, point: ArrayLike
) -> Mesh:
    """Put a vertex of valence 3 into face `at`; its three faces come last."""
    p, q, r = faces[at]
    new = len(vertices)
    three = [(p, q, new), (q, r, new), (r, p, new)]
    return np.vstack([vertices, point]), np.vstack([np.delete(faces, at, axis=0), three])


def insert_degree_3(mesh: Mesh, rng: np.random.Generator, count: int, depth: int) -> Mesh:
    """Put `count` stacks of `depth` vertices of valence 3 into random faces.

    Every vertex of a stack goes into a face of the one before, more often than not such that all
    of them share an edge: then they nest.
    """
    vertices, faces = mesh
    for _ in range(count):
        at = int(rng.integers(len(faces)))
        side = rng.permutation(faces[at])[:2]
        keeps_side = rng.random() < 0.6
        for _ in range(depth):
            weights = rng.dirichlet([3, 3, 3])
            corners = vertices[faces[at]]
            size = np.linalg.norm(corners - corners.mean(axis=0))
            point = corners.T @ weights + 0.1 * size * rng.uniform(-1, 1, 3)
            vertices, faces = inserted(vertices, faces, at, point)
            at = len(faces) - int(rng.integers(1, 4))
            if keeps_side:
                at = next(len(faces) - k for k in (1, 2, 3) if np.isin(side, faces[-k]).all())
    return vertices, faces


def punched(mesh: Mesh, rng: np.random.Generator, holes: int, *, max_size: int = 4) -> Mesh:
    """Take out faces, one and up to `max_size` - 1 next to it, `holes` times.

    A hole of one face is a boundary loop of length 3. A hole may also bite into another or into
    the boundary, and cut the surface in two; what is left is a surface always.
    """
    vertices, faces = mesh
    triangles = faces.tolist()
    for _ in range(holes):
        removed: set[int] = set()
        for _ in range(int(rng.integers(1, max_size + 1))):
            order = rng.permutation(len(triangles))[:10].tolist()
            if removed:
                order = [
                    fi for fi in order_by_touching(triangles, removed, rng) if len(triangles) > 1
                ][:4]
            for fi in order:
                left = triangles[:fi] + triangles[fi + 1 :]
                if is_surface(left):
                    removed |= set(triangles[fi])
                    triangles = left
                    break
            else:
                break
    return compacted(vertices, triangles)


def order_by_touching(
    triangles: list[list[int]], vertices: set[int], rng: np.random.Generator
) -> list[int]:
    """Return, in random order, the faces that have two or three of these vertices."""
    touching = [fi for fi, t in enumerate(triangles) if len(vertices.intersection(t)) >= 2]
    return rng.permutation(touching).astype(int).tolist()


def flipped_edges(mesh: Mesh, rng: np.random.Generator, count: int) -> Mesh:
    """Flip random edges wherever the new edge does not exist: valences go astray."""
    vertices, faces = mesh
    triangles = faces.tolist()
    for _ in range(count):
        at = directed_edges(triangles)
        p, q = list(at)[int(rng.integers(len(at)))]
        if (q, p) not in at:
            continue
        r = next(vi for vi in triangles[at[p, q]] if vi not in (p, q))
        s = next(vi for vi in triangles[at[q, p]] if vi not in (p, q))
        if r == s or (r, s) in at or (s, r) in at:
            continue
        triangles[at[p, q]], triangles[at[q, p]] = [p, s, r], [s, q, r]
    return vertices, np.array(triangles)


def disjoint_union(*meshes: Mesh, spacing: float = 0.3) -> Mesh:
    """Put meshes side by side along x."""
    vertices, faces, x, n_vertices = [], [], 0.0, 0
    for points, triangles in meshes:
        low, high = points.min(axis=0), points.max(axis=0)
        vertices.append(points + np.array([x - low[0], 0, 0]))
        faces.append(triangles + n_vertices)
        x += high[0] - low[0] + spacing
        n_vertices += len(points)
    return np.vstack(vertices), np.vstack(faces)


def shuffled(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """Renumber the vertices, reorder the faces, and rotate the corners of each, at random."""
    vertices, faces = mesh
    number = rng.permutation(len(vertices))
    points = np.empty_like(vertices)
    points[number] = vertices
    triangles = number[faces][rng.permutation(len(faces))]
    turns = (np.arange(3) + rng.integers(3, size=(len(faces), 1))) % 3
    return points, np.take_along_axis(triangles, turns, axis=1)


def interior_faces(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices of the faces that do not touch the boundary."""
    on_boundary = [vi for side in boundary_edges(faces) for vi in side]
    return np.flatnonzero(~np.isin(faces, on_boundary).any(axis=1))


def tube(
    points: list[NDArray[np.float64]], start: list[int], end: list[int], layers: int
) -> list[tuple[int, int, int]]:
    """Join two 3-cycles, matched vertex by vertex, by a prism; append the vertices of its rings.

    `start` runs as a face that was taken out there, `end` against one.
    """
    rings = [start]
    for layer in range(1, layers):
        t = layer / layers
        rings.append(list(range(len(points), len(points) + 3)))
        points += [(1 - t) * points[p] + t * points[q] for p, q in zip(start, end, strict=True)]
    rings.append(end)
    faces = []
    for one, two in pairwise(rings):
        for k in range(3):
            p, q, r, s = one[k], one[(k + 1) % 3], two[(k + 1) % 3], two[k]
            faces += [(p, q, r), (p, r, s)]
    return faces


def connected_sum(
    a: Mesh, b: Mesh, *, face_a: int | None = None, face_b: int | None = None, prism_layers: int = 0
) -> Mesh:
    """Take a face out of each of two surfaces and join them along the two 3-cycles.

    Parameters
    ----------
    a, b : Mesh
        b is scaled, turned and moved so that it sits outside on the face of a.
    face_a, face_b : int, optional
        The faces to take out; by default the first that does not touch the boundary.
    prism_layers : int
        0 identifies the two 3-cycles; k > 0 puts a triangular prism of k layers between them.

    Raises
    ------
    ValueError
        If the result would be no surface (both faces touch the boundary).
    """
    face_a = int(interior_faces(a[1])[0]) if face_a is None else face_a
    face_b = int(interior_faces(b[1])[0]) if face_b is None else face_b
    start = a[1][face_a].tolist()
    end = (b[1][face_b] + len(a[0])).tolist()
    end = [end[0], end[2], end[1]]  # seen from a, the face of b runs the other way around
    moved = moved_onto(b, face_b, a[0][start], prism_layers)
    points = [*a[0], *moved]
    faces = [*np.delete(a[1], face_a, axis=0), *(np.delete(b[1], face_b, axis=0) + len(a[0]))]
    return joined(points, faces, start, end, prism_layers, "connected_sum")


def moved_onto(
    mesh: Mesh, face: int, target: NDArray[np.float64], prism_layers: int
) -> NDArray[np.float64]:
    """Return the vertices, moved so that a face lies on a target triangle from the other side."""

    def frame(corners: NDArray[np.float64]) -> tuple[NDArray, float, NDArray]:
        centre = corners.mean(axis=0)
        size = float(np.linalg.norm(corners - centre))
        if not (corners[0] - centre).any():
            raise ValueError("a corner of the face lies in its middle")
        x = (corners[0] - centre) / np.linalg.norm(corners[0] - centre)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        if not normal.any():  # the corners are on one line: any normal of that will do
            normal = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
        normal /= np.linalg.norm(normal)
        return centre, size, np.stack([x, np.cross(normal, x), normal])

    centre, size, axes = frame(mesh[0][mesh[1][face]])
    onto, onto_size, onto_axes = frame(target)
    onto_axes = onto_axes * [[1], [-1], [-1]]
    lifted = onto + onto_axes[2] * (-0.7 * onto_size * prism_layers)
    return lifted + (mesh[0] - centre) @ axes.T @ onto_axes * (onto_size / size)


def joined(
    points: list[NDArray[np.float64]],
    faces: list[NDArray[np.int64]],
    start: list[int],
    end: list[int],
    prism_layers: int,
    what: str,
) -> Mesh:
    """Identify two 3-cycles, or join them by a prism, where both faces have been taken out."""
    if prism_layers:
        added = tube(points, start, end, prism_layers)
        return checked(compacted(np.array(points), np.vstack([*faces, *added])), what)
    vertices, triangles = np.array(points), np.array(faces)
    for p, q in zip(start, end, strict=True):
        triangles[triangles == q] = p
    return checked(compacted(vertices, triangles), what)


def add_handle(
    mesh: Mesh, f: int, g: int, *, prism_layers: int = 1, turn: int | None = None
) -> Mesh:
    """Take out two faces of one surface and join the holes: one handle more.

    Parameters
    ----------
    mesh : Mesh
        A surface.
    f, g : int
        Two faces, best far from each other.
    prism_layers : int
        0 identifies the two 3-cycles; k > 0 puts a triangular prism of k layers between them.
    turn : int, optional
        Which of the three ways to match the two 3-cycles; by default the one that twists least.

    Raises
    ------
    ValueError
        If the result would be no surface: the faces are too near to each other.
    """
    vertices, faces = mesh
    start, end = faces[f].tolist(), faces[g].tolist()[::-1]
    if set(start) & set(end):
        raise ValueError(f"add_handle needs two faces apart from each other, got {f} and {g}")
    if turn is None:
        twists = [vertices[start] - vertices[end[k:] + end[:k]] for k in range(3)]
        turn = int(np.argmin([np.linalg.norm(twist) for twist in twists]))
    end = end[turn % 3 :] + end[: turn % 3]
    left = [face for fi, face in enumerate(faces) if fi not in (f, g)]
    points = [*vertices]
    if not prism_layers:  # the 3-cycle they become lies halfway
        for p, q in zip(start, end, strict=True):
            points[p] = (points[p] + points[q]) / 2
    return joined(points, left, start, end, prism_layers, "add_handle")


def bridged(mesh: Mesh, first: tuple[int, int], second: tuple[int, int]) -> Mesh:
    r"""Join two directed boundary edges by a strip of two faces.

    ::

        ---p---s---       It joins two loops into one, or cuts one into two. The strip's own
           | \ |          edges are chords that do not separate: a handle once the loop is coned.
        ---q---r---
    """
    (p, q), (r, s) = first, second
    faces = np.vstack([mesh[1], [(q, p, s), (q, s, r)]])
    return checked((mesh[0], faces), "bridged")


# ---------------------------------------------------------------------------- broken on purpose


def moebius_strip(n: int = 5) -> Mesh:
    """A surface that cannot be oriented: faces i, i+1, i+2 mod n; n must be odd, 5 or more."""
    a = 2 * np.pi * np.arange(n) / n
    # Vertices lie on alternating sides of a line that goes around once while the strip turns half.
    side = 0.6 * (-1.0) ** np.arange(n)
    radius = 2 + side * np.cos(a / 2)
    vertices = [radius * np.cos(a), radius * np.sin(a), side * np.sin(a / 2)]
    faces = [(i, (i + 1) % n, (i + 2) % n) for i in range(n)]
    return as_mesh(np.stack(vertices, axis=1), faces)


def bow_tie() -> Mesh:
    r"""Two fans that share a vertex and nothing else.

    ::

        2       4
        | \   / |
        |   0   |
        | /   \ |
        1       3
    """
    points = [(0, 0, 0), (-1, -1, 0), (-1, 1, 0.2), (1, -1, 0), (1, 1, 0)]
    return as_mesh(points, [(0, 2, 1), (0, 3, 4)])


def three_pages() -> Mesh:
    """Three faces at one edge, 0 1: an edge of degree 3."""
    points = [(0, 0, 0), (0, 0, 1), (1, 0, 0.5), (-0.5, 0.8, 0.5), (-0.5, -0.8, 0.5)]
    return as_mesh(points, [(0, 1, 2), (0, 1, 3), (0, 1, 4)])


def flipped_face() -> Mesh:
    """An octahedron with one face turned inside out: no consistent orientation."""
    vertices, faces = octahedron()
    return vertices, np.vstack([faces[0][::-1], faces[1:]])


def double_covered_triangle() -> Mesh:
    """Two faces back to back: every edge has degree 2, and nothing is right."""
    return triangle()[0], np.array([(0, 1, 2), (0, 2, 1)])


def collapsed_face() -> Mesh:
    """Two triangles and a degenerate face that names a vertex twice."""
    vertices, faces = two_triangles()
    return vertices, np.vstack([faces, [(0, 1, 1)]])


def unused_vertices() -> Mesh:
    """An octahedron with a vertex before, one in between and one after that no face uses."""
    vertices, faces = octahedron()
    points = np.vstack([(9, 9, 9), vertices[:2], (8, 8, 8), vertices[2:], (7, 7, 7)])
    return points, np.array([1, 2, 4, 5, 6, 7])[faces]
