"""The one decorator of all kernels.

``nogil`` lets threads run kernels side by side; ``cache`` keeps the machine code on disk. Division
by zero gives what NumPy gives: a branch for an exception would keep loops from being vectorised.
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
from numba.core.caching import IndexDataCacheFile


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
        compiled = numba.njit(nogil=True, cache=True, error_model="numpy", **options)(function)
    except RuntimeError as error:  # no folder that the cache could be written to
        warnings.warn(f"kernels are compiled anew in every process: {error}", stacklevel=3)
        return numba.njit(nogil=True, error_model="numpy", **options)(function)
    numbered = compiled._cache._cache_file
    name = f"{numbered._index_name.removesuffix('.nbi')}.{KERNELS_DIGEST[:16]}"
    compiled._cache._cache_file = CacheFile(numbered._cache_path, name, KERNELS_DIGEST)
    return compiled


class CacheFile(IndexDataCacheFile):
    """The files of one kernel in the cache.

    Each state of the kernels has files with names of their own: those of another state could not
    even be read where a NamedTuple has changed. And machine code has a name by the types that it is
    for, where Numba takes the next number that is free: two processes that compile for different
    types at the same time take the same one, and each may then find the code of the other.
    """

    def save(self, key: Any, data: Any) -> None:
        """Save what was compiled for some types."""
        overloads = self._load_index()
        if key not in overloads:
            kind = hashlib.sha256(repr(key).encode()).hexdigest()[:16]
            overloads[key] = f"{self._index_name.removesuffix('.nbi')}.{kind}.nbc"
            self._save_index(overloads)
        self._save_data(overloads[key], data)
