"""Values at the vertices of an isosurface, interpolated along their lattice edges."""

import numpy as np

from tetsimplify.kernels.jit import kernel_in_place, part
from tetsimplify.kernels.marching import WORD


@kernel_in_place
def interpolate(field, first, tables, edges, ratios, values):
    """Interpolate a field linearly between the ends of the lattice edges of vertices.

    Parameters
    ----------
    field : float64 (p, n1, n2)
        Samples of some planes.
    first : int
        The number of the first plane.
    edges, ratios : int64 (n,), float64 (n,)
        See :class:`tetsimplify.kernels.marching.Output`.
    values : float64 (n,), out
    """
    for i in range(edges.size):
        z, y, x, slot = _site(edges[i], first, field.shape)
        a, b = tables.slot_ends[slot]
        from_a = _mean_at(field, z, y, x, a)
        values[i] = from_a + ratios[i] * (_mean_at(field, z, y, x, b) - from_a)


@kernel_in_place
def gradient_normals(samples, first, n_planes, tables, edges, ratios, frame, downwards, normals):
    """Interpolate the directions of the gradient, which are normals of the surface.

    Gradients of samples are central differences, one-sided on the sides of the volume; those of
    centres are gradients of the trilinear interpolation. Where the gradient vanishes, the normal
    is the direction of the lattice edge.

    Parameters
    ----------
    samples : float64 or float32 (p, n1, n2)
        Planes of the volume, one before that of the first vertex where there is one.
    n_planes : int
        Planes of the volume.
    frame : float64 (2, 3)
        Spacing and origin.
    downwards : bool
        Whether normals point to lower values.
    normals : float64 (n, 3), out
        Of unit length.
    """
    sign = -1.0 if downwards else 1.0
    for i in range(edges.size):
        z, y, x, slot = _site(edges[i], first, samples.shape)
        a, b = tables.slot_ends[slot]
        for axis in range(3):
            at_a = _slope(samples, first, n_planes, z, y, x, a, axis)
            at_b = _slope(samples, first, n_planes, z, y, x, b, axis)
            slope = at_a + ratios[i] * (at_b - at_a)
            normals[i, axis] = sign * slope / frame[0, axis]
        if not _make_unit(normals[i]):
            rises = _mean_at(samples, z, y, x, b) > _mean_at(samples, z, y, x, a)
            for axis in range(3):
                step = frame[0, axis] * (tables.points[b, axis] - tables.points[a, axis])
                normals[i, axis] = sign * step if rises else -sign * step
            _make_unit(normals[i])


@part
def _site(edge, first, shape):
    site, slot = edge // WORD, edge % WORD
    row, x = site // shape[2], site % shape[2]
    return row // shape[1] - first, row % shape[1], x, slot


@part
def _mean_at(field, z, y, x, point):
    """The value at a point of a site: a sample, or the mean of the eight around a centre."""
    if point < 8:
        return field[z + (point >> 2), y + (point >> 1 & 1), x + (point & 1)]
    z, y, x = z + (point == 9), y + (point == 10), x + (point == 11)
    total = 0.0
    for corner in range(8):
        total += 0.125 * field[z + (corner >> 2), y + (corner >> 1 & 1), x + (corner & 1)]
    return total


@part
def _slope(samples, first, n_planes, z, y, x, point, axis):
    """The difference of values along an axis at a point of a site, over one cube."""
    if point < 8:
        z, y, x = z + (point >> 2), y + (point >> 1 & 1), x + (point & 1)
        if axis == 0:
            low, high = max(z - 1, -first), min(z + 1, n_planes - 1 - first)
            return _difference(samples[low, y, x], samples[high, y, x], high - low)
        if axis == 1:
            low, high = max(y - 1, 0), min(y + 1, samples.shape[1] - 1)
            return _difference(samples[z, low, x], samples[z, high, x], high - low)
        low, high = max(x - 1, 0), min(x + 1, samples.shape[2] - 1)
        return _difference(samples[z, y, low], samples[z, y, high], high - low)
    z, y, x = z + (point == 9), y + (point == 10), x + (point == 11)
    slope = 0.0
    for corner in range(8):
        value = samples[z + (corner >> 2), y + (corner >> 1 & 1), x + (corner & 1)]
        slope += 0.25 * value if corner >> (2 - axis) & 1 else -0.25 * value
    return slope


@part
def _difference(low, high, n_cubes):
    return high / n_cubes - low / n_cubes


@part
def _make_unit(vector):
    """Scale a vector to unit length; return whether it has a direction."""
    largest = max(abs(vector[0]), abs(vector[1]), abs(vector[2]))
    if not (largest > 0.0 and largest < np.inf):
        return False
    for axis in range(3):
        vector[axis] /= largest
    length = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    for axis in range(3):
        vector[axis] /= length
    return True
