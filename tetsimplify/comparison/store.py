"""The folder of a report: finished runs, their meshes, the results as JSON and CSV."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tetsimplify.errors import FileError
from tetsimplify.io.files import replacing
from tetsimplify.mesh import Mesh

RESULTS = "results.json"
TABLE = "results.csv"
MESHES = "meshes"
RUNS = "runs"
NO_FILE_NAME = r"[^\w.-]+"  # what is left out of names of files
LISTS = ("violating_edges", "all", "histogram", "key", "clocks")  # that have no place in a table


class Store:
    """Keeps finished runs in a folder, so that they need not be done again.

    Parameters
    ----------
    folder : Path
        Made where it is missing.

    Raises
    ------
    FileError
        When it cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            for name in (MESHES, RUNS):
                (folder / name).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"cannot make the folder {folder}: {error}") from error

    def finished(self, key: str) -> dict[str, Any] | None:
        """A run that was kept, None where there is none or its mesh is gone."""
        try:
            run: dict[str, Any] = json.loads((self.folder / RUNS / f"{key}.json").read_text())
        except (OSError, ValueError):
            return None
        mesh = run.get("mesh")
        return run if mesh is None or (self.folder / mesh).is_file() else None

    def keep(self, run: dict[str, Any]) -> None:
        """Keep a run for the next time."""
        with replacing(self.folder / RUNS / f"{run['key']}.json") as path:
            path.write_text(as_json(run))

    def write_mesh(self, name: str, mesh: Mesh) -> str:
        """Write a mesh; return its path in the folder."""
        place = f"{MESHES}/{re.sub(NO_FILE_NAME, '-', name)}.npz"
        with replacing(self.folder / place) as path:
            np.savez_compressed(path, vertices=mesh.vertices, faces=mesh.faces)
        return place

    def write_results(self, results: dict[str, Any]) -> None:
        """Write all that was found, whole and as a table."""
        with replacing(self.folder / RESULTS) as path:
            path.write_text(as_json(results))
        rows = [dict(flat(plain(run))) for run in results["runs"]]
        names = list(dict.fromkeys(name for row in rows for name in row))
        with replacing(self.folder / TABLE) as path, open(path, "w", newline="") as file:
            table = csv.DictWriter(file, names, restval="")
            table.writeheader()
            table.writerows(rows)


def as_json(value: Any) -> str:
    """A document, the same for the same content."""
    return json.dumps(plain(value), indent=1, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """What JSON has: infinity becomes a word, NaN null."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def flat(run: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """The single values of a run with names such as ``seconds.median``."""
    for name, value in run.items():
        if name in LISTS:
            continue
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, "; ".join(map(str, value)) if isinstance(value, list) else value
