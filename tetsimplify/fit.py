"""A simplified mesh brought nearer to the mesh given: vertices moved, edges turned over.

Contraction puts each vertex where the planes merged into it want it. What counts in the end is how
far the faces are from the surface given. So samples of that are taken, each is given to the nearest
face of the result, and all vertices move a little so that the squared heights of the samples above
their faces become least: see kernels/samples.py and kernels/fit.py. Where there is time, edges are
turned over in between by the same samples, see flips.py, and in the end the spots where it is
farthest from the surface given are lowered, see spots.py. The topology stays.

The work is done in parts that depend on the meshes alone, and so does the result.
"""

from __future__ import annotations

import math
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels, memory
from tetsimplify.crew import Crew
from tetsimplify.flips import Flips, Table, Taken, find_thin
from tetsimplify.mesh import Mesh
from tetsimplify.options import Progress
from tetsimplify.spots import Spots, new_boxes

if TYPE_CHECKING:
    from tetsimplify.kernels.fit import Solver
    from tetsimplify.kernels.samples import Desk, Samples, Stars
    from tetsimplify.kernels.spots import Made

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

VERTICES = 2**12  # in a part: within it each vertex knows the steps of those before it
AT_ONCE = 2**15  # vertices or faces in a part, where little is to be done
GROUP_BITS = 13  # of faces whose samples are added up together: their sums fit the cache of a core
SAMPLES = 2**13  # in a part

COS_TURN = 0.7  # of the largest angle by which a face may turn
EXACT = 1e-9  # of the size of the mesh: a height that is as good as none
FLAT = 1e-3  # of the edges around: the height of faces that are not to be pulled from what they fit
LARGEST = 1e300  # size of a mesh, and one over it: beyond, nothing is moved
REACH = 4.0  # in root mean squared heights: how far a vertex may go in a round
LIFT = 0.8  # the same at right angles to the surface
DOUBT = 6.0  # so many samples more, without height, are thought of for that
HIGH = 5.0  # in root mean squared heights of all: what is high
HIGHEST = 0.6  # of the largest height of all: what is lowered


class Plan(NamedTuple):
    """How much is done."""

    per_face: float
    """Samples for each face of the result, in each round."""
    least_stride: int
    """Of so many faces given one has a sample in a round, at most."""
    rounds: int
    """How often samples are taken."""
    flips: int
    """After how many of these edges are turned over by them."""
    sweeps: int
    """Over the equations of a round."""
    stiffness: float
    pull: float
    """See `kernels.fit.Solver`."""
    eases: bool
    """Whether the highest samples are lowered by more than the equations say."""
    lowers: bool
    """Whether the worst spots are lowered in the end, which are looked for on both surfaces."""


LEAST = 3.0  # faces given for one that is left: where there are fewer, hardly anything is gained
FEW = 16.0  # where there are as many, there is time for more, and more to gain
ROUGH = 0.005  # rms height of samples, in edges, from which on there is more to gain
PLANE = 0.0003  # the same, below which it is nearly all planes, with triangles to turn over there
LIGHT = Plan(  # for smooth surfaces of which many faces are left
    per_face=3.5,
    least_stride=1,
    rounds=1,
    flips=0,
    sweeps=1,
    stiffness=0.01,
    pull=0.2,
    eases=True,
    lowers=False,
)
# for rough and plane ones, after a first round with the samples of the light plan
MEDIUM = LIGHT._replace(per_face=8.0, rounds=2, flips=1, stiffness=0.0007)
THOROUGH = Plan(  # where few are left
    per_face=8.0,
    least_stride=4,
    rounds=3,
    flips=1,
    sweeps=2,
    stiffness=0.0015,
    pull=0.3,
    eases=False,
    lowers=True,
)


class Links(NamedTuple):
    """The corner table of a mesh, see kernels/corners.py, as `topology.examine` makes it."""

    first_corner: Indices
    """Shape (n,)."""
    next_corner: Indices
    """Shape (3 m,)."""


def pays(given: Mesh, made: Mesh) -> bool:
    """Whether enough faces are gone that it is worth the time."""
    return len(given.faces) >= LEAST * len(made.faces)


def fit_mesh(
    given: Mesh,
    made: Mesh,
    vertex_map: Indices,
    held: NDArray[np.uint8],
    links: Links,
    threads: int,
    *,
    cos_turn: float = COS_TURN,
    cos_feature: float | None = None,
    flips: bool = False,
    progress: Progress | None = None,
) -> Mesh:
    """Bring a simplified mesh nearer to the mesh given.

    Parameters
    ----------
    given : Mesh
    made : Mesh
        What became of it.
    vertex_map : ndarray, shape (n given,), int32
        The vertex that each one given was merged into, -1 where it was removed.
    held : ndarray, shape (n,), uint8
        Which vertices stay exactly where they are, and the edges between them. More are marked,
        with `cos_feature`.
    links : Links
        Of the mesh made, corners in order.
    threads : int
        The result does not depend on it.
    cos_turn : float
        Cosine of the largest angle by which a face may turn. It may not lose more than half of
        its area either, three quarters at the worst spots.
    cos_feature : float, optional
        Cosine of the angle from which on the vertices of an edge are held.
    flips : bool
        Whether edges may be turned over: where that gains something, unless the surface is smooth
        and many faces are left, and where faces have no height.
    progress : callable, optional
        Called as ``progress("fit", done)``. Raise from it to cancel.

    Returns
    -------
    Mesh
        As many vertices and faces. A face of which a side was turned over is in the place of one of
        the two that were there.
    """
    low, high = _box(made)
    size = float((high - low).max())
    if len(made.faces) in (0, len(given.faces)) or not 1.0 / LARGEST < size < LARGEST:
        return made
    plan = THOROUGH if len(given.faces) >= FEW * len(made.faces) else LIGHT
    most = MEDIUM if plan is LIGHT else plan
    n_tasks = 3 + flips + (cos_feature is not None) + most.rounds * (7 + most.sweeps)
    n_tasks += 2 * most.lowers
    fit = _Fit(made, held, links, (low, high), Crew(threads, progress, "fit", n_tasks))
    cosine = max(cos_turn, COS_TURN)
    fit.measure()
    if cos_feature is not None:
        fit.hold_features(cos_feature)
    fit.take_samples(given, vertex_map, plan, 0)
    if plan is LIGHT and not PLANE < fit.roughness < ROUGH:
        plan = MEDIUM
    for i in range(plan.rounds):
        if i:
            fit.measure()
            fit.take_samples(given, vertex_map, plan, i)
        fit.solve(plan)
        if plan.eases:
            fit.ease_highest()
        fit.move(cosine)
        if flips and i < plan.flips:
            fit.turn_over(cosine)
    if plan.lowers:
        fit.lower_spots(given, vertex_map, cosine)
    if flips:
        fit.turn_over_caps(cosine)
    fitted = Mesh(fit.vertices(), fit.faces)
    if progress is not None:
        progress("fit", 1.0)  # where less was done than might have been
    return fitted


def _box(mesh: Mesh) -> tuple[Array, Array]:
    """The least and the largest coordinates; zeros where there are none."""
    low, high = kernels.order.bounds(mesh.vertices) if len(mesh.vertices) else np.zeros((2, 3))
    return low, high


class _Fit:
    """What a fit works on.

    Parameters
    ----------
    made : Mesh
    held : ndarray, shape (n,), uint8
    links : Links
    box : tuple
        The least and the largest coordinates, each of shape (3,).
    crew : Crew

    Attributes
    ----------
    faces : ndarray, shape (m, 3), int32
        As they are now.
    """

    def __init__(
        self,
        made: Mesh,
        held: NDArray[np.uint8],
        links: Links,
        box: tuple[Array, Array],
        crew: Crew,
    ) -> None:
        n, m = len(made.vertices), len(made.faces)
        self._made, self._held, self._crew = made, held, crew
        self._links = links
        self.faces = made.faces
        self._is_own = False  # whether faces and links are copies
        low, high = box
        # a power of two: so a mesh twice as large gives the same
        size = float((high - low).max())
        self._frame = low + 0.5 * (high - low), 2.0 ** -math.frexp(size)[1]
        self._places = memory.empty((n, 3))
        self._normals = memory.empty((m, 4))
        self._first_normals: Array | None = None
        self._steps, self._steps_before = memory.empty((n, 3)), memory.empty((n, 3))
        self._sums = memory.cache_lines(m).view(np.float32)
        self._samples: Samples | None = None
        self._ends: NDArray[np.int64] | None = None
        self._of_groups: Array = np.zeros((0, 3))
        self._desks: SimpleQueue[Desk] = SimpleQueue()

        self._enter_frame(made.vertices, self._places)
        self._stars = self._new_stars(crew)

    def _enter_frame(self, vertices: Array, places: Array) -> None:
        """Put vertices into the frame."""

        def enter(part: slice) -> None:
            kernels.fit.enter_frame(vertices, *self._frame, part.start, part.stop, places)

        self._crew.share(enter, len(vertices), AT_ONCE)

    def _new_stars(self, crew: Crew) -> Stars:
        """Room for the faces around each vertex."""
        n, kernel = len(self._places), kernels.samples
        first = np.empty(n + 1, np.int32)

        def count(part: slice) -> int:
            return int(kernel.count_blocks(*self._links, part.start, part.stop, first))

        def give(part: slice) -> None:
            kernel.number_blocks(part.start, part.stop, begin[part.start // VERTICES], first)

        begin = np.cumsum([0, *crew.share(count, n, VERTICES)])
        Crew(self._crew.n_threads).share(give, n, VERTICES)
        first[n] = begin[-1]
        lanes = memory.empty((int(begin[-1]), kernel.N_ROWS, kernel.LANES), np.float32)
        stars: Stars = kernel.Stars(
            first, lanes, lanes.view(np.int32), lanes.reshape(-1, kernel.LANES)
        )
        return stars

    def measure(self) -> None:
        """Find normals, areas and stars as they are now."""
        if self._first_normals is None:
            self._first_normals = self._normals
        elif self._first_normals is self._normals:
            self._normals = memory.empty(self._normals.shape)

        def find_normals(part: slice) -> None:
            kernels.samples.find_normals(
                self._places, self.faces, part.start, part.stop, self._normals
            )

        def fill(part: slice) -> None:
            kernels.samples.fill_stars(
                *(self._places, self.faces.reshape(-1), self._links, self._normals),
                *(part.start, part.stop, self._stars),
            )

        self._crew.share(find_normals, len(self._normals), AT_ONCE)
        self._crew.share(fill, len(self._places), VERTICES)

    def hold_features(self, cosine: float) -> None:
        """Hold the vertices at which neighbouring faces turn by more."""

        def hold(part: slice) -> None:
            kernels.fit.hold_features(
                self._links, self._normals, cosine, part.start, part.stop, self._held
            )

        self._crew.share(hold, len(self._places), VERTICES)

    def take_samples(self, given: Mesh, vertex_map: Indices, plan: Plan, which: int) -> None:
        """Take samples of the mesh given, and add them up for each face."""
        n_given, m = len(given.faces), len(self._normals)
        stride = max(plan.least_stride, round(n_given / (plan.per_face * m)))
        offset = which * stride // plan.rounds
        n_samples = -(-(n_given - offset) // stride)
        if self._samples is None or len(self._samples.face) < n_samples:
            self._samples = _new_samples(n_samples)
        samples = self._samples
        n_groups = ((m - 1) >> GROUP_BITS) + 1
        ends = np.empty((-(-n_samples // SAMPLES), n_groups + 1), np.int64)

        def take(part: slice) -> None:
            desk = self._take_desk()
            n = kernels.samples.take_samples(
                *((*given, vertex_map), self._frame, self._places),
                *(self.faces.reshape(-1), self._normals, self._stars),
                *((part.start, part.stop, stride, offset), desk),
            )
            kernels.samples.sort_samples(
                desk.samples, n, GROUP_BITS, part.start, ends[part.start // SAMPLES], samples
            )
            self._desks.put(desk)

        def add_up(part: slice) -> tuple[float, float, float]:
            group = part.start >> GROUP_BITS
            of_group: tuple[float, float, float] = kernels.fit.sum_samples(
                samples, ends, self._normals, group, part.start, part.stop, EXACT**2, self._sums
            )
            return of_group

        self._ends = ends
        self._crew.share(take, n_samples, SAMPLES)
        self._of_groups = np.array(self._crew.share(add_up, m, 2**GROUP_BITS))

    def _take_desk(self) -> Desk:
        """A desk that is free, or a new one."""
        try:
            return self._desks.get_nowait()
        except Empty:
            return _new_desk()

    @property
    def roughness(self) -> float:
        """The root mean squared height of the samples, over that of the edges, about."""
        squares, counts, _ = self._of_groups.sum(axis=0)
        area = float(self._normals[:, 3].mean())
        return math.sqrt(squares / counts / area) if counts * area > 0.0 else 0.0

    def solve(self, plan: Plan) -> None:
        """Find the steps of all vertices."""
        solver: Solver = kernels.fit.Solver(
            *(plan.stiffness, plan.pull, EXACT**2, FLAT**2, REACH**2, LIFT**2, DOUBT)
        )

        def solve(part: slice) -> None:
            kernels.fit.solve(
                *(self._places, self.faces.reshape(-1), self._links, self._sums),
                *(self._held, solver, part.start, part.stop, self._steps_before, self._steps),
            )

        self._steps_before.fill(0.0)
        for i in range(plan.sweeps):
            if i:
                self._steps, self._steps_before = self._steps_before, self._steps
            self._crew.share(solve, len(self._places), VERTICES)

    def ease_highest(self) -> None:
        """Change steps where single samples are far higher than all others."""
        squares, counts, most2 = self._of_groups.T
        mean2 = squares.sum() / max(counts.sum(), 1.0)
        limit2 = max(HIGH**2 * mean2, HIGHEST**2 * float(most2.max()), EXACT**2)
        of_faces = self._sums[:, kernels.fit.MOST2]
        faces = [
            first + np.flatnonzero(of_faces[first : first + 2**GROUP_BITS] > limit2)
            for first in np.flatnonzero(most2 > limit2) << GROUP_BITS
        ]
        if faces:
            found = np.concatenate(faces)
            order = found[np.argsort(-of_faces[found], kind="stable")]
            kernels.fit.ease_highest(
                *(order, self.faces.reshape(-1), self._links, self._sums, self._held),
                *(math.sqrt(limit2), EXACT**2, np.zeros(len(self._places), np.uint8), self._steps),
            )

    def move(self, cos_turn: float) -> None:
        """Take back steps that harm faces, until none does, and do the others."""
        n, m = len(self._places), len(self._normals)
        harmed, stale = np.zeros(n, np.uint8), np.ones(n, np.uint8)

        def find_harmed(part: slice) -> None:
            kernels.fit.find_harmed(
                *(self._places, self.faces, self._first_normals, self._steps, cos_turn),
                *(stale, part.start, part.stop, harmed),
            )

        def take_back(part: slice) -> int:
            return int(kernels.fit.take_back(part.start, part.stop, self._steps, harmed, stale))

        def move(part: slice) -> None:
            kernels.fit.move(part.start, part.stop, self._steps, self._places)

        crew = self._crew
        while True:
            crew.share(find_harmed, m, AT_ONCE)
            if not sum(crew.share(take_back, n, AT_ONCE)):
                break
            crew = Crew(crew.n_threads)  # how often is not known before
        self._crew.share(move, n, AT_ONCE)

    def lower_spots(self, given: Mesh, vertex_map: Indices, cos_turn: float) -> None:
        """Move vertices where the surfaces are farthest from each other."""
        assert self._first_normals is not None
        vertices = memory.empty(given.vertices.shape)
        self._enter_frame(given.vertices, vertices)
        made: Made = kernels.spots.Made(
            kernels.patches.Surface(self._places, self.faces),
            *(*self._links, self._held, self._first_normals, cos_turn),
            new_boxes(len(self.faces)),
        )
        spots = Spots(made, Mesh(vertices, given.faces), vertex_map, self._crew)
        spots.lower(self._sums[:, kernels.fit.MOST2], EXACT)

    def turn_over(self, cos_turn: float) -> None:
        """Turn edges over by the samples that were taken last, after the vertices have moved."""
        assert self._samples is not None and self._ends is not None
        assert self._first_normals is not None
        taken = Taken(self._samples, self._ends, 2**GROUP_BITS, self._normals, self._steps)
        flips = self._new_flips(cos_turn)
        if self._first_normals is self._normals:  # those of the samples stay as they are
            self._first_normals = self._normals.copy()
        if flips.by_samples(self._places, taken, self._first_normals):
            self._stars = self._new_stars(Crew(self._crew.n_threads))

    def turn_over_caps(self, cos_turn: float) -> None:
        """Turn over the longest sides of faces without height, after all else."""
        thin = find_thin(self._places, self.faces, self._crew)
        if thin.any():
            self._new_flips(cos_turn).of_caps(self._places, thin, self._normals)

    def _new_flips(self, cos_turn: float) -> Flips:
        """What turns over edges of faces and links that are copies."""
        if not self._is_own:
            self.faces = self.faces.copy()
            self._links, self._is_own = Links(*(part.copy() for part in self._links)), True
        table, n_threads = Table(self.faces, *self._links), self._crew.n_threads
        return Flips(table, self._held, cos_turn=cos_turn, exact=EXACT, threads=n_threads)

    def vertices(self) -> Array:
        """The vertices where they are now; shape (n, 3)."""
        moved = np.empty_like(self._places)

        def leave(part: slice) -> None:
            kernels.fit.leave_frame(
                *(self._made.vertices, *self._frame, part.start, part.stop),
                *(self._places, moved),
            )

        self._crew.share(leave, len(moved), AT_ONCE)
        return moved


def _new_samples(n: int) -> Samples:
    samples: Samples = kernels.samples.Samples(
        memory.empty(n, np.int32), memory.empty((n, 3), np.float32)
    )
    return samples


def _new_desk() -> Desk:
    kernel = kernels.samples
    distance2 = np.empty(kernel.LANES, np.float32)
    desk: Desk = kernel.Desk(
        place=np.empty((kernel.BATCH, 6)),
        found=np.empty((kernel.BATCH, 2), np.int32),
        weights=np.empty((kernel.BATCH, 2)),
        distance2=distance2,
        bits=distance2.view(np.int32),
        turned=np.empty(3, np.float32),
        samples=_new_samples(SAMPLES),
    )
    return desk
