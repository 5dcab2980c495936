"""Isosurfaces of voxel volumes by marching tetrahedra."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.arrays import MAX_CORNERS, as_triple, as_volume
from tetsimplify.errors import OptionError, VolumeError
from tetsimplify.lattices import Tables, lattice_tables
from tetsimplify.mesh import Mesh

Progress = Callable[[str, float], object]

BYTES_READ_AT_ONCE = 2**24  # of float64 samples; a few planes of a volume in any memory order
GROWTH = 1.25  # of the arrays of the result: at most a quarter of them is to spare


def extract_isosurface(
    volume: Any,
    level: float,
    *,
    spacing: Sequence[float] = (1.0, 1.0, 1.0),
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    lattice: str = "kuhn",
    closed: bool = False,
    normals: str = "lower",
    progress: Progress | None = None,
) -> Mesh:
    """Extract the surface where a volume has the value `level`.

    The surface is a 2-manifold, consistently oriented, with boundary only on the sides of
    the volume. Memory beyond the result is that of a few planes of the volume.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2), any real dtype
        Samples, at least two along each axis; in any memory order.
    level : float
        The iso-value. Samples equal to it count as outside.
    spacing : three floats
        Distance between samples along the three axes, in the units that you want.
    origin : three floats
        Position of sample (0, 0, 0).
    lattice : str
        How cubes are cut into tetrahedra; see :data:`tetsimplify.lattices.LATTICES`.
    closed : bool
        Close the surface with caps on the sides of the volume where these are inside.
    normals : {"lower", "higher"}
        The side that normals point to. With "lower" the solid is where values are above the
        level, with "higher" where they are below.
    progress : callable, optional
        Called as ``progress("isosurface", done)`` with `done` from 0 to 1. Raise from it to
        cancel.

    Returns
    -------
    Mesh
        Vertices at ``origin + spacing * index``, coordinates in the order of the axes of the
        volume, which are taken as right-handed; faces in memory order, neighbours near each
        other. Empty when nothing crosses the level.

    Raises
    ------
    VolumeError
        When the volume has the wrong shape or dtype or holds NaN or infinity, or when the
        surface has more corners than int32 can count.
    OptionError
        When an option has a wrong value.

    Notes
    -----
    Where a sample (nearly) equals the level, a vertex keeps a distance of 1e-4 of the lattice
    edge from the sample, so that no edge has zero length and no face is degenerate.

    References
    ----------
    A. Doi and A. Koide. An efficient method of triangulating equi-valued surfaces by using
    tetrahedral cells. IEICE Trans. Inform. Systems E74-D(1), 1991, 214-224.

    Examples
    --------
    >>> import numpy as np
    >>> import tetsimplify
    >>> x, y, z = np.mgrid[-1:1:20j, -1:1:20j, -1:1:20j]
    >>> mesh = tetsimplify.extract_isosurface(0.8 - np.sqrt(x**2 + y**2 + z**2), 0.0)
    >>> tetsimplify.topology(*mesh).euler_characteristic
    2
    """
    samples = as_volume(volume)
    tables = lattice_tables(lattice)
    frame = (as_triple("spacing", spacing, positive=True), as_triple("origin", origin))
    if np.shape(level) or np.asarray(level).dtype.kind not in "biuf" or not np.isfinite(level):
        raise OptionError(f"level must be a finite number, got {level!r}")
    if normals not in ("lower", "higher"):
        raise OptionError(f"normals must be 'lower' or 'higher', got {normals!r}")

    march = _March(samples.shape, float(level), frame, tables, closed)
    for plane in _planes(samples, float(level), above=normals == "lower"):
        march.add(plane)
        if progress is not None:
            progress("isosurface", march.n_planes / samples.shape[0])
    return march.finish()


class _Plane(NamedTuple):
    """One plane of samples."""

    samples: NDArray[np.float64]
    inside: NDArray[np.bool_]


def _planes(volume: Any, level: float, above: bool) -> Iterator[_Plane]:
    """Read a volume along its first axis, a few planes at a time."""
    bytes_of_plane = 8 * volume.shape[1] * volume.shape[2]
    at_once = max(1, BYTES_READ_AT_ONCE // bytes_of_plane)
    for begin in range(0, volume.shape[0], at_once):
        block = np.ascontiguousarray(volume[begin : begin + at_once])
        is_float = block.dtype.kind == "f"
        with np.errstate(over="ignore"):  # of types wider than float64
            block = block.astype(np.float64, copy=False)
        if is_float and not np.isfinite(block).all():
            index = np.argwhere(~np.isfinite(block))[0] + (begin, 0, 0)
            raise VolumeError(
                f"volume must be finite, got {volume[tuple(index)]} at index {index.tolist()}"
            )
        inside = block > level if above else block < level
        yield from (_Plane(*pair) for pair in zip(block, inside, strict=True))


class _Rows:
    """Rows of three that are added to, in an array that grows in place.

    Where the system can map a large block of memory elsewhere nothing is copied, and nothing is
    ever there twice.
    """

    def __init__(self, dtype: type) -> None:
        self._rows: NDArray[Any] = np.empty((0, 3), dtype)
        self.n_rows = 0

    def add(self, n_rows: int) -> NDArray[Any]:
        """A view of new rows, to be filled before more are added."""
        begin = self.n_rows
        self.n_rows += n_rows
        if self.n_rows > len(self._rows):
            self._resize(max(self.n_rows, int(GROWTH * len(self._rows))))
        return self._rows[begin : self.n_rows]

    def finish(self) -> NDArray[Any]:
        """Exactly the rows added."""
        self._resize(self.n_rows)
        return self._rows

    def _resize(self, n_rows: int) -> None:
        self._rows.resize((n_rows, 3), refcheck=False)  # no view is in use any more


class _March:
    """Takes planes one by one and keeps what the next cubes need of the last three."""

    def __init__(
        self,
        shape: tuple[int, int, int],
        level: float,
        frame: tuple[NDArray[np.float64], NDArray[np.float64]],
        tables: Tables,
        closed: bool,
    ) -> None:
        self.shape, self.level, self.tables, self.closed = shape, level, tables, closed
        self.spacing, self.origin = frame
        self.n_planes = 0
        self._n_slots = len(tables.slot_ends)
        plane_size = shape[1] * shape[2]
        if plane_size * self._n_slots > MAX_CORNERS:
            raise VolumeError(f"planes of {shape[1]} x {shape[2]} samples are too large")
        # of the planes with even and odd numbers: vertices of the slots; active cubes
        self._slot_vertex = np.empty((2, plane_size * self._n_slots), np.int32)
        self._cubes = np.empty((2, plane_size), np.int32)
        self._colours = np.empty((2, plane_size), np.uint8)
        self._n_cubes = [0, 0]
        self._edges = np.empty(plane_size * self._n_slots, np.int32)
        self._previous: _Plane | None = None
        self._vertices = _Rows(np.float64)
        self._faces = _Rows(np.int32)

    def add(self, plane: _Plane) -> None:
        """Take the next plane: scan the one before, fill the cubes below that."""
        if self._previous is not None:
            self._scan(self.n_planes - 1, self._previous, plane)
        self._previous = plane
        self.n_planes += 1

    def finish(self) -> Mesh:
        """Scan the last plane and hand over the result."""
        assert self._previous is not None
        self._scan(self.n_planes - 1, self._previous, self._previous)
        return Mesh(self._vertices.finish(), self._faces.finish())

    def _scan(self, z: int, low: _Plane, high: _Plane) -> None:
        n_numbered, self._n_cubes[z % 2] = kernels.marching.scan_plane(
            low.inside.view(np.uint8),
            high.inside.view(np.uint8),
            z,
            self.shape[0],
            self.closed,
            self.tables,
            self._vertices.n_rows,
            self._slot_vertex[z % 2],
            self._edges,
            self._cubes[z % 2],
            self._colours[z % 2],
        )
        if n_numbered:
            if self._vertices.n_rows + n_numbered > MAX_CORNERS:
                raise VolumeError(f"the surface has more than {MAX_CORNERS:,} vertices")
            kernels.marching.place_vertices(
                low.samples,
                high.samples,
                self.level,
                z,
                self.spacing,
                self.origin,
                self.tables,
                self._edges[:n_numbered],
                self._vertices.add(n_numbered),
            )
        if z > 0:
            self._emit(z - 1)

    def _emit(self, z: int) -> None:
        """Write the triangles of the cubes between planes z and z + 1."""
        cubes = self._cubes[z % 2][: self._n_cubes[z % 2]]
        if not len(cubes):
            return
        colours = self._colours[z % 2][: len(cubes)]
        self._emit_table(z, cubes, colours, self.tables.first, self.tables.triangles)
        if not self.closed:
            return
        rows, columns = np.divmod(cubes, self.shape[2])
        z_of_cubes = np.full(len(cubes), z)
        for axis, index in enumerate((z_of_cubes, rows, columns)):
            for high, side_index in enumerate((0, self.shape[axis] - 2)):
                on_side = index == side_index
                if on_side.any():
                    first = self.tables.cap_first[2 * axis + high]
                    table = (first, self.tables.cap_triangles)
                    self._emit_table(z, cubes[on_side], colours[on_side], *table)

    def _emit_table(
        self,
        z: int,
        cubes: NDArray[np.int32],
        colours: NDArray[np.uint8],
        first: NDArray[np.int32],
        triangles: NDArray[np.int32],
    ) -> None:
        n_faces = kernels.marching.count_triangles(colours, first)
        if 3 * (self._faces.n_rows + n_faces) > MAX_CORNERS:
            raise VolumeError(f"the surface has more than {MAX_CORNERS:,} face corners")
        kernels.marching.emit_triangles(
            cubes,
            colours,
            self.shape[2],
            first,
            triangles,
            self._slot_vertex[z % 2],
            self._slot_vertex[(z + 1) % 2],
            self._n_slots,
            self._faces.add(n_faces),
        )
