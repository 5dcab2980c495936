"""What several commands take, do and tell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tetsimplify import __version__
from tetsimplify.cli.session import Session
from tetsimplify.io import MESH_FORMATS, VOLUME_FORMATS, write_mesh
from tetsimplify.mesh import Mesh

MESH_SUFFIXES = " ".join(MESH_FORMATS)
VOLUME_SUFFIXES = " ".join(VOLUME_FORMATS)

AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, for programs.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")]
Output = Annotated[
    Path,
    typer.Option("--output", "-o", metavar="MESH", help=f"Mesh to write: {MESH_SUFFIXES}"),
]


def header(this: Session, source: Path | str) -> dict[str, Any]:
    """What every result begins with."""
    made = {"command": this.command, "version": __version__, "input": source}
    return {**made, "outputs": this.written} if this.written else made


def wrote(this: Session) -> str:
    """The files that were written, in a sentence."""
    return f"Wrote {' and '.join(map(str, this.written))}"


def topology(this: Session, mesh: Mesh) -> Any:
    """Tell the topology of a mesh."""
    from tetsimplify.topology import topology as topology_of

    with this.stage("topology"):
        return topology_of(*mesh)


def write(this: Session, path: Path, mesh: Mesh) -> None:
    """Write a mesh."""
    with this.stage("write"):
        write_mesh(path, mesh)
    this.written.append(path)
