"""A small comparison with everything that a page has to show, and a slow decoder of its meshes."""

from __future__ import annotations

import base64
import zlib
from pathlib import Path
from typing import Any

import numpy as np

import tetsimplify
from models import ball
from tetsimplify.mesh import Mesh

HOSTILE = "</script><script>alert('&')</script>"


def with_fin(mesh: Mesh) -> tuple[Mesh, list[float]]:
    """A mesh with a tetrahedron's two faces more at its first edge, and the ends of that edge."""
    a, b = mesh.faces[0, :2]
    tip = mesh.vertices[[a, b]].mean(axis=0) * 1.4
    n = len(mesh.vertices)
    faces = np.concatenate([mesh.faces, [[a, b, n], [b, a, n]]]).astype(np.int32)
    ends = [*mesh.vertices[a].tolist(), *mesh.vertices[b].tolist()]
    return Mesh(np.vstack([mesh.vertices, tip]), faces), ends


def small_comparison(folder: Path) -> dict[str, Any]:
    """Two surfaces, four methods, two sizes; one breaks the topology, one crashes."""
    (folder / "meshes").mkdir()
    results: dict[str, Any] = {
        "version": 1,
        "created": "2026-01-02T03:04:05+00:00",
        "machine": {"processor": "abacus", "cores": 2, "packages": {"numpy": "9.9"}},
        "inputs": [],
        "absent": [
            {
                "method": "gone",
                "title": f"gone {HOSTILE}",
                "package": "g",
                "install": "pip install g",
            }
        ],
        "runs": [],
    }
    for name, n in (("ball", 9), (HOSTILE, 7)):
        mesh = tetsimplify.extract_isosurface(ball(n), 0.0)
        number = len(results["inputs"])
        diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
        results["inputs"].append(
            {
                "name": name,
                "kind": "volume",
                "n_vertices": len(mesh.vertices),
                "n_faces": len(mesh.faces),
                "diagonal": diagonal,
                "topology": {"euler_characteristic": 2},
                "mesh": stored(folder, f"input-{number}", mesh),
            }
        )
        for ratio in (0.5, 0.25):
            kept = Mesh(*tetsimplify.simplify(*mesh, keep_ratio=ratio)[:2])
            broken, ends = with_fin(kept)
            file = f"{number}-{ratio}"
            base = {"input": name, "criterion": {"keep_ratio": ratio}, "target_faces": 10}
            results["runs"] += [
                base | method("tetsimplify") | measured(folder, f"{file}-ours", kept, []),
                base | method("finned") | measured(folder, f"{file}-fin", broken, [ends]),
                base | method(HOSTILE) | {"status": "crashed", "message": f"signal {HOSTILE}"},
            ]
    results["runs"].append(
        {"input": "ball", "criterion": {"max_edge_length": 0.3}}
        | method("tetsimplify")
        | {"status": "not applicable", "message": "takes no length"}
    )
    return results


def method(name: str) -> dict[str, str]:
    """What is told of a method."""
    return {"method": name, "title": f"title of {name}", "package": name, "version": "1.0"}


def stored(folder: Path, name: str, mesh: Mesh) -> str:
    """Write a mesh as a report has it."""
    np.savez(folder / "meshes" / f"{name}.npz", vertices=mesh.vertices, faces=mesh.faces)
    return f"meshes/{name}.npz"


def measured(
    folder: Path, name: str, mesh: Mesh, violating_edges: list[list[float]]
) -> dict[str, Any]:
    """A run that ended well."""
    found = tetsimplify.topology(*mesh)
    distance = {"mean": 1e-3, "rms": 2e-3, "lower": 3e-3, "upper": 4e-3}
    return {
        "status": "ok",
        "message": None,
        "seconds": {"median": 0.25, "min": 0.2, "max": 0.3, "all": [0.2, 0.25, 0.3]},
        "peak_memory_bytes": 10**8,
        "n_vertices": len(mesh.vertices),
        "n_faces": len(mesh.faces),
        "edge_degrees": {str(degree): n for degree, n in found.edge_degrees.items()},
        "n_violating_edges": len(violating_edges),
        "violating_edges": violating_edges,
        "n_nonmanifold_vertices": 0,
        "euler_characteristic": found.euler_characteristic,
        "n_components": found.n_components,
        "n_boundary_loops": found.n_boundary_loops,
        "n_duplicate_faces": 0,
        "n_degenerate_faces": 0,
        "n_flipped_faces": 0,
        "n_self_intersections": None,
        "shortest_edge": 0.1,
        "short_length": 0.2,
        "n_short_edges": 7,
        "topology_kept": not violating_edges,
        "why_not": ["1 edge of degree 4"] if violating_edges else [],
        "distance": {"to_input": distance, "from_input": distance, **distance},
        "quality": {
            "mean_ratio": 0.8,
            "min_angle_degrees": float("nan"),
            "mean_valence_deviation": 0.5,
            "histogram": {"edges": [0.0, 0.5, 1.0], "counts": [3, 9]},
        },
        "volume_change": -0.01,
        "area_change": 0.02,
        "mesh": stored(folder, name, mesh),
    }


def decoded(embedded: dict[str, Any]) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices and faces of an embedded mesh, number by number."""
    data = zlib.decompress(base64.b64decode(embedded["data"]))
    n, n_corners = embedded["n_vertices"], 3 * embedded["n_faces"]
    assert len(data) == 2 * 3 * n + 4 * n_corners
    levels = np.zeros((n, 3), int)
    for axis in range(3):
        level = 0
        for v in range(n):
            at = axis * n + v
            level = (level + data[at] + 256 * data[3 * n + at]) % 65536
            levels[v, axis] = level
    rest, corners, newest = data[6 * n :], [], 0
    for c in range(n_corners):
        behind = sum(rest[k * n_corners + c] << (8 * k) for k in range(4))
        corners.append(newest - behind)
        newest += behind == 0
    low, high = np.array(embedded["low"]), np.array(embedded["high"])
    faces = [corners[c : c + 3] for c in range(0, n_corners, 3)]
    return low + levels / 65535 * (high - low), faces
