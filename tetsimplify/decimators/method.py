"""What a decimator is here: how it is asked, how it is run, where it comes from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version
from typing import Any

from tetsimplify.mesh import Mesh

FACES = "faces"
LENGTH = "length"
VOLUME = "volume"


@dataclass(frozen=True)
class Goal:
    """How far a mesh is to be simplified: one of the first two is given."""

    target_faces: int | None = None
    max_edge_length: float | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    """Further options of :func:`tetsimplify.simplify`, for the methods that are its own."""
    volume: Mapping[str, Any] | None = None
    """What the mesh is cut out of, for methods that start there: `path`, `level`, `lattice`."""

    @property
    def kind(self) -> str:
        """``"faces"``, ``"length"`` or ``"volume"``."""
        if self.volume is not None:
            return VOLUME
        return FACES if self.max_edge_length is None else LENGTH


@dataclass(frozen=True)
class Method:
    """A decimator.

    ``prepare(mesh, goal)`` makes what ``run(prepared, goal)`` takes, which may destroy it, and
    ``finish`` makes vertices and faces of what that returns. Only `run` counts as its time.
    Packages are imported inside these functions.
    """

    name: str
    title: str
    packages: tuple[str, ...]
    """On PyPI; the first is the one whose version is told."""
    licence: str
    run: Callable[[Any, Goal], Any]
    prepare: Callable[[Mesh, Goal], Any] = lambda mesh, goal: mesh
    finish: Callable[[Any], tuple[Any, Any]] = lambda result: result
    takes: tuple[str, ...] = (FACES,)
    """What it can be asked for: a number of faces, an edge length; or a surface of a volume."""
    precision: str = "float64"
    """Of the coordinates that it takes or gives, whichever is less."""
    meets_count: bool = True
    """Whether it goes by the number of faces itself, or by a length that should give it."""
    is_own: bool = False
    """Whether it is a mode of tetsimplify, and takes the options of that."""
    module: str = "tetsimplify.decimators"
    """Where other processes find it: a module with a dictionary METHODS, by names."""

    @property
    def version(self) -> str | None:
        """The version that is installed, None where a package is missing."""
        versions = [version_of(package) for package in self.packages]
        return None if None in versions else versions[0]

    @property
    def install(self) -> str:
        """The command that installs what it needs."""
        return f"pip install {' '.join(self.packages)}"


def version_of(package: str) -> str | None:
    """The version of an installed package, found without importing it; None of others."""
    try:
        return installed_version(package)
    except PackageNotFoundError:
        return None
