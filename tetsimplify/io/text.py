"""Rows of numbers as text."""

from __future__ import annotations

import warnings
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError

ROWS_AT_ONCE = 1 << 12  # more take twice as long, as what is formatted leaves the cache


def write_rows(file: BinaryIO, row_format: str, rows: NDArray[Any]) -> None:
    """Write one line for each row.

    ``%r`` prints a float with the fewest digits that read back as the same float. One large
    format at a time is several times faster than a line at a time.
    """
    for start in range(0, len(rows), ROWS_AT_ONCE):
        some = rows[start : start + ROWS_AT_ONCE]
        numbers = tuple(some.reshape(-1).tolist())
        file.write((row_format * len(some) % numbers).encode("ascii"))


def parse_numbers(text: bytes, dtype: type[np.generic] = np.float64) -> NDArray[Any]:
    """Read numbers that are separated by any white space.

    Raises
    ------
    FileError
        When something is not a number.
    """
    with warnings.catch_warnings():  # older versions of NumPy warn where newer ones raise
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (ValueError, DeprecationWarning):
            raise FileError(f"{_first_wrong(text, dtype)!r} is not a number") from None


def _first_wrong(text: bytes, dtype: type[np.generic]) -> str:
    convert = int if np.issubdtype(dtype, np.integer) else float
    for word in text.split():
        try:
            convert(word)
        except ValueError:
            return word[:40].decode("latin-1")
    return ""


def parse_rows(lines: list[bytes], n_columns: int) -> NDArray[np.float64]:
    """Read the first numbers of each line, and pass over what follows them.

    Returns
    -------
    ndarray, shape (n, n_columns), float64

    Raises
    ------
    FileError
        When a line has fewer columns.
    """
    widths = {len(line.split()) for line in lines} or {n_columns}
    if min(widths) < n_columns:
        row = next(k for k, line in enumerate(lines) if len(line.split()) < n_columns)
        raise FileError(f"vertex {row} has fewer than {n_columns} coordinates")
    if len(widths) > 1:
        lines = [b" ".join(line.split()[:n_columns]) for line in lines]
        widths = {n_columns}
    return parse_numbers(b" ".join(lines)).reshape(-1, widths.pop())[:, :n_columns]
