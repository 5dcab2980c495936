"""The command isosurface."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tetsimplify.cli import tables, values
from tetsimplify.cli.session import Session, session
from tetsimplify.cli.steps import (
    VOLUME_SUFFIXES,
    AsJson,
    Debug,
    Output,
    Quiet,
    header,
    wrote,
)
from tetsimplify.cli.volumes import (
    Axes,
    Channel,
    Closed,
    Key,
    Lattice,
    Normals,
    Refine,
    Regularise,
    Spacing,
    Time,
    extract,
    opened,
)
from tetsimplify.errors import OptionError
from tetsimplify.io import check_target, write_meshes
from tetsimplify.io.files import suffix_among
from tetsimplify.io.meshes import MESH_FORMATS
from tetsimplify.mesh import NORMALS

WHAT = "What to extract: one of these is needed"
VERTEX_OPTIONS = "What vertices carry"


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command()(isosurface)


def isosurface(
    volume: Annotated[Path, typer.Argument(help=f"Volume to read: {VOLUME_SUFFIXES}")],
    output: Output,
    level: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X|otsu,...",
            help="Iso-value, or otsu for that which parts the samples best. Of several, given "
            "with commas or one by one, each has a file of its own: head.ply becomes "
            "head-80.5.ply.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    labels: Annotated[
        str | None,
        typer.Option(
            metavar="all|N,...",
            help="Labels of a volume of integers, each in a file of its own: frog-3.ply. "
            "Surfaces of neighbours fit.",
            rich_help_panel=WHAT,
        ),
    ] = None,
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
    vertex_normals: Annotated[
        bool,
        typer.Option(
            "--vertex-normals",
            help="Write normals of the gradient: not to .stl.",
            rich_help_panel=VERTEX_OPTIONS,
        ),
    ] = False,
    vertex_data: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VOLUME",
            help="Write the values of another volume of the same shape, read likewise: to .ply, "
            ".vtk, .vtp, .vtu.",
            rich_help_panel=VERTEX_OPTIONS,
        ),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Extract surfaces of a volume by marching tetrahedra: where it has a value, or of labels."""
    with session("isosurface", as_json=as_json, quiet=quiet, debug=debug) as this:
        if (not level) == (labels is None):
            raise OptionError("give either --level or --labels")
        levels = values.parse_levels(level or [])
        numbers = None if labels is None else values.parse_labels(labels)
        fields = values.parse_named("--vertex-data", vertex_data or [])
        carried = [*fields, *([NORMALS] if vertex_normals else [])]
        for path in _targets(output, levels, numbers):
            check_target(path, carried)
        chosen = {"key": key, "channel": channel, "time": time, "axes": axes}
        options = {
            "level": levels if len(levels) > 1 else levels[0] if levels else None,
            "labels": numbers,
            "lattice": lattice,
            "normals": normals,
            "closed": closed or None,
            "refine": refine,
            "regularise": regularise or None,
            "vertex_normals": vertex_normals or None,
            "vertex_data": {name: opened(this, Path(path), chosen) for name, path in fields.items()}
            or None,
        }
        found = extract(this, volume, chosen, spacing, options)
        surfaces = found if isinstance(found, list) else [found]
        if numbers is not None:
            numbers = [surface.label for surface in surfaces]
        targets = _targets(output, levels, numbers)
        from tetsimplify.topology import topology

        with this.stage("topology"):
            topologies = [topology(*surface) for surface in surfaces]
        with this.stage("write"):
            rows = zip(targets, surfaces, strict=True)
            write_meshes([(path, one, getattr(one, "vertex_data", {})) for path, one in rows])
        this.written += targets
        _finish(this, volume, surfaces, topologies)


def _targets(output: Path, levels: list[float | str], labels: list[int] | str | None) -> list[Path]:
    """The file of each surface; where the labels are not known yet, one that stands for all."""
    if isinstance(labels, str) or (labels is None and len(levels) == 1):
        return [output]
    suffix = suffix_among(output, MESH_FORMATS) or ""
    stem = output.name[: len(output.name) - len(suffix)]
    ending = output.name[len(stem) :]
    words = [str(each).removesuffix(".0") for each in labels or levels]
    return [output.with_name(f"{stem}-{word}{ending}") for word in words]


def _finish(this: Session, volume: Path, surfaces: list[Any], topologies: list[Any]) -> None:
    """Tell what came of it: of one surface as such, of several one by one."""
    names = [
        f"label {one.label}" if hasattr(one, "label") else f"level {one.level:g}"
        for one in surfaces
    ]
    told = [
        {
            **({"label": one.label} if hasattr(one, "label") else {"level": one.level}),
            "topology": tables.topology_as_dict(each),
        }
        for one, each in zip(surfaces, topologies, strict=True)
    ]
    if len(surfaces) == 1 and "level" in told[0]:
        result: dict[str, Any] = told[0]
        parts = [tables.topology_table("Topology", isosurface=topologies[0])]
    else:
        outputs = zip(this.written, told, strict=True)
        result = {"surfaces": [{"output": path, **each} for path, each in outputs]}
        parts = [tables.surfaces_table(dict(zip(names, topologies, strict=True)))]
    this.finish(
        {**header(this, volume), **result, "seconds": this.seconds},
        *parts,
        tables.seconds_table(this.seconds),
        wrote(this),
    )
