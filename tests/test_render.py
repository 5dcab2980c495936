"""Pictures of meshes."""

from __future__ import annotations

import numpy as np
import pytest

from io_meshes import sphere
from tetsimplify.errors import MissingExtraError
from tetsimplify.mesh import Mesh
from tetsimplify.picture import Lens, Side, save_side_by_side
from tetsimplify.render import View, draw, point_seen_at

FROM_ABOVE = View((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 4.0)
SIZE = (40, 40)


def square(z: float, half: float) -> Mesh:
    """A square that faces upwards."""
    points = [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]]
    return Mesh(np.array(points), np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def both(a: Mesh, b: Mesh) -> Mesh:
    """Two meshes as one."""
    faces = np.concatenate([a.faces, b.faces + len(a.vertices)])
    return Mesh(np.concatenate([a.vertices, b.vertices]), faces.astype(np.int32))


def test_what_is_covered():
    opacity = draw(square(0.0, 1.0), FROM_ABOVE, SIZE)[..., 3]
    assert opacity.shape == (40, 40)
    assert opacity[11:29, 11:29].min() == 1
    assert opacity.sum() == pytest.approx(20 * 20, rel=0.02)


def test_backs_are_not_drawn():
    flipped = Mesh(square(0.0, 1.0).vertices, square(0.0, 1.0).faces[:, ::-1].copy())
    assert not draw(flipped, FROM_ABOVE, SIZE).any()


@pytest.mark.parametrize("small_is_near", [True, False])
def test_the_nearest_is_seen(small_is_near):
    small = square(0.5 if small_is_near else -0.5, 0.5)
    mesh = both(small, square(0.0, 1.0))
    for order in (mesh.faces, mesh.faces[::-1].copy()):
        image = draw(Mesh(mesh.vertices, order), FROM_ABOVE, SIZE, edge_width=1.0)
        has_edge_inside = image[20, 12:19, 0].min() < 0.6 * image[20, 12:19, 0].max()
        assert has_edge_inside == small_is_near


def test_left_is_left_and_up_is_up():
    corner = Mesh(square(0.0, 0.5).vertices + [-1.0, 1.0, 0.0], square(0.0, 0.5).faces)
    opacity = draw(corner, FROM_ABOVE, SIZE)[..., 3]
    assert opacity[:20, :20].sum() == opacity.sum() > 0


def test_light_and_edges():
    image = draw(sphere(), View((0, 0, 0), (0.2, -1, 0.3), (0, 0, 1), 0.8), SIZE)
    assert image[14, 15, 0] > 1.5 * image[26, 27, 0]  # light falls from the upper left
    lined = draw(sphere(), View((0, 0, 0), (0.2, -1, 0.3), (0, 0, 1), 0.8), SIZE, edge_width=1.0)
    assert lined[..., 0].sum() < 0.9 * image[..., 0].sum()
    np.testing.assert_array_equal(lined[..., 3], image[..., 3])


def test_outside_of_the_picture():
    mesh = Mesh(sphere().vertices * 1000, sphere().faces)
    from_the_side = View((0, 0, 0), (0, -1, 0), (0, 0, 1), 4.0)
    assert draw(mesh, from_the_side, SIZE)[..., 3].min() == 1
    assert not draw(Mesh(mesh.vertices + 1e6, mesh.faces), from_the_side, SIZE).any()


def test_point_seen_at():
    mesh = both(square(0.5, 0.5), square(0.0, 1.0))
    assert point_seen_at(mesh, FROM_ABOVE, SIZE, (0.38, 0.38)).tolist() == [-0.5, 0.5, 0.5]
    assert point_seen_at(mesh, FROM_ABOVE, SIZE, (0.0, 1.0)).tolist() == [-1, -1, 0]


def test_side_by_side(tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    view = View((0, 0, 0), (0.2, -1, 0.3), (0, 0, 1), 0.8)
    side = Side(sphere(), "title", "caption")
    for name in "ab":
        save_side_by_side(tmp_path / f"{name}.png", (side, side), view, Lens((0.5, 0.5), 0.1))
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    image = matplotlib.image.imread(tmp_path / "a.png")
    assert image.shape == (840, 1950, 4)
    assert image[..., 0].std() > 0.1


def test_side_by_side_without_matplotlib(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib", None)
    side = Side(sphere(), "title", "caption")
    with pytest.raises(MissingExtraError, match=r"tetsimplify\[demo\]"):
        save_side_by_side(tmp_path / "a.png", (side, side), FROM_ABOVE, Lens((0.5, 0.5), 0.1))
