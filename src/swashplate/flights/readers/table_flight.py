"""A flight from a table: its columns as channels, one stream for all that have a number in the same rows.

A cell that is blank has no sample. A channel that has a number in every fourth row was logged at a quarter of the rate:
it becomes a stream of its own, and nothing is lost. Where a few numbers are missing their rows are left out, where many
are the channel has a stream of its own, and both are told with their share. All faults of a table are told at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.readers import checks, clocked, table_columns, table_time, tables
from swashplate.flights.readers.checks import Faults
from swashplate.flights.readers.clocked import Remarks, share
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_columns import Column
from swashplate.flights.readers.table_layout import ColumnTable
from swashplate.flights.readers.table_time import Stamps
from swashplate.flights.schema import LOGGED_UNIT, is_known
from swashplate.registry import nearest

_FEW = 0.02  # of the rows: as many may lack a number, and the channels still go together
_USUAL = {"latitude": "deg", "longitude": "deg"}
"""Units of channels that nobody writes in another one."""
_SLOWER = 1.5  # times the table's step: a channel whose own steps are longer was logged at a rate of its own


@dataclass(frozen=True)
class _Chosen:
    """The columns of channels by name, and that of time with the name that the header has for it.

    `lost`: a mapping names the time, and wrongly, which is told already.
    """

    channels: Mapping[str, Column]
    time: Column | None
    time_name: str
    lost: bool = False


def flight_of(table: ColumnTable, source: Source, options: Options, *, reader: str, version: str) -> Flight:
    """A table as a flight.

    Args:
        options: `units` by channel where the table has none; `mapping`; `bad_stamps`.

    Raises:
        FlightError, UnitError: naming the file, every channel or line that is wrong, what was found and what to do.
    """
    faults, remarks = Faults(source.name), table.remarks
    chosen = _chosen(table, options, faults)
    given = _given_units(options, chosen)
    units = {name: given.get(name, place.unit or _USUAL.get(name)) for name, place in chosen.channels.items()}
    _check_given(given, chosen, table, faults)
    table_columns.check_units(units, table.where, faults)
    channels, labels = _numbers(table, chosen.channels, units, faults, mapped=bool(options.mapping))
    stamps = _stamps(table, chosen, given, options, faults)
    faults.refuse(beside=remarks.notes)
    if not channels or stamps is None:
        raise FlightError("there is no channel beside time.", where=source.name, hint="Export the channels too.")
    streams: dict[str, xr.Dataset] = {}
    with faults.gathered():
        streams = streams_of(
            stamps, channels, labels, where=source.name, bad_stamps=options.bad_stamps, remarks=remarks
        )
    faults.refuse(beside=[*remarks.notes, *remarks.damage])
    for data in streams.values():
        for name in map(str, data.data_vars):
            if units[name] and units[name] != data[name].attrs.get("units"):
                data[name].attrs[LOGGED_UNIT] = units[name]
    remarks.notes += table_columns.near_misses(list(channels))
    remarks.notes += checks.constant_notes({n: v[np.isfinite(v)] for n, v in channels.items()})
    provenance = source.provenance(
        reader, version, notes=tuple(remarks.notes), damage=tuple(remarks.damage), epoch=stamps.zero
    )
    return Flight(streams, provenance)


# ---- which columns, in which units -----------------------------------------------------------------------------------
def _chosen(table: ColumnTable, options: Options, faults: Faults) -> _Chosen:
    """What the header or the mapping names; a mapping that says nothing of time leaves it to the header."""
    named = table_columns.from_header(table, Faults(table.where) if options.mapping else faults)
    name = table_time.time_name(named) or ""
    time = named.get(name)
    if time is not None:
        unit = time.unit if time.unit is not None else table_time.named_unit(name)
        time = replace(time, unit=unit, date=table_time.date_beside(name, named))
    if options.mapping:
        mapped = table_columns.from_mapping(options, table, faults)
        if "time" in options.mapping["channels"]:
            asked = mapped.pop("time", None)
            return _Chosen(mapped, asked, "time", lost=asked is None)
        return _Chosen(mapped, time if options.mapping.get("rate") is None else None, "time")
    left = {time.index, time.date} if time is not None else set[int | None]()
    return _Chosen({n: column for n, column in named.items() if column.index not in left}, time, name)


def _given_units(options: Options, chosen: _Chosen) -> dict[str, str]:
    """Units by channel; a unit that is given for the time column's own name in the header is the time's."""
    given = dict(options.units)
    if chosen.time_name in given and chosen.time_name not in chosen.channels:
        given.setdefault("time", given.pop(chosen.time_name))
    return given


def _check_given(given: Mapping[str, str], chosen: _Chosen, table: ColumnTable, faults: Faults) -> None:
    there = [*(["time"] if chosen.time is not None else []), *chosen.channels]
    unknown = set(given) - set(there)
    if unknown:
        faults.add(
            UnitError(
                f"units are given for a column that the file lacks; it has {', '.join(there)}.",
                where=table.where,
                channel=", ".join(sorted(unknown)),
                hint=nearest(min(unknown), there) or "Correct the name that the unit is given for.",
            )
        )


def _stamps(
    table: ColumnTable, chosen: _Chosen, given: Mapping[str, str], options: Options, faults: Faults
) -> Stamps | None:
    """The times of the rows; None where that is a fault."""
    rate = options.mapping.get("rate")
    with faults.gathered():
        if rate is not None and (
            isinstance(rate, bool) or not isinstance(rate, int | float) or not 0.0 < rate < np.inf
        ):
            raise FlightError(f"rate = {rate!r} in the mapping is not a positive number.", where=table.where)
        if chosen.time is not None:
            return table_time.stamps(table, chosen.time, given.get("time", chosen.time.unit))
        if chosen.lost:
            return None
        if rate is not None:
            return Stamps(np.arange(len(table)) / float(rate))
        raise FlightError(
            f"there is no time column; found {', '.join(chosen.channels) or 'nothing'}.",
            where=table.where,
            channel="time",
            hint=table_time.time_hint(chosen.channels),
        )
    return None


# ---- numbers ---------------------------------------------------------------------------------------------------------
def _numbers(
    table: ColumnTable, columns: Mapping[str, Column], units: Mapping[str, str | None], faults: Faults, *, mapped: bool
) -> tuple[dict[str, Array], dict[str, str]]:
    """Values inside, NaN where a cell is blank, and their units, by channel; columns of text are passed over."""
    channels, labels, text, blank = dict[str, Array](), dict[str, str](), list[str](), list[str]()
    for name, place in columns.items():
        try:
            raw = table.numbers(place.index, name=name)
        except FlightError as error:
            if mapped or is_known(name) or any(map(tables.is_number, table.texts(place.index))):
                faults.add(error)
            else:
                text.append(name)
            continue
        if len(raw) and np.isnan(raw).all():
            if mapped:
                faults.add(FlightError("is blank throughout.", where=table.where, channel=name))
            blank.append(name)
            continue
        with faults.gathered():
            there = ~np.isnan(raw)
            checks.finite(np.where(there, raw, 0.0), channel=name, where=table.where)
            with np.errstate(over="ignore"):  # what overflows is refused below, by name
                scaled = raw if (place.factor, place.offset) == (1.0, 0.0) else raw * place.factor + place.offset
            values, label = table_columns.inside(scaled, name, units[name], where=table.where)
            checks.finite(np.where(there, values, 0.0), channel=name, where=table.where)
            channels[name], labels[name] = values, label
    for names, what in ((text, "no numbers"), (blank, "nothing")):
        if names:
            hold = "holds" if len(names) == 1 else "hold"
            table.remarks.notes.append(f"{', '.join(names)} {hold} {what}: not read")
    return channels, {name: label for name, label in labels.items() if not is_known(name)}


# ---- streams ---------------------------------------------------------------------------------------------------------
def streams_of(
    stamps: Stamps,
    channels: Mapping[str, Array],
    labels: Mapping[str, str],
    *,
    where: str,
    bad_stamps: str,
    remarks: Remarks,
) -> dict[str, xr.Dataset]:
    """The streams of a table's channels: "log", and "log_2", ... for those with other blanks.

    Args:
        channels: values inside by channel, NaN where a cell is blank, shape (n,).
        labels: units of channels that the schema does not know.
        remarks: takes what was left out.
    """
    timed = np.isfinite(stamps.time)
    if not timed.all():
        remarks.damage.append(f"{share(int((~timed).sum()), timed.size, 'rows')} are lost: their time is blank")
    time, keep = clocked.usable(
        stamps.time[timed],
        [values[timed] for values in channels.values()],
        where=where,
        bad_stamps=bad_stamps,
        remarks=remarks,
        tick=stamps.tick,
        turns=stamps.turns,
    )
    values = {name: column[timed][keep] for name, column in channels.items()}
    streams: dict[str, xr.Dataset] = {}
    for names, there in _together(values, remarks):
        if there.sum() < 2:
            remarks.notes.append(f"{', '.join(names)}: less than two numbers: not read")
            continue
        if streams or there.sum() < (1.0 - _FEW) * there.size:
            _tell_blanks(names, time, there, remarks)
        chosen = {name: values[name][there] for name in names}
        called = "log" if not streams else f"log_{len(streams) + 1}"
        streams[called] = stream(time[there], chosen, {n: labels[n] for n in names if n in labels})
    if not streams:
        raise FlightError(
            "no channel has two numbers or more.", where=where, channel=", ".join(values), hint="Give a longer record."
        )
    return streams


def _together(values: Mapping[str, Array], remarks: Remarks) -> list[tuple[list[str], clocked.Mask]]:
    """Channels that go into one stream, and the rows in which they have numbers, the fullest first."""
    finite = {name: np.isfinite(column) for name, column in values.items()}
    n = next(iter(finite.values())).size
    joint, in_first = np.ones(n, dtype=np.bool_), set[str]()
    for name in sorted(finite, key=lambda name: -int(finite[name].sum())):
        both = joint & finite[name]
        if n - both.sum() <= _FEW * n:
            joint = both
            in_first.add(name)
    if lost := int(n - joint.sum()):
        missing = ", ".join(
            f"{name} ({n - finite[name].sum()})" for name in values if name in in_first and not finite[name].all()
        )
        remarks.damage.append(f"{share(lost, n, 'rows')} are lost: a number is missing in {missing}")
    groups: dict[bytes, list[str]] = {}
    for name in values:
        if name not in in_first:
            groups.setdefault(np.packbits(finite[name]).tobytes(), []).append(name)
    apart = [(names, finite[names[0]]) for names in groups.values()]
    first = [([name for name in values if name in in_first], joint)] if in_first else []
    return [*first, *sorted(apart, key=lambda group: -int(group[1].sum()))]


def _tell_blanks(names: list[str], time: Array, there: clocked.Mask, remarks: Remarks) -> None:
    """What many blank cells mean: a rate of its own, or samples that are missing."""
    count = int((~there).sum())
    step, usual = float(np.median(np.diff(time[there]))), float(np.median(np.diff(time)))
    cells = f"{', '.join(names)}: {share(count, time.size, 'cells')} are blank"
    if step > _SLOWER * usual:
        remarks.notes.append(f"{cells}: a stream of its own, at {1.0 / step:.4g} Hz")
    else:
        remarks.damage.append(f"{cells}: these samples are lost")
