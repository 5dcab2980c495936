"""What :func:`tetsimplify.simplify` can be told, checked."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tetsimplify import kernels
from tetsimplify.errors import OptionError

if TYPE_CHECKING:
    from tetsimplify.kernels.state import Rules

Progress = Callable[[str, float], object]

BLOCKED = ("contract", "skip", "violate")
OUTER = ("region", "path", "distance")
COSTS = ("auto", "length", "quadric")
BOUNDARIES = ("simplify", "keep", "lock")
INTERSECTIONS = ("allow", "prevent")


class Placement(NamedTuple):
    """Places that are tried in turn."""

    places: tuple[float, ...]
    """Parameters along the edge; with quadrics the cheapest comes first."""
    optimum: bool = False
    """Whether the place of the least quadric error comes before them."""


PLACEMENTS = {
    "midpoint": Placement((0.5, 0.25, 0.75, 0.0, 1.0)),
    "endpoint": Placement((0.0, 1.0)),
    "quadric": Placement((0.5, 0.0, 1.0), optimum=True),
}

DEFAULT_REMOVAL_LIMIT = 4.0  # in lengths: of the edge length asked for, else of the edge itself
DEFAULT_FOLDOVER = 75.0  # degrees

GUARDS_OF_QUADRICS = {
    "normal_deviation": 90.0,  # degrees
    "shape": 0.9,  # 4 sqrt(3) area / (sum of the squared edges), which is 1 for equilateral ones
}
"""What "auto" means for them where edges are judged by the quadric error."""


BOUNDARY_WEIGHT = 10.0
FEATURE_WEIGHT = 10.0  # of the planes that hold feature edges

UNLIMITED_STEPS = 2**62


@dataclass(frozen=True)
class Options:
    """The options of one run; see :func:`tetsimplify.simplify`."""

    max_edge_length: float | None = None
    target_faces: int | None = None
    keep_ratio: float | None = None
    max_error: float | None = None
    max_quadric_error: float | None = None
    cost: str = "auto"
    placement: str = "auto"
    blocked: str = "contract"
    removal_limit: float | None = None
    outer: str = "region"
    boundary: str = "simplify"
    feature_angle: float | None = None
    foldover: float | None = DEFAULT_FOLDOVER
    normal_deviation: float | str | None = "auto"
    shape: float | str | None = "auto"
    intersections: str = "allow"
    fit: bool | str = "auto"

    def __post_init__(self) -> None:
        for name, high in (
            ("max_edge_length", math.inf),
            ("keep_ratio", 1.0),
            ("max_error", math.inf),
            ("max_quadric_error", math.inf),
            ("removal_limit", math.inf),
            ("foldover", 180.0),
            ("normal_deviation", 180.0),
            ("feature_angle", 180.0),
            ("shape", 1.0),
        ):
            value = getattr(self, name)
            if value is not None and not (value == "auto" and name in GUARDS_OF_QUADRICS):
                _check_number(name, value, 0.0, high)
        if self.target_faces is not None:
            _check_count("target_faces", self.target_faces)
        _check_choice("cost", self.cost, COSTS)
        _check_choice("placement", self.placement, ("auto", *PLACEMENTS))
        _check_choice("blocked", self.blocked, BLOCKED)
        _check_choice("outer", self.outer, OUTER)
        _check_choice("boundary", self.boundary, BOUNDARIES)
        _check_choice("intersections", self.intersections, INTERSECTIONS)
        if self.intersections == "prevent" and self.blocked == "violate":
            raise OptionError("intersections='prevent' needs a topology that is kept")
        if self.fit != "auto" and not isinstance(self.fit, bool):
            raise OptionError(f"fit must be True, False or 'auto', got {self.fit!r}")
        if not any(getattr(self, name) is not None for name in CRITERIA):
            raise OptionError(f"give at least one of {', '.join(CRITERIA)}")
        if self.feature_angle is not None and self.by_length:
            if self.chosen_placement != "quadric":
                raise OptionError(
                    "feature_angle needs cost='quadric' or placement='quadric', got "
                    f"cost={self.cost!r} and placement={self.placement!r}"
                )
        if self.fit is True and (obstacle := self._obstacle_to_fit()) is not None:
            raise OptionError(f"fit=True {obstacle}")

    @property
    def by_length(self) -> bool:
        """Whether edges are judged by their length, not by the quadric error."""
        if self.cost != "auto":
            return self.cost == "length"
        others = (self.target_faces, self.keep_ratio, self.max_error, self.max_quadric_error)
        return all(criterion is None for criterion in others)

    @property
    def has_one_threshold(self) -> bool:
        """Whether every edge below one length is contracted, and none has to go first."""
        return self.by_length and self.target_faces is None and self.keep_ratio is None

    @property
    def chosen_placement(self) -> str:
        """The placement, with "auto" decided."""
        if self.placement != "auto":
            return self.placement
        plain = self.by_length and self.feature_angle is None
        return "midpoint" if plain else "quadric"

    @property
    def fits(self) -> bool:
        """Whether the vertices are moved nearer to the mesh given in the end."""
        return self.fit is not False and self._obstacle_to_fit() is None

    def _obstacle_to_fit(self) -> str | None:
        """Why vertices must not be moved in the end, None if they may."""
        if self.by_length or self.chosen_placement != "quadric":
            return (
                "needs cost='quadric' and placement='quadric', got "
                f"cost={self.cost!r} and placement={self.placement!r}"
            )
        if self.target_faces is None and self.keep_ratio is None:
            return "needs target_faces or keep_ratio"
        for name in ("max_edge_length", "max_error", "max_quadric_error"):
            if getattr(self, name) is not None:
                return f"cannot be with {name}, which it might break"
        if not isinstance(self.normal_deviation, str | None):
            return "cannot be with a normal_deviation that is asked for, which it might break"
        if self.intersections != "allow":
            return f"cannot be with intersections={self.intersections!r}, which it might break"
        if self.blocked == "violate":
            return "needs a topology that is kept, not blocked='violate'"
        return None

    @property
    def uses_quadrics(self) -> bool:
        """Whether quadric errors are computed at all."""
        asked_for = (
            *(self.max_error, self.max_quadric_error, self.feature_angle),
            *(self.guard(name) for name in GUARDS_OF_QUADRICS),
        )
        by_error = not self.by_length or self.chosen_placement == "quadric"
        return by_error or any(value is not None for value in asked_for)

    def guard(self, name: str) -> float | None:
        """One of the guards that need quadrics, with "auto" decided: None where it is off."""
        value: float | str | None = getattr(self, name)
        if not isinstance(value, str):
            return value
        return None if self.by_length else GUARDS_OF_QUADRICS[name]

    def fewest_faces(self, n_faces: int) -> int:
        """So many of the faces given are to be left; 0 where no number is asked for."""
        wanted = [0 if self.target_faces is None else self.target_faces]
        if self.keep_ratio is not None:
            wanted.append(math.ceil(self.keep_ratio * n_faces))
        return max(wanted)

    def rules(self) -> Rules:
        """The options as the kernels want them."""
        length = math.inf if self.max_edge_length is None else float(self.max_edge_length)
        limit, in_edges = self.removal_limit, 0.0
        if limit is None:
            has_length = self.max_edge_length is not None
            limit = DEFAULT_REMOVAL_LIMIT * length if has_length else 0.0
            in_edges = 0.0 if has_length else DEFAULT_REMOVAL_LIMIT
        placement = PLACEMENTS[self.chosen_placement]
        return kernels.state.Rules(
            max_length2=length * length,  # infinite, not an error, where it overflows
            by_length=self.by_length,
            is_bounded=self.max_quadric_error is not None,
            blocked=BLOCKED.index(self.blocked),
            removal_limit2=float(limit) * float(limit),
            removal_edges2=in_edges * in_edges,
            cos_foldover=cosine_of(self.foldover),
            cos_deviation=cosine_of(self.guard("normal_deviation")),
            shape=float(self.guard("shape") or 0.0),
            optimum=placement.optimum,
            places=np.array(placement.places),
            max_steps=UNLIMITED_STEPS,
        )

    def outer_code(self) -> int | None:
        """The heuristic for outer triangles as the kernels want it."""
        codes = {"region": None, "path": kernels.state.PATH, "distance": kernels.state.DISTANCE}
        return codes[self.outer]


CRITERIA = ("max_edge_length", "target_faces", "keep_ratio", "max_error", "max_quadric_error")
"""Of these one must be given; where there are several, the first that is reached stops."""


def cosine_of(degrees: float | None) -> float:
    """Cosine of the angle of a guard, and what switches it off for None."""
    return kernels.guards.NO_GUARD if degrees is None else math.cos(math.radians(degrees))


def _check_choice(name: str, value: object, choices: object) -> None:
    if value not in choices:  # type: ignore[operator]
        listed = ", ".join(repr(choice) for choice in choices)  # type: ignore[attr-defined]
        raise OptionError(f"{name} must be one of {listed}, got {value!r}")


def _check_count(name: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise OptionError(f"{name} must be a whole number, got {value!r}")
    if value < 0:
        raise OptionError(f"{name} must be at least 0, got {value}")


def _check_number(name: str, value: object, low: float, high: float) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise OptionError(f"{name} must be a number, got {value!r}")
    if not low <= float(value) <= high:
        span = f"at least {low:g}" if high == math.inf else f"from {low:g} to {high:g}"
        raise OptionError(f"{name} must be {span}, got {value}")
