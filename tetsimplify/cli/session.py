"""One run of a command: its progress, its notes, its result and how it ends."""

from __future__ import annotations

import json
import logging
import math
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any

import typer
from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.table import Table

from tetsimplify.errors import OptionError, TetsimplifyError


class ExitCode(IntEnum):
    """How a command ends."""

    OK = 0
    FAILED = 1
    USAGE = 2
    INTERRUPTED = 130


@dataclass
class Session:
    """What a command needs to talk to whoever called it.

    Results go to the standard output, as tables for people or as one JSON object for
    programs; all else goes to the standard error output.
    """

    command: str
    as_json: bool
    quiet: bool
    debug: bool
    notes: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    written: list[Path] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._errors = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
        self._progress: Progress | None = None
        self._bars: dict[str, TaskID] = {}

    def progress(self, stage: str, done: float) -> None:
        """Show how far a stage is: the callback that the library takes."""
        if self.quiet or not self._errors.is_terminal:
            return
        if self._progress is None:
            columns = (
                TextColumn("{task.description:>12}"),
                BarColumn(),
                TextColumn("{task.percentage:>3.0f} %"),
                TimeElapsedColumn(),
            )
            self._progress = Progress(*columns, console=self._errors, transient=True)
            self._progress.start()
        if stage not in self._bars:
            self._bars[stage] = self._progress.add_task(stage, total=1.0)
        self._progress.update(self._bars[stage], completed=done)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Take the time of a stage."""
        begin = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - begin

    def note(self, message: str) -> None:
        """Tell something that the caller should know."""
        self.notes.append(message)
        if not self.quiet:
            self._errors.print(f"note: {message}", style="yellow")

    def finish(self, result: dict[str, Any], *parts: RenderableType) -> None:
        """Print the result, as JSON or as tables and lines of text."""
        self.stop()
        if self.as_json:
            self._print_json({**result, "notes": self.notes})
        elif not self.quiet:
            console = Console(highlight=False)
            for part in parts:
                console.print(part, *[""] * isinstance(part, Table), sep="\n")

    def fail(self, error: BaseException, code: ExitCode) -> typer.Exit:
        """Tell what went wrong in one line and make the exit to raise."""
        self.stop()
        message = " ".join(str(error).split()) or type(error).__name__
        if self.debug:
            traceback.print_exception(error)
        if self.as_json:
            kind = type(error).__name__
            self._print_json({"command": self.command, "error": {"type": kind, "message": message}})
        self._errors.print(f"tetsimplify: {message}", style="bold red")
        return typer.Exit(int(code))

    def stop(self) -> None:
        """Take the progress bars away."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None

    def _print_json(self, value: dict[str, Any]) -> None:
        sys.stdout.write(json.dumps(as_plain(value), indent=2, allow_nan=False) + "\n")


@contextmanager
def session(command: str, *, as_json: bool, quiet: bool, debug: bool) -> Iterator[Session]:
    """Run a command: collect its notes, and turn what it raises into an exit code."""
    this = Session(command, as_json, quiet, debug)
    handler = _NoteHandler(this)
    log = logging.getLogger("tetsimplify.io")
    level, propagate = log.level, log.propagate
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False
    try:
        yield this
    except KeyboardInterrupt:
        done = ", ".join(map(str, this.written)) or "no file"
        interrupt = KeyboardInterrupt(f"interrupted; {done} was written")
        raise this.fail(interrupt, ExitCode.INTERRUPTED) from None
    except OptionError as error:
        raise this.fail(error, ExitCode.USAGE) from None
    except (TetsimplifyError, OSError) as error:
        raise this.fail(error, ExitCode.FAILED) from None
    except MemoryError:
        raise this.fail(MemoryError("out of memory"), ExitCode.FAILED) from None
    except typer.Exit:
        raise
    except Exception as error:
        if not debug:
            kind = type(error).__name__
            error = RuntimeError(f"unexpected {kind}: {error} (--debug shows where it came from)")
        raise this.fail(error, ExitCode.FAILED) from None
    finally:
        this.stop()
        log.removeHandler(handler)
        log.setLevel(level)
        log.propagate = propagate


class _NoteHandler(logging.Handler):
    """Makes what the readers and writers log the notes of a session."""

    def __init__(self, this: Session) -> None:
        super().__init__()
        self._session = this

    def emit(self, record: logging.LogRecord) -> None:
        self._session.note(record.getMessage())


def as_plain(value: Any) -> Any:
    """Turn a result into what JSON has: numbers that are not finite become strings or null."""
    if isinstance(value, dict):
        return {str(key): as_plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [as_plain(item) for item in value]
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy
        return as_plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value if isinstance(value, (int, float, str, bool, type(None))) else str(value)
