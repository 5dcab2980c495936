"""Isosurfaces of voxel volumes and functions by marching tetrahedra."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify.arrays import as_triple, as_volume
from tetsimplify.errors import OptionError, VolumeError
from tetsimplify.interfaces import label_surfaces
from tetsimplify.lattices import LATTICES, lattice_named
from tetsimplify.levels import as_levels
from tetsimplify.march import Block, March, Rows, blocks
from tetsimplify.mesh import Mesh
from tetsimplify.planes import Planes, as_sliceable
from tetsimplify.regularise import DEFAULT_FOLDOVER, as_foldover, regular
from tetsimplify.sampling import Function, Refined, SampledFunction, as_factor, sampled
from tetsimplify.tables import lattice_tables
from tetsimplify.vertex_data import VertexData, as_fields
from tetsimplify.workers import Workers

Progress = Callable[[str, float], object]


class Isosurface(Mesh):
    """The mesh of an isosurface, and what is known of its vertices.

    It is a pair of `vertices` and `faces`, as every :class:`~tetsimplify.Mesh`.

    Attributes
    ----------
    level : float
        The value at the surface.
    vertex_data : dict of str to ndarray, shape (n,) or (n, 3), float64
        What was asked for: ``"normals"``, and values of other volumes by their names.
    """

    level: float
    vertex_data: dict[str, NDArray[np.float64]]

    def __new__(
        cls,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int32],
        level: float = 0.0,
        vertex_data: Mapping[str, NDArray[np.float64]] | None = None,
    ) -> Isosurface:
        """Make one of its parts."""
        self = super().__new__(cls, vertices, faces)
        self.level = level
        self.vertex_data = dict(vertex_data or {})
        return self


def extract_isosurface(
    volume: ArrayLike | Function,
    level: float | str | Sequence[float | str] | None = None,
    *,
    labels: Sequence[int] | str | None = None,
    spacing: Sequence[float] = (1.0, 1.0, 1.0),
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    bounds: Sequence[Sequence[float]] | None = None,
    shape: int | Sequence[int] | None = None,
    lattice: str = "kuhn",
    centres: Any = None,
    closed: bool = False,
    normals: str = "lower",
    refine: int = 1,
    regularise: bool = False,
    foldover: float | None = DEFAULT_FOLDOVER,
    vertex_normals: bool = False,
    vertex_data: Mapping[str, Any] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Any:
    """Extract the surface where a volume has the value `level`.

    The surface is a 2-manifold, consistently oriented, with boundary only on the sides of
    the volume. Memory beyond the result is that of a few planes of the volume.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2), any real dtype, or callable
        Samples, at least two along each axis; in any memory order. Anything with ``shape``,
        ``dtype`` and slices along the first axis is read a few planes at a time, each once. Or a
        function of three arrays of coordinates, which is sampled as `bounds` and `shape` say.
    level : float, "otsu", or a list of these
        The iso-value. Samples equal to it count as outside. "otsu" parts the samples into two
        classes of least variance, and reads the volume twice for that.
    labels : "all" or sequence of int, optional
        Instead of a level, for volumes of integers: one surface for each of these labels, or for
        each that there is but 0, of the interfaces that
        :func:`~tetsimplify.interfaces.extract_interfaces` makes, so that neighbours fit. Of the
        other options these go with it: `spacing`, `origin`, `closed` (which caps half a sample
        outside), `normals`, `threads`, `progress`.
    spacing : three floats
        Distance between samples along the three axes, in the units that you want.
    origin : three floats
        Position of sample (0, 0, 0).
    bounds : three pairs of floats
        For a function, the least and the greatest coordinate along each axis.
    shape : int or three ints
        For a function, the number of samples along each axis.
    lattice : {"kuhn", "five", "bcc"}
        How cubes are cut into tetrahedra; see :data:`tetsimplify.lattices.LATTICES`.
    centres : array_like, shape (n0 - 1, n1 - 1, n2 - 1), optional
        Values in the middle of the cubes, for a lattice that has points there ("bcc"). If not
        given these are the means of the eight corners, or the values of the function.
    closed : bool
        Close the surface with caps on the sides of the volume where these are inside.
    normals : {"lower", "higher"}
        The side that normals point to. With "lower" the solid is where values are above the
        level, with "higher" where they are below.
    refine : int
        So many cubes along each edge of a cube, of samples by trilinear interpolation: nearer to
        the surface of the trilinear function, for `refine` squared times the faces.
    regularise : bool
        Contract vertices that are near the same lattice point where that keeps the topology:
        regularised marching tetrahedra (Treece, Prager and Gee 1999).
    foldover : float or None
        With `regularise`, vertices are left where that would turn a face by more degrees; None
        for no such guard.
    vertex_normals : bool
        Make unit normals at the vertices from the gradient of the volume, to be found as
        ``vertex_data["normals"]`` of the result.
    vertex_data : dict of str to array_like, shape (n0, n1, n2), optional
        Other volumes of the same shape, whose values at the vertices are wanted.
    threads : int, optional
        How many threads to use; all cores that the process may use if not given. The result
        is the same for any number.
    progress : callable, optional
        Called as ``progress("isosurface", done)`` with `done` from 0 to 1. Raise from it to
        cancel.

    Returns
    -------
    Isosurface, or list of Isosurface
        A :class:`~tetsimplify.Mesh` with its `level` and `vertex_data`; a list of them, in the
        same order, when `level` is a list; a list of
        :class:`~tetsimplify.interfaces.LabelSurface` for `labels`. Vertices at
        ``origin + spacing * index``, coordinates in the order of the axes of the volume, which are
        taken as right-handed; faces in memory order, neighbours near each other. Empty when
        nothing crosses the level.

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

    G. M. Treece, R. W. Prager and A. H. Gee. Regularised marching tetrahedra: improved iso-surface
    extraction. Computers & Graphics 23(4), 1999, 583-598, doi:10.1016/S0097-8493(99)00076-X.

    S. L. Chan and E. O. Purisima. A new tetrahedral tesselation scheme for isosurface generation.
    Computers & Graphics 22(1), 1998, 83-90, doi:10.1016/S0097-8493(97)00085-X.

    Examples
    --------
    >>> import numpy as np
    >>> import tetsimplify
    >>> x, y, z = np.mgrid[-1:1:20j, -1:1:20j, -1:1:20j]
    >>> mesh = tetsimplify.extract_isosurface(0.8 - np.sqrt(x**2 + y**2 + z**2), 0.0)
    >>> tetsimplify.topology(*mesh).euler_characteristic
    2

    >>> ball = lambda x, y, z: 1 - x**2 - y**2 - z**2
    >>> mesh = tetsimplify.extract_isosurface(ball, 0.0, bounds=[(-2, 2)] * 3, shape=20)
    >>> bool(abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() < 0.02)
    True
    """
    if labels is not None:
        given = {
            "level": level is None,
            "bounds": bounds is None,
            "shape": shape is None,
            "lattice": lattice == "kuhn",
            "centres": centres is None,
            "refine": refine == 1,
            "regularise": not regularise,
            "vertex_normals": not vertex_normals,
            "vertex_data": not vertex_data,
        }
        if wrong := [name for name, is_default in given.items() if not is_default]:
            raise OptionError(f"labels do not go with {', '.join(wrong)}")
        return label_surfaces(
            volume,  # type: ignore[arg-type]
            labels,
            is_outward=_is_lower(normals),
            spacing=spacing,
            origin=origin,
            closed=closed,
            threads=threads,
            progress=progress,
        )
    limit = as_foldover(foldover)
    samples, middles, frame = as_source(volume, bounds, shape, spacing, origin, lattice, centres)
    fields = as_fields(vertex_data, samples.shape, vertex_normals)
    above = _is_lower(normals)
    factor = as_factor(refine)
    if factor > 1 and (is_function(volume) or middles is not None):
        raise OptionError("refine is for samples alone: a function has a shape, centres stay")

    with Workers(threads) as workers:
        levels = as_levels(level, samples)
        if factor > 1:
            samples, frame[0] = Refined(samples, factor), frame[0] / factor
            fields = {name: Refined(field, factor, name) for name, field in fields.items()}
        planes, tables = Planes(samples, is_compact=True), lattice_tables(lattice, closed)
        data = VertexData(fields, vertex_normals, workers)
        is_traced = data.is_wanted or regularise
        marches = [March(planes, one, above, frame, tables, workers, is_traced) for one in levels]
        rows = [data.rows() for _ in marches]
        for block in blocks(planes, middles, tables, workers, int(vertex_normals)):
            of_fields = data.take(block)
            for k, march in enumerate(marches):
                tell = _telling(progress, block, k, len(marches))
                is_new = march.add(block, tell)
                data.add(block, of_fields, march, is_new, rows[k])
    surfaces = [
        _finished(*pair, limit if regularise else None) for pair in zip(marches, rows, strict=True)
    ]
    return surfaces if isinstance(level, list | tuple) else surfaces[0]


def _is_lower(normals: Any) -> bool:
    if normals not in ("lower", "higher"):
        raise OptionError(f"normals must be 'lower' or 'higher', got {normals!r}")
    return bool(normals == "lower")


def _finished(march: March, data: dict[str, Rows], cos_foldover: float | None) -> Isosurface:
    """Hand over a surface, made regular where there is a guard for that."""
    faces, rows = march.faces.finish(), {"": march.vertices.finish()}
    rows |= {name: of_name.finish() for name, of_name in data.items()}
    if cos_foldover is not None:
        faces, rows = regular(faces, rows, march, cos_foldover)
    return Isosurface(rows.pop(""), faces, march.level, rows)


def is_function(volume: Any) -> bool:
    """Whether this is to be sampled, instead of samples."""
    return callable(volume) and not hasattr(volume, "shape")


def as_source(
    volume: Any,
    bounds: Any,
    shape: Any,
    spacing: Any,
    origin: Any,
    lattice: str,
    centres: Any,
) -> tuple[Any, Planes | None, NDArray[np.float64]]:
    """Check what is to be marched over: samples, centres where given, and spacing and origin."""
    has_centres = lattice_named(lattice).has_centres
    frame = np.array([as_triple("spacing", spacing, positive=True), as_triple("origin", origin)])
    source: Any = volume
    if is_function(volume):
        source, frame = _as_samples(volume, bounds, shape, frame)
        if has_centres and centres is None:
            centres = source.centres()
    elif bounds is not None or shape is not None:
        raise OptionError("bounds and shape are for functions; a volume has spacing and origin")
    samples = as_volume(source)
    middles = _as_centres(centres, samples.shape, lattice)
    return samples, middles, frame


def _as_samples(
    function: Function, bounds: Any, shape: Any, frame: NDArray[np.float64]
) -> tuple[SampledFunction, NDArray[np.float64]]:
    if not np.array_equal(frame, [(1, 1, 1), (0, 0, 0)]):
        raise OptionError("a function has bounds and shape, instead of spacing and origin")
    samples = sampled(function, bounds, shape)
    return samples, np.array([samples.spacing, samples.origin])


def _as_centres(centres: Any, shape: tuple[int, int, int], lattice: str) -> Planes | None:
    if centres is None:
        return None
    if not LATTICES[lattice].has_centres:
        having = ", ".join(name for name, entry in LATTICES.items() if entry.has_centres)
        raise OptionError(f"centres are for lattices that have points there ({having})")
    values = as_sliceable(centres)
    wanted = tuple(n - 1 for n in shape)
    if tuple(values.shape) != wanted or np.dtype(values.dtype).kind not in "biuf":
        raise VolumeError(
            f"centres must hold real numbers and have shape {wanted}, got {values.dtype} and "
            f"{tuple(values.shape)}"
        )
    return Planes(values, "centres")


def _telling(
    progress: Progress | None, block: Block, number: int, n_surfaces: int
) -> Callable[[float], object]:
    """What tells the progress of the whole when told that of one surface in a block."""

    def tell(part: float) -> None:
        if progress is not None:
            part = (number + part) / n_surfaces
            n_done = block.begin + part * (block.end - block.begin)
            progress("isosurface", n_done / block.n_planes)

    return tell
