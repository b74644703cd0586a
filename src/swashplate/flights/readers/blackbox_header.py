"""The header of a Blackbox log: lines `H name:value`, among them the definitions of the frames' fields.

Source: "Blackbox logging internals" of Betaflight's documentation (sections "Log header" and "Log field format").
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass

from swashplate.errors import FlightError

MARKER = b"H Product:Blackbox flight data recorder by Nicholas Sherlock\n"
_LONGEST_HEADER = 1 << 20  # bytes; real ones have some 5 kB
_MOST_FIELDS = 512  # in a frame; the firmware's own tools hold 128
_DEFINITION = re.compile(r"Field ([A-Z]) (name|signed|predictor|encoding)")

PREDICTORS = {
    0: "zero", 1: "previous", 2: "straight line", 3: "average of two", 4: "minthrottle", 5: "motor[0]", 6: "increment",
    7: "home coordinate", 8: "1500", 9: "vbatref", 10: "last main frame's time", 11: "lowest motor output",
}  # fmt: skip
ENCODINGS = {
    0: "signed variable byte", 1: "unsigned variable byte", 3: "negative 14 bit", 4: "Elias delta, unsigned",
    5: "Elias delta, signed", 6: "TAG8_8SVB", 7: "TAG2_3S32", 8: "TAG8_4S16", 9: "nothing", 10: "TAG2_3SVARIABLE",
}  # fmt: skip
_NEEDS_HISTORY = (1, 2, 3, 6)
_UNSIGNED = (1, 4, 9)  # encodings that write no number below zero


@dataclass(frozen=True)
class FrameLayout:
    """The fields of one kind of frame, in the order in which they are written.

    Attributes:
        names: as in the header.
        signed: whether a value is a signed 32-bit number.
        predictors, encodings: numbers of `PREDICTORS` and `ENCODINGS`.
    """

    names: tuple[str, ...]
    signed: tuple[bool, ...]
    predictors: tuple[int, ...]
    encodings: tuple[int, ...]


@dataclass(frozen=True)
class Header:
    """What a log says before its first frame.

    Attributes:
        values: value by name, of all lines that define no field.
        layouts: by frame letter: "I" and "P" at least.
        end: where the frames begin, in bytes of the file.
    """

    values: Mapping[str, str]
    layouts: Mapping[str, FrameLayout]
    end: int

    def number(self, name: str, default: float = 0.0) -> float:
        """A value as a number: decimal, or a float's bits in hexadecimal (0x...)."""
        return as_number(self.values.get(name, "").split(",")[0], default)

    @property
    def intervals(self) -> tuple[int, int, int]:
        """I interval, and numerator and denominator of the share of loops that is logged ("1/4", or "4" alone)."""
        intra = min(max(int(self.number("I interval", 32.0)), 1), 1 << 16)
        first, slash, second = self.values.get("P interval", "1/1").partition("/")
        share = (first, second) if slash else ("1", first)
        top, bottom = (int(as_number(text.strip(), 1.0)) for text in share)
        if bottom < 1 or top < 1 or bottom > 1 << 16:  # 0: nothing but I frames
            return intra, 1, intra
        return intra, min(top, bottom), bottom


def as_number(text: str, default: float) -> float:
    """A header's number; `default` where it is none that is finite."""
    try:
        if text.lower().startswith("0x"):
            value = float(struct.unpack("<f", struct.pack("<I", int(text, 16)))[0])
        else:
            value = float(text)
    except (ValueError, struct.error, OverflowError):
        return default
    return value if abs(value) < 1e12 else default  # also what is not a number


def starts(content: bytes) -> tuple[int, ...]:
    """Where the logs of a file begin [bytes]."""
    places, at = [], content.find(MARKER)
    while at >= 0:
        places.append(at)
        at = content.find(MARKER, at + len(MARKER))
    return tuple(places)


def read_header(content: bytes, start: int, stop: int, *, where: str) -> Header:
    """The header of the log in these bytes of the file.

    Raises:
        FlightError: where it does not define the main frames, or what it says of a field cannot be.
    """
    at, values, lists = start, dict[str, str](), dict[tuple[str, str], list[str]]()
    while content[at : at + 2] == b"H ":
        end = content.find(b"\n", at, min(stop, start + _LONGEST_HEADER))
        if end < 0:
            break  # a torn line: the header is all that stands before it
        name, _, value = content[at + 2 : end].decode("utf-8", "replace").rstrip("\r").partition(":")
        at = end + 1
        definition = _DEFINITION.fullmatch(name.strip())
        if definition is None:
            values[name.strip()] = value.strip()
            continue
        count = value.count(",") + 1
        if count > _MOST_FIELDS:
            raise FlightError(
                f"the header defines {count:,} fields of frame {definition[1]}; at most {_MOST_FIELDS} are read.",
                where=where,
                channel=name.strip(),
                hint="The header is damaged or forged: copy the log again.",
            )
        lists[definition[1], definition[2]] = [part.strip() for part in value.split(",")] if value.strip() else []
    version = values.get("Data version", "2")
    if version != "2":
        raise FlightError(
            f"is of version {version[:20]!r}; version 2 is read (Cleanflight since 1.8, Betaflight, Rotorflight).",
            where=where,
            channel="Data version",
        )
    layouts = {letter: _layout(letter, lists, where=where) for letter in sorted({key[0] for key in lists} | {"I"})}
    if ("P", "predictor") not in lists:
        layouts["P"] = layouts["I"]
    if "time" not in layouts["I"].names:
        raise FlightError(
            "no field of the main frames is called 'time'.", where=where, channel="Field I name", hint="Copy it again."
        )
    return Header(values, layouts, at)


def _layout(letter: str, lists: Mapping[tuple[str, str], list[str]], *, where: str) -> FrameLayout:
    """The fields of a kind of frame; P frames have the names and signs of I frames."""
    home = "I" if letter == "P" else letter
    names = lists.get((home, "name"), [])
    if not names:
        raise FlightError(
            f"the header does not name the fields of frame {home}.",
            where=where,
            channel=f"Field {home} name",
            hint="The log was cut in its header: copy it again.",
        )
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled or not all(names):
        raise FlightError(
            f"names {doubled[0] if doubled else 'a field of no name'!r} twice or not at all.",
            where=where,
            channel=f"Field {home} name",
            hint="The header is damaged: copy the log again.",
        )
    numbers = {}
    for what, known in (("signed", {0: "", 1: ""}), ("predictor", PREDICTORS), ("encoding", ENCODINGS)):
        source = home if what == "signed" else letter
        if what == "signed" and (home, what) not in lists:
            continue  # optional, says the documentation: then how the fields are written tells it
        cells = lists.get((source, what), [])
        if len(cells) != len(names):
            raise FlightError(
                f"has {len(cells)} numbers for {len(names)} fields.",
                where=where,
                channel=f"Field {source} {what}",
                hint="The header is damaged: copy the log again.",
            )
        for name, cell in zip(names, cells, strict=True):
            if not cell.isascii() or not cell.isdigit() or int(cell[:9]) not in known:
                raise FlightError(
                    f"says {cell[:20]!r} of field '{name[:40]}'; known are {', '.join(map(str, known))}.",
                    where=where,
                    channel=f"Field {source} {what}",
                    hint="The header is damaged, or of a firmware that is not known.",
                )
        numbers[what] = [int(cell) for cell in cells]
    for name, predictor in zip(names, numbers["predictor"], strict=True):
        if letter != "P" and predictor in _NEEDS_HISTORY:
            raise FlightError(
                f"predicts field '{name[:40]}' from frames before it ({PREDICTORS[predictor]}); only P frames can.",
                where=where,
                channel=f"Field {letter} predictor",
                hint="The header is damaged: copy the log again.",
            )
    if 5 in numbers["predictor"] and "motor[0]" not in names:
        raise FlightError(
            "predicts from motor[0], which is no field.", where=where, channel=f"Field {letter} predictor"
        )
    signed = tuple(map(bool, numbers["signed"])) if "signed" in numbers else _written_signed(home, lists)
    return FrameLayout(tuple(names), signed, tuple(numbers["predictor"]), tuple(numbers["encoding"]))


def _written_signed(home: str, lists: Mapping[tuple[str, str], list[str]]) -> tuple[bool, ...]:
    """Whether each field is signed, where the header has no line that says so: by the encoding of its whole values.

    P frames are no witness: they write differences, which are signed for every field.
    """
    return tuple(not cell.isdigit() or int(cell[:9]) not in _UNSIGNED for cell in lists.get((home, "encoding"), []))
