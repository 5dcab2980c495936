"""Pictures of meshes, drawn without a graphics card, a screen or OpenGL."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.mesh import Mesh

Floats = NDArray[np.float64]
Size = tuple[int, ...]

SAMPLES = 3  # across a pixel in each direction, against jagged outlines
CLAY = (0.93, 0.80, 0.72)
INK = (0.16, 0.20, 0.30)

# Directions to the lights as seen by the eye (right, up, towards the eye), and how bright.
LIGHTS = (((-0.45, 0.65, 0.62), 0.80), ((0.75, 0.10, 0.50), 0.22), ((0.0, -0.7, 0.3), 0.10))
AMBIENT = 0.16
GLOSS = 0.18
SEARCH_RADIUS = 5.0  # pixels
HOLLOW_DARKNESS = 0.52


@dataclass(frozen=True)
class View:
    """A parallel projection.

    Attributes
    ----------
    centre : three floats
        What is in the middle of the picture.
    towards_eye, up : three floats
        Directions.
    width : float
        Of the picture, in the units of the mesh.
    """

    centre: tuple[float, float, float]
    towards_eye: tuple[float, float, float]
    up: tuple[float, float, float]
    width: float

    def axes(self) -> Floats:
        """The directions right, up and towards the eye as rows of a matrix."""
        eye = np.array(self.towards_eye) / np.linalg.norm(self.towards_eye)
        right = np.cross(self.up, eye)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(eye, right), eye])

    def pixels(self, points: Floats, size: Size) -> Floats:
        """Column, row and depth of points, in pixels."""
        n_columns, n_rows = size
        seen = (points - self.centre) @ self.axes().T * (n_columns / self.width)
        return seen * [1, -1, -1] + [(n_columns - 1) / 2, (n_rows - 1) / 2, 0]

    def moved_to(self, centre: Floats, width: float) -> View:
        """The same directions, but of another place and of another size."""
        x, y, z = centre.tolist()
        return replace(self, centre=(x, y, z), width=width)


def draw(mesh: Mesh, view: View, size: Size, *, edge_width: float = 0.0) -> NDArray[np.float32]:
    """Draw a mesh in clay, with or without its edges.

    Parameters
    ----------
    mesh : Mesh
        Its normals are smoothed over the surface.
    view : View
        Where from.
    size : two ints
        Columns and rows of the picture in pixels.
    edge_width : float
        Of the lines along edges, in pixels; 0 for none.

    Returns
    -------
    ndarray, shape (rows, columns, 4), float32
        Red, green, blue and opacity from 0 to 1, the colours multiplied by the opacity.
    """
    columns, rows = (n * SAMPLES for n in size)
    points = view.pixels(mesh.vertices, (columns, rows))
    depth = np.full((rows, columns), np.inf)
    face_at = np.full((rows, columns), -1, np.int32)
    weight_at = np.zeros((rows, columns, 2), np.float32)
    kernels.raster.draw_triangles(points, mesh.faces, depth, face_at, weight_at)

    seen = face_at >= 0
    faces = face_at[seen]
    weights = weight_at[seen]
    weights = np.column_stack([weights, 1 - weights.sum(axis=1)])
    brightness = _brightness(_vertex_normals(mesh) @ view.axes().T).astype(np.float32)
    light = np.zeros(depth.shape, np.float32)
    light[seen] = np.einsum("pk,pk->p", weights, brightness[mesh.faces[faces]])
    lines = np.zeros(depth.shape, np.float32)
    if edge_width:
        lines[seen] = _edge_coverage(points, mesh.faces, faces, weights, edge_width * SAMPLES)
        light *= 1 - lines

    light, lines, opacity = (_reduced(layer) for layer in (light, lines, seen))
    light *= 1 - HOLLOW_DARKNESS * _hollowness(_reduced_depth(depth))
    colours = light[..., None] * np.array(CLAY) + lines[..., None] * np.array(INK)
    return np.dstack([np.clip(colours, 0, 1), opacity]).astype(np.float32)


def point_seen_at(mesh: Mesh, view: View, size: Size, place: tuple[float, float]) -> Floats:
    """The vertex that is seen at some place in a picture.

    Parameters
    ----------
    mesh, view, size
        See :func:`draw`.
    place : two floats
        In parts of the width and the height, from the left upper corner.

    Returns
    -------
    ndarray, shape (3,), float64
        Of the vertices near that place the one nearest to the eye.
    """
    points = view.pixels(mesh.vertices, size)
    distance = np.linalg.norm(points[:, :2] - np.multiply(place, size), axis=1)
    near = np.flatnonzero(distance <= max(distance.min(), SEARCH_RADIUS))
    return mesh.vertices[near[np.argmin(points[near, 2])]]


def _reduced(layer: NDArray[Any]) -> NDArray[np.float32]:
    """From samples to pixels."""
    rows, columns = layer.shape
    blocks = layer.reshape(rows // SAMPLES, SAMPLES, columns // SAMPLES, SAMPLES)
    return blocks.mean(axis=(1, 3), dtype=np.float32)


def _reduced_depth(depth: Floats) -> Floats:
    """Depth at the middle of each pixel, in pixels."""
    return depth[SAMPLES // 2 :: SAMPLES, SAMPLES // 2 :: SAMPLES] / SAMPLES


def _unit(vectors: Floats) -> Floats:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


def _vertex_normals(mesh: Mesh) -> Floats:
    """Normals of the faces around each vertex, weighted by their areas."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    of_faces = np.cross(b - a, c - a)
    corners = mesh.faces.reshape(-1)
    n = len(mesh.vertices)
    sums = [np.bincount(corners, np.repeat(of_faces[:, x], 3), n) for x in range(3)]
    return _unit(np.column_stack(sums))


def _brightness(normals: Floats) -> Floats:
    """Brightness of surfaces with some normals, as seen by the eye."""
    brightness = np.full(len(normals), AMBIENT)
    for direction, strength in LIGHTS:
        towards = _unit(np.array(direction))
        # Half wrapped around the surface, as light in a room is.
        brightness += strength * np.clip((normals @ towards + 0.25) / 1.25, 0, None)
        halfway = _unit(towards + np.array([0.0, 0.0, 1.0]))
        brightness += GLOSS * strength * np.clip(normals @ halfway, 0, None) ** 40
    return brightness


def _hollowness(depth: Floats) -> Floats:
    """How much deeper each pixel lies than what is around it, from 0 to 1.

    Depth minus its own blur darkens the hollows (Luft, Colditz and Deussen, Image
    enhancement by unsharp masking the depth buffer, 2006).
    """
    seen = np.isfinite(depth)
    depth = np.where(seen, depth, 0.0)
    hollow = np.zeros(depth.shape)
    for part, share in ((90, 0.40), (35, 0.40), (14, 0.20)):
        radius = max(len(depth) // part, 1)
        around = _blurred(depth, radius) / np.maximum(_blurred(seen * 1.0, radius), 1e-9)
        hollow += share * np.clip((depth - around) / (0.7 * radius), 0, 1)
    return np.where(seen, hollow, 0.0)


def _blurred(image: Floats, radius: int) -> Floats:
    """Mean over squares, twice, which is nearly a mean over discs."""
    width = 2 * radius + 1
    for _ in range(2):
        for axis in (0, 1):
            margins = [(0, 0), (0, 0)]
            margins[axis] = (radius + 1, radius)
            sums = np.cumsum(np.pad(image, margins), axis=axis)
            upper = np.take(sums, range(width, sums.shape[axis]), axis=axis)
            image = (upper - np.take(sums, range(image.shape[axis]), axis=axis)) / width
    return image


def _edge_coverage(
    points: Floats,
    mesh_faces: NDArray[np.int32],
    faces: NDArray[np.int32],
    weights: NDArray[np.float32],
    width: float,
) -> NDArray[np.float32]:
    """How much of a line of some width along the edges covers each sample, from 0 to 1."""
    a, b, c = (points[mesh_faces[:, k], :2] for k in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    opposite = np.stack([np.linalg.norm(e, axis=1) for e in (c - b, a - c, b - a)], axis=1)
    heights = np.abs(ux * vy - uy * vx)[:, None] / np.maximum(opposite, 1e-9)
    distance = (weights * heights.astype(np.float32)[faces]).min(axis=1)
    return np.clip(0.5 * width + 0.5 - distance, 0, 1)
