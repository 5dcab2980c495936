"""TIFF: what the axes are, physical sizes, and files that are read page by page."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from tetsimplify.errors import FileError, OptionError
from tetsimplify.io import LazyArray, read_volume
from tetsimplify.io.volume import affine_of
from volumes import SPACING, assert_holds, samples

tifffile = pytest.importorskip("tifffile")

COMPRESSIONS = [None, "zlib"]


def write_ome(path, data, axes, compression=None, **sizes):
    metadata = {"axes": axes, **{f"PhysicalSize{name}": value for name, value in sizes.items()}}
    tifffile.imwrite(path, data, ome=True, metadata=metadata, compression=compression)
    return path


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("axes", ["TZCYX", "TCZYX", "ZTCYX", "CZTYX"])
def test_ome_channels_and_times(tmp_path, axes, compression):
    data = samples(np.uint16, (3, 7, 2, 6, 5))  # t, z, c, y, x
    stored = data.transpose(["TZCYX".index(axis) for axis in axes])
    path = write_ome(tmp_path / "a.ome.tif", stored, axes, compression)
    with pytest.raises(FileError, match="it has 2 channels, choose one by channel, from 0 to 1"):
        read_volume(path, time=0)
    with pytest.raises(FileError, match="it has 3 times"):
        read_volume(path, channel=1)
    volume = read_volume(path, time=2, channel=1)
    assert isinstance(volume.data, LazyArray) == (compression is not None)
    assert_holds(volume, data[2, :, 1].T, np.eye(4))
    with pytest.raises(OptionError, match="time must be from 0 to 2, got 3"):
        read_volume(path, time=3, channel=1)


def test_ome_units(tmp_path):
    sizes = {"X": 0.5, "XUnit": "µm", "Y": 700, "YUnit": "nm", "Z": 0.003, "ZUnit": "mm"}
    volume = read_volume(write_ome(tmp_path / "a.tif", samples().T, "ZYX", **sizes))
    np.testing.assert_allclose(volume.spacing, SPACING, rtol=1e-15)
    assert volume.unit == "µm"
    assert read_volume(write_ome(tmp_path / "b.tif", samples().T, "ZYX", X=2.0, Y=2.0)).unit == "µm"
    assert read_volume(write_ome(tmp_path / "c.tif", samples().T, "ZYX")).unit is None
    sizes["ZUnit"] = "reference frame"
    with pytest.raises(FileError, match="different units"):
        read_volume(write_ome(tmp_path / "d.tif", samples().T, "ZYX", **sizes))


@pytest.mark.parametrize(("unit", "expected"), [("um", "µm"), ("micron", "µm"), ("\\u00B5m", "µm"),
                                                ("mm", "mm"), ("pixel", None)])  # fmt: skip
def test_imagej_units(tmp_path, unit, expected):
    metadata = {"axes": "ZYX", "unit": unit, "spacing": SPACING[2]}
    tifffile.imwrite(tmp_path / "a.tif", samples().T, imagej=True, metadata=metadata,
                     resolution=(1 / SPACING[0], 1 / SPACING[1]))  # fmt: skip
    volume = read_volume(tmp_path / "a.tif")
    np.testing.assert_allclose(volume.spacing, SPACING, rtol=1e-6)
    assert volume.unit == expected


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("axes", ["TYX", "ZYX"])
def test_times_of_planes_are_planes(tmp_path, axes, compression):
    """Many programs write the planes of a stack as times."""
    path = write_ome(tmp_path / "a.tif", samples(np.uint16).T, axes, compression)
    assert_holds(read_volume(path), samples(np.uint16), np.eye(4))


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_colours(tmp_path, compression):
    data = samples(np.uint8, (7, 6, 5, 3))
    tifffile.imwrite(tmp_path / "a.tif", data, photometric="rgb", compression=compression)
    with pytest.raises(FileError, match="it has 3 channels"):
        read_volume(tmp_path / "a.tif")
    volume = read_volume(tmp_path / "a.tif", channel=1)
    assert_holds(volume, data[..., 1].T, np.eye(4))


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_pages_that_lie_apart(tmp_path, compression):
    """Pages of other programs are not one piece."""
    with tifffile.TiffWriter(tmp_path / "a.tif") as writer:
        for page in samples(np.int16).T:
            writer.write(page, contiguous=False, compression=compression, metadata=None)
    volume = read_volume(tmp_path / "a.tif")
    assert isinstance(volume.data, LazyArray)
    assert_holds(volume, samples(np.int16), np.eye(4))


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_tiles(tmp_path, compression):
    data = samples(np.uint16, (50, 60, 7))
    tifffile.imwrite(tmp_path / "a.tif", data.T, tile=(32, 32), compression=compression)
    assert_holds(read_volume(tmp_path / "a.tif"), data, np.eye(4))


LOSSLESS = ["lzw", "zstd", "packbits", "adobe_deflate", "lzma"]


@pytest.mark.parametrize("compression", LOSSLESS)
@pytest.mark.parametrize("predictor", [False, True])
def test_compressions_without_loss(tmp_path, compression, predictor):
    pytest.importorskip("imagecodecs")
    if predictor and compression == "packbits":
        pytest.skip("has none")
    data = samples(np.uint16, (50, 60, 7))
    options = {"compression": compression, "predictor": predictor}
    tifffile.imwrite(tmp_path / "a.tif", data.T, **options)
    volume = read_volume(tmp_path / "a.tif")
    assert isinstance(volume.data, LazyArray)
    assert_holds(volume, data, np.eye(4))
    (tmp_path / "folder").mkdir()
    for k, plane in enumerate(data.T):
        tifffile.imwrite(tmp_path / "folder" / f"{k}.tif", plane, **options)
    assert_holds(read_volume(tmp_path / "folder"), data, np.eye(4))


@pytest.mark.parametrize("is_folder", [False, True])
def test_a_codec_that_is_missing_is_told_before_any_work(tmp_path, is_folder):
    pytest.importorskip("imagecodecs")
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, samples(np.uint16).T, compression="lzw")
    code = (
        "import sys\n"
        "sys.modules['imagecodecs'] = None\n"
        "from tetsimplify.errors import MissingExtraError\n"
        "from tetsimplify.io import read_volume\n"
        "try:\n    read_volume(sys.argv[1])\n"
        "except MissingExtraError as error:\n    print(error)\n"
    )
    given = tmp_path if is_folder else path
    told = subprocess.run(
        [sys.executable, "-c", code, str(given)], capture_output=True, text=True, check=True
    )
    assert told.stdout.strip() == (
        'reading TIFF with LZW compression needs imagecodecs: pip install "tetsimplify[volumes]"'
    )


def test_several_images(tmp_path):
    with tifffile.TiffWriter(tmp_path / "a.tif") as writer:
        writer.write(samples().T, metadata=None)
        writer.write(samples(shape=(6, 8, 9)), metadata=None)
    with pytest.raises(FileError, match=r"2 images, choose one by its key, from 0 to 1: \(7, 6, 5"):
        read_volume(tmp_path / "a.tif")
    assert_holds(read_volume(tmp_path / "a.tif", key="0"), samples(), np.eye(4))
    assert read_volume(f"{tmp_path / 'a.tif'}:1").data.shape == (9, 8, 6)
    with pytest.raises(FileError, match="from 0 to 1"):
        read_volume(tmp_path / "a.tif", key="2")


def test_each_image_of_ome_has_its_sizes(tmp_path):
    with tifffile.TiffWriter(tmp_path / "a.ome.tif", ome=True) as writer:
        writer.write(samples().T, metadata={"axes": "ZYX", "PhysicalSizeX": 2.0})
        writer.write(samples(shape=(6, 8, 9)), metadata={"axes": "ZYX", "PhysicalSizeX": 3.0})
    assert read_volume(tmp_path / "a.ome.tif", key="1").spacing == (3, 1, 1)


def test_folder_of_planes(tmp_path):
    folder = tmp_path / "planes"
    folder.mkdir()
    data = samples(np.uint16, (5, 6, 12))
    for k in range(12):
        tifffile.imwrite(folder / f"plane_{k}.tif", data[..., k].T, compression="zlib")
    (folder / "notes.txt").write_text("voxels of 2 um")
    volume = read_volume(folder)
    assert isinstance(volume.data, LazyArray)
    assert_holds(volume, data, affine_of())
    tifffile.imwrite(folder / "plane_7.tif", samples(np.uint16, (3, 3)))
    with pytest.raises(FileError, match=r"plane_7\.tif has shape \(3, 3\), others \(6, 5\)"):
        read_volume(folder).data[..., 7]


def test_folder_of_planes_with_colours_or_of_stacks(tmp_path):
    for name, shape in (("colours", (6, 5, 3)), ("stacks", (3, 6, 5))):
        (tmp_path / name).mkdir()
        for k in range(4):
            photometric = "rgb" if name == "colours" else "minisblack"
            tifffile.imwrite(
                tmp_path / name / f"{k}.tif", samples(shape=shape) + k, photometric=photometric
            )
    with pytest.raises(FileError, match="3 channels"):
        read_volume(tmp_path / "colours")
    colours = read_volume(tmp_path / "colours", channel=2).data
    np.testing.assert_array_equal(colours[..., 3], samples(shape=(6, 5, 3))[..., 2].T + 3)
    with pytest.raises(FileError, match="is to be one plane"):
        read_volume(tmp_path / "stacks")


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_axes_that_the_caller_knows(tmp_path, compression):
    """Three planes that were written as if they were colours."""
    options = {"photometric": "rgb", "planarconfig": "separate", "compression": compression}
    tifffile.imwrite(tmp_path / "a.tif", samples(shape=(3, 7, 6)), **options)
    with pytest.raises(FileError, match="axes 'cyx', but a volume has x, y and z"):
        read_volume(tmp_path / "a.tif")
    volume = read_volume(tmp_path / "a.tif", axes="zyx")
    assert_holds(volume, samples(shape=(3, 7, 6)).T, np.eye(4))
    for axes, message in (("zyxc", "are 4, but the array"), ("zy", "axes must be x, y, z"),
                          ("zyxx", "axes must be"), ("zyq", "axes must be")):  # fmt: skip
        with pytest.raises(OptionError, match=message):
            read_volume(tmp_path / "a.tif", axes=axes)


@pytest.mark.parametrize("compression", ["lzw", "jpeg", "zstd"])
def test_compressions_of_other_programs(tmp_path, compression):
    pytest.importorskip("imagecodecs")
    data = np.full((16, 32, 7), 100, np.uint8) + np.arange(7, dtype=np.uint8) * 8
    tifffile.imwrite(tmp_path / "a.tif", data.T, compression=compression)
    np.testing.assert_allclose(read_volume(tmp_path / "a.tif").data, data, atol=1)
