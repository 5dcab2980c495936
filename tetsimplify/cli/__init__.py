"""The command line; see the page on it in the documentation."""

from tetsimplify.cli.commands import app, main

__all__ = ["app", "main"]
