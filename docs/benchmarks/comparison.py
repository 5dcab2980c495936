"""Write the tables of reports of `tetsimplify compare` into the page of benchmarks.

tetsimplify compare igea.ply mni152_mri.npz --level 80.5 --keep-ratio 15% --clock cpu -o report
python docs/benchmarks/comparison.py report
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from common import Row, as_markdown, signed, write_between

from tetsimplify.comparison.tables import criterion_in_words, three_digits

PAGE = Path(__file__).parents[1] / "benchmarks.md"
NONE = "\N{EN DASH}"


def row_of(run: dict[str, Any], diagonal: float) -> Row:
    """One method; dashes where it came to nothing."""
    if "n_faces" not in run:
        return {"method": run["method"], "topology kept": run["message"] or run["status"]}
    distance = run["distance"] or {}
    return {
        "method": run["method"],
        "s": three_digits(run["seconds"]["median"]),
        "MiB": f"{(run['peak_memory_bytes'] or 0) / 2**20:,.0f}",
        "faces": f"{run['n_faces']:,}",
        **{
            title: three_digits(1e5 * distance[key] / diagonal) if distance else NONE
            for title, key in (("mean", "mean"), ("max", "upper"))
        },
        "2r/R": f"{run['quality']['mean_ratio']:.3f}",
        "χ": signed(run["euler_characteristic"]),
        "edges of other degree": f"{run['n_violating_edges']:,}",
        "double faces": f"{run['n_duplicate_faces']:,}",
        "crossing pairs": NONE if (n := run["n_self_intersections"]) is None else f"{n:,}",
        "topology kept": "yes" if run["topology_kept"] else "no",
    }


def tables_of(results: dict[str, Any]) -> Iterator[str]:
    """A table for each input and criterion."""
    for given in results["inputs"]:
        runs = [run for run in results["runs"] if run["input"] == given["name"]]
        for words in dict.fromkeys(criterion_in_words(run["criterion"]) for run in runs):
            rows = [
                row_of(run, given["diagonal"])
                for run in runs
                if criterion_in_words(run["criterion"]) == words
            ]
            columns = max(rows, key=len)
            rows = [{column: row.get(column, NONE) for column in columns} for row in rows]
            yield as_markdown(f"{given['name']}, {given['n_faces']:,} faces, {words}", rows)
    machine = results["machine"]
    yield f"{machine['processor']}, {machine['cores']} cores; Python {machine['python']}."
    absent = ", ".join(f"{row['method']} (`{row['install']}`)" for row in results["absent"])
    if absent:
        yield f"Not installed: {absent}."


def main() -> None:
    """Put the tables between the marks in the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("reports", nargs="+", type=Path)
    arguments = parser.parse_args()
    found = [json.loads((path / "results.json").read_text("utf-8")) for path in arguments.reports]
    tables = "\n\n".join(table.strip() for results in found for table in tables_of(results))
    write_between(PAGE, "comparison", tables)


if __name__ == "__main__":
    main()
