"""Volumes on the command line: their options, and surfaces out of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from tetsimplify.cli import values
from tetsimplify.cli.session import Session
from tetsimplify.errors import OptionError, VolumeError
from tetsimplify.io import Volume, isosurface_of, read_volume
from tetsimplify.lattices import LATTICES

VOLUME_OPTIONS = "Volumes"

Level = Annotated[
    list[str] | None,
    typer.Option(
        metavar="X|otsu",
        help="Iso-value, or otsu for that which parts the samples best.",
        rich_help_panel=VOLUME_OPTIONS,
    ),
]
Closed = Annotated[
    bool,
    typer.Option("--closed", help="Cap the surface on the sides.", rich_help_panel=VOLUME_OPTIONS),
]
Lattice = Annotated[
    str | None,
    typer.Option(
        help=f"How cubes are cut into tetrahedra: {', '.join(LATTICES)}.",
        rich_help_panel=VOLUME_OPTIONS,
    ),
]
Normals = Annotated[
    str | None,
    typer.Option(help="Point to lower or higher values.", rich_help_panel=VOLUME_OPTIONS),
]
Refine = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        help="So many cubes along the edge of each, by trilinear interpolation.",
        rich_help_panel=VOLUME_OPTIONS,
    ),
]
Regularise = Annotated[
    bool,
    typer.Option(
        "--regularise",
        help="Make a vertex of those around a lattice point: a quarter of the triangles.",
        rich_help_panel=VOLUME_OPTIONS,
    ),
]
Key = Annotated[
    str | None,
    typer.Option(
        help="What to take of a file that holds several: array, path, level, image, series.",
        rich_help_panel=VOLUME_OPTIONS,
    ),
]
Channel = Annotated[
    int | None,
    typer.Option(help="Which channel to take, from 0.", rich_help_panel=VOLUME_OPTIONS),
]
Time = Annotated[
    int | None, typer.Option(help="Which time to take, from 0.", rich_help_panel=VOLUME_OPTIONS)
]
Axes = Annotated[
    str | None,
    typer.Option(
        metavar="LETTERS",
        help="What the axes of an array are, where its file does not tell: zyx, tzcyx.",
        rich_help_panel=VOLUME_OPTIONS,
    ),
]
Spacing = Annotated[
    str | None,
    typer.Option(
        metavar="A,B,C",
        help="Distance between samples along the axes, instead of that in the file.",
        rich_help_panel=VOLUME_OPTIONS,
    ),
]


def one_level(given: Sequence[str]) -> float | str:
    """The level of a command that makes one surface."""
    levels = values.parse_levels(given)
    if len(levels) > 1:
        raise OptionError(f"give one --level, got {', '.join(map(str, levels))}")
    return levels[0]


def opened(
    this: Session, path: Path, chosen: Mapping[str, Any], spacing: str | None = None
) -> Volume:
    """Open a volume."""
    distances = None if spacing is None else values.parse_spacing(spacing)
    begun = this.seconds.get("read", 0.0)  # of volumes that were opened before
    with this.stage("read"):
        volume = read_volume(path, **chosen)
    this.seconds["read"] += begun
    return volume if distances is None else volume.with_spacing(distances)


def nothing_crosses(level: float, path: Path, volume: Volume) -> VolumeError:
    """What to say where a surface has no faces."""
    low, high = volume.value_range()
    return VolumeError(
        f"nothing crosses the level {level:g}: the values of {path} go from {low} to {high}"
    )


def extract(
    this: Session,
    path: Path,
    chosen: Mapping[str, Any],
    spacing: str | None,
    options: Mapping[str, Any],
) -> Any:
    """Extract a surface or several from a volume, and explain when there is none."""
    volume = opened(this, path, chosen, spacing)
    given = {name: value for name, value in options.items() if value is not None}
    with this.stage("extract"):
        found = isosurface_of(volume, progress=this.progress, **given)
    for surface in found if isinstance(found, list) else [found]:
        if len(surface.faces):
            continue
        if "labels" in given:
            raise VolumeError(f"there is no label {surface.label} in {path}")
        raise nothing_crosses(surface.level, path, volume)
    if not found:
        raise VolumeError(f"there is no label in {path}, all is background")
    return found
