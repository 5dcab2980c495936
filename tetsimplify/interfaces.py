"""Interfaces between the labels of a volume: watertight, and shared by the labels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import combinations, permutations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import kernels
from tetsimplify.arrays import MAX_CORNERS, as_triple, as_volume
from tetsimplify.errors import OptionError, VolumeError
from tetsimplify.march import BYTES_AT_ONCE, LEAST_PLANES_AT_ONCE, Rows
from tetsimplify.mesh import Mesh
from tetsimplify.planes import Planes
from tetsimplify.workers import Workers

Progress = Callable[[str, float], object]
Chain = tuple[int, ...]  # corners of a cube, each one beyond the one before

BACKGROUND = 0
LARGEST_LABEL = 2**53
N_MORE = 2  # planes beyond a block that its slabs need


class Interfaces(NamedTuple):
    """The faces between labels, each once.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3), float64
    faces : ndarray, shape (m, 3), int32
        Where three labels meet, edges have three faces.
    face_labels : ndarray, shape (m, 2), int64
        The labels behind and before each face; the normal points to the second, which is the
        smaller one.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    face_labels: NDArray[np.int64]

    @property
    def labels(self) -> NDArray[np.int64]:
        """All labels that have faces, the background among them."""
        return np.unique(self.face_labels)

    def surface(self, label: int) -> Mesh:
        """The surface of one label, a 2-manifold whose normals point away from it.

        Surfaces of neighbours have the same vertices and faces between them.
        """
        behind, before = (self.face_labels == label).T
        faces = np.concatenate([self.faces[behind], self.faces[before][:, ::-1]])
        order = np.argsort(np.concatenate([np.flatnonzero(behind), np.flatnonzero(before)]))
        used, faces = np.unique(faces[order], return_inverse=True)
        return Mesh(self.vertices[used], faces.reshape(-1, 3).astype(np.int32))


class LabelSurface(Mesh):
    """The surface of one label: a pair of `vertices` and `faces`, and its `label`."""

    label: int

    def __new__(
        cls, vertices: NDArray[np.float64], faces: NDArray[np.int32], label: int = 0
    ) -> LabelSurface:
        """Make one of its parts."""
        self = super().__new__(cls, vertices, faces)
        self.label = label
        return self


def label_surfaces(
    volume: ArrayLike,
    labels: Sequence[int] | str,
    *,
    is_outward: bool = True,
    **options: Any,
) -> list[LabelSurface]:
    """Extract one surface for each of some labels.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2), any integer or boolean dtype
    labels : "all" or sequence of int
        "all" are all that there are but the background, which is 0.
    is_outward : bool
        Whether normals point away from the label, or to it.
    **options
        Those of :func:`extract_interfaces`.

    Returns
    -------
    list of LabelSurface
        In the order of `labels`, or of their numbers. Empty ones for labels that there are not.

    Raises
    ------
    VolumeError, OptionError
        See :func:`extract_interfaces`.
    """
    if isinstance(labels, str) and labels != "all":
        raise OptionError(f"labels must be 'all' or a list of integers, got {labels!r}")
    wanted = _as_labels(None if isinstance(labels, str) else labels)
    if wanted is not None and BACKGROUND in wanted:
        raise OptionError(f"labels must not be {BACKGROUND}, which is the background")
    found = extract_interfaces(volume, wanted, **options)  # type: ignore[arg-type]
    each = found.labels[found.labels != BACKGROUND] if wanted is None else wanted
    surfaces = []
    for label in each.tolist():
        vertices, faces = found.surface(label)
        faces = faces if is_outward else np.ascontiguousarray(faces[:, ::-1])
        surfaces.append(LabelSurface(vertices, faces, label))
    return surfaces


def extract_interfaces(
    volume: ArrayLike,
    labels: Sequence[int] | None = None,
    *,
    spacing: Sequence[float] = (1.0, 1.0, 1.0),
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    closed: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Interfaces:
    """Extract the interfaces between the labels of a volume.

    The lattice is that of Kuhn. Every face separates two labels; the faces of each label make a
    2-manifold with the topology of the isosurface of that label alone.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2), any integer or boolean dtype
        Labels; read a few planes at a time, as by :func:`~tetsimplify.extract_isosurface`.
    labels : sequence of int, optional
        Those that are wanted; all others become background, which is 0. All if not given.
    spacing, origin : three floats
        Distance between samples along the three axes, and position of sample (0, 0, 0).
    closed : bool
        Surround the volume with background, so that the surfaces are closed, half a sample
        beyond its sides. If not, they end on the sides.
    threads : int, optional
        How many threads to use; all cores that the process may use if not given. The result
        is the same for any number.
    progress : callable, optional
        Called as ``progress("interfaces", done)`` with `done` from 0 to 1. Raise from it to
        cancel.

    Returns
    -------
    Interfaces

    Raises
    ------
    VolumeError
        When the volume has the wrong shape or holds no integers, or when there are more
        corners than int32 can count.
    OptionError
        When an option has a wrong value.

    Examples
    --------
    >>> import numpy as np
    >>> from tetsimplify.interfaces import extract_interfaces
    >>> from tetsimplify.topology import topology
    >>> volume = np.zeros((6, 6, 6), np.uint8)
    >>> volume[1:5, 1:5, 1:3], volume[1:5, 1:5, 3:5] = 1, 2
    >>> interfaces = extract_interfaces(volume)
    >>> [topology(*interfaces.surface(label)).euler_characteristic for label in (1, 2)]
    [2, 2]
    """
    source = as_volume(volume)
    if np.dtype(source.dtype).kind not in "biu":
        raise VolumeError(f"volume must hold integers as labels, got dtype {source.dtype}")
    frame = np.array([as_triple("spacing", spacing, positive=True), as_triple("origin", origin)])
    chosen = _Chosen(source, _as_labels(labels), int(bool(closed)))
    frame[1] -= frame[0] * chosen.width
    tables, planes = interface_tables(), Planes(chosen)
    n_planes, n1, n2 = planes.shape
    at_once = max(LEAST_PLANES_AT_ONCE, BYTES_AT_ONCE // (8 * n1 * n2))

    out = Rows(np.float64, 3), Rows(np.int32, 3), Rows(np.int64, 2)
    with Workers(threads) as workers:
        for begin in range(0, n_planes, at_once):
            end = min(begin + at_once, n_planes)
            block = planes.take(begin, min(end + N_MORE, n_planes), workers)
            _add(block, begin, end, tables, frame, workers, out)
            if progress is not None:
                progress("interfaces", end / n_planes)
    return Interfaces(*(rows.finish() for rows in out))


def _add(
    block: NDArray[np.float64],
    begin: int,
    end: int,
    tables: Any,
    frame: NDArray[np.float64],
    workers: Workers,
    out: tuple[Rows, Rows, Rows],
) -> None:
    """Add what is in some planes."""
    slabs = workers.parts(begin, end)

    def count(slab: tuple[int, int]) -> tuple[int, int]:
        return kernels.interfaces.count_slab(block, begin, *slab, tables, np.empty(8))

    counts = np.array(workers.map(count, slabs))
    before = out[0].n_rows, out[1].n_rows
    ends = np.cumsum(counts, axis=0) + before
    if ends[-1, 0] > MAX_CORNERS or 3 * ends[-1, 1] > MAX_CORNERS:
        raise VolumeError(f"there are more than {MAX_CORNERS:,} vertices or face corners")
    for rows, n in zip(out, ends[-1][[0, 1, 1]].tolist(), strict=True):
        rows.extend(n)
    begins = ends - counts

    def fill(k: int) -> None:
        of_vertices, of_faces = (slice(*pair) for pair in zip(begins[k], ends[k], strict=True))
        target = kernels.interfaces.InterfaceOutput(
            out[0].rows[of_vertices], out[1].rows[of_faces], out[2].rows[of_faces]
        )
        numbers = np.empty((2, block.shape[1] * block.shape[2]), np.int64)
        start = int(begins[k, 0])
        kernels.interfaces.fill_slab(
            block, begin, *slabs[k], tables, start, frame, numbers, np.empty(8), target
        )

    workers.map(fill, range(len(slabs)))


def _as_labels(labels: Any) -> NDArray[np.int64] | None:
    if labels is None:
        return None
    chosen = np.asarray(labels)
    if chosen.ndim != 1 or (chosen.size and chosen.dtype.kind not in "iu"):
        raise OptionError(f"labels must be a list of integers, got {labels!r}")
    return chosen.astype(np.int64)


class _Chosen:
    """The labels that are wanted, with background around them: read by slices."""

    def __init__(self, volume: Any, labels: NDArray[np.int64] | None, width: int) -> None:
        self._volume, self._labels, self.width = volume, labels, width
        self.shape = tuple(n + 2 * width for n in volume.shape)
        self.dtype = np.dtype(np.int64)

    def __getitem__(self, planes: slice) -> NDArray[np.int64]:
        width = self.width
        found = np.full((planes.stop - planes.start, *self.shape[1:]), BACKGROUND, np.int64)
        begin = max(planes.start - width, 0)
        end = min(planes.stop - width, self._volume.shape[0])
        if begin < end:
            block = np.asarray(self._volume[begin:end]).astype(np.int64)
            if np.abs(block).max() > LARGEST_LABEL:
                raise VolumeError(f"labels must not exceed {LARGEST_LABEL}")
            if self._labels is not None:
                block[~np.isin(block, self._labels)] = BACKGROUND
            at = begin + width - planes.start
            inner = (slice(width, n - width) for n in self.shape[1:])
            found[(slice(at, at + len(block)), *inner)] = block
        return found


# ---------------------------------------------------------------------------- tables


@cache
def interface_tables() -> Any:
    """What is between the labels of a tetrahedron, for every way in which some are equal."""
    tetrahedra = [(0, a, a + b, 7) for a, b, _ in permutations((1, 2, 4))]
    simplices = {chain for t in tetrahedra for k in (2, 3, 4) for chain in combinations(t, k)}
    chains = sorted({_at_site(chain)[1] for chain in simplices}, key=lambda c: (len(c), c))
    rows = np.zeros((6, 64, 2), np.int32)
    triangles: list[list[tuple[int, int]]] = []
    sides: list[tuple[int, int]] = []
    for number, tetrahedron in enumerate(tetrahedra):
        for classes in _partitions(4):
            pairs = enumerate(combinations(classes, 2))
            pattern = sum((a == b) << k for k, (a, b) in pairs)
            begin = len(triangles)
            for behind, before, polygon in _polygons(tetrahedron, classes):
                anchored = [_at_site(chain) for chain in polygon]
                corners = [(site, chains.index(chain)) for site, chain in anchored]
                for k in range(1, len(polygon) - 1):
                    triangles.append([corners[0], corners[k], corners[k + 1]])
                    sides.append((behind, before))
            rows[number, pattern] = begin, len(triangles)
    padded = [chain + chain[-1:] * (4 - len(chain)) for chain in chains]
    return kernels.interfaces.InterfaceTables(
        np.array(padded, np.int32),
        np.array(tetrahedra, np.int32),
        rows,
        np.array(triangles, np.int32),
        np.array(sides, np.int32),
    )


def _partitions(n: int) -> list[tuple[int, ...]]:
    """All ways to put `n` things into classes, numbered in the order in which they appear."""
    found: list[tuple[int, ...]] = [()]
    for _ in range(n):
        found = [(*p, c) for p in found for c in range(max(p, default=-1) + 2)]
    return found


def _at_site(chain: Chain) -> tuple[int, Chain]:
    """The site of a simplex, as a corner, and the simplex relative to it."""
    return chain[0], tuple(corner ^ chain[0] for corner in chain)


def _polygons(tetrahedron: Chain, classes: tuple[int, ...]) -> list[tuple[int, int, list[Chain]]]:
    """The polygons between the labels of a tetrahedron.

    Returns
    -------
    list of (behind, before, polygon)
        A corner on either side, and the simplices in the middle of which its vertices are,
        anticlockwise as seen from before.

    Notes
    -----
    ::

        three labels, A twice              four labels: six quadrilaterals like this one

            A|B:  A1B  A2B  A2BC  A1BC         A|B:  AB  ABC  ABCD  ABD
            A|C:  A1C  A2C  A2BC  A1BC
            B|C:  BC  A1BC  A2BC
    """
    label = dict(zip(tetrahedron, classes, strict=True))
    n_labels = len(set(classes))
    found = []
    for p, q in combinations(sorted(set(classes)), 2):
        behind = [corner for corner in tetrahedron if label[corner] == p]
        before = [corner for corner in tetrahedron if label[corner] == q]
        others = [corner for corner in tetrahedron if label[corner] not in (p, q)]
        edges = [_chain(a, b) for a in behind for b in before]
        if n_labels == 2:
            polygon = edges
            if len(edges) == 4:
                polygon = [edges[0], edges[1], edges[3], edges[2]]
        elif n_labels == 4:
            (a, b), (c, d) = edges[0], others
            polygon = [edges[0], _chain(a, b, c), tetrahedron, _chain(a, b, d)]
        elif len(edges) == 2:
            (c,) = others
            polygon = [edges[0], edges[1], _chain(*edges[1], c), _chain(*edges[0], c)]
        else:
            polygon = [edges[0], *(_chain(*edges[0], c) for c in others)]
        outwards = _position(before) - _position(behind)
        corners = [_position(chain) for chain in polygon[:3]]
        if np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ outwards < 0:
            polygon = polygon[::-1]
        found.append((behind[0], before[0], polygon))
    return found


def _chain(*corners: int) -> Chain:
    return tuple(sorted(corners))


def _position(corners: Sequence[int]) -> NDArray[np.float64]:
    """The middle of some corners of a cube."""
    return np.mean([(c >> 2 & 1, c >> 1 & 1, c & 1) for c in corners], axis=0)
