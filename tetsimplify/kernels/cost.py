"""What it costs to contract the edges of a face."""

from tetsimplify.kernels.jit import part


@part
def squared_length(vertices, a, b):
    """Squared length of the edge ab."""
    dx = vertices[a, 0] - vertices[b, 0]
    dy = vertices[a, 1] - vertices[b, 1]
    dz = vertices[a, 2] - vertices[b, 2]
    return dx * dx + dy * dy + dz * dz


@part
def edge_costs(vertices, corner_vertex, face):
    """Squared lengths of the edges that begin at the three corners of a face."""
    a = corner_vertex[3 * face]
    b = corner_vertex[3 * face + 1]
    c = corner_vertex[3 * face + 2]
    return (
        squared_length(vertices, a, b),
        squared_length(vertices, b, c),
        squared_length(vertices, c, a),
    )


@part
def cheapest_first(costs):
    """The three edges in the order of their costs."""
    x, y, z = costs
    if x <= y:
        if y <= z:
            return 0, 1, 2
        return (0, 2, 1) if x <= z else (2, 0, 1)
    if x <= z:
        return 1, 0, 2
    return (1, 2, 0) if y <= z else (2, 1, 0)
