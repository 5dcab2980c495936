"""What all formats share: suffixes, clear errors, and files that appear whole or not at all."""

from __future__ import annotations

import logging
import os
import secrets
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tetsimplify.errors import FileError, MissingExtraError, OptionError

log = logging.getLogger("tetsimplify.io")


def suffix_among(path: str | os.PathLike[str], suffixes: Iterable[str]) -> str | None:
    """The longest of some suffixes that a file name ends with, ``.nii.gz`` before ``.gz``."""
    name = Path(path).name.lower()
    return max((suffix for suffix in suffixes if name.endswith(suffix)), key=len, default=None)


@contextmanager
def reading(path: Path, *, folders: bool = False) -> Iterator[None]:
    """Make every failure to read a file a FileError that names the file.

    Raises
    ------
    FileError
        When there is no such file, when it is a folder and `folders` are not taken, or
        whatever else is wrong with it.
    """
    if not path.exists():
        raise FileError(f"there is no file {path}")
    if not path.is_file() and not folders:
        raise FileError(f"{path} is not a file")
    try:
        yield
    except (MissingExtraError, OptionError, MemoryError):
        raise
    except Exception as error:
        raise FileError(f"cannot read {path}: {in_one_line(error)}") from error


def log_whole(path: Path) -> None:
    """Tell that a volume is read whole, since it cannot be read in parts."""
    log.info("%s cannot be read in parts, so all of it is read into memory", path.name)


def in_one_line(error: Exception) -> str:
    """The message of an error, for quoting it in that of another."""
    text = " ".join(str(error).split())[:300]
    plain = isinstance(error, (FileError, ValueError, OSError, RuntimeError)) and text
    return text if plain else f"{type(error).__name__}: {text}".removesuffix(": ")


def check_folder_of(path: str | os.PathLike[str]) -> None:
    """Make sure that a file can be created or replaced at `path`, before any work is done.

    Raises
    ------
    FileError
        When its folder is missing or not writable, or when `path` is a folder.
    """
    folder = Path(path).resolve().parent
    if not folder.is_dir():
        raise FileError(f"cannot write {path}: there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise FileError(f"cannot write {path}: no permission to write to the folder {folder}")
    if Path(path).is_dir():
        raise FileError(f"cannot write {path}: it is a folder")


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a file beside its target and move it there once it is complete.

    The temporary file lies in the folder of the target, since only a move within one file
    system is atomic, and has its suffix, since some writers go by the suffix. Whatever is
    raised in between, a KeyboardInterrupt too, the temporary file is removed and a target
    that exists already stays as it is.

    Parameters
    ----------
    path : path-like
        The target. Where it is a symbolic link, the file that it points to is replaced.

    Yields
    ------
    Path
        An empty file to write to.

    Raises
    ------
    FileError
        When the folder is missing or not writable, or when writing fails.
    """
    check_folder_of(path)
    target = Path(path).resolve()
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield temporary
        _flush_to_disk(temporary)
        if target.exists():
            shutil.copymode(target, temporary)
        os.replace(temporary, target)
    except (FileError, MissingExtraError, MemoryError):
        raise
    except Exception as error:
        raise FileError(f"cannot write {path}: {in_one_line(error)}") from error
    finally:
        temporary.unlink(missing_ok=True)


def _flush_to_disk(path: Path) -> None:
    # Without this a power cut after the move may leave the name of the new file with
    # none of its content.
    with open(path, "rb+") as file:
        os.fsync(file.fileno())
