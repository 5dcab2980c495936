"""CGAL: isotropic remeshing, through its official bindings."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from tetsimplify.decimators.length import length_for
from tetsimplify.decimators.method import Goal, Method
from tetsimplify.io import read_mesh, write_mesh
from tetsimplify.mesh import Mesh

ITERATIONS = 10


def prepare(mesh: Mesh, goal: Goal) -> Any:
    """A polyhedron, its facets, and the edge length that should give the number of faces."""
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mesh.off")
        write_mesh(path, mesh)
        polyhedron = Polyhedron_3(str(path))
    return polyhedron, list(polyhedron.facets()), length_for(mesh, goal)


def run(prepared: Any, goal: Goal) -> Any:
    """Without edges that are held."""
    from CGAL import CGAL_Polygon_mesh_processing

    polyhedron, facets, length = prepared
    CGAL_Polygon_mesh_processing.isotropic_remeshing(
        facets, length, polyhedron, ITERATIONS, [], False
    )
    return polyhedron


def finish(polyhedron: Any) -> tuple[Any, Any]:
    """By way of a file, in text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "mesh.off")
        polyhedron.write_to_file(str(path))
        mesh = read_mesh(path)
    return mesh.vertices, mesh.faces


METHODS = (
    Method(
        "cgal-remeshing",
        "CGAL, isotropic remeshing",
        ("cgal",),
        "GPL-3.0-or-later",
        run,
        prepare,
        finish,
        meets_count=False,
    ),
)
