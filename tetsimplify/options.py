"""What :func:`tetsimplify.simplify` can be told, checked."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tetsimplify import kernels
from tetsimplify.errors import OptionError

if TYPE_CHECKING:
    from tetsimplify.kernels.state import Rules

Progress = Callable[[str, float], object]

BLOCKED = ("contract", "skip", "violate")
OUTER = ("region", "path", "distance")

PLACEMENTS: dict[str, tuple[float, ...]] = {
    "midpoint": (0.5, 0.25, 0.75, 0.0, 1.0),
    "endpoint": (0.0, 1.0),
}
"""Places that each placement tries in turn, as parameters along the edge."""

DEFAULT_REMOVAL_LIMIT = 4.0  # in units of the edge length asked for
DEFAULT_FOLDOVER = 75.0  # degrees

UNLIMITED_STEPS = 2**62


@dataclass(frozen=True)
class Options:
    """The options of one run; see :func:`tetsimplify.simplify`."""

    max_edge_length: float
    blocked: str = "contract"
    placement: str = "midpoint"
    removal_limit: float | None = None
    outer: str = "region"
    foldover: float | None = DEFAULT_FOLDOVER

    def __post_init__(self) -> None:
        _check_number("max_edge_length", self.max_edge_length, 0.0, math.inf)
        _check_choice("blocked", self.blocked, BLOCKED)
        _check_choice("placement", self.placement, PLACEMENTS)
        _check_choice("outer", self.outer, OUTER)
        if self.removal_limit is not None:
            _check_number("removal_limit", self.removal_limit, 0.0, math.inf)
        if self.foldover is not None:
            _check_number("foldover", self.foldover, 0.0, 180.0)

    def rules(self) -> Rules:
        """The options as the kernels want them."""
        limit = self.removal_limit
        if limit is None:
            limit = DEFAULT_REMOVAL_LIMIT * self.max_edge_length
        off = kernels.guards.NO_FOLDOVER_GUARD
        return kernels.state.Rules(
            max_length2=float(self.max_edge_length) ** 2,
            blocked=BLOCKED.index(self.blocked),
            removal_limit2=float(limit) ** 2,
            cos_foldover=off if self.foldover is None else math.cos(math.radians(self.foldover)),
            places=np.array(PLACEMENTS[self.placement]),
            max_steps=UNLIMITED_STEPS,
        )

    def outer_code(self) -> int | None:
        """The heuristic for outer triangles as the kernels want it."""
        codes = {"region": None, "path": kernels.state.PATH, "distance": kernels.state.DISTANCE}
        return codes[self.outer]


def _check_choice(name: str, value: object, choices: object) -> None:
    if value not in choices:  # type: ignore[operator]
        listed = ", ".join(repr(choice) for choice in choices)  # type: ignore[attr-defined]
        raise OptionError(f"{name} must be one of {listed}, got {value!r}")


def _check_number(name: str, value: object, low: float, high: float) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise OptionError(f"{name} must be a number, got {value!r}")
    if not low <= float(value) <= high:
        span = f"at least {low:g}" if high == math.inf else f"from {low:g} to {high:g}"
        raise OptionError(f"{name} must be {span}, got {value}")
