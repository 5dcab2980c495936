"""The meshes that are compared on: files, isosurfaces of volumes, models, arrays."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from tetsimplify.arrays import as_mesh
from tetsimplify.comparison.models import DEFAULT_VERTICES, MODELS, model
from tetsimplify.edges import edge_lengths
from tetsimplify.errors import FileError, MeshError, OptionError
from tetsimplify.io import is_mesh_file, is_volume_file, isosurface_of, read_mesh, read_volume
from tetsimplify.lattices import lattice_named
from tetsimplify.mesh import Mesh
from tetsimplify.repair import repair as repair_mesh
from tetsimplify.standard import as_result
from tetsimplify.topology import TopologyReport, topology

SUFFIXES = re.compile(r"(\.nii\.gz|\.[^.]+)$", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Input:
    """An oriented manifold that all methods get."""

    name: str
    kind: str
    """``"mesh"``, ``"volume"`` or ``"model"``."""
    mesh: Mesh = field(repr=False)
    topology: TopologyReport = field(repr=False)
    repairs: dict[str, int] | None = None
    """What was mended, None where nothing had to be."""
    volume: Mapping[str, Any] | None = field(default=None, repr=False)
    """What it was cut out of: `path`, `level`, `lattice`; None of meshes and models."""

    @cached_property
    def digest(self) -> str:
        """The same for the same arrays."""
        found = hashlib.sha256()
        for array in self.mesh:
            found.update(np.ascontiguousarray(array).data)
        return found.hexdigest()

    @cached_property
    def diagonal(self) -> float:
        """Of the box around the mesh."""
        return float(np.linalg.norm(np.ptp(self.mesh.vertices, axis=0)))

    @cached_property
    def median_edge(self) -> float:
        """The median edge length."""
        return float(np.median(edge_lengths(self.mesh)))

    @cached_property
    def n_regular_faces(self) -> int:
        """Faces of the regularised surface of the volume.

        Raises
        ------
        OptionError
            When there is no volume.
        """
        if self.volume is None:
            raise OptionError(
                f"{self.name} is no file of a volume, so there is no surface of it to regularise"
            )
        volume = read_volume(self.volume["path"])
        options = {"lattice": self.volume["lattice"], "regularise": True}
        return len(isosurface_of(volume, self.volume["level"], **options).faces)


def load(
    sources: Sequence[Any] | Mapping[str, Any],
    *,
    level: float | Sequence[float] | None = None,
    lattice: str = "kuhn",
    repair: bool = False,
) -> list[Input]:
    """Read, extract or make all inputs.

    Parameters
    ----------
    sources : sequence or mapping of names
        Files of meshes or volumes; models such as ``"torus"`` or ``"torus:20000"``; pairs of
        vertices and faces.
    level : float or sequence of floats, optional
        Of the volumes: one for all, or one for each in their order.
    lattice : str
        Of the volumes.
    repair : bool
        Make what is no oriented manifold one.

    Raises
    ------
    OptionError
        When there is no source, or the levels are not as many as the volumes.
    FileError, VolumeError, MeshError
        When something cannot be read, or is no oriented manifold and `repair` is False.
    """
    if not sources:
        raise OptionError("give at least one input")
    named = list(sources.items()) if isinstance(sources, Mapping) else _named(sources)
    levels = _levels(level, sum(_is_volume(source) for _, source in named))
    lattice_named(lattice)
    return [
        _as_manifold(name, *_mesh_of(source, levels, lattice), repair) for name, source in named
    ]


def _named(sources: Sequence[Any]) -> list[tuple[str, Any]]:
    """Sources with names of which none is there twice."""
    taken: set[str] = set()
    named = []
    for source in sources:
        plain = _name_of(source)
        name = next(n for k in count(1) if (n := plain if k == 1 else f"{plain}-{k}") not in taken)
        taken.add(name)
        named.append((name, source))
    return named


def _name_of(source: Any) -> str:
    if not isinstance(source, (str, os.PathLike)):
        return "mesh"
    return SUFFIXES.sub("", Path(source).name).replace(":", "-")


def _is_path(source: Any) -> bool:
    return isinstance(source, (str, os.PathLike))


def _is_volume(source: Any) -> bool:
    return _is_path(source) and is_volume_file(source)


def _levels(level: float | Sequence[float] | None, n_volumes: int) -> Iterator[float]:
    """A level for each volume."""
    if level is None:
        given: list[float] = []
    elif isinstance(level, Sequence):
        given = [float(one) for one in level]
    else:
        given = [float(level)]
    if len(given) == 1:
        given *= n_volumes
    if len(given) != n_volumes:
        raise OptionError(
            f"give one level for all volumes, or one for each of the {n_volumes}; got {len(given)}"
        )
    return iter(given)


def _mesh_of(
    source: Any, levels: Iterator[float], lattice: str
) -> tuple[str, Mesh, dict[str, Any] | None]:
    """What kind of input this is, the mesh, and the volume if there is one."""
    if not _is_path(source):
        try:
            vertices, faces = source
        except (TypeError, ValueError) as error:
            raise MeshError(
                "an input must be a file, the name of a model, or a pair of vertices and faces"
            ) from error
        return "mesh", as_mesh(vertices, faces), None
    if is_volume_file(source):
        level = next(levels)
        volume = {"path": os.path.abspath(source), "level": level, "lattice": lattice}
        return "volume", isosurface_of(read_volume(source), level, lattice=lattice), volume
    if is_mesh_file(source):
        return "mesh", read_mesh(source), None
    name, _, number = str(source).partition(":")
    if name not in MODELS:
        raise FileError(
            f"{source} is neither a file of a known suffix nor a model; models are "
            f"{', '.join(MODELS)}, also with a number of vertices, such as torus:20000"
        )
    if number and not number.isdecimal():
        raise OptionError(f"{source}: the number of vertices must be a positive integer")
    return "model", model(name, int(number) if number else DEFAULT_VERTICES), None


def _as_manifold(
    name: str, kind: str, mesh: Mesh, volume: dict[str, Any] | None, repair: bool
) -> Input:
    """Repair what needs it, and check."""
    mesh = as_result(*mesh)
    if not len(mesh.faces):
        raise MeshError(f"{name} has no faces")
    found = topology(*mesh)
    repairs = None
    if not found.is_manifold and repair:
        repaired = repair_mesh(*mesh)
        repairs = asdict(repaired.report)
        mesh = as_result(repaired.vertices, repaired.faces)
        found = topology(*mesh)
    if (defects := found.defects()) is not None:
        raise MeshError(f"{name} is no oriented manifold, repair it first: {defects}")
    return Input(name, kind, mesh, found, repairs, volume)
