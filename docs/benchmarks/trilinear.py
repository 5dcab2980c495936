r"""Measure how near isosurfaces come to the surface of the trilinear function of the samples.

    python docs/benchmarks/trilinear.py mni152_mri.npz engine_ct.npz cranium_ct.npz \
        --levels 80.5 70.5 226.5 --markdown trilinear.md

Of each volume the middle is taken, in units of its samples. What stands for the trilinear surface
is that of the bcc lattice with four cubes along the edge of each. Distances are measured both ways,
at points all over the faces, a third of a sample apart: the mean, what 99.9 % of the area are
nearer than, the largest, and the places where it exceeds half a sample: how many, which are
connected faces, and their share of the area. Faces less than a sample from the sides of that middle
do not count, where surfaces end. The marching cubes of scikit-image (Lewiner's, whose cases are
those of the trilinear function) are measured likewise, and each surface against theirs.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from common import Row, as_markdown, as_rich, machine
from numpy.typing import NDArray
from rich.console import Console
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from skimage.measure import marching_cubes

from tetsimplify import Mesh, extract_isosurface, surface_distance
from tetsimplify.distance import DirectedDistance
from tetsimplify.io import read_volume

HALF = 0.5
REFERENCE = 4  # cubes along the edge of each
MARGIN = 1.0  # from the sides
SPLIT = 3  # of the edges of faces, for the points on them
WAYS: dict[str, dict[str, Any]] = {
    "kuhn": {"lattice": "kuhn"},
    "five": {"lattice": "five"},
    "bcc": {"lattice": "bcc"},
    "bcc, regularise": {"lattice": "bcc", "regularise": True},
    "kuhn, refine=2": {"lattice": "kuhn", "refine": 2},
    "bcc, refine=2": {"lattice": "bcc", "refine": 2},
}


class Found(NamedTuple):
    """Distances from one surface to another, in samples."""

    mean: float
    quantile: float
    largest: float
    places: int
    share: float


def middle(path: str, n: int) -> NDArray[Any]:
    """So many samples a side of a volume."""
    data = read_volume(path).data
    return np.asarray(
        data[tuple(slice(max(0, k // 2 - n // 2), k // 2 + n // 2) for k in data.shape)]
    )


def split(mesh: Mesh, n: int) -> Mesh:
    """The same surface with each face cut into n^2, whose corners are not shared."""
    corner = [(i, j) for i in range(n + 1) for j in range(n + 1 - i)]
    number = {pair: k for k, pair in enumerate(corner)}
    faces = []
    for i, j in corner:
        if i + j < n:
            faces.append([number[i, j], number[i + 1, j], number[i, j + 1]])
        if i + j < n - 1:
            faces.append([number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]])
    u, v = np.array(corner).T[..., None] / n
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    points = a[:, None] + u * (b - a)[:, None] + v * (c - a)[:, None]
    first = np.arange(len(mesh.faces))[:, None, None] * len(corner)
    return Mesh(points.reshape(-1, 3), (np.array(faces) + first).reshape(-1, 3).astype(np.int32))


def measured(a: Mesh, n_a: int, b: Mesh, n_b: int) -> tuple[Found, Found]:
    """Distances from `a` to `b` and back, at points of faces that are cut into n^2."""
    found = surface_distance(split(a, n_a), split(b, n_b), tolerance=0.5)
    high = np.maximum(a.vertices.max(axis=0), b.vertices.max(axis=0)) - MARGIN
    return one_way(a, found.a_to_b, high), one_way(b, found.b_to_a, high)


def one_way(mesh: Mesh, distance: DirectedDistance, high: NDArray[np.float64]) -> Found:
    """What there is to tell of the points of a mesh that are away from the sides."""
    corners = mesh.vertices[mesh.faces]
    inner = ((corners > MARGIN) & (corners < high)).all(axis=(1, 2))
    points = distance.vertex_distances.reshape(len(mesh.faces), -1)[inner]
    mesh = Mesh(mesh.vertices, mesh.faces[inner])
    p, q, r = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    area = np.linalg.norm(np.cross(q - p, r - p), axis=1)
    weights = np.repeat(area / area.sum() / points.shape[1], points.shape[1])
    order = np.argsort(points, axis=None)
    up_to = np.searchsorted(np.cumsum(weights[order]), 0.999)
    far = points > HALF
    return Found(
        float((weights * points.ravel()).sum()),
        float(points.ravel()[order[min(up_to, len(order) - 1)]]),
        float(points.max()),
        n_places(mesh.faces[far.any(axis=1)]),
        float(weights[far.ravel()].sum()),
    )


def n_places(faces: NDArray[np.int32]) -> int:
    """In how many pieces some faces are."""
    if not len(faces):
        return 0
    used, corners = np.unique(faces, return_inverse=True)
    a, b, c = corners.reshape(-1, 3).T
    joined = coo_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, c])), (len(used),) * 2)
    return int(connected_components(joined, directed=False)[0])


def rows_of(path: str, level: float, n: int) -> list[Row]:
    """One row for each way to extract the surface."""
    volume = middle(path, n)
    reference = Mesh(*extract_isosurface(volume, level, lattice="bcc", refine=REFERENCE))
    vertices, faces = marching_cubes(volume.astype(np.float32), level)[:2]
    cubes = Mesh(vertices.astype(np.float64), faces.astype(np.int32))
    surfaces = {"scikit-image": cubes}
    surfaces |= {name: Mesh(*extract_isosurface(volume, level, **o)) for name, o in WAYS.items()}
    rows = []
    for name, mesh in surfaces.items():
        n = max(1, SPLIT // WAYS.get(name, {}).get("refine", 1))
        there, back = measured(mesh, n, reference, 1)
        row = {
            "volume": Path(path).stem,
            "surface": name,
            "faces": f"{len(mesh.faces):,}",
            "mean": f"{max(there.mean, back.mean):.4f}",
            "99.9 %": f"{max(there.quantile, back.quantile):.2f}",
            "largest": f"{there.largest:.2f}, {back.largest:.2f}",
            "places": f"{there.places}, {back.places}",
            "of the area": f"{100 * max(there.share, back.share):.3f} %",
        }
        if mesh is not cubes:
            to, fro = measured(mesh, n, cubes, SPLIT)
            row |= {
                "against scikit-image: largest": f"{to.largest:.2f}, {fro.largest:.2f}",
                "places there": f"{to.places}, {fro.places}",
                "area there": f"{100 * max(to.share, fro.share):.3f} %",
            }
        else:
            row |= {"against scikit-image: largest": "", "places there": "", "area there": ""}
        rows.append(row)
    return rows


def main() -> None:
    """Print the table; write it too if asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("volumes", nargs="+", help="files of volumes")
    parser.add_argument("--levels", type=float, nargs="+", required=True, help="one for each")
    parser.add_argument("--side", type=int, default=48, help="samples a side of the middle")
    parser.add_argument("--markdown", type=Path, help="a file for the table")
    options = parser.parse_args()
    pairs = zip(options.volumes, options.levels, strict=True)
    rows = [row for path, level in pairs for row in rows_of(path, level, options.side)]
    title = "Distances to the trilinear surface and to scikit-image's, in samples, both ways"
    console = Console(width=200)
    console.print(as_rich(title, rows))
    console.print(machine())
    if options.markdown:
        options.markdown.write_text(as_markdown(title, rows))


if __name__ == "__main__":
    main()
