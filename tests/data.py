"""The folder of large real inputs, which is no part of the repository."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def data_dir() -> Path | None:
    """The folder named by TETSIMPLIFY_DATA, None where it is not set."""
    named = os.environ.get("TETSIMPLIFY_DATA")
    return Path(named) if named else None


needs_data = pytest.mark.skipif(
    data_dir() is None, reason="set TETSIMPLIFY_DATA to the folder of real meshes and volumes"
)
