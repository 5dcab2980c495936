"""Slow and obvious oracles: what a triangle surface is, and which of its edges can be contracted.

Everything here is sets and dictionaries, so that it can be read against the theory line by line.
Nothing is shared with the package. Three oracles answer the same question, may this edge be
contracted?, and each knows less of the theory than the one before:

`is_contractible`
    The criterion: cone the boundary, cut along the 3-cycles through the edge, look at the lenses.
`is_contractible_by_trying`
    Cut in the same way, but then keep each piece in turn and compare the topology of what comes
    out with the topology of what went in. Rims, pinches and tetrahedra are never mentioned.
`is_contractible_by_trying_everything`
    The same without coning, for every *choice* of pieces: nothing is assumed about what a lens is.

Meshes are `faces`, an (m, 3) array of vertex indices, and `vertices`, an (n, 3) array. The last
two oracles and all that speaks of lenses expect a 2-manifold; `summary` takes anything.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

Edge = tuple[int, int]
Triangle = tuple[int, int, int]


def edge(p: int, q: int) -> Edge:
    """Return the edge between two vertices, the smaller index first."""
    return (p, q) if p < q else (q, p)


def as_triangles(faces: ArrayLike) -> list[Triangle]:
    """Return the faces as a list of plain tuples."""
    return [(int(p), int(q), int(r)) for p, q, r in np.asarray(faces).reshape(-1, 3).tolist()]


def edges_of(triangle: Triangle) -> tuple[Edge, Edge, Edge]:
    """Return the three edges of a triangle."""
    p, q, r = triangle
    return edge(p, q), edge(q, r), edge(r, p)


def faces_at_edges(triangles: Iterable[Triangle]) -> dict[Edge, list[int]]:
    """Map every edge to the indices of the faces it bounds."""
    found: dict[Edge, list[int]] = defaultdict(list)
    for fi, triangle in enumerate(triangles):
        for side in edges_of(triangle):
            found[side].append(fi)
    return found


def all_edges(faces: ArrayLike) -> list[Edge]:
    """Return every edge of a mesh once, sorted."""
    return sorted(faces_at_edges(as_triangles(faces)))


def classes(members: Iterable[object], pairs: Iterable[tuple[object, object]]) -> list[list]:
    """Return the equivalence classes of `members` under the relation spanned by `pairs`."""
    parent = {member: member for member in members}

    def root(member):
        while parent[member] != member:
            parent[member] = parent[parent[member]]
            member = parent[member]
        return member

    for p, q in pairs:
        parent[root(p)] = root(q)
    grouped: dict[object, list] = defaultdict(list)
    for member in parent:
        grouped[root(member)].append(member)
    return list(grouped.values())


# ---------------------------------------------------------------------------- what a surface is


@dataclass(frozen=True)
class Summary:
    """The topology of a set of triangles.

    Attributes
    ----------
    edge_degrees : tuple of (int, int)
        Pairs (degree, number of edges of that degree), ascending.
    euler_characteristic : int
        Vertices minus edges plus faces; only vertices that some face uses are counted.
    n_components : int
        Components; a shared vertex is enough to connect.
    n_boundary_loops : int
        Boundary loops. Two fans that merely touch in a vertex have a loop each.
    components : tuple of (int, int)
        One pair (Euler characteristic, number of boundary loops) a component, sorted.
    n_duplicate_faces : int
        Faces whose three vertices an earlier face has already.
    n_degenerate_faces : int
        Faces that name a vertex twice. They count here and nowhere else.
    non_manifold_vertices : tuple of int
        Vertices with more than one fan of faces.
    is_consistently_oriented : bool
        No directed edge is used twice.
    """

    edge_degrees: tuple[tuple[int, int], ...]
    euler_characteristic: int
    n_components: int
    n_boundary_loops: int
    components: tuple[tuple[int, int], ...]
    n_duplicate_faces: int
    n_degenerate_faces: int
    non_manifold_vertices: tuple[int, ...]
    is_consistently_oriented: bool

    @property
    def is_manifold(self) -> bool:
        """Whether this is a 2-manifold, perhaps with boundary, oriented or not."""
        return (
            all(degree <= 2 for degree, _ in self.edge_degrees)
            and not self.non_manifold_vertices
            and not self.n_duplicate_faces
            and not self.n_degenerate_faces
        )

    @property
    def is_closed(self) -> bool:
        """Whether every edge has degree 2."""
        return all(degree == 2 for degree, _ in self.edge_degrees)

    @property
    def is_sound(self) -> bool:
        """Whether this is a consistently oriented 2-manifold."""
        return self.is_manifold and self.is_consistently_oriented


def fans(vi: int, triangles: Iterable[Triangle]) -> list[list[Triangle]]:
    """Return the fans at a vertex: its faces, grouped by the edges they share at that vertex."""
    around = [triangle for triangle in triangles if vi in triangle]
    spokes: dict[int, list[int]] = defaultdict(list)
    for number, triangle in enumerate(around):
        for other in set(triangle) - {vi}:
            spokes[other].append(number)
    pairs = [(sharing[0], number) for sharing in spokes.values() for number in sharing[1:]]
    return [[around[number] for number in fan] for fan in classes(range(len(around)), pairs)]


def summary(faces: ArrayLike) -> Summary:
    """Return the topology of a set of triangles, however broken.

    Parameters
    ----------
    faces : (m, 3) int array
        Vertex indices; vertices that no face uses do not exist here.
    """
    given = as_triangles(faces)
    triangles = [triangle for triangle in given if len(set(triangle)) == 3]
    at_edge = faces_at_edges(triangles)
    at_vertex: dict[int, list[Triangle]] = defaultdict(list)
    directed: Counter[Edge] = Counter()
    for p, q, r in triangles:
        for vi in (p, q, r):
            at_vertex[vi].append((p, q, r))
        directed.update([(p, q), (q, r), (r, p)])

    # Two boundary edges follow one another on a loop when one fan lies between them.
    boundary = {side for side, sharing in at_edge.items() if len(sharing) == 1}
    follows = []
    pinched = []
    for vi, around in at_vertex.items():
        fans_here = fans(vi, around)
        if len(fans_here) > 1:
            pinched.append(vi)
        for fan in fans_here:
            ends = {side for t in fan for side in edges_of(t) if vi in side} & boundary
            follows += list(combinations(sorted(ends), 2))
    loops = classes(boundary, follows)

    component_of = {}
    members = classes(at_vertex, at_edge)
    for number, component in enumerate(members):
        component_of.update(dict.fromkeys(component, number))
    euler = [len(component) for component in members]
    for p, _ in at_edge:
        euler[component_of[p]] -= 1
    for p, _, _ in triangles:
        euler[component_of[p]] += 1
    holes = [0] * len(members)
    for loop in loops:
        holes[component_of[loop[0][0]]] += 1

    return Summary(
        edge_degrees=tuple(sorted(Counter(len(sharing) for sharing in at_edge.values()).items())),
        euler_characteristic=sum(euler),
        n_components=len(members),
        n_boundary_loops=len(loops),
        components=tuple(sorted(zip(euler, holes, strict=True))),
        n_duplicate_faces=len(triangles) - len({frozenset(triangle) for triangle in triangles}),
        n_degenerate_faces=len(given) - len(triangles),
        non_manifold_vertices=tuple(sorted(pinched)),
        is_consistently_oriented=all(times == 1 for times in directed.values()),
    )


# ---------------------------------------------------------------------------- coning and cutting


@dataclass(frozen=True)
class ConedSurface:
    """A surface closed by one virtual vertex for each boundary loop.

    Virtual vertices are -1, -2, ...; a triangle is real when all its vertices are.

    Attributes
    ----------
    triangles : list of Triangle
        The real faces in their order, then the virtual ones.
    at_edge : dict
        The indices into `triangles` at each edge.
    neighbours : dict
        The neighbours of each vertex, virtual ones too.
    """

    triangles: list[Triangle]
    at_edge: dict[Edge, list[int]]
    neighbours: dict[int, set[int]]

    def is_real(self, ti: int) -> bool:
        """Whether triangle `ti` is a face of the real surface."""
        return min(self.triangles[ti]) >= 0


def cone(faces: ArrayLike) -> ConedSurface:
    """Close a 2-manifold: join every boundary loop to a virtual vertex of its own."""
    triangles = as_triangles(faces)
    at_edge = faces_at_edges(triangles)
    boundary = [side for side, sharing in at_edge.items() if len(sharing) == 1]
    # On a manifold a boundary vertex lies on just one loop, so a loop is a connected set of edges.
    ends = {vi for side in boundary for vi in side}
    loop_of = {}
    for number, loop in enumerate(sorted(map(sorted, classes(ends, boundary)))):
        loop_of.update(dict.fromkeys(loop, -1 - number))
    for side in boundary:
        p, q, r = triangles[at_edge[side][0]]
        tail, head = next(s for s in ((p, q), (q, r), (r, p)) if edge(*s) == side)
        triangles.append((head, tail, loop_of[head]))
    neighbours: dict[int, set[int]] = defaultdict(set)
    for triangle in triangles:
        for vi in triangle:
            neighbours[vi].update(set(triangle) - {vi})
    return ConedSurface(triangles, faces_at_edges(triangles), neighbours)


def as_coned(faces: ArrayLike | ConedSurface) -> ConedSurface:
    """Return `faces` coned; what is coned already is passed through, to save doing it again."""
    return faces if isinstance(faces, ConedSurface) else cone(faces)


@dataclass(frozen=True)
class Lens:
    """One of the regions a coned surface falls into when it is cut at an edge.

    Attributes
    ----------
    faces : frozenset of int
        Indices of the real faces in it.
    triangles : tuple of Triangle
        All its triangles, virtual ones too.
    rim : tuple of Edge
        The cut edges it meets, sorted; an edge met from both sides stands here twice.
    """

    faces: frozenset[int]
    triangles: tuple[Triangle, ...]
    rim: tuple[Edge, ...]

    @property
    def vertices(self) -> frozenset[int]:
        """All vertices, those on the rim and virtual ones too."""
        return frozenset(vi for triangle in self.triangles for vi in triangle)

    @property
    def inside(self) -> frozenset[int]:
        """The real vertices that do not lie on the rim."""
        on_rim = {vi for side in self.rim for vi in side}
        return frozenset(vi for vi in self.vertices - on_rim if vi >= 0)

    @property
    def has_plain_rim(self) -> bool:
        """Whether the rim is four edges, each met once: then it is the 4-cycle v c u c'."""
        return len(self.rim) == 4 and len(set(self.rim)) == 4

    @property
    def euler_characteristic(self) -> int:
        """Euler characteristic of the closed region."""
        n_edges = len(faces_at_edges(self.triangles))
        return len(self.vertices) - n_edges + len(self.triangles)

    @property
    def is_disc(self) -> bool:
        """Whether the closed region is a disc with a plain rim."""
        return self.has_plain_rim and self.euler_characteristic == 1


def faces_of_edge(coned: ConedSurface, v: int, u: int) -> list[int]:
    """Return the indices of the two triangles at an edge of the real surface."""
    at_vu = coned.at_edge.get(edge(v, u), [])
    if min(v, u) < 0 or len(at_vu) != 2:
        raise ValueError(f"({v}, {u}) is no edge of a 2-manifold: {len(at_vu)} faces after coning")
    return at_vu


def lenses(faces: ArrayLike | ConedSurface, v: int, u: int) -> list[Lens]:
    r"""Cut the coned surface along vu and all vc, uc, and return all but the two faces of vu.

    ::

             c            The common neighbours of v and u are a and b, the apexes of the two faces
           / | \          of vu, and c. The 3-cycle v c u is no face. What is left of the cut
          /  *  \         surface is one lens with rim v a u c, the one with * in it, and another
         /  / \  \        with rim v c u b, which goes around the back.
        /  / a \  \
       | /  / \  \ |      In a closed surface the lenses are closed discs, or hold the handles; a
       v------------u     boundary loop has a virtual vertex, which can be a, b, or c.
        \    b    /

    Lenses come in the order of their first triangles at the cut. Other components of the mesh
    belong to none.
    """
    coned = as_coned(faces)
    at_vu = faces_of_edge(coned, v, u)
    common = coned.neighbours[v] & coned.neighbours[u]
    cut = {edge(v, u)} | {edge(x, c) for c in common for x in (v, u)}

    found = []
    seen = set(at_vu)
    for start in sorted(ti for side in cut for ti in coned.at_edge[side]):
        if start in seen:
            continue
        seen.add(start)
        region, rim = [start], []
        for ti in region:  # grows while we walk it
            for side in edges_of(coned.triangles[ti]):
                if side in cut:
                    rim.append(side)
                    continue
                for other in coned.at_edge[side]:
                    if other not in seen:
                        seen.add(other)
                        region.append(other)
        found.append(
            Lens(
                faces=frozenset(ti for ti in region if coned.is_real(ti)),
                triangles=tuple(coned.triangles[ti] for ti in sorted(region)),
                rim=tuple(sorted(rim)),
            )
        )
    return found


# ---------------------------------------------------------------------------- the criterion

Obstacle = Literal["pinch", "loop_of_three", "tetrahedron", "handle", "hole"]
"""Why a lens cannot be the one that is kept.

=============== ====================================================================
`pinch`         the merged vertex would lie on two boundary loops
`loop_of_three` a boundary loop would be left with fewer than three edges
`tetrahedron`   two faces of the kept lens would become equal
`handle`        the rim of the kept lens is not plain, or another lens is no disc
`hole`          a boundary loop would vanish with another lens
=============== ====================================================================
"""
OBSTACLES: tuple[Obstacle, ...] = get_args(Obstacle)


def obstacles_to_keeping(
    coned: ConedSurface, v: int, u: int, kept: Lens, removed: Iterable[Lens]
) -> frozenset[Obstacle]:
    """Return all that speaks against contracting vu by keeping one lens; nothing if it may be.

    A boundary loop *runs through* a lens when its virtual vertex is among the vertices of the
    lens. As the rest of the surface goes, every loop must run through the kept lens. This is what
    "a removed lens is a disc in the real surface" comes to: a virtual vertex on the rim of a
    removed disc does no harm (the disc is an ear cut off by vu, and its real part may be pinched,
    or empty), but one strictly inside, or one between two removed lenses, takes its loop along.
    """
    removed = list(removed)
    found: set[Obstacle] = set()
    if not kept.has_plain_rim or not all(lens.is_disc for lens in removed):
        found.add("handle")

    def loops_at(vertices: Iterable[int]) -> set[int]:
        return {vi for vi in vertices if vi < 0}

    every_loop = loops_at(kept.vertices).union(*(loops_at(lens.vertices) for lens in removed))
    if every_loop - kept.vertices:
        found.add("hole")
    if len(loops_at(coned.neighbours[v] | coned.neighbours[u])) > 1:
        found.add("pinch")

    merged = [tuple(v if vi == u else vi for vi in triangle) for triangle in kept.triangles]
    edges_left = Counter(min(triangle) for triangle in merged if min(triangle) < 0)
    if any(n_edges < 3 for n_edges in edges_left.values()):
        found.add("loop_of_three")
    real = [frozenset(triangle) for triangle in merged if min(triangle) >= 0]
    if len(set(real)) < len(real):
        found.add("tetrahedron")
    return frozenset(found)


def obstacles(faces: ArrayLike | ConedSurface, v: int, u: int) -> dict[Lens, frozenset[Obstacle]]:
    """Return for each lens at vu what speaks against keeping it."""
    coned = as_coned(faces)
    found = lenses(coned, v, u)
    return {
        kept: obstacles_to_keeping(coned, v, u, kept, [lens for lens in found if lens is not kept])
        for kept in found
    }


def vanishing_vertices(
    faces: ArrayLike | ConedSurface, v: int, u: int, kept: Lens
) -> frozenset[int]:
    """Return the real vertices that are gone when vu is contracted and `kept` is kept.

    These are the vertices inside the removed lenses, and also the common neighbours that no kept
    face uses: the apex of a spike, and those between two removed lenses. The end of vu that is
    merged into the other is not among them.
    """
    everything = {vi for lens in lenses(faces, v, u) for vi in lens.vertices}
    return frozenset(vi for vi in everything - kept.vertices if vi >= 0)


def kept_lens_candidates(
    faces: ArrayLike | ConedSurface,
    v: int,
    u: int,
    *,
    vertices: ArrayLike | None = None,
    removal_limit: float = math.inf,
    limit_on: Literal["inside", "vanishing"] = "inside",
    locked: Collection[int] = (),
) -> list[Lens]:
    """Return the lenses that may be kept, those with the most vertices first.

    Parameters
    ----------
    faces : (m, 3) int array or ConedSurface
        A 2-manifold.
    v, u : int
        The ends of an edge.
    vertices : (n, 3) float array, optional
        Needed for a finite `removal_limit` only.
    removal_limit : float
        How far from the midpoint of vu a vertex may lie to be removed, in mesh units.
    limit_on : {"inside", "vanishing"}
        Which vertices the limit speaks of: those strictly inside a removed lens, or all that
        vanish. The tip of a spike (a vertex of valence 3, v and u among its neighbours) is not
        inside the lens that goes: it lies on the rim.
    locked : collection of int
        Vertices that can neither be removed nor moved. One end of vu may be locked: then the
        other moves onto it.
    """
    coned = as_coned(faces)
    if v in locked and u in locked:
        return []
    candidates = []
    for kept, against in obstacles(coned, v, u).items():
        if against:
            continue
        gone = vanishing_vertices(coned, v, u, kept)
        if gone & set(locked):
            continue
        if removal_limit < math.inf:
            others = [lens for lens in lenses(coned, v, u) if lens.faces != kept.faces]
            inside = frozenset().union(*(lens.inside for lens in others))
            limited = gone if limit_on == "vanishing" else inside
            if max(distances_to_midpoint(vertices, v, u, limited), default=0.0) > removal_limit:
                continue
        candidates.append(kept)
    return sorted(candidates, key=lambda lens: len(lens.vertices), reverse=True)


def distances_to_midpoint(
    vertices: ArrayLike | None, v: int, u: int, those: Iterable[int]
) -> list[float]:
    """Return the distances of some vertices from the midpoint of vu."""
    if vertices is None:
        raise ValueError("a finite removal_limit needs vertices, got None")
    points: NDArray[np.float64] = np.asarray(vertices, dtype=np.float64)
    midpoint = (points[v] + points[u]) / 2
    return [math.dist(midpoint, points[vi]) for vi in those]


def is_contractible(
    vertices: ArrayLike | None,
    faces: ArrayLike | ConedSurface,
    v: int,
    u: int,
    *,
    removal_limit: float = math.inf,
    limit_on: Literal["inside", "vanishing"] = "inside",
    locked: Collection[int] = (),
) -> bool:
    """Return whether vu can be contracted, by the criterion. See `kept_lens_candidates`."""
    return bool(
        kept_lens_candidates(
            faces,
            v,
            u,
            vertices=vertices,
            removal_limit=removal_limit,
            limit_on=limit_on,
            locked=locked,
        )
    )


def edge_kind(faces: ArrayLike | ConedSurface, v: int, u: int) -> str:
    """Name the kind of an edge: what contracting it takes, or what forbids it.

    Returns
    -------
    str
        "simple", when only the faces of vu go; "nested", when lenses go too; "ear", when vu is
        a chord of a boundary loop and what it cuts off goes; otherwise "obstructed by " and the
        obstacles to keeping the lens that has the fewest, joined by " and ". Where several have
        as few, the obstacle that stands first in `OBSTACLES` decides.
    """
    coned = as_coned(faces)
    against = obstacles(coned, v, u)
    if all(against.values()):
        named = [[name for name in OBSTACLES if name in found] for found in against.values()]
        fewest = min(named, key=lambda names: (len(names), [OBSTACLES.index(n) for n in names]))
        return "obstructed by " + " and ".join(fewest)
    common = coned.neighbours[v] & coned.neighbours[u]
    if len(common) == 2:
        return "simple"
    is_boundary_edge = not all(coned.is_real(ti) for ti in faces_of_edge(coned, v, u))
    return "ear" if min(common) < 0 and not is_boundary_edge else "nested"


def contract(faces: ArrayLike, v: int, u: int, kept: Lens) -> NDArray[np.int64]:
    """Contract vu: rename u to v, drop the faces of vu and every lens but one.

    Returns
    -------
    (k, 3) int64 array
        The faces that are left, in their order; vertices keep their indices.
    """
    coned = cone(faces)
    gone = set(faces_of_edge(coned, v, u))
    gone = gone.union(*(lens.faces for lens in lenses(coned, v, u))) - kept.faces
    left = [triangle for fi, triangle in enumerate(as_triangles(faces)) if fi not in gone]
    return renamed(left, v, u)


def renamed(triangles: Collection[Triangle], v: int, u: int) -> NDArray[np.int64]:
    """Return the triangles with u renamed to v, as an array."""
    array = np.array(list(triangles), dtype=np.int64).reshape(-1, 3)
    array[array == u] = v
    return array


def remaining_contractible(
    vertices: ArrayLike,
    faces: ArrayLike,
    max_edge_length: float,
    *,
    removal_limit: float = math.inf,
    limit_on: Literal["inside", "vanishing"] = "inside",
    locked: Collection[int] = (),
) -> list[Edge]:
    """Return the edges shorter than `max_edge_length` that could still be contracted."""
    points = np.asarray(vertices, dtype=np.float64)
    coned = cone(faces)
    return [
        (v, u)
        for v, u in all_edges(faces)
        if math.dist(points[v], points[u]) < max_edge_length
        and is_contractible(
            points, coned, v, u, removal_limit=removal_limit, limit_on=limit_on, locked=locked
        )
    ]


# ---------------------------------------------------------------------------- by trying


def has_same_topology(before: Summary, after: Summary) -> bool:
    """Whether `after` is a sound surface of the same topology as `before`."""
    return after.is_sound and after.components == before.components


def is_made_of_discs(triangles: list[Triangle]) -> bool:
    """Whether the triangles, grouped by the edges they share, form discs only."""
    at_edge = faces_at_edges(triangles)
    pairs = [pair for sharing in at_edge.values() for pair in combinations(sharing, 2)]
    for piece in classes(range(len(triangles)), pairs):
        shape = summary([triangles[fi] for fi in piece])
        if not shape.is_manifold or shape.components != ((1, 1),):
            return False
    return True


def is_contractible_by_trying(faces: ArrayLike, v: int, u: int) -> bool:
    """Return whether vu can be contracted: keep each piece of the cut in turn, and look.

    A trial succeeds when what is left is a sound surface with the topology of the input, and what
    went with the faces of vu was made of discs. The surface is coned and cut as `lenses` does it;
    nothing else of the criterion is used.
    """
    triangles = as_triangles(faces)
    before = summary(triangles)
    coned = cone(triangles)
    at_vu = set(faces_of_edge(coned, v, u))
    pieces = [lens.faces for lens in lenses(coned, v, u)]
    for kept in pieces:
        gone = frozenset().union(*pieces) - kept
        left = [t for fi, t in enumerate(triangles) if fi not in gone and fi not in at_vu]
        if has_same_topology(before, summary(renamed(left, v, u))) and is_made_of_discs(
            [triangles[fi] for fi in sorted(gone)]
        ):
            return True
    return False


def is_contractible_by_trying_everything(
    faces: ArrayLike, v: int, u: int, *, max_pieces: int = 8
) -> bool:
    """Return whether vu can be contracted: keep any choice of pieces of the cut, and look.

    There is no coning: the real surface is cut along vu and all vc, uc, and a chord of a boundary
    loop separates by itself. Every set of pieces is tried, so that nothing is taken for granted of
    what can be kept, nor of what may be removed.

    Raises
    ------
    ValueError
        If there are more than `max_pieces` pieces, as the number of trials doubles with each.
    """
    triangles = as_triangles(faces)
    before = summary(triangles)
    at_edge = faces_at_edges(triangles)
    neighbours: dict[int, set[int]] = defaultdict(set)
    for p, q in at_edge:
        neighbours[p].add(q)
        neighbours[q].add(p)
    cut = {edge(v, u)} | {edge(x, c) for c in neighbours[v] & neighbours[u] for x in (v, u)}
    at_vu = set(at_edge[edge(v, u)])
    pairs = [
        (sharing[0], fi)
        for side, sharing in at_edge.items()
        if side not in cut
        for fi in sharing[1:]
    ]
    component = next(part for part in classes(neighbours, at_edge) if v in part)
    pieces = [
        set(piece)
        for piece in classes(range(len(triangles)), pairs)
        if triangles[piece[0]][0] in component and piece[0] not in at_vu
    ]
    if len(pieces) > max_pieces:
        raise ValueError(f"expected at most {max_pieces} pieces, got {len(pieces)}")
    for n_gone in range(len(pieces) + 1):
        for choice in combinations(pieces, n_gone):
            gone = at_vu.union(*choice)
            left = [triangle for fi, triangle in enumerate(triangles) if fi not in gone]
            if has_same_topology(before, summary(renamed(left, v, u))):
                return True
    return False
