"""What `simplify` is asked to do on the command line, before the mesh is known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from tetsimplify.cli.values import (
    parse_length,
    parse_or_off,
    parse_ratio,
    parse_removal_limit,
)
from tetsimplify.edges import edge_lengths
from tetsimplify.errors import OptionError
from tetsimplify.mesh import Mesh


def median_edge(mesh: Mesh) -> float:
    """The median edge length."""
    lengths = edge_lengths(mesh)
    return float(np.median(lengths)) if len(lengths) else 0.0


def diagonal(mesh: Mesh) -> float:
    """The diagonal of the bounding box of the faces."""
    corners = mesh.vertices[mesh.faces.reshape(-1)]
    return float(np.linalg.norm(np.ptp(corners, axis=0))) if len(corners) else 0.0


UNITS = {"max_edge_length": median_edge, "max_error": diagonal, "max_quadric_error": diagonal}
"""The lengths among the options, and what percentages are of."""

PARSERS: dict[str, Callable[[str, str], Any]] = {
    "keep_ratio": parse_ratio,
    "foldover": partial(parse_or_off, expected="an angle in degrees"),
    "normal_deviation": partial(parse_or_off, expected="an angle in degrees"),
    "shape": partial(parse_or_off, expected="a number from 0 to 1"),
}


class Wanted:
    """Options of :func:`tetsimplify.simplify`, some relative to a mesh that is not read yet.

    Parameters
    ----------
    given : mapping of names to values
        As people write them, None where they do not.

    Raises
    ------
    OptionError
        When something is wrong that the mesh has nothing to do with.
    """

    def __init__(self, given: Mapping[str, Any]) -> None:
        from tetsimplify.options import CRITERIA, Options

        said = {name: value for name, value in given.items() if value is not None}
        if not said.keys() & set(CRITERIA):
            raise OptionError(f"give at least one of {', '.join(map(_dashed, CRITERIA))}")
        self._removal_limit = said.pop("removal_limit", None)
        self._lengths = {
            name: parse_length(_dashed(name), said.pop(name)) for name in UNITS if name in said
        }
        self._others = {
            name: PARSERS[name](_dashed(name), value) if name in PARSERS else value
            for name, value in said.items()
        }
        Options(**self._with({name: number for name, (number, _) in self._lengths.items()}))

    def streamed(self) -> dict[str, Any] | None:
        """The options if they do for a surface that is not there as a whole, None if not."""
        from tetsimplify.options import Options
        from tetsimplify.streaming import obstacle

        if any(is_relative for _, is_relative in self._lengths.values()):
            return None  # to edges that are not known yet
        options = self._with({name: number for name, (number, _) in self._lengths.items()})
        return options if obstacle(Options(**options)) is None else None

    def options(self, mesh: Mesh) -> dict[str, Any]:
        """The options for a mesh."""
        lengths = {
            name: number * UNITS[name](mesh) if is_relative else number
            for name, (number, is_relative) in self._lengths.items()
        }
        return self._with(lengths)

    def _with(self, lengths: dict[str, float]) -> dict[str, Any]:
        options = {**lengths, **self._others}
        if self._removal_limit is not None:
            length = lengths.get("max_edge_length")
            options["removal_limit"] = parse_removal_limit(self._removal_limit, length)
        return options


def _dashed(name: str) -> str:
    """An option of the library as one of the command line."""
    return f"--{name.replace('_', '-')}"
