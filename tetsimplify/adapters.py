"""Mesh objects of other packages: the adapters installed, and how one is found.

An adapter is an entry point of the group ``tetsimplify.adapters``. Its name is the top-level
package that defines the mesh classes, its value an :class:`Adapter`:

.. code-block:: toml

    [project.entry-points."tetsimplify.adapters"]
    trimesh = "tetsimplify.plugins.trimesh:ADAPTER"

An object is matched by the packages that its class and its base classes come from, so no
package is imported to find out that an object is not its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, NamedTuple

from numpy.typing import NDArray

from tetsimplify.errors import MeshError, MissingExtraError, OptionError

if TYPE_CHECKING:
    from tetsimplify.topology import TopologyReport

GROUP = "tetsimplify.adapters"


class UnknownMeshTypeError(MeshError, TypeError):
    """No installed adapter knows the object given as a mesh."""


class MeshArrays(NamedTuple):
    """A mesh object as arrays: what ``from_...`` of an adapter returns and ``to_...`` takes."""

    vertices: NDArray[Any]
    """Shape (n, 3)."""
    faces: NDArray[Any]
    """Shape (m, 3)."""
    vertex_data: dict[str, NDArray[Any]]
    """Shapes (n, ...)."""
    face_data: dict[str, NDArray[Any]]
    """Shapes (m, ...)."""


@dataclass(frozen=True)
class Adapter:
    """What an entry point of the group ``tetsimplify.adapters`` names."""

    name: str
    """The package whose objects it takes, as users know it."""
    simplify: Callable[..., Any]
    """``simplify(mesh, **options)``: an object of the same kind. The options are those of
    :func:`tetsimplify.simplify`, without `vertex_data` and `face_data`."""
    topology: Callable[[Any], TopologyReport]
    """``topology(mesh)``."""


def names() -> list[str]:
    """The packages that adapters are installed for; none of them is imported.

    Examples
    --------
    >>> import tetsimplify.adapters
    >>> "trimesh" in tetsimplify.adapters.names()
    True
    """
    return sorted(_installed())


def find(mesh: Any) -> Adapter:
    """Find the adapter for an object.

    Raises
    ------
    UnknownMeshTypeError
        When no installed adapter knows objects of this class.
    MissingExtraError
        When the adapter cannot be imported because a package is missing.
    """
    for base in type(mesh).__mro__:
        package = base.__module__.partition(".")[0]
        if package in _installed():
            adapter: Adapter = _installed()[package].load()
            return adapter
    kind = f"{type(mesh).__module__}.{type(mesh).__qualname__}"
    raise UnknownMeshTypeError(
        f"give vertices and faces, or one object of {', '.join(names()) or 'an adapter'}; "
        f"got one {kind.removeprefix('builtins.')} and no faces"
    )


def simplify(
    mesh: Any, *, vertex_data: object = None, face_data: object = None, **options: Any
) -> Any:
    """Simplify an object that an adapter knows; see :func:`tetsimplify.simplify`."""
    adapter = find(mesh)
    if vertex_data is not None or face_data is not None:
        raise OptionError(
            "vertex_data and face_data go with vertices and faces; "
            f"an object of {adapter.name} carries its own"
        )
    return adapter.simplify(mesh, **options)


def topology(mesh: Any) -> TopologyReport:
    """Tell the topology of an object that an adapter knows."""
    return find(mesh).topology(mesh)


@contextmanager
def needs(package: str, extra: str | None = None) -> Iterator[None]:
    """Import a package of an adapter; when it is missing, the error names the extra.

    Parameters
    ----------
    package : str
        The package to be imported in the block.
    extra : str, optional
        The extra of tetsimplify that installs it, where it has another name.

    Examples
    --------
    >>> from tetsimplify.adapters import needs
    >>> with needs("numpy"):
    ...     import numpy
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        name = extra or package
        raise MissingExtraError(f"tetsimplify.plugins.{name}", package, name) from error


@cache
def _installed() -> dict[str, EntryPoint]:
    """The entry points by their names."""
    return {entry.name: entry for entry in entry_points(group=GROUP)}
