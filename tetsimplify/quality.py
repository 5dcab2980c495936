"""The quality of a triangulation: topological and geometric criteria, element by element."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.errors import OptionError

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]

IDEAL_VALENCE = 6  # of an interior vertex among equilateral triangles
IDEAL_BOUNDARY_VALENCE = 4  # on a straight boundary


class Measure(NamedTuple):
    """What a measure tells of each element, and which values are bad."""

    element: str
    """``"face"``, ``"edge"`` or ``"vertex"``."""
    low: float
    """The least value that it can have."""
    high: float
    """The greatest value that it can have."""
    worst: str
    """``"least"`` or ``"greatest"``: the values that are bad."""


MEASURES = {
    "radius_ratio": Measure("face", 0.0, 1.0, "least"),
    "min_angle": Measure("face", 0.0, 60.0, "least"),
    "max_angle": Measure("face", 60.0, 180.0, "greatest"),
    "aspect_ratio": Measure("face", 1.0, math.inf, "greatest"),
    "edge_ratio": Measure("face", 1.0, math.inf, "greatest"),
    "area": Measure("face", 0.0, math.inf, "least"),
    "edge_length": Measure("edge", 0.0, math.inf, "least"),
    "dihedral_angle": Measure("edge", 0.0, 180.0, "greatest"),
    "irregularity": Measure("vertex", 0.0, math.inf, "greatest"),
}
"""The measures by their names, which are those of the arrays of :class:`QualityReport`."""


class Summary(NamedTuple):
    """The distribution of a measure.

    Percentiles and the median are values of elements: the least that at least so many percent of
    the elements do not exceed. All is zero where there is no element.
    """

    n: int
    """Number of elements."""
    min: float
    p1: float
    p5: float
    median: float
    mean: float
    p95: float
    p99: float
    max: float


class Histogram(NamedTuple):
    """How many values lie in which bin."""

    counts: NDArray[np.int64]
    """Shape (b,)."""
    edges: Floats
    """Shape (b + 1,): bin i reaches from edge i to edge i + 1, the last with its end."""


@dataclass(frozen=True, eq=False)
class QualityReport:
    """What :func:`quality` finds. Angles are in degrees, lengths in units of the vertices."""

    n_vertices: int
    """All vertices, referenced or not."""
    n_faces: int
    """All faces, also those without area."""
    n_edges: int
    """Edges of the faces that name no vertex twice."""
    n_interior_vertices: int
    n_boundary_vertices: int
    """Vertices of edges that have one face only."""
    topological_criterion: float
    """Mean distance of the valence from 6, over the interior vertices; 0 is ideal, and the value
    where there are none."""
    boundary_criterion: float
    """Mean distance of the valence from 4, over the boundary vertices; likewise."""
    geometric_criterion: float
    """Mean of 1/2 - r/R over the faces, r and R the radii of incircle and circumcircle; 0 is
    ideal, 1/2 the worst."""
    radius_ratio: Floats = field(repr=False)
    """Shape (n_faces,): 2 r/R, from 0 to 1 in the equilateral triangle."""
    min_angle: Floats = field(repr=False)
    """Shape (n_faces,): smallest angle."""
    max_angle: Floats = field(repr=False)
    """Shape (n_faces,): largest angle."""
    aspect_ratio: Floats = field(repr=False)
    """Shape (n_faces,): longest edge / (2 sqrt(3) r), from 1 in the equilateral triangle."""
    edge_ratio: Floats = field(repr=False)
    """Shape (n_faces,): longest edge / shortest edge."""
    area: Floats = field(repr=False)
    """Shape (n_faces,)."""
    zero_area_faces: Indices = field(repr=False)
    """Shape (z,): faces whose corners lie on one line. They have radius ratio 0, angles 0 and
    180, aspect ratio infinity."""
    edges: Indices = field(repr=False)
    """Shape (n_edges, 2): lower vertex first. The edges of two faces come before all others."""
    edge_length: Floats = field(repr=False)
    """Shape (n_edges,)."""
    dihedral_angle: Floats = field(repr=False)
    """Shape (d,): angle between the normals of the two faces at each of the first d `edges`, 0
    where these are flat or one has no area. The other edges have no such angle."""
    valence: Indices = field(repr=False)
    """Shape (n_vertices,): number of edges at each vertex."""
    is_on_boundary: NDArray[np.bool_] = field(repr=False)
    """Shape (n_vertices,)."""
    irregularity: Indices = field(repr=False)
    """Shape (n_vertices,): distance of the valence from 6, from 4 on the boundary; 0 where there
    are no edges."""

    def summary(self, name: str) -> Summary:
        """Tell the distribution of a measure.

        Parameters
        ----------
        name : str
            One of :data:`MEASURES`. Vertices without edges have no irregularity.

        Raises
        ------
        OptionError
            When there is no such measure.
        """
        values = self._values(name)
        n = len(values)
        if not n:
            return Summary(0, *[0.0] * 8)
        ranks = [0, *(-(-percent * n // 100) - 1 for percent in (1, 5, 50, 95, 99)), n - 1]
        low, p1, p5, median, p95, p99, high = np.partition(values, ranks)[ranks].tolist()
        with np.errstate(over="ignore"):
            mean = float(values.mean(dtype=np.float64))
        return Summary(n, low, p1, p5, median, mean, p95, p99, high)

    def histogram(self, name: str, bins: int | Sequence[float] = 20) -> Histogram:
        """Count the values of a measure.

        Parameters
        ----------
        name : str
            One of :data:`MEASURES`. Vertices without edges have no irregularity.
        bins : int or increasing floats
            Bins of equal width over all that the measure can be, up to the greatest finite value
            where it can be anything; or the ends of the bins. What is outside is not counted, as
            is infinity.

        Raises
        ------
        OptionError
            When there is no such measure, or there can be no such bins.
        """
        values = self._values(name)
        if isinstance(bins, (int, np.integer)) and bins > 0:
            return Histogram(*np.histogram(values, int(bins), _range(name, values)))
        ends = np.asarray(bins)
        if ends.ndim != 1 or ends.dtype.kind not in "iuf" or not _is_increasing(ends):
            raise OptionError(
                f"bins must be a positive integer or at least two increasing numbers, got {bins!r}"
            )
        return Histogram(*np.histogram(values, ends.astype(np.float64)))

    def worst(self, name: str, k: int = 10) -> NDArray[np.intp]:
        """Find the worst elements.

        Parameters
        ----------
        name : str
            One of :data:`MEASURES`.
        k : int
            How many.

        Returns
        -------
        ndarray, shape (k,), or fewer where there are fewer
            Indices of faces, of `edges` or of vertices, the worst first; of equals the first.

        Raises
        ------
        OptionError
            When there is no such measure or `k` is no number of elements.
        """
        values = self._array(name)
        if isinstance(k, bool) or not isinstance(k, (int, np.integer)) or k < 0:
            raise OptionError(f"k must be an integer, 0 or more, got {k!r}")
        badness = values if MEASURES[name].worst == "greatest" else -values
        k = min(int(k), len(badness))
        if not k:
            return np.empty(0, np.intp)
        least = np.partition(badness, len(badness) - k)[len(badness) - k]
        candidates = np.flatnonzero(badness >= least)
        return candidates[np.argsort(-badness[candidates], kind="stable")][:k]

    def as_dict(self) -> dict[str, int | float]:
        """All plain numbers: the counts, the criteria, and ``"<measure>_<statistic>"``."""
        numbers: dict[str, int | float] = {
            name: value for name, value in vars(self).items() if isinstance(value, (int, float))
        }
        numbers["n_zero_area_faces"] = len(self.zero_area_faces)
        for measure in MEASURES:
            summary = self.summary(measure)._asdict()
            del summary["n"]
            numbers |= {f"{measure}_{statistic}": value for statistic, value in summary.items()}
        return numbers

    def _array(self, name: str) -> NDArray[Any]:
        if name not in MEASURES:
            listed = ", ".join(repr(measure) for measure in MEASURES)
            raise OptionError(f"name must be one of {listed}, got {name!r}")
        array: NDArray[Any] = getattr(self, name)
        return array

    def _values(self, name: str) -> NDArray[Any]:
        """The array of a measure without the elements that have none."""
        array = self._array(name)
        return array[self.valence > 0] if MEASURES[name].element == "vertex" else array


def quality(vertices: ArrayLike, faces: ArrayLike) -> QualityReport:
    """Measure the quality of a triangle mesh.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions.
    faces : array_like, shape (m, 3), integers
        Vertex indices. Any set of triangles will do.

    Returns
    -------
    QualityReport
        The topological and the geometric criterion; radius ratio, angles, aspect ratio, edge
        ratio and area of each face; length of each edge, angle between the faces at it; valence
        of each vertex. All of it is finite but the aspect ratios of faces without area and the
        edge ratios of faces with an edge of no length.

    Raises
    ------
    MeshError
        When the arrays have the wrong shape or dtype, a position is NaN or infinite or an index
        is out of range.

    References
    ----------
    Нужен алгоритм для построения оптимальной триангуляции. Критерии качества треугольных
    элементов (in Russian; author and year not stated): the two criteria.

    W. H. Frey and D. A. Field. Mesh relaxation: a new technique for improving triangulations. Int.
    J. Numerical Methods in Engineering 31(6), 1991, 1121-1133, doi:10.1002/nme.1620310607.

    K. Shimada and D. C. Gossard. Bubble mesh: automated triangular meshing of non-manifold geometry
    by sphere packing. Proc. 3rd ACM Symposium on Solid Modeling and Applications, 1995, 409-419,
    doi:10.1145/218013.218095.

    P. P. Pébay and T. J. Baker. Analysis of triangle quality measures. Mathematics of Computation
    72(244), 2003, 1817-1839, doi:10.1090/S0025-5718-03-01485-6.

    Examples
    --------
    >>> import tetsimplify
    >>> report = tetsimplify.quality([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> print(report.radius_ratio.round(4), report.min_angle, report.max_angle)
    [0.8284] [45.] [90.]
    >>> report.edges[report.worst("edge_length", 2)].tolist()
    [[0, 1], [0, 2]]
    """
    mesh = as_mesh(vertices, faces)
    corner_vertex = mesh.faces.reshape(-1)
    of_faces = kernels.quality.measure_faces(*mesh)
    corners = kernels.corners.link_corners(corner_vertex, len(mesh.vertices))
    of_edges = kernels.quality.measure_edges(
        mesh.vertices, corner_vertex, *corners, of_faces.normal
    )

    valence, is_on_boundary = of_edges.valence, of_edges.is_on_boundary
    ideal = np.where(is_on_boundary, IDEAL_BOUNDARY_VALENCE, IDEAL_VALENCE)
    irregularity = np.where(valence > 0, np.abs(valence - ideal), 0).astype(np.int32)
    inside = irregularity[(valence > 0) & ~is_on_boundary]
    at_boundary = irregularity[is_on_boundary]
    return QualityReport(
        n_vertices=len(mesh.vertices),
        n_faces=len(mesh.faces),
        n_edges=len(of_edges.interior) + len(of_edges.others),
        n_interior_vertices=len(inside),
        n_boundary_vertices=len(at_boundary),
        topological_criterion=_mean(inside),
        boundary_criterion=_mean(at_boundary),
        geometric_criterion=_mean(0.5 - of_faces.radius_ratio / 2),
        radius_ratio=of_faces.radius_ratio,
        min_angle=of_faces.min_angle,
        max_angle=of_faces.max_angle,
        aspect_ratio=of_faces.aspect_ratio,
        edge_ratio=of_faces.edge_ratio,
        area=of_faces.area,
        zero_area_faces=np.flatnonzero(np.isinf(of_faces.aspect_ratio)).astype(np.int32),
        edges=np.concatenate([of_edges.interior, of_edges.others]),
        edge_length=np.concatenate([of_edges.interior_length, of_edges.other_length]),
        dihedral_angle=of_edges.dihedral_angle,
        valence=valence,
        is_on_boundary=is_on_boundary,
        irregularity=irregularity,
    )


def _mean(values: NDArray[Any]) -> float:
    return float(values.mean(dtype=np.float64)) if len(values) else 0.0


def _is_increasing(ends: NDArray[Any]) -> bool:
    return len(ends) > 1 and bool((ends[1:] > ends[:-1]).all())


def _range(name: str, values: NDArray[Any]) -> tuple[float, float]:
    """From the least to the greatest that a measure can be, or to the greatest that there is."""
    low, high = MEASURES[name].low, MEASURES[name].high
    if math.isinf(high):
        high = float(values[np.isfinite(values)].max(initial=low))
    return low, high if high > low * (1 + 1e-6) else low + 1.0
