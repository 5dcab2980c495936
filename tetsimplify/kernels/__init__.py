"""Every compiled loop, one concept a file.

Reaching for a kernel module (``kernels.corners``) loads it, and Numba with it;
importing this package alone loads neither, which keeps ``import tetsimplify`` quick.

Kernels take arrays and NamedTuples of arrays that :mod:`tetsimplify.arrays` has
checked. They validate nothing, read and write no files and raise nothing.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType


def __getattr__(name: str) -> ModuleType:
    try:
        return import_module(f"{__name__}.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"{__name__}.{name}":
            raise
        raise AttributeError(f"there is no kernel module {name!r}") from error
