"""Regularised marching tetrahedra: no decimator, but as many faces from the volume at once.

References
----------
G. M. Treece, R. W. Prager and A. H. Gee. Regularised marching tetrahedra: improved iso-surface
extraction. Computers & Graphics 23(4), 1999, 583-598, doi:10.1016/S0097-8493(99)00076-X.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tetsimplify.decimators.method import VOLUME, Goal, Method
from tetsimplify.mesh import Mesh


def prepare(mesh: Mesh, goal: Goal) -> Any:
    """Samples in memory; the mesh, which is the plain surface, is not used."""
    from tetsimplify.io import read_volume

    assert goal.volume is not None
    volume = read_volume(goal.volume["path"])
    return volume._replace(data=np.asarray(volume.data))


def run(prepared: Any, goal: Goal) -> Any:
    """Extract the surface again, and regularise it."""
    from tetsimplify.io import isosurface_of

    assert goal.volume is not None
    level, lattice = goal.volume["level"], goal.volume["lattice"]
    return isosurface_of(prepared, level, lattice=lattice, regularise=True)


METHODS = (
    Method(
        "tetsimplify-regularised",
        "tetsimplify, regularised extraction",
        ("tetsimplify",),
        "MIT",
        run,
        prepare,
        takes=(VOLUME,),
        is_own=True,
    ),
)
