"""What is to be done: one method on one input by one criterion."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tetsimplify import kernels
from tetsimplify.comparison.inputs import Input
from tetsimplify.decimators import FACES, LENGTH, VOLUME, Goal, Method
from tetsimplify.decimators.length import area_of, equilateral_edge
from tetsimplify.errors import OptionError
from tetsimplify.standard import faces_to_keep

KEEP_RATIO = "keep_ratio"
MAX_EDGE_LENGTH = "max_edge_length"
REGULARISED = "regularised"
CLOCKS = ("wall", "cpu")
SHORT = 0.5  # of the edge of equilateral triangles: what counts as short where no length is given


@dataclass(frozen=True)
class Settings:
    """How every task is done."""

    repeats: int = 3
    time_limit: float = 600.0
    """Seconds that a process may take."""
    tolerance: float = 1e-4
    """Of the bounds of the largest distance, in diagonals of the input."""
    clock: str = "wall"
    """Whose seconds are told first."""

    def __post_init__(self) -> None:
        if isinstance(self.repeats, bool) or not isinstance(self.repeats, int) or self.repeats < 1:
            raise OptionError(f"repeats must be a positive integer, got {self.repeats!r}")
        for name in ("time_limit", "tolerance"):
            value = getattr(self, name)
            if not isinstance(value, (int, float)) or not 0.0 < value < math.inf:
                raise OptionError(f"{name} must be a positive number, got {value!r}")
        if self.clock not in CLOCKS:
            raise OptionError(f"clock must be one of {', '.join(CLOCKS)}, got {self.clock!r}")


@dataclass(frozen=True)
class Criterion:
    """A part of the faces, an edge length, or the faces of the regularised surface."""

    name: str
    value: float
    in_median_edges: bool = False
    """Whether it is a length that a mesh has to tell yet."""

    def on(self, given: Input) -> Criterion:
        """The criterion for one input, with its length in the units of that."""
        if self.name == REGULARISED:
            return Criterion(self.name, given.n_regular_faces)
        return (
            Criterion(self.name, self.value * given.median_edge) if self.in_median_edges else self
        )

    @property
    def by_length(self) -> bool:
        """Whether it is an edge length."""
        return self.name == MAX_EDGE_LENGTH

    def suits(self, method: Method) -> bool:
        """Whether a method has something to do: those that start from a volume, with one only."""
        return FACES in method.takes or (self.name == REGULARISED and VOLUME in method.takes)

    def __str__(self) -> str:
        if self.name == REGULARISED:
            return f"{self.value:,.0f} faces as regularised"
        return f"edges below {self.value:.4g}" if self.by_length else f"{100 * self.value:g} %"


def criteria(keep_ratio: Any, max_edge_length: Any, regularised: bool = False) -> list[Criterion]:
    """The criteria that are asked for: one, or several of a kind.

    Raises
    ------
    OptionError
        When not exactly one kind is given, or a value is wrong.
    """
    if (keep_ratio is not None) + (max_edge_length is not None) + bool(regularised) != 1:
        raise OptionError("give either keep_ratio or max_edge_length or regularised")
    if regularised:
        return [Criterion(REGULARISED, 0.0)]
    given = max_edge_length if keep_ratio is None else keep_ratio
    values = list(given) if isinstance(given, (list, tuple)) else [given]
    if not values:
        raise OptionError("give at least one keep_ratio or max_edge_length")
    return list(dict.fromkeys(map(_length if keep_ratio is None else _ratio, values)))


def _ratio(given: Any) -> Criterion:
    faces_to_keep(given, 1)
    return Criterion(KEEP_RATIO, float(given))


def _length(given: Any) -> Criterion:
    is_relative = isinstance(given, str) and given.endswith("%")
    try:
        number = float(given[:-1] if is_relative else given)
    except (TypeError, ValueError):
        number = math.nan
    if not 0.0 < number < math.inf:
        raise OptionError(
            "max_edge_length must be a positive length, or a percentage of the median edge such "
            f"as '120%', got {given!r}"
        )
    return Criterion(MAX_EDGE_LENGTH, number / 100 if is_relative else number, is_relative)


@dataclass(frozen=True, eq=False)
class Task:
    """One run."""

    given: Input
    method: Method
    criterion: Criterion
    options: Mapping[str, Any] = field(default_factory=dict)
    """Of :func:`tetsimplify.simplify`, for methods that are its own."""

    def __str__(self) -> str:
        return f"{self.given.name}, {self.criterion}: {self.method.title}"

    @property
    def goes_by_length(self) -> bool:
        """Whether the method itself gets an edge length."""
        return self.criterion.by_length and LENGTH in self.method.takes

    def goal(self, n_by_length: int | None) -> Goal:
        """What the method is asked for.

        Parameters
        ----------
        n_by_length : int or None
            The number of faces that contraction by length leaves, where the method needs one and
            the criterion is a length.
        """
        if self.goes_by_length:
            return Goal(max_edge_length=self.criterion.value, options=self.options)
        if self.criterion.name == REGULARISED:
            volume = self.given.volume if VOLUME in self.method.takes else None
            return Goal(int(self.criterion.value), options=self.options, volume=volume)
        if not self.criterion.by_length:
            n_by_length = faces_to_keep(self.criterion.value, len(self.given.mesh.faces))
        return Goal(target_faces=n_by_length, options=self.options)

    def short_length(self, goal: Goal) -> float:
        """Shorter edges count as short: the length asked for, or what the faces left suggest."""
        if self.criterion.by_length:
            return self.criterion.value
        assert goal.target_faces is not None
        return SHORT * equilateral_edge(area_of(self.given.mesh), goal.target_faces)

    def key(self, settings: Settings, machine: Mapping[str, Any]) -> str:
        """The same for runs that would be the same, or would be measured the same."""
        packages = machine["packages"]
        parts = {
            "input": self.given.digest,
            "method": [self.method.name, self.method.module],
            "versions": [packages[name] for name in ("tetsimplify", *self.method.packages)],
            "kernels": kernels.jit.KERNELS_DIGEST if self.method.is_own else None,
            "criterion": [self.criterion.name, self.criterion.value],
            "options": sorted((name, repr(value)) for name, value in self.options.items()),
            "settings": [settings.repeats, settings.time_limit, settings.tolerance],
            "machine": [machine["processor"], machine["python"]],
        }
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:24]
