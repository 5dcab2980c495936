"""The command compare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from tetsimplify import __version__
from tetsimplify.cli.session import Session, session
from tetsimplify.cli.values import parse_length, parse_ratio
from tetsimplify.errors import OptionError
from tetsimplify.lattices import LATTICES

if TYPE_CHECKING:
    from tetsimplify.compare import Comparison

CRITERIA = "How far to go: one of these is needed"
RUNS = "How each method is run and measured"
VOLUME_OPTIONS = "Volumes"


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command()(compare)


def compare(
    inputs: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="INPUT...",
            help="Meshes and volumes to read, or models: sphere, torus, hyperboloid, gyroid, "
            "tangle; torus:20000 is one of about so many vertices.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FOLDER",
            help="Where to write the report: index.html, results.json, results.csv, meshes. "
            "Runs that are finished there are not done again.",
        ),
    ] = None,
    methods: Annotated[
        str | None,
        typer.Option(metavar="A,B,...", help="Only these; --list tells all of them."),
    ] = None,
    keep_ratio: Annotated[
        str | None,
        typer.Option(
            metavar="R,...",
            help="Parts of the faces to keep: 0.5,0.15 or 50%,15%.",
            rich_help_panel=CRITERIA,
        ),
    ] = None,
    max_edge_length: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH,...",
            help="Lengths in the units of the inputs, or percentages of their median edges such "
            "as 120%. Methods that do not go by length get the number of faces that this gives.",
            rich_help_panel=CRITERIA,
        ),
    ] = None,
    regularised: Annotated[
        bool,
        typer.Option(
            "--regularised",
            help="As many faces as regularised marching tetrahedra give, which take part: for "
            "volumes.",
            rich_help_panel=CRITERIA,
        ),
    ] = False,
    table1: Annotated[
        bool,
        typer.Option(
            "--table1",
            help="Do Table 1 of Pepko and Borisenko (2023) again, without inputs.",
            rich_help_panel=CRITERIA,
        ),
    ] = False,
    level: Annotated[
        list[float] | None,
        typer.Option(
            help="Iso-value, of all volumes; given several times, of each in turn.",
            rich_help_panel=VOLUME_OPTIONS,
        ),
    ] = None,
    lattice: Annotated[
        str | None,
        typer.Option(
            help=f"How cubes are cut into tetrahedra: {', '.join(LATTICES)}.",
            rich_help_panel=VOLUME_OPTIONS,
        ),
    ] = None,
    repair: Annotated[
        bool, typer.Option("--repair", help="Make inputs oriented manifolds first.")
    ] = False,
    repeats: Annotated[
        int | None, typer.Option(help="Runs of each method.", rich_help_panel=RUNS)
    ] = None,
    time_limit: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            help="What all runs of a method may take together.",
            rich_help_panel=RUNS,
        ),
    ] = None,
    tolerance: Annotated[
        str | None,
        typer.Option(
            metavar="PERCENT",
            help="What the bounds of the largest distance may differ by, in diagonals.",
            rich_help_panel=RUNS,
        ),
    ] = None,
    clock: Annotated[
        str | None,
        typer.Option(
            help="Whose seconds to tell: wall, or cpu where the machine has other work.",
            rich_help_panel=RUNS,
        ),
    ] = None,
    show_list: Annotated[
        bool, typer.Option("--list", help="Tell all methods and do nothing.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object, for programs.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
) -> None:
    """Compare tetsimplify with the decimators that people use, on the same inputs.

    Topology, distance, quality, time and memory of each, in a process of its own. What is not
    installed is listed as absent.
    """
    with session("compare", as_json=as_json, quiet=quiet, debug=debug) as this:
        if show_list:
            _list_methods(this)
            return
        given = {
            "keep_ratio": _several(keep_ratio, lambda text: parse_ratio("--keep-ratio", text)),
            "max_edge_length": _several(max_edge_length, _as_length),
            "methods": None if methods is None else methods.split(","),
            "regularised": regularised or None,
            "level": level or None,
            "lattice": lattice,
            "repair": repair or None,
            "repeats": repeats,
            "time_limit": time_limit,
            "clock": clock,
            "tolerance": None if tolerance is None else _as_part(tolerance),
        }
        options = {name: value for name, value in given.items() if value is not None}
        try:
            found = _run(this, inputs or [], output, table1, options)
        except KeyboardInterrupt:
            if output is not None:
                this.note(f"the same command goes on with the runs that are finished in {output}")
            raise
        for note in found.notes:
            this.note(note)
        _finish(this, found, output)


def _run(
    this: Session, inputs: list[str], output: Path | None, table1: bool, options: dict[str, Any]
) -> Comparison:
    """Compare, with a bar that tells what is being done."""
    if table1 and (inputs or options.keys() - {"repeats", "clock"}):
        raise OptionError(
            "--table1 has its own inputs; of the options --repeats and --clock go with it"
        )
    if not table1 and not inputs:
        raise OptionError("give at least one input, or --table1")
    columns = (
        BarColumn(20),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    console = Console(stderr=True)
    hidden = this.quiet or not console.is_terminal
    with (
        Progress(*columns, console=console, transient=True, disable=hidden) as bars,
        this.stage("compare"),
    ):
        bar = bars.add_task("reading", total=100)

        def show(stage: str, done: float) -> None:
            bars.update(bar, completed=round(100 * done), description=stage)

        if table1:
            from tetsimplify.comparison.table1 import table1 as paper

            return paper(output=output, progress=show, **options)
        from tetsimplify.compare import compare as run

        return run(inputs, output=output, progress=show, **options)


def _finish(this: Session, found: Comparison, output: Path | None) -> None:
    """Tell what was found, and where the report is."""
    from tetsimplify.comparison import table1, tables

    results = found.results
    parts = table1.table_of(results) if "table1" in results else tables.tables_of(results)
    if output is not None:
        this.written += [output / name for name in ("results.json", "results.csv")]
        this.written += [] if found.page is None else [found.page]
    wrote = f"Wrote {' and '.join(map(str, this.written))}" if this.written else ""
    header = {"command": this.command, "version_of_tetsimplify": __version__}
    this.finish({**header, **results, "outputs": this.written}, *parts, wrote)


def _list_methods(this: Session) -> None:
    """Tell all methods, what is installed of them and how to install the others."""
    from tetsimplify.cli.tables import table
    from tetsimplify.standard import METHODS

    made = table("Methods", "name", "licence", "goes by", "version")
    for method in METHODS.values():
        version = method.version or f"absent: {method.install}"
        made.add_row(method.name, method.licence, " or ".join(method.takes), version)
    listed = [
        {
            "method": method.name,
            "title": method.title,
            "version": method.version,
            "licence": method.licence,
            "takes": method.takes,
            "install": method.install,
        }
        for method in METHODS.values()
    ]
    this.finish({"command": this.command, "methods": listed}, made)


def _several(text: str | None, parse: Any) -> list[Any] | None:
    return None if text is None else [parse(part.strip()) for part in text.split(",")]


def _as_length(text: str) -> float | str:
    """A length as a number, a percentage as it is."""
    number, is_relative = parse_length("--max-edge-length", text)
    return text if is_relative else number


def _as_part(text: str) -> float:
    number, is_relative = parse_length("--tolerance", text)
    if not is_relative:
        raise OptionError(f"--tolerance must be a percentage of the diagonal, got {text!r}")
    return number
