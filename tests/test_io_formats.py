"""Each mesh format: the kinds of files there are, and files that make no sense."""

from __future__ import annotations

import logging
import struct

import numpy as np
import pytest

from io_meshes import FANNED, POINTS, POLYGONS, TRIANGLES, assert_same, nasty_mesh, sphere
from ply_files import ENCODINGS, PlyFile, list_of
from tetsimplify.errors import FileError
from tetsimplify.io import read_mesh, stl, write_mesh
from tetsimplify.mesh import Mesh

# --- PLY -----------------------------------------------------------------------------------

XYZ = ["double x", "double y", "double z"]
PLAIN = {"vertex": XYZ, "list": "list uchar int vertex_indices"}


def vertex_rows(before=(), after=lambda i: ()):
    return [[*before, *(("double", v) for v in p), *after(i)] for i, p in enumerate(POINTS)]


def face_rows(faces, count="uchar", index="int", before=(), after=lambda face: ()):
    return [[*before, *list_of(count, index, face), *after(face)] for face in faces]


def plain_ply(file, faces):
    file.element("vertex", XYZ, vertex_rows())
    file.element("face", ["list uchar int vertex_indices"], face_rows(faces))


def ply_with_other_names_and_types(file, faces):
    file.element("vertex", XYZ, vertex_rows())
    file.element("face", ["list int ushort vertex_index"], face_rows(faces, "int", "ushort"))


def ply_with_comments(file, faces):
    for line in ("comment element vertex 99", "obj_info num_cols 3", "comment", ""):
        file.line(line)
    plain_ply(file, faces)


def ply_with_colours(file, faces):
    colours = ["uchar red", "uchar green", "uchar blue"]
    file.element("vertex", [*XYZ, *colours], vertex_rows(after=lambda i: [("uchar", i)] * 3))
    file.element("face", ["list uchar uint vertex_indices"], face_rows(faces, index="uint"))


def ply_with_lists_at_vertices(file, faces):
    tags = lambda i: [("float", 1.0), *list_of("uchar", "float", [2.0] * (i % 3)), ("short", -1)]  # noqa: E731
    properties = ["float quality", *XYZ, "float nx", "list uchar float tags", "short end"]
    file.element("vertex", properties, vertex_rows([("float", 0.5)], tags))
    file.element("face", ["list uchar int vertex_indices"], face_rows(faces))


def ply_with_values_around_the_faces(file, faces):
    uv = lambda face: [*list_of("uchar", "float", [0.25] * 2 * len(face)), ("float", 2.5)]  # noqa: E731
    file.element("vertex", XYZ, vertex_rows())
    file.element(
        "face",
        ["int flags", "list uchar int vertex_indices", "list uchar float texcoord", "float q"],
        face_rows(faces, before=[("int", 7)], after=uv),
    )


def ply_with_other_elements(file, faces):
    camera = [[("float", 0.5), *list_of("uchar", "int", [3, 4])]] * 2
    file.element("camera", ["float view_px", "list uchar int numbers"], camera)
    plain_ply(file, faces)
    file.element("edge", ["int vertex1", "int vertex2"], [[("int", 0), ("int", 1)]] * 3)


PLY_KINDS = [
    plain_ply,
    ply_with_other_names_and_types,
    ply_with_comments,
    ply_with_colours,
    ply_with_lists_at_vertices,
    ply_with_values_around_the_faces,
    ply_with_other_elements,
]


@pytest.mark.parametrize("newline", ["\n", "\r\n"], ids=["lf", "crlf"])
@pytest.mark.parametrize("faces", [TRIANGLES, POLYGONS], ids=["triangles", "polygons"])
@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("kind", PLY_KINDS)
def test_ply_of_every_kind(tmp_path, kind, encoding, faces, newline):
    file = PlyFile(encoding, newline)
    kind(file, faces)
    (tmp_path / "a.ply").write_bytes(file.to_bytes())
    expected = FANNED if faces is POLYGONS else TRIANGLES
    assert_same(read_mesh(tmp_path / "a.ply"), POINTS, expected)


@pytest.mark.parametrize("faces", [TRIANGLES, POLYGONS], ids=["triangles", "polygons"])
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_ply_cut_short(tmp_path, encoding, faces):
    file = PlyFile(encoding)
    plain_ply(file, faces)
    whole = file.to_bytes()
    body = whole.index(b"end_header") + len("end_header\n")
    for n_bytes in (3, body - 20, body, body + 40, len(whole) - 6):
        (tmp_path / "a.ply").write_bytes(whole[:n_bytes])
        with pytest.raises(FileError, match=r"a\.ply"):
            read_mesh(tmp_path / "a.ply")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"ply\n", b"plx\n", "first line must be 'ply'"),
        (b"property double x", b"property quad x", "unknown type 'quad'"),
        (b"property double x", b"property double u", "no property x"),
        (b"vertex_indices", b"corners", "vertex_indices or vertex_index"),
        (b"element face", b"element strips", "no element face, only vertex, strips"),
        (b"element vertex", b"element vertices", "no element vertex"),
        (b"format ascii", b"format utf8", "makes no sense"),
        (b"3 0 1 2", b"3 0 1 7", "face 0 refers to vertex 7, but there are 7 vertices"),
        (b"3 0 2 3", b"3 0 -2 3", "face 1 refers to vertex -2"),
        (b"9.0 9.0 9.0", b"9.0 nine 9.0", "'nine' is not a number"),
    ],
)
def test_ply_that_makes_no_sense(tmp_path, old, new, message):
    file = PlyFile("ascii")
    plain_ply(file, TRIANGLES)
    content = file.to_bytes()
    assert old in content
    (tmp_path / "a.ply").write_bytes(content.replace(old, new, 1))
    with pytest.raises(FileError, match=message):
        read_mesh(tmp_path / "a.ply")


def test_fanning_is_told(tmp_path, caplog):
    file = PlyFile("ascii")
    plain_ply(file, [*POLYGONS, [1, 2]])
    (tmp_path / "a.ply").write_bytes(file.to_bytes())
    with caplog.at_level(logging.INFO, "tetsimplify.io"):
        assert_same(read_mesh(tmp_path / "a.ply"), POINTS, FANNED)
    assert [(r.levelname, r.getMessage()) for r in caplog.records] == [
        ("INFO", "2 polygons with more than three corners fanned into triangles"),
        ("WARNING", "1 faces with fewer than three corners left out"),
    ]


# --- STL -----------------------------------------------------------------------------------


def stl_text(faces, name="x y"):
    corners = np.array(POINTS, np.float32)[np.array(faces)].astype(float).tolist()
    facets = "".join(
        "  facet normal 0 0 0\n    outer loop\n"
        + "".join(f"      vertex {x!r} {y!r} {z!r}\n" for x, y, z in triangle)
        + "    endloop\n  endfacet\n"
        for triangle in corners
    )
    return f"solid {name}\n{facets}endsolid {name}\n"


def stl_binary(faces, header=b""):
    facets = np.zeros(len(faces), stl.FACET)
    facets["corners"] = np.array(POINTS, np.float32)[np.array(faces)]
    return header.ljust(80) + struct.pack("<I", len(faces)) + facets.tobytes()


@pytest.mark.parametrize(
    "content",
    [
        stl_binary(TRIANGLES),
        stl_binary(TRIANGLES, b"solid but binary"),
        stl_text(TRIANGLES).encode(),
        (stl_text(TRIANGLES[:2]) + stl_text(TRIANGLES[2:], "two")).encode(),
        stl_text(TRIANGLES).upper().encode(),
        stl_text(TRIANGLES).replace("\n", "\r\n").encode(),
    ],
    ids=["binary", "solid-binary", "text", "two-solids", "capitals", "crlf"],
)
def test_stl_is_welded_in_order_of_appearance(tmp_path, content, caplog):
    (tmp_path / "a.stl").write_bytes(content)
    with caplog.at_level(logging.INFO, "tetsimplify.io"):
        mesh = read_mesh(tmp_path / "a.stl")
    points = np.array(POINTS, np.float32)
    expected = [[0, 1, 2], [0, 2, 3], [0, 4, 1], [0, 1, 2], [3, 3, 0]]
    assert_same(mesh, points[[0, 1, 2, 3, 6]], expected)
    assert "15 corners with equal coordinates welded to 5 vertices" in caplog.text


def test_weld_tells_neighbouring_floats_apart():
    a = np.array([[1, 2, 3]], np.float32)
    points = np.concatenate([a, np.nextafter(a, np.float32(9)), -a, a, [[0, 0, 0], [-0.0, 0, 0]]])
    representatives, numbers = stl.weld(points.astype(np.float32))
    assert representatives.tolist() == [0, 1, 2, 4]
    assert numbers.tolist() == [0, 1, 2, 0, 3, 3]


def test_weld_survives_clashing_hashes(monkeypatch):
    points = np.random.default_rng(0).integers(0, 3, (200, 3)).astype(np.float32)
    expected = stl.weld(points)
    monkeypatch.setattr(stl, "_hash", lambda bits: bits[:, 0].astype(np.uint64))
    for found, wanted in zip(stl.weld(points), expected, strict=True):
        np.testing.assert_array_equal(found, wanted)
    np.testing.assert_array_equal(points[expected[0]][expected[1]], points)


@pytest.mark.parametrize(
    "content",
    [b"", b"short", stl_binary(TRIANGLES)[:-1], stl_text(TRIANGLES).encode()[:-120],
     b"solid x\nnot a facet\n", stl_text(TRIANGLES).replace("vertex 4.0", "vertex four").encode()],
)  # fmt: skip
def test_stl_that_makes_no_sense(tmp_path, content):
    (tmp_path / "a.stl").write_bytes(content)
    with pytest.raises(FileError, match=r"cannot read .*a\.stl"):
        read_mesh(tmp_path / "a.stl")


def test_stl_tells_which_vertices_it_would_merge(tmp_path, caplog):
    points = [[0, 0, 0], [1, 0, 0], [1 + 1e-12, 0, 0], [0, 1, 0]]
    write_mesh(tmp_path / "a.stl", Mesh(np.array(points), np.array([[0, 1, 3], [0, 2, 3]])))
    assert "1 vertices fall on others" in caplog.text
    caplog.clear()
    write_mesh(tmp_path / "a.stl", sphere())
    assert not caplog.text


# --- OBJ and OFF ---------------------------------------------------------------------------

POINT_LINES = [" ".join(map(repr, p)) for p in POINTS]


def obj_of(faces, vertex="v {}", face="f {}", corner="{}", first=1):
    vertices = [vertex.format(line) for line in POINT_LINES]
    corners = [" ".join(corner.format(i + first) for i in f) for f in faces]
    return "\n".join([*vertices, *(face.format(text) for text in corners), ""])


@pytest.mark.parametrize(
    "text",
    [
        obj_of(TRIANGLES),
        obj_of(TRIANGLES, vertex="v\t{} 0.5 0.5 0.5 # coloured", corner="{}/1/2"),
        obj_of(TRIANGLES, vertex="  v {} 1.0", corner="{}//7", face="g a\nusemtl b\ns 1\nf {} "),
        obj_of(TRIANGLES, first=-len(POINTS)),
        obj_of(TRIANGLES, vertex="vn 0 0 1\nvt 0 0\nv \\\n {}", face="f \\\n{}\\\n"),
        obj_of(TRIANGLES).replace("\n", "\r\n"),
    ],
    ids=["plain", "colours", "groups", "negative", "continued", "crlf"],
)
def test_obj_of_every_kind(tmp_path, text):
    (tmp_path / "a.obj").write_text(text, newline="")
    assert_same(read_mesh(tmp_path / "a.obj"), POINTS, TRIANGLES)


def test_obj_with_faces_between_vertices(tmp_path):
    lines = [f"v {line}" for line in POINT_LINES]
    lines[4:4] = ["f 1 2 3", "f -4 -2 -1"]
    (tmp_path / "a.obj").write_text("\n".join([*lines, "f -2 -1 2"]))
    assert_same(read_mesh(tmp_path / "a.obj"), POINTS, [[0, 1, 2], [0, 2, 3], [5, 6, 1]])


def test_obj_polygons_and_lines(tmp_path, caplog):
    (tmp_path / "a.obj").write_text(obj_of(POLYGONS) + "l 1 2\np 3\n")
    assert_same(read_mesh(tmp_path / "a.obj"), POINTS, FANNED)
    assert "2 lines and points left out" in caplog.text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("v 1 2\n", "fewer than 3 coordinates"),
        ("v 1 2 x\n", "'x' is not a number"),
        ("v 1 2 3 0.5 0 0\nv 1\n", "vertex 1 has fewer than 3 coordinates"),
        (obj_of([[0, 1, 7]]), "face 0 refers to vertex 7"),
        (obj_of([[0, 1, 2]], first=0), "counts from 1"),
        (obj_of([[0, 1, 2]], first=-9), "refers to vertex -2"),
    ],
)
def test_obj_that_makes_no_sense(tmp_path, text, message):
    (tmp_path / "a.obj").write_text(text)
    with pytest.raises(FileError, match=message):
        read_mesh(tmp_path / "a.obj")


def off_of(faces, head="OFF\n", vertex="{}", face="{}"):
    points = [vertex.format(line) for line in POINT_LINES]
    polygons = [face.format(" ".join(map(str, [len(f), *f]))) for f in faces]
    return f"{head}{len(points)} {len(faces)} 0\n" + "\n".join([*points, *polygons, ""])


@pytest.mark.parametrize(
    "text",
    [
        off_of(POLYGONS),
        off_of(POLYGONS, head="# hello\n\nOFF # hello\n\n# 1 2 3\n"),
        off_of(POLYGONS, head="OFF "),
        off_of(POLYGONS, head="COFF\n", vertex="{} 1 0 0 1", face="{} 255 0 0"),
        off_of(POLYGONS, head="NOFF\n", vertex="{} 0 0 1", face="{} 3"),
        off_of(POLYGONS).replace("\n", "\r\n"),
    ],
    ids=["plain", "comments", "one-line", "colours", "normals", "crlf"],
)
def test_off_of_every_kind(tmp_path, text):
    (tmp_path / "a.off").write_text(text, newline="")
    assert_same(read_mesh(tmp_path / "a.off"), POINTS, FANNED)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must begin with OFF"),
        ("4OFF\n1 0 0\n", "not '4OFF'"),
        ("OFF BINARY\n", "not 'OFF BINARY'"),
        ("OFF\n", "no counts"),
        (off_of(TRIANGLES)[:-10], "ends after 7 of 7 vertices and 4 of 5 faces"),
        (off_of([[0, 1, 9]]), "face 0 refers to vertex 9"),
    ],
)
def test_off_that_makes_no_sense(tmp_path, text, message):
    (tmp_path / "a.off").write_text(text)
    with pytest.raises(FileError, match=message):
        read_mesh(tmp_path / "a.off")


# --- VTK and GLB ---------------------------------------------------------------------------


def vtk_surface(pyvista, polygons):
    points = np.array(nasty_mesh().vertices)
    return pyvista.PolyData(points, np.concatenate([[len(p), *p] for p in polygons]))


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("suffix", [".vtk", ".vtp", ".vtu"])
def test_vtk_polygons(tmp_path, suffix, binary):
    pyvista = pytest.importorskip("pyvista")
    surface = vtk_surface(pyvista, POLYGONS)
    dataset = surface.cast_to_unstructured_grid() if suffix == ".vtu" else surface
    dataset.save(tmp_path / f"a{suffix}", binary=binary)
    mesh = read_mesh(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(mesh.faces, FANNED)
    # the legacy text format of VTK prints twelve digits
    np.testing.assert_allclose(mesh.vertices, nasty_mesh().vertices, rtol=1e-10, atol=1e-15)


def test_vtk_with_lines_and_strips(tmp_path, caplog):
    pyvista = pytest.importorskip("pyvista")
    surface = vtk_surface(pyvista, TRIANGLES[:2])
    surface.lines = [2, 0, 1]
    surface.save(tmp_path / "a.vtp")
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.vtp").faces, TRIANGLES[:2])
    assert "1 vertex and line cells left out" in caplog.text
    strip = pyvista.PolyData(np.array(POINTS), strips=[5, 0, 1, 2, 3, 4])
    strip.save(tmp_path / "a.vtk")
    assert len(read_mesh(tmp_path / "a.vtk").faces) == 3


def test_vtu_with_solid_cells(tmp_path, caplog):
    pyvista = pytest.importorskip("pyvista")
    cells = [3, 0, 1, 2, 4, 0, 1, 2, 3, 4, 0, 1, 2, 3]
    types = [pyvista.CellType.TRIANGLE, pyvista.CellType.TETRA, pyvista.CellType.QUAD]
    pyvista.UnstructuredGrid(cells, types, nasty_mesh().vertices).save(tmp_path / "a.vtu")
    expected = [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.vtu").faces, expected)
    assert "1 cells of VTK types 10 left out" in caplog.text
    pyvista.UnstructuredGrid(cells[4:9], types[1:2], sphere().vertices).save(tmp_path / "b.vtu")
    with pytest.raises(FileError, match="none of its 1 cells is a polygon"):
        read_mesh(tmp_path / "b.vtu")


def test_vtk_that_makes_no_sense(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    pyvista.ImageData(dimensions=(2, 2, 2)).save(tmp_path / "image.vtk")
    with pytest.raises(FileError, match="holds a ImageData, not a surface"):
        read_mesh(tmp_path / "image.vtk")
    write_mesh(tmp_path / "whole.vtp", sphere())
    whole = (tmp_path / "whole.vtp").read_bytes()
    (tmp_path / "cut.vtp").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(FileError, match="cannot read"):
        read_mesh(tmp_path / "cut.vtp")


def test_glb_scene_is_put_together(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    scene = trimesh.Scene()
    scene.add_geometry(box, geom_name="box")
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirror[0, 3] = 5.0
    scene.graph.update(frame_to="again", matrix=mirror, geometry="box")
    scene.export(tmp_path / "a.glb")
    mesh = read_mesh(tmp_path / "a.glb")
    assert mesh.faces.shape == (24, 3)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), [5.5, 0.5, 0.5])
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(2.0)
