"""DICOM series, written here with pydicom from what the standard says, and read by SimpleITK."""

from __future__ import annotations

import numpy as np
import pytest

from tetsimplify.errors import FileError, OptionError
from tetsimplify.io import LazyArray, is_volume_file, isosurface_of, read_volume
from tetsimplify.io.volume import affine_of
from volumes import ORIGIN, ROTATION, SPACING, assert_holds, ball, samples, signed_volume

pydicom = pytest.importorskip("pydicom")
pytest.importorskip("SimpleITK")

SERIES = "1.2.826.0.1.3680043.8.498.7"
COLUMN, ROW, NORMAL = (ROTATION * SPACING).T


def write_slice(path, pixels, position, *, directions=ROTATION, series=SERIES, spacing=SPACING,
                slope=1, intercept=0, number=1, **more):  # fmt: skip
    """Write pixels[x, y] at a position; more attributes by their keyword."""
    meta = pydicom.dataset.FileMetaDataset()
    meta.MediaStorageSOPClassUID = pydicom.uid.CTImageStorage
    meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    one = pydicom.Dataset()
    one.file_meta = meta
    one.SOPClassUID, one.SOPInstanceUID = (
        meta.MediaStorageSOPClassUID,
        meta.MediaStorageSOPInstanceUID,
    )
    one.StudyInstanceUID, one.SeriesInstanceUID, one.Modality = f"{SERIES}.1", series, "CT"
    one.InstanceNumber = number
    one.ImagePositionPatient = [float(x) for x in position]
    one.ImageOrientationPatient = [float(x) for x in directions.T[:2].reshape(-1)]
    one.PixelSpacing = [spacing[1], spacing[0]]  # between rows, then between columns
    one.SliceThickness = 99.0  # has nothing to do with the distance between slices
    one.SamplesPerPixel, one.PhotometricInterpretation = 1, "MONOCHROME2"
    one.Rows, one.Columns = pixels.shape[1], pixels.shape[0]
    one.BitsAllocated = one.BitsStored = 8 * pixels.dtype.itemsize
    one.HighBit = one.BitsStored - 1
    one.PixelRepresentation = int(pixels.dtype.kind == "i")
    one.RescaleSlope, one.RescaleIntercept = slope, intercept
    one.PixelData = np.ascontiguousarray(pixels.T).tobytes()
    for name, value in more.items():
        setattr(one, name, value)
    one.save_as(path, enforce_file_format=True)


def write_series(folder, data, *, step=NORMAL, skip=(), prefix="", suffix=".dcm", **more):
    """Write data[x, y, z] in slices whose names are in no order."""
    folder.mkdir(exist_ok=True)
    names = np.random.default_rng(3).permutation(data.shape[2])
    for k in range(data.shape[2]):
        if k not in skip:
            path = folder / f"{prefix}{names[k]:03d}{suffix}"
            write_slice(path, data[..., k], ORIGIN + k * step, number=int(names[k]), **more)
    return sorted(folder.iterdir())


def test_folder_and_any_file_of_it(tmp_path):
    data = samples(np.int16)
    for path in (tmp_path / "s", *write_series(tmp_path / "s", data)):
        volume = read_volume(path)
        assert_holds(volume, data, affine_of(SPACING, ORIGIN, ROTATION))
        assert volume.unit == "mm"
        assert isinstance(volume.data, LazyArray)
    assert read_volume(tmp_path / "s").slowest_first().data.order == (0, 1, 2)


def test_one_slice_is_read_when_it_is_needed(tmp_path):
    files = write_series(tmp_path / "s", samples(np.int16))
    volume = read_volume(tmp_path / "s")
    for file in files:
        file.unlink()
    with pytest.raises(FileError, match="cannot read"):
        volume.data[..., 0]


def test_world_is_that_of_the_standard(tmp_path):
    """Equation C.7.6.2.1-1 of the standard, with the header as pydicom reads it."""
    data = samples(np.int16)
    files = write_series(tmp_path / "s", data)
    volume = read_volume(tmp_path / "s")
    for file in files:
        one = pydicom.dcmread(file)
        along_row, along_column = np.reshape(one.ImageOrientationPatient, (2, 3)).astype(float)
        between_rows, between_columns = map(float, one.PixelSpacing)
        for row, column in ((0, 0), (5, 4), (3, 1)):
            world = np.array(one.ImagePositionPatient, float)
            world += along_row * between_columns * column + along_column * between_rows * row
            index = np.linalg.solve(volume.affine, [*world, 1])[:3]
            np.testing.assert_allclose(index, index.round(), atol=1e-6)
            i, j, k = index.round().astype(int)
            assert volume.data[i, j, k] == one.pixel_array[row, column]


def test_tilted_gantry_gives_a_sheared_grid(tmp_path):
    data = samples(np.int16)
    step = NORMAL + [0.0, 0.9, 0.2]
    write_series(tmp_path / "s", data, step=step)
    volume = read_volume(tmp_path / "s")
    np.testing.assert_array_equal(volume.data, data)
    np.testing.assert_allclose(volume.affine[:3, 2], step)
    np.testing.assert_allclose(volume.affine[:3, 0], COLUMN)
    np.testing.assert_allclose(volume.affine[:3, 1], ROW)


@pytest.mark.parametrize("sign", [1, -1])
def test_surface_is_oriented_either_way_round(tmp_path, sign):
    """Positions go along the normal or against it: slices are in order along the normal."""
    data = (100 * ball()).astype(np.int16)
    write_series(tmp_path / "s", data, step=sign * NORMAL)
    volume = read_volume(tmp_path / "s")
    assert np.linalg.det(volume.affine[:3, :3]) > 0
    mesh = isosurface_of(volume, 0.5)
    content = np.prod(SPACING) * 7**3 / np.sqrt(1.2 * 1.5) * 4 / 3 * np.pi
    assert signed_volume(mesh) == pytest.approx(content, rel=0.03)
    centre = ORIGIN + 9 * COLUMN + 10 * ROW + 11 * sign * NORMAL
    extent = mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)
    np.testing.assert_allclose(extent / 2, centre, atol=0.1)


def test_values_are_rescaled(tmp_path):
    write_series(tmp_path / "int", samples(), slope=1, intercept=-1024)
    volume = read_volume(tmp_path / "int")
    assert volume.data.dtype.kind == "i"
    np.testing.assert_array_equal(volume.data, samples(np.int16) - 1024)
    write_series(tmp_path / "float", samples(), slope=0.25, intercept=0.5)
    np.testing.assert_array_equal(
        read_volume(tmp_path / "float").data, samples(np.float64) * 0.25 + 0.5
    )


def test_slices_may_have_their_own_slope(tmp_path):
    data = samples()
    (tmp_path / "s").mkdir()
    for k in range(7):
        path = tmp_path / "s" / f"{k}.dcm"
        write_slice(path, data[..., k], ORIGIN + k * NORMAL, slope=1 if k == 0 else 0.5**k)
    expected = data * 0.5 ** np.arange(7)
    np.testing.assert_array_equal(read_volume(tmp_path / "s").data, expected)


def test_missing_slice(tmp_path):
    write_series(tmp_path / "s", samples(), skip=[3])
    with pytest.raises(FileError, match=r"not at equal distances: .* are 6 mm apart, most 3 mm"):
        read_volume(tmp_path / "s")


def test_rounded_positions_are_taken(tmp_path):
    data = samples()
    (tmp_path / "s").mkdir()
    for k in range(7):
        position = np.round(ORIGIN + k * NORMAL * 0.987, 1)
        write_slice(tmp_path / "s" / f"{k}.dcm", data[..., k], position)
    np.testing.assert_array_equal(read_volume(tmp_path / "s").data, data)


def test_several_series_in_a_folder(tmp_path):
    folder, other = tmp_path / "s", f"{SERIES}.2"
    write_series(folder, samples(), prefix="a")
    write_series(folder, samples()[::-1], prefix="b", series=other, SeriesDescription="bone")
    with pytest.raises(FileError, match=r"by its key: .*7 files.*\.2 \(7 files, bone\)"):
        read_volume(folder)
    np.testing.assert_array_equal(read_volume(folder, key=other).data, samples()[::-1])
    np.testing.assert_array_equal(read_volume(folder / "b001.dcm").data, samples()[::-1])
    with pytest.raises(FileError, match="belongs to the series"):
        read_volume(folder / "b001.dcm", key=SERIES)
    with pytest.raises(FileError, match="choose one of its series"):
        read_volume(folder, key="1.2.3")


def test_times_at_the_same_positions(tmp_path):
    first, second = samples(), samples() + np.uint8(40)
    write_series(tmp_path / "s", second, prefix="a", AcquisitionNumber=2)
    write_series(tmp_path / "s", first, prefix="b", AcquisitionNumber=1)
    with pytest.raises(FileError, match="it has 2 times, choose one by time"):
        read_volume(tmp_path / "s")
    np.testing.assert_array_equal(read_volume(tmp_path / "s", time=0).data, first)
    np.testing.assert_array_equal(read_volume(tmp_path / "s", time=1).data, second)
    with pytest.raises(OptionError, match="time must be from 0 to 1, got 2"):
        read_volume(tmp_path / "s", time=2)
    (tmp_path / "s" / "a003.dcm").unlink()
    with pytest.raises(FileError, match="some positions have 1 slices, some 2"):
        read_volume(tmp_path / "s", time=0)


def test_slices_that_do_not_belong_together(tmp_path):
    write_series(tmp_path / "size", samples())
    write_slice(tmp_path / "size" / "z.dcm", samples(shape=(9, 9)), ORIGIN - NORMAL)
    with pytest.raises(FileError, match=r"has size \("):
        read_volume(tmp_path / "size")
    write_series(tmp_path / "turned", samples())
    turned = ROTATION[:, [1, 2, 0]]
    write_slice(tmp_path / "turned" / "z.dcm", samples()[..., 0], ORIGIN, directions=turned)
    with pytest.raises(FileError, match="has another orientation"):
        read_volume(tmp_path / "turned")


def test_colours(tmp_path):
    (tmp_path / "s").mkdir()
    for k in range(3):
        colours = samples(shape=(5, 6, 3))
        write_slice(tmp_path / "s" / f"{k}.dcm", colours[..., 0], ORIGIN + k * NORMAL,
                    SamplesPerPixel=3, PhotometricInterpretation="RGB", PlanarConfiguration=0,
                    PixelData=np.ascontiguousarray(colours.swapaxes(0, 1)).tobytes())  # fmt: skip
    with pytest.raises(FileError, match="it has 3 channels"):
        read_volume(tmp_path / "s")
    volume = read_volume(tmp_path / "s", channel=1)
    np.testing.assert_array_equal(volume.data[..., 2], samples(shape=(5, 6, 3))[..., 1])


def test_files_without_a_suffix(tmp_path):
    files = write_series(tmp_path / "s", samples(), suffix="")
    assert is_volume_file(files[0])
    np.testing.assert_array_equal(read_volume(files[0]).data, samples())
    (tmp_path / "text").write_text("nothing of this kind")
    assert not is_volume_file(tmp_path / "text")


def test_folders_without_a_series(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileError, match="no file of a known format"):
        read_volume(tmp_path / "empty")


def test_truncated_slice(tmp_path):
    files = write_series(tmp_path / "s", samples(np.int16, (40, 41, 5)))
    files[2].write_bytes(files[2].read_bytes()[:-2000])
    with pytest.raises(FileError, match="cannot read"):
        np.asarray(read_volume(tmp_path / "s").data)


def test_other_files_in_the_folder(tmp_path, capfd):
    write_series(tmp_path / "s", samples())
    (tmp_path / "s" / "readme.txt").write_text("about the series " * 20)
    (tmp_path / "s" / "empty").write_bytes(b"")
    np.testing.assert_array_equal(read_volume(tmp_path / "s").data, samples())
    assert capfd.readouterr() == ("", "")


def test_one_file_with_many_frames(tmp_path):
    import SimpleITK

    image = SimpleITK.GetImageFromArray(samples().T)
    image.SetSpacing(SPACING)
    SimpleITK.WriteImage(image, str(tmp_path / "a.dcm"))
    whole = SimpleITK.ReadImage(str(tmp_path / "a.dcm"))
    volume = read_volume(tmp_path / "a.dcm")
    np.testing.assert_array_equal(volume.data, samples())
    for index in ((0, 0, 0), (4, 5, 6)):
        point = whole.TransformIndexToPhysicalPoint(index)
        np.testing.assert_allclose((volume.affine @ [*index, 1])[:3], point, atol=1e-5)


def test_series_written_by_itk(tmp_path):
    """Another writer than pydicom, and the transform that SimpleITK gives when it reads it."""
    import SimpleITK

    data = samples(np.int16)
    for k in range(7):
        image = SimpleITK.GetImageFromArray(data[..., k].T)
        image.SetSpacing(SPACING[:2])
        position = "\\".join(map(str, ORIGIN + k * NORMAL))
        orientation = "\\".join(map(str, ROTATION.T[:2].reshape(-1)))
        for tag, value in (("0020|000e", SERIES), ("0020|0032", position), ("0008|0060", "CT"),
                           ("0020|0037", orientation), ("0020|0013", str(k))):  # fmt: skip
            image.SetMetaData(tag, value)
        writer = SimpleITK.ImageFileWriter()
        writer.KeepOriginalImageUIDOn()
        writer.SetFileName(str(tmp_path / f"{k}.dcm"))
        writer.Execute(image)
    volume = read_volume(tmp_path)
    files = SimpleITK.ImageSeriesReader.GetGDCMSeriesFileNames(str(tmp_path), SERIES)
    whole = SimpleITK.ReadImage(files)
    np.testing.assert_array_equal(volume.data, SimpleITK.GetArrayFromImage(whole).T)
    for index in ((0, 0, 0), (1, 2, 3), (4, 5, 6)):
        point = whole.TransformIndexToPhysicalPoint(index)
        np.testing.assert_allclose((volume.affine @ [*index, 1])[:3], point, atol=1e-5)
