"""OFF: the text format of Geomview."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError
from tetsimplify.io.polygons import mesh_of_polygons
from tetsimplify.io.text import parse_numbers, parse_rows, write_rows
from tetsimplify.mesh import NORMALS, Mesh

# Texture, colour and normal may follow the position of a vertex (ST, C, N). Positions in
# four or in n dimensions (4, n) and binary files are not for us.
HEADER = re.compile(rb"(ST)?C?N?OFF")
COMMENT = re.compile(rb"#[^\r\n]*")


def read(path: Path) -> Mesh:
    """Read an OFF file, with or without colours and normals."""
    text = COMMENT.sub(b"", path.read_bytes())
    lines = [line for line in text.splitlines() if line and not line.isspace()]
    n_points, n_faces, start = _read_counts(lines)
    points = lines[start : start + n_points]
    faces = lines[start + n_points : start + n_points + n_faces]
    if len(faces) < n_faces or len(points) < n_points:
        raise FileError(
            f"it ends after {len(points):,} of {n_points:,} vertices and {len(faces):,} of "
            f"{n_faces:,} faces"
        )
    return mesh_of_polygons(parse_rows(points, 3), *_parse_faces(faces))


def write(path: Path, mesh: Mesh, data: Mapping[str, NDArray[Any]] | None = None) -> None:
    """Write an OFF file, NOFF with normals; numbers are printed to read back exactly."""
    rows = np.hstack([mesh.vertices, data[NORMALS]]) if data else mesh.vertices
    with open(path, "wb") as file:
        word = "NOFF" if data else "OFF"
        file.write(f"{word}\n{len(mesh.vertices)} {len(mesh.faces)} 0\n".encode("ascii"))
        write_rows(file, f"{' '.join(['%r'] * rows.shape[1])}\n", rows)
        write_rows(file, "3 %d %d %d\n", mesh.faces)


def _read_counts(lines: list[bytes]) -> tuple[int, int, int]:
    """Read the counts, on the line of the keyword or the next; tell the line after them."""
    words = lines[0].split() if lines else [b""]
    if not HEADER.fullmatch(words[0]) or words[1:] == [b"BINARY"]:
        found = b" ".join(words).decode("latin-1")[:40]
        raise FileError(f"it must begin with OFF, COFF or NOFF, not {found!r}")
    start = 1
    counts = words[1:]
    if not counts and len(lines) > 1:
        counts, start = lines[1].split(), 2
    if len(counts) < 2:
        raise FileError("there are no counts of vertices and faces behind OFF")
    return int(counts[0]), int(counts[1]), start


def _parse_faces(lines: list[bytes]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Read the number of corners and the corners of each face, and pass over its colour."""
    n_words = np.array([len(line.split()) for line in lines], np.int64)
    n_corners = np.array([int(line.split(None, 1)[0]) for line in lines], np.int64)
    if (n_words < n_corners + 1).any():
        raise FileError(f"face {np.argmax(n_words < n_corners + 1)} has fewer corners than it says")
    if (n_words > n_corners + 1).any():
        pairs = zip(lines, n_corners.tolist(), strict=True)
        lines = [b" ".join(line.split()[: n + 1]) for line, n in pairs]
    numbers = parse_numbers(b" ".join(lines), np.int64)
    is_count = np.zeros(len(numbers), np.bool_)
    is_count[np.cumsum(n_corners + 1) - n_corners - 1] = True
    return n_corners, numbers[~is_count]
