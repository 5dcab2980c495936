"""STL: a soup of triangles, in text or binary.

An STL file has no vertices, only three corners for every triangle, in single precision.
Corners with exactly equal coordinates are made one vertex on reading.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError
from tetsimplify.io.polygons import log
from tetsimplify.mesh import Mesh

HEADER_SIZE = 80
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
FACETS_AT_ONCE = 1 << 20


def read(path: Path) -> Mesh:
    """Read an STL file and weld corners with exactly equal coordinates.

    Vertices are numbered in the order in which they are first met.
    """
    corners = _read_binary(path) if _is_binary(path) else _read_text(path)
    representatives, corner_vertex = weld(corners)
    vertices = corners[representatives].astype(np.float64)
    log.info(
        "STL holds no connectivity: %s corners with equal coordinates welded to %s vertices",
        f"{len(corners):,}",
        f"{len(vertices):,}",
    )
    return Mesh(vertices, corner_vertex.astype(np.int32).reshape(-1, 3))


def write(path: Path, mesh: Mesh) -> None:
    """Write binary STL. Positions are rounded to single precision."""
    corners = mesh.vertices.astype("<f4")
    _warn_of_merged_vertices(mesh, corners)
    with open(path, "wb") as file:
        file.write(b"tetsimplify".ljust(HEADER_SIZE))
        file.write(np.array(len(mesh.faces), "<u4").tobytes())
        for start in range(0, len(mesh.faces), FACETS_AT_ONCE):
            faces = mesh.faces[start : start + FACETS_AT_ONCE]
            facets = np.zeros(len(faces), FACET)
            facets["corners"] = corners[faces]
            facets["normal"] = _unit_normals(mesh.vertices, faces)
            facets.tofile(file)


def weld(points: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number points so that exactly equal ones have the same number.

    Parameters
    ----------
    points : ndarray, shape (n, 3), float32

    Returns
    -------
    representatives : ndarray, shape (k,), int64
        The first point of each number.
    numbers : ndarray, shape (n,), int64
        The number of each point, counted in the order of first appearance.
    """
    bits = (np.ascontiguousarray(points, np.float32) + 0.0).view(np.uint32)  # -0.0 becomes 0.0
    # Sorting one integer is many times faster than sorting rows, so rows are hashed first
    # and hashes that clash, should there be any, are told apart by sorting rows after all.
    _, first, numbers = np.unique(_hash(bits), return_index=True, return_inverse=True)
    if not np.array_equal(bits[first][numbers], bits):
        _, first, numbers = np.unique(bits, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[numbers.reshape(-1)]


def _hash(bits: NDArray[np.uint32]) -> NDArray[np.uint64]:
    # Multiply and fold, with the odd constants of the splitmix64 generator.
    mixed = bits[:, 0].astype(np.uint64)
    for column in (1, 2):
        mixed *= np.uint64(0xBF58476D1CE4E5B9)
        mixed ^= mixed >> np.uint64(29)
        mixed += bits[:, column]
    mixed *= np.uint64(0x94D049BB133111EB)
    return mixed ^ (mixed >> np.uint64(32))


def _is_binary(path: Path) -> bool:
    """Tell binary from text; some binary files begin with "solid" too."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        start = file.read(HEADER_SIZE + 4)
    if len(start) == HEADER_SIZE + 4:
        n_facets = int.from_bytes(start[HEADER_SIZE:], "little")
        if size == HEADER_SIZE + 4 + n_facets * FACET.itemsize:
            return True
    return not start.lstrip().lower().startswith(b"solid")


def _read_binary(path: Path) -> NDArray[np.float32]:
    with open(path, "rb") as file:
        header = file.read(HEADER_SIZE + 4)
        if len(header) < HEADER_SIZE + 4:
            raise FileError("it is too short for an STL file")
        n_facets = int.from_bytes(header[HEADER_SIZE:], "little")
        facets = np.fromfile(file, FACET, n_facets)
    if len(facets) < n_facets:
        raise FileError(f"it ends after {len(facets):,} of {n_facets:,} triangles")
    return facets["corners"].reshape(-1, 3)


def _read_text(path: Path) -> NDArray[np.float32]:
    corners: list[Any] = []
    n_facets = 0
    with open(path, "rb") as file:
        for line in file:
            words = line.split()
            if not words:
                continue
            keyword = words[0].lower()
            if keyword == b"vertex" and len(words) == 4:
                corners.append(words[1:])
            elif keyword == b"facet":
                n_facets += 1
            elif keyword not in (b"solid", b"outer", b"endloop", b"endfacet", b"endsolid"):
                raise FileError(f"a line makes no sense in an STL file: {line[:80]!r}")
    if len(corners) != 3 * n_facets:
        raise FileError(f"{n_facets:,} facets must have three corners each, not {len(corners):,}")
    numbers = [float(word) for words in corners for word in words]
    return np.array(numbers, np.float32).reshape(-1, 3)


def _unit_normals(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Normals of length 1, or 0 for triangles without area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    return normals / np.where(lengths > 0, lengths, 1.0)[:, None]


def _warn_of_merged_vertices(mesh: Mesh, rounded: NDArray[np.float32]) -> None:
    used = np.unique(mesh.faces)
    n_merged = len(used) - len(weld(rounded[used])[0])
    if n_merged:
        log.warning(
            "%s vertices fall on others in the single precision of STL: the surface read "
            "back will be joined there. PLY, OBJ and OFF keep it as it is",
            f"{n_merged:,}",
        )
