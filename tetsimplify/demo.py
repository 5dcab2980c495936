"""The main job on a real volume: the brain of an average MRI, which is part of the package."""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

from tetsimplify.io import Volume, isosurface_of, read_volume
from tetsimplify.mesh import Mesh
from tetsimplify.picture import Lens, Side, save_side_by_side
from tetsimplify.render import View

if TYPE_CHECKING:
    from tetsimplify.report import Simplification

Progress = Callable[[str, float], object]

VOLUME = "mni152_mri.npz"
LEVEL = 80.5
MEDIAN_EDGES = 1.2

FROM_THE_LEFT = View((98.0, 122.0, 74.0), (-1.0, 0.42, 0.22), (0.0, 0.0, 1.0), 212.0)
FRONTAL_LOBE = Lens((0.42, 0.47), 13.0)


def brain_volume() -> Volume:
    """The average brain in mm: x from left to right, y from back to front, z upwards."""
    with as_file(files("tetsimplify") / "data" / VOLUME) as path:
        return read_volume(path, axes="zyx")


def extract_brain(progress: Progress | None = None) -> Mesh:
    """Extract the surface of the average brain, in mm."""
    return isosurface_of(brain_volume(), LEVEL, progress=progress)


def save_picture(path: str | os.PathLike[str], before: Mesh, result: Simplification) -> None:
    """Draw the brain before and after, each with a lens that shows its edges.

    Raises
    ------
    FileError
        When the file cannot be written.
    MissingExtraError
        When matplotlib is not installed.
    """
    after = Mesh(result.vertices, result.faces)
    report = result.report
    left, right = (
        Side(mesh, title, _caption(mesh, topology.euler_characteristic))
        for mesh, title, topology in (
            (before, "Marching tetrahedra", report.topology_before),
            (after, "Short edges contracted", report.topology_after),
        )
    )
    save_side_by_side(path, (left, right), FROM_THE_LEFT, FRONTAL_LOBE)


def _caption(mesh: Mesh, euler_characteristic: int) -> str:
    text = f"{len(mesh.faces):,} triangles, Euler characteristic {euler_characteristic}"
    return text.replace("-", "\N{MINUS SIGN}")
