"""Where volumes lie in the world: one volume in every format is one surface."""

from __future__ import annotations

import gzip

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from data import data_dir, needs_data
from tetsimplify.errors import FileError, OptionError
from tetsimplify.io import Volume, isosurface_of, read_volume
from tetsimplify.io.units import as_unit, in_one_unit
from tetsimplify.io.volume import affine_of
from volumes import ORIGIN, ROTATION, SHAPE, SPACING, assert_holds, ball, samples, signed_volume

STEPS = (0.5, 0.75, 3.0)  # exact in single precision, which NIfTI has, and in decimals


# --- one volume in every format ------------------------------------------------------------


def write_nifti(path, data):
    nibabel = pytest.importorskip("nibabel")
    nibabel.save(nibabel.Nifti1Image(data, affine_of(STEPS)), path)


def write_nrrd(path, data):
    nrrd = pytest.importorskip("nrrd")
    header = {"space": "RAS", "space directions": np.diag(STEPS), "space origin": np.zeros(3)}
    nrrd.write(str(path), data, {**header, "encoding": path.stem})


def write_metaimage(path, data):
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(data.T)
    image.SetSpacing(STEPS)
    sitk.WriteImage(image, str(path), useCompression=path.stem == "gzip")


def write_dicom(path, data):
    sitk = pytest.importorskip("SimpleITK")
    path.mkdir()
    for k in range(data.shape[2]):
        image = sitk.GetImageFromArray(data[..., k].T)
        image.SetSpacing(STEPS[:2])
        image.SetMetaData("0020|000e", "1.2.3")
        image.SetMetaData("0020|0032", f"0\\0\\{k * STEPS[2]}")
        image.SetMetaData("0020|0037", "1\\0\\0\\0\\1\\0")
        writer = sitk.ImageFileWriter()
        writer.KeepOriginalImageUIDOn()
        writer.SetFileName(str(path / f"{k}.dcm"))
        writer.Execute(image)


def write_tiff(path, data):
    tifffile = pytest.importorskip("tifffile")
    names = ("PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ")
    metadata = {"axes": "ZYX", **dict(zip(names, STEPS, strict=True))}
    compression = "zlib" if path.stem == "gzip" else None
    tifffile.imwrite(path, data.T, ome=True, metadata=metadata, compression=compression)


def write_hdf5(path, data):
    with pytest.importorskip("h5py").File(path, "w") as file:
        file.create_dataset("raw", data=data.T, chunks=(5, 8, 8))
        file["raw"].attrs["element_size_um"] = STEPS[::-1]


def write_zarr(path, data):
    group = pytest.importorskip("zarr").open_group(path, mode="w")
    array = group.create_array("0", shape=data.T.shape, dtype=data.dtype, chunks=(5, 8, 8))
    array[...] = data.T
    transforms = [{"type": "scale", "scale": STEPS[::-1]}]
    axes = [{"name": name, "type": "space"} for name in "zyx"]
    image = {"axes": axes, "datasets": [{"path": "0", "coordinateTransformations": transforms}]}
    group.attrs["ome"] = {"version": "0.5", "multiscales": [image]}


def write_npz(path, data):
    np.savez(path, data=np.asfortranarray(data), spacing=STEPS)


def write_vtk(path, data):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=data.shape, spacing=STEPS)
    image.point_data["values"] = data.reshape(-1, order="F")
    if path.suffix == ".vti":
        return image.save(path)
    from vtkmodules.vtkIOLegacy import vtkStructuredPointsWriter

    writer = vtkStructuredPointsWriter()
    writer.SetInputData(image)
    writer.SetFileName(str(path))
    writer.Write()


WRITERS = {
    "a.nii": write_nifti,
    "a.nii.gz": write_nifti,
    "raw.nrrd": write_nrrd,
    "raw.nhdr": write_nrrd,
    "gzip.nrrd": write_nrrd,
    "ascii.nrrd": write_nrrd,
    "raw.mha": write_metaimage,
    "raw.mhd": write_metaimage,
    "gzip.mha": write_metaimage,
    "series": write_dicom,
    "raw.ome.tif": write_tiff,
    "gzip.ome.tif": write_tiff,
    "a.npz": write_npz,
    "a.h5": write_hdf5,
    "a.zarr": write_zarr,
    "a.vti": write_vtk,
    "a.vtk": write_vtk,
}


def assert_same_surface_as_in_memory(path, data, level):
    expected = isosurface_of(Volume(np.asfortranarray(data), affine_of(STEPS)), level)
    mesh = isosurface_of(read_volume(path), level)
    assert len(expected.faces) > 500
    assert mesh.vertices.tobytes() == expected.vertices.tobytes()
    assert mesh.faces.tobytes() == expected.faces.tobytes()


@pytest.mark.parametrize(("name", "write"), WRITERS.items())
def test_every_format_gives_the_same_bytes(tmp_path, name, write):
    data = (100 * ball()).astype(np.int16)
    write(tmp_path / name, data)
    assert_same_surface_as_in_memory(tmp_path / name, data, 0.5)


@needs_data
@pytest.mark.parametrize(("name", "write"), WRITERS.items())
def test_a_head_in_every_format(tmp_path, name, write):
    head = read_volume(data_dir() / "volumes" / "cranium_ct.npz", axes="zyx").data
    data = np.ascontiguousarray(head[100:164, 100:148, 20:60])
    write(tmp_path / name, data)
    assert_same_surface_as_in_memory(tmp_path / name, data, 226.5)


# --- NIfTI ---------------------------------------------------------------------------------


def nifti(path, affine, *, sform, qform, data=None):
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(samples() if data is None else data, None)
    image.header.set_zooms(SPACING)
    image.set_sform(affine, sform)
    image.set_qform(affine if qform else None, qform)
    image.header.set_xyzt_units("micron")
    image.to_filename(path)
    return nibabel.load(path)


@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize(("sform", "qform"), [(0, 1), (2, 0), (2, 1), (0, 0)])
def test_sform_before_qform_before_sizes(tmp_path, sform, qform, mirror):
    affine = affine_of(SPACING, ORIGIN, ROTATION * [1, 1, mirror])
    image = nifti(tmp_path / "a.nii", affine, sform=sform, qform=qform)
    volume = read_volume(tmp_path / "a.nii")
    np.testing.assert_array_equal(volume.affine, image.affine)
    if sform or qform:
        np.testing.assert_allclose(volume.affine, affine, atol=1e-6)
    assert volume.unit == "µm"


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    matrix=st.lists(st.integers(-3, 3), min_size=9, max_size=9)
    .map(lambda values: np.reshape(values, (3, 3)) / 2.0)
    .filter(lambda matrix: abs(np.linalg.det(matrix)) > 0.1),
    suffix=st.sampled_from(["nii", "nii.gz", "mgh", "mgz"]),
)
def test_any_affine_has_outward_normals_and_the_right_content(tmp_path, matrix, suffix):
    """Sheared, mirrored, turned: the content grows by the determinant, the place is nibabel's."""
    nibabel = pytest.importorskip("nibabel")
    affine = affine_of(1.0, ORIGIN, matrix)
    kind = nibabel.MGHImage if suffix.startswith("mg") else nibabel.Nifti1Image
    if kind is nibabel.MGHImage:  # which has no shear
        affine = affine_of(SPACING, ORIGIN, ROTATION * np.sign(np.linalg.det(matrix)))
    nibabel.save(kind(ball().astype(np.float32), affine), tmp_path / f"a.{suffix}")
    mesh = isosurface_of(read_volume(tmp_path / f"a.{suffix}"), 0.0)
    in_grid = isosurface_of(Volume(ball().astype(np.float32), np.eye(4)), 0.0)
    stretch = abs(np.linalg.det(affine[:3, :3]))
    assert signed_volume(mesh) == pytest.approx(stretch * signed_volume(in_grid), rel=1e-4)
    image = nibabel.load(tmp_path / f"a.{suffix}")
    centre = nibabel.affines.apply_affine(image.affine, in_grid.vertices).mean(axis=0)
    np.testing.assert_allclose(mesh.vertices.mean(axis=0), centre, atol=0.05 * np.abs(affine).max())


@pytest.mark.parametrize("suffix", ["nii", "nii.gz"])
def test_nifti_scaled_with_times(tmp_path, suffix):
    nibabel = pytest.importorskip("nibabel")
    data = samples(np.int16, (*SHAPE, 3))
    image = nibabel.Nifti1Image(data, np.eye(4))
    image.header.set_slope_inter(0.25, -3)
    image.to_filename(tmp_path / f"a.{suffix}")
    volume = read_volume(tmp_path / f"a.{suffix}", time=1)
    assert_holds(volume, data[..., 1] * 0.25 - 3, np.eye(4))


def test_nifti_of_vectors_and_colours(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    data = samples(np.int16, (*SHAPE, 1, 3))
    nibabel.save(nibabel.Nifti1Image(data, np.eye(4)), tmp_path / "a.nii")
    with pytest.raises(FileError, match="it has 3 channels"):
        read_volume(tmp_path / "a.nii")
    assert_holds(read_volume(tmp_path / "a.nii", channel=2), data[..., 0, 2], np.eye(4))
    colours = np.zeros(SHAPE, [("R", "u1"), ("G", "u1"), ("B", "u1")])
    nibabel.save(nibabel.Nifti1Image(colours, np.eye(4)), tmp_path / "b.nii")
    with pytest.raises(FileError, match="a volume holds real numbers"):
        read_volume(tmp_path / "b.nii")
    nibabel.save(nibabel.Nifti1Image(samples(np.complex64), np.eye(4)), tmp_path / "c.nii")
    with pytest.raises(FileError, match="complex64"):
        read_volume(tmp_path / "c.nii")


# --- NRRD and MetaImage --------------------------------------------------------------------


def write_nrrd_by_hand(folder, data, *fields, before=b"", after=b"", attached=False):
    header = ["NRRD0004", "dimension: 3", f"sizes: {' '.join(map(str, data.shape))}", *fields]
    content = before + data.tobytes(order="F") + after
    if attached:
        (folder / "a.nrrd").write_bytes("\n".join([*header, "", ""]).encode() + content)
        return folder / "a.nrrd"
    (folder / "a.raw").write_bytes(content)
    (folder / "a.nhdr").write_text("\n".join([*header, "data file: a.raw", ""]))
    return folder / "a.nhdr"


@pytest.mark.parametrize("endian", ["little", "big"])
@pytest.mark.parametrize("attached", [True, False])
def test_raw_nrrd_of_either_byte_order(tmp_path, endian, attached):
    pytest.importorskip("nrrd")
    dtype = np.dtype(np.int16).newbyteorder(endian)
    fields = ("type: short", f"endian: {endian}", "encoding: raw")
    path = write_nrrd_by_hand(tmp_path, samples(dtype), *fields, attached=attached)
    volume = read_volume(path)
    assert isinstance(volume.data, np.memmap)
    np.testing.assert_array_equal(volume.data, samples(np.int16))


@pytest.mark.parametrize(
    ("before", "after", "skips"),
    [
        (b"one\ntwo\nxyz", b"", ("line skip: 2", "byte skip: 3")),
        (b"", b"more", ("lineskip: 0",)),
        (b"a header of some length", b"", ("byte skip: -1",)),
    ],
)
def test_raw_nrrd_with_skips(tmp_path, before, after, skips):
    nrrd = pytest.importorskip("nrrd")
    fields = ("type: uchar", "encoding: raw", *skips)
    path = write_nrrd_by_hand(tmp_path, samples(), *fields, before=before, after=after)
    assert_holds(read_volume(path), samples(), np.eye(4))
    if not after:
        np.testing.assert_array_equal(nrrd.read(str(path))[0], samples())


def test_nrrd_units_kinds_and_compression(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    header = {"space units": ["mm"] * 3, "space dimension": 3, "space directions": np.eye(3)}
    nrrd.write(str(tmp_path / "a.nrrd"), samples(), header)
    assert read_volume(tmp_path / "a.nrrd").unit == "mm"
    data = np.stack([samples(), samples()[::-1]])
    header = {"kinds": ["time", "domain", "domain", "domain"], "spacings": [np.nan, *SPACING],
              "units": ["s", "um", "um", "um"]}  # fmt: skip
    for encoding in ("raw", "gzip", "bzip2"):
        nrrd.write(str(tmp_path / "b.nrrd"), data, {**header, "encoding": encoding})
        with pytest.raises(FileError, match="2 times"):
            read_volume(tmp_path / "b.nrrd")
        volume = read_volume(tmp_path / "b.nrrd", time=1)
        assert_holds(volume, samples()[::-1], affine_of(SPACING))
        assert volume.unit == "µm"


def test_metaimage_with_times(tmp_path):
    sitk = pytest.importorskip("SimpleITK")
    data = samples(np.int16, (3, 7, 6, 5))
    image = sitk.GetImageFromArray(data, isVector=False)
    image.SetSpacing((*SPACING, 1.0))
    for compressed in (False, True):
        sitk.WriteImage(image, str(tmp_path / "a.mha"), useCompression=compressed)
        with pytest.raises(FileError, match="3 times"):
            read_volume(tmp_path / "a.mha")
        volume = read_volume(tmp_path / "a.mha", time=2)
        assert_holds(volume, data[2].T, affine_of(SPACING))


# --- NumPy and VTK -------------------------------------------------------------------------


def test_numpy_axes(tmp_path):
    np.save(tmp_path / "a.npy", samples().T)
    volume = read_volume(tmp_path / "a.npy", axes="zyx")
    assert isinstance(volume.data, np.memmap)
    assert_holds(volume, samples(), np.eye(4))
    np.savez(tmp_path / "a.npz", data=samples().T, spacing=SPACING[::-1], unit="um")
    volume = read_volume(tmp_path / "a.npz", axes="ZYX")
    assert_holds(volume, samples(), affine_of(SPACING))
    assert volume.unit == "µm"
    np.save(tmp_path / "b.npy", samples(shape=(2, 7, 6, 5)))
    volume = read_volume(tmp_path / "b.npy", axes="czyx", channel=1)
    assert_holds(volume, samples(shape=(2, 7, 6, 5))[1].T, np.eye(4))


def test_vtk_surfaces_are_no_volumes(tmp_path):
    from tetsimplify.io import is_volume_file

    pyvista = pytest.importorskip("pyvista")
    pyvista.Sphere().save(tmp_path / "mesh.vtk")
    assert not is_volume_file(tmp_path / "mesh.vtk")
    assert not is_volume_file(tmp_path / "missing.vtk")
    write_vtk(tmp_path / "image.vtk", samples())
    assert is_volume_file(tmp_path / "image.vtk")


@pytest.mark.parametrize("at_cells", [False, True])
def test_vti_that_does_not_begin_at_zero(tmp_path, at_cells):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(spacing=SPACING, origin=ORIGIN, direction_matrix=ROTATION)
    extents = np.array([[2, -3, 4], np.add(SHAPE, [1, -4, 3]) + at_cells]).T
    image.extent = extents.reshape(-1).tolist()
    values = image.cell_data if at_cells else image.point_data
    values["a"] = samples().reshape(-1, order="F")
    image.save(tmp_path / "a.vti")
    volume = read_volume(tmp_path / "a.vti")
    np.testing.assert_array_equal(volume.data, samples())
    points = image.cell_centers().points if at_cells else image.points
    for index in ((0, 0, 0), (2, 3, 4), (4, 5, 6)):
        expected = points[np.ravel_multi_index(index[::-1], SHAPE[::-1])]
        np.testing.assert_allclose((volume.affine @ [*index, 1])[:3], expected, rtol=1e-6)


# --- paths, keys, units --------------------------------------------------------------------


def test_keys_in_paths(tmp_path):
    np.savez(tmp_path / "a.npz", ct=samples(), mri=samples(np.float32))
    assert read_volume(f"{tmp_path / 'a.npz'}:mri").data.dtype == np.float32
    (tmp_path / "B.NPZ").write_bytes((tmp_path / "a.npz").read_bytes())
    assert read_volume(f"{tmp_path / 'B.NPZ'}:mri").data.dtype == np.float32
    with pytest.raises(FileError, match="there is no file"):
        read_volume(f"{tmp_path / 'a.npz'}:")
    np.save(tmp_path / "a.npy", samples())
    with pytest.raises(FileError, match="there is no file"):
        read_volume(f"{tmp_path / 'a.npy'}:0")
    (tmp_path / "a.npz:ct.npz").write_bytes((tmp_path / "a.npz").read_bytes())
    with pytest.raises(FileError, match="by its key"):  # a file of this very name
        read_volume(tmp_path / "a.npz:ct.npz")


def test_times_and_channels_that_are_not_there(tmp_path):
    np.save(tmp_path / "a.npy", samples())
    assert_holds(read_volume(tmp_path / "a.npy", time=0, channel=0), samples(), np.eye(4))
    for name in ("time", "channel"):
        with pytest.raises(OptionError, match=f"{name} must be 0, as there is only one, got 1"):
            read_volume(tmp_path / "a.npy", **{name: 1})


def test_wrong_gzip(tmp_path):
    pytest.importorskip("nibabel")
    (tmp_path / "a.nii.gz").write_bytes(gzip.compress(b"nothing of the kind" * 100))
    with pytest.raises(FileError, match="cannot read"):
        read_volume(tmp_path / "a.nii.gz")


def test_units():
    assert [as_unit(text) for text in ("um", "micrometer", "μm", "nanometre", "Å", "foot")] == [
        "µm", "µm", "µm", "nm", "Å", "foot"]  # fmt: skip
    assert as_unit(None) is as_unit("") is as_unit("pixel") is as_unit("unknown") is None
    assert in_one_unit([1.0, 2.0], ["mm", "mm"]) == ([1.0, 2.0], "mm")
    assert in_one_unit([1.0, 500.0, 0.002], ["µm", "nm", "mm"]) == ([1.0, 0.5, 2.0], "µm")
    assert in_one_unit([1, 2, 3], [None, "", "pixel"]) == ([1, 2, 3], None)
    with pytest.raises(FileError, match="None is not known"):
        in_one_unit([1, 2], ["mm", None])
