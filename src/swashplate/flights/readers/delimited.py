"""CSV logs: one time column, one column a channel, units in the header (`phi [deg]`) or in a small mapping file.

A mapping file is TOML; with one, only the channels it names are read:

    rate = 50                # optional: Hz, where the table has no time column
    delimiter = ","          # optional: comma, semicolon, tab and spaces are told apart
    header = true            # false where the first line is data already; then columns are numbers from 1

    [channels]
    time = {column = "TimeUS", unit = "us"}           # optional where the header names it; ["Date", "Time"] for two
    phi = {column = "Roll", unit = "deg"}
    servo_pitch = {column = 7, unit = "1", factor = -0.002, offset = 3.0}

A value inside is (cell * factor + offset), then converted from `unit`. Axes are not turned: a CSV log is expected in
the schema's own axes (NED, FRD), or brought there with factors of -1.

Where the header stands and which rows are whole is found by `table_layout`, what names and units mean by
`table_columns`, the time by `table_time`, and what blank cells mean by `table_flight`.
"""

from __future__ import annotations

from swashplate.flights.flight import Flight
from swashplate.flights.readers import tables
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_flight import flight_of
from swashplate.flights.readers.table_layout import read_table

NAME = "csv"
VERSION = "1"


def recognises(source: Source) -> bool:
    """Any text with more than one column; the motion capture exports are asked first."""
    text = source.text
    if text is None or any(mark in text[:65536] for mark in ",;\t"):
        return text is not None
    rows = [line.split() for line in text[:4096].splitlines()[:-1] if line.strip() and not line.startswith("#")]
    return bool(rows) and all(len(row) > 1 and all(map(tables.is_number, row)) for row in rows)


def read(source: Source, options: Options) -> Flight:
    """A CSV log as a flight with one stream, "log", and more where blank cells show other rates.

    Args:
        source: the file.
        options: `units` by channel where the header has none; `mapping`; `bad_stamps`.

    Raises:
        FlightError, UnitError: naming the file, every channel or line that is wrong, what was found and what to do.
    """
    table = read_table(source.text or "", where=source.name, mapping=options.mapping)
    if table.preface:
        count = len(table.preface)
        table.remarks.notes.append(f"{count} line{'s' * (count != 1)} before the header: not read")
    return flight_of(table, source, options, reader=NAME, version=VERSION)
