"""From a volume to a simplified surface, without the whole surface before."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import kernels
from tetsimplify.chunks import by_chunks
from tetsimplify.contract import Clock, contract
from tetsimplify.engine import Engine
from tetsimplify.errors import OptionError
from tetsimplify.isosurface import as_source
from tetsimplify.levels import as_levels
from tetsimplify.march import March, blocks
from tetsimplify.memory import hand_back_memory, nothing_kept
from tetsimplify.mesh import Mesh
from tetsimplify.options import DEFAULT_FOLDOVER, Options, Progress
from tetsimplify.pieces import (
    COUNTERS,
    Finished,
    Piece,
    contracted,
    empty_piece,
    joined,
    piece_of,
    released,
)
from tetsimplify.planes import Planes
from tetsimplify.report import SimplificationReport
from tetsimplify.sampling import Function
from tetsimplify.tables import lattice_tables
from tetsimplify.topology import TopologyReport
from tetsimplify.workers import Workers

SAMPLES_AT_ONCE = 3 * 2**20  # about so many make a block
STEP = 2.0  # from one length to the next one, up to that asked for
LEAST_PLANES_AT_ONCE = 8  # of thinner blocks too much is open


class SimplifiedIsosurface(NamedTuple):
    """A surface that was simplified while it was extracted; see :func:`extract_and_simplify`."""

    vertices: NDArray[np.float64]
    """Shape (n, 3)."""
    faces: NDArray[np.int32]
    """Shape (m, 3)."""
    level: float
    """The value at the surface."""
    report: SimplificationReport
    """As of :func:`tetsimplify.simplify` for the whole surface."""


@nothing_kept()
def extract_and_simplify(
    volume: ArrayLike | Function,
    level: float | str,
    *,
    max_edge_length: float | None = None,
    spacing: Sequence[float] = (1.0, 1.0, 1.0),
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    bounds: Sequence[Sequence[float]] | None = None,
    shape: int | Sequence[int] | None = None,
    lattice: str = "kuhn",
    centres: Any = None,
    closed: bool = False,
    normals: str = "lower",
    placement: str = "auto",
    blocked: str = "contract",
    removal_limit: float | None = None,
    outer: str = "region",
    boundary: str = "simplify",
    foldover: float | None = DEFAULT_FOLDOVER,
    threads: int | None = None,
    progress: Progress | None = None,
    **others: Any,
) -> SimplifiedIsosurface:
    """Extract an isosurface and contract its short edges, block by block.

    The surface as it comes out of the volume never exists as a whole: what is needed is memory for
    the result and for a few blocks of planes. Its topology is that of
    :func:`tetsimplify.extract_isosurface`.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2), any real dtype, or callable
        Samples, or a function that is sampled as `bounds` and `shape` say; see
        :func:`tetsimplify.extract_isosurface`. Anything with slices along the first axis is read
        a few planes at a time, each once.
    level : float or "otsu"
        The iso-value.
    max_edge_length : float
        Longer edges are left; in the units of `spacing`.
    spacing, origin, bounds, shape, lattice, centres, closed, normals
        See :func:`tetsimplify.extract_isosurface`.
    placement, blocked, removal_limit, outer, boundary, foldover
        See :func:`tetsimplify.simplify`. Not ``placement="quadric"`` nor ``blocked="violate"``.
    threads : int, optional
        None for as many as the process may use. The result does not depend on it.
    progress : callable, optional
        Called as ``progress("isosurface", done)`` and then as ``progress("contract", done)``, with
        `done` from 0 to 1. Raise from it to cancel.
    **others
        Any other option of :func:`tetsimplify.simplify` is refused, since it needs the whole
        surface.

    Returns
    -------
    SimplifiedIsosurface
        `vertices`, `faces`, `level` and `report`. ``report.topology_before`` is that of the surface
        that was never there: its vertices and faces are counted, and its Euler characteristics and
        boundary loops are those of the result, since contractions keep them.

    Raises
    ------
    VolumeError
        As :func:`tetsimplify.extract_isosurface`.
    OptionError
        When an option has a wrong value, or needs the whole surface: by a number of faces or a
        proven error, call :func:`tetsimplify.extract_isosurface` and :func:`tetsimplify.simplify`.

    Notes
    -----
    Each block is contracted on its own, then joined to what is left of those before and contracted
    again, and so is the whole in the end. Where a block is open, two rings of vertices are locked
    until it is joined, so every contraction is decided with all neighbours known.

    Examples
    --------
    >>> import tetsimplify
    >>> tube = lambda x, y, z: 0.1 - ((x**2 + y**2) ** 0.5 - 0.6) ** 2 - z**2
    >>> result = tetsimplify.extract_and_simplify(
    ...     tube, 0.0, bounds=[(-1.5, 1.5)] * 3, shape=60, max_edge_length=0.1
    ... )
    >>> result.report.topology_after.genus, result.report.remaining
    (1, {})
    """
    given = {"max_edge_length": max_edge_length, "placement": placement, "blocked": blocked}
    given |= {"removal_limit": removal_limit, "outer": outer, "boundary": boundary}
    options = _as_options(**given, foldover=foldover, **others)
    if isinstance(level, list | tuple):
        raise OptionError(f"level must be one number or 'otsu', got {level!r}")
    samples, middles, frame = as_source(volume, bounds, shape, spacing, origin, lattice, centres)
    if normals not in ("lower", "higher"):
        raise OptionError(f"normals must be 'lower' or 'higher', got {normals!r}")

    clock = Clock()
    with clock.stage("stream"):
        with Workers(threads) as workers:
            (number,) = as_levels(level, samples)
            march = March(
                *(Planes(by_chunks(samples), is_compact=True), number, normals == "lower", frame),
                *(lattice_tables(lattice, closed), workers),
            )
            stream = _Stream(options, workers, progress)
            mesh = stream.run(march, middles)
        del march
        hand_back_memory()
    with clock.stage("check"):
        locked = np.zeros(len(mesh.vertices), np.bool_)
        engine = Engine(mesh, options, locked, threads=threads)
        del mesh  # which the engine has copied
    whole = contract(
        engine,
        None,
        locked=locked,
        vertex_data={},
        face_data={},
        progress=progress,
        clock=clock,
    )
    report = stream.told(whole.report)
    return SimplifiedIsosurface(whole.vertices, whole.faces, number, report)


def _as_options(**given: Any) -> Options:
    """Check the options of the contraction, and that they do not need the whole surface."""
    if unknown := sorted(given.keys() - {option.name for option in fields(Options)}):
        raise TypeError(f"extract_and_simplify() has no option {unknown[0]!r}")
    options = Options(**given)
    if why := obstacle(options):
        raise OptionError(f"{why}: call extract_isosurface and simplify")
    return options


def obstacle(options: Options) -> str | None:
    """Why a surface cannot be simplified with these options before all of it is there, if so."""
    for name in ("target_faces", "keep_ratio"):
        if getattr(options, name) is not None:
            return f"{name} needs the whole surface, to tell which edges are the cheapest"
    if options.max_error is not None:
        return "max_error needs the whole surface, to compare the result with"
    if options.intersections != "allow":
        return "intersections='prevent' needs the whole surface, to tell what comes to cross"
    if options.uses_quadrics:
        return "quadrics need the whole surface, to stand for all that was merged"
    if options.blocked == "violate":
        return "parts can only be joined when the topology is kept, not with blocked='violate'"
    return None


def block_ends(shape: tuple[int, int, int]) -> list[int]:
    """Where blocks end; the result depends on that, and this on nothing but the shape."""
    n_planes, n1, n2 = shape
    at_once = max(LEAST_PLANES_AT_ONCE, SAMPLES_AT_ONCE // (n1 * n2))
    n_blocks = max(1, n_planes // at_once)
    return [n_planes * (k + 1) // n_blocks for k in range(n_blocks)]


def steps_to(length: float, spacing: float) -> list[float]:
    """Lengths that grow by STEP from about that of the edges of a lattice to the one given."""
    n_steps = max(0, math.ceil(math.log(max(length / spacing, 1.0), STEP)))
    return [length / STEP**k for k in range(n_steps, -1, -1)]


class _Stream:
    """Contracts blocks beside each other, and joins them one after the other."""

    def __init__(self, options: Options, workers: Workers, progress: Progress | None) -> None:
        self._options, self._workers, self._progress = options, workers, progress
        self._finished = Finished()
        self._blocks: deque[tuple[Future[Piece], float]] = deque()
        self._rest = workers.submit(empty_piece)
        self._n_vertices = self._n_faces = 0
        self._shortest = np.inf

    def run(self, march: March, centres: Planes | None) -> Mesh:
        """All of the surface, as far as it can be contracted in parts."""
        ends = block_ends(march.shape)
        spacing, origin = march.frame[:, 0].tolist()
        self._lengths = steps_to(self._options.max_edge_length or 0.0, march.frame[0].max())
        for block in blocks(march.volume, centres, march.tables, self._workers, ends=ends):
            low = origin + spacing * block.begin if block.begin > 0 else -np.inf
            high = origin + spacing * block.end if block.end < block.n_planes else np.inf
            self._add(piece_of(march.take(block), (low, high)), block.end / block.n_planes)
        while self._blocks:
            self._join()
        self._rest.result()
        return self._finished.mesh()

    def _add(self, piece: Piece, done: float) -> None:
        """Begin to contract the surface of the next block."""
        self._n_vertices += len(piece.vertices) - len(piece.above)
        self._n_faces += len(piece.faces)
        shortest, _ = kernels.result.edge_extremes(piece.vertices, piece.faces.reshape(-1))
        self._shortest = min(self._shortest, shortest)
        box = [piece]

        def task() -> Piece:
            return contracted(box, self._options, self._lengths)

        self._blocks.append((self._workers.submit(task), done))
        if len(self._blocks) >= self._workers.n_threads:
            self._join()

    def _join(self) -> None:
        """Begin to join the next block to what is open of those before."""
        block, done = self._blocks.popleft()
        last = [self._rest.result()]

        def task() -> Piece:
            piece = joined(last.pop(), block.result())
            piece = contracted([piece], self._options, self._lengths)
            return released(piece, self._finished, self._lengths[-1])

        self._rest = self._workers.submit(task)
        if self._progress is not None:
            self._progress("isosurface", done)

    def told(self, report: SimplificationReport) -> SimplificationReport:
        """The report on the last contractions as one on all of them."""
        done = self._finished.done + [getattr(report, name.lower()) for name in COUNTERS]
        counts = dict(zip((name.lower() for name in COUNTERS), done.tolist(), strict=True))
        return replace(
            report,
            **counts,
            topology_before=self._of_raw(report.topology_before),
            shortest_edge_before=float(self._shortest),
        )

    def _of_raw(self, report: TopologyReport) -> TopologyReport:
        """The topology of the surface before: counted, or the same as after.

        With V vertices, F faces and Euler characteristic X there are E = V + F - X edges, of which
        2 E - 3 F are on the boundary.
        """
        n_edges = self._n_vertices + self._n_faces - report.euler_characteristic
        n_boundary = 2 * n_edges - 3 * self._n_faces
        degrees = {1: n_boundary, 2: n_edges - n_boundary}
        return replace(
            report,
            n_vertices=self._n_vertices,
            n_faces=self._n_faces,
            n_edges=n_edges,
            n_boundary_edges=n_boundary,
            edge_degrees={degree: count for degree, count in degrees.items() if count},
        )
