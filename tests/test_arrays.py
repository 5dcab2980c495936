"""Bad input gets a specific error before any work starts."""

import numpy as np
import pytest

import meshes
import tetsimplify
from tetsimplify import arrays
from tetsimplify.io import write_mesh

CALLS = {
    "topology": lambda v, f: tetsimplify.topology(v, f),
    "simplify": lambda v, f: tetsimplify.simplify(v, f, max_edge_length=1.0),
    "repair": lambda v, f: tetsimplify.repair(v, f),
}
VERTICES, FACES = meshes.octahedron()


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (VERTICES[:, :2], FACES, r"vertices must have shape \(n, 3\), got \(6, 2\)"),
        (VERTICES.ravel(), FACES, r"vertices must have shape \(n, 3\), got \(18,\)"),
        (VERTICES[None], FACES, r"vertices must have shape \(n, 3\), got \(1, 6, 3\)"),
        (VERTICES, FACES[:, :2], r"faces must have shape \(m, 3\), got \(8, 2\)"),
        (VERTICES, FACES.ravel(), r"faces must have shape \(m, 3\), got \(24,\)"),
        (VERTICES.astype(complex), FACES, "vertices must be real numbers, got dtype complex128"),
        (VERTICES.astype(str), FACES, "vertices must be real numbers, got dtype"),
        (VERTICES.astype(object), FACES, "vertices must be real numbers, got dtype object"),
        (VERTICES, FACES.astype(float), "faces must be integers, got dtype float64"),
        (VERTICES, FACES > 0, "faces must be integers, got dtype bool"),
        (VERTICES, FACES - 1, r"faces must hold vertex indices from 0 to 5, got -1 to 4"),
        (VERTICES, FACES + 1, r"faces must hold vertex indices from 0 to 5, got 1 to 6"),
        (VERTICES, FACES.astype(np.uint64) + np.uint64(2**63), "faces must hold vertex indices"),
        (np.empty((0, 3)), FACES, "faces must hold vertex indices"),
    ],
)
def test_wrong_arrays(call, vertices, faces, message):
    with pytest.raises(tetsimplify.MeshError, match=message):
        call(vertices, faces)


@pytest.mark.parametrize("call", [CALLS["simplify"], CALLS["repair"]])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_positions_that_are_not_finite(call, value):
    vertices = VERTICES.copy()
    vertices[4, 1] = value
    with pytest.raises(tetsimplify.MeshError, match="got NaN or infinity at vertices 4"):
        call(vertices, FACES)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (VERTICES.astype(">f8"), FACES.astype(">i4")),
        (VERTICES.astype(np.float32), FACES.astype(np.uint8)),
        (VERTICES.astype(np.float16), FACES.astype(np.int64)),
        ((VERTICES * 100).astype(np.int16), FACES.astype(np.uint64)),
        (np.asfortranarray(VERTICES), np.asfortranarray(FACES)),
        (np.repeat(VERTICES, 2, axis=0)[::2], np.repeat(FACES, 2, axis=1)[:, ::2]),
        (VERTICES.tolist(), FACES.tolist()),
    ],
)
def test_every_kind_of_array_is_taken(call, vertices, faces):
    assert call(vertices, faces) is not None


def test_too_many_corners(monkeypatch):
    monkeypatch.setattr(arrays, "MAX_CORNERS", 23)
    with pytest.raises(tetsimplify.MeshError, match="at most 23 vertices and as many face corners"):
        tetsimplify.simplify(VERTICES, FACES, max_edge_length=1.0)


@pytest.mark.parametrize("value", ["abc", (1, 2, "x"), (1, (2, 3), 3), (1, 2, 1j), (1, 2), None])
def test_what_are_not_three_numbers(value):
    with pytest.raises(tetsimplify.OptionError, match="spacing must be three finite numbers"):
        tetsimplify.extract_isosurface(np.zeros((2, 2, 2)), 0.5, spacing=value)


def test_messages_list_the_first_offenders():
    assert arrays.listed(np.arange(3)) == "0, 1, 2"
    assert arrays.listed(np.arange(9)) == "0, 1, 2, 3, 4, ... (9 in all)"


def test_errors_also_are_the_standard_ones():
    for error in (tetsimplify.MeshError, tetsimplify.OptionError, tetsimplify.VolumeError):
        assert issubclass(error, ValueError)
        assert issubclass(error, tetsimplify.TetsimplifyError)
    assert issubclass(tetsimplify.FileError, OSError)
    missing = tetsimplify.MissingExtraError("reading NIfTI", "nibabel", "volumes")
    assert isinstance(missing, ImportError)
    assert str(missing) == 'reading NIfTI needs nibabel: pip install "tetsimplify[volumes]"'


@pytest.mark.parametrize("data", [np.zeros((4, 3)), [1, 2, 3, 4], "normals"])
def test_data_are_named(data, tmp_path):
    vertices, faces = meshes.tetrahedron()
    message = f"vertex_data must be a dict of arrays by name, got {type(data).__name__}"
    with pytest.raises(tetsimplify.OptionError, match=message):
        tetsimplify.simplify(vertices, faces, max_edge_length=1.0, vertex_data=data)
    with pytest.raises(tetsimplify.OptionError, match=message):
        write_mesh(tmp_path / "a.ply", (vertices, faces), data)
    assert not list(tmp_path.iterdir())
