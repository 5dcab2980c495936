"""Zarr and OME-Zarr, versions 2 and 3 of the format, through zarr."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from tetsimplify.errors import FileError, MissingExtraError
from tetsimplify.io.axes import DROPPED, Choice, pick
from tetsimplify.io.units import in_one_unit
from tetsimplify.io.volume import Volume, affine_of, checked_volume

AXES_BEFORE_0_4 = "tczyx"


class Multiscale(NamedTuple):
    """One image at several resolutions, as the metadata of OME tell it."""

    metadata: dict[str, Any]
    axes: str
    units: list[str | None]

    @property
    def paths(self) -> list[str]:
        """Where the levels are, the finest first."""
        return [dataset["path"] for dataset in self.metadata["datasets"]]

    def frame(self, level: int) -> tuple[list[float], list[float]]:
        """Distance between samples, and position of the first one, for each axis."""
        dataset = self.metadata["datasets"][level]
        scale, translation = [1.0] * len(self.axes), [0.0] * len(self.axes)
        for transform in (
            *dataset.get("coordinateTransformations", ()),
            *self.metadata.get("coordinateTransformations", ()),
        ):
            if transform["type"] == "scale":
                pairs = list(zip(scale, translation, transform["scale"], strict=True))
                scale = [a * factor for a, _, factor in pairs]
                translation = [b * factor for _, b, factor in pairs]
            elif transform["type"] == "translation":
                shift = transform["translation"]
                translation = [b + d for b, d in zip(translation, shift, strict=True)]
            elif transform["type"] != "identity":
                raise FileError(f"its transform is of the unknown type {transform['type']!r}")
        return scale, translation


def read(path: Path, choice: Choice) -> Volume:
    """Open an array, which is read by slabs.

    The key is the path of an array or of an image in the file, or the number of a level of an
    OME-Zarr image, 0 for the finest, which also is the default.
    """
    try:
        import zarr
    except ImportError as error:
        raise MissingExtraError("reading Zarr", "zarr", "volumes") from error
    array, image, level = _find(zarr.open(path, mode="r"), choice.key)
    if image is None:
        picked = pick(array.shape, _axes_of_array(array), choice)
        return checked_volume(picked.take_lazily(array, path, array.chunks), affine_of())
    picked = pick(array.shape, image.axes, choice)
    scale, translation = image.frame(level)
    units = picked.xyz(image.units)
    spacing, unit = in_one_unit(picked.xyz(scale), units)
    origin, _ = in_one_unit(picked.xyz(translation), units)
    data = picked.take_lazily(array, path, array.chunks)
    return checked_volume(data, affine_of(spacing, origin), unit)


def _find(root: Any, key: str | None) -> tuple[Any, Multiscale | None, int]:
    """Go to an array; tell the image that it is a level of, and which level."""
    import zarr

    if isinstance(root, zarr.Array):
        if key is not None:
            raise FileError(f"it is a single array, so there is no {key!r} in it")
        return root, None, 0
    image = _multiscale(root)
    if image is not None and (key is None or key in image.paths or key.isdecimal()):
        level = image.paths.index(key) if key in image.paths else int(key or 0)
        if level >= len(image.paths):
            raise FileError(f"there is no level {level}, only 0 to {len(image.paths) - 1}")
        return root[image.paths[level]], image, level
    if key is None:
        return _find_only(root)
    head, _, rest = key.strip("/").partition("/")
    if head not in root:
        raise FileError(f"there is no {key!r} in it, only {_listed(root)}")
    return _find(root[head], rest or None)


def _find_only(root: Any) -> tuple[Any, Multiscale | None, int]:
    """Go into the only image, or else the only array."""
    import zarr

    members = dict(root.members())
    images = [
        name
        for name, member in members.items()
        if isinstance(member, zarr.Group) and _multiscale(member) is not None
    ]
    arrays = [name for name, member in members.items() if isinstance(member, zarr.Array)]
    if len(images or arrays) != 1:
        raise FileError(f"it is no image, choose a part of it by its key: {_listed(root)}")
    return _find(members[(images or arrays)[0]], None)


def _listed(root: Any) -> str:
    return ", ".join(sorted(root.keys())) or "nothing"


def _multiscale(group: Any) -> Multiscale | None:
    attributes = group.attrs.asdict()
    attributes = attributes.get("ome", attributes)  # since version 0.5
    if not attributes.get("multiscales"):
        return None
    metadata = attributes["multiscales"][0]
    axes = metadata.get("axes", list(AXES_BEFORE_0_4))
    axes = [{"name": axis} if isinstance(axis, str) else axis for axis in axes]
    return Multiscale(metadata, "".join(map(_letter, axes)), [axis.get("unit") for axis in axes])


def _letter(axis: dict[str, Any]) -> str:
    of_types = {"channel": "c", "time": "t"}
    name = axis["name"].lower()
    return of_types.get(axis.get("type", ""), name if len(name) == 1 else DROPPED)


def _axes_of_array(array: Any) -> str | None:
    """Names of axes by the format (version 3) or by the convention of xarray (version 2)."""
    names = getattr(array.metadata, "dimension_names", None)
    names = names or array.attrs.asdict().get("_ARRAY_DIMENSIONS") or ()
    axes = "".join(str(name).lower() for name in names)
    return axes if len(axes) == array.ndim and set("xyz") <= set(axes) else None
