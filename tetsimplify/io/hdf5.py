"""HDF5, through h5py."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from tetsimplify.errors import FileError, MissingExtraError
from tetsimplify.io.axes import Choice, pick
from tetsimplify.io.volume import Volume, affine_of, checked_volume


def read(path: Path, choice: Choice) -> Volume:
    """Open the dataset at the path `key` in the file, or the only volume; read by slabs.

    Names of axes come from dimension labels, or from the ``axistags`` of ilastik. An attribute
    ``element_size_um`` has the distances along z, y, x in micrometres, and means that this is
    their order where nothing names the axes.
    """
    try:
        import h5py
    except ImportError as error:
        raise MissingExtraError("reading HDF5", "h5py", "volumes") from error
    file = h5py.File(path, "r")  # closed when its last dataset is
    dataset = _find(file, choice.key)
    size = dataset.attrs.get("element_size_um")
    axes = _axes(dataset) or ("zyx" if size is not None and dataset.ndim == 3 else None)
    picked = pick(dataset.shape, axes, choice)
    data = picked.take_lazily(dataset, path, dataset.chunks)
    if size is None:
        return checked_volume(data, affine_of())
    z_y_x = np.asarray(size, np.float64).reshape(-1)
    if z_y_x.shape != (3,):
        raise FileError(f"its attribute element_size_um must hold three numbers, got {size}")
    return checked_volume(data, affine_of(z_y_x[::-1]), "µm")


def _find(file: Any, key: str | None) -> Any:
    import h5py

    if key is not None:
        found = file.get(key)
        if isinstance(found, h5py.Dataset):
            return found
        raise FileError(f"there is no dataset {key!r}, only {_listed(_datasets(file)) or 'none'}")
    datasets = _datasets(file)
    volumes = [one for one in datasets if one.ndim == 3] or [
        one for one in datasets if one.ndim > 3
    ]
    if len(volumes) == 1:
        return volumes[0]
    if not volumes:
        raise FileError(f"it holds no volume, but {_listed(datasets) or 'no dataset'}")
    raise FileError(f"it holds several volumes, choose one by its key: {_listed(volumes)}")


def _datasets(file: Any) -> list[Any]:
    import h5py

    found = []

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            found.append(item)

    file.visititems(visit)
    return found


def _listed(datasets: list[Any]) -> str:
    return ", ".join(f"{one.name} {one.shape}" for one in datasets)


def _axes(dataset: Any) -> str | None:
    tags = dataset.attrs.get("axistags")
    if tags is not None:
        names = [axis["key"] for axis in json.loads(tags)["axes"]]
    else:
        names = [dimension.label for dimension in dataset.dims]
    axes = "".join(name.lower() for name in names)
    return axes if len(axes) == dataset.ndim and set("xyz") <= set(axes) else None
