"""What people write on the command line, as numbers."""

from __future__ import annotations

import math

from tetsimplify.errors import OptionError


def _number(option: str, text: str, expected: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise OptionError(f"{option} must be {expected}, got {text!r}")
    return number


def parse_edge_length(text: str) -> tuple[float, bool]:
    """Read a length, or a percentage of the median edge length.

    Returns
    -------
    number : float
        The length, or the part (0.5 for 50 %).
    is_relative : bool
        Whether it is a part of the median edge length.
    """
    is_relative = text.endswith("%")
    expected = "a length such as 0.5 or a percentage such as 50%"
    number = _number("--max-edge-length", text.removesuffix("%"), expected)
    if not 0 <= number < math.inf:
        raise OptionError(f"--max-edge-length must be {expected}, got {text!r}")
    return (number / 100, True) if is_relative else (number, False)


def parse_removal_limit(text: str, max_edge_length: float) -> float:
    """Read a length, ``inf``, or a multiple of the edge length such as ``4x``."""
    expected = "a length, inf, or a multiple of the edge length such as 4x"
    number = _number("--removal-limit", text.removesuffix("x"), expected)
    return number * max_edge_length if text.endswith("x") else number


def parse_foldover(text: str) -> float | None:
    """Read an angle in degrees, or ``off``."""
    if text.lower() == "off":
        return None
    return _number("--foldover", text, "an angle in degrees, or off")


def parse_spacing(text: str) -> tuple[float, float, float]:
    """Read three lengths with commas between them."""
    expected = "three lengths such as 1,1,2.5"
    lengths = [_number("--spacing", part, expected) for part in text.split(",")]
    if len(lengths) != 3 or not all(0 < length < math.inf for length in lengths):
        raise OptionError(f"--spacing must be {expected}, got {text!r}")
    return lengths[0], lengths[1], lengths[2]
