"""Volumes out of files, and surfaces out of volumes."""

from __future__ import annotations

import builtins

import numpy as np
import pytest

from data import data_dir, needs_data
from tetsimplify.errors import FileError, MissingExtraError, OptionError, VolumeError
from tetsimplify.io import LazyArray, Volume, isosurface_of, read_volume
from tetsimplify.io.volume import affine_of
from volumes import ORIGIN, ROTATION, SHAPE, SPACING, assert_holds, ball, samples, signed_volume


def without_package(monkeypatch, package):
    imported = builtins.__import__

    def no_such_package(name, *rest, **more):
        if name.partition(".")[0] == package:
            raise ModuleNotFoundError(name)
        return imported(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", no_such_package)


# --- arrays of NumPy -----------------------------------------------------------------------


def test_npy_is_mapped(tmp_path):
    np.save(tmp_path / "a.npy", samples(np.int16))
    volume = read_volume(tmp_path / "a.npy")
    assert isinstance(volume.data, np.memmap)
    assert_holds(volume, samples(np.int16), np.eye(4))
    assert (volume.spacing, volume.origin) == ((1, 1, 1), (0, 0, 0))


def test_npz_with_spacing_and_origin(tmp_path):
    np.savez(tmp_path / "a.npz", data=samples(), spacing=SPACING, origin=ORIGIN, unit="mm")
    volume = read_volume(tmp_path / "a.npz")
    assert_holds(volume, samples(), affine_of(SPACING, ORIGIN))
    assert (volume.spacing, volume.origin) == (SPACING, ORIGIN)


def test_npz_with_one_array_and_with_keys(tmp_path):
    np.savez(tmp_path / "one.npz", mri=samples(), spacing=SPACING)
    assert_holds(read_volume(tmp_path / "one.npz"), samples(), affine_of(SPACING))
    np.savez(tmp_path / "two.npz", ct=samples(), mri=samples(np.float32))
    with pytest.raises(FileError, match="choose one by its key: ct, mri"):
        read_volume(tmp_path / "two.npz")
    with pytest.raises(FileError, match="no array 'pet', only ct, mri"):
        read_volume(tmp_path / "two.npz", key="pet")
    assert_holds(read_volume(tmp_path / "two.npz", key="mri"), samples(np.float32), np.eye(4))


@needs_data
def test_npz_of_the_data_folder():
    volume = read_volume(data_dir() / "volumes" / "frog_tissue_labels.npz")
    assert volume.data.shape == (136, 470, 500)
    assert volume.spacing == (1.5, 1.0, 1.0)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"data": samples(shape=(3, 4))}, r"shape \(3, 4\)"),
        ({"data": samples(shape=(3, 4, 5, 6))}, r"shape \(3, 4, 5, 6\)"),
        ({"data": samples(complex)}, "complex128"),
        ({"data": np.array([[["a"]]])}, "real numbers"),
        ({"data": samples(), "spacing": [1, 2]}, "'spacing' must hold three numbers"),
        ({"data": samples(), "spacing": [1, 0, 2]}, "cannot be inverted"),
        ({"data": samples(), "origin": [1, np.nan, 2]}, "cannot be inverted"),
        ({"data": np.array([{}], object)}, "allow_pickle"),
    ],
)
def test_npz_that_is_no_volume(tmp_path, arrays, message):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(FileError, match=message):
        read_volume(tmp_path / "a.npz")


def test_single_last_axes_are_dropped(tmp_path):
    np.save(tmp_path / "a.npy", samples()[..., None, None])
    assert read_volume(tmp_path / "a.npy").data.shape == SHAPE


# --- medical formats -----------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("mirror", [1, -1])
def test_nifti_has_the_transform_of_nibabel(tmp_path, suffix, mirror):
    nibabel = pytest.importorskip("nibabel")
    affine = affine_of(SPACING, ORIGIN, ROTATION * [mirror, 1, 1])
    nibabel.save(nibabel.Nifti1Image(ball().astype(np.float32), affine), tmp_path / f"a{suffix}")
    volume = read_volume(tmp_path / f"a{suffix}")
    assert_holds(volume, ball().astype(np.float32), affine)
    assert isinstance(volume.data, np.memmap) == (suffix == ".nii")
    assert volume.spacing is None

    mesh = isosurface_of(volume, 0.0)
    image = nibabel.load(tmp_path / f"a{suffix}")
    index = nibabel.affines.apply_affine(np.linalg.inv(image.affine), mesh.vertices)
    x, y, z = (index - [9, 10, 11]).T
    np.testing.assert_allclose(np.sqrt(x**2 + 1.2 * y**2 + 1.5 * z**2), 7, atol=0.1)
    assert signed_volume(mesh) > 0


def test_nifti_scales_its_values(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(samples(np.int16), np.eye(4))
    image.header.set_slope_inter(0.5, 3)
    image.to_filename(tmp_path / "a.nii")
    volume = read_volume(tmp_path / "a.nii")
    np.testing.assert_array_equal(volume.data, nibabel.load(tmp_path / "a.nii").get_fdata())


def test_nifti_with_times(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    for n_times in (1, 3):
        data = samples(np.int32)[..., None] + np.arange(1 - n_times, 1, dtype=np.int32)
        nibabel.save(nibabel.Nifti1Image(data, np.eye(4)), tmp_path / f"{n_times}.nii")
    assert read_volume(tmp_path / "1.nii").data.shape == SHAPE
    with pytest.raises(FileError, match="it has 3 times, choose one by time, from 0 to 2"):
        read_volume(tmp_path / "3.nii")
    assert_holds(read_volume(tmp_path / "3.nii", time=2), samples(np.int32), np.eye(4))


@pytest.mark.parametrize("suffix", [".nrrd", ".nhdr"])
def test_nrrd_with_directions(tmp_path, suffix):
    nrrd = pytest.importorskip("nrrd")
    header = {
        "space": "left-posterior-superior",
        "space directions": (ROTATION * SPACING).T,
        "space origin": ORIGIN,
    }
    nrrd.write(str(tmp_path / f"a{suffix}"), samples(np.int16), header)
    expected = affine_of(SPACING, ORIGIN, ROTATION)
    assert_holds(read_volume(tmp_path / f"a{suffix}"), samples(np.int16), expected)


def test_nrrd_with_spacings_only_or_nothing(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    nrrd.write(str(tmp_path / "a.nrrd"), samples(), {"spacings": SPACING})
    assert read_volume(tmp_path / "a.nrrd").spacing == SPACING
    nrrd.write(str(tmp_path / "b.nrrd"), samples(), {"spacings": [1.0, np.nan, 2.0]})
    assert read_volume(tmp_path / "b.nrrd").spacing == (1, 1, 2)
    nrrd.write(str(tmp_path / "c.nrrd"), samples())
    assert_holds(read_volume(tmp_path / "c.nrrd"), samples(), np.eye(4))


def test_nrrd_with_components(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    directions = np.vstack([np.full(3, np.nan), np.diag(SPACING)])
    header = {"space dimension": 3, "space directions": directions}
    for n in (1, 3):
        data = np.stack([samples() + np.uint8(k) for k in range(n)])
        nrrd.write(str(tmp_path / f"{n}.nrrd"), data, header)
    assert_holds(read_volume(tmp_path / "1.nrrd"), samples(), affine_of(SPACING))
    with pytest.raises(FileError, match="3 channels"):
        read_volume(tmp_path / "3.nrrd")
    volume = read_volume(tmp_path / "3.nrrd", channel=2)
    assert_holds(volume, samples() + np.uint8(2), affine_of(SPACING))


@pytest.mark.parametrize("suffix", [".mha", ".mhd"])
def test_metaimage_has_the_transform_of_itk(tmp_path, suffix):
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(samples(np.int16).T)
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    image.SetDirection(ROTATION.reshape(-1).tolist())
    sitk.WriteImage(image, str(tmp_path / f"a{suffix}"))
    volume = read_volume(tmp_path / f"a{suffix}")
    assert_holds(volume, samples(np.int16), affine_of(SPACING, ORIGIN, ROTATION))
    index = [1, 2, 3]
    physical = image.TransformContinuousIndexToPhysicalPoint(index)
    np.testing.assert_allclose((volume.affine @ [*index, 1])[:3], physical)


def test_metaimage_with_components_or_two_axes(tmp_path):
    sitk = pytest.importorskip("SimpleITK")
    colours = np.stack([samples(np.int16).T + k for k in range(3)], axis=-1)
    sitk.WriteImage(sitk.GetImageFromArray(colours, isVector=True), str(tmp_path / "a.mha"))
    with pytest.raises(FileError, match="3 channels"):
        read_volume(tmp_path / "a.mha")
    assert_holds(read_volume(tmp_path / "a.mha", channel=1), samples(np.int16) + 1, np.eye(4))
    sitk.WriteImage(sitk.GetImageFromArray(samples(shape=(4, 5))), str(tmp_path / "b.mha"))
    with pytest.raises(FileError, match="a volume has x, y and z"):
        read_volume(tmp_path / "b.mha")


# --- TIFF and VTI --------------------------------------------------------------------------


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize("compression", [None, "zlib"])
def test_tiff_of_imagej(tmp_path, compression, big_endian):
    tifffile = pytest.importorskip("tifffile")
    x, y, z = SPACING
    tifffile.imwrite(
        tmp_path / "a.tif",
        samples(np.uint16).T,
        imagej=True,
        byteorder=">" if big_endian else "<",
        compression=compression,
        resolution=(1 / x, 1 / y),
        metadata={"spacing": z, "unit": "um", "axes": "ZYX"},
    )
    volume = read_volume(tmp_path / "a.tif")
    np.testing.assert_array_equal(volume.data, samples(np.uint16))
    np.testing.assert_allclose(volume.spacing, SPACING, rtol=1e-6)
    assert isinstance(volume.data, LazyArray if compression else np.memmap)


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_tiff_of_ome(tmp_path, compression):
    tifffile = pytest.importorskip("tifffile")
    sizes = dict(zip(("PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"), SPACING, strict=True))
    metadata = {"axes": "ZYX", **sizes}
    options = {"ome": True, "metadata": metadata, "compression": compression}
    tifffile.imwrite(tmp_path / "a.ome.tiff", samples(np.float32).T, **options)
    volume = read_volume(tmp_path / "a.ome.tiff")
    np.testing.assert_array_equal(volume.data, samples(np.float32))
    assert volume.spacing == SPACING


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_plain_tiff(tmp_path, compression):
    tifffile = pytest.importorskip("tifffile")
    tifffile.imwrite(
        tmp_path / "a.tif", samples().T, metadata=None, resolution=(72, 72), compression=compression
    )
    assert_holds(read_volume(tmp_path / "a.tif"), samples(), np.eye(4))


def test_tiff_that_is_no_stack(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    tifffile.imwrite(tmp_path / "flat.tif", samples(shape=(8, 9)))
    with pytest.raises(FileError, match="a volume has x, y and z"):
        read_volume(tmp_path / "flat.tif")
    tifffile.imwrite(tmp_path / "rgb.tif", samples(shape=(8, 9, 3)), photometric="rgb")
    with pytest.raises(FileError, match="a volume has x, y and z"):
        read_volume(tmp_path / "rgb.tif")


def test_vti_at_points_and_cells(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    grid = {"spacing": SPACING, "origin": ORIGIN, "direction_matrix": ROTATION}
    image = pyvista.ImageData(dimensions=SHAPE, **grid)
    image.point_data["ct"] = samples(np.int16).reshape(-1, order="F")
    image.save(tmp_path / "points.vti")
    volume = read_volume(tmp_path / "points.vti")
    assert_holds(volume, samples(np.int16), affine_of(SPACING, ORIGIN, ROTATION))
    np.testing.assert_allclose(
        (volume.affine @ [2, 3, 4, 1])[:3],
        image.points[np.ravel_multi_index((4, 3, 2), SHAPE[::-1])],
    )

    image = pyvista.ImageData(dimensions=np.add(SHAPE, 1), **grid)
    image.cell_data["labels"] = samples().reshape(-1, order="F")
    image.save(tmp_path / "cells.vti")
    volume = read_volume(tmp_path / "cells.vti")
    np.testing.assert_array_equal(volume.data, samples())
    centre = image.cell_centers().points[np.ravel_multi_index((4, 3, 2), SHAPE[::-1])]
    np.testing.assert_allclose((volume.affine @ [2, 3, 4, 1])[:3], centre)


def test_vti_with_keys_and_errors(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=SHAPE)
    image.save(tmp_path / "none.vti")
    image.point_data["a"] = samples().reshape(-1, order="F")
    image.point_data["b"] = samples(np.float32).reshape(-1, order="F")
    image.point_data["rgb"] = np.zeros((image.n_points, 3))
    image.save(tmp_path / "a.vti")
    assert read_volume(tmp_path / "a.vti", key="b").data.dtype == np.float32
    for key, message in ((None, "by its key: a, b, rgb"), ("c", "no array 'c', only a, b, rgb"),
                         ("rgb", "3 channels")):  # fmt: skip
        with pytest.raises(FileError, match=message):
            read_volume(tmp_path / "a.vti", key=key)
    with pytest.raises(FileError, match="holds no array"):
        read_volume(tmp_path / "none.vti")


# --- what can go wrong ---------------------------------------------------------------------


def test_unknown_suffix_missing_file_and_key(tmp_path):
    (tmp_path / "a.xyz").write_bytes(b"1 2 3")
    with pytest.raises(FileError, match=r"\.nii \.nii\.gz .*\.nrrd"):
        read_volume(tmp_path / "a.xyz")
    with pytest.raises(FileError, match="there is no file"):
        read_volume(tmp_path / "a.npy")
    np.save(tmp_path / "a.npy", samples())
    with pytest.raises(OptionError, match="no key 'data'"):
        read_volume(tmp_path / "a.npy", key="data")


PACKAGES = {
    ".nii": "nibabel",
    ".nii.gz": "nibabel",
    ".nrrd": "nrrd",
    ".mha": "SimpleITK",
    ".dcm": "SimpleITK",
    ".tif": "tifffile",
    ".h5": "h5py",
    ".zarr": "zarr",
    ".vti": "pyvista",
}


@pytest.mark.parametrize(("suffix", "package"), PACKAGES.items())
def test_missing_package(tmp_path, monkeypatch, suffix, package):
    without_package(monkeypatch, package)
    (tmp_path / f"a{suffix}").write_bytes(b"x")
    extra = "pyvista" if package == "pyvista" else "volumes"
    with pytest.raises(MissingExtraError, match=rf"tetsimplify\[{extra}\]"):
        read_volume(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", [*PACKAGES, ".npy", ".npz"])
def test_content_that_makes_no_sense(tmp_path, suffix):
    if suffix in PACKAGES:
        pytest.importorskip(PACKAGES[suffix])
    (tmp_path / f"a{suffix}").write_bytes(b"no volume at all" * 30)
    with pytest.raises(FileError, match="cannot read"):
        read_volume(tmp_path / f"a{suffix}")


# --- isosurfaces ---------------------------------------------------------------------------


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("normals", ["lower", "higher"])
def test_normals_point_as_asked_for_in_every_world(order, mirror, normals):
    affine = affine_of(SPACING, ORIGIN, ROTATION * [1, mirror, 1])
    mesh = isosurface_of(Volume(np.array(ball(), order=order), affine), 0.0, normals=normals)
    content = np.prod(SPACING) * np.prod([7, 7 / 1.2**0.5, 7 / 1.5**0.5]) * 4 / 3 * np.pi
    expected = content if normals == "lower" else -content
    assert signed_volume(mesh) == pytest.approx(expected, rel=0.03)
    centre = affine @ [9, 10, 11, 1]
    extent = mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)
    np.testing.assert_allclose(extent / 2, centre[:3], atol=0.1)


def test_with_spacing_keeps_directions():
    volume = Volume(ball(), affine_of(SPACING, ORIGIN, ROTATION)).with_spacing((1, 2, 3))
    np.testing.assert_allclose(volume.affine, affine_of((1, 2, 3), ORIGIN, ROTATION))
    with pytest.raises(OptionError, match="positive"):
        volume.with_spacing((1, 0, 3))


def test_nan_is_refused():
    data = ball()
    data[3, 4, 5] = np.nan
    with pytest.raises(VolumeError, match="nan"):
        isosurface_of(Volume(data, np.eye(4)), 0.0)
