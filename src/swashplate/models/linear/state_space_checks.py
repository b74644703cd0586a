"""Checks of a state-space model file that need no model: units, limits of inputs, the shape that is drawn."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from swashplate.errors import CardError
from swashplate.flights.base_units import is_unit
from swashplate.flights.schema import channel


def units(given: Mapping[str, Any], *, path: str) -> None:
    """That what stands for a unit is one, and that channels of flights are in the flights' own.

    Args:
        given: units by entry of the file, e.g. "outputs.p.unit". path: of the file.

    Raises:
        CardError: naming the entry.
    """
    for entry, unit in given.items():
        if not isinstance(unit, str) or (unit and not is_unit(unit)):
            raise CardError(
                f"unit {unit!r} is not known, expected a unit or a product of units.",
                where=path,
                channel=entry,
                hint='For example "rad/s", "m/s^2", "rad/(m s)" or "1"; "" where there is none.',
            )
        part, _, name = entry.removesuffix(".unit").partition(".")
        wanted = channel(name).unit
        if part in ("inputs", "outputs") and unit and wanted and unit != wanted:
            raise CardError(
                f"unit is {unit!r}, expected {wanted!r}: flights hold '{name}' in {wanted}.",
                where=path,
                channel=entry,
                hint="Convert the model's numbers, or give the channel another name.",
            )


def delays(
    names: Collection[str],
    inputs: Sequence[str],
    outputs: Sequence[str],
    entries: Collection[tuple[str, str]],
    *,
    path: str,
) -> None:
    """That delays belong to inputs, to responses (output/input) or to entries (state_dot/input), not to several.

    Args:
        names: of the delays.
        inputs, outputs: of the model. entries: state and input of each entry of G.
        path: of the file.

    Raises:
        CardError: naming the entry.
    """
    of_entries: dict[str, str] = {}
    listed = ", ".join(f"{state}_dot/{name}" for state, name in sorted(entries))
    for name in names:
        row, _, column = name.rpartition("/")
        if column in inputs and (name == column or row in outputs):
            continue
        if (row.removesuffix("_dot"), column) not in entries or not row.endswith("_dot"):
            raise CardError(
                "is no input, no 'output/input' and no 'state_dot/input' of an entry of this model.",
                where=path,
                channel=f"delays.{name}",
                hint=f"Inputs are {', '.join(inputs)}; entries are {listed}.",
            )
        of_entries[column] = name
    for name in names:
        row, _, column = name.rpartition("/")
        if row in outputs and column in of_entries:
            raise CardError(
                f"is the delay of a response, {of_entries[column]} that of an entry: expected one kind for an input.",
                where=path,
                channel=f"delays.{name}",
            )


def limits(table: Mapping[str, Any], inputs: Sequence[str], *, path: str) -> None:
    """That limits belong to inputs and have two ends.

    Raises:
        CardError: naming the entry.
    """
    for name, ends in table.items():
        if name not in inputs:
            raise CardError("is no input of this model.", where=path, channel=f"limits.{name}")
        numbers = isinstance(ends, list) and len(ends) == 2
        if not numbers or any(isinstance(v, bool) or not isinstance(v, int | float) for v in ends):
            raise CardError(f"is {ends!r}, expected [low, high].", where=path, channel=f"limits.{name}")


def shape(table: Mapping[str, Any], *, path: str) -> None:
    """That a shape is a rotor's radius that can be drawn.

    Raises:
        CardError: naming the entry.
    """
    for name, size in table.items():
        if name != "rotor_radius":
            raise CardError("is no part of a shape.", where=path, channel=f"shape.{name}", hint="It has rotor_radius.")
        if isinstance(size, bool) or not isinstance(size, int | float) or not 0.0 < size < 100.0:
            raise CardError(f"is {size!r}, expected 0 to 100 m.", where=path, channel=f"shape.{name}")
