"""Changes of the current mesh of a ``pymeshlab.MeshSet`` in place."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tetsimplify.plugins.pymeshlab_arrays import CUSTOM, WEDGES, levels

from tetsimplify import seams
from tetsimplify.adapters import MeshArrays, needs

with needs("pymeshlab"):
    import pymeshlab
    from pymeshlab import PercentageValue, PyMeshLabException

Data = dict[str, NDArray[Any]]

FAR = 2.0**600  # its square is infinite, its product with any other length here is not

# as they are before filters are added to them
apply_filter = pymeshlab.MeshSet.apply_filter
filter_parameter_values = pymeshlab.MeshSet.filter_parameter_values


class Selection(NamedTuple):
    """What is selected."""

    vertices: NDArray[np.bool_]
    faces: NDArray[np.bool_]


class Writer:
    r"""Changes the current mesh of a ``MeshSet`` in place.

    PyMeshLab lets Python read a mesh, not write to it. Putting a new mesh in its place would
    change its id, leave references to it dangling and lose textures, custom attributes and
    transform. So PyMeshLab's own filters do the work. Every vertex is moved to the place on a
    parabola that stands for its new index, and those that are gone far away. Then a face
    vanishes exactly when its area is zero or infinite. Null faces are removed, vertices in one
    place unified, and what is left is moved to where it belongs::

        a---b---c                  0---1---1            0-----1
         \ / \ /     b, c -> 1      \ / \ /              \   / \
          d---e                      2---3                2---3

    Positions come from short-lived meshes, by morphing.

    Parameters
    ----------
    ms : pymeshlab.MeshSet
    expressions : bool
        Use filters that evaluate expressions even where there are custom attributes. PyMeshLab
        dies of them where a mesh had its attributes before it was added to the set.

    Raises
    ------
    PyMeshLabException
        When expressions are wanted and a custom attribute has a name that forbids them.
    """

    def __init__(self, ms: pymeshlab.MeshSet, *, expressions: bool = False) -> None:
        self.ms, self.mesh = ms, ms.current_mesh()
        self.apply = partial(apply_filter, ms)
        found = _custom_attributes(ms)
        if expressions:
            _check_names(self.mesh, found)
        held = set() if expressions else {kind[0] for kind, _ in found}
        self.is_held = {element: element in held for element in "vf"}
        """Whether custom attributes forbid expressions, for vertices and for faces."""
        self.custom = [name for kind, name in found if expressions and kind[0] == "v"]
        """The custom attributes of vertices that can be written."""

    def replace(self, result: seams.Seamed, given: MeshArrays, selected: Selection) -> None:
        """Make the mesh that of a result."""
        # so large that where a vertex comes from is less than a rounding error
        unit = 2.0 ** math.ceil(math.log2(np.abs(given.vertices).max() + 1) + 54)
        self._move(_keys(result.vertex_map, unit))
        self.apply("meshing_remove_null_faces")
        self.apply("meshing_remove_unreferenced_vertices")
        self.apply("meshing_remove_duplicate_vertices")
        keys = self.mesh.vertex_matrix()
        order = np.rint(keys[:, 2] / unit).astype(np.int64) - 1
        if len(order) != len(result.vertices) or self.mesh.face_number() != len(result.faces):
            raise PyMeshLabException(
                "the filters of PyMeshLab that this is made of "
                "did not do as expected, and have damaged the current mesh"
            )
        if len(order) == 0:  # all gone, as can happen when the topology may be violated
            return
        self._write_colors_and_scalars(keys, {k: x[order] for k, x in result.vertex_data.items()})
        written = {name: values[order] for name, values in result.vertex_data.items()}
        if "tex_coord" in written and not self.is_held["v"]:
            self._write_tex_coords(written["tex_coord"])
        for name in self.custom:
            if CUSTOM + name in written:
                self._write_custom(name, written[CUSTOM + name])
        if WEDGES in result.wedge_data:
            self._write_wedges(result.faces, result.wedge_data[WEDGES], order)
        if not np.array_equal(self.mesh.vertex_matrix(), keys):
            self._move(keys)
        self._select(keys, order, result, selected)
        self._move(result.vertices[order])
        self.apply("compute_normal_per_face")
        self.apply("compute_normal_per_vertex")

    def _move(self, positions: NDArray[np.float64]) -> None:
        """Move all vertices, exactly."""
        with self._short_lived(pymeshlab.Mesh(positions)) as target:
            for _ in range(4):  # each time what is lost to rounding gets smaller
                self.apply("compute_coord_linear_morphing", targetmesh=target, percentmorph=100.0)
                if np.array_equal(self.mesh.vertex_matrix(), positions):
                    return
        raise PyMeshLabException("the vertices cannot be moved")

    @contextmanager
    def _short_lived(self, mesh: pymeshlab.Mesh) -> Iterator[int]:
        """A mesh beside the current one, as its id."""
        current = self.ms.current_mesh_id()
        self.ms.add_mesh(mesh, "", False)
        number = max(mesh.id() for mesh in self.ms)
        try:
            yield number
        finally:
            self.ms.set_current_mesh(number)
            self.apply("delete_current_mesh")
            self.ms.set_current_mesh(current)

    def _write_colors_and_scalars(self, keys: NDArray[np.float64], data: Data) -> None:
        given = {k: v for k, v in (("color", "matrix"), ("scalar", "array")) if k in data}
        if not given:
            return
        arguments = {
            f"v_{name}_{shape}": levels(data[name]) if name == "color" else data[name]
            for name, shape in given.items()
        }
        with self._short_lived(pymeshlab.Mesh(keys, **arguments)) as source:
            self._transfer(
                source, colortransfer="color" in given, qualitytransfer="scalar" in given
            )

    def _select(
        self,
        keys: NDArray[np.float64],
        order: NDArray[np.int64],
        result: seams.Seamed,
        selected: Selection,
    ) -> None:
        """Select what is left of the faces and vertices that were selected."""
        self.apply("set_selection_none")
        chosen = selected.faces[result.face_map]
        if chosen.all():
            self.apply("set_selection_all", allverts=False)
        elif chosen.any() and not self.is_held["f"]:
            self._select_faces(result.faces, chosen, order)
            self._move(keys)
        elif chosen.any():  # of a face with a vertex that only selected faces have
            inside = np.zeros(len(order), np.bool_)
            inside[result.faces[chosen]] = True
            inside[result.faces[~chosen]] = False
            self._select_vertices(keys, inside[order])
            self.apply("compute_selection_transfer_vertex_to_face", inclusive=False)
        kept = np.flatnonzero(selected.vertices & (result.vertex_map >= 0))
        vertices = np.zeros(len(order), np.bool_)
        vertices[result.vertex_map[kept]] = True
        self._select_vertices(keys, vertices[order])

    def _select_faces(
        self, faces: NDArray[np.int32], chosen: NDArray[np.bool_], order: NDArray[np.int64]
    ) -> None:
        """Select faces: move the vertices so that an expression tells these from others.

        Most are known by a vertex that no other face has. Of the rest each is known by one of
        its directed edges, v to w; a vertex v is moved to (number, w, w').
        """
        place = np.full((len(order), 3), -1.0)
        place[:, 0] = np.arange(len(order))
        inside = np.ones(len(order), np.bool_)
        inside[faces[~chosen]] = False
        place[inside, 1] = -2
        left = np.flatnonzero(chosen & ~inside[faces].any(axis=1))
        for axis, k in product((1, 2), range(3)):
            v, w = faces[left, k], faces[left, (k + 1) % 3]
            _, first = np.unique(v, return_index=True)
            free = first[place[v[first], axis] == -1]
            place[v[free], axis] = w[free]
            left = np.delete(left, free)
        self._move(place[order])
        terms = [f"y{k}==-2||y{k}==x{(k + 1) % 3}||z{k}==x{(k + 1) % 3}" for k in range(3)]
        self.apply("compute_selection_by_condition_per_face", condselect="||".join(terms))

    def _select_vertices(self, keys: NDArray[np.float64], chosen: NDArray[np.bool_]) -> None:
        self.apply("set_selection_none", allfaces=False)
        if not chosen.any():
            return
        source = pymeshlab.Mesh(keys, v_scalar_array=chosen.astype(np.float64))
        with self._short_lived(source) as number:
            current = self.ms.current_mesh_id()
            self.ms.set_current_mesh(number)
            self.apply("compute_selection_by_scalar_per_vertex", minq=0.5, maxq=2.0)
            self.ms.set_current_mesh(current)
            self._transfer(number, colortransfer=False, selectiontransfer=True)

    def _transfer(self, source: int, **what: bool) -> None:
        """Take values of the vertices from another mesh, in the same places."""
        self.apply(
            "transfer_attributes_per_vertex",
            sourcemesh=source,
            targetmesh=self.mesh.id(),
            vertexsampling=True,
            upperbound=PercentageValue(1),
            **what,
        )

    def _write_tex_coords(self, uv: NDArray[np.float64]) -> None:
        self._move(np.column_stack([uv, np.zeros(len(uv))]))
        self.apply("compute_texcoord_by_function_per_vertex", u="x", v="y")

    def _write_custom(self, name: str, values: NDArray[np.float64]) -> None:
        """Write a custom attribute of the vertices, from vertices that are moved to its values."""
        rows = np.zeros((len(values), 3))
        rows[:, : values[0].size] = values.reshape(len(values), -1)
        self._move(rows)
        if values.ndim == 1:
            self.apply("compute_new_custom_scalar_attribute_per_vertex", name=name, expr="x")
        else:
            expressions = {f"{axis}_expr": axis for axis in "xyz"}
            self.apply("compute_new_custom_point_attribute_per_vertex", name=name, **expressions)

    def _write_wedges(
        self, faces: NDArray[np.int32], uv: NDArray[np.float64], order: NDArray[np.int64]
    ) -> None:
        """Write texture coordinates per wedge, from vertices that are moved to these.

        At a seam a vertex has several, so faces whose vertices agree are written together.
        """
        left = np.ones(len(faces), np.bool_)
        while left.any():
            at_vertex = np.zeros((len(order), 3))
            at_vertex[faces[left], :2] = uv[left]
            agrees = left & (at_vertex[faces, :2] == uv).all(axis=(1, 2))
            if not agrees.any():  # no face won all its vertices: one at a time
                face = np.flatnonzero(left)[0]
                at_vertex[faces[face], :2] = uv[face]
                agrees[face] = True
            self._select_faces(faces, agrees, order)
            self._move(at_vertex[order])
            self.apply(
                "compute_texcoord_by_function_per_wedge",
                **{f"u{k}": f"x{k}" for k in range(3)},
                **{f"v{k}": f"y{k}" for k in range(3)},
                onselected=True,
            )
            left &= ~self.mesh.face_selection_array()


def _custom_attributes(ms: pymeshlab.MeshSet) -> list[tuple[str, str]]:
    """Kind and name of the custom attributes of the current mesh; "vs" are scalars of vertices."""
    start = "__ca_"  # __ca_vs__name, among the parameters for saving a file
    keys = [key for key in filter_parameter_values(ms, "ply") if key.startswith(start)]
    return [(key[5:7], key[9:]) for key in keys]


def _check_names(mesh: pymeshlab.Mesh, attributes: list[tuple[str, str]]) -> None:
    """Refuse names that are none in expressions, or mean something else there."""
    own = {f"{axis}{k}" for axis in "xyz" for k in ("", 0, 1, 2)}
    for kind, name in attributes:
        element = "vertex" if kind[0] == "v" else "face"
        values = "scalar_attribute_array" if kind[1] == "s" else "point_attribute_matrix"
        try:  # spaces in names are listed as underscores
            getattr(mesh, f"{element}_custom_{values}")(name)
            is_sound = re.fullmatch("[A-Za-z_][A-Za-z_0-9]*", name) and name not in own
        except PyMeshLabException:
            is_sound = None
        if not is_sound:
            raise PyMeshLabException(
                f"customattributes=True: PyMeshLab cannot have {name!r} in expressions: a custom "
                "attribute needs a name of letters, digits and _ that is no coordinate."
            )


def _keys(index: NDArray[Any], unit: float) -> NDArray[np.float64]:
    """Places on a parabola, no three on a line; -1 is so far away that areas overflow."""
    keys = np.zeros((len(index), 3), order="F")
    keys[:, 2] = (index + 1.0) * unit
    keys[:, 0] = (index + 1.0) * keys[:, 2]
    keys[index < 0] = 0.0, 0.0, FAR
    return keys


def textures_of_faces(mesh: pymeshlab.Mesh) -> NDArray[np.float64]:
    """The number of the texture of each face."""
    ms = pymeshlab.MeshSet()
    ms.add_mesh(mesh)
    apply_filter(ms, "compute_new_custom_scalar_attribute_per_face", name="texture", expr="ti")
    numbers: NDArray[np.float64] = ms.current_mesh().face_custom_scalar_attribute_array("texture")
    return numbers
