"""Commands from questions: what `swashplate.api.question` says once becomes options, help and checks of the line."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from swashplate.api.languages import Language
from swashplate.api.question import FieldText, VerbQuestion, check, default_of, entries, help_of, settings_of
from swashplate.errors import SwashError

_SHELL = {"bool": bool, "path": Path}
_OUT = "Folder for all files, made if missing; or one file's name, whose ending says which: {}. May be repeated."


def question_at(place: str) -> type[VerbQuestion[Any]]:
    """The question at "module:Class"."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def command_of(
    question: type[VerbQuestion[Any]], name: str, carry_out: Callable[[VerbQuestion[Any], tuple[Path, ...]], None]
) -> Any:
    """A click command that asks a question.

    Args:
        question: its class.
        name: of the command.
        carry_out: called with the question and the places of `--out`.
    """
    known = entries(question)
    shown = {field: pair for field, pair in known.items() if pair[1].place != "setting"}
    parameters = [_parameter(question, field, *pair) for field, pair in shown.items()]
    if question.files or question.by_name:
        parameters.append(_out(question))

    def command(**given: Any) -> None:
        outs = tuple(given.pop("out_", None) or ())
        context = typer_context()
        carry_out(asked(question, given, settings=context.meta.get("settings", ())), outs)

    command.__signature__ = inspect.Signature(parameters)  # pyrefly: ignore[missing-attribute]
    command.__annotations__ = {entry.name: entry.annotation for entry in parameters}
    command.__doc__ = inspect.getdoc(question)
    app = typer.Typer(rich_markup_mode=None, add_completion=False)
    app.command(name, help=_help(question), epilog=_settings_help(known))(command)
    built = typer.main.get_command(app)
    built.name = name
    built.question = question  # of whom a page or a test asks what it takes  # pyrefly: ignore[missing-attribute]
    return built


def typer_context() -> Any:
    """The context of the command that runs."""
    from typer._click.globals import get_current_context

    return get_current_context()


def asked(
    question: type[VerbQuestion[Any]], given: dict[str, Any], *, settings: Sequence[str] = ()
) -> VerbQuestion[Any]:
    """The question of a line and its settings: options win.

    Raises:
        SwashError: a value that its language does not take, by its option's name; a field without a value.
    """
    known = entries(question)
    values = settings_of(settings, question)
    for name, value in given.items():
        if value is None or value == ():
            continue
        language, entry = known[name]
        called = metavar_of(name, entry) if entry.place == "argument" else flag_of(name, entry)
        texts = list(map(str, value)) if isinstance(value, list | tuple) else value
        values[name] = language.taken(texts, called=called)
        check(values[name], entry, called=called)
    missing = [name for name in known if name not in values and default_of(question, name) is dataclasses.MISSING]
    if missing:
        name, entry = missing[0], known[missing[0]][1]
        kind = "argument" if entry.place == "argument" else "option"
        hint = metavar_of(name, entry) if kind == "argument" else flag_of(name, entry)
        raise_missing(f"'{hint}'", kind)
    return question(**values)


def raise_missing(hint: str, kind: str) -> None:
    """As a usage error, behind those of what was typed."""
    from typer._click.exceptions import MissingParameter

    raise MissingParameter(ctx=typer_context(), param_hint=hint, param_type=kind)


def flag_of(name: str, entry: FieldText) -> str:
    """The option of a field."""
    return entry.flag.partition("/")[0] or f"--{name.replace('_', '-')}"


def metavar_of(name: str, entry: FieldText) -> str:
    """What stands for a value in the help."""
    return entry.metavar or name.upper()


def _parameter(question: type[VerbQuestion[Any]], name: str, language: Language, entry: FieldText) -> inspect.Parameter:
    """A field as an argument of a function, as typer reads it. All may be missing: a file of settings may have them."""
    default = default_of(question, name)
    element = _SHELL.get(language.kind, str)  # numbers are read by their language, with errors of its own
    listed: Any = list[element] if language.repeated else element
    complete = _COMPLETE.get(entry.complete)
    if entry.place == "argument":
        metavar = entry.metavar if default is dataclasses.MISSING else f"[{entry.metavar}]"
        declared = typer.Argument(metavar=metavar, help=entry.help, show_default=False, autocompletion=complete)
    else:
        flag = entry.flag or flag_of(name, entry)
        if language.kind == "bool" and default is True and not entry.flag:
            flag = f"--{name.replace('_', '-')}/--no-{name.replace('_', '-')}"
        flags = (flag, "-o") if flag == "--out" else (flag,)
        more: dict[str, Any] = {}
        if language.kind != "bool":
            more["metavar"] = entry.metavar or "|".join(entry.choices) or language.metavar or None
        declared = typer.Option(*flags, help=_text(entry, default), show_default=False, autocompletion=complete, **more)
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[listed | None, declared]
    )


def _text(entry: FieldText, default: Any) -> str:
    """The help of an option, with unit and default."""
    parts = [help_of(entry)]
    if default is not dataclasses.MISSING and default not in (None, False, (), ""):
        shown = ",".join(map(str, default)) if isinstance(default, tuple) else default
        shown = f"{shown:g}" if isinstance(shown, float) else shown
        parts.append(f"[default: {shown}]")
    elif default is dataclasses.MISSING:
        parts.append("[required]")
    return " ".join(parts)


def _out(question: type[VerbQuestion[Any]]) -> inspect.Parameter:
    endings = ", ".join(dict.fromkeys(Path(name).suffix for name in (*question.files, *question.by_name)))
    help = _OUT.format(endings) + (" [required]" if question.needs_out else "")
    declared = typer.Option("--out", "-o", metavar="DIR|FILE", help=help, show_default=False)
    annotation = Annotated[list[Path] | None, declared]
    return inspect.Parameter("out_", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)


def _help(question: type[VerbQuestion[Any]]) -> str:
    return (inspect.getdoc(question) or "").partition("\nRaises:")[0].rstrip()


def _settings_help(known: Mapping[str, tuple[Language, FieldText]]) -> str | None:
    """What a file of settings may say besides the options."""
    rare = [(name, entry) for name, (_, entry) in known.items() if entry.place == "setting"]
    if not rare:
        return None
    listed = [f"{name} ({entry.help.rstrip('.')}{f' [{entry.unit}]' if entry.unit else ''})" for name, entry in rare]
    return f"Also by --settings NAME=VALUE or FILE.toml: {'; '.join(listed)}."


def _vehicles(incomplete: str) -> list[str]:
    """Packaged vehicles for shell completion (files are completed by the shell itself)."""
    from importlib import resources

    files = (resources.files("swashplate.models") / "data").iterdir()
    names = sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml"))
    return [name for name in names if name.startswith(incomplete)]


def _flights(incomplete: str) -> list[str]:
    """Registered flights for shell completion (files are completed by the shell itself)."""
    from swashplate.flights.datasets import REGISTRY

    names = [f"{name}/{Path(file).stem}" for name, data in REGISTRY.items() for file in data.files if "flight" in file]
    return [name for name in names if name.startswith(incomplete)]


_COMPLETE = {"vehicle": _vehicles, "flight": _flights}


def checked_endings(question: VerbQuestion[Any], outs: Iterable[Path]) -> None:
    """Refuse names of files that a verb does not write, and folders where it writes none, before anything is computed.

    Raises:
        SwashError: naming the endings that there are.
    """
    endings = dict.fromkeys(Path(name).suffix for name in (*question.files, *question.by_name))
    for out in outs:
        ending = "" if out.is_dir() else out.suffix.lower()
        if ending not in endings and (ending in _KNOWN or not question.files):
            given = f"ends in '{out.suffix}'" if ending else "is a folder's name"
            raise SwashError(
                f"{given}, expected {_listed(list(endings))}" + (", or a folder for all." if question.files else "."),
                where=out,
                channel="--out",
            )


def _listed(endings: list[str]) -> str:
    return endings[0] if len(endings) == 1 else f"one of {', '.join(endings)}"


_KNOWN = (".html", ".json", ".toml", ".nc", ".csv", ".pdf", ".png", ".svg", ".c", ".lua", ".parm", ".params", ".param",
          ".parquet", ".txt", ".bin", ".mat", ".fmu", ".mcap", ".xlsx", ".h")  # fmt: skip
