"""Open3D: decimation of legacy meshes by quadric error."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from tetsimplify.decimators.method import Goal, Method
from tetsimplify.mesh import Mesh


def import_open3d() -> Any:
    """Import it, with the libusb of a package where the system has none."""
    try:
        import open3d
    except ImportError as error:
        if "libusb" not in str(error):
            raise
        import libusb_package

        ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
        import open3d
    return open3d


def prepare(mesh: Mesh, goal: Goal) -> Any:
    """A mesh of its own."""
    open3d = import_open3d()
    return open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(mesh.vertices), open3d.utility.Vector3iVector(mesh.faces)
    )


def run(mesh: Any, goal: Goal) -> Any:
    """With its defaults."""
    return mesh.simplify_quadric_decimation(
        target_number_of_triangles=goal.target_faces, maximum_error=np.inf, boundary_weight=1.0
    )


METHODS = (
    Method(
        "open3d",
        "Open3D, quadric",
        ("open3d",),
        "MIT",
        run,
        prepare,
        lambda mesh: (np.asarray(mesh.vertices), np.asarray(mesh.triangles)),
    ),
)
