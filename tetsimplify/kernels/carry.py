"""Contractions repeated on what vertices carry."""

from tetsimplify.kernels.jit import kernel_in_place


@kernel_in_place
def interpolate(merges, merged_into, rows):
    """Interpolate the rows of merged vertices as their positions were."""
    for i in range(len(merges)):
        u = int(merges[i, 0])
        t = merges[i, 1]
        v = merged_into[u]
        for k in range(rows.shape[1]):
            if t == 1.0:
                rows[v, k] = rows[u, k]
            elif t > 0.0:  # at 0 nothing of u comes in, not even a NaN
                rows[v, k] += t * (rows[u, k] - rows[v, k])


@kernel_in_place
def follow(merges, merged_into, nearest):
    """Find for merged vertices the vertex given that the nearer ends lead back to."""
    for i in range(len(merges)):
        u = int(merges[i, 0])
        if merges[i, 1] > 0.5:
            nearest[merged_into[u]] = nearest[u]
