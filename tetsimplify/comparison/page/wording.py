"""Numbers and names of a comparison as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

MINUS = "\N{MINUS SIGN}"
TIMES = "\N{MULTIPLICATION SIGN}"
NONE = "\N{EM DASH}"


def whole(number: float | None) -> str:
    """A count with separators: ``1,234``."""
    return NONE if number is None else f"{number:,.0f}".replace("-", MINUS)


def short(number: float | None, digits: int = 3) -> str:
    """A number with so many significant digits."""
    if number is None or not math.isfinite(number):
        return NONE
    if number == 0:
        return "0"
    magnitude = math.floor(math.log10(abs(number)))
    if not -4 <= magnitude < 7:
        return f"{number:.{digits - 1}e}".replace("-", MINUS)
    return f"{number:,.{max(digits - 1 - magnitude, 0)}f}".replace("-", MINUS)


def percent(part: float | None, digits: int = 3) -> str:
    """A part of 1: ``15 %``."""
    return NONE if part is None else f"{part * 100:.{digits}g} %".replace("-", MINUS)


def memory(n_bytes: float | None) -> str:
    """In MB."""
    return NONE if n_bytes is None else f"{whole(n_bytes / 1e6)} MB"


def criterion_name(criterion: Mapping[str, float]) -> str:
    """What was asked for, in a word: ``15 %`` of the faces, or edges of at least ``ε 0.3``."""
    if "keep_ratio" in criterion:
        return percent(criterion["keep_ratio"])
    if "max_edge_length" in criterion:
        return f"ε {criterion['max_edge_length']:.4g}"
    if "regularised" in criterion:
        return f"as regularised: {whole(criterion['regularised'])} faces"
    return ", ".join(f"{name} {value:.4g}" for name, value in criterion.items())


def degrees(edge_degrees: Mapping[str, int]) -> str:
    """How many edges have a degree other than 2: ``1: 120 · 4: 9``."""
    others = sorted((int(degree), n) for degree, n in edge_degrees.items() if int(degree) != 2)
    return " · ".join(f"{degree}: {whole(n)}" for degree, n in others if n) or "all 2"


def listing(items: Iterable[str]) -> str:
    """In one sentence: ``a, b and c``."""
    *others, last = items
    return f"{', '.join(others)} and {last}" if others else last


def counted(n: int, one: str, many: str | None = None) -> str:
    """A number with its noun."""
    return f"{whole(n)} {one if n == 1 else many or one + 's'}"
