"""Edges as vectors, their lengths, and products of vectors."""

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


@part
def dot(a, b):
    """The product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def cross(a, b):
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part
def twice_area(vertices, a, b, c):
    """The normal of a face, as long as twice its area."""
    return cross(edge_vector(vertices, a, b), edge_vector(vertices, a, c))
