"""OBJ: Wavefront text files. Only positions and faces are read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError
from tetsimplify.io.polygons import log, mesh_of_polygons
from tetsimplify.io.text import parse_numbers, parse_rows, write_rows
from tetsimplify.mesh import NORMALS, Mesh

COMMENT = re.compile(rb"#[^\r\n]*")
LINE_CONTINUED = re.compile(rb"\\\r?\n")
TEXTURE_AND_NORMAL = re.compile(rb"/\S*")  # of a corner "vertex/texture/normal"


def read(path: Path) -> Mesh:
    """Read the vertices and faces of an OBJ file, whatever groups they belong to."""
    vertices: list[bytes] = []
    faces: list[bytes] = []
    n_vertices_before: list[int] = []
    n_other = 0
    for line in _lines(path):
        keyword, _, rest = line.partition(b" ")
        if keyword == b"v":
            vertices.append(rest)
        elif keyword == b"f":
            faces.append(rest)
            n_vertices_before.append(len(vertices))
        elif keyword in (b"l", b"p"):
            n_other += 1
    if n_other:
        log.warning("%s lines and points left out: only faces are read", f"{n_other:,}")
    n_corners = np.array([len(face.split()) for face in faces], np.int64)
    corners = parse_numbers(TEXTURE_AND_NORMAL.sub(b"", b" ".join(faces)), np.int64)
    before = np.repeat(np.array(n_vertices_before, np.int64), n_corners)
    # A weight or a colour may follow the three coordinates.
    return mesh_of_polygons(parse_rows(vertices, 3), n_corners, _as_indices(corners, before))


def write(path: Path, mesh: Mesh, data: Mapping[str, NDArray[Any]] | None = None) -> None:
    """Write an OBJ file; positions and normals are printed so that they read back exactly."""
    numbers = mesh.faces.astype(np.int64) + 1
    with open(path, "wb") as file:
        file.write(b"# tetsimplify\n")
        write_rows(file, "v %r %r %r\n", mesh.vertices)
        if data:
            write_rows(file, "vn %r %r %r\n", data[NORMALS])
            write_rows(file, "f %d//%d %d//%d %d//%d\n", np.repeat(numbers, 2, axis=1))
        else:
            write_rows(file, "f %d %d %d\n", numbers)


def _lines(path: Path) -> list[bytes]:
    """Lines without comments and tabs; a backslash joins a line with the next."""
    text = path.read_bytes().replace(b"\t", b" ")
    if b"#" in text:
        text = COMMENT.sub(b"", text)
    if b"\\" in text:
        text = LINE_CONTINUED.sub(b" ", text)
    return [line.lstrip() for line in text.splitlines()]


def _as_indices(numbers: NDArray[np.int64], n_before: NDArray[np.int64]) -> NDArray[np.int64]:
    """Turn vertex numbers, from 1, or back from the last so far by -1, into indices."""
    if (numbers == 0).any():
        raise FileError("a face refers to vertex 0, but OBJ counts from 1")
    return np.where(numbers > 0, numbers - 1, numbers + n_before)
