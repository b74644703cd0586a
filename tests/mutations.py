"""Documents with one thing wrong: entries left out, doubled, renamed, of another type, huge, not finite, nested."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator
from typing import Any

import tomli_w

LONG = "x" * 300_000
ODD: tuple[Any, ...] = (
    True, False, 0, 1, -1, 3, 2**31, 2**53 + 1, 2**63, -(2**63) - 1, 10**400, 0.0, -0.0, 1e-320, 1e-9, 0.5, 1e9,
    1e30, 1e99, -1e99, 1e101, 1e308, float("nan"), float("inf"), -float("inf"), "", " ", "x", "1", "nan", "é\u202e漢",
    "a/b", "a.b", "../x", "\x00", "\x7f", "x" * 2_100, LONG, [], {}, [[]], [{}], {"": 0}, {"a": {"b": 1}}, [1, "x"],
    [1.0, 2.0], [1.0, 2.0, 3.0], [[1.0], [1.0, 2.0]], "__import__('os')", "1/0", "9**9**9", "a" * 400,
)  # fmt: skip
"""What stands in the place of an entry. JSON has null and lone surrogates beside these."""


def _nested(depth: int) -> Any:
    value: Any = 1
    for k in range(depth):
        value = [value] if k % 2 else {"a": value}
    return value


def _places(value: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in inside:
        yield (*place, key)
        yield from _places(entry, (*place, key))


def _at(document: Any, place: tuple[Any, ...]) -> Any:
    for key in place:
        document = document[key]
    return document


def mutated(document: dict[str, Any], chance: random.Random, *, form: str) -> str:
    """The text of a document with one to three things wrong."""
    found = copy.deepcopy(document)
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        places = list(_places(found))
        if not places:
            break
        *above, key = chance.choice(places)
        _mutate(_at(found, tuple(above)), key, chance, form)
    text = tomli_w.dumps(found) if form == "toml" else json.dumps(found, indent=1)
    return _damaged(text, chance) if chance.random() < 0.15 else text


def _mutate(table: Any, key: Any, chance: random.Random, form: str) -> None:
    value = table[key]
    kind = chance.randrange(8)
    if kind == 0:
        del table[key]
    elif kind == 1 and isinstance(table, dict):
        table[chance.choice((f"{key}_", key.upper(), "", "x.y", "é", "a" * 301))] = table.pop(key)
    elif kind == 1:
        table.insert(key, copy.deepcopy(value))
    elif kind == 2 and isinstance(value, int | float) and not isinstance(value, bool):
        table[key] = max(-1e200, min(1e200, value)) * chance.choice((-1, 0, 1e-9, 1e3, 1e9, 1e30, 1e90))
    elif kind == 3:
        other = chance.choice(list(table) if isinstance(table, dict) else range(len(table)))
        table[key], table[other] = table[other], table[key]
    elif kind == 4:
        table[key] = _nested(chance.choice((2, 20, 30, 120)))
    elif kind == 5 and form == "json":
        table[key] = chance.choice((None, "\ud800", [None], {"a": None}))
    else:
        table[key] = copy.deepcopy(chance.choice(ODD))


def _damaged(text: str, chance: random.Random) -> str:
    """A text with bytes cut, doubled or exchanged, or with what takes parsers down."""
    a, b = sorted(chance.randrange(len(text) + 1) for _ in range(2))
    return chance.choice(
        (
            text[:a],
            text[a:],
            text[:a] + text[b:],
            text[:b] + text[a:b] + text[b:],
            text[:a] + chance.choice("\"'[]{}=.,#\\\n\x00é") + text[a:],
            text[:a] + "9" * 5_000 + text[a:],
            text + "\n" + ".".join("a" * 20_000) + " = 1",
            text[:a] + "[" * 3_000 + text[a:],
            text[:a] + '{"a":' * 3_000 + text[a:],
            "\ufeff" + text,
        )
    )
