"""The distance between two surfaces: the largest, between proven bounds, and the mean."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.crew import Crew
from tetsimplify.errors import MeshError, OptionError
from tetsimplify.mesh import Mesh
from tetsimplify.options import Progress
from tetsimplify.targets import Frame, Target

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]

DEFAULT_TOLERANCE = 1e-4  # of the diagonal of the box around both surfaces
SMALLEST_TOLERANCE = 1e-11  # of the diagonal, some hundred times the rounding errors
AT_ONCE = 2**14  # faces that a thread takes in turn, or vertices
REFINED = 2**15  # faces that are looked at closely for the mean
REFINED_AT_ONCE = 2**11
ACCURACY = 2e-3  # of the mean, were the errors of the parts independent


@dataclass(frozen=True, eq=False)
class DirectedDistance:
    """How far the points of one surface are from another; see :func:`surface_distance`."""

    lower: float
    """The distance of `point`, which is the farthest that was found."""
    upper: float
    """No point is farther."""
    mean: float
    """Mean over the surface."""
    rms: float
    """Root of the mean of the square over the surface."""
    area: float
    """Of the surface."""
    point: Floats = field(repr=False)
    """Shape (3,): a point of the surface that has the distance `lower`."""
    face: int = field(repr=False)
    """The face that it lies on."""
    nearest_point: Floats = field(repr=False)
    """Shape (3,): the point of the other surface that is nearest to it."""
    nearest_face: int = field(repr=False)
    """The face of the other surface that this lies on."""
    vertex_distances: Floats = field(repr=False)
    """Shape (n,): the distance of each vertex, whether a face uses it or not."""


@dataclass(frozen=True, eq=False)
class SurfaceDistance:
    """The distance between two surfaces; see :func:`surface_distance`."""

    a_to_b: DirectedDistance
    b_to_a: DirectedDistance
    tolerance: float
    """What `upper` may exceed `lower` by."""

    @property
    def lower(self) -> float:
        """The Hausdorff distance is not less: the larger one of both directions."""
        return max(self.a_to_b.lower, self.b_to_a.lower)

    @property
    def upper(self) -> float:
        """The Hausdorff distance is not more."""
        return max(self.a_to_b.upper, self.b_to_a.upper)

    @property
    def mean(self) -> float:
        """Mean over the points of both surfaces."""
        share_a, share_b = self._shares
        return share_a * self.a_to_b.mean + share_b * self.b_to_a.mean

    @property
    def rms(self) -> float:
        """Root of the mean of the square over the points of both surfaces."""
        share_a, share_b = self._shares
        return math.hypot(
            math.sqrt(share_a) * self.a_to_b.rms, math.sqrt(share_b) * self.b_to_a.rms
        )

    @property
    def _shares(self) -> tuple[float, float]:
        """What part of all points each surface has."""
        area_a, area_b = self.a_to_b.area, self.b_to_a.area
        area = area_a + area_b
        return (area_a / area, area_b / area) if area else (0.5, 0.5)


def surface_distance(
    a: tuple[ArrayLike, ArrayLike],
    b: tuple[ArrayLike, ArrayLike],
    *,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SurfaceDistance:
    """Measure the distance between two surfaces.

    The surfaces are all points of all faces, not only the vertices. Nothing is assumed of them:
    they may be open, intersect themselves, have degenerate faces or be no manifolds.

    Parameters
    ----------
    a, b : pairs of array_like
        Vertices, shape (n, 3), and faces, shape (m, 3), of each surface; at least one face.
    tolerance : float, optional
        What the bounds of the largest distance may differ by, in the units of the mesh. 1e-4 of the
        diagonal of the box around both surfaces if not given.
    threads : int, optional
        How many threads to use; all that the process may if not given. The result is the same to
        the last bit.
    progress : callable, optional
        Called as ``progress("distance", done)`` with `done` from 0 to 1. Raise from it to cancel.

    Returns
    -------
    SurfaceDistance

    Raises
    ------
    MeshError
        When a surface is no mesh, has no faces, or a position is not finite.
    OptionError
        When an option has a wrong value.

    Notes
    -----
    The bounds are proven, up to rounding errors of 1e-12 of the diagonal; smaller distances count
    as 0. The mean and the root mean square are integrals by quadrature over all faces, with a
    correction from some of them that are looked at closely; they are not bounded.

    References
    ----------
    M. Tang, M. Lee and Y. J. Kim. Interactive Hausdorff distance computation for general polygonal
    models. ACM Trans. Graphics 28(3), 2009, 74, doi:10.1145/1531326.1531380.

    Examples
    --------
    A square, cut along either diagonal and folded there. They have the same vertices.

    >>> import tetsimplify
    >>> vertices = [[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1]]
    >>> a, b = (vertices, [[0, 1, 2], [0, 2, 3]]), (vertices, [[0, 1, 3], [1, 2, 3]])
    >>> distance = tetsimplify.surface_distance(a, b, tolerance=1e-6)
    >>> print(f"{distance.lower:.5f} {distance.upper:.5f}")
    0.57735 0.57735
    >>> print(distance.a_to_b.vertex_distances)
    [0. 0. 0. 0.]
    """
    mesh_a, mesh_b = _as_surface("a", a), _as_surface("b", b)
    frame = Frame.around(mesh_a, mesh_b)
    if tolerance is None:
        tolerance = DEFAULT_TOLERANCE * (frame.diagonal or 1.0)
    _check_length("tolerance", tolerance, SMALLEST_TOLERANCE * frame.diagonal)
    crew = Crew(threads, progress, "distance", n_tasks=10)
    target_a, target_b = Target(mesh_a, frame, crew), Target(mesh_b, frame, crew)
    return SurfaceDistance(
        a_to_b=_Direction(target_a, target_b, crew).measure(tolerance),
        b_to_a=_Direction(target_b, target_a, crew).measure(tolerance),
        tolerance=float(tolerance),
    )


class Exceeding(NamedTuple):
    """Faces that are not within a limit of a surface; see :func:`exceeds`."""

    faces: Indices
    """Shape (k,), ascending."""
    points: Floats
    """Shape (k, 3): the farthest point of each that was met."""
    distances: Floats
    """Shape (k,): its distance."""


def exceeds(
    a: Mesh,
    b: Mesh | Target,
    limit: float,
    *,
    slack: float,
    hints: Indices | None = None,
    threads: int | None = None,
) -> Exceeding:
    """Find the faces of a mesh that have a point farther than a limit from a surface.

    Parameters
    ----------
    a : Mesh
        Checked arrays. It is quickest when faces that follow one another are near each other.
    b : Mesh or Target
        The surface, with one face at least. A target can be kept for the next time.
    limit : float
        Faces that are not found are within it everywhere, which is proven up to rounding errors.
    slack : float
        At most `limit`. Faces that are found have a point farther than ``limit - slack``: the
        proof may give up there. The smaller it is the longer that takes.
    hints : ndarray, shape (m,), int32, optional
        For each face of `a` a face of `b` that may be near it, -1 for none.
    threads : int, optional
        How many threads to use, all that the process may if not given. The result is the same.

    Returns
    -------
    Exceeding

    Raises
    ------
    OptionError
        When `limit` or `slack` is no positive number or too small, or `slack` exceeds `limit`.

    Examples
    --------
    >>> import numpy as np
    >>> from tetsimplify import Mesh
    >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.1]])
    >>> a = Mesh(square, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    >>> b = Mesh(square, np.array([[0, 1, 2]], np.int32))
    >>> exceeds(a, b, 0.5, slack=0.01).faces
    array([1], dtype=int32)
    """
    if not isinstance(b, Target):
        b = Target(b)
    _check_length("limit", limit, SMALLEST_TOLERANCE * b.frame.diagonal)
    _check_length("slack", slack, SMALLEST_TOLERANCE * b.frame.diagonal)
    if slack > limit:
        raise OptionError(f"slack must be at most the limit, {limit:g}, got {slack:g}")
    hints = np.empty(0, np.int32) if hints is None else np.ascontiguousarray(hints, np.int32)
    target, scale = b.arrays, b.frame.scale
    vertices = b.frame.enter(a.vertices)

    def find(part: slice) -> tuple[Indices, Floats]:
        found, points = np.empty(AT_ONCE, np.int32), np.empty((AT_ONCE, 4))
        n_found = kernels.distance.exceeding_faces(
            target,
            vertices,
            a.faces,
            part.start,
            part.stop,
            hints,
            limit * scale,
            slack * scale,
            kernels.cover.Column.new(),
            kernels.pieces.Pieces.new(),
            kernels.nearest.Stack.new(),
            found,
            points,
        )
        return found[:n_found], points[:n_found]

    nothing = np.empty(0, np.int32), np.empty((0, 4))
    parts = [nothing, *Crew(threads).share(find, len(a.faces), AT_ONCE)]
    faces, points = (np.concatenate(pieces) for pieces in zip(*parts, strict=True))
    return Exceeding(faces, b.frame.leave(points[:, :3]), points[:, 3] / scale)


class _Direction:
    """Measures the distances from one surface to another.

    Parameters
    ----------
    a, b : Target
        In the same frame.
    crew : Crew
    """

    def __init__(self, a: Target, b: Target, crew: Crew) -> None:
        self._frame = a.frame
        self._target = b.arrays
        self._crew = crew
        vertices, faces, tree, _ = a.arrays
        self._source = kernels.distance.Source(
            vertices=vertices,
            faces=faces,
            vertex_distance=np.empty(len(vertices)),
            vertex_nearest=np.empty(len(vertices), np.int32),
            centre_distance=np.empty(len(faces)),
            centre_nearest=np.empty(len(faces), np.int32),
        )
        self._order = tree.face

    def measure(self, tolerance: float) -> DirectedDistance:
        """Measure all there is to know; the tolerance is in the units of the mesh."""
        scale = self._frame.scale
        used = self._measure_vertices()
        area, mean, square = self._integrate()
        lower, upper, face, point = self._bound(used, tolerance * scale)
        nearest_face, nearest_point = self._nearest(point)
        return DirectedDistance(
            lower=lower / scale,
            upper=upper / scale,
            mean=mean / scale,
            rms=math.sqrt(square) / scale,
            area=area / scale**2,
            point=self._frame.leave(point),
            face=face,
            nearest_point=self._frame.leave(nearest_point),
            nearest_face=nearest_face,
            vertex_distances=self._source.vertex_distance / scale,
        )

    def _measure_vertices(self) -> Indices:
        """Measure the distances of all vertices; return the vertices that faces use."""
        target, source = self._target, self._source
        vertices, n_used = kernels.distance.vertices_along(
            source.faces, self._order, len(source.vertices)
        )

        def measure(part: slice) -> None:
            stack = kernels.nearest.Stack.new()
            kernels.distance.measure_vertices(target, source, vertices[part], stack)

        self._crew.share(measure, len(vertices), AT_ONCE)
        return vertices[:n_used]

    def _integrate(self) -> tuple[float, float, float]:
        """The area, and the means of the distance and of its square."""
        target, source, order = self._target, self._source, self._order

        def measure(part: slice) -> Floats:
            sums = np.empty(3)
            stack = kernels.nearest.Stack.new()
            kernels.distance.measure_centres(target, source, order[part], stack, sums)
            return sums

        sums = np.sum(self._crew.share(measure, len(order), AT_ONCE), axis=0)
        area = float(sums[0])
        if area == 0.0:  # nothing but degenerate faces: all count alike
            centres = source.centre_distance
            sums = np.array([len(centres), centres.sum(), centres @ centres])
        step = area / REFINED if len(order) > REFINED else 0.0
        chosen, weights = kernels.quadrature.choose_faces(
            source.vertices, source.faces, order, step
        )
        accuracy = ACCURACY * float(sums[1]) / math.sqrt(sums[0])

        def refine(part: slice) -> Floats:
            changes = np.empty(2)
            kernels.quadrature.refine_integrals(
                target,
                source,
                chosen[part],
                weights[part],
                accuracy,
                kernels.quadrature.Triangles.new(),
                kernels.nearest.Stack.new(),
                changes,
            )
            return changes

        changes = np.sum(self._crew.share(refine, len(chosen), REFINED_AT_ONCE), axis=0)
        mean, square = np.maximum((sums[1:] + changes) / sums[0], 0.0)
        return area, float(mean), float(square)

    def _bound(self, used: Indices, tolerance: float) -> tuple[float, float, int, Floats]:
        """Bounds of the largest distance; the face and the point that have the lower one."""
        target, source, order = self._target, self._source, self._order
        vertex = used[source.vertex_distance[used].argmax()]
        face = int((source.faces == vertex).any(axis=1).argmax())
        lower, point = float(source.vertex_distance[vertex]), source.vertices[vertex]
        centre = int(source.centre_distance.argmax())
        if source.centre_distance[centre] > lower:
            face = centre
            lower = float(source.centre_distance[face])
            point = source.vertices[source.faces[face]].mean(axis=0)

        def bound(part: slice) -> Floats:
            bounds = np.empty(6)
            kernels.distance.bound_faces(
                target,
                source,
                order[part],
                lower,
                tolerance,
                kernels.cover.Column.new(),
                kernels.pieces.Pieces.new(),
                kernels.nearest.Stack.new(),
                bounds,
            )
            return bounds

        bounds = np.array(self._crew.share(bound, len(order), AT_ONCE))
        best = bounds[bounds[:, 0].argmax()]
        if best[0] > lower:
            lower, face, point = float(best[0]), int(best[2]), best[3:]
        return lower, max(lower, float(bounds[:, 1].max())), face, point

    def _nearest(self, point: Floats) -> tuple[int, Floats]:
        """The face of the other surface that is nearest to a point, and the point on it."""
        alone = self._source._replace(
            vertices=point[None], vertex_distance=np.empty(1), vertex_nearest=np.empty(1, np.int32)
        )
        stack = kernels.nearest.Stack.new()
        kernels.distance.measure_vertices(self._target, alone, np.zeros(1, np.int32), stack)
        face = int(alone.vertex_nearest[0])
        return face, _closest_point(point, self._target.vertices[self._target.faces[face]])


def _closest_point(point: Floats, triangle: Floats) -> Floats:
    """The point of a triangle that is nearest to a point."""
    ends = np.roll(triangle, -1, axis=0)
    candidates = []
    for start, along in zip(triangle, ends - triangle, strict=True):
        length2 = along @ along
        t = np.clip((point - start) @ along / length2, 0.0, 1.0) if length2 > 0.0 else 0.0
        candidates.append(start + t * along)
    sides = (triangle[1:] - triangle[0]).T
    s, t = np.linalg.lstsq(sides, point - triangle[0], rcond=None)[0]
    if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
        candidates.append(triangle[0] + sides @ (s, t))
    return min(candidates, key=lambda candidate: float(np.linalg.norm(candidate - point)))


def _as_surface(name: str, surface: Any) -> Mesh:
    """Cast and check a pair of vertices and faces."""
    try:
        vertices, faces = surface
    except (TypeError, ValueError):
        raise MeshError(
            f"surface {name} must be a pair (vertices, faces), got {type(surface).__name__}"
        ) from None
    try:
        mesh = as_mesh(vertices, faces)
    except MeshError as error:
        raise MeshError(f"surface {name}: {error}") from None
    if not len(mesh.faces):
        raise MeshError(f"surface {name} has no faces")
    return mesh


def _check_length(name: str, value: object, smallest: float) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise OptionError(f"{name} must be a number, got {value!r}")
    if not 0.0 < float(value) < math.inf:
        raise OptionError(f"{name} must be positive and finite, got {value}")
    if float(value) < smallest:
        raise OptionError(
            f"{name} must be at least {smallest:g}, above the rounding errors, got {value}"
        )
