"""VTK: its filters for decimation, through PyVista."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tetsimplify.decimators.method import Goal, Method
from tetsimplify.mesh import Mesh


def prepare(mesh: Mesh, goal: Goal) -> Any:
    """Points stay double."""
    import pyvista

    faces: Any = mesh.faces
    return pyvista.PolyData.from_regular_faces(mesh.vertices, faces)


def decimation(name: str, **options: Any) -> Callable[[Any, Goal], Any]:
    """One of the filters, which are told what part to remove."""

    def run(surface: Any, goal: Goal) -> Any:
        assert goal.target_faces is not None
        return getattr(surface, name)(1.0 - goal.target_faces / surface.n_cells, **options)

    return run


def method(
    name: str, title: str, filter_name: str, *, precision: str = "float64", **options: Any
) -> Method:
    """One filter with its options."""
    return Method(
        name,
        title,
        ("pyvista", "vtk"),
        "MIT, BSD-3-Clause",
        decimation(filter_name, **options),
        prepare,
        lambda surface: (surface.points, surface.regular_faces),
        precision=precision,
    )


METHODS = (
    method(
        "vtk-quadric", "VTK, quadric", "decimate", precision="float32", volume_preservation=False
    ),
    method("vtk-pro", "VTK, DecimatePro", "decimate_pro", preserve_topology=False),
    method(
        "vtk-pro-topology",
        "VTK, DecimatePro, preserve_topology",
        "decimate_pro",
        preserve_topology=True,
    ),
)
