"""Adversarial surfaces: hypothesis strategies, and `adversarial_mesh(seed)` for large sweeps.

A surface is built from a `Recipe`: a few parts, each a base to which operations are applied, put
side by side and shuffled. Both the strategies and `adversarial_mesh` choose recipes only, and
hypothesis shrinks them to fewer parts, fewer operations and smaller seeds. An operation that does
not apply (no face to punch, no room for a handle, too many faces already) leaves the surface as
it is.

Everything built is a consistently oriented 2-manifold in general position.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

import meshes
from meshes import Mesh

Rng = np.random.Generator

MAX_FACES = 150
"""No operation and no further part may take a surface beyond this."""

MAX_SEED = 2**16


# ---------------------------------------------------------------------------- the ingredients

BASES: dict[str, Callable[[], Mesh]] = {
    "triangle": meshes.triangle,
    "two triangles": meshes.two_triangles,
    "half fan": lambda: meshes.fan(5),
    "cone": lambda: meshes.fan(4, full=True),
    "tetrahedron without a face": lambda: meshes.fan(3, full=True),
    "grid": lambda: meshes.grid(3, 3),
    "strip": lambda: meshes.grid(5, 1),
    "annulus": lambda: meshes.annulus(5),
    "smallest annulus": lambda: meshes.annulus(3),
    "wide annulus": lambda: meshes.annulus(4, 2),
    "open tube": lambda: meshes.prism_tube(4),
    "pinched ear": meshes.ear_with_a_pinched_rest,
    "loop between lenses": meshes.loop_between_two_lenses,
    "tetrahedron": meshes.tetrahedron,
    "triangular bipyramid": lambda: meshes.bipyramid(3),
    "octahedron": meshes.octahedron,
    "needle's eye": lambda: meshes.bipyramid(9),
    "icosahedron": lambda: meshes.icosphere(0),
    "lenses of two faces": lambda: meshes.every_lens_a_tetrahedron(5),
    "stack of spikes": lambda: meshes.stack_of_spikes(3),
    "capped tube": lambda: meshes.prism_tube(4, "capped"),
    "smallest ring of prisms": lambda: meshes.prism_tube(3, "joined"),
    "ring of prisms": lambda: meshes.prism_tube(5, "joined"),
    "minimal torus": meshes.minimal_torus,
    "torus": lambda: meshes.torus(4, 4),
    "two tori on a neck": meshes.two_tori_on_a_neck,
}

CLOSED_BALLOONS = (
    "tetrahedron",
    "octahedron",
    "icosahedron",
    "capped tube",
    "minimal torus",
    "smallest ring of prisms",
)
BALLOONS = (*CLOSED_BALLOONS, "tetrahedron without a face", "wide annulus", "grid")


def punch(mesh: Mesh, rng: Rng) -> Mesh:
    """Take out a hole of a few faces."""
    return meshes.punched(mesh, rng, 1, max_size=5)


def punch_threes(mesh: Mesh, rng: Rng) -> Mesh:
    """Take out single faces: boundary loops of length 3 wherever it is no bite."""
    return meshes.punched(mesh, rng, 3, max_size=1)


def insert(mesh: Mesh, rng: Rng) -> Mesh:
    """Stack vertices of valence 3, several deep."""
    return meshes.insert_degree_3(mesh, rng, int(rng.integers(1, 4)), int(rng.integers(1, 5)))


def flip(mesh: Mesh, rng: Rng) -> Mesh:
    """Flip edges until valences have gone astray."""
    return meshes.flipped_edges(mesh, rng, len(mesh[1]))


def inflate(mesh: Mesh, rng: Rng, balloons: tuple[str, ...] = BALLOONS) -> Mesh:
    """Put a balloon on a neck: one 3-cycle, or a tube of up to two prisms."""
    balloon = BASES[balloons[int(rng.integers(len(balloons)))]]()
    free = meshes.interior_faces(balloon[1])
    return meshes.connected_sum(
        mesh,
        balloon,
        face_a=int(rng.integers(len(mesh[1]))),
        face_b=int(rng.choice(free)) if len(free) else 0,
        prism_layers=int(rng.integers(3)),
    )


def inflate_closed(mesh: Mesh, rng: Rng) -> Mesh:
    """Put a balloon without holes on a neck."""
    return inflate(mesh, rng, CLOSED_BALLOONS)


def handle(mesh: Mesh, rng: Rng) -> Mesh:
    """Add a handle: its throat is one 3-cycle, or a tube of up to three prisms."""
    f, g = rng.choice(len(mesh[1]), 2, replace=False).tolist()
    layers, turn = int(rng.integers(4)), int(rng.integers(3))
    return meshes.add_handle(mesh, f, g, prism_layers=layers, turn=turn)


def bridge(mesh: Mesh, rng: Rng) -> Mesh:
    """Join two boundary edges by a strip."""
    first, second = rng.choice(meshes.boundary_edges(mesh[1]), 2, replace=False).tolist()
    return meshes.bridged(mesh, tuple(first), tuple(second))


OPERATIONS: dict[str, Callable[[Mesh, Rng], Mesh]] = {
    "insert": insert,
    "punch": punch,
    "punch threes": punch_threes,
    "flip": flip,
    "inflate": inflate,
    "inflate closed": inflate_closed,
    "handle": handle,
    "bridge": bridge,
}


# ---------------------------------------------------------------------------- recipes


@dataclass(frozen=True)
class Part:
    """A base by its name, and operations: name and seed."""

    base: str
    operations: tuple[tuple[str, int], ...] = ()

    def build(self) -> Mesh:
        """Apply the operations to the base."""
        mesh = BASES[self.base]()
        for name, seed in self.operations:
            mesh = attempted(OPERATIONS[name], mesh, seed)
        return mesh


@dataclass(frozen=True)
class Recipe:
    """Parts to put side by side, and a seed to shuffle and crumple the whole."""

    parts: tuple[Part, ...]
    seed: int = 0

    def build(self) -> Mesh:
        """Build the parts, leaving out what would be too many faces, and shuffle."""
        rng = np.random.default_rng(self.seed)
        built = [part.build() for part in self.parts]
        room = MAX_FACES - np.cumsum([len(faces) for _, faces in built])
        fitting = [mesh for mesh, left in zip(built, room, strict=True) if left >= 0]
        return meshes.shuffled(crumpled(meshes.disjoint_union(*fitting), rng), rng)


def attempted(
    operation: Callable[[Mesh, Rng], Mesh], mesh: Mesh, seed: int, tries: int = 4
) -> Mesh:
    """Return what an operation makes of a mesh, or the mesh when it does not apply."""
    rng = np.random.default_rng(seed)
    for _ in range(tries):
        try:
            result = operation(mesh, rng)
        except ValueError:
            continue
        return result if len(result[1]) <= MAX_FACES else mesh
    return mesh


def crumpled(mesh: Mesh, rng: Rng) -> Mesh:
    """Move every vertex by up to a fifth of the median edge length: lengths vary, nothing ties."""
    vertices, faces = mesh
    sides = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
    noise = rng.uniform(-1, 1, vertices.shape) / np.sqrt(3)
    return vertices + 0.2 * np.median(sides) * noise, faces


def adversarial_recipe(seed: int) -> Recipe:
    """Return the recipe of `adversarial_mesh`."""
    rng = np.random.default_rng(seed)
    names = list(BASES)
    parts = []
    for _ in range(int(rng.choice([1, 2, 3], p=[0.7, 0.2, 0.1]))):
        wanted = rng.choice(list(OPERATIONS), int(rng.integers(0, 6))).tolist()
        seeds = rng.integers(MAX_SEED, size=len(wanted)).tolist()
        base = names[int(rng.integers(len(names)))]
        parts.append(Part(base, tuple(zip(wanted, seeds, strict=True))))
    return Recipe(tuple(parts), int(rng.integers(MAX_SEED)))


def adversarial_mesh(seed: int) -> Mesh:
    """Return a surface made to be hard to simplify: same seed, same mesh.

    Parameters
    ----------
    seed : int
        Any nonnegative integer.

    Returns
    -------
    vertices : (n, 3) float64 array
    faces : (m, 3) int64 array
        A consistently oriented 2-manifold, with or without boundary, of up to `MAX_FACES` faces:
        several components, any genus, stacks of vertices of valence 3, necks and handles with
        triangular throats, holes that nearly touch.
    """
    return adversarial_recipe(seed).build()


# ---------------------------------------------------------------------------- strategies

seeds = st.integers(min_value=0, max_value=MAX_SEED - 1)


def recipes(
    *,
    bases: list[str] | None = None,
    operations: list[str] | None = None,
    max_parts: int = 3,
    max_operations: int = 6,
) -> st.SearchStrategy[Recipe]:
    """Return a strategy for recipes from some of the ingredients, by default all."""
    step = st.tuples(st.sampled_from(operations or list(OPERATIONS)), seeds)
    steps = st.lists(step, max_size=max_operations).map(tuple)
    part = st.builds(Part, base=st.sampled_from(bases or list(BASES)), operations=steps)
    parts = st.lists(part, min_size=1, max_size=max_parts).map(tuple)
    return st.builds(Recipe, parts=parts, seed=seeds)


def surfaces(**options) -> st.SearchStrategy[Mesh]:
    """Return a strategy for surfaces, with or without boundary. Options as for `recipes`."""
    return recipes(**options).map(Recipe.build)


def closed_surfaces(*, max_parts: int = 3, max_operations: int = 6) -> st.SearchStrategy[Mesh]:
    """Return a strategy for surfaces without boundary."""
    closed = [name for name, base in BASES.items() if not meshes.boundary_edges(base()[1])]
    return recipes(
        bases=closed,
        operations=["insert", "flip", "inflate closed", "handle"],
        max_parts=max_parts,
        max_operations=max_operations,
    ).map(Recipe.build)


@st.composite
def surfaces_with_an_edge(draw, **options) -> tuple[Mesh, tuple[int, int]]:
    """Draw a surface and one of its edges, as (mesh, (v, u)). Options as for `recipes`."""
    mesh = draw(surfaces(**options))
    directed = meshes.directed_edges(mesh[1])
    return mesh, draw(st.sampled_from(sorted(directed)))
