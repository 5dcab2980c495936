"""The one decorator of all kernels.

``nogil`` lets threads run kernels side by side; ``cache`` keeps the machine code on disk.
There is no ``fastmath`` (predicates must mean what they say) and no ``parallel`` (its
default threading layer aborts the process when two Python threads enter it).

Numba keys its cache by the file that a function stands in, but kernels call kernels of
other files. So the key here is a digest of all kernel files together: change any and all
are compiled anew.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba


def _digest_of_kernels() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


KERNELS_DIGEST = _digest_of_kernels()


_PART = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that Python calls; it may allocate arrays."""
    return _compiled(function)


def kernel_in_place(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that Python calls and that allocates nothing.

    Without allocations no references need be counted. Counting those of the arrays in
    NamedTuples took as long as the sweeps themselves.
    """
    return _compiled(function, _nrt=False)


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a part of kernels: a function that only they call and that allocates nothing.

    It gets no wrappers for Python, which halves the time to compile it, and becomes a piece of
    the machine code of its callers, which took a third off the time of the sweeps.
    """
    return _compiled(function, forceinline=True, **_PART)


def cold_part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a part of kernels that is called seldom and stays a function of its own."""
    return _compiled(function, **_PART)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function a piece of the one kernel that calls it, which saves compiling it twice."""
    return _compiled(function, inline="always")


def _compiled(function: Callable[..., Any], **options: Any) -> Callable[..., Any]:
    if numba.config.DISABLE_JIT:
        return function
    try:
        compiled = numba.njit(nogil=True, cache=True, **options)(function)
    except RuntimeError as error:  # no folder that the cache could be written to
        warnings.warn(f"kernels are compiled anew in every process: {error}", stacklevel=3)
        return numba.njit(nogil=True, **options)(function)
    _name_by_digest(compiled._cache._cache_file)
    return compiled


def _name_by_digest(cache: Any) -> None:
    """Give the files of each state of the kernels names of their own.

    Those of another state could not even be read where a NamedTuple has changed.
    """
    name = f"{cache._index_name.removesuffix('.nbi')}.{KERNELS_DIGEST[:16]}"
    cache._source_stamp = KERNELS_DIGEST
    cache._index_name = f"{name}.nbi"
    cache._index_path = str(Path(cache._cache_path) / cache._index_name)
    cache._data_name_pattern = f"{name}.{{number:d}}.nbc"
