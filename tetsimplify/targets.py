"""Surfaces made ready for distances to be measured to them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.crew import Crew
from tetsimplify.mesh import Mesh

Points = NDArray[np.float64]


class Frame(NamedTuple):
    """Coordinates in which meshes lie around the origin and have a size of about one.

    There rounding errors are of the size of those of the input, wherever the meshes are, and
    there is one size below which all is rounding.
    """

    origin: Points
    scale: float
    """A power of two: it changes no digits."""
    diagonal: float
    """Of the box around the meshes, in their own units."""

    @classmethod
    def around(cls, *meshes: Mesh) -> Frame:
        """The frame of the faces of some meshes. Vertices that no face uses do not count."""
        corners = []
        for vertices, faces in meshes:
            is_used = np.zeros(len(vertices), np.bool_)
            is_used[faces] = True
            used = vertices if is_used.all() else vertices[is_used]
            corners += [used.min(axis=0), used.max(axis=0)]
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        exponent = math.frexp((high - low).max())[1]
        return cls(low + 0.5 * (high - low), 2.0**-exponent, float(np.linalg.norm(high - low)))

    def enter(self, points: Points) -> Points:
        """Points in this frame."""
        return (points - self.origin) * self.scale

    def leave(self, points: Points) -> Points:
        """Points of this frame as they are in the meshes."""
        return points / self.scale + self.origin


class Target:
    """A surface that distances can be measured to.

    Making one takes much longer than asking a few times, so keep it.

    Parameters
    ----------
    mesh : Mesh
        Checked arrays, with one face at least.
    frame : Frame, optional
        That of the mesh if not given.
    crew : Crew, optional
        Threads to make it with; one if not given.

    Attributes
    ----------
    frame : Frame
    arrays : kernels.nearest.Target
        What the kernels work on, in the coordinates of the frame.
    """

    def __init__(self, mesh: Mesh, frame: Frame | None = None, crew: Crew | None = None) -> None:
        self.frame = frame or Frame.around(mesh)
        vertices = self.frame.enter(mesh.vertices)

        def tree() -> Any:
            return kernels.bvh.build(vertices, mesh.faces)

        def is_open() -> Any:
            corner_vertex = mesh.faces.reshape(-1)
            first, following, _ = kernels.corners.link_corners(corner_vertex, len(vertices))
            return kernels.cover.open_faces(corner_vertex, first, following)

        tasks = tree, is_open
        made = (crew or Crew(1)).share(lambda part: tasks[part.start](), len(tasks), 1)
        self.arrays = kernels.nearest.Target(vertices, mesh.faces, *made)
