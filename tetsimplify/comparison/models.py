"""Analytic models by name, cut out of their volumes by marching tetrahedra."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import OptionError
from tetsimplify.isosurface import extract_isosurface
from tetsimplify.mesh import Mesh

Samples = NDArray[np.float64]

DEFAULT_VERTICES = 50_000
SMALLEST_GRID, LARGEST_GRID = 8, 2000
FIRST_GRID = 48
NEAR = 2  # samples a side: how far the guess from the first grid may be off


class Model(NamedTuple):
    """A surface where a function is 0, positive inside, in the cube of this half width."""

    title: str
    field: Callable[[Any, Any, Any], Samples]
    half_width: float


def torus(x: Any, y: Any, z: Any) -> Samples:
    """Radii 1 and 0.4."""
    return np.asarray(0.4 - np.hypot(np.hypot(x, y) - 1, z))


def sphere(x: Any, y: Any, z: Any) -> Samples:
    """Radius 1."""
    return np.asarray(1 - x**2 - y**2 - z**2)


def hyperboloid(x: Any, y: Any, z: Any) -> Samples:
    """Two sheets, solid in the two cups."""
    return np.asarray(z**2 - x**2 - y**2 - 1)


def gyroid(x: Any, y: Any, z: Any) -> Samples:
    """Odd phases, so that no sample lies on the surface."""
    x, y, z = x + 0.1, y + 0.2, z + 0.3
    return np.asarray(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x))


def tangle(x: Any, y: Any, z: Any) -> Samples:
    """A cube of eight balls that are joined along its edges."""
    return np.asarray(sum(5 * t**2 - t**4 for t in (x, y, z)) - 11.8)


MODELS = {
    "sphere": Model("sphere", sphere, 1.2),
    "torus": Model("torus of radii 1 and 0.4", torus, 1.7),
    "hyperboloid": Model("hyperboloid of two sheets z^2 = 1 + x^2 + y^2", hyperboloid, 2.0),
    "gyroid": Model("gyroid, two periods a side", gyroid, 2 * np.pi),
    "tangle": Model("tangle cube, genus 5", tangle, 3.0),
}


def model(name: str, n_vertices: int = DEFAULT_VERTICES) -> Mesh:
    """Extract a model with about so many vertices.

    Parameters
    ----------
    name : str
        One of :data:`MODELS`.
    n_vertices : int
        The grid is the one that comes nearest to it.

    Returns
    -------
    Mesh

    Raises
    ------
    OptionError
        When there is no such model, or the number is too small or too large for one.

    Examples
    --------
    >>> from tetsimplify.comparison.models import model
    >>> len(model("torus", 16_772).vertices)
    16788
    """
    if name not in MODELS:
        raise OptionError(f"there is no model {name!r}; there are {', '.join(MODELS)}")
    is_count = isinstance(n_vertices, (int, np.integer)) and not isinstance(n_vertices, bool)
    if not is_count or n_vertices < 1:
        raise OptionError(f"the number of vertices must be a positive integer, got {n_vertices!r}")

    def error(n_samples: int) -> int:
        return abs(len(on_grid(name, n_samples).vertices) - n_vertices)

    first = on_grid(name, FIRST_GRID)
    guess = round(FIRST_GRID * (n_vertices / len(first.vertices)) ** 0.5)
    if not SMALLEST_GRID < guess < LARGEST_GRID:
        raise OptionError(f"{n_vertices:,} vertices are too few or too many for a {name}")
    return on_grid(name, min(range(guess - NEAR, guess + NEAR + 1), key=error))


def on_grid(name: str, n_samples: int) -> Mesh:
    """Extract a model from so many samples a side."""
    spacing, width = spacing_of(name, n_samples), MODELS[name].half_width
    volume = samples_of(name, n_samples)
    return extract_isosurface(volume, 0.0, spacing=(spacing,) * 3, origin=(-width,) * 3)


def samples_of(name: str, n_samples: int) -> Samples:
    """The volume that a model is cut out of."""
    axis = np.linspace(-MODELS[name].half_width, MODELS[name].half_width, n_samples)
    return MODELS[name].field(*np.meshgrid(axis, axis, axis, indexing="ij", sparse=True))


def spacing_of(name: str, n_samples: int) -> float:
    """The distance between samples, of which there are so many a side."""
    return 2 * MODELS[name].half_width / (n_samples - 1)
