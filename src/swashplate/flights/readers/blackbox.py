"""Blackbox logs of Rotorflight and Betaflight (`.bbl`, `.bfl`, `.txt`): the firmware that small helicopters fly.

One stream of the main frames, one of GPS frames where there are any; slow frames and events become events. Times are
the autopilot's own: seconds since its start. What fields are is said in `blackbox_fields`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.provenance import Event
from swashplate.flights.readers import blackbox_header, checks, clocked
from swashplate.flights.readers.blackbox_encodings import Whole
from swashplate.flights.readers.blackbox_fields import Fields, gps_place
from swashplate.flights.readers.blackbox_frames import FoundFrames, find_frames
from swashplate.flights.readers.blackbox_header import Header, as_number, read_header
from swashplate.flights.readers.blackbox_values import Main, main_frames
from swashplate.flights.readers.options import Options, refuse_mapping
from swashplate.flights.readers.source import Source

_AXES = (("roll", 7, 1.0), ("pitch", 8, -1.0), ("yaw", 9, -1.0))
"""Name, the same place in System ID's count of axes, and the sign from forward-left-up to forward-right-down."""
_OFF = 0.02  # of the frequency, beside a step of the field: what a chirp's own law does not explain
_FOLLOWS = 0.95  # of the samples
_FEWEST = 20  # samples


@dataclass(frozen=True)
class _Law:
    start_hz: float
    stop_hz: float
    seconds: float

    def since(self, hertz: Array) -> Array:
        """Time since the start [s] at which the chirp has a frequency [Hz]."""
        return np.asarray(self.seconds * np.log(hertz / self.start_hz) / np.log(self.stop_hz / self.start_hz))


def chirps(header: Header, columns: Mapping[str, Whole], time: Array) -> list[Event]:
    """The chirps that the log tells of.

    Args:
        columns: of the main frames, by field, shape (n,). time: of each frame [s], shape (n,).
    """
    law = _Law(
        0.1 * header.number("chirp_frequency_start_deci_hz"),
        0.1 * header.number("chirp_frequency_end_deci_hz"),
        header.number("chirp_time_seconds"),
    )
    if not (0.0 < law.start_hz < law.stop_hz and law.seconds > 0.0 and {"debug[1]", "debug[2]"} <= columns.keys()):
        return []
    axis, deci = columns["debug[1]"], columns["debug[2]"]
    on = np.isin(axis, range(len(_AXES))) & (deci > 0)
    edges = np.flatnonzero(np.diff(np.where(on, axis, -1), prepend=-1, append=-1))
    events = []
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if on[first] and last - first >= _FEWEST:
            hertz = np.asarray(0.1 * deci[first:last], dtype=np.float64)
            start = _start(law, time[first:last], hertz)
            if start is not None:
                events.append(_event(header, law, int(axis[first]), start, float(time[last - 1])))
    return events


def _start(law: _Law, time: Array, hertz: Array) -> float | None:
    """When the chirp began [s]; None where the field does not follow the header's law."""
    # A step of the field is 0.1 Hz: half of one is little where the frequency is high.
    sharp = hertz >= np.median(hertz)
    start = float(np.median(time[sharp] - law.since(hertz[sharp])))
    lawful = law.start_hz * (law.stop_hz / law.start_hz) ** ((time - start) / law.seconds)
    follows = np.abs(hertz - lawful) <= 0.1 + _OFF * lawful
    rises = law.since(hertz[-1:])[0] - law.since(hertz[:1])[0] > 0.0
    return start if rises and np.mean(follows) >= _FOLLOWS else None


def _event(header: Header, law: _Law, axis: int, start: float, last: float) -> Event:
    name, place, sign = _AXES[axis]
    magnitude = sign * header.number(f"chirp_amplitude_{name}", 1.0)
    chirp = Chirp(place, magnitude, law.start_hz, law.stop_hz, law.seconds, fade_in=0.0, fade_out=0.0, dwell=0.0)
    text = f"{chirp.axis_name}, {chirp.start_hz:g}-{chirp.stop_hz:g} Hz in {chirp.record:g} s"
    times = {"start": start, "stop": start + law.seconds, "seen": min(start + law.seconds, last)}
    return Event(start, "sweep", text, {**chirp.as_details(), **times, "channel": f"mixer_{name}"})


NAME = "blackbox"
VERSION = "1"
NAMES_UNITS = True
_KINDS = {14: "message", 15: "disarmed", 30: "mode"}


def recognises(source: Source) -> bool:
    """A file that holds the line with which every Blackbox log begins."""
    return blackbox_header.MARKER in source.content


def read(source: Source, options: Options) -> Flight:
    """A Blackbox log as a flight; of several in the file the largest, or the one that is asked for.

    What is damaged is left out and said: see `Provenance.damage`.

    Raises:
        FlightError: where the header says what cannot be, or nothing in the log can be used, or a mapping is
            given.
    """
    refuse_mapping(options, "a Blackbox log", where=source.name)
    start, stop, number, note = _chosen(source, options.log)
    header = read_header(source.content, start, stop, where=source.name)
    frames = find_frames(source.content, header, stop=stop, where=source.name)
    main = main_frames(frames, header)
    fields = Fields(header, header.layouts["I"].names)
    columns = fields.columns(main.columns)
    remarks = clocked.Remarks(list(note), [*_lost(frames), *main.damage])
    streams: dict[str, xr.Dataset] = {}
    data = clocked.made_stream("blackbox", main.time, columns, remarks=remarks)
    if data is None:
        raise FlightError(
            f"holds no flight: {len(main.time)} main frames of {frames.intra.size} can be used, and two are needed.",
            where=source.name,
            hint="Copy the log again; a log of nothing but a header was never written to.",
        )
    streams["blackbox"] = data
    gps = _gps(frames, header, main, remarks)
    if gps is not None:
        streams["gps"] = gps
    inputs = {
        str(n): np.asarray(v.values, np.float64) for n, v in data.data_vars.items() if str(n).startswith("mixer_")
    }
    remarks.notes += [*main.notes, *_unfinished(frames), *fields.remarks(columns), *checks.constant_notes(inputs)]
    provenance = source.provenance(
        NAME,
        VERSION,
        vehicle=" ".join(filter(None, (header.values.get("Craft name", ""), fields.firmware))),
        firmware=fields.called,
        notes=tuple(remarks.notes),
        damage=tuple(remarks.damage),
        parameters=_parameters(header, fields),
        events=_events(frames, header, main),
    )
    if note:
        provenance = replace(provenance, source=f"{source.path.name}#{number}")
    return Flight(streams, provenance)


def _chosen(source: Source, wanted: int | None) -> tuple[int, int, int, tuple[str, ...]]:
    """Where the log that is read begins and ends [bytes], its number, and a note where there are several."""
    starts = blackbox_header.starts(source.content)
    stops = (*starts[1:], source.size)
    if wanted is not None and not 1 <= wanted <= len(starts):
        raise FlightError(
            f"log {wanted} is asked for; the file holds {len(starts)}.", where=source.name, hint="Count from 1."
        )
    sizes = [stop - start for start, stop in zip(starts, stops, strict=True)]
    index = int(np.argmax(sizes)) if wanted is None else wanted - 1
    if len(starts) == 1:
        return starts[0], stops[0], 1, ()
    listed = ", ".join(f"{size:,}" for size in sizes[:12]) + (" ..." if len(sizes) > 12 else "")
    why = "the longest" if wanted is None else "as asked"
    note = (
        f"the file holds {len(starts)} logs ({listed} bytes); number {index + 1} was read, {why}: FILE#N (in Python "
        "log=N) takes another"
    )
    return starts[index], stops[index], index + 1, (note,)


def _unfinished(frames: FoundFrames) -> list[str]:
    if frames.unfinished:
        return [f"the last {frames.unfinished} bytes are an unfinished frame: not read"]
    return [] if frames.ended else ["the log has no end mark: it was cut off, or the power was"]


def _lost(frames: FoundFrames) -> list[str]:
    if not frames.lost and not frames.waiting:
        return []
    places = "place" if frames.places == 1 else "places"
    return [
        f"{frames.lost} bytes at {frames.places} {places} belong to no frame, and {frames.waiting} P frames have no I "
        "frame before them: they were skipped"
    ]


def _parameters(header: Header, fields: Fields) -> dict[str, float]:
    """Numbers of the header by name; of a row of numbers `rollPID_0`, `rollPID_1`, ..."""
    parameters = {}
    for name, text in header.values.items():
        key = re.sub(r"\W+", "_", name).strip("_")
        parts = text.split(",")
        for i, part in enumerate(parts[:32]):
            value = as_number(part.strip(), np.nan)
            if key and np.isfinite(value):
                parameters[key if len(parts) == 1 else f"{key}_{i}"] = value
    if fields.rotorflight:
        return parameters | _rotorflight_gains(parameters)
    return parameters | (_betaflight_gains(parameters) if "betaflight" in fields.firmware.lower() else {})


def _betaflight_gains(numbers: Mapping[str, float]) -> dict[str, float]:
    """Betaflight's gains by the names of its command line (`p_roll`), and the joint corner of D's filters [Hz].

    Headers that tell `d_max` are of 2025.12 and later, where D is not the largest one of each axis. None where a filter
    of D is not of first order or the rows are missing: nothing is said of such a loop.
    """
    first = numbers.get("dterm_lpf1_dyn_hz_0") or numbers.get("dterm_lpf1_static_hz")
    second = numbers.get("dterm_lpf2_static_hz")
    if "d_max_0" not in numbers or first is None or second is None or numbers.get("dterm_notch_hz"):
        return {}
    if (first and numbers.get("dterm_lpf1_type")) or (second and numbers.get("dterm_lpf2_type")):
        return {}
    lag = sum(1.0 / corner for corner in (first, second) if corner)
    gains = {
        f"{name}_{axis}": numbers[f"{axis}PID_{i}"]
        for axis in ("roll", "pitch", "yaw")
        for i, name in enumerate("pid")
        if f"{axis}PID_{i}" in numbers
    }
    return {**gains, "dterm_lpf": 1.0 / lag if lag else 0.0} if gains else {}


def _rotorflight_gains(numbers: Mapping[str, float]) -> dict[str, float]:
    """Rotorflight's gains and cut-offs by the names of its command line (`roll_p_gain`).

    Headers with five gains an axis (P, I, D, F, B) are of firmwares whose scales are known: `rate_gain_names`.
    """
    gains: dict[str, float] = {}
    for axis in ("roll", "pitch", "yaw"):
        for header, names in (("PID", "pidfb"), ("BW", ("gyro", "d", "b"))):
            if f"{axis}PID_4" in numbers:
                gains |= {
                    f"{axis}_{name}_{'gain' if header == 'PID' else 'cutoff'}": numbers[f"{axis}{header}_{i}"]
                    for i, name in enumerate(names)
                    if f"{axis}{header}_{i}" in numbers
                }
    return gains


def _when(after: int, main: Main) -> float:
    """The time [s] of the main frame before an event."""
    return float(main.clock[min(max(after - 1, 0), main.clock.size - 1)]) if main.clock.size else 0.0


def _events(frames: FoundFrames, header: Header, main: Main) -> tuple[Event, ...]:
    events = chirps(header, main.columns, main.time)
    for frame in frames.events:
        time = _when(frame.after, main)
        if frame.kind == 14:  # a pause lies behind it
            time = _when(frame.after + 1, main)
        numbers = {f"number_{i}": value for i, value in enumerate(frame.numbers)}
        shown = " ".join(f"{value:g}" for value in frame.numbers)
        events.append(Event(time, _KINDS.get(frame.kind, "message"), f"{frame.text} {shown}".strip(), numbers))
    if "S" in frames.others:
        written, after = frames.others["S"]
        for row, name in zip(written, header.layouts["S"].names, strict=True):
            changed = np.flatnonzero(np.diff(row, prepend=row[0] - 1)).tolist()
            for i in changed:
                kind = "mode" if name == "flightModeFlags" else "message"
                events.append(Event(_when(int(after[i]), main), kind, f"{name} {row[i]}", {"number": float(row[i])}))
    return tuple(sorted(events, key=lambda event: event.time))


def _gps(frames: FoundFrames, header: Header, main: Main, remarks: clocked.Remarks) -> xr.Dataset | None:
    """GPS frames: places count from the home before them, times from the main frame before them."""
    if "G" not in frames.others or not main.clock.size:
        return None
    written, after = frames.others["G"]
    layout = header.layouts["G"]
    base = np.array([_when(int(count), main) for count in after])
    time = np.asarray(base)
    columns: dict[str, tuple[Array, str]] = {}
    for row, name, predictor in zip(written, layout.names, layout.predictors, strict=True):
        values = row.astype(np.float64)
        if name == "time":
            time = base + values / 1e6 if predictor == 10 else values / 1e6
            continue
        if predictor == 7:
            values = values + _home(frames, header, name, after)
        channel, unit, factor = gps_place(name)
        columns[channel] = (values * factor, unit)
    return clocked.made_stream("gps", time, _unlike(columns), remarks=remarks)


def _unlike(columns: Mapping[str, tuple[Array, str]]) -> dict[str, tuple[Array, str]]:
    """The columns without those that the main frames may hold."""
    return {name: column for name, column in columns.items() if name.lower().startswith(("gps", "lat", "lon"))}


def _home(frames: FoundFrames, header: Header, name: str, after: Whole) -> Array:
    """The home coordinate that stands before each GPS frame; NaN where none does."""
    home = np.full(after.size, np.nan)
    if "H" not in frames.others:
        return home
    written, stands = frames.others["H"]
    wanted = name.replace("coord", "home")
    names = header.layouts["H"].names
    if wanted not in names:
        return home
    index = np.searchsorted(stands, after, side="right") - 1
    there = index >= 0
    home[there] = written[names.index(wanted)][index[there]]
    return home
