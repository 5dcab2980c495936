"""PyMeshLab meshes in and out, and the filters in PyMeshLab."""

from __future__ import annotations

import numpy as np
import pytest

import tetsimplify
from data import data_dir, needs_data
from strategies import adversarial_mesh
from test_docs import ROOT
from tetsimplify.errors import MeshError

pymeshlab = pytest.importorskip("pymeshlab")
plugin = pytest.importorskip("tetsimplify.plugins.pymeshlab")
from pymeshlab import (  # noqa: E402
    InvalidEnumException,
    Mesh,
    MeshSet,
    PercentageValue,
    PureValue,
    PyMeshLabException,
)
from tetsimplify.plugins.pymeshlab_in_place import textures_of_faces  # noqa: E402

SIMPLIFY = "meshing_decimation_topology_preserving_edge_collapse"
LENGTH = PureValue(0.15)
OTHER = "meshing_isotropic_explicit_remeshing"  # a filter of PyMeshLab with a length


def sphere(**kwargs):
    ms = MeshSet(**kwargs)
    ms.create_sphere(subdiv=5)
    return ms


def grid(n=24):
    """A square and, for each face, whether it is right of the middle."""
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    a = np.flatnonzero((x < n) & (y < n))
    faces = np.concatenate([np.c_[a, a + 1, a + n + 2], np.c_[a, a + n + 2, a + n + 1]])
    return np.c_[x, y, 0 * x] / n, faces, x[faces].mean(axis=1) > n / 2


def textured_grid():
    """A square whose halves belong to two charts, 0.5 apart in u."""
    vertices, faces, right = grid()
    uv = vertices[faces][:, :, :2] + np.where(right[:, None, None], (0.5, 0), 0)
    ms = MeshSet()
    ms.add_mesh(Mesh(vertices, faces, w_tex_coords_matrix=uv.reshape(-1, 2)), "square")
    return ms


def with_polylines():
    """A square with a polyline across it that goes on beyond, where no face is."""
    vertices, faces, _ = grid()
    line = np.flatnonzero(vertices[:, 0] == 0.25)
    beyond = len(vertices) + np.arange(3)
    edges = np.concatenate([np.c_[line[:-1], line[1:]], [[line[-1], beyond[0]]], [beyond[:2]]])
    vertices = np.concatenate([vertices, [[0.25, 1.5, 0], [0.25, 2, 0], [9, 9, 9]]])
    return Mesh(vertices, faces, edge_matrix=edges.astype(np.int32))


def lines(mesh):
    """The polyline edges as positions."""
    return mesh.vertex_matrix()[mesh.edge_matrix()]


def not_compact():
    """A square in a set, and a deleted vertex: a filter failed before it tidied up."""
    vertices, faces, _ = grid()
    ms = MeshSet()
    ms.add_mesh(Mesh(np.concatenate([[[9, 9, 9]], vertices]), faces + 1))
    with pytest.raises(PyMeshLabException, match="non watertight"):
        ms.compute_iso_parametrization()
    sphere()  # a filter that succeeds: PyMeshLab lets go of the log of the set, else it dies of it
    assert not ms.current_mesh().is_compact()
    return ms


def same(a, b):
    return all(np.array_equal(x, y) for x, y in zip(a[:2], b[:2], strict=True)) and all(
        d.keys() == e.keys() and all(np.array_equal(d[k], e[k]) for k in d)
        for d, e in zip(a[2:], b[2:], strict=True)
    )


def triangles(vertices, faces):
    """All triangles as positions, whatever the vertices are called; the face order is kept."""
    return np.asarray(vertices)[np.asarray(faces)]


def message_of(call, error=PyMeshLabException):
    with pytest.raises(error) as caught:
        call()
    return str(caught.value)


# --- in place --------------------------------------------------------------------------------


def test_result_is_that_of_the_core():
    ms = sphere()
    arrays = plugin.from_pymeshlab(ms.current_mesh())
    expected = tetsimplify.simplify(arrays.vertices, arrays.faces, max_edge_length=0.15)
    figures = ms.meshing_decimation_topology_preserving_edge_collapse(maxedgelength=LENGTH)
    mesh = ms.current_mesh()
    new = triangles(mesh.vertex_matrix(), mesh.face_matrix())
    assert np.array_equal(new, triangles(expected.vertices, expected.faces))
    assert figures["faces_number"] == mesh.face_number() == len(expected.faces)
    assert figures["faces_number_before"] == len(arrays.faces)
    assert figures["genus"] == 0 and figures["remaining_short_edges"] == {}


def test_all_ways_to_call_are_the_same():
    results = []
    for call in (
        lambda ms: ms.meshing_decimation_topology_preserving_edge_collapse(maxedgelength=LENGTH),
        lambda ms: ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH),
        lambda ms: ms.apply_filter(filter_name=SIMPLIFY, maxedgelength=LENGTH),
        lambda ms: plugin.simplify_current_mesh(ms, maxedgelength=LENGTH),
    ):
        ms = sphere()
        assert call(ms)["contractions_number"] > 0
        results.append(ms.current_mesh().vertex_matrix())
    assert all(np.array_equal(results[0], other) for other in results)


def test_mesh_stays_what_it_was_and_others_untouched():
    ms = MeshSet()
    for k in range(3):
        ms.create_sphere(subdiv=4 + k)
    ms.set_current_mesh(1)
    mesh = ms.current_mesh()
    mesh.set_label("the one")
    matrix = np.diag([2.0, 3.0, 4.0, 1.0])
    ms.set_matrix(transformmatrix=matrix, freeze=False)
    others = [plugin.from_pymeshlab(ms.mesh(k)) for k in (0, 2)]
    n_faces = mesh.face_number()
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    assert mesh.face_number() < n_faces  # the reference that we hold still is the mesh
    assert ms.current_mesh_id() == mesh.id() == 1 and ms.mesh_number() == 3
    assert [each.id() for each in ms] == [0, 1, 2]
    assert mesh.label() == "the one" and mesh.is_compact()
    assert np.array_equal(mesh.transform_matrix(), matrix)
    assert all(
        same(a, plugin.from_pymeshlab(ms.mesh(k))) for a, k in zip(others, (0, 2), strict=True)
    )


def test_percentage_is_of_the_diagonal():
    ms = sphere()
    diagonal = ms.current_mesh().bounding_box().diagonal()
    values = ms.filter_parameter_values(SIMPLIFY, maxedgelength=PercentageValue(5))
    assert values["maxedgelength"] == pytest.approx(0.05 * diagonal)
    assert values["removallimit"] == pytest.approx(0.2 * diagonal)
    assert values["selected"] is False
    values = ms.filter_parameter_values(SIMPLIFY)
    assert values["maxedgelength"] == pytest.approx(0.01 * diagonal)
    values = ms.filter_parameter_values(SIMPLIFY, targetfacenum=100)
    assert values["maxedgelength"] is None and values["removallimit"] is None
    values = ms.filter_parameter_values(SIMPLIFY, maxedgelength=PercentageValue(5))
    other = sphere()
    ms.apply_filter(SIMPLIFY, maxedgelength=PercentageValue(5))
    other.apply_filter(SIMPLIFY, maxedgelength=PureValue(values["maxedgelength"]))
    assert ms.current_mesh().face_number() == other.current_mesh().face_number()


def test_normals_and_bounding_box_are_those_of_the_result():
    ms = sphere()
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    mesh = ms.current_mesh()
    vertices, box = mesh.vertex_matrix(), mesh.bounding_box()
    assert np.allclose(box.max(), vertices.max(axis=0)) and np.allclose(
        box.min(), vertices.min(axis=0)
    )
    ways = [mesh.vertex_normal_matrix(), mesh.face_normal_matrix()]
    ms.compute_normal_per_face()
    ms.compute_normal_per_vertex()
    assert np.allclose(ways[0], mesh.vertex_normal_matrix())
    assert np.allclose(ways[1], mesh.face_normal_matrix())


@pytest.mark.parametrize("blocked", ["contract", "skip", "violate"])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_adversarial_meshes(blocked, scale):
    for seed in range(8):
        vertices, faces = adversarial_mesh(seed)
        vertices = scale * (vertices + [1e3, 0, 0])
        length = scale * 0.2 * np.linalg.norm(np.ptp(vertices / scale, axis=0))
        expected = tetsimplify.simplify(vertices, faces, max_edge_length=length, blocked=blocked)
        ms = MeshSet()
        ms.add_mesh(Mesh(vertices, faces))
        ms.apply_filter(SIMPLIFY, maxedgelength=PureValue(length), blocked=blocked)
        mesh = ms.current_mesh()
        new = triangles(mesh.vertex_matrix(), mesh.face_matrix())
        assert np.array_equal(new, triangles(expected.vertices, expected.faces))


def test_balloon_that_is_removed():
    """Vertices that vanish without becoming another one."""
    ms = MeshSet()
    ms.create_sphere(subdiv=5)
    vertices = np.ascontiguousarray(ms.current_mesh().vertex_matrix())
    faces = ms.current_mesh().face_matrix()
    # a pinched sphere: nested triangles around its waist
    vertices[:, :2] *= (0.004 + np.abs(vertices[:, 2:]) ** 2)[:, :1]
    expected = tetsimplify.simplify(vertices, faces, max_edge_length=0.1, removal_limit=np.inf)
    assert expected.report.n_nested > 0 and (expected.vertex_map < 0).any()
    ms = MeshSet()
    ms.add_mesh(Mesh(vertices, faces))
    ms.apply_filter(SIMPLIFY, maxedgelength=PureValue(0.1), removallimit=PureValue(1e9))
    mesh = ms.current_mesh()
    new = triangles(mesh.vertex_matrix(), mesh.face_matrix())
    assert np.array_equal(new, triangles(expected.vertices, expected.faces))


# --- targets and guards, as in quadric decimation ---------------------------------------------


QUADRIC = "meshing_decimation_quadric_edge_collapse"


@pytest.mark.parametrize(
    "target", [{"targetfacenum": 500}, {"targetperc": 0.1}, {"targetfacenum": 9, "targetperc": 0.1}]
)
def test_targets_are_those_of_quadric_decimation(target):
    theirs, ours = sphere(), sphere()
    theirs.apply_filter(QUADRIC, **target)
    figures = ours.apply_filter(SIMPLIFY, **target)
    assert ours.current_mesh().face_number() == theirs.current_mesh().face_number()
    assert figures["stop"] == ("keep_ratio" if "targetperc" in target else "target_faces")


@pytest.mark.parametrize(
    ("parameters", "options"),
    [
        ({}, {}),
        ({"qualitythr": 0.5}, {"shape": 0.5}),
        ({"qualitythr": 0.0}, {"shape": None}),
        ({"preservenormal": True}, {"normal_deviation": 90.0}),
        ({"preservenormal": False}, {"normal_deviation": None}),
        ({"preserveboundary": True}, {"boundary": "keep"}),
        ({"optimalplacement": True}, {"placement": "quadric"}),
        ({"optimalplacement": False}, {"placement": "endpoint"}),
        ({"cost": "length"}, {"cost": "length"}),
        ({"fit": False}, {"fit": False}),
        ({"featureangle": 20}, {"feature_angle": 20}),
        ({"maxquadricerror": PureValue(0.01)}, {"max_quadric_error": 0.01}),
        ({"maxerror": PureValue(0.02)}, {"max_error": 0.02}),
        ({"maxedgelength": LENGTH}, {"max_edge_length": 0.15}),
    ],
)
def test_parameters_are_options_of_the_core(parameters, options):
    vertices, faces, _ = grid()
    vertices[:, 2] = 0.1 * np.sin(5 * vertices[:, 0]) * np.cos(4 * vertices[:, 1])
    ms = MeshSet()
    ms.add_mesh(Mesh(vertices, faces))
    figures = ms.apply_filter(SIMPLIFY, targetfacenum=200, **parameters)
    face_data = {"face": np.arange(len(faces))}  # with which no edge is turned over
    expected = tetsimplify.simplify(
        vertices, faces, target_faces=200, face_data=face_data, **options
    )
    mesh = ms.current_mesh()
    new = triangles(mesh.vertex_matrix(), mesh.face_matrix())
    assert np.array_equal(new, triangles(expected.vertices, expected.faces))
    assert figures["stop"] == expected.report.stop


@pytest.mark.parametrize("n_faces", [200, 20])
def test_faces_in_place_are_what_contraction_leaves(n_faces):
    """PyMeshLab keeps its faces: where edges are turned over they would be others."""
    vertices, faces, _ = grid()
    vertices[:, 2] = 0.1 * np.sin(5 * vertices[:, 0]) * np.cos(4 * vertices[:, 1])
    ms = MeshSet()
    ms.add_mesh(Mesh(vertices, faces))
    ms.apply_filter(SIMPLIFY, targetfacenum=n_faces)
    of_map, new, free = (
        tetsimplify.simplify(vertices, faces, target_faces=n_faces, **options)
        for options in ({"fit": False}, {"face_data": {"face": faces[:, 0]}}, {})
    )
    assert np.array_equal(of_map.faces, new.faces) and not np.array_equal(of_map.faces, free.faces)
    mesh = ms.current_mesh()
    in_place = triangles(mesh.vertex_matrix(), mesh.face_matrix())
    assert np.array_equal(in_place, triangles(new.vertices, new.faces))


# --- what a mesh carries -----------------------------------------------------------------------


def test_vertex_data_stay_linear():
    ms = sphere()
    ms.compute_scalar_by_function_per_vertex(q="x + 2*y - 3*z")
    ms.compute_color_by_function_per_vertex(x="127*(x+1)", y="127*(y+1)", z="127*(z+1)", a="200")
    ms.compute_texcoord_by_function_per_vertex(u="x", v="z")
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    mesh = ms.current_mesh()
    vertices = mesh.vertex_matrix()
    assert np.abs(mesh.vertex_scalar_array() - vertices @ (1, 2, -3)).max() < 1e-12
    colors = np.rint(255 * mesh.vertex_color_matrix())
    assert np.abs(colors[:, :3] - 127 * (vertices + 1)).max() < 2
    assert (colors[:, 3] == 200).all()
    assert np.abs(mesh.vertex_tex_coord_matrix() - vertices[:, [0, 2]]).max() < 1e-6


def test_face_data_are_those_of_the_faces_left():
    ms = sphere()
    mesh = ms.current_mesh()
    ms.compute_scalar_by_function_per_face(q="fi")
    ms.compute_color_by_function_per_face(r="255*(x0 > 0)", g="7", b="fi", a="255")
    colors = mesh.face_color_matrix()
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    source = mesh.face_scalar_array().astype(int)
    assert len(np.unique(source)) == len(source) == mesh.face_number()
    assert np.array_equal(mesh.face_color_matrix(), colors[source])


@pytest.mark.parametrize("before_add", [False, True])
def test_custom_attributes(before_add):
    """Also those that a mesh had before it was added, which PyMeshLab's own filters die of."""
    holder = sphere()
    arrays = plugin.from_pymeshlab(holder.current_mesh())
    given = Mesh(arrays.vertices, arrays.faces)
    ms = MeshSet()
    if not before_add:
        ms.add_mesh(given)
        given = ms.current_mesh()
    given.add_vertex_custom_scalar_attribute(np.arange(len(arrays.vertices), dtype=float), "id")
    given.add_vertex_custom_point_attribute(arrays.vertices, "was")
    given.add_face_custom_scalar_attribute(np.arange(len(arrays.faces), dtype=float), "id")
    given.add_face_custom_point_attribute(arrays.vertices[arrays.faces[:, 0]], "corner")
    if before_add:
        ms.add_mesh(given)
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    mesh = ms.current_mesh()
    ids = mesh.vertex_custom_scalar_attribute_array("id").astype(int)
    was = mesh.vertex_custom_point_attribute_matrix("was")
    assert np.array_equal(was, arrays.vertices[ids])
    assert np.linalg.norm(was - mesh.vertex_matrix(), axis=1).max() < 3 * LENGTH.value()
    ids = mesh.face_custom_scalar_attribute_array("id").astype(int)
    corners = mesh.face_custom_point_attribute_matrix("corner")
    assert np.array_equal(corners, arrays.vertices[arrays.faces[ids, 0]])


def test_custom_attributes_of_vertices_are_interpolated_when_asked_for():
    ms = sphere()
    mesh = ms.current_mesh()
    n_vertices, n_faces = mesh.vertex_number(), mesh.face_number()
    places = np.ascontiguousarray(mesh.vertex_matrix())
    unset = np.full(n_vertices, np.nan)
    mesh.add_vertex_custom_scalar_attribute(places @ (1.0, -2.0, 0.5) + 3.0, "line")
    mesh.add_vertex_custom_point_attribute(places[:, ::-1] * 1e6, "turned")
    mesh.add_vertex_custom_scalar_attribute(unset, "unset")
    mesh.add_vertex_custom_scalar_attribute(np.full(n_vertices, 7.0), "same")
    mesh.add_face_custom_scalar_attribute(np.arange(n_faces, dtype=float), "same")
    ms.compute_new_custom_scalar_attribute_per_vertex(name="made", expr="x - y")
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH, customattributes=True)
    vertices = mesh.vertex_matrix()
    assert len(vertices) < n_vertices / 3
    scalar = mesh.vertex_custom_scalar_attribute_array
    np.testing.assert_allclose(scalar("line"), vertices @ (1.0, -2.0, 0.5) + 3.0, atol=1e-12)
    np.testing.assert_allclose(scalar("made"), vertices @ (1.0, -1.0, 0.0), atol=1e-12)
    turned = mesh.vertex_custom_point_attribute_matrix("turned")
    np.testing.assert_allclose(turned, vertices[:, ::-1] * 1e6, atol=1e-6)
    assert np.isnan(scalar("unset")).all() and (scalar("same") == 7.0).all()
    ids = mesh.face_custom_scalar_attribute_array("same").astype(int)
    assert len(np.unique(ids)) == mesh.face_number()
    ms.compute_scalar_by_function_per_vertex(q="made")  # the mesh is whole


@pytest.mark.parametrize("name", ["two words", "x", "1st", "z2"])
def test_names_that_expressions_cannot_have(name):
    ms = sphere()
    mesh = ms.current_mesh()
    n_vertices = mesh.vertex_number()
    mesh.add_face_custom_scalar_attribute(np.zeros(mesh.face_number()), name)
    message = message_of(lambda: ms.apply_filter(SIMPLIFY, customattributes=True))
    assert repr(name.replace(" ", "_")) in message and mesh.vertex_number() == n_vertices
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    assert mesh.vertex_number() < n_vertices


def test_selected_vertices_beside_texture_coordinates_of_vertices():
    vertices, faces, _ = grid()
    ms = MeshSet()
    ms.add_mesh(Mesh(vertices, faces, v_tex_coords_matrix=1.0 - vertices[:, 1::-1]))
    ms.compute_selection_by_condition_per_vertex(condselect="x < 0.5")
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    mesh = ms.current_mesh()
    x, chosen = mesh.vertex_matrix()[:, 0], mesh.vertex_selection_array()
    assert chosen.any() and x[chosen].max() < 0.6 and x[~chosen].min() > 0.4
    uv = mesh.vertex_tex_coord_matrix()
    np.testing.assert_allclose(uv, 1.0 - mesh.vertex_matrix()[:, 1::-1], atol=1e-6)


def test_texture_seam_neither_tears_nor_bleeds(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # PyMeshLab writes the dummy texture there
    ms = textured_grid()
    mesh = ms.current_mesh()
    ms.set_texture_per_mesh(textname="t.png", use_dummy_texture=True)
    names = list(mesh.textures())
    n_faces = mesh.face_number()
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    assert mesh.face_number() < n_faces / 3
    assert names and list(mesh.textures()) == names
    vertices, faces = mesh.vertex_matrix(), mesh.face_matrix()
    right = vertices[faces, 0].mean(axis=1) > 0.5
    expected = vertices[faces][:, :, :2] + np.where(right[:, None, None], (0.5, 0), 0)
    uv = mesh.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    assert np.abs(uv - expected).max() < 1e-6
    assert ms.get_topological_measures()["number_holes"] == 1  # the seam is welded


def test_wedges_beside_custom_attributes_of_faces():
    ms = textured_grid()
    mesh = ms.current_mesh()
    n_faces = mesh.face_number()
    mesh.add_face_custom_scalar_attribute(np.arange(n_faces, dtype=float), "id")
    message = message_of(lambda: ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH))
    assert "per wedge" in message and mesh.face_number() == n_faces
    assert "customattributes=True" in message
    new = plugin.simplify(mesh, max_edge_length=0.15, custom_attributes=["id"])
    ids = new.face_custom_scalar_attribute_array("id").astype(int)
    assert len(np.unique(ids)) == new.face_number() < n_faces / 3
    corners = triangles(new.vertex_matrix(), new.face_matrix())
    uv = new.wedge_tex_coord_matrix().reshape(-1, 3, 2) - corners[:, :, :2]
    assert np.isin(np.round(uv[..., 0], 6), (0, 0.5)).all()
    assert np.abs(uv[..., 1]).max() < 1e-6
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH, customattributes=True)
    assert np.array_equal(mesh.face_custom_scalar_attribute_array("id").astype(int), ids)
    assert np.array_equal(mesh.wedge_tex_coord_matrix(), new.wedge_tex_coord_matrix())


def test_borders_of_several_textures_stay(tmp_path):
    image = pytest.importorskip("PIL.Image")
    vertices, faces, right = grid()
    for name in "ab":
        image.new("RGB", (4, 4)).save(tmp_path / f"{name}.png")
    (tmp_path / "m.mtl").write_text("".join(f"newmtl {k}\nmap_Kd {k}.png\n" for k in "ab"))
    lines = ["mtllib m.mtl"]
    lines += [f"v {x} {y} {z}\nvt {x} {y}" for x, y, z in vertices]
    for name, side in (("a", ~right), ("b", right)):
        lines += [f"usemtl {name}"]
        lines += ["f " + " ".join(f"{i}/{i}" for i in face) for face in faces[side] + 1]
    (tmp_path / "m.obj").write_text("\n".join(lines))
    ms = MeshSet()
    ms.load_new_mesh(str(tmp_path / "m.obj"))
    mesh = ms.current_mesh()
    names = list(mesh.textures())
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    assert len(names) == 2 and list(mesh.textures()) == names
    corners = triangles(mesh.vertex_matrix(), mesh.face_matrix())
    texture = textures_of_faces(mesh)
    assert np.array_equal(texture == texture.max(), corners[:, :, 0].mean(axis=1) > 0.5)
    uv = mesh.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    assert np.abs(uv - corners[:, :, :2]).max() < 1e-6


@pytest.mark.parametrize("selected", [True, None])
def test_only_selected_faces_change(selected):
    ms = sphere()
    ms.compute_selection_by_condition_per_face(condselect="x0 > 0")
    mesh = ms.current_mesh()
    ms.compute_scalar_by_function_per_face(q="fi")
    is_selected = mesh.face_selection_array()
    before = triangles(mesh.vertex_matrix(), mesh.face_matrix())
    ms.apply_filter(
        SIMPLIFY, maxedgelength=LENGTH, **({} if selected is None else {"selected": True})
    )
    source = mesh.face_scalar_array().astype(int)
    after = triangles(mesh.vertex_matrix(), mesh.face_matrix())
    kept = ~is_selected[source]
    assert kept.sum() == (~is_selected).sum()
    assert np.array_equal(after[kept], before[~is_selected])
    assert (~kept).sum() < is_selected.sum() / 3
    chosen = mesh.face_selection_array()
    assert np.array_equal(chosen, ~kept)


def test_selection_of_everything_and_of_vertices():
    ms = sphere()
    ms.set_selection_all()
    ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    mesh = ms.current_mesh()
    assert mesh.selected_face_number() == mesh.face_number()
    assert mesh.selected_vertex_number() == mesh.vertex_number()


@pytest.mark.parametrize("criterion", [{"maxedgelength": LENGTH}, {"targetperc": 0.02}])
@pytest.mark.parametrize("preserve", [False, True])
def test_preserveboundary(criterion, preserve):
    """The boundary stays the same curve: a wavy side with all its vertices."""
    vertices, faces, _ = grid()
    vertices[:, 1] += 0.02 * np.cos(40 * vertices[:, 0])
    side = {tuple(p) for p in vertices[:25]}
    ms = MeshSet()
    ms.add_mesh(Mesh(vertices, faces))
    ms.apply_filter(SIMPLIFY, preserveboundary=preserve, **criterion)
    left = {tuple(p) for p in ms.current_mesh().vertex_matrix()}
    assert (side <= left) is preserve


def test_polylines_stay():
    ms = MeshSet()
    ms.add_mesh(with_polylines())
    ms.compute_scalar_by_function_per_vertex(q="x + 2*y")
    mesh = ms.current_mesh()
    before = lines(mesh)
    figures = ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    assert figures["faces_number"] < figures["faces_number_before"] / 4
    assert figures["vertices_number"] == mesh.vertex_number()
    assert np.array_equal(lines(mesh), before)
    assert np.abs(mesh.vertex_scalar_array() - mesh.vertex_matrix() @ (1, 2, 0)).max() < 1e-12


def test_a_mesh_that_is_not_compact():
    ms = not_compact()
    figures = ms.apply_filter(SIMPLIFY, maxedgelength=LENGTH)
    mesh = ms.current_mesh()
    assert mesh.is_compact() and mesh.face_number() < figures["faces_number_before"] / 4
    assert agree(ms).euler_characteristic == 1


# --- plain functions ---------------------------------------------------------------------------


def rich_mesh():
    ms = sphere()
    ms.compute_scalar_by_function_per_vertex(q="x")
    ms.compute_color_by_function_per_vertex(x="127*(x+1)", y="vi", z="3", a="255")
    ms.compute_scalar_by_function_per_face(q="fi")
    ms.compute_color_by_function_per_face(r="fi", g="fi/2", b="1", a="255")
    ms.compute_texcoord_by_function_per_vertex(u="x", v="y")
    ms.compute_texcoord_parametrization_triangle_trivial_per_wedge()
    mesh = ms.current_mesh()
    mesh.add_vertex_custom_point_attribute(np.ascontiguousarray(mesh.vertex_matrix()), "place")
    mesh.add_face_custom_scalar_attribute(np.arange(mesh.face_number(), dtype=float), "id")
    return ms, mesh


def test_round_trip_is_exact():
    _ms, mesh = rich_mesh()
    arrays = plugin.from_pymeshlab(mesh, ["place", "id"])
    assert {"normal", "color", "scalar", "tex_coord", "custom.place"} <= arrays.vertex_data.keys()
    assert {"normal", "color", "scalar", "wedge_tex_coord", "custom.id"} == arrays.face_data.keys()
    again = plugin.to_pymeshlab(*arrays, like=mesh)
    assert again.label() == mesh.label()
    back = plugin.from_pymeshlab(again, ["place", "id"])
    for each in (arrays, back):
        del each.vertex_data["normal"]  # PyMeshLab computes its own
    assert same(arrays, back)
    with pytest.raises(PyMeshLabException, match="nothing"):
        plugin.from_pymeshlab(mesh, ["nothing"])


def test_simplify_a_mesh():
    ms = sphere()
    ms.compute_scalar_by_function_per_vertex(q="x + 2*y")
    mesh = ms.current_mesh()
    mesh.add_vertex_custom_point_attribute(np.ascontiguousarray(mesh.vertex_matrix()), "place")
    before = plugin.from_pymeshlab(mesh, ["place"])
    new, report = plugin.simplify(
        mesh, max_edge_length=0.15, custom_attributes=["place"], return_report=True
    )
    assert same(before, plugin.from_pymeshlab(mesh, ["place"]))
    vertices = new.vertex_matrix()
    assert new.face_number() == report.topology_after.n_faces < len(before.faces)
    assert np.abs(new.vertex_scalar_array() - vertices @ (1, 2, 0)).max() < 1e-12
    assert np.abs(new.vertex_custom_point_attribute_matrix("place") - vertices).max() < 1e-12
    assert (new.vertex_color_matrix() == mesh.vertex_color_matrix()[0]).all()
    assert new.label() == mesh.label()
    with pytest.raises(MeshError, match="current_mesh"):
        plugin.simplify(ms, max_edge_length=0.15)


def test_polylines_stay_in_a_new_mesh():
    mesh = with_polylines()
    new = plugin.simplify(mesh, max_edge_length=0.15)
    assert new.face_number() < mesh.face_number() / 4
    assert np.array_equal(lines(new), lines(mesh))
    held = np.arange(mesh.vertex_number())
    assert plugin.simplify(mesh, max_edge_length=0.15, locked=held).face_number() == 1152


def test_a_mesh_that_is_not_compact_is_left_so():
    ms = not_compact()
    mesh = ms.current_mesh()
    assert plugin.from_pymeshlab(mesh).vertices.shape == (625, 3)
    assert plugin.topology(mesh).n_vertices == 625
    new = plugin.simplify(mesh, max_edge_length=0.15)
    assert new.is_compact() and not mesh.is_compact()
    assert plugin.topology(new).same_topology(plugin.topology(mesh))


# --- pipelines -----------------------------------------------------------------------------------


def agree(ms):
    """PyMeshLab's measures and our report say the same."""
    theirs, ours = ms.get_topological_measures(), plugin.topology(ms.current_mesh())
    assert theirs["is_mesh_two_manifold"] and ours.is_manifold
    assert theirs["genus"] == ours.genus
    assert theirs["number_holes"] == ours.n_boundary_loops
    assert theirs["boundary_edges"] == ours.n_boundary_edges
    assert theirs["connected_components_number"] == ours.n_components
    assert theirs["edges_number"] == ours.n_edges
    return ours


@needs_data
@pytest.mark.parametrize("name", ["face_libigl", "elephant_refined", "skull_yj"])
def test_pipeline_on_a_real_mesh(name, tmp_path):
    ms = MeshSet()
    ms.load_new_mesh(str(data_dir() / "meshes" / f"{name}.ply"))
    ms.meshing_remove_unreferenced_vertices()
    before = agree(ms)
    figures = ms.apply_filter(SIMPLIFY, maxedgelength=PercentageValue(1))
    assert figures["faces_number"] < figures["faces_number_before"]
    assert before.same_topology(agree(ms))
    ms.apply_coord_taubin_smoothing(stepsmoothnum=2)
    ms.save_current_mesh(str(tmp_path / "out.ply"))
    ms.load_new_mesh(str(tmp_path / "out.ply"))
    assert before.same_topology(agree(ms))


def test_isosurface_filter():
    x, y, z = np.mgrid[-1:1:40j, -1:1:40j, -1:1:40j]
    torus = 0.3 - np.hypot(np.hypot(x, y) - 0.6, z)
    ms = sphere()
    figures = ms.generate_isosurface_by_marching_tetrahedra(volume=torus, meshname="torus")
    assert ms.current_mesh_id() == 1 and ms.current_mesh().label() == "torus"
    assert figures["faces_number"] == ms.current_mesh().face_number()
    assert agree(ms).genus == 1
    ms.apply_filter(SIMPLIFY, maxedgelength=PureValue(1.0))
    assert agree(ms).genus == 1
    empty = MeshSet()
    plugin.isosurface_to_new_mesh(empty, volume=torus, isovalue=-0.1, spacing=(1, 2, 3))
    assert empty.mesh_number() == 1


def test_isosurface_filter_takes_the_options_of_extraction():
    x, y, z = np.mgrid[-1:1:20j, -1:1:20j, -1:1:20j]
    torus = 0.3 - np.hypot(np.hypot(x, y) - 0.6, z)
    n_faces = {}
    for name, options in {
        "plain": {},
        "regular": {"regularise": True},
        "fine": {"refine": 2},
    }.items():
        ms = MeshSet()
        ms.generate_isosurface_by_marching_tetrahedra(volume=torus, lattice="bcc", **options)
        n_faces[name] = ms.current_mesh().face_number()
        assert agree(ms).genus == 1
    assert n_faces["regular"] < 0.4 * n_faces["plain"]
    assert n_faces["fine"] > 3.5 * n_faces["plain"]


# --- errors in PyMeshLab's words -----------------------------------------------------------------


def test_wrong_parameters_have_the_messages_of_other_filters():
    ms = sphere()
    for value in (1.0, "1%"):
        theirs = message_of(lambda v=value: ms.apply_filter(OTHER, targetlen=v))
        ours = message_of(lambda v=value: ms.apply_filter(SIMPLIFY, maxedgelength=v))
        assert ours == theirs.replace("targetlen", "maxedgelength")
    theirs = message_of(lambda: ms.apply_filter(OTHER, nonsense=1))
    ours = message_of(lambda: ms.apply_filter(SIMPLIFY, nonsense=1))
    assert ours == theirs.replace(OTHER, SIMPLIFY)
    theirs = message_of(lambda: MeshSet().apply_filter(OTHER))
    assert message_of(lambda: MeshSet().apply_filter(SIMPLIFY)) == theirs.replace(OTHER, SIMPLIFY)
    ours = message_of(lambda: ms.apply_filter(SIMPLIFY, blocked="no"), InvalidEnumException)
    assert ours.startswith("Enum 'no' not found. Possible values are 'contract'; ")
    assert "foldover" in message_of(lambda: ms.apply_filter(SIMPLIFY, foldover="x"))


def test_no_faces_has_the_message_of_other_filters():
    ms = sphere()
    ms.meshing_remove_all_faces()
    theirs = message_of(lambda: ms.apply_filter(OTHER))
    assert message_of(lambda: ms.apply_filter(SIMPLIFY)) == theirs.replace(OTHER, SIMPLIFY)


@pytest.mark.parametrize(
    "name", ["boundaryweight", "planarquadric", "planarweight", "preservetopology", "qualityweight"]
)
def test_parameters_that_are_fixed(name):
    default = plugin.FILTERS[SIMPLIFY].parameters[name].default
    assert sphere().apply_filter(SIMPLIFY, targetfacenum=100, **{name: default})["genus"] == 0
    other = not default if isinstance(default, bool) else 2 * default
    message = message_of(lambda: sphere().apply_filter(SIMPLIFY, **{name: other}))
    assert message == f"Parameter {name} of filter {SIMPLIFY} can only be {default}."


def test_bad_mesh_says_what_is_wrong():
    ms = MeshSet()
    ms.add_mesh(Mesh(np.eye(5, 3), np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])))
    message = message_of(lambda: ms.apply_filter(SIMPLIFY))
    assert message.startswith(f"Failed to apply filter: {SIMPLIFY}\nDetails: ")
    assert "more than two faces" in message and "meshing_repair_non_manifold_edges" in message
    assert ms.current_mesh().face_number() == 3
    ms = MeshSet()
    ours = message_of(lambda: ms.generate_isosurface_by_marching_tetrahedra(volume=np.eye(3)))
    assert "shape" in ours
    assert "volume" in message_of(lambda: ms.generate_isosurface_by_marching_tetrahedra())


def test_other_filters_are_as_before():
    ms = sphere()
    assert ms.apply_filter("get_geometric_measures")["surface_area"] > 12
    assert "targetlen" in ms.filter_parameter_values(OTHER)
    with pytest.raises(PyMeshLabException, match="Filter does not exists"):
        ms.apply_filter("no_such_filter")
    with pytest.raises(TypeError, match="incompatible function arguments"):
        ms.apply_filter()


# --- help ----------------------------------------------------------------------------------------


def test_filters_are_listed(capsys):
    assert plugin.FILTERS.keys() <= set(pymeshlab.filter_list())
    for call in (pymeshlab.print_filter_list, lambda: pymeshlab.search("topology_preserving")):
        call()
        assert SIMPLIFY in capsys.readouterr().out
    pymeshlab.print_filter_parameter_list(SIMPLIFY)
    printed = capsys.readouterr().out
    assert "\tmaxedgelength : PercentageValue = 1% unless there is a target\n" in printed
    assert "\ttargetfacenum : int = 0\n" in printed and "planarquadric" not in printed


def test_page_and_help_tell_of_all_parameters():
    page = (ROOT / "docs" / "plugins" / "pymeshlab.md").read_text(encoding="utf-8")
    for name, each in plugin.FILTERS.items():
        assert f"## `{name}`" in page
        for parameter in each.parameters:
            assert f"`{parameter}`" in page


def test_filters_can_be_removed():
    plugin.remove_filters()
    try:
        assert not hasattr(MeshSet, SIMPLIFY) and SIMPLIFY not in pymeshlab.filter_list()
        ms = sphere()
        assert plugin.simplify_current_mesh(ms, maxedgelength=LENGTH)["genus"] == 0
        with pytest.raises(PyMeshLabException, match="does not exists"):
            ms.apply_filter(SIMPLIFY)
    finally:
        plugin.add_filters()
