"""PyMeshLab: filters of every ``pymeshlab.MeshSet``, and ``pymeshlab.Mesh`` in and out.

Importing this module adds two filters to those of PyMeshLab, where they are called and listed
as the others: ``meshing_decimation_topology_preserving_edge_collapse`` and
``generate_isosurface_by_marching_tetrahedra``. :func:`remove_filters` takes them out again; the
functions of this module work without them.

Examples
--------
>>> import pymeshlab
>>> import tetsimplify.plugins.pymeshlab
>>> ms = pymeshlab.MeshSet()
>>> ms.create_sphere(subdiv=5)
>>> figures = ms.meshing_decimation_topology_preserving_edge_collapse(
...     maxedgelength=pymeshlab.PercentageValue(3)
... )
>>> figures["genus"], ms.get_topological_measures()["genus"]
(0, 0)
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from tetsimplify.plugins.pymeshlab_arrays import (
    WEDGES,
    compact,
    from_pymeshlab,
    in_rows,
    is_constant,
    to_pymeshlab,
    with_ends,
)
from tetsimplify.plugins.pymeshlab_filters import (
    FILTERS,
    isosurface_to_new_mesh,
    simplify_current_mesh,
)
from tetsimplify.plugins.pymeshlab_menu import add_filters, remove_filters

from tetsimplify import seams
from tetsimplify.adapters import Adapter, needs
from tetsimplify.arrays import as_vertex_mask
from tetsimplify.topology import TopologyReport
from tetsimplify.topology import topology as topology_of_arrays

with needs("pymeshlab"):
    import pymeshlab

__all__ = [
    "ADAPTER",
    "FILTERS",
    "add_filters",
    "from_pymeshlab",
    "isosurface_to_new_mesh",
    "remove_filters",
    "simplify",
    "simplify_current_mesh",
    "to_pymeshlab",
    "topology",
]

DEFAULTS = {"color": 1.0, "scalar": 0.0}  # what PyMeshLab gives to new vertices


def simplify(
    mesh: pymeshlab.Mesh,
    *,
    custom_attributes: Collection[str] = (),
    return_report: bool = False,
    locked: Any = None,
    **options: Any,
) -> Any:
    """Contract edges until a criterion is reached, without changing the topology.

    Parameters
    ----------
    mesh : pymeshlab.Mesh
        Not changed. Polylines stay where they are.
    custom_attributes : collection of str
        Names of the custom attributes to be carried; a mesh does not tell which it has.
    return_report : bool
        Return the :class:`tetsimplify.SimplificationReport` too.
    locked, **options
        Those of :func:`tetsimplify.simplify`: `max_edge_length`, `keep_ratio`, ...

    Returns
    -------
    pymeshlab.Mesh
        A new mesh with the label, colours, scalars and texture coordinates of `mesh` and with
        normals of its own. Texture images, transform and selection stay with meshes in a
        ``MeshSet``, since PyMeshLab has no way to write them; the filter keeps them.
    report : optional

    Raises
    ------
    MeshError
        When the mesh is no consistently oriented 2-manifold (``repair=True`` repairs it).
    """
    with compact(mesh) as source:
        given = from_pymeshlab(source, custom_attributes, normals=False)
        ends = in_rows(source.edge_matrix())
    held = as_vertex_mask("locked", locked, len(given.vertices))
    held[ends] = True
    # what is the same everywhere, as colours that nobody has set, needs no interpolation
    same = {name: rows[0] for name, rows in given.vertex_data.items() if is_constant(rows)}
    wedges = {name: rows for name, rows in given.face_data.items() if name == WEDGES}
    result = seams.simplify(
        given.vertices,
        given.faces,
        vertex_data={k: rows for k, rows in given.vertex_data.items() if k not in same},
        face_data={k: rows for k, rows in given.face_data.items() if k != WEDGES},
        wedge_data=wedges,
        locked=held,
        **options,
    )
    result = with_ends(result, given, ends)
    of_vertices = result.vertex_data | {
        name: np.broadcast_to(row, (len(result.vertices), *row.shape))
        for name, row in same.items()
        if not np.all(row == DEFAULTS.get(name))
    }
    new = to_pymeshlab(
        result.vertices,
        result.faces,
        of_vertices,
        result.face_data | result.wedge_data,
        edges=result.vertex_map[ends],
        like=mesh,
    )
    return (new, result.report) if return_report else new


def topology(mesh: pymeshlab.Mesh) -> TopologyReport:
    """Tell the topology of a mesh."""
    with compact(mesh) as source:
        return topology_of_arrays(source.vertex_matrix(), source.face_matrix())


add_filters()

ADAPTER = Adapter("pymeshlab", simplify, topology)
