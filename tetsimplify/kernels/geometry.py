"""Edges as vectors, and their lengths."""

from tetsimplify.kernels.jit import part


@part
def edge_vector(vertices, a, b):
    """The edge from a to b."""
    return (
        vertices[b, 0] - vertices[a, 0],
        vertices[b, 1] - vertices[a, 1],
        vertices[b, 2] - vertices[a, 2],
    )


@part
def squared_length(vertices, a, b):
    """Squared length of the edge ab."""
    dx = vertices[a, 0] - vertices[b, 0]
    dy = vertices[a, 1] - vertices[b, 1]
    dz = vertices[a, 2] - vertices[b, 2]
    return dx * dx + dy * dy + dz * dz
