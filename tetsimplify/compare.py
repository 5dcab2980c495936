"""The comparative evaluation: our modes, the standard contraction, and what people use."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tetsimplify.errors import OptionError
from tetsimplify.options import Progress

if TYPE_CHECKING:
    from tetsimplify.standard import Method


@dataclass(frozen=True, eq=False)
class Comparison:
    """What :func:`compare` found."""

    results: dict[str, Any] = field(repr=False)
    """The document that `results.json` holds; see the page on comparisons."""
    folder: Path | None
    """Where the report is, None where none was asked for."""
    page: Path | None
    """The report for a browser, None where it could not be made."""
    notes: list[str]
    """What the caller should know."""

    @property
    def runs(self) -> list[dict[str, Any]]:
        """One entry for each input, criterion and method that is installed."""
        found: list[dict[str, Any]] = self.results["runs"]
        return found


def compare(
    inputs: Sequence[Any] | Mapping[str, Any],
    *,
    methods: Sequence[str | Method] | None = None,
    keep_ratio: float | Sequence[float] | None = None,
    max_edge_length: float | str | Sequence[float | str] | None = None,
    output: str | os.PathLike[str] | None = None,
    regularised: bool = False,
    level: float | Sequence[float] | None = None,
    lattice: str = "kuhn",
    repair: bool = False,
    repeats: int = 3,
    time_limit: float = 600.0,
    tolerance: float = 1e-4,
    clock: str = "wall",
    progress: Progress | None = None,
) -> Comparison:
    """Simplify the same inputs with many methods, and measure what comes of it.

    Each run has a process and a core of its own. A crash, a hang, an error or a wrong number of
    faces is an entry of the result like others; a method whose package is missing is listed as
    absent.

    Parameters
    ----------
    inputs : sequence, or mapping of names
        Files of meshes or volumes; models such as ``"torus"`` or ``"gyroid:20000"``, which is a
        number of vertices; pairs of vertices and faces.
    methods : sequence of str or Method, optional
        Names in :data:`tetsimplify.standard.METHODS`, or methods of your own; all of
        :data:`~tetsimplify.standard.METHODS` if not given.
    keep_ratio : float or several, optional
        Parts of the faces to keep. This or one of the next two is given.
    max_edge_length : float, str or several, optional
        Lengths in the units of the inputs, or percentages of their median edges such as
        ``"120%"``. Methods that do not go by length get the number of faces that the contraction
        of all shorter edges comes to.
    regularised : bool
        For files of volumes: extract the surface by regularised marching tetrahedra, and simplify
        the plain surface to as many faces by the other methods.
    output : path-like, optional
        Folder for the report: `results.json`, `results.csv`, `index.html` and the meshes. Runs
        that are finished there already, with the same input, options, versions and processor,
        are not done again.
    level : float or several, optional
        Iso-value of the volumes: one for all, or one for each.
    lattice : {"kuhn", "five", "bcc"}
        How the cubes of volumes are cut; see :func:`tetsimplify.extract_isosurface`.
    repair : bool
        Make inputs that are no oriented manifolds such ones first. Else they are refused.
    repeats : int
        How often each method runs; the first run does not count. What takes longer than 5 s runs
        once.
    time_limit : float
        Seconds that a process may take for all of that.
    tolerance : float
        What the bounds of the largest distance may differ by, as a part of the diagonal of the
        input.
    clock : {"wall", "cpu"}
        Whose seconds are told. The time of the processor is to be preferred where the machine has
        other work.
    progress : callable, optional
        Called as ``progress(stage, done)`` with what comes next and `done` from 0 to 1.

    Returns
    -------
    Comparison

    Raises
    ------
    OptionError
        When an option has a wrong value, or there is no such method or model.
    FileError, VolumeError, MeshError
        When an input cannot be read, or is no oriented manifold and `repair` is False.

    Examples
    --------
    >>> from tetsimplify.compare import compare
    >>> found = compare(
    ...     ["sphere:2000"], methods=["tetsimplify-quadric", "standard"], keep_ratio=0.2, repeats=1
    ... )
    >>> [(run["method"], run["status"]) for run in found.runs]
    [('tetsimplify-quadric', 'ok'), ('standard', 'ok')]
    """
    from tetsimplify.comparison.bench import carry_out
    from tetsimplify.comparison.inputs import load
    from tetsimplify.comparison.tasks import Settings, Task, criteria
    from tetsimplify.standard import chosen

    settings = Settings(repeats, time_limit, tolerance, clock)
    asked = criteria(keep_ratio, max_edge_length, regularised)
    wanted = [method for method in chosen(methods) if asked[0].suits(method)]
    if methods is not None and len(wanted) < len(chosen(methods)):
        raise OptionError("tetsimplify-regularised goes with regularised, and with nothing else")
    given = load(inputs, level=level, lattice=lattice, repair=repair)
    tasks = [
        Task(one, method, criterion)
        for one in given
        for criterion in dict.fromkeys(each.on(one) for each in asked)
        for method in wanted
        if method.version is not None
    ]
    return carry_out(tasks, given, wanted, settings, output, progress=progress)
