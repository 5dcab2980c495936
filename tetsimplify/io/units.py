"""Units of length."""

from __future__ import annotations

from collections.abc import Sequence

from tetsimplify.errors import FileError

EXPONENTS = {"pm": -12, "Å": -10, "nm": -9, "µm": -6, "mm": -3, "cm": -2, "dm": -1, "m": 0, "km": 3}

# Spellings in files: the Greek letter mu, ImageJ's escape, names in full.
SPELLINGS = {
    "um": "µm",
    "\N{GREEK SMALL LETTER MU}m": "µm",
    "\\u00b5m": "µm",
    "micron": "µm",
    "microns": "µm",
    "angstrom": "Å",
    "\N{ANGSTROM SIGN}": "Å",
    **{
        f"{prefix}{word}": symbol
        for prefix, symbol in {
            "pico": "pm", "nano": "nm", "micro": "µm", "milli": "mm", "centi": "cm",
            "deci": "dm", "": "m", "kilo": "km",
        }.items()
        for word in ("meter", "metre", "meters", "metres")
    },
}  # fmt: skip
NO_UNITS = {"", "unknown", "pixel", "pixels", "voxel", "none", "reference frame"}


def as_unit(text: str | None) -> str | None:
    """The usual sign of a unit; None where a file says that there is none."""
    word = (text or "").strip().strip('"')
    if word.lower() in NO_UNITS:
        return None
    return SPELLINGS.get(word, SPELLINGS.get(word.lower(), word))


def in_one_unit(
    lengths: Sequence[float], units: Sequence[str | None]
) -> tuple[list[float], str | None]:
    """Convert lengths to the unit of the first one.

    Raises
    ------
    FileError
        When units differ and one of them is unknown.
    """
    first, *_ = signs = [as_unit(unit) for unit in units]
    if len(set(signs)) == 1:
        return list(lengths), first
    unknown = [sign for sign in signs if sign not in EXPONENTS]
    if unknown:
        raise FileError(f"its axes have different units, of which {unknown[0]!r} is not known")
    assert first is not None
    return [
        _scaled(length, EXPONENTS[sign] - EXPONENTS[first])
        for length, sign in zip(lengths, signs, strict=True)
        if sign is not None
    ], first


def _scaled(length: float, exponent: int) -> float:
    # Powers of ten with positive exponents are exact.
    return float(length * 10**exponent if exponent >= 0 else length / 10**-exponent)
