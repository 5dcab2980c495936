"""Everything that tetsimplify raises on purpose.

Each error also is the standard error that a caller would expect, so both
``except TetsimplifyError`` and ``except ValueError`` work.
"""

from __future__ import annotations


class TetsimplifyError(Exception):
    """Base class of all errors raised by tetsimplify."""


class MeshError(TetsimplifyError, ValueError):
    """The vertices and faces given are not a mesh that the operation accepts."""


class VolumeError(TetsimplifyError, ValueError):
    """The array given is not a volume that the operation accepts."""


class OptionError(TetsimplifyError, ValueError):
    """An option has a value that it cannot have."""


class FileError(TetsimplifyError, OSError):
    """A file cannot be read or written."""


class MissingExtraError(TetsimplifyError, ImportError):
    """An optional package is needed and not installed.

    Parameters
    ----------
    purpose : str
        What needs the package, as the subject of a sentence: ``"reading NIfTI"``.
    package : str
        The package that is missing.
    extra : str
        The extra of tetsimplify that installs it.
    """

    def __init__(self, purpose: str, package: str, extra: str) -> None:
        super().__init__(f'{purpose} needs {package}: pip install "tetsimplify[{extra}]"')
        self.package = package
        self.extra = extra
