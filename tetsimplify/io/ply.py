"""PLY: the Stanford polygon format, in text or binary of either byte order.

A PLY file is a header followed by tables, called elements. A row of a table holds scalars
and lists; the lists may have another length in every row. Of all that this reader takes the
positions of the element ``vertex`` and the vertex lists of the element ``face``, wherever in
the rows they stand, and steps over everything else.

References
----------
Greg Turk, The PLY polygon file format, 1994.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError
from tetsimplify.io.polygons import mesh_of_polygons
from tetsimplify.io.text import parse_numbers
from tetsimplify.mesh import NORMALS, Mesh

Bytes = NDArray[np.uint8]
Positions = NDArray[np.int64]

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
VERTEX_LISTS = ("vertex_indices", "vertex_index")
ROWS_AT_ONCE = 1 << 20


class Property(NamedTuple):
    """A column of an element; `count_type` is that of the list lengths, None for scalars."""

    name: str
    value_type: np.dtype[Any]
    count_type: np.dtype[Any] | None


class Element(NamedTuple):
    """A table of the file."""

    name: str
    n_rows: int
    properties: list[Property]

    @property
    def lists(self) -> list[Property]:
        """The columns that hold lists."""
        return [column for column in self.properties if column.count_type is not None]


class Column(NamedTuple):
    """The values of a column, row after row, and the length of the list in each row."""

    values: NDArray[Any]
    counts: Any


def read(path: Path) -> Mesh:
    """Read the vertices and faces of a PLY file."""
    with open(path, "rb") as file:
        encoding, elements = _read_header(file)
        body: Bytes
        if encoding == "ascii":
            body, elements = _text_as_binary(file, elements)
        else:
            body = np.fromfile(file, np.uint8)
    tables = _read_tables(elements, body)
    if "vertex" not in tables:
        raise FileError("there is no element vertex")
    vertex = tables["vertex"]
    if missing := [axis for axis in "xyz" if axis not in vertex]:
        raise FileError(f"the element vertex has no property {missing[0]}")
    points = np.column_stack([vertex[axis].values for axis in "xyz"])
    faces = _vertex_lists(elements, tables)
    return mesh_of_polygons(points, faces.counts, faces.values)


def write(path: Path, mesh: Mesh, data: Mapping[str, NDArray[Any]] | None = None) -> None:
    """Write little-endian binary PLY with positions and data of vertices in double precision."""
    columns = {"x": mesh.vertices[:, 0], "y": mesh.vertices[:, 1], "z": mesh.vertices[:, 2]}
    columns |= _columns(data or {})
    properties = "".join(f"property double {name}\n" for name in columns)
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment tetsimplify\n"
        f"element vertex {len(mesh.vertices)}\n{properties}"
        f"element face {len(mesh.faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    with open(path, "wb") as file:
        file.write(header.encode("ascii"))
        for start in range(0, len(mesh.vertices), ROWS_AT_ONCE):
            some = slice(start, start + ROWS_AT_ONCE)
            np.column_stack([c[some] for c in columns.values()]).astype("<f8").tofile(file)
        for start in range(0, len(mesh.faces), ROWS_AT_ONCE):
            faces = mesh.faces[start : start + ROWS_AT_ONCE]
            rows = np.empty(len(faces), [("count", "u1"), ("vertices", "<i4", 3)])
            rows["count"] = 3
            rows["vertices"] = faces
            rows.tofile(file)


def _columns(data: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Data of vertices column by column: nx, ny, nz are the normals, as readers expect them."""
    columns: dict[str, NDArray[Any]] = {}
    for name, values in data.items():
        parts = values.reshape(len(values), -1).T
        word = "_".join(name.split())
        names = [word] if values.ndim == 1 else [f"{word}_{k}" for k in range(len(parts))]
        if name == NORMALS:
            names = ["nx", "ny", "nz"]
        if taken := {"x", "y", "z", *columns} & set(names):
            raise FileError(f"two properties of its vertices would be called {min(taken)}")
        columns |= dict(zip(names, parts, strict=True))
    return columns


def _read_header(file: BinaryIO) -> tuple[str, list[Element]]:
    if file.readline().strip() != b"ply":
        raise FileError("it is no PLY file: the first line must be 'ply'")
    encoding = ""
    elements: list[Element] = []
    for raw in iter(file.readline, b""):
        line = raw.decode("latin-1").strip()
        match line.split():
            case ["end_header"]:
                if not encoding:
                    raise FileError("the PLY header tells no format")
                return encoding, elements
            case ["format", name, _] if name in BYTE_ORDERS:
                encoding = name
            case ["element", name, n_rows] if n_rows.isdigit():
                elements.append(Element(name, int(n_rows), []))
            case ["property", "list", counts, values, name] if elements and encoding:
                column = Property(name, _as_dtype(values, encoding), _as_dtype(counts, encoding))
                elements[-1].properties.append(column)
            case ["property", values, name] if elements and encoding:
                elements[-1].properties.append(Property(name, _as_dtype(values, encoding), None))
            case [] | ["comment", *_] | ["obj_info", *_]:
                pass
            case _:
                raise FileError(f"the PLY header has a line that makes no sense: {line[:80]!r}")
    raise FileError("the PLY header has no end")


def _as_dtype(type_name: str, encoding: str) -> np.dtype[Any]:
    if type_name not in TYPES:
        raise FileError(f"the PLY header names an unknown type {type_name!r}")
    return np.dtype(BYTE_ORDERS[encoding] + TYPES[type_name])


def _text_as_binary(file: BinaryIO, elements: list[Element]) -> tuple[Bytes, list[Element]]:
    """Turn a text body into the binary body of a file in which every type is a double."""
    numbers = parse_numbers(file.read())
    double = np.dtype(np.float64)
    doubled = [
        Element(
            element.name,
            element.n_rows,
            [
                Property(column.name, double, None if column.count_type is None else double)
                for column in element.properties
            ],
        )
        for element in elements
    ]
    return numbers.view(np.uint8), doubled


def _read_tables(elements: list[Element], body: Bytes) -> dict[str, dict[str, Column]]:
    """Read the tables up to the faces; what stands behind them is of no interest."""
    tables: dict[str, dict[str, Column]] = {}
    start = 0
    for element in elements:
        if element.n_rows == 0:
            columns = {name: Column(np.empty(0), 0) for name, *_ in element.properties}
        elif same_lengths := _read_fixed_rows(element, body, start):
            columns, start = same_lengths
        else:
            columns, start = _read_ragged_rows(element, body, start)
        tables[element.name] = columns
        if element.name == "face" and "vertex" in tables:
            break
    return tables


def _vertex_lists(elements: list[Element], tables: dict[str, dict[str, Column]]) -> Column:
    if "face" not in tables:
        names = ", ".join(element.name for element in elements)
        raise FileError(f"there is no element face, only {names}")
    for name in VERTEX_LISTS:
        if name in tables["face"]:
            values, counts = tables["face"][name]
            return Column(values.astype(np.int64) if values.dtype.kind == "f" else values, counts)
    raise FileError(f"the element face has no property {' or '.join(VERTEX_LISTS)}")


def _read_fixed_rows(
    element: Element, body: Bytes, start: int
) -> tuple[dict[str, Column], int] | None:
    """Read a table in which all lists of a column are as long as its first; else None."""
    fields: list[tuple[Any, ...]] = []
    at = start
    for number, (_, value_type, count_type) in enumerate(element.properties):
        if count_type is None:
            fields.append((f"value{number}", value_type))
        else:
            length = _read_length(body, at, count_type)
            fields.append((f"count{number}", count_type))
            fields.append((f"value{number}", value_type, (length,)))
            at += count_type.itemsize + (length - 1) * value_type.itemsize
        at += value_type.itemsize
    row_type = np.dtype(fields)
    end = start + element.n_rows * row_type.itemsize
    if end > len(body):
        if element.lists:
            return None
        raise FileError(f"it ends in the middle of the element {element.name}")
    rows = body[start:end].view(row_type)
    columns = {}
    for number, (name, _, count_type) in enumerate(element.properties):
        values = rows[f"value{number}"]
        if count_type is not None and (rows[f"count{number}"] != values.shape[1]).any():
            return None
        length = 1 if count_type is None else values.shape[1]
        columns[name] = Column(values.reshape(-1), length)
    return columns, end


def _read_length(body: Bytes, at: int, count_type: np.dtype[Any]) -> int:
    if at + count_type.itemsize > len(body):
        return 0
    return max(int(body[at : at + count_type.itemsize].view(count_type)[0]), 0)


def _read_ragged_rows(element: Element, body: Bytes, start: int) -> tuple[dict[str, Column], int]:
    """Read a table whose lists differ in length, so that every row must be walked."""
    try:
        positions, counts, end = _walk_rows(element, body.tobytes(), start)
    except (struct.error, OverflowError):
        end = len(body) + 1
    if end > len(body):
        raise FileError(f"it ends in the middle of the element {element.name}")
    columns = {}
    for number, (name, value_type, count_type) in enumerate(element.properties):
        lengths = np.ones(element.n_rows, np.int64) if count_type is None else counts[number]
        columns[name] = Column(
            _gather(body, positions[number], lengths, value_type),
            1 if count_type is None else lengths,
        )
    return columns, end


def _walk_rows(
    element: Element, body: bytes, start: int
) -> tuple[dict[int, Positions], dict[int, Positions], int]:
    """Find where the values of each column stand, and how long each list is.

    A row is a run of scalars, a list, a run of scalars, a list, ...: only the lists have to
    be looked at.
    """
    # of each list: bytes before it, how to read its length, size of the length and of an item
    lists: list[tuple[int, Callable[..., tuple[Any, ...]], int, int]] = []
    scalar_at: dict[int, tuple[int, int]] = {}  # column -> (run, offset in the run)
    list_columns = []
    gap = 0
    for number, (_, value_type, count_type) in enumerate(element.properties):
        if count_type is None:
            scalar_at[number] = (len(lists), gap)
            gap += value_type.itemsize
        else:
            order = ">" if count_type.byteorder == ">" else "<"
            read_length = struct.Struct(order + count_type.char).unpack_from
            lists.append((gap, read_length, count_type.itemsize, value_type.itemsize))
            list_columns.append(number)
            gap = 0
    tail = gap

    run_starts: list[list[int]] = [[] for _ in range(len(lists) + 1)]
    lengths: list[list[int]] = [[] for _ in lists]
    at = start
    for _ in range(element.n_rows):
        for k, (before, read_length, length_size, item_size) in enumerate(lists):
            run_starts[k].append(at)
            at += before
            length = int(read_length(body, at)[0])
            if length < 0:
                raise FileError(f"the element {element.name} has a list of negative length")
            lengths[k].append(length)
            at += length_size + length * item_size
        run_starts[-1].append(at)
        at += tail

    starts = [np.array(run, np.int64) for run in run_starts]
    positions = {number: starts[run] + offset for number, (run, offset) in scalar_at.items()}
    counts = {}
    for k, number in enumerate(list_columns):
        before, _, length_size, _ = lists[k]
        positions[number] = starts[k] + before + length_size
        counts[number] = np.array(lengths[k], np.int64)
    return positions, counts, at


def _gather(
    body: Bytes, positions: Positions, lengths: Positions, value_type: np.dtype[Any]
) -> NDArray[Any]:
    """Collect values that stand in runs of some lengths at some positions."""
    before = np.cumsum(lengths) - lengths
    place_in_run = np.arange(lengths.sum()) - np.repeat(before, lengths)
    at = np.repeat(positions, lengths) + place_in_run * value_type.itemsize
    gathered = body[at[:, None] + np.arange(value_type.itemsize)]
    return np.ascontiguousarray(gathered).view(value_type).reshape(-1)
