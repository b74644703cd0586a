"""The options that a message names, so that a button can apply them: a unit, or leaving out bad time stamps."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

_UNIT = re.compile(r"--unit (?P<name>\w+)=(?P<unit>[^\s,;()]+)(?: \(and (?P<more>[\w, ]+?) alike\))?")
_DROP = "--drop-bad-stamps"


@dataclass(frozen=True)
class Remedy:
    """Options of a reading that a button applies.

    Attributes:
        units: by channel or field.
        drop_bad_stamps: leave out samples whose time repeats or goes backwards.
    """

    units: Mapping[str, str] = field(default_factory=dict)
    drop_bad_stamps: bool = False

    @property
    def option_text(self) -> str:
        """The options as the command line has them."""
        given = [f"--unit {name}={unit}" for name, unit in self.units.items()]
        return " ".join([*given, *([_DROP] if self.drop_bad_stamps else [])])

    def to_document(self) -> dict[str, object]:
        """As the page has it."""
        return {"words": self.option_text, "units": dict(self.units), "drop_bad_stamps": self.drop_bad_stamps}


def remedy(text: str) -> Remedy | None:
    """What a message says would mend it; None where it names no option of a reading."""
    units: dict[str, str] = {}
    for match in _UNIT.finditer(text):
        unit = match["unit"].rstrip(".")
        for name in (match["name"], *re.findall(r"\w+", match["more"] or "")):
            units[name] = unit
    drop = _DROP in text
    return Remedy(units, drop) if units or drop else None
