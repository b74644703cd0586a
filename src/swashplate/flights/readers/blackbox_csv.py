"""Blackbox logs that another program has made a table of: `blackbox_decode`, or Blackbox Explorer's CSV export.

The fields are those of the log (`blackbox_fields` says what they are), times are in microseconds. `blackbox_decode`
writes units behind some names and numbers in them (`vbatLatest (V)`). Explorer writes the log's header above the table,
`blackbox_decode` leaves it out: then the firmware is not known.
"""

from __future__ import annotations

import re

from swashplate.arrays import Array
from swashplate.flights.flight import Flight
from swashplate.flights.readers import checks, clocked, tables
from swashplate.flights.readers.blackbox_fields import Fields
from swashplate.flights.readers.blackbox_header import Header
from swashplate.flights.readers.options import Options, refuse_mapping
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_flight import streams_of
from swashplate.flights.readers.table_layout import DelimitedTable, read_table
from swashplate.flights.readers.table_time import Stamps
from swashplate.flights.schema import is_known

NAME = "blackbox csv"
VERSION = "1"
NAMES_UNITS = True

_HEAD = re.compile(r'^"?loopIteration"?\s*,\s*"?time\b', re.MULTILINE)
_CONVERTED = {("vbatLatest", "V"): "voltage", ("amperageLatest", "A"): "current"}
"""Fields that `blackbox_decode` has brought to the unit that it writes behind their names."""


def recognises(source: Source) -> bool:
    """A text with a line of names that begins with a Blackbox log's first two fields."""
    return source.text is not None and _HEAD.search(source.text[: 1 << 16]) is not None


def read(source: Source, options: Options) -> Flight:
    """A table of Blackbox fields as a flight, with the channels, units and signs that the log itself would give.

    Raises:
        FlightError: where the table does not hold together, or a mapping is given that names no channels.
    """
    refuse_mapping(options, "a Blackbox log", where=source.name)
    table = read_table(source.text or "", where=source.name, mapping={})
    numbers, units = _fields(table)
    header = _header(table)
    fields = Fields(header, tuple(numbers))
    columns = fields.columns(numbers)
    for name, unit in units.items():
        if (channel := _CONVERTED.get((name, unit))) is not None:
            columns.pop(name, None)
            columns[channel] = (numbers[name], unit)
    inside = {channel: clocked.converted(values, unit) for channel, (values, unit) in columns.items()}
    remarks = table.remarks
    streams = streams_of(
        Stamps(numbers["time"] / 1e6),
        {channel: values for channel, (values, _) in inside.items()},
        {channel: unit for channel, (_, unit) in inside.items() if not is_known(channel)},
        where=source.name,
        bad_stamps=options.bad_stamps,
        remarks=remarks,
    )
    remarks.notes += fields.remarks(columns)
    if "blackbox_high_resolution" not in header.values:
        remarks.notes.append(
            "the table does not say whether blackbox_high_resolution was on: rates are read as if it was not"
        )
    inputs = {channel: values for channel, (values, _) in inside.items() if channel.startswith("mixer_")}
    remarks.notes += checks.constant_notes(inputs)
    provenance = source.provenance(
        NAME, VERSION, vehicle=fields.firmware, notes=tuple(remarks.notes), damage=tuple(remarks.damage)
    )
    return Flight(streams, provenance)


def _fields(table: DelimitedTable) -> tuple[dict[str, Array], dict[str, str]]:
    """Numbers by field, and the unit that stands behind its name; fields of words ("IDLE") are passed over."""
    numbers, units, texts = dict[str, Array](), dict[str, str](), list[str]()
    for index, cell in enumerate(table.header):
        name, _, behind = cell.partition(" (")
        unit = behind.removesuffix(")")
        if name != "time" and not tables.is_number(table.first(index)):
            texts.append(name)
        elif name:
            numbers[name] = table.numbers(index, name=name)
            units |= {name: unit} if unit else {}
    if texts:
        table.remarks.notes.append(f"{', '.join(filter(None, texts))}: no numbers: not read")
    return numbers, units


def _header(table: DelimitedTable) -> Header:
    """What Explorer wrote above the table, under the names that the log has for it."""
    values = {row[0]: ",".join(row[1:]) for row in table.preface if len(row) > 1}
    firmware = " ".join(values[key] for key in ("firmwareType", "firmwareVersion") if key in values)
    return Header({**values, "Firmware revision": firmware}, {}, 0)
