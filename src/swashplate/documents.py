"""TOML and JSON documents of users: read, bounded, and held against a schema before anything is done with them.

Three steps, each with its own message: the text (size, nesting, dotted keys, before a parser sees it), the values
(finite and bounded numbers, readable texts), the schema (`msgspec`: which fields, of which type). Whatever the bytes,
the outcome is a document or the caller's `SwashError` that names the file and the entry.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from swashplate import files
from swashplate.errors import DocumentError, SwashError

Schema = TypeVar("Schema")
Form = Literal["toml", "json"]

LARGEST = 1e100
"""Largest number: its cube is still a double. Whole numbers have 64 bits."""
LARGEST_FILE = {"toml": 4 << 20, "json": 32 << 20}
"""Bytes."""
MOST_ENTRIES = {"toml": 200_000, "json": 1_000_000}
LONGEST_TEXT, LONGEST_KEY = 200_000, 300
DEEPEST = 24
"""Tables and lists inside each other, and parts of a dotted key."""

_NAMES = {"toml": "TOML", "json": "JSON"}
_TOKEN = re.compile(
    r'''(?P<quote>"""|\'\'\'|"|')
    |(?P<key>[A-Za-z0-9_+: \t-]+)
    |(?P<comment>\#[^\n]*)
    |(?P<dot>\.)
    |(?P<open>[\[{])
    |(?P<close>[\]}])
    |(?P<part>[,=])
    |(?P<other>.)''',
    re.DOTALL | re.VERBOSE,
)
_CLOSING = {
    '"""': re.compile(r'\\.|"{3,5}', re.DOTALL),
    "'''": re.compile(r"'{3,5}"),
    '"': re.compile(r'\\[^\n]|["\n]'),
    "'": re.compile(r"['\n]"),
}
"""What ends a text that opens so; escapes are passed over, and a line's end ends no text."""


class _RefusedError(ValueError):
    """What a document must not hold, in words that continue the file's name."""


def _bounded_toml(text: str) -> None:
    """Refuses what `tomllib` takes minutes or gigabytes for: its cost grows with the square of a dotted key's parts."""
    depth = dots = entries = place = 0
    while token := _TOKEN.match(text, place):
        kind, place = token.lastgroup, token.end()
        if kind == "quote":
            place = _closed(text, token)
        if kind in ("quote", "key"):
            continue
        if kind == "dot":
            dots += 1
            if dots >= DEEPEST:
                raise _RefusedError(f"has a dotted key of more than {DEEPEST} parts.")
            continue
        dots = 0
        if kind == "open":
            depth, entries = depth + 1, entries + 1
            if depth > DEEPEST:
                raise _RefusedError(f"is nested more than {DEEPEST} deep.")
        elif kind == "close":
            depth = max(0, depth - 1)
        elif kind == "part":
            entries += 1
    _bounded_count(entries, "toml")


def _closed(text: str, opening: re.Match[str]) -> int:
    """Where the text that opens here has ended. A parser reads an open one to the file's end, slowly, and says less."""
    marks = (mark for mark in _CLOSING[opening[0]].finditer(text, opening.end()) if mark[0][0] != "\\")
    mark = next(marks, None)
    if mark is None or mark[0] == "\n":
        line = text.count("\n", 0, opening.start()) + 1
        raise _RefusedError(f"is not TOML: the text that opens with {opening[0]} in line {line:,} never closes.")
    return mark.end()


def _bounded_json(text: str) -> None:
    _bounded_count(sum(map(text.count, ",[{")), "json")


def _bounded_count(entries: int, form: Form) -> None:
    if entries > MOST_ENTRIES[form]:
        raise _RefusedError(f"has {entries:,} entries; {MOST_ENTRIES[form]:,} are read.")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    entries = dict(pairs)
    if len(entries) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise _RefusedError(f"has '{_shown(twice)}' twice in one table.")
    return entries


def _shown(value: Any) -> str:
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= 60 else f"{text[:50]}... ({len(text):,} characters)"


def _unreadable(text: str) -> bool:
    """Control characters, and halves of surrogate pairs, which no file and no screen can take."""
    return not text.isprintable() and any(
        (c < " " and c not in "\n\t\r") or c == "\x7f" or "\ud800" <= c <= "\udfff" for c in text
    )


def _refuse_value(value: Any) -> str | None:
    """What is wrong with a single value, None where nothing is."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, int):
        return None if -(2**63) <= value < 2**63 else "is a whole number of more than 64 bits."
    if isinstance(value, float):
        if not math.isfinite(value):
            return f"is {value}, expected a finite number."
        return None if abs(value) <= LARGEST else f"is {value:g}, expected a number of at most {LARGEST:g}."
    if isinstance(value, str):
        if len(value) > LONGEST_TEXT:
            return f"is a text of {len(value):,} characters; {LONGEST_TEXT:,} are read."
        return f"is {_shown(value)!a}, which has control characters in it." if _unreadable(value) else None
    return f"is {_shown(str(value))}, expected a text, a number, a list or a table."


def _check_values(document: Any, where: str, error: type[SwashError], *, logged: bool = False) -> None:
    waiting: list[tuple[Any, tuple[str | int, ...]]] = [(document, ())]
    while waiting:
        value, place = waiting.pop()
        if isinstance(value, dict | list):
            if len(place) >= DEEPEST:
                raise error(f"is nested more than {DEEPEST} deep.", where=where, channel=_path(place[:3]) + "...")
            if isinstance(value, dict):
                for key in value:
                    if len(key) > LONGEST_KEY or (not logged and _unreadable(key)):
                        raise error(f"has the name {_shown(key)!a} in it.", where=where, channel=_path(place) or None)
                waiting += [(entry, (*place, key)) for key, entry in value.items()]
            else:
                waiting += [(entry, (*place, i)) for i, entry in enumerate(value) if not _is_plain_number(entry)]
        elif not logged and (problem := _refuse_value(value)) is not None:
            raise error(problem, where=where, channel=_path(place))


def _is_plain_number(value: Any) -> bool:
    """Whether a list's entry need not be looked at again (most are such)."""
    return type(value) is float and -LARGEST <= value <= LARGEST


def _path(place: tuple[str | int, ...]) -> str:
    """A place in a document as its messages have it: parameters[3].value."""
    parts = (f"[{part}]" if isinstance(part, int) else f".{_shown(part)}" for part in place)
    return "".join(parts).removeprefix(".")


def parse(
    text: str, *, form: Form, where: str | Path = "", error: type[SwashError] = DocumentError, hint: str | None = None
) -> dict[str, Any]:
    """The document in a text, its values checked.

    Args:
        text: TOML, or JSON with an object at its top.
        form: which of them.
        where: the file, for messages.
        error: the type of every error that is raised.
        hint: what to do where the text does not parse.

    Raises:
        error: where the text is too large, does not parse, is nested too deeply, or holds a number that is not finite,
            too large, or a text that cannot be shown.
    """
    document = _parsed(text, form, str(where), error, hint)
    if not isinstance(document, dict):
        raise error(f"is a {type(document).__name__}, expected an object with named entries.", where=where, hint=hint)
    _check_values(document, str(where), error)
    return document


def parse_logged(text: str, schema: type[Schema], *, where: str | Path, at: str, error: type[SwashError]) -> Schema:
    """The JSON `at` a part of a log, as a schema's object; its numbers and texts are the log's, whatever they are.

    Raises:
        error: where the text is too large, does not parse, is nested too deeply, or is not of the schema.
    """
    document = _parsed(text, "json", str(where), error, None)
    _check_values(document, str(where), error, logged=True)
    return checked(document, schema, where=where, at=at, error=error)


def _parsed(text: str, form: Form, where: str, error: type[SwashError], hint: str | None) -> Any:
    try:
        if len(text) > LARGEST_FILE[form]:
            raise _RefusedError(f"has {len(text):,} characters; {LARGEST_FILE[form]:,} are read.")
        if form == "toml":
            _bounded_toml(text)
            return tomllib.loads(text)
        _bounded_json(text)
        return json.loads(text, object_pairs_hook=_once)
    except _RefusedError as refused:
        raise error(str(refused), where=where, hint=hint) from None
    except RecursionError:
        raise error("is nested too deeply.", where=where, hint=hint) from None
    except ValueError as trouble:  # both parsers' own errors, and numbers of too many digits
        raise error(f"is not {_NAMES[form]}: {trouble}.", where=where, hint=hint) from None


def read_text(path: str | Path, *, form: Form, error: type[SwashError] = DocumentError, hint: str | None = None) -> str:
    """The text of a document's file (UTF-8, with or without a byte order mark).

    Raises:
        error: where it is missing, cannot be read, is too large or no text.
    """
    try:
        return files.read_text(path, most=LARGEST_FILE[form])
    except FileNotFoundError:
        raise error("there is no such file.", where=path, hint="Check the path.") from None
    except UnicodeDecodeError:
        raise error(f"is no text file, expected {_NAMES[form]}.", where=path, hint=hint) from None
    except (OSError, ValueError) as trouble:  # ValueError: a path with a zero byte
        reason = getattr(trouble, "strerror", None) or trouble
        raise error(f"cannot be read: {reason}.", where=path, hint="Check the path.") from None


def read_document(
    path: str | Path, *, form: Form, error: type[SwashError] = DocumentError, hint: str | None = None
) -> dict[str, Any]:
    """The document in a file, its values checked; `hint` says what to do where it is none. Raises `error`."""
    return parse(read_text(path, form=form, error=error, hint=hint), form=form, where=path, error=error, hint=hint)


def kind_of(path: str | Path) -> str:
    """What a TOML file says that it is (its entry `kind`); "" where it says nothing or is none: its reader says why."""
    try:
        return str(read_document(path, form="toml").get("kind", ""))
    except SwashError:
        return ""


def read(
    path: str | Path,
    *,
    form: Form,
    kind: str,
    schema: type[Schema],
    error: type[SwashError] = DocumentError,
    hint: str | None = None,
) -> Schema:
    """The document in a file as an object of a schema.

    Args:
        path: the file.
        form: "toml" or "json".
        kind: what its entry `kind` must be.
        schema: a `msgspec.Struct`, or anything else that msgspec converts to; unknown fields are refused where the
            schema forbids them.
        error: the type of every error that is raised.
        hint: what to do where it is no such document.

    Raises:
        error: naming the file and the entry that is missing, unknown or of another type.
    """
    document = read_document(path, form=form, error=error, hint=hint)
    if document.get("kind") != kind:
        actual = f"kind is {_shown(document['kind'])!r}" if "kind" in document else "says no kind"
        raise error(f"{actual}, expected '{kind}'.", where=path, hint=hint)
    return checked(document, schema, where=path, error=error)


def checked(
    document: Any,
    schema: type[Schema],
    *,
    where: str | Path = "",
    at: str = "",
    error: type[SwashError] = DocumentError,
    hint: str | None = None,
) -> Schema:
    """A document, or the part of one that stands `at` an entry, as an object of a schema.

    Raises:
        error: naming the file and the entry that is missing, unknown or of another type.
    """
    try:
        return msgspec.convert(document, schema)
    except msgspec.ValidationError as trouble:
        problem, entry = _words(document, schema, str(trouble))
        channel = ".".join(part for part in (at, entry) if part) or None
        raise error(problem, where=where, channel=channel, hint=hint) from None


def _words(document: Any, schema: Any, told: str) -> tuple[str, str]:
    """What msgspec says, as a problem and the entry it is at; the name in a table is looked up, which it leaves out."""
    problem, _, place = told.partition(" - at `$")
    place = place.rstrip("`")
    while "[...]" in place:
        head, _, tail = place.partition("[...]")
        table = _inside(document, head)
        if not isinstance(table, dict):
            break
        culprit = next((key for key in table if _fails(document, schema, head, key)), None)
        if culprit is None:
            break
        place = f"{head}.{_shown(culprit)}{tail}"
        if "." in culprit or "[" in culprit:
            break
    missing = re.fullmatch(r"Object missing required field `(.*)`", problem)
    if missing:
        return "is missing.", f"{place}.{missing[1]}".removeprefix(".")
    unknown = re.fullmatch(r"Object contains unknown field `(.*)`", problem)
    if unknown:
        return "is not known here.", f"{place}.{_shown(unknown[1])}".removeprefix(".")
    wrong = re.fullmatch(r"Expected (.*), got `(.*)`", problem)
    if wrong:
        words = {"float": "a number", "int": "a whole number", "str": "a text", "bool": "true or false"}
        words |= {"object": "a table", "array": "a list", "null": "nothing", "dict": "a table", "list": "a list"}
        expected = " or ".join(words.get(kind.strip("` "), kind.strip("` ")) for kind in wrong[1].split("|"))
        return f"is {words.get(wrong[2], wrong[2])}, expected {expected}.", place.removeprefix(".")
    return f"{problem[:1].lower()}{problem[1:]}.", place.removeprefix(".")


def _inside(document: Any, place: str) -> Any:
    for name, number in re.findall(r"\.([^.\[]+)|\[(\d+)\]", place):
        try:
            document = document[int(number)] if number else document[name]
        except (KeyError, IndexError, TypeError):
            return None
    return document


def _fails(document: Any, schema: Any, place: str, key: str) -> bool:
    """Whether the document is refused at `place` with this entry alone in the table there."""
    steps = [(name, number) for name, number in re.findall(r"\.([^.\[]+)|\[(\d+)\]", place)]

    def only(value: Any, left: list[tuple[str, str]]) -> Any:
        if not left:
            return {key: value[key]}
        name, number = left[0]
        if number:
            return [only(entry, left[1:]) if i == int(number) else entry for i, entry in enumerate(value)]
        return {k: only(entry, left[1:]) if k == name else entry for k, entry in value.items()}

    try:
        msgspec.convert(only(document, steps), schema)
    except msgspec.ValidationError as trouble:
        return f"`${place}[...]" in str(trouble)
    return False
