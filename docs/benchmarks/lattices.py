"""Measure how near isosurfaces come to surfaces that are known, for each lattice.

    python docs/benchmarks/lattices.py --markdown lattices.md

A sphere, a torus and a gyroid are sampled with twice as many cubes from size to size. Their area
and volume are compared with the true ones, and the distance to them is measured both ways: to a
reference that is made of the bcc lattice at the double of the largest size, with its vertices
moved onto the surface. The order is the binary logarithm of how many times smaller the error is at
the last size than at the one before.

Surfaces are timed on one core and thread, the best of some runs.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from common import Row, as_markdown, as_rich, machine, one_core, timed
from numpy.typing import NDArray
from rich.console import Console

import tetsimplify
from tetsimplify import Mesh
from tetsimplify.lattices import LATTICES

Array = NDArray[np.float64]
SIZES = (16, 32, 64)  # cubes along each axis
RUNS = 5
WAYS = [*((name, {"lattice": name}) for name in LATTICES)]
WAYS += [("bcc, regularise", {"lattice": "bcc", "regularise": True})]


@dataclass(frozen=True)
class Shape:
    """A surface: where a function is zero, positive inside."""

    name: str
    function: Callable[[Array, Array, Array], Array]
    half_width: float
    volume: float
    area: float | None = None


def sphere(x: Array, y: Array, z: Array) -> Array:
    """Not the distance, so that the function is not linear across the surface."""
    return 0.8**2 - x**2 - y**2 - z**2


def torus(x: Array, y: Array, z: Array) -> Array:
    """Radius 0.6 and 0.25."""
    return 0.25**2 - (np.hypot(x, y) - 0.6) ** 2 - z**2


def gyroid(x: Array, y: Array, z: Array) -> Array:
    """One period, odd in all coordinates together."""
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


SHAPES = (
    Shape("sphere", sphere, 1.003, 4 / 3 * np.pi * 0.8**3, 4 * np.pi * 0.8**2),
    Shape("torus", torus, 1.003, 2 * np.pi**2 * 0.6 * 0.25**2, 4 * np.pi**2 * 0.6 * 0.25),
    Shape("gyroid", gyroid, np.pi, 4 * np.pi**3),
)


def cut(shape: Shape, n_cubes: int, **options: Any) -> Mesh:
    """The surface from a volume of so many cubes along each axis."""
    bounds = [(-shape.half_width, shape.half_width)] * 3
    return tetsimplify.extract_isosurface(
        shape.function, 0.0, bounds=bounds, shape=n_cubes + 1, threads=1, **options
    )


def moved_onto(mesh: Mesh, function: Callable[..., Array]) -> Mesh:
    """The mesh with its vertices on the surface, by Newton's method along the gradient."""
    points = mesh.vertices.copy()
    step = 1e-5
    for _ in range(4):
        x = points.T
        slopes = [
            (function(*(x + step * axis)) - function(*(x - step * axis))) / (2 * step)
            for axis in np.eye(3)[:, :, None]
        ]
        gradient = np.stack(slopes, axis=1)
        points -= (function(*x) / (gradient**2).sum(axis=1))[:, None] * gradient
    return Mesh(points, mesh.faces)


def area_of(mesh: Mesh) -> float:
    """Sum of the areas of all faces."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def volume_of(mesh: Mesh) -> float:
    """What a closed surface encloses."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def true_area(shape: Shape, reference: Mesh, coarser: Mesh) -> float:
    """The area that is known, or else extrapolated from two references."""
    if shape.area is not None:
        return shape.area
    return (4 * area_of(reference) - area_of(coarser)) / 3


def errors(shape: Shape, n_cubes: int, area: float, reference: Mesh, **options: Any) -> Array:
    """Of area and volume, relative; mean and largest distance, in cubes."""
    mesh = cut(shape, n_cubes, **options)
    width = 2 * shape.half_width / n_cubes
    distance = tetsimplify.surface_distance(mesh, reference, tolerance=1e-3 * width)
    sides = distance.a_to_b, distance.b_to_a
    return np.array(
        [
            abs(area_of(mesh) / area - 1),
            abs(volume_of(cut(shape, n_cubes, closed=True, **options)) / shape.volume - 1),
            max(side.mean for side in sides) / width,
            distance.upper / width,
        ]
    )


def seconds_of(shape: Shape, n_cubes: int, **options: Any) -> float:
    """Processor time of the extraction alone, from samples in memory."""
    x = np.linspace(-shape.half_width, shape.half_width, n_cubes + 1)
    volume = shape.function(x[:, None, None], x[None, :, None], x[None, None, :])
    runs = [
        timed(lambda: tetsimplify.extract_isosurface(volume, 0.0, threads=1, **options))
        for _ in range(RUNS)
    ]
    return min(times["cpu"] for times, _ in runs)


def rows_of(shape: Shape, sizes: list[int]) -> list[Row]:
    """One row for each lattice."""
    coarser, reference = (
        moved_onto(cut(shape, factor * sizes[-1], lattice="bcc"), shape.function)
        for factor in (1, 2)
    )
    area = true_area(shape, reference, coarser)
    rows = []
    for name, options in WAYS:
        found = [errors(shape, n, area, reference, **options) for n in sizes[-2:]]
        orders = np.log2(found[0] / found[1])
        orders[2:] += 1  # distances are in cubes, and these are half as wide
        last = found[1]
        rows.append(
            {
                "surface": shape.name,
                "lattice": name,
                "faces": f"{len(cut(shape, sizes[-1], **options).faces):,}",
                "ms": f"{1000 * seconds_of(shape, sizes[-1], **options):.1f}",
                "area": f"{100 * last[0]:.3f} % ({orders[0]:.1f})",
                "volume": f"{100 * last[1]:.3f} % ({orders[1]:.1f})",
                "mean distance": f"{last[2]:.4f} ({orders[2]:.1f})",
                "largest distance": f"{last[3]:.4f} ({orders[3]:.1f})",
            }
        )
    return rows


def main() -> None:
    """Print the table; write it too if asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=list(SIZES), help="cubes a side")
    parser.add_argument("--markdown", type=Path, help="a file for the table")
    options = parser.parse_args()
    console = Console(width=170)
    with one_core():
        rows = [row for shape in SHAPES for row in rows_of(shape, options.sizes)]
    title = f"Errors at {options.sizes[-1]} cubes a side (observed order)"
    console.print(as_rich(title, rows))
    console.print(machine())
    if options.markdown:
        options.markdown.write_text(as_markdown(title, rows))


if __name__ == "__main__":
    main()
