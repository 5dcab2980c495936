"""Topology-preserving simplification of triangle surfaces."""

from tetsimplify.compare import Comparison, compare
from tetsimplify.distance import SurfaceDistance, surface_distance
from tetsimplify.errors import (
    FileError,
    MeshError,
    MissingExtraError,
    OptionError,
    TetsimplifyError,
    VolumeError,
)
from tetsimplify.interfaces import Interfaces, extract_interfaces
from tetsimplify.intersections import IntersectionReport, self_intersections
from tetsimplify.isosurface import Isosurface, extract_isosurface
from tetsimplify.memory import hand_back_memory
from tetsimplify.mesh import Mesh
from tetsimplify.quality import QualityReport, quality
from tetsimplify.repair import repair
from tetsimplify.report import RepairReport, Simplification, SimplificationReport
from tetsimplify.simplify import simplify
from tetsimplify.streaming import SimplifiedIsosurface, extract_and_simplify
from tetsimplify.topology import TopologyReport, topology

__version__ = "0.1.0"

__all__ = [
    "Comparison",
    "FileError",
    "Interfaces",
    "IntersectionReport",
    "Isosurface",
    "Mesh",
    "MeshError",
    "MissingExtraError",
    "OptionError",
    "QualityReport",
    "RepairReport",
    "Simplification",
    "SimplificationReport",
    "SimplifiedIsosurface",
    "SurfaceDistance",
    "TetsimplifyError",
    "TopologyReport",
    "VolumeError",
    "compare",
    "extract_and_simplify",
    "extract_interfaces",
    "extract_isosurface",
    "hand_back_memory",
    "quality",
    "repair",
    "self_intersections",
    "simplify",
    "surface_distance",
    "topology",
]
