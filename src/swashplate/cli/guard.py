"""Every way a command can end, as one readable line on standard error and an exit code."""

from __future__ import annotations

import os
import shlex
import sys
import traceback
from enum import IntEnum
from typing import Any, NoReturn

import typer
from typer.core import TyperGroup

from swashplate.cli.spelling import spelled
from swashplate.cli.typed_first import refuse_wrong_names
from swashplate.errors import SwashError
from swashplate.extras import EXTRA_OF, missing
from swashplate.visible import visible

_LONGEST = 200  # characters of a foreign error that are shown
_LONGEST_LINE = 1_900  # of a whole message: file names may have thousands


class Exit(IntEnum):
    """Exit codes: fine, a bug of ours, the user's input, stopped by the user (128 + SIGINT, as shells have it)."""

    FINE = 0
    OURS = 1
    INPUT = 2
    STOPPED = 130


def _end(message: str, code: Exit, *, debug: bool) -> NoReturn:
    if debug:
        traceback.print_exc()
    if code is Exit.STOPPED:
        typer.echo(message, err=True)
    else:
        complain(message)
    raise typer.Exit(code)


def complain(message: str) -> None:
    """One line of error on standard error; red where there is a terminal and nobody asked for no colour."""
    colour = False if os.environ.get("NO_COLOR") else None  # no-color.org: set and not empty
    typer.secho("Error: ", fg="red", bold=True, err=True, nl=False, color=colour)
    line = visible(" ".join(message.split()))
    typer.echo(line if len(line) <= _LONGEST_LINE else f"{line[: _LONGEST_LINE - 6]} [...]", err=True)


def _file_trouble(error: OSError) -> str:
    """A file that could not be read or written, in words (no space left, no permission, ...)."""
    place = f"{error.filename}: " if error.filename else ""
    reason = error.strerror or str(error) or type(error).__name__
    return f"{place}{reason}. Nothing was left half-written. Check the path, its permissions and the disk's space."


class Guarded(TyperGroup):
    """A group of verbs that ends in words: `SwashError` and trouble with files give 2, anything unforeseen 1.

    The context's object is called when a verb begins.
    """

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, command, rest = super().resolve_command(ctx, args)
        return name, command, rest if command is None else spelled(command, rest)

    def _judged(self, ctx: Any) -> Any:
        """The verb; where an option is missing, the names that were typed are judged first."""
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            if type(error).__name__ == "MissingParameter" and error.ctx is not None:
                refuse_wrong_names(error.ctx.command, error.ctx.params)
            raise

    def invoke(self, ctx: Any) -> Any:
        debug = bool(ctx.params.get("debug")) or os.environ.get("SWASHPLATE_DEBUG", "") not in ("", "0")
        try:
            if ctx.obj is not None:  # as a program
                ctx.obj()
            return self._judged(ctx)
        except (typer.Exit, typer.Abort, typer.TyperException, BrokenPipeError):
            raise  # typer knows what to do with these: usage errors are 2 already
        except KeyboardInterrupt:
            _end("Stopped. Nothing was left half-written.", Exit.STOPPED, debug=debug)
        except SwashError as error:
            _end(str(error), Exit.INPUT, debug=debug)
        except OSError as error:
            _end(_file_trouble(error), Exit.INPUT, debug=debug)
        except Exception as error:
            if isinstance(error, ModuleNotFoundError) and (library := (error.name or "").partition(".")[0]) in EXTRA_OF:
                _end(str(missing(library, what=f"swash {ctx.invoked_subcommand}")), Exit.INPUT, debug=debug)
            first = next(iter(str(error).splitlines()), "")[:_LONGEST]  # libraries put whole tracebacks into a message
            described = f"{type(error).__name__}: {first}" if first else type(error).__name__
            advice = "This is a bug in swashplate, not in your input. Please report it with the output of"
            command = shlex.join(["swash", "--debug", *sys.argv[1:]])
            _end(f"{described.rstrip('.')}. {advice} `{command}`.", Exit.OURS, debug=debug)
