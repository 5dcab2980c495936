"""Lengths."""

from tetsimplify.kernels.jit import part


@part
def squared_length(vertices, a, b):
    """Squared length of the edge ab."""
    dx = vertices[a, 0] - vertices[b, 0]
    dy = vertices[a, 1] - vertices[b, 1]
    dz = vertices[a, 2] - vertices[b, 2]
    return dx * dx + dy * dy + dz * dz
