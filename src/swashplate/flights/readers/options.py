"""What a user may tell a reader that the file itself does not say."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from swashplate import documents
from swashplate.errors import FlightError

_MOCAP_KEYS = ("body", "rotation", "body_axes", "world_axes")


@dataclass(frozen=True)
class Options:
    """Arguments of `read` as the readers see them.

    Attributes:
        units: units by column or field name, where the file has none or wrong ones.
        mapping: the parsed mapping file (see `readers/delimited.py`).
        mapping_file: its name, for messages about it; "" where it was given as a dictionary.
        body: the tracked body, where a motion capture file has several.
        rotation: "helical", "euler_xyz" or "quaternion", where the file does not say.
        body_axes: where the logged body axes x, y, z point, for example "forward-left-up".
        world_axes: where the logged world axes x, y, z point, for example "north-west-up".
        bad_stamps: "error", or "drop" to leave out samples whose time does not increase.
        log: which of a file's logs is read, from 1; None for the longest.
    """

    units: Mapping[str, str] = field(default_factory=dict)
    mapping: Mapping[str, Any] = field(default_factory=dict)
    mapping_file: str = ""
    body: str | None = None
    rotation: str | None = None
    body_axes: str | None = None
    world_axes: str | None = None
    bad_stamps: str = "error"
    log: int | None = None


def load_mapping(mapping: str | os.PathLike[str] | Mapping[str, Any] | None) -> Mapping[str, Any]:
    """The mapping as a dictionary, read from a TOML file where a path is given."""
    if mapping is None:
        return {}
    if isinstance(mapping, Mapping):
        return mapping
    hint = "Correct the mapping file; `docs/howto/your-own-csv.md` has one to copy."
    document = documents.read_document(Path(mapping), form="toml", error=FlightError, hint=hint)
    if not document:
        raise FlightError("says nothing.", where=Path(mapping), hint=hint)
    return document


def with_mocap_table(options: Options) -> Options:
    """Options completed from the mapping's table `[mocap]`; arguments win over the file."""
    table = options.mapping.get("mocap", {})
    if not isinstance(table, Mapping) or set(table) - set(_MOCAP_KEYS):
        raise FlightError(
            f"the mapping's table [mocap] may hold {', '.join(_MOCAP_KEYS)}; found {table!r}.",
            where=options.mapping_file or None,
            hint="Correct the key.",
        )
    given: dict[str, Any] = {key: getattr(options, key) or table.get(key) for key in _MOCAP_KEYS}
    wrong = [key for key, value in given.items() if not isinstance(value, str | None)]
    if wrong:
        raise FlightError(
            f"'{wrong[0]}' in the mapping's table [mocap] must be text.",
            where=options.mapping_file or None,
            channel=wrong[0],
        )
    return replace(options, **given)


def refuse_mapping(options: Options, what: str, *, where: str) -> None:
    """Raises a FlightError where a mapping is given for a file whose channels are known, such as "a ULog file"."""
    if options.mapping:
        raise FlightError(
            f"a mapping has no meaning for {what}: its channels are known.", where=where, hint="Leave it out."
        )
