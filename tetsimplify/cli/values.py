"""What people write on the command line, as numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tetsimplify.errors import OptionError


def _number(option: str, text: str, expected: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise OptionError(f"{option} must be {expected}, got {text!r}")
    return number


def parse_length(option: str, text: str) -> tuple[float, bool]:
    """Read a length, or a percentage of a length that only the mesh tells.

    Returns
    -------
    number : float
        The length, or the part (0.5 for 50 %).
    is_relative : bool
        Whether it is a part.
    """
    is_relative = text.endswith("%")
    expected = "a length such as 0.5 or a percentage such as 50%"
    number = _number(option, text.removesuffix("%"), expected)
    if not 0 <= number < math.inf:
        raise OptionError(f"{option} must be {expected}, got {text!r}")
    return (number / 100, True) if is_relative else (number, False)


def parse_ratio(option: str, text: str) -> float:
    """Read a part of a whole: a number from 0 to 1, or a percentage."""
    expected = "a number from 0 to 1 or a percentage such as 15%"
    number = _number(option, text.removesuffix("%"), expected)
    if text.endswith("%"):
        number /= 100
    if not 0 <= number <= 1:
        raise OptionError(f"{option} must be {expected}, got {text!r}")
    return number


def parse_removal_limit(text: str, max_edge_length: float | None) -> float:
    """Read a length, ``inf``, or a multiple of the edge length such as ``4x``."""
    expected = "a length, inf, or a multiple of the edge length such as 4x"
    number = _number("--removal-limit", text.removesuffix("x"), expected)
    if not text.endswith("x"):
        return number
    if max_edge_length is None:
        raise OptionError(f"--removal-limit {text} is a multiple of --max-edge-length: give both")
    return number * max_edge_length


def parse_or_off(option: str, text: str, *, expected: str) -> float | None:
    """Read a number, or ``off``."""
    return None if text.lower() == "off" else _number(option, text, f"{expected}, or off")


def parse_spacing(text: str) -> tuple[float, float, float]:
    """Read three lengths with commas between them."""
    expected = "three lengths such as 1,1,2.5"
    lengths = [_number("--spacing", part, expected) for part in text.split(",")]
    if len(lengths) != 3 or not all(0 < length < math.inf for length in lengths):
        raise OptionError(f"--spacing must be {expected}, got {text!r}")
    return lengths[0], lengths[1], lengths[2]


def parse_levels(given: Sequence[str]) -> list[float | str]:
    """Read iso-values, or ``otsu``, with commas between them or one by one."""
    expected = "a number or otsu"
    levels: list[float | str] = []
    for word in (word.strip() for text in given for word in text.split(",")):
        level = "otsu" if word.lower() == "otsu" else _number("--level", word, expected)
        if level in (math.inf, -math.inf):
            raise OptionError(f"--level must be {expected}, got {word!r}")
        if level in levels:
            raise OptionError(f"--level {word} is given twice")
        levels.append(level)
    return levels


def parse_labels(text: str) -> list[int] | str:
    """Read integers with commas between them, or ``all``."""
    if text.lower() == "all":
        return "all"
    try:
        labels = [int(word) for word in text.split(",")]
    except ValueError:
        raise OptionError(f"--labels must be all, or integers such as 1,4, got {text!r}") from None
    if len(set(labels)) < len(labels):
        raise OptionError(f"--labels {text} has one of them twice")
    return labels


def parse_named(option: str, given: Sequence[str]) -> dict[str, str]:
    """Read pairs of a name and a file such as ``dose=dose.nii``."""
    found: dict[str, str] = {}
    for text in given:
        name, equals, path = text.partition("=")
        if not (name and equals and path) or name in found:
            raise OptionError(f"{option} must be NAME=VOLUME, each name once, got {text!r}")
        found[name] = path
    return found
