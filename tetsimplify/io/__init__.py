"""Files in and out: meshes and voxel volumes.

Each format is one short module here; :data:`~tetsimplify.io.meshes.MESH_FORMATS` and
:data:`~tetsimplify.io.volumes.VOLUME_FORMATS` are the tables of what is known. Packages that
a format needs are imported when a file of that format is met.
"""

from tetsimplify.io.lazy import LazyArray
from tetsimplify.io.meshes import (
    MESH_FORMATS,
    check_target,
    is_mesh_file,
    read_mesh,
    write_mesh,
    write_meshes,
)
from tetsimplify.io.surfaces import isosurface_of
from tetsimplify.io.volume import Volume
from tetsimplify.io.volumes import VOLUME_FORMATS, is_volume_file, read_volume

__all__ = [
    "MESH_FORMATS",
    "VOLUME_FORMATS",
    "LazyArray",
    "Volume",
    "check_target",
    "is_mesh_file",
    "is_volume_file",
    "isosurface_of",
    "read_mesh",
    "read_volume",
    "write_mesh",
    "write_meshes",
]
