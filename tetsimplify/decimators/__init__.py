"""Decimators that people use, one short file for each package, all of the same shape.

Importing this loads none of the packages. To add one: write such a file, and name it here.
"""

from tetsimplify.decimators import (
    cgal,
    fast_quadric,
    libigl,
    meshlib,
    meshoptimizer,
    open3d,
    own,
    pymeshlab,
    regularised,
    vtk,
)
from tetsimplify.decimators.method import FACES, LENGTH, VOLUME, Goal, Method

METHODS = {
    method.name: method
    for module in (
        own,
        regularised,
        meshoptimizer,
        fast_quadric,
        meshlib,
        libigl,
        open3d,
        vtk,
        pymeshlab,
        cgal,
    )
    for method in module.METHODS
}
"""All methods by their names, in the order of tables: our own come first."""

__all__ = ["FACES", "LENGTH", "METHODS", "VOLUME", "Goal", "Method"]
