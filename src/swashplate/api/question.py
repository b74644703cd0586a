"""One text for each verb: a dataclass whose fields are its arguments, with type, unit, default and help.

From it come the command line (`swashplate.cli.generate`), the words of `--settings`, the reference page and the check
of what was given; in Python a question is asked as `Respond(flight, inputs="mixer_roll", outputs="p").answer()`.
The type that a field is annotated with says how its text is read
(`swashplate.api.languages`). The modules of `swashplate.api.verbs` load nothing heavy before `answer` is called.
"""

from __future__ import annotations

import dataclasses
import inspect
import typing
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, ParamSpec, TypeVar, cast

from swashplate.api.languages import Language, language_of
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

Answer = TypeVar("Answer")
Value = TypeVar("Value")
Fields = ParamSpec("Fields")
Place = Literal["argument", "option", "setting"]


@dataclasses.dataclass(frozen=True)
class FieldText:
    """What is said of a field beside its type and default.

    Attributes:
        help: for what it is; one sentence.
        place: an argument of the line, an option, or only a word of `--settings`.
        metavar: what stands for its value in the help.
        unit: of its number.
        least, most: bounds of its number.
        choices: what it may be, where that is a short list.
        flag: the option, where it is not the field's name.
        complete: "vehicle" or "flight", for the shell.
    """

    help: str
    place: Place = "option"
    metavar: str = ""
    unit: str = ""
    least: float | None = None
    most: float | None = None
    choices: tuple[str, ...] = ()
    flag: str = ""
    complete: str = ""


def _field(default: Any, entry: FieldText, kw_only: bool) -> Any:
    return dataclasses.field(default=default, kw_only=kw_only, metadata={"entry": entry})


def argument(
    *, default: Any = dataclasses.MISSING, help: str, metavar: str, complete: str = "", kw_only: bool = False
) -> Any:
    """A field that stands on the line without a name; the last one may be a list."""
    return _field(default, FieldText(help, "argument", metavar, complete=complete), kw_only)


def option(*, default: Any = dataclasses.MISSING, help: str, kw_only: bool = True, **more: Any) -> Any:
    """A field that is an option; `more` as of `FieldText`. With `kw_only` False it comes first in Python."""
    return _field(default, FieldText(help, "option", **more), kw_only)


def setting(*, default: Any, help: str, kw_only: bool = True, **more: Any) -> Any:
    """A field that few need: a word of `--settings FILE.toml`, and an argument in Python."""
    return _field(default, FieldText(help, "setting", **more), kw_only)


@typing.dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(argument, option, setting))
class VerbQuestion(ABC, Generic[Answer]):
    """What a verb is asked. Subclasses are dataclasses; their docstring is the verb's help.

    Attributes:
        files: names of what `--out` may write. A folder gets all but those of `by_name`, a name that ends like one of
            them that file alone.
        by_name: files that are written only where `--out` names one.
        needs_out: whether nothing is done without `--out`.
        told_every: seconds between two lines of progress in a pipe; None for one line a stage.
    """

    files: ClassVar[tuple[str, ...]] = ()
    by_name: ClassVar[tuple[str, ...]] = ()
    needs_out: ClassVar[bool] = False
    told_every: ClassVar[float | None] = None

    def __init_subclass__(cls, **given: Any) -> None:
        super().__init_subclass__(**given)
        dataclasses.dataclass(frozen=True, repr=False, eq=False)(cls)

    def __post_init__(self) -> None:
        for name, (language, entry) in entries(type(self)).items():
            value = language.taken(getattr(self, name), called=name)
            check(value, entry, called=name)
            object.__setattr__(self, name, value)

    @abstractmethod
    def answer(self, say: Say = silent) -> Answer:
        """Do what is asked."""

    def finish(self, answer: Any) -> None:
        """What the command line does with the answer, also without `--out`."""

    def ours(self, out: Path) -> tuple[str, ...]:
        """What of a folder was written by an earlier run, and goes."""
        return self.files

    # ---- how the command line shows it -------------------------------------------------------------------------
    def check_places(self, outs: tuple[Path, ...]) -> None:
        """Refuse what would fail only after minutes of computing."""

    def write(self, answer: Any, folder: Path, names: tuple[str, ...]) -> None:
        """Write the named files into a folder that is there; by default as the result does."""
        from swashplate.api.report_folder import ReportFolder

        if isinstance(answer, ReportFolder):
            answer.write(folder)
            return
        for name in names:
            if name.endswith(".html"):
                from swashplate.reporting.report import report

                report(answer, path=folder / name)
            else:
                answer.save(folder / name)

    def document(self, answer: Any) -> Any:
        """What `--json` prints."""
        return answer.to_document()

    def text(self, answer: Any, width: int) -> list[Any]:
        """What is printed: texts and tables."""
        return [repr(answer)]

    def remarks(self, answer: Any) -> Sequence[str]:
        """What is said on standard error, whatever is printed."""
        return ()

    def problems(self, answer: Any) -> Sequence[str]:
        """What could not be computed, or may not be used: exit code 2."""
        return ()


def verb(
    name: str, question: Callable[Fields, VerbQuestion[Answer]], *, value: Callable[[Answer], Value] | None = None
) -> Callable[Fields, Value]:
    """A question as a function of `swashplate`: signature, help and checks are the question's.

    Args:
        name: of the function.
        question: its class; `question(...).answer(say)` does the same, and tells how far it is.
        value: what of the answer the function returns, where that is not all.
    """
    kind = cast(type[VerbQuestion[Any]], question)
    fields = inspect.signature(kind)

    def asked(*args: Any, **given: Any) -> Any:
        try:
            fields.bind(*args, **given)
        except TypeError as error:  # would name the question's class
            raise TypeError(f"{name}() {error}") from None
        answer = kind(*args, **given).answer()
        return answer if value is None else value(answer)

    asked.__name__ = asked.__qualname__ = name
    asked.__module__ = "swashplate"
    asked.__signature__ = fields.replace(return_annotation=(value or kind.answer).__annotations__["return"])  # type: ignore[attr-defined]
    told, parts = entries(kind), (inspect.getdoc(kind) or "").partition("\nRaises:")
    lines = [parts[0].rstrip(), "", "Args:"]
    for field, (_, entry) in told.items():
        choices = f" ({', '.join(entry.choices)})" if entry.choices else ""
        lines.append(f"    {field}: {help_of(entry)}{choices}")
    asked.__doc__ = "\n".join([*lines, *(["", f"Raises:{parts[2]}"] if parts[2] else [])])
    return asked


def help_of(entry: FieldText) -> str:
    """What a field is for, with its unit."""
    if not entry.unit or f"[{entry.unit}]" in entry.help:
        return entry.help
    return f"{entry.help.rstrip('.')} [{entry.unit}]."


def entries(question: type[VerbQuestion[Any]]) -> Mapping[str, tuple[Language, FieldText]]:
    """The fields of a question, its own first: how their text is read, and what is said of them."""
    texts = {}
    for field in fields_of(question):
        entry = field.metadata["entry"]
        texts[field.name] = (language_of(str(field.type), choices=entry.choices), entry)
    return texts


def fields_of(question: type[VerbQuestion[Any]]) -> list[dataclasses.Field[Any]]:
    """The fields of a question, its own first, then those that it shares with others."""
    fields = {field.name: field for field in dataclasses.fields(question)}  # pyrefly: ignore[bad-argument-type]
    names = dict.fromkeys(name for kind in question.__mro__ for name in vars(kind).get("__annotations__", {}))
    return [fields[name] for name in names if name in fields]


def default_of(question: type[VerbQuestion[Any]], name: str) -> Any:
    """A field's default; `dataclasses.MISSING` where it has none."""
    return next(field.default for field in dataclasses.fields(question) if field.name == name)  # pyrefly: ignore[bad-argument-type]


def check(value: Any, entry: FieldText, *, called: str) -> None:
    """That a number, or each of several, lies within its bounds, and a text among its choices.

    Raises:
        SwashError: naming the field.
    """
    if isinstance(value, str) and entry.choices and value not in entry.choices:
        from swashplate.registry import nearest

        expected = f"expected one of {', '.join(entry.choices)}"
        raise SwashError(f"'{value}' is unknown, {expected}.", channel=called, hint=nearest(value, entry.choices))
    if isinstance(value, tuple):
        for one in value:
            check(one, entry, called=called)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return
    low, high = entry.least, entry.most
    if (low is not None and not value >= low) or (high is not None and not value <= high):
        unit = f" {entry.unit}" if entry.unit else ""
        expected = (
            f"at least {low:g}" if high is None else f"at most {high:g}" if low is None else f"{low:g} to {high:g}"
        )
        raise SwashError(f"is {value:g}, expected {expected}{unit}.", channel=called)


def settings_of(texts: Sequence[str], question: type[VerbQuestion[Any]]) -> dict[str, Any]:
    """What `--settings` says of a question, by field: files of settings, and NAME=VALUE, of which the last wins.

    Raises:
        SwashError: a word that the verb does not have, or a value that is none.
    """
    known = entries(question)
    made: dict[str, Any] = {}
    listed: dict[str, list[str]] = {}
    for text in texts:
        word, equals, value = text.partition("=")
        if equals and word.replace("-", "_").isidentifier():
            name = _known(word, known, where="--settings")
            listed.setdefault(name, []).append(value)
            made[name] = listed[name] if known[name][0].repeated else value
            continue
        from swashplate import documents

        document = documents.parse(documents.read_text(text, form="toml"), form="toml", where=text)
        made |= {_known(word, known, where=text): value for word, value in document.items()}
    taken = {}
    for name, value in made.items():
        taken[name] = known[name][0].taken(value, called=name)
        check(taken[name], known[name][1], called=name)
    return taken


def _known(word: str, known: Mapping[str, Any], *, where: str) -> str:
    name = word.replace("-", "_")
    if name not in known:
        from swashplate.registry import nearest

        raise SwashError("is no setting of this verb.", where=where, channel=word, hint=nearest(name, known))
    return name
