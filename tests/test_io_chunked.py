"""HDF5, Zarr and OME-Zarr."""

from __future__ import annotations

import json
import logging

import numpy as np
import pytest

from tetsimplify.errors import FileError, OptionError
from tetsimplify.io import LazyArray, is_volume_file, isosurface_of, lazy, read_volume
from tetsimplify.io.volume import affine_of
from volumes import ORIGIN, SHAPE, SPACING, assert_holds, ball, samples

# --- HDF5 ----------------------------------------------------------------------------------


@pytest.fixture
def hdf5(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        yield file


def saved(file):
    path = file.filename
    file.close()
    return path


def test_hdf5_with_one_volume(hdf5, tmp_path):
    hdf5["about/table"] = np.ones((4, 2))
    hdf5["raw/ct"] = samples(np.int16)
    volume = read_volume(saved(hdf5))
    assert isinstance(volume.data, LazyArray)
    assert_holds(volume, samples(np.int16), np.eye(4))
    assert volume.unit is None


def test_hdf5_with_size_of_elements(hdf5):
    hdf5["a"] = samples().T
    hdf5["a"].attrs["element_size_um"] = SPACING[::-1]
    volume = read_volume(saved(hdf5))
    assert_holds(volume, samples(), affine_of(SPACING))
    assert (volume.unit, volume.spacing) == ("µm", SPACING)
    assert volume.slowest_first().data.order == (0, 1, 2)


def test_hdf5_with_paths(hdf5):
    hdf5["raw/ct"] = samples(np.int16)
    hdf5["raw/mri"] = samples(np.float32)
    path = saved(hdf5)
    with pytest.raises(FileError, match=r"by its key: /raw/ct \(5, 6, 7\), /raw/mri"):
        read_volume(path)
    for key in ("raw/mri", "/raw/mri"):
        assert read_volume(path, key=key).data.dtype == np.float32
        assert read_volume(f"{path}:{key}").data.dtype == np.float32
        assert is_volume_file(f"{path}:{key}")
    for key in ("raw/pet", "raw"):
        with pytest.raises(FileError, match=rf"no dataset '{key}', only /raw/ct"):
            read_volume(path, key=key)
    with pytest.raises(OptionError, match="two keys"):
        read_volume(f"{path}:raw/ct", key="raw/mri")


def test_hdf5_with_channels_and_times(hdf5):
    data = samples(np.int32, (2, 7, 6, 5, 3))
    hdf5["labelled"] = data
    for dimension, label in zip(hdf5["labelled"].dims, "tzyxc", strict=True):
        dimension.label = label
    hdf5["tagged"] = data
    tags = {"axes": [{"key": key, "typeFlags": 2, "resolution": 0} for key in "tzyxc"]}
    hdf5["tagged"].attrs["axistags"] = json.dumps(tags)
    hdf5["plain"] = data
    path = saved(hdf5)
    for key, axes in (("labelled", None), ("tagged", None), ("plain", "tzyxc")):
        with pytest.raises(FileError, match="it has 3 channels, choose one by channel"):
            read_volume(path, key=key, axes=axes, time=0)
        volume = read_volume(path, key=key, axes=axes, time=1, channel=2)
        assert_holds(volume, data[1, ..., 2].T, np.eye(4))
        with pytest.raises(OptionError, match="channel must be from 0 to 2, got -1"):
            read_volume(path, key=key, axes=axes, time=1, channel=-1)
    with pytest.raises(FileError, match="tell what they are, such as axes='tzyx'"):
        read_volume(path, key="plain")


def test_hdf5_chunks_are_read_once(tmp_path, monkeypatch):
    """Slabs follow the chunks, however the planes are asked for."""
    h5py = pytest.importorskip("h5py")
    monkeypatch.setattr(lazy, "SLAB_BYTES", 1)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("a", data=samples(shape=(20, 8, 8)), chunks=(6, 4, 4))
    data = read_volume(tmp_path / "a.h5").data
    slabs, read = [], data._slabs._read
    data._slabs._read = lambda *ends: slabs.append(ends) or read(*ends)
    for plane in range(20):
        np.testing.assert_array_equal(data[plane], samples(shape=(20, 8, 8))[plane])
    assert slabs == [(0, 6), (6, 12), (12, 18), (18, 20)]


def test_hdf5_that_is_no_volume(hdf5):
    hdf5["text"] = np.array([[[b"a"]]])
    hdf5["complex"] = samples(complex)
    hdf5["compound"] = np.zeros(SHAPE, [("r", "u1"), ("g", "u1")])
    hdf5["size"] = samples()
    hdf5["size"].attrs["element_size_um"] = (1.0, 2.0)
    hdf5["zero"] = samples()
    hdf5["zero"].attrs["element_size_um"] = (0.0, 1.0, 1.0)
    hdf5["flat"] = samples(shape=(6, 7))
    path = saved(hdf5)
    for key, message in (("text", "real numbers"), ("complex", "complex128"), ("compound", "real"),
                         ("size", "three numbers"), ("zero", "cannot be inverted"),
                         ("flat", "three axes")):  # fmt: skip
        with pytest.raises(FileError, match=message):
            read_volume(path, key=key)


def test_hdf5_without_a_volume(hdf5):
    hdf5["flat"] = samples(shape=(6, 7))
    with pytest.raises(FileError, match=r"holds no volume, but /flat \(6, 7\)"):
        read_volume(saved(hdf5))


# --- Zarr ----------------------------------------------------------------------------------


@pytest.fixture(params=[2, 3])
def version(request):
    pytest.importorskip("zarr")
    return request.param


def write_array(group, name, data, chunks=None, **more):
    array = group.create_array(
        name, shape=data.shape, dtype=data.dtype, chunks=chunks or (2,) * data.ndim, **more
    )
    array[...] = data
    return array


def axis(name):
    kind = {"c": "channel", "t": "time"}.get(name, "space")
    return {"name": name, "type": kind, **({"unit": "micrometer"} if kind == "space" else {})}


def write_image(path, version, data, axes, scale, translation, extra=(), factor=2):
    """Write an image of two levels by OME-Zarr 0.4 (Zarr 2) or 0.5 (Zarr 3)."""
    import zarr

    group = zarr.open_group(path, mode="w", zarr_format=version)
    datasets = []
    for level, step in enumerate((1, factor)):
        every = tuple(slice(None, None, step if name in "xyz" else 1) for name in axes)
        write_array(group, f"s{level}", data[every])
        factors = [step if name in "xyz" else 1 for name in axes]
        transforms = [
            {"type": "scale", "scale": [a * b for a, b in zip(scale, factors, strict=True)]},
            {"type": "translation", "translation": list(translation)},
        ]
        datasets.append({"path": f"s{level}", "coordinateTransformations": transforms})
    image = {"axes": [axis(name) for name in axes], "datasets": datasets}
    if extra:
        image["coordinateTransformations"] = list(extra)
    if version == 2:
        group.attrs["multiscales"] = [{"version": "0.4", **image}]
    else:
        group.attrs["ome"] = {"version": "0.5", "multiscales": [image]}
    return group


def test_zarr_array(tmp_path, version):
    import zarr

    array = zarr.create_array(
        tmp_path / "a.zarr", shape=SHAPE, dtype="int16", chunks=(2, 3, 4), zarr_format=version
    )
    array[...] = samples(np.int16)
    volume = read_volume(tmp_path / "a.zarr")
    assert isinstance(volume.data, LazyArray)
    assert_holds(volume, samples(np.int16), np.eye(4))
    assert_holds(read_volume(tmp_path / "a.zarr", axes="zyx"), samples(np.int16).T, np.eye(4))
    with pytest.raises(FileError, match="a single array, so there is no '0'"):
        read_volume(f"{tmp_path / 'a.zarr'}:0")
    (tmp_path / "a.zarr").rename(tmp_path / "other")
    assert_holds(read_volume(tmp_path / "other"), samples(np.int16), np.eye(4))


def test_zarr_names_of_axes(tmp_path, version):
    import zarr

    group = zarr.open_group(tmp_path / "a.zarr", mode="w", zarr_format=version)
    if version == 3:
        write_array(group, "a", samples().T, dimension_names=("z", "y", "x"))
    else:
        write_array(group, "a", samples().T).attrs["_ARRAY_DIMENSIONS"] = ["z", "y", "x"]
    assert_holds(read_volume(tmp_path / "a.zarr"), samples(), np.eye(4))


def test_ome_zarr_levels(tmp_path, version):
    data = samples(np.uint16, (8, 10, 12))
    path = tmp_path / "a.zarr"
    write_image(path, version, data.T, "zyx", SPACING[::-1], ORIGIN[::-1])
    for key in (None, "0", "s0"):
        volume = read_volume(path, key=key)
        assert_holds(volume, data, affine_of(SPACING, ORIGIN))
        assert (volume.unit, volume.spacing, volume.origin) == ("µm", SPACING, ORIGIN)
    for name in (f"{path}:1", f"{path}:s1"):
        doubled = affine_of(np.multiply(SPACING, 2), ORIGIN)
        assert_holds(read_volume(name), data[::2, ::2, ::2], doubled)
    with pytest.raises(FileError, match="no level 2, only 0 to 1"):
        read_volume(path, key="2")
    with pytest.raises(FileError, match="there is no 'x' in it, only s0, s1"):
        read_volume(path, key="x")


def test_ome_zarr_transforms_follow_each_other(tmp_path, version):
    extra = [
        {"type": "scale", "scale": [10.0, 10.0, 100.0]},
        {"type": "translation", "translation": [1.0, 2.0, 3.0]},
    ]
    write_image(tmp_path / "a.zarr", version, samples().T, "zyx", (3, 2, 1), (1, 1, 1), extra)
    expected = affine_of((100, 20, 30), (103, 12, 11))
    assert_holds(read_volume(tmp_path / "a.zarr"), samples(), expected)


def test_ome_zarr_channels_and_times(tmp_path, version):
    data = samples(np.uint16, (2, 3, 7, 6, 5))
    scale, shift = (0.1, 1.0, *SPACING[::-1]), (0.0, 0.0, *ORIGIN[::-1])
    write_image(tmp_path / "a.zarr", version, data, "tczyx", scale, shift)
    with pytest.raises(FileError, match="it has 3 channels"):
        read_volume(tmp_path / "a.zarr", time=1)
    volume = read_volume(tmp_path / "a.zarr", time=1, channel=2)
    assert_holds(volume, data[1, 2].T, affine_of(SPACING, ORIGIN))


def test_ome_zarr_units(tmp_path, version):
    group = write_image(tmp_path / "a.zarr", version, samples().T, "zyx", (2000, 1, 0.5), (0, 0, 7))
    attributes = group.attrs.asdict()
    axes = attributes.get("ome", attributes)["multiscales"][0]["axes"]
    axes[0]["unit"], axes[1]["unit"] = "nanometer", "millimeter"
    group.attrs.update(attributes)
    volume = read_volume(tmp_path / "a.zarr")
    assert (volume.spacing, volume.unit) == ((0.5, 1000, 2), "µm")
    axes[0]["unit"] = "cubit"
    group.attrs.update(attributes)
    with pytest.raises(FileError, match="different units, of which 'cubit' is not known"):
        read_volume(tmp_path / "a.zarr")


def test_ome_zarr_in_a_collection(tmp_path, version):
    """As bioformats2raw writes: images 0, 1 in a group; labels in a group of an image."""
    import zarr

    path = tmp_path / "a.zarr"
    zarr.open_group(path, mode="w", zarr_format=version)
    write_image(path / "0", version, samples().T, "zyx", (1, 1, 1), (0, 0, 0))
    assert_holds(read_volume(path), samples(), np.eye(4))
    write_image(path / "1", version, samples(np.int16).T, "zyx", (1, 1, 1), (0, 0, 0))
    with pytest.raises(FileError, match="choose a part of it by its key: 0, 1"):
        read_volume(path)
    assert read_volume(f"{path}:1").data.dtype == np.int16
    assert read_volume(f"{path}:1/s1").data.shape == (3, 3, 4)
    zarr.open_group(path / "1" / "labels", mode="w", zarr_format=version)
    write_image(path / "1" / "labels" / "cells", version, samples(np.int32).T, "zyx",
                (1, 1, 1), (0, 0, 0))  # fmt: skip
    assert read_volume(f"{path}:1/labels/cells/1").data.dtype == np.int32


def test_ome_zarr_of_an_unknown_transform(tmp_path, version):
    extra = [{"type": "rotation", "rotation": [0, 1, 2]}]
    write_image(tmp_path / "a.zarr", version, samples().T, "zyx", (1, 1, 1), (0, 0, 0), extra)
    with pytest.raises(FileError, match="unknown type 'rotation'"):
        read_volume(tmp_path / "a.zarr")


def test_surface_of_ome_zarr_is_in_the_world(tmp_path, version):
    """The same surface from z, y, x in a file as from x, y, z in memory."""
    from tetsimplify.io import Volume

    write_image(tmp_path / "a.zarr", version, ball().T, "zyx", SPACING[::-1], ORIGIN[::-1])
    mesh = isosurface_of(read_volume(tmp_path / "a.zarr"), 0.0)
    in_memory = Volume(ball().copy(order="F"), affine_of(SPACING, ORIGIN))
    expected = isosurface_of(in_memory, 0.0)
    assert mesh.vertices.tobytes() == expected.vertices.tobytes()
    assert mesh.faces.tobytes() == expected.faces.tobytes()


def test_zarr_that_is_broken(tmp_path, version):
    group = write_image(tmp_path / "a.zarr", version, samples().T, "zyx", (1, 1, 1), (0, 0, 0))
    names = {".zattrs", ".zarray", "zarr.json"}
    files = (tmp_path / "a.zarr" / "s0").rglob("*")
    chunk = next(file for file in files if file.is_file() and file.name not in names)
    chunk.write_bytes(b"no chunk at all")
    with pytest.raises(FileError, match="cannot read"):
        np.asarray(read_volume(tmp_path / "a.zarr").data)
    del group["s0"]
    with pytest.raises(FileError, match="cannot read"):
        read_volume(tmp_path / "a.zarr")
    (tmp_path / "b.zarr").mkdir()
    with pytest.raises(FileError, match="cannot read"):
        read_volume(tmp_path / "b.zarr")


def test_zarr_is_quiet(tmp_path, version, caplog):
    write_image(tmp_path / "a.zarr", version, samples().T, "zyx", (1, 1, 1), (0, 0, 0))
    with caplog.at_level(logging.INFO, logger="tetsimplify.io"):
        read_volume(tmp_path / "a.zarr")
    assert not caplog.text
