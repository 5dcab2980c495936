"""The page of a comparison: one HTML file that needs no network.

`page.html` is the skeleton. `tables` and `figures` write its words and tables; the scripts draw
charts and views from the data that are embedded. Nothing but plotly.js comes from elsewhere, and
the page itself forbids the browser to load anything.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterator, Mapping
from functools import cache
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tetsimplify
from tetsimplify.arrays import as_mesh
from tetsimplify.comparison.page import embedding, figures, tables, wording
from tetsimplify.comparison.page.model import (
    OURS,
    Comparison,
    Run,
    case_of,
    has_mesh,
    is_kept,
    is_ours,
)
from tetsimplify.errors import MissingExtraError
from tetsimplify.io.files import reading, replacing
from tetsimplify.mesh import Mesh

NAME = "index.html"
SCRIPTS = ("mesh.js", "camera.js", "surface.js", "views.js", "charts.js", "page.js")

Floats = NDArray[np.float64]


def write_page(results: Mapping[str, Any], folder: str | os.PathLike[str]) -> Path:
    """Write the page of a comparison.

    Parameters
    ----------
    results : mapping
        What was measured; the content of ``results.json``.
    folder : path-like
        Where the meshes are that the results name, and where the page goes.

    Returns
    -------
    Path
        The page, ``index.html``. It is replaced once the new one is complete.

    Raises
    ------
    OptionError
        When the results are no comparison of a version that is known.
    FileError
        When a mesh cannot be read or the page cannot be written.
    MissingExtraError
        When plotly is not installed.
    """
    plotly = _plotly()
    comparison = Comparison(results)
    path = Path(folder) / NAME
    meshes = _Meshes(comparison, Path(folder))
    stored = dict(meshes.embedded())
    content = {
        "title": escape(f"Simplifiers compared: {', '.join(_names(comparison))}"),
        "heading": escape(f"{_title(comparison)}, simplified"),
        "lede": tables.lede(comparison),
        "verdicts": tables.verdicts(comparison),
        "absent": tables.absent(comparison),
        "failures": tables.failures(comparison),
        "figures": figures.table(comparison),
        "epsilon": tables.short_lengths(comparison),
        "machine": tables.machine(comparison),
        "methods": tables.methods(comparison),
        "embedding": escape(meshes.told()),
        "version": tetsimplify.__version__,
        "comparison": _json(_data(comparison, meshes)),
        "meshes": "\n".join(
            f'<script type="application/json" id="mesh-{key}">{_json(mesh)}</script>'
            for key, mesh in stored.items()
        ),
        "plotly": plotly,
        "css": _text("page.css"),
        "scripts": "\n".join(map(_text, SCRIPTS)),
    }
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: content[match[1]], _text("page.html"))
    with replacing(path) as temporary:
        temporary.write_text(page, encoding="utf-8", newline="\n")
    return path


class _Meshes:
    """The meshes of a comparison, each embedded as a whole or around some places."""

    def __init__(self, comparison: Comparison, folder: Path) -> None:
        self.comparison = comparison
        self.folder = folder
        self.limit = embedding.whole_limit([entry["n_faces"] for _, entry in self.entries()])

    def entries(self) -> Iterator[tuple[str, Run]]:
        """Keys, and inputs or runs; those without a face have nothing to be shown."""
        for k, entry in enumerate(self.comparison.inputs):
            if entry.get("mesh") and entry["n_faces"]:
                yield f"input-{k}", entry
        for k, run in enumerate(self.comparison.runs):
            if has_mesh(run) and run.get("mesh") and run["n_faces"]:
                yield f"run-{k}", run

    def is_whole(self, entry: Run) -> bool:
        """Whether a mesh is small enough."""
        return bool(entry["n_faces"] <= self.limit)

    def embedded(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Keys, and what goes into the page."""
        for key, entry in self.entries():
            mesh = self.read(entry)
            if not self.is_whole(entry):
                mesh = embedding.patches(mesh, self.places(entry.get("input") or entry["name"]))
            yield key, embedding.embedded(mesh, _violating_edges(entry))

    @cache  # noqa: B019
    def places(self, name: str) -> Floats:
        """Where the large meshes of an input are looked at."""
        entry = next(entry for entry in self.comparison.inputs if entry["name"] == name)
        edges = [_violating_edges(run) for run in self.comparison.runs if run["input"] == name]
        return embedding.places_of(edges, self.read(entry).vertices)

    def read(self, entry: Run) -> Mesh:
        """The mesh of an input or a run, less the faces with corners that are not finite."""
        path = self.folder / entry["mesh"]
        with reading(path), np.load(path, allow_pickle=False) as arrays:
            mesh = as_mesh(arrays["vertices"], arrays["faces"], finite=False)
        is_finite = np.isfinite(mesh.vertices[mesh.faces]).reshape(-1, 9)
        return Mesh(mesh.vertices, mesh.faces[np.all(is_finite, axis=1)])

    def told(self) -> str:
        """What is left out, as the page says it."""
        if all(self.is_whole(entry) for _, entry in self.entries()):
            return ""
        return (
            f" Meshes of more than {wording.whole(self.limit)} faces are here around some places "
            f"only, those of violating edges where there are any, with "
            f"{wording.whole(embedding.PATCH_FACES)} faces each; the folder of this page has all."
        )


# --- data for the scripts --------------------------------------------------------------------


def _data(comparison: Comparison, meshes: _Meshes) -> dict[str, Any]:
    names = _names(comparison)
    cases = comparison.cases
    methods = [run["method"] for run in comparison.methods]
    runs = []
    for k, run in enumerate(comparison.runs):
        case = case_of(run)
        entry = {
            "number": k,
            "method": methods.index(run["method"]),
            "input": names.index(run["input"]),
            "case": cases.index(case),
            "criterion": case.name,
            "status": run["status"],
        }
        runs.append(entry | (_measured(comparison, run) if has_mesh(run) else {}))
    return {
        "methods": [
            {
                "key": run["method"],
                "title": run["title"],
                "package": run.get("package") or "",
                "isOurs": is_ours(run),
                "isPeer": run.get("package") != OURS,
            }
            for run in comparison.methods
        ],
        "inputs": [_scene(entry, meshes) for entry in comparison.inputs],
        "cases": [
            {
                "input": names.index(case.input),
                "criterion": case.name,
                "title": f"{case.input} at {case.name}",
            }
            for case in cases
        ],
        "runs": runs,
        "results": {key: _told(comparison, meshes, key, entry) for key, entry in meshes.entries()},
        "firstCase": _first_case(comparison),
    }


def _measured(comparison: Comparison, run: Run) -> dict[str, Any]:
    diagonal = comparison.diagonal(run)
    distance = run.get("distance") or {}
    quality = run.get("quality") or {}
    return {
        "nFaces": run["n_faces"],
        "isKept": is_kept(run),
        "error": {
            kind: distance[kind] / diagonal for kind in ("mean", "upper") if kind in distance
        },
        "degrees": run["edge_degrees"],
        "nViolating": run["n_violating_edges"],
        "histogram": quality.get("histogram"),
        "meanRatio": wording.short(quality.get("mean_ratio")),
    }


def _scene(entry: Run, meshes: _Meshes) -> dict[str, Any]:
    """The ball that an input is seen in."""
    vertices = meshes.read(entry).vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = (low + high) / 2
    radius = float(np.linalg.norm(vertices - middle, axis=1).max()) or 1.0
    return {"name": entry["name"], "middle": middle.tolist(), "radius": radius}


def _told(comparison: Comparison, meshes: _Meshes, key: str, entry: Run) -> dict[str, Any]:
    """What the views say of a mesh."""
    n = entry["n_faces"]
    euler = entry.get("euler_characteristic", entry.get("topology", {}).get("euler_characteristic"))
    about = f"{wording.counted(n, 'face')}, χ {wording.whole(euler)}."
    if key.startswith("run"):
        why = "; ".join(entry["why_not"])
        about += " Topology kept." if is_kept(entry) else f" Topology broken: {why or 'changed'}."
        marked, violating = len(_violating_edges(entry)), entry["n_violating_edges"]
        if marked < violating:
            about += f" {wording.whole(marked)} of {wording.whole(violating)} edges are marked."
    part = "" if meshes.is_whole(entry) else "Only the surroundings of some places are shown."
    name = entry.get("input") or entry["name"]
    return {
        "mesh": f"mesh-{key}",
        "input": _names(comparison).index(name),
        "about": about,
        "part": part,
    }


def _first_case(comparison: Comparison) -> int:
    """The case to begin with: most results have violations there, and those the fewest."""
    found: dict[int, list[int]] = {}
    for run in comparison.runs:
        if has_mesh(run) and run["n_violating_edges"]:
            number = comparison.cases.index(case_of(run))
            found.setdefault(number, []).append(run["n_violating_edges"])
    return min(found, key=lambda case: (-len(found[case]), sum(found[case])), default=0)


def _violating_edges(entry: Run) -> Floats:
    return np.array(entry.get("violating_edges") or [], np.float64).reshape(-1, 6)


def _names(comparison: Comparison) -> list[str]:
    return [entry["name"] for entry in comparison.inputs]


def _title(comparison: Comparison) -> str:
    names = _names(comparison)
    return wording.listing(names) if len(names) <= 4 else wording.counted(len(names), "surface")


# --- text ------------------------------------------------------------------------------------


def _plotly() -> str:
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise MissingExtraError("the page of a comparison", "plotly", "compare") from error
    return str(get_plotlyjs()).replace("</script", "<\\/script")


def _json(data: Any) -> str:
    """JSON that no HTML parser ends early; what is not finite becomes null."""
    text = json.dumps(_finite(data), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _finite(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {str(key): _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def _text(name: str) -> str:
    return (files(__package__) / name).read_text(encoding="utf-8")
