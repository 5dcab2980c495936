"""PLY files of every shape that the format allows, written value by value."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence

CODES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
    "float": "f", "double": "d",
}  # fmt: skip
ENCODINGS = ("ascii", "binary_little_endian", "binary_big_endian")

Row = list[tuple[str, float]]  # type and value


class PlyFile:
    """Builds a PLY file element by element."""

    def __init__(self, encoding: str, newline: str = "\n") -> None:
        self.encoding, self.newline = encoding, newline
        self.header = ["ply", f"format {encoding} 1.0"]
        self.rows: list[Row] = []

    def line(self, text: str) -> None:
        """Add a line to the header."""
        self.header.append(text)

    def element(self, name: str, properties: Sequence[str], rows: Iterable[Row]) -> None:
        """Add an element with its properties and rows."""
        rows = list(rows)
        self.header.append(f"element {name} {len(rows)}")
        self.header += [f"property {text}" for text in properties]
        self.rows += rows

    def to_bytes(self) -> bytes:
        """The whole file."""
        head = self.newline.join([*self.header, "end_header", ""]).encode()
        if self.encoding == "ascii":
            lines = (" ".join(repr(value) for _, value in row) for row in self.rows)
            return head + self.newline.join([*lines, ""]).encode()
        order = "<" if self.encoding == "binary_little_endian" else ">"
        return head + b"".join(
            struct.pack(order + "".join(CODES[kind] for kind, _ in row), *(v for _, v in row))
            for row in self.rows
        )


def list_of(count_type: str, value_type: str, values: Sequence[float]) -> Row:
    """The values of a list property."""
    return [(count_type, len(values)), *((value_type, value) for value in values)]
