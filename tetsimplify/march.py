"""Marching tetrahedra over a whole volume: block by block, each block by several threads.

A block is as many planes as are held at once. It is taken in passes, and each pass in slabs of a
few planes that know nothing of each other: which samples are inside; how many vertices and
triangles there will be; and then, when every slab knows its place in the result, the vertices and
triangles themselves. So the result is the same however it is divided.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.arrays import MAX_CORNERS
from tetsimplify.errors import VolumeError
from tetsimplify.planes import Planes
from tetsimplify.tables import Tables
from tetsimplify.workers import Workers

BYTES_AT_ONCE = 2**24  # of samples
BYTES_IN_PLACE = 2**32  # the same where nothing is copied, so that the result can be made at once
LEAST_PLANES_AT_ONCE = 4
LEAST_SAMPLES_OF_SLAB = 2**15  # below that a thread takes longer to wake up than to work
GROWTH = 1.25  # of the arrays of the result: at most a quarter of them is to spare
LIKELY = 1.25  # times as many rows as if the other planes were like those before
MOST_ROOM = 16  # times the rows that there are is made at once


class Raw(NamedTuple):
    """The surface of a block as a mesh of its own, complete but for what lies around its planes."""

    vertices: NDArray[np.float64]
    """Shape (n, 3): those of the block, and then those of the next plane."""
    faces: NDArray[np.int32]
    n_below: int
    """So many of the first vertices are the last ones of the block before, in the same order."""
    n_above: int
    """So many of the last vertices are the first ones of the next block."""


class Block(NamedTuple):
    """Planes of a volume that are taken at once, and as many more as their cubes need."""

    begin: int
    end: int
    first: int
    """The first plane of the samples, which is `begin` or the one before."""
    n_planes: int
    """Planes of the volume."""
    samples: NDArray[Any]
    """Float64 or float32, of planes from `first` to some planes beyond `end`."""
    centres: NDArray[np.float64]
    """Values given for the centres of the cubes above these planes, none for their means."""


def blocks(
    volume: Planes,
    centres: Planes | None,
    tables: Tables,
    workers: Workers,
    n_before: int = 0,
    ends: Sequence[int] | None = None,
) -> Iterator[Block]:
    """Read a volume block by block, with so many planes before each.

    Blocks end before the planes `ends`. If none are given, the planes that are read for a block end
    where those of a chunk end, if these are not too many.
    """
    n_planes, n1, n2 = volume.shape
    n_more = 3 if tables.has_centres else 2
    if ends is None:
        n_bytes = BYTES_IN_PLACE if volume.is_in_place else BYTES_AT_ONCE
        at_once = max(LEAST_PLANES_AT_ONCE, n_bytes // (volume.dtype.itemsize * n1 * n2))
        at_once -= at_once % volume.planes_of_chunk if volume.planes_of_chunk < at_once else 0
        ends = [*range(at_once - n_more, n_planes - n_more, at_once), n_planes]
    for begin, end in pairwise([0, *ends]):
        first, last = max(begin - n_before, 0), min(end + n_more, n_planes)
        samples = volume.take(first, last, workers)
        middles = np.empty((0, n1 - 1, n2 - 1))
        if centres is not None and first < n_planes - 1:
            middles = centres.take(first, min(last, n_planes - 1), workers)
            if not np.isfinite(middles).all():
                centres.refuse(middles, first)
        yield Block(begin, end, first, n_planes, samples, middles)


class March:
    """Takes the blocks of a volume one after the other and makes the surface at one level.

    Parameters
    ----------
    volume : Planes
    level : float
    above : bool
        Whether inside is above the level.
    frame : ndarray, shape (2, 3)
        Spacing and origin.
    tables : Tables
    workers : Workers
    traced : bool
        Keep the lattice edge of every vertex.
    """

    def __init__(
        self,
        volume: Planes,
        level: float,
        above: bool,
        frame: NDArray[np.float64],
        tables: Tables,
        workers: Workers,
        traced: bool = False,
    ) -> None:
        _, n1, n2 = volume.shape
        if n1 * n2 > MAX_CORNERS:
            raise VolumeError(f"planes of {n1} x {n2} samples are too large")
        self.level, self.above, self.frame, self.tables = level, above, frame, tables
        self.volume, self.shape = volume, volume.shape
        self._colours = _Colours(volume, level, above, tables.has_centres, workers)
        self._workers, self._traced = workers, traced
        self._numbers_shape = (2, n1 * n2)
        self._scratch: list[tuple[NDArray[Any], ...]] = []
        self.vertices = Rows(np.float64, 3)
        self.faces = Rows(np.int32, 3)
        self.edges = Rows(np.int64)
        self.ratios = Rows(np.float64)
        self._n_shared = 0

    def add(self, block: Block, tell: Callable[[float], object]) -> slice:
        """Take the next block; return which vertices are new.

        `tell` is called with the part of the block that is done, from 0 to 1.
        """
        return self._add(block, self._colours.window(block), tell)

    def take(self, block: Block) -> Raw:
        """Take the next block, and hand over its surface instead of adding it to what there is."""
        window = self._colours.window(block)
        is_last = block.end == block.n_planes
        n_above = 0 if is_last else self._count(window, (block.end, block.end + 1))[0]
        self._add(block, window, lambda done: None, n_above)
        raw = Raw(self.vertices.finish(), self.faces.finish(), self._n_shared, n_above)
        self._n_shared = n_above
        return raw

    def _add(
        self, block: Block, window: Any, tell: Callable[[float], object], n_above: int = 0
    ) -> slice:
        slabs = self._workers.parts(block.begin, block.end, self._colours.least_planes)
        counts = np.array(self._workers.map(lambda slab: self._count(window, slab), slabs))
        before = self.vertices.n_rows, self.faces.n_rows
        ends = np.cumsum(counts, axis=0) + before
        ends[-1, 0] += n_above  # which the last slab places, too
        counts[-1, 0] += n_above
        n_vertices, n_faces = ends[-1].tolist()
        for n, name in ((n_vertices, "vertices"), (3 * n_faces, "face corners")):
            if n > MAX_CORNERS:
                raise VolumeError(f"the surface has more than {MAX_CORNERS:,} {name}")
        growth = LIKELY * block.n_planes / block.end if block.end < block.n_planes else 1.0
        of_vertices = n_vertices, int(growth * n_vertices)
        self.vertices.extend(*of_vertices)
        self.faces.extend(n_faces, int(growth * n_faces))
        if self._traced:
            self.edges.extend(*of_vertices)
            self.ratios.extend(*of_vertices)
        begins = ends - counts
        filled = self._workers.each(
            lambda k: self._fill(window, slabs[k], begins[k].tolist(), ends[k].tolist()),
            range(len(slabs)),
        )
        for n_done, _ in enumerate(filled, 1):
            tell(n_done / len(slabs))
        return slice(before[0], n_vertices)

    def _count(self, window: Any, slab: tuple[int, int]) -> tuple[int, int]:
        _, row = scratch = self._scratch_space()
        counts = kernels.marching.count_slab(window, self.tables, *slab, row)
        self._scratch.append(scratch)
        return counts

    def _fill(self, window: Any, slab: tuple[int, int], begin: list[int], end: list[int]) -> None:
        numbers, row = scratch = self._scratch_space()
        of_vertices, of_faces = slice(begin[0], end[0]), slice(begin[1], end[1])
        out = kernels.marching.Output(
            self.vertices.rows[of_vertices],
            self.faces.rows[of_faces],
            self.edges.rows[of_vertices],
            self.ratios.rows[of_vertices],
        )
        kernels.marching.fill_slab(
            window, self.tables, *slab, begin[0], self.frame, numbers, row, out
        )
        self._scratch.append(scratch)

    def _scratch_space(self) -> tuple[NDArray[Any], ...]:
        """Arrays that no other thread is using, of former slabs if there are any."""
        if self._scratch:
            return self._scratch.pop()
        row_of_sites = np.empty((2, self._colours.n_sites_of_row), np.int32)
        return np.empty(self._numbers_shape, np.int64), row_of_sites


class _Colours:
    """Which points are inside, of the planes at work. Each plane is looked at once."""

    def __init__(
        self, volume: Planes, level: float, above: bool, has_centres: bool, workers: Workers
    ) -> None:
        self._volume, self._level, self._above = volume, level, above
        self._has_centres, self._workers = has_centres, workers
        self.n_sites_of_row = volume.shape[2]
        self.least_planes = -(-LEAST_SAMPLES_OF_SLAB // (volume.shape[1] * volume.shape[2]))
        n_words = -(-volume.shape[2] // kernels.marching.WORD)
        self._samples = np.empty((0, volume.shape[1], n_words), np.uint32)
        self._centres = self._samples
        self._begin = self._end = 0

    def window(self, block: Block) -> Any:
        """A block as the kernels want it."""
        n_known, n = self._end - block.first, len(block.samples)
        moved_by = block.first - self._begin
        self._begin, self._end = block.first, block.first + n
        self._samples = _moved(self._samples, moved_by, n_known, n)
        self._colour_samples(block, n_known)
        if self._has_centres:
            self._centres = _moved(self._centres, moved_by, n_known, n)
        window = kernels.marching.Window(
            block.samples,
            self._samples,
            block.centres,
            self._centres,
            block.first,
            block.n_planes,
            self._level,
            self._above,
        )
        if self._has_centres:
            # above the last plane that is known there are cubes of which one side is not
            begin = block.first + max(n_known - 1, 0)
            end = self._end - (self._end < block.n_planes)
            self._workers.map(
                lambda part: kernels.marching.colour_centres(window, *part),
                self._workers.parts(begin, end, self.least_planes),
            )
        return window

    def _colour_samples(self, block: Block, n_known: int) -> None:
        def colour(part: tuple[int, int]) -> bool:
            planes = slice(*part)
            row = np.empty(block.samples.shape[2], np.uint8)
            return kernels.marching.colour_samples(
                block.samples[planes], self._level, self._above, row, self._samples[planes]
            )

        parts = self._workers.parts(n_known, len(block.samples), self.least_planes)
        if not all(self._workers.map(colour, parts)):
            self._volume.refuse(block.samples, block.first)


def _moved(bits: NDArray[np.uint32], by: int, n_known: int, n: int) -> NDArray[np.uint32]:
    """The planes that are known at the front of an array of `n` planes."""
    moved = bits if len(bits) >= n else np.empty((n, *bits.shape[1:]), bits.dtype)
    moved[:n_known] = bits[by : by + n_known]
    return moved


class Rows:
    """Numbers, or rows of numbers, that are added to, in an array that grows in place.

    Memory that is not written to costs nothing, so room is made for all rows that are likely. Where
    they come to be more, and the system can map a large block of memory elsewhere, nothing is
    copied; but what is new there is filled with zeros, which takes time.
    """

    def __init__(self, dtype: type, *shape: int) -> None:
        self._rows: NDArray[Any] = np.empty((0, *shape), dtype)
        self.n_rows = 0

    @property
    def rows(self) -> NDArray[Any]:
        """A view of all rows, to be let go of before more are added."""
        return self._rows[: self.n_rows]

    def extend(self, n_rows: int, n_likely: int = 0) -> None:
        """Make room for so many rows in all, and at once for as many as it is likely to be."""
        if n_rows > len(self._rows):
            n_likely = min(n_likely, MOST_ROOM * n_rows)
            if n_likely > 2 * len(self._rows):
                rows = np.empty((max(n_rows, n_likely), *self._rows.shape[1:]), self._rows.dtype)
                rows[: self.n_rows] = self.rows
                self._rows = rows
            else:
                self._resize(max(n_rows, int(GROWTH * len(self._rows))))
        self.n_rows = n_rows

    def finish(self) -> NDArray[Any]:
        """Hand over exactly the rows added, and begin anew."""
        self._resize(self.n_rows)
        rows = self._rows
        self._rows, self.n_rows = np.empty((0, *rows.shape[1:]), rows.dtype), 0
        return rows

    def _resize(self, n_rows: int) -> None:
        if not len(self._rows):  # growing fills with zeros, which takes time
            self._rows = np.empty((n_rows, *self._rows.shape[1:]), self._rows.dtype)
        self._rows.resize((n_rows, *self._rows.shape[1:]), refcheck=False)  # no view is in use
