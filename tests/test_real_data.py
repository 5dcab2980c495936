"""Real meshes and volumes: the topology is kept, and no contractible short edge is left."""

import math

import numpy as np
import pytest

import naive
import tetsimplify
from data import data_dir, needs_data
from tetsimplify import io

FOLDER = data_dir()
MESHES = sorted((FOLDER / "meshes").glob("*.ply")) if FOLDER else []
VOLUMES = sorted((FOLDER / "volumes").glob("*.npz")) if FOLDER else []
LARGE = {"soma_mask", "berea_sandstone"}  # some seconds each; the others are quick


def named(paths):
    slow = pytest.mark.slow
    return [
        pytest.param(path, id=path.stem, marks=slow if path.stem in LARGE else ()) for path in paths
    ]


def median_edge(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.median(np.linalg.norm(np.concatenate([a - b, b - c, c - a]), axis=1)))


def check(mesh, factor, n_checked=150, **options):
    length = factor * median_edge(mesh)
    result = tetsimplify.simplify(*mesh, max_edge_length=length, **options)
    report = result.report
    assert report.topology_after.same_topology(report.topology_before)
    assert set(report.topology_after.edge_degrees) <= {1, 2}
    assert len(result.faces) < len(mesh.faces)
    if options.get("foldover", 0) is None:
        assert set(report.remaining) <= {"obstructed"}
    # the oracle is slow: it looks at some of the edges that are left, with their surroundings
    edges = report.remaining_edges[report.remaining_reasons == "obstructed"]
    faces_of = faces_of_vertices(result.faces)
    for v, u in edges[:: max(1, len(edges) // n_checked)].tolist():
        component = component_of(result.faces, faces_of, v)
        if component is not None:
            assert not naive.is_contractible(result.vertices, component, v, u)


def faces_of_vertices(faces):
    """The faces of each vertex."""
    order = np.argsort(faces.ravel(), kind="stable")
    return np.split(order // 3, np.cumsum(np.bincount(faces.ravel()))[:-1])


def component_of(faces, faces_of, vertex, most=200):
    """Faces of the component of a vertex, None where they are too many for the oracle."""
    found, todo = set(), [vertex]
    seen = {vertex}
    while todo:
        for face in faces_of[todo.pop()].tolist():
            found.add(face)
            for w in faces[face].tolist():
                if w not in seen:
                    seen.add(w)
                    todo.append(w)
        if len(found) > most:
            return None
    return faces[sorted(found)]


def check_target(mesh, **options):
    """To a part of the faces by quadric error: topology kept, the number not overshot."""
    wanted = math.ceil(0.15 * len(mesh.faces))
    result = tetsimplify.simplify(*mesh, target_faces=wanted, **options)
    report = result.report
    assert report.topology_after.same_topology(report.topology_before)
    assert set(report.topology_after.edge_degrees) <= {1, 2}
    assert len(result.faces) >= wanted
    if report.stop == "target_faces":
        assert len(result.faces) <= wanted + 1


@needs_data
@pytest.mark.parametrize("path", named(MESHES))
def test_meshes(path):
    mesh = io.read_mesh(path)
    is_manifold = tetsimplify.topology(*mesh).is_manifold
    if not is_manifold:
        with pytest.raises(tetsimplify.MeshError, match="no consistently oriented 2-manifold"):
            tetsimplify.simplify(*mesh, max_edge_length=1.0)
    check(mesh, 1.2, repair=not is_manifold)
    check_target(mesh, repair=not is_manifold)
    if len(mesh.faces) < 300_000:
        check(mesh, 4.0, repair=not is_manifold, foldover=None, removal_limit=np.inf)


@needs_data
@pytest.mark.parametrize("path", named(VOLUMES))
def test_volumes(path):
    with np.load(path) as stored:
        level = float(stored["iso"])
        level = 0.5 if np.isnan(level) else level
        mesh = tetsimplify.extract_isosurface(stored["data"], level, spacing=stored["spacing"])
    check(mesh, 1.2)
    check_target(mesh)
    check(mesh, 3.0, foldover=None, removal_limit=np.inf)
