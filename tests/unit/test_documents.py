"""The loader of documents: bounds before the parser, usable values, and schemas whose messages name entries."""

from __future__ import annotations

import random
import tomllib
import tracemalloc
from collections import Counter
from pathlib import Path
from unittest.mock import Mock

import msgspec
import pytest

from swashplate import documents
from swashplate.errors import CardError, DocumentError, SwashError


class Part(msgspec.Struct, forbid_unknown_fields=True):
    """Something with a name and a number."""

    name: str
    value: float
    sigma: float | None = None


class Whole(msgspec.Struct):
    """Parts in a list and in a table."""

    parts: list[Part]
    by_name: dict[str, Part] = {}


BOMBS = {
    "dotted keys": ("toml", ".".join("a" * 20_000) + " = 1", "dotted key of more than 24 parts"),
    "quoted dotted keys": ("toml", ".".join(['"é"'] * 5_000) + " = 1", "dotted key of more than 24 parts"),
    "a dotted table": ("toml", f"[{' . '.join('a' * 9_000)}]", "dotted key of more than 24 parts"),
    "dotted keys inside": ("toml", "x = {" + ".".join("a" * 9_000) + " = 1}", "dotted key of more than 24 parts"),
    "nested lists": ("toml", "a = " + "[" * 5_000, "nested more than 24 deep"),
    "nested tables": ("toml", "a = " + "{a=" * 5_000, "nested more than 24 deep"),
    "nested JSON": ("json", '{"a":' * 100_000, "nested too deeply"),
    "deep JSON": ("json", '{"a":' * 40 + "1" + "}" * 40, "nested more than 24 deep"),
    "digits": ("toml", "a = " + "9" * 5_000, "is not TOML: Exceeds the limit"),
    "digits in JSON": ("json", '{"a": ' + "9" * 5_000 + "}", "is not JSON: Exceeds the limit"),
    "hexadecimal digits": ("toml", "a = 0x" + "f" * 5_000, "a: is a whole number of more than 64 bits"),
    "entries": ("toml", "a = [" + "1," * 200_001 + "]", "has 200,003 entries; 200,000 are read"),
    "size": ("toml", "#" * (5 << 20), "has 5,242,880 characters"),
    "escapes that never close": ("toml", '\na = """' + '\\"""' * 300_000, 'opens with """ in line 2 never closes'),
    "quotes that never close": ("toml", "a = '''" + "''x" * 300_000, "opens with ''' in line 1 never closes"),
    "escapes of one line": ("toml", 'a = "' + '\\"' * 300_000, 'opens with " in line 1 never closes'),
    "a quote that meets the line's end": ("toml", "a = 'b\nc = 'd'", "opens with ' in line 1 never closes"),
    "not finite": ("toml", "a = [1.0, nan]", "a[1]: is nan, expected a finite number"),
    "beyond a double": ("json", '{"a": {"b": 1e999}}', "a.b: is inf, expected a finite number"),
    "huge": ("toml", "a = -1e101", "a: is -1e+101, expected a number of at most 1e+100"),
    "twice": ("json", '{"a": 1, "a": 2}', "has 'a' twice in one table"),
    "control characters": ("toml", 'a = "x\\u0000y"', "control characters"),
    "half a surrogate pair": ("json", '{"a": "\\ud800"}', "control characters"),
    "a long name": ("toml", f"{'a' * 301} = 1", "has the name"),
    "a date": ("toml", "a = 1979-05-27", "a: is 1979-05-27, expected a text"),
    "no object": ("json", "[1]", "is a list, expected an object"),
}


BEFORE = ("dotted key of", "nested more than", "entries;", "880 characters", "never closes")
"""What is said before a parser has seen a TOML text."""


@pytest.mark.parametrize("name", BOMBS)
def test_what_takes_parsers_down_is_refused_before_they_see_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    form, text, said = BOMBS[name]
    parser = Mock(wraps=tomllib.loads)
    monkeypatch.setattr(tomllib, "loads", parser)
    tracemalloc.start()
    try:
        with pytest.raises(CardError) as caught:
            documents.parse(text, form=form, where="a.toml", error=CardError)  # type: ignore[arg-type]
        assert tracemalloc.get_traced_memory()[1] < 64 << 20
    finally:
        tracemalloc.stop()
    assert parser.called == (form == "toml" and not any(words in said for words in BEFORE))
    assert str(caught.value).startswith("a.toml: ")
    assert said in str(caught.value)
    assert len(str(caught.value)) < 2_000


def test_what_only_looks_dangerous_is_read() -> None:
    dots = ".".join("a" * 40)
    text = f'x.y = {{p.q = 1.5}}\n# {dots}\nz = "{dots}"\nw = """{dots}\n[[["""\n'
    values = (
        '""',
        '"' * 6,
        f'"""{dots}\\""" "" """""',
        f"'''{dots}\\''''",
        f'"{dots}\\""',
        f"'{dots}\\'",
        f'"""\\\n{dots}"""',
    )
    for k, value in enumerate(values):
        text += f'"{dots} {k}" = {value}\n'
    text += "v = [1.5, 2.5, 3.5]\n['a.b'.c]\nd = 0.1"
    found = documents.parse(text, form="toml")
    assert found["z"] == dots
    assert found["a.b"] == {"c": {"d": 0.1}}
    assert found["x"] == {"y": {"p": {"q": 1.5}}}


def test_no_text_is_called_open_that_a_parser_closes() -> None:
    """Random quotes, escapes, ends of lines and comments: what is refused as open, the parser refuses too."""
    chance, counts = random.Random(1), Counter[str]()
    for _ in range(4_000):
        inside = "".join(
            chance.choices(['"', "'", '"""', "'''", "\\", "\n", "a", ".", "#", "[", "n"], k=chance.randint(0, 9))
        )
        quote = chance.choice(['"', "'", '"""', "'''", ""])
        text = f"a = {quote}{inside}{quote}\nb = 1\n"
        try:
            tomllib.loads(text)
            parsed = True
        except tomllib.TOMLDecodeError:
            parsed = False
        try:
            documents.parse(text, form="toml")
            outcome = "read"
        except DocumentError as refused:
            outcome = "open" if "never closes" in str(refused) else "refused"
        assert parsed == (outcome == "read"), text
        counts[outcome] += 1
    assert min(counts[outcome] for outcome in ("read", "open", "refused")) > 200, counts


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({}, "parts: is missing."),
        ({"parts": [{"name": "a"}]}, "parts[0].value: is missing."),
        ({"parts": [{"name": "a", "value": "b"}]}, "parts[0].value: is a text, expected a number."),
        ({"parts": [{"name": "a", "value": True}]}, "parts[0].value: is true or false, expected a number."),
        ({"parts": [{"name": "a", "value": 1, "vale": 2}]}, "parts[0].vale: is not known here."),
        ({"parts": [{"name": "a", "value": 1, "sigma": "x"}]}, "parts[0].sigma: is a text, expected a number or"),
        ({"parts": 3}, "parts: is a whole number, expected a list."),
        ({"parts": [], "by_name": {"good": {"name": "a", "value": 1}, "bad": {"name": "a"}}}, "by_name.bad.value: is"),
        ({"parts": [], "by_name": {"x.y[": {"name": 1, "value": 1}}}, "by_name.x.y[.name: is a whole number"),
    ],
)
def test_a_schema_names_the_entry(document: dict[str, object], said: str) -> None:
    with pytest.raises(DocumentError) as caught:
        documents.checked(document, Whole, where="f.json")
    assert str(caught.value).startswith(f"f.json: {said}")


def test_a_file_of_a_kind(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(b'\xef\xbb\xbf{"kind": "whole", "parts": [{"name": "a", "value": 1}]}')
    found = documents.read(path, form="json", kind="whole", schema=Whole)
    assert found.parts == [Part("a", 1.0)]
    with pytest.raises(CardError, match=r"kind is 'whole', expected 'part'\. Make one"):
        documents.read(path, form="json", kind="part", schema=Whole, error=CardError, hint="Make one.")
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DocumentError, match="is no text file, expected JSON"):
        documents.read_document(path, form="json")
    for place, said in (("none", "no such file"), ("a\0b", "cannot be read"), (tmp_path, "cannot be read: Is a dir")):
        with pytest.raises(DocumentError, match=said):
            documents.read_document(place, form="toml")
    assert documents.kind_of(path) == ""


def test_messages_stay_readable_whatever_is_in_them() -> None:
    error = SwashError("x" * 9_000, where="/" + "y" * 9_000, channel="z" * 9_000, hint="w" * 9_000)
    assert len(str(error)) < 2_000
    assert error.problem == "x" * 9_000
