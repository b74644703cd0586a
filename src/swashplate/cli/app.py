"""`swash`: the verbs, and nothing heavy until one of them runs."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from swashplate.cli.guard import Guarded
from swashplate.cli.terminal import over
from swashplate.cli.verbs import VERBS, Verb
from swashplate.systems import HANGUP

_EVERYWHERE = {"--json": 0, "--quiet": 0, "-q": 0, "--debug": 0, "--settings": 1}
"""Options of every verb, which may stand anywhere, and how many values they take."""


class _Verbs(dict[str, Any]):
    """Commands by name; each is made when it is asked for."""

    def __init__(self, verbs: dict[str, Verb]) -> None:
        super().__init__(dict.fromkeys(verbs))
        self._verbs = verbs

    def __getitem__(self, name: str) -> Any:
        if super().__getitem__(name) is None:
            self[name] = _command(name, self._verbs[name])
        return super().__getitem__(name)

    def get(self, name: str, default: Any = None) -> Any:
        return self[name] if name in self else default  # noqa: SIM401

    def values(self) -> Any:
        return [self[name] for name in self]

    def items(self) -> Any:
        return [(name, self[name]) for name in self]


def _command(name: str, verb: Verb) -> Any:
    """The command of a verb, or the group."""
    if verb.verbs:
        help = verb.help + (f" `{verb.usual}` need not be typed." if verb.usual else "")
        return VerbGroup(name=name, help=help, no_args_is_help=verb.usual == "", rich_markup_mode=None,
                         context_settings=_HELP, verbs=verb.verbs, usual=verb.usual)  # fmt: skip
    from swashplate.cli.generate import command_of, question_at
    from swashplate.cli.run import carry_out

    command = command_of(question_at(f"swashplate.api.verbs.{verb.question}"), name, carry_out)
    command.context_settings = _HELP
    command.short_help = verb.help
    return command


_HELP = {"help_option_names": ["-h", "--help"]}


class VerbGroup(TyperGroup):
    """A group whose verbs are made when they are asked for, listed under their doors.

    The usual verb of a group is taken where the first word is none of its verbs, nor like one, nor an option.
    """

    def __init__(self, *, verbs: dict[str, Verb], usual: str = "", **attrs: Any) -> None:
        attrs["commands"] = _Verbs(verbs)
        super().__init__(**attrs)
        self.verbs, self.usual = verbs, usual

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        first = args[0] if args else "-"
        if self.usual:
            mistyped = get_close_matches(first, list(self.verbs)) and not Path(first).exists()
            theirs = (first.startswith("-") and first != "-") or first in self.verbs or mistyped
            if not theirs:
                args = [self.usual, *args]
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """The verbs under their doors, without making them."""
        doors = dict.fromkeys(verb.door for verb in self.verbs.values())
        for door in doors:
            with formatter.section(door or "Commands"):
                formatter.write_dl([(name, verb.help) for name, verb in self.verbs.items() if verb.door == door])


class AllVerbs(Guarded, VerbGroup):
    """All verbs. What every verb takes may stand anywhere on the line."""

    def __init__(self, **attrs: Any) -> None:
        super().__init__(verbs=VERBS, **attrs)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        return super().parse_args(ctx, in_front(args))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        within = [f"swash {name} {args[0]}" for name, verb in VERBS.items() if args[0] in verb.verbs]
        if args[0] not in VERBS and within:
            ctx.fail(f"No such command '{args[0]}'. Did you mean '{within[0]}'?")
        return super().resolve_command(ctx, args)


def in_front(line: list[str]) -> list[str]:
    """The line with the options of every verb before the verb."""
    front: list[str] = []
    rest: list[str] = []
    waiting = iter(line)
    for word in waiting:
        if word == "--":
            return [*front, *rest, word, *waiting]
        count = _EVERYWHERE.get(word.partition("=")[0])
        (rest if count is None else front).append(word)
        if count and "=" not in word:
            front += _next(waiting)
    return [*front, *rest]


def _next(rest: Iterator[str]) -> list[str]:
    value = next(rest, None)
    return [] if value is None else [value]


app = typer.Typer(
    name="swash",
    cls=AllVerbs,
    help="From a small helicopter's flight log to a validated model.",
    rich_markup_mode=None,  # plain help: rich takes longer to load than everything else that --help needs
    pretty_exceptions_enable=False,
    invoke_without_command=True,
    context_settings=_HELP,
)


def _version(wanted: bool) -> None:
    if wanted:
        import platform

        from swashplate.extras import version_of

        versions = ", ".join(f"{name} {version_of(name)}" for name in ("casadi", "numpy", "scipy"))
        typer.echo(f"swashplate {version_of('swashplate')} (Python {platform.python_version()}, {versions})")
        raise typer.Exit


@app.callback()
def root(
    context: typer.Context,
    json: Annotated[bool, typer.Option("--json", help="Print the result as JSON instead of tables.")] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="No progress, no tables: files and exit code only.")
    ] = False,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--settings",
            metavar="FILE.toml|NAME=VALUE",
            help="Options of the verb from a file, and its rarer ones, which its help lists. May be repeated.",
        ),
    ] = None,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the full traceback of an error (or set SWASHPLATE_DEBUG=1).")
    ] = False,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """From a small helicopter's flight log to a validated model. Without a verb, a page to try it on opens.

    The options below may stand anywhere on the line, with every verb.
    """
    context.meta.update(json=json, quiet=quiet, settings=settings or ())
    if context.invoked_subcommand is None:
        from swashplate.api.verbs.look import Open
        from swashplate.cli.run import carry_out

        carry_out(Open(open_page=True), ())


def _open_closed_streams() -> None:
    """Nothing in the place of standard streams that are closed (`>&-`): else the next file would be one of them."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # the system gives the lowest free number, which is the stream's own
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode))


def _clean_up_when_interrupted() -> None:
    """From now on: a verb begins. Before, `swashplate.__main__` ends at once."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as in the background of a shell
        signal.signal(signal.SIGINT, signal.default_int_handler)


def main() -> NoReturn:
    """The console script. A polite kill ends as an interrupt does: temporary files are removed."""
    _open_closed_streams()
    sys.stdout, sys.stderr = over(sys.stdout), over(sys.stderr)
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # the compiler's remarks to its own developers
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    if HANGUP is not None and signal.getsignal(HANGUP) is signal.SIG_DFL:  # `nohup` ignores it
        signal.signal(HANGUP, lambda number, _: sys.exit(128 + number))
    app(prog_name="swash", obj=_clean_up_when_interrupted)  # also as `python -m swashplate`: help speaks of swash
    raise AssertionError("typer ends the process itself")
