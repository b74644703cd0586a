"""X-Plane's Data.txt: columns parted by bars, named "name,unit" and padded with underscores.

Angles, body rates, latitude, longitude and true airspeed become the schema's channels; every other column keeps its
name. X-Plane's rates are about the body's axes forward, right and down, as the schema's.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from swashplate.flights import units
from swashplate.flights.flight import Flight
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_flight import flight_of
from swashplate.flights.readers.table_layout import read_table

NAME = "csv"
VERSION = "1"

_CLOCKS = ("real,time", "totl,time", "missn,time", "timer,time")
_CHANNELS = {
    "pitch,deg": "theta [deg]", "roll,deg": "phi [deg]", "hding,true": "psi [deg]", "p,rad/s": "p [rad/s]",
    "q,rad/s": "q [rad/s]", "r,rad/s": "r [rad/s]", "lat,deg": "latitude [deg]", "lon,deg": "longitude [deg]",
    "vtrue,ktas": "airspeed [kn]",
}  # fmt: skip


def recognises(source: Source) -> bool:
    """Text whose first line with bars names one of X-Plane's clocks."""
    return source.text is not None and any(clock in map(_lowered, _cells(source.text[:8192])) for clock in _CLOCKS)


def read(source: Source, options: Options) -> Flight:
    """The table as a flight; see `delimited.read` for options and errors."""
    text = source.text or ""
    header = next(line for line in text.splitlines() if "|" in line)
    named = _named(_cells(text))
    rest = text[text.index(header) + len(header) :].replace(header, "")
    rows = (line.strip().strip("|") for line in rest.splitlines())
    table = read_table("\n".join(["|".join(named), *filter(None, rows)]), where=source.name, mapping={"delimiter": "|"})
    return flight_of(table, source, options, reader=NAME, version=VERSION)


def _cells(text: str) -> Sequence[str]:
    """The names of the first line with bars."""
    line = next((line for line in text.splitlines() if "|" in line), "")
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def _lowered(cell: str) -> str:
    return ",".join(part.strip("_ ") for part in cell.lower().split(","))


def _named(cells: Sequence[str]) -> list[str]:
    """Names as a table has them: each once, with the unit where it is known."""
    clock = next(name for name in _CLOCKS if name in map(_lowered, cells))
    titles: list[str] = []
    for cell in cells:
        lowered, (name, _, unit) = _lowered(cell), cell.partition(",")
        if lowered == clock:
            title = "time [s]"
        elif lowered in _CHANNELS:
            title = _CHANNELS[lowered]
        else:
            said = unit.strip("_ ")
            title = re.sub(r"_+", "_", f"{name.strip('_ ')} [{said}]" if units.is_known(said) else cell.strip("_ "))
        beside = sum(other.partition(" [")[0] == title.partition(" [")[0] for other in titles)
        titles.append(title.replace(" [", f"_{beside + 1} [") if beside and "[" in title else title)
        if beside and "[" not in title:
            titles[-1] = f"{title}_{beside + 1}"
    return [title.replace(",", " ") for title in titles]
