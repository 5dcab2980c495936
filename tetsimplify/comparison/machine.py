"""What a comparison ran on."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import tetsimplify
from tetsimplify.decimators import Method
from tetsimplify.decimators.method import version_of

ALWAYS = ("numpy", "numba")


def machine(methods: Iterable[Method]) -> dict[str, Any]:
    """The processor, its memory, and the versions of all packages; None of what is missing."""
    names = [*ALWAYS, *(package for method in methods for package in method.packages)]
    packages = {name: version_of(name) for name in dict.fromkeys(names)}
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "memory_bytes": _memory(),
        "platform": platform.platform(terse=True),
        "python": platform.python_version(),
        "packages": {**packages, "tetsimplify": tetsimplify.__version__},
    }


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    named = (line.partition(": ")[2] for line in lines if line.startswith("model name"))
    return next(named, platform.processor() or platform.machine())


def _memory() -> int | None:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # no such thing on this system
        return None
