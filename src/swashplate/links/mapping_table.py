"""The entries of a servo mapping's file, each asked for by name, and told apart from those that nobody asked for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from swashplate.errors import LinkError
from swashplate.links.servo import CHANNELS, PULSES, Servo

_MISSING: Any = object()
_HINT = "The how-to 'Fly a vehicle under ArduPilot or PX4' has a whole mapping."


class MappingTable:
    """A table of a TOML document.

    Args:
        entries: the table.
        where: the file.
        path: the table's name with a full stop behind it, empty for the document.
    """

    def __init__(self, entries: Mapping[str, Any], where: str, path: str = "") -> None:
        self.where = where
        self._entries, self._path = entries, path
        self._asked: set[str] = set()
        self._parts: list[MappingTable] = []

    def error(self, key: str, problem: str) -> LinkError:
        """An error at one of its entries."""
        return LinkError(problem, where=self.where, channel=f"{self._path}{key}", hint=_HINT)

    def _get(self, key: str, missing: Any) -> Any:
        self._asked.add(key)
        if key in self._entries:
            return self._entries[key]
        if missing is _MISSING:
            raise self.error(key, "is missing.")
        return missing

    def part(self, key: str, *, missing: Any = _MISSING) -> MappingTable:
        """The table inside this one."""
        inner = self._get(key, missing)
        if not isinstance(inner, Mapping):
            raise self.error(key, f"is {inner!r}, expected a table.")
        table = MappingTable(inner, self.where, f"{self._path}{key}.")
        self._parts.append(table)
        return table

    def text(self, key: str) -> str:
        value = self._get(key, _MISSING)
        if not isinstance(value, str):
            raise self.error(key, f"is {value!r}, expected a text.")
        return value

    def flag(self, key: str) -> bool:
        value = self._get(key, False)
        if not isinstance(value, bool):
            raise self.error(key, f"is {value!r}, expected true or false.")
        return value

    def number(self, key: str, *, missing: Any = _MISSING) -> float:
        return self._number(key, self._get(key, missing))

    def numbers(self, key: str, *, missing: Any = _MISSING) -> tuple[float, ...]:
        entries = self._get(key, missing)
        if not isinstance(entries, list | tuple):
            raise self.error(key, f"is {entries!r}, expected a list of numbers.")
        return tuple(self._number(key, entry) for entry in entries)

    def pair(self, key: str) -> tuple[float, float]:
        numbers = self.numbers(key)
        if len(numbers) != 2:
            raise self.error(key, f"has {len(numbers)} numbers, expected two.")
        return numbers[0], numbers[1]

    def rows(self, key: str) -> tuple[tuple[float, ...], ...]:
        """A matrix, row by row; empty where it is missing."""
        rows = self._get(key, ())
        if not isinstance(rows, list | tuple) or not all(isinstance(row, list) for row in rows):
            raise self.error(key, f"is {rows!r}, expected a list of lists of numbers.")
        if len({len(row) for row in rows}) > 1:
            raise self.error(key, "has rows of different length.")
        return tuple(tuple(self._number(key, entry) for entry in row) for row in rows)

    def servo(self, channel: float, servos: MappingTable) -> Servo:
        """The output of this number, with the travel that `servos` has for it."""
        number = int(channel)
        if number != channel or not 1 <= number <= CHANNELS:
            raise self.error("channel", f"is {channel:g}, expected an output of 1 to {CHANNELS}.")
        entry = servos.part(str(number), missing={})
        servo = Servo(
            number,
            entry.number("low", missing=1000.0),
            entry.number("centre", missing=1500.0),
            entry.number("high", missing=2000.0),
            entry.flag("reversed"),
        )
        if not PULSES[0] <= servo.low < servo.centre < servo.high <= PULSES[1]:
            raise entry.error("low", f"expected {PULSES[0]} <= low < centre < high <= {PULSES[1]} us.")
        return servo

    def done(self) -> None:
        """Complain about entries that nobody asked for."""
        for key in self._entries:
            if key not in self._asked:
                known = ", ".join(sorted(self._asked))
                raise self.error(key, f"is not an entry; known here are {known}.")
        for part in self._parts:
            part.done()

    def _number(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.error(key, f"is {value!r}, expected a number.")
        return float(value)
