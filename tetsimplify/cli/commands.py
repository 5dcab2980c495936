"""The commands: simplify, info, distance and demo; isosurface and compare are beside."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer

from tetsimplify import __version__
from tetsimplify.cli import compare, isosurface, tables, values
from tetsimplify.cli.session import Session, session
from tetsimplify.cli.steps import (
    MESH_SUFFIXES,
    VOLUME_SUFFIXES,
    AsJson,
    Debug,
    Output,
    Quiet,
    header,
    topology,
    write,
    wrote,
)
from tetsimplify.cli.volumes import (
    Axes,
    Channel,
    Closed,
    Key,
    Lattice,
    Level,
    Normals,
    Refine,
    Regularise,
    Spacing,
    Time,
    extract,
    nothing_crosses,
    one_level,
    opened,
)
from tetsimplify.cli.wanted import Wanted, diagonal, median_edge
from tetsimplify.edges import edge_lengths
from tetsimplify.errors import FileError, MissingExtraError, OptionError
from tetsimplify.io import (
    check_target,
    is_mesh_file,
    is_volume_file,
    read_mesh,
)
from tetsimplify.mesh import Mesh

CRITERIA = "What stops it: the first of these that is reached, at least one is needed"
CONTRACTIONS = "Which edges go, and where the new vertex is"
GUARDS = "What is held"

app = typer.Typer(
    name="tetsimplify",
    help="Extract surfaces from voxel volumes and simplify triangle meshes without ever "
    "changing their topology.",
    epilog="Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted.",
    no_args_is_help=True,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)

isosurface.register(app)


@app.command()
def simplify(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="MESH|VOLUME",
            help=f"Mesh to read: {MESH_SUFFIXES}; or volume: {VOLUME_SUFFIXES}",
        ),
    ],
    output: Output,
    max_edge_length: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH|PERCENT",
            help="Contract shorter edges: a length in the units of the mesh, or a percentage "
            "of the median edge length such as 120%.",
            rich_help_panel=CRITERIA,
        ),
    ] = None,
    target_faces: Annotated[
        int | None,
        typer.Option(metavar="N", help="Leave so many faces.", rich_help_panel=CRITERIA),
    ] = None,
    keep_ratio: Annotated[
        str | None,
        typer.Option(
            metavar="R|PERCENT",
            help="Leave such a part of the faces: 0.15 or 15%.",
            rich_help_panel=CRITERIA,
        ),
    ] = None,
    max_error: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH|PERCENT",
            help="Distance between both surfaces, proven: a length, or a percentage of the "
            "diagonal of the bounding box such as 0.1%.",
            rich_help_panel=CRITERIA,
        ),
    ] = None,
    max_quadric_error: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH|PERCENT",
            help="Mean distance of each vertex from the planes merged into it, likewise; fast, "
            "and no bound of the distance.",
            rich_help_panel=CRITERIA,
        ),
    ] = None,
    cost: Annotated[
        str | None,
        typer.Option(
            help="What makes an edge cheap: length, quadric or auto.",
            rich_help_panel=CONTRACTIONS,
        ),
    ] = None,
    placement: Annotated[
        str | None,
        typer.Option(
            help="Where the new vertex goes: midpoint, quadric, endpoint or auto.",
            rich_help_panel=CONTRACTIONS,
        ),
    ] = None,
    blocked: Annotated[
        str | None,
        typer.Option(
            help="Edges that the link condition blocks: contract, skip or violate.",
            rich_help_panel=CONTRACTIONS,
        ),
    ] = None,
    outer: Annotated[
        str | None,
        typer.Option(
            help="How to tell what is outside of nested 3-cycles: region, path or distance.",
            rich_help_panel=CONTRACTIONS,
        ),
    ] = None,
    fit: Annotated[
        bool | None,
        typer.Option(
            "--fit/--no-fit",
            help="Move the vertices nearer to the surface given in the end; so by default where "
            "a number of faces is asked for by quadric error.",
            show_default=False,
            rich_help_panel=CONTRACTIONS,
        ),
    ] = None,
    removal_limit: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH|Nx|inf",
            help="How far from its edge a nested contraction may remove vertices: a length, "
            "a multiple of --max-edge-length such as 4x, or inf.",
            rich_help_panel=GUARDS,
        ),
    ] = None,
    boundary: Annotated[
        str | None,
        typer.Option(
            help="Boundary edges: simplify them, keep the curve, or lock them.",
            rich_help_panel=GUARDS,
        ),
    ] = None,
    feature_angle: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES",
            help="Hold edges between faces whose normals differ by more.",
            rich_help_panel=GUARDS,
        ),
    ] = None,
    foldover: Annotated[
        str | None,
        typer.Option(
            metavar="DEGREES|off",
            help="Largest turn of a face in one contraction.",
            rich_help_panel=GUARDS,
        ),
    ] = None,
    normal_deviation: Annotated[
        str | None,
        typer.Option(
            metavar="DEGREES|off",
            help="Largest turn of a face in all contractions together.",
            rich_help_panel=GUARDS,
        ),
    ] = None,
    shape: Annotated[
        str | None,
        typer.Option(
            metavar="X|off",
            help="Avoid triangles of worse shape: from 0 to 1, which is equilateral.",
            rich_help_panel=GUARDS,
        ),
    ] = None,
    repair: Annotated[
        bool, typer.Option("--repair", help="Make the mesh an oriented manifold first.")
    ] = False,
    threads: Annotated[
        int | None,
        typer.Option(help="So many, which changes nothing but the time; all cores if not given."),
    ] = None,
    level: Level = None,
    closed: Closed = False,
    lattice: Lattice = None,
    normals: Normals = None,
    refine: Refine = None,
    regularise: Regularise = False,
    key: Key = None,
    channel: Channel = None,
    time: Time = None,
    axes: Axes = None,
    spacing: Spacing = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Contract edges until a criterion is reached, and keep the topology.

    A volume is turned into the surface at --level first.
    """
    with session("simplify", as_json=as_json, quiet=quiet, debug=debug) as this:
        check_target(output)
        wanted = Wanted(
            {
                "max_edge_length": max_edge_length,
                "target_faces": target_faces,
                "keep_ratio": keep_ratio,
                "max_error": max_error,
                "max_quadric_error": max_quadric_error,
                "cost": cost,
                "placement": placement,
                "blocked": blocked,
                "outer": outer,
                "removal_limit": removal_limit,
                "boundary": boundary,
                "feature_angle": feature_angle,
                "foldover": foldover,
                "normal_deviation": normal_deviation,
                "shape": shape,
                "fit": fit,
            }
        )
        volume_options = {
            "lattice": lattice,
            "normals": normals,
            "closed": closed or None,
            "refine": refine,
            "regularise": regularise or None,
        }
        chosen = {"key": key, "channel": channel, "time": time, "axes": axes}
        result = None
        if is_volume_file(source) and level and not repair:
            result = _stream(this, source, level, chosen, spacing, volume_options, wanted, threads)
        if result is None:
            mesh = _read(this, source, level, chosen, spacing, volume_options)
            result = _simplify(this, mesh, repair=repair, threads=threads, **wanted.options(mesh))
        write(this, output, Mesh(result.vertices, result.faces))
        this.finish(
            {
                **header(this, source),
                **tables.simplification_as_dict(result.report),
                "seconds": this.seconds,
            },
            *tables.simplification_tables(result.report, this.seconds),
            tables.headline(result.report),
            wrote(this),
        )


@app.command()
def info(
    mesh: Annotated[Path, typer.Argument(help=f"Mesh to read: {MESH_SUFFIXES}")],
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Tell the topology of a mesh, its quality, and what keeps it from being a manifold."""
    with session("info", as_json=as_json, quiet=quiet, debug=debug) as this:
        with this.stage("read"):
            surface = read_mesh(mesh)
        found = topology(this, surface)
        lengths = edge_lengths(surface)
        shapes = _quality(this, surface)
        defects = tables.defect_table(found)
        this.finish(
            {
                **header(this, mesh),
                "topology": tables.topology_as_dict(found),
                "edge_lengths": tables.lengths_as_dict(lengths),
                "quality": shapes.as_dict(),
                "seconds": this.seconds,
            },
            tables.topology_table("Topology", mesh=found),
            tables.lengths_table(lengths),
            tables.quality_table(shapes),
            *([] if defects is None else [defects]),
        )


@app.command()
def distance(
    a: Annotated[Path, typer.Argument(help=f"Mesh to read: {MESH_SUFFIXES}")],
    b: Annotated[Path, typer.Argument(help="Mesh to compare it with.")],
    tolerance: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH|PERCENT",
            help="What the bounds of the largest distance may differ by: a length, or a "
            "percentage of the diagonal of the bounding box of A.",
        ),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Measure the distance between two surfaces, both ways."""
    with session("distance", as_json=as_json, quiet=quiet, debug=debug) as this:
        number, is_relative = 0.0, False
        if tolerance is not None:
            number, is_relative = values.parse_length("--tolerance", tolerance)
        with this.stage("read"):
            first, second = read_mesh(a), read_mesh(b)
        whole = diagonal(first)

        from tetsimplify.distance import surface_distance

        with this.stage("distance"):
            bound = None if tolerance is None else number * (whole if is_relative else 1.0)
            found = surface_distance(first, second, tolerance=bound, progress=this.progress)
        this.finish(
            {
                **header(this, a),
                "other": b,
                "distance": tables.distance_as_dict(found),
                "diagonal": whole,
                "seconds": this.seconds,
            },
            tables.distance_table(found, whole),
            tables.seconds_table(this.seconds),
        )


@app.command()
def demo(
    output_dir: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Where to write brain.ply and brain.png.")
    ] = Path(),
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Do the main job on a real volume: the brain of an average MRI.

    Extracts 925,212 triangles, contracts every edge shorter than 1.2 median edges, writes
    the result and a picture of before and after.
    """
    with session("demo", as_json=as_json, quiet=quiet, debug=debug) as this:
        from tetsimplify import demo as work

        mesh_path, picture_path = output_dir / "brain.ply", output_dir / "brain.png"
        check_target(mesh_path)
        with this.stage("extract"):
            before = work.extract_brain(this.progress)
        length = work.MEDIAN_EDGES * median_edge(before)
        result = _simplify(this, before, max_edge_length=length)
        after = Mesh(result.vertices, result.faces)
        write(this, mesh_path, after)
        try:
            with this.stage("draw"):
                work.save_picture(picture_path, before, result)
            this.written.append(picture_path)
        except MissingExtraError as error:
            this.note(f"no picture: {error}")
        this.finish(
            {
                **header(this, work.VOLUME),
                "level": work.LEVEL,
                **tables.simplification_as_dict(result.report),
                "seconds": this.seconds,
            },
            f"Average brain MRI, 1 mm, at level {work.LEVEL}: edges shorter than "
            f"{length:.4g} mm ({work.MEDIAN_EDGES} median edges) contracted",
            "",
            *tables.simplification_tables(result.report, this.seconds),
            tables.headline(result.report),
            wrote(this),
        )


compare.register(app)


def _read(
    this: Session,
    source: Path,
    level: list[str] | None,
    chosen: dict[str, Any],
    spacing: str | None,
    options: dict[str, Any],
) -> Mesh:
    """Read a mesh, or extract one from a volume."""
    if is_volume_file(source):
        if not level:
            raise OptionError(f"{source} is a volume, so --level is needed")
        options = {**options, "level": one_level(level)}
        mesh: Mesh = extract(this, source, chosen, spacing, options)
        return mesh
    if not is_mesh_file(source):
        raise FileError(
            f"{source} has no known suffix; meshes have {MESH_SUFFIXES}, volumes {VOLUME_SUFFIXES}"
        )
    given = {"level": level or None, **chosen, "spacing": spacing, **options}
    if wrong := [f"--{name}" for name, value in given.items() if value is not None]:
        raise OptionError(f"{', '.join(wrong)}: only for volumes, and {source} is a mesh")
    with this.stage("read"):
        return read_mesh(source)


def _stream(
    this: Session,
    path: Path,
    level: list[str],
    chosen: dict[str, Any],
    spacing: str | None,
    volume_options: dict[str, Any],
    wanted: Wanted,
    threads: int | None,
) -> Any:
    """Simplify the surface of a volume while it is extracted; None where all of it is needed."""
    from tetsimplify.io.simplified import has_right_angles, simplified_isosurface_of

    options = wanted.streamed()
    given = {name: value for name, value in volume_options.items() if value is not None}
    if options is None or given.keys() & {"refine", "regularise"}:
        return None
    number = one_level(level)
    volume = opened(this, path, chosen, spacing)
    if not has_right_angles(volume):
        return None
    result = simplified_isosurface_of(
        volume, number, threads=threads, progress=this.progress, **options, **given
    )
    this.seconds.update(result.report.seconds)
    if not len(result.faces):
        raise nothing_crosses(result.level, path, volume)
    return result


def _simplify(this: Session, mesh: Mesh, **options: Any) -> Any:
    from tetsimplify.simplify import simplify as contract

    result = contract(*mesh, progress=this.progress, **options)
    this.seconds.update(result.report.seconds)
    return result


def _quality(this: Session, mesh: Mesh) -> Any:
    from tetsimplify.quality import quality

    with this.stage("quality"):
        return quality(*mesh)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"tetsimplify {__version__}")
        raise typer.Exit


@app.callback()
def _tetsimplify(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version.", is_eager=True, callback=_show_version),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line of the console script."""
    # A polite request to end must not leave a temporary file behind either.
    signal.signal(signal.SIGTERM, _end)
    app()


def _end(number: int, frame: FrameType | None) -> None:
    sys.exit(128 + number)
