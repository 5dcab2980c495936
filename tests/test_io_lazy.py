"""Volumes that stay in their file: slices are those of the whole, and memory stays small."""

from __future__ import annotations

import gc
import logging
import subprocess
import sys
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tetsimplify.errors import FileError
from tetsimplify.io import LazyArray, Volume, isosurface_of, lazy, read_volume
from tetsimplify.io.volume import affine_of
from volumes import ORIGIN, ROTATION, SPACING, ball, samples

HERE = Path(__file__)  # any file that is there


def lazy_array(array, *, path=HERE, chunk_depth=1, close=None):
    """An array behind a LazyArray, and the list of what was read of it."""
    reads = []

    def read(begin, end):
        reads.append((begin, end))
        return array[begin:end]

    return LazyArray(read, array.shape, array.dtype, path, chunk_depth, close), reads


def indices(n):
    ends = st.none() | st.integers(-n - 2, n + 2)
    steps = st.none() | st.integers(-3, 3).filter(bool)
    return st.integers(-n, n - 1) | st.builds(slice, ends, ends, steps)


@settings(max_examples=300, deadline=None)
@given(
    order=st.sampled_from(list(permutations(range(3)))),
    key=st.tuples(*[indices(n) for n in (5, 5, 5)]),
    depth=st.integers(1, 7),
    n_keys=st.integers(0, 3),
)
@example(order=(0, 1, 2), key=(0, slice(-6, None, -1), 0), depth=1, n_keys=2)
def test_slices_are_those_of_the_array(order, key, depth, n_keys):
    array = samples(np.int16, (5, 5, 5))
    volume, _ = lazy_array(array, chunk_depth=depth)
    key = key[:n_keys]
    expected = array.transpose(order)[key]
    taken = volume.transpose(order)[key]
    assert taken.shape == expected.shape
    assert taken.dtype == expected.dtype
    np.testing.assert_array_equal(taken, expected)


def test_what_arrays_have():
    array = samples()
    volume, reads = lazy_array(array)
    assert (volume.shape, volume.ndim, len(volume)) == (array.shape, 3, 5)
    assert (volume.T.shape, volume.T.order) == (array.T.shape, (2, 1, 0))
    assert "shape=(5, 6, 7), dtype=uint8" in repr(volume)
    assert not reads
    np.testing.assert_array_equal(volume[..., 2], array[..., 2])
    np.testing.assert_array_equal(volume[1, ..., 2], array[1, :, 2])
    assert volume[1, 2, 3] == array[1, 2, 3]
    assert np.asarray(volume, np.float32).dtype == np.float32
    np.testing.assert_array_equal(np.asarray(volume.T), array.T)
    for wrong in ((0, 0, 0, 0), 5, (0, 6)):
        with pytest.raises(IndexError):
            volume[wrong]
    with pytest.raises(ValueError, match="without a copy"):
        np.asarray(volume, copy=False)


def test_what_is_taken_can_be_written_to():
    volume, _ = lazy_array(samples())
    volume[0:2][:] = 99
    np.testing.assert_array_equal(volume[0:2], samples()[0:2])


def test_planes_in_order_are_read_once(monkeypatch):
    monkeypatch.setattr(lazy, "SLAB_BYTES", 4 * 42)
    volume, reads = lazy_array(samples(np.uint8, (11, 6, 7)))
    for begin in range(0, 11, 3):
        volume[begin : begin + 3]
    assert reads == [(0, 4), (4, 8), (8, 11)]


def test_chunks_are_read_whole_unless_too_large(monkeypatch):
    monkeypatch.setattr(lazy, "SLAB_BYTES", 42)
    volume, reads = lazy_array(samples(np.uint8, (11, 6, 7)), chunk_depth=5)
    for plane in range(11):
        volume[plane]
    assert reads == [(0, 5), (5, 10), (10, 11)]
    monkeypatch.setattr(lazy, "MAX_SLAB_BYTES", 2 * 42)
    volume, reads = lazy_array(samples(np.uint8, (5, 6, 7)), chunk_depth=5)
    volume[:]
    assert reads == [(0, 2), (2, 4), (4, 5)]


def test_errors_name_the_file(tmp_path):
    def fail(begin, end):
        raise RuntimeError("broken plane")

    (tmp_path / "a.raw").write_bytes(b"")
    volume = LazyArray(fail, (4, 5, 6), np.uint8, tmp_path / "a.raw")
    with pytest.raises(FileError, match=r"cannot read .*a\.raw: broken plane"):
        volume[0]
    short = LazyArray(lambda begin, end: np.zeros((1, 5, 6)), (4, 5, 6), "u1", tmp_path / "a.raw")
    with pytest.raises(FileError, match="planes 0 to 3 have shape"):
        short[0]
    (tmp_path / "a.raw").unlink()
    with pytest.raises(FileError, match="there is no file"):
        volume[0]


def test_closed_when_no_view_is_left():
    closed = []
    volume, _ = lazy_array(samples(), close=lambda: closed.append(True))
    view = volume.T
    del volume
    gc.collect()
    assert not closed
    del view
    gc.collect()
    assert closed == [True]


def test_threads_share_a_volume(monkeypatch):
    monkeypatch.setattr(lazy, "SLAB_BYTES", 1)
    array = samples(np.int32, (40, 6, 7))
    volume, _ = lazy_array(array)
    with ThreadPoolExecutor(8) as pool:
        planes = list(pool.map(lambda k: volume[k], [*range(40)] * 5))
    np.testing.assert_array_equal(planes, np.concatenate([array] * 5))


# --- volumes -------------------------------------------------------------------------------


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_slowest_first_is_the_same_volume(order):
    affine = affine_of(SPACING, ORIGIN, ROTATION)
    array = samples()
    volume, _ = lazy_array(array)
    columns = [*order, 3]
    for data in (volume.transpose(order), array.transpose(order)):
        sorted_volume = Volume(data, affine[:, columns], "mm").slowest_first()
        np.testing.assert_array_equal(sorted_volume.data, array)
        np.testing.assert_array_equal(sorted_volume.affine, affine)
        assert sorted_volume.unit == "mm"


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
@pytest.mark.parametrize("mirror", [1, -1])
def test_surface_is_the_same_bytes_as_in_memory(monkeypatch, order, mirror):
    monkeypatch.setattr(lazy, "SLAB_BYTES", 3 * 8 * 22 * 24)
    affine = affine_of(SPACING, ORIGIN, ROTATION * [1, mirror, 1])
    volume, _ = lazy_array(ball())
    from_file = isosurface_of(Volume(volume.transpose(order), affine), 0.0)
    in_memory = isosurface_of(Volume(ball().transpose(order), affine), 0.0)
    assert from_file.vertices.tobytes() == in_memory.vertices.tobytes()
    assert from_file.faces.tobytes() == in_memory.faces.tobytes()
    assert len(from_file.faces) > 500


def test_value_range_leaves_nan_out(monkeypatch):
    monkeypatch.setattr("tetsimplify.io.volume.SLAB_BYTES", 8 * 42)
    array = samples(np.float64)
    array[0] = np.nan
    array[2, 3, 4] = -7.5
    volume, _ = lazy_array(array)
    for data in (array, volume, volume.T):
        assert Volume(data, np.eye(4)).value_range() == (-7.5, 209)


# --- files ---------------------------------------------------------------------------------


def write_nifti(path, array):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(array, np.eye(4))
    image.header.set_slope_inter(0.5, 1)
    image.to_filename(path)
    return array * 0.5 + 1


def write_metaimage(path, array):
    sitk = pytest.importorskip("SimpleITK")
    sitk.WriteImage(sitk.GetImageFromArray(array.T), str(path))
    return array


def write_tiff(path, array):
    pytest.importorskip("tifffile").imwrite(path, array.T, compression="zlib", metadata=None)
    return array


def write_hdf5(path, array):
    with pytest.importorskip("h5py").File(path, "w") as file:
        file.create_dataset("a", data=array.T, chunks=(8, 32, 32), compression="gzip")
        file["a"].attrs["element_size_um"] = [1, 1, 1]
    return array


def write_zarr(path, array):
    store = pytest.importorskip("zarr").create_array(
        path, shape=array.T.shape, dtype=array.dtype, chunks=(8, 32, 32), dimension_names="zyx"
    )
    store[:] = array.T
    return array


def write_vti(path, array):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=array.shape)
    image.point_data["a"] = array.reshape(-1, order="F")
    image.save(path)
    return array


WRITERS = {
    "a.nii": write_nifti,
    "a.mha": write_metaimage,
    "a.tif": write_tiff,
    "a.h5": write_hdf5,
    "a.zarr": write_zarr,
    "a.vti": write_vti,
}


@pytest.mark.parametrize(("name", "write"), WRITERS.items())
def test_slabs_take_little_memory(tmp_path, monkeypatch, name, write):
    """Half a megabyte at once of a volume of 6 MB, in the order of the file."""
    monkeypatch.setattr(lazy, "SLAB_BYTES", 2**18)
    array = samples(np.int16, (96, 128, 256))
    expected = write(tmp_path / name, array)
    read_volume(tmp_path / name).slowest_first().data[:1]  # whatever is loaded with the package
    tracemalloc.start()
    data = read_volume(tmp_path / name).slowest_first().data
    assert isinstance(data, LazyArray)
    sums = [int(data[z : z + 8].astype(np.int64).sum()) for z in range(0, 256, 8)]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert sum(sums) == int(expected.astype(np.int64).sum())
    assert peak < array.nbytes / 2
    np.testing.assert_array_equal(data.T[40:42, 3:5], expected[40:42, 3:5])


@pytest.mark.parametrize("name", ["a.nii.gz", "a.mha", "a.nrrd"])
def test_what_is_read_whole_is_told(tmp_path, caplog, name):
    path = tmp_path / name
    if name == "a.nrrd":
        pytest.importorskip("nrrd").write(str(path), samples())
    elif name == "a.mha":
        sitk = pytest.importorskip("SimpleITK")
        sitk.WriteImage(sitk.GetImageFromArray(samples().T), str(path), useCompression=True)
    else:
        nibabel = pytest.importorskip("nibabel")
        nibabel.save(nibabel.Nifti1Image(samples(), np.eye(4)), path)
    with caplog.at_level(logging.INFO, logger="tetsimplify.io"):
        volume = read_volume(path)
    np.testing.assert_array_equal(volume.data, samples())
    assert f"{name} cannot be read in parts" in caplog.text


@pytest.mark.parametrize("mapped", ["a.npy", "a.nii", "a.nrrd", "a.nhdr", "a.tif"])
def test_what_is_mapped(tmp_path, caplog, mapped):
    path, array = tmp_path / mapped, np.asfortranarray(samples(np.int16))
    if mapped == "a.npy":
        np.save(path, array)
    elif mapped == "a.nii":
        nibabel = pytest.importorskip("nibabel")
        nibabel.save(nibabel.Nifti1Image(array, np.eye(4)), path)
    elif mapped == "a.tif":
        pytest.importorskip("tifffile").imwrite(path, array.T)
    else:
        nrrd = pytest.importorskip("nrrd")
        nrrd.write(str(path), array, {"encoding": "raw"})
    with caplog.at_level(logging.INFO, logger="tetsimplify.io"):
        volume = read_volume(path)
    assert isinstance(volume.data, np.memmap)
    np.testing.assert_array_equal(volume.data, array)
    assert not caplog.text
    assert volume.slowest_first().data.flags.c_contiguous


CUT_OFF = ["a.npy", "a.nii", "a.nii.gz", "a.nrrd", "a.mha", "a.tif", "z.tif", "a.h5", "a.vti"]


@pytest.mark.parametrize("name", CUT_OFF)
def test_truncated_files(tmp_path, name):
    path, array = tmp_path / name, np.random.default_rng(5).integers(0, 255, (40, 36, 32), np.uint8)
    if name == "a.npy":
        np.save(path, array)
    elif name.startswith("a.nii"):
        nibabel = pytest.importorskip("nibabel")
        nibabel.save(nibabel.Nifti1Image(array, np.eye(4)), path)
    elif name == "a.nrrd":
        pytest.importorskip("nrrd").write(str(path), array, {"encoding": "raw"})
    elif name == "a.tif":
        pytest.importorskip("tifffile").imwrite(path, array.T)
    else:
        WRITERS[name.replace("z.", "a.")](path, array)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    with pytest.raises(FileError, match="cannot read"):
        np.asarray(read_volume(path).data)


# --- more than memory ----------------------------------------------------------------------

EXTRACT_IN_LITTLE_MEMORY = """
import resource, sys
import numpy as np
resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]), int(sys.argv[2])))
from tetsimplify.io import isosurface_of, read_volume
volume = read_volume(sys.argv[1])
mesh = isosurface_of(volume, 0.5)
np.savez(sys.argv[3], *mesh)
try:
    np.asarray(volume.data)
except MemoryError:
    print("all of it would not fit")
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of the address space")
def test_volume_of_four_times_the_memory(tmp_path):
    """A ball at each end of an OME-Zarr array of 6 GiB, in a process that may have 1.5 GiB."""
    zarr = pytest.importorskip("zarr")
    limit, n = 3 * 2**29, (2544, 1600, 1600)
    assert np.prod(n) > 4 * limit
    part = (100 * ball((48, 48, 48))).clip(0, 100).astype(np.uint8)
    store = zarr.create_array(
        tmp_path / "a.zarr", shape=n, dtype="uint8", chunks=(48, 160, 160), dimension_names="zyx"
    )
    store[:48, :48, :48] = part.T
    store[2496:, :48, :48] = part.T
    command = [sys.executable, "-c", EXTRACT_IN_LITTLE_MEMORY]
    arguments = [tmp_path / "a.zarr", limit, tmp_path / "mesh.npz"]
    options = {"capture_output": True, "text": True, "check": True}
    assert "would not fit" in subprocess.run([*command, *map(str, arguments)], **options).stdout

    expected = isosurface_of(Volume(np.asfortranarray(part), np.eye(4)), 0.5)
    with np.load(tmp_path / "mesh.npz") as arrays:
        vertices, faces = arrays["arr_0"], arrays["arr_1"]
    n_vertices, n_faces = len(expected.vertices), len(expected.faces)
    assert (len(vertices), len(faces)) == (2 * n_vertices, 2 * n_faces)
    assert vertices[:n_vertices].tobytes() == expected.vertices.tobytes()
    assert faces[:n_faces].tobytes() == expected.faces.tobytes()
    np.testing.assert_array_equal(faces[n_faces:], expected.faces + n_vertices)
    np.testing.assert_allclose(vertices[n_vertices:], expected.vertices + [0, 0, 2496], rtol=1e-12)
