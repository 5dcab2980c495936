"""Small volumes that tell a wrong axis, a mirror image or a wrong place at once."""

from __future__ import annotations

import numpy as np

SHAPE = (5, 6, 7)
SPACING = (0.5, 0.7, 3.0)
ORIGIN = (-10.0, 20.0, 1.5)
ROTATION = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])


def samples(dtype=np.uint8, shape=SHAPE):
    """A different number in every sample, as far as the type allows."""
    return np.arange(np.prod(shape)).reshape(shape).astype(dtype)


def ball(shape=(20, 22, 24), radius=7.0):
    """A ball, large inside, off the centre so that no mirror image is the same."""
    x, y, z = np.indices(shape) - np.array([9.0, 10.0, 11.0]).reshape(3, 1, 1, 1)
    return radius - np.sqrt(x**2 + 1.2 * y**2 + 1.5 * z**2)


def signed_volume(mesh):
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def assert_holds(volume, data, affine):
    np.testing.assert_array_equal(volume.data, data)
    assert volume.data.dtype == data.dtype
    assert volume.affine.dtype == np.float64
    np.testing.assert_allclose(volume.affine, affine, rtol=1e-7, atol=1e-12)
