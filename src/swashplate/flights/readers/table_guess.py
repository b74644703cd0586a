"""What the columns of anybody's table may be: channel, unit and sign, for a person to confirm.

A guess is never read unasked. It fills in a mapping (`readers/delimited.py`), which says it in the file's own words.
Names are looked for in English, German, French, Italian and Spanish, and as programs of this field write them.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import tomli_w

from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.flights import units
from swashplate.flights.readers import delimited, mat_table, table_columns, table_time
from swashplate.flights.readers.options import Options
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_layout import ColumnTable, read_table
from swashplate.flights.schema import channel, is_known

_TURN, _GRAVITY = 6.4, 9.80665
_MANY = 300
"""Columns of a table that a person would map."""


@dataclass(frozen=True)
class Guess:
    """A column and what it may be.

    Attributes:
        index: of the column, from 0. name: of the header, "" where there is none.
        channel: its channel, "" where nobody knows. unit: in the file, "" where nobody knows.
        factor, offset: before the unit, as a mapping has them.
        why: what the guess rests on.
    """

    index: int
    name: str
    channel: str = ""
    unit: str = ""
    factor: float = 1.0
    offset: float = 0.0
    why: str = ""


def table_in(source: Source, mapping: Mapping[str, Any]) -> ColumnTable | None:
    """The table of a file that a mapping has a meaning for; None where it is none.

    Raises:
        FlightError: where it is a table, and damaged.
    """
    if mat_table.recognises(source):
        return mat_table.table_of(source, Options(mapping=mapping))
    if source.text is not None and delimited.recognises(source):
        return read_table(source.text, where=source.name, mapping=mapping)
    return None


# ---- names -----------------------------------------------------------------------------------------------------------
_AXES = {
    "roll": (
        "roll", "rol", "rll", "querruder", "aileron", "ail", "alettone", "alabeo", "roulis", "rollio", "lateral", "lat",
    ),
    "pitch": (
        "pitch", "pit", "pch", "ptch", "nick", "hohenruder", "hoehenruder", "elevator", "ele", "elev", "tangage",
        "cabeceo", "beccheggio", "profondeur", "longitudinal", "lon",
    ),
    "yaw": (
        "yaw", "gier", "seitenruder", "rudder", "rud", "lacet", "guinada", "imbardata", "pedal", "heading", "hdg",
    ),
    "collective": (
        "collective", "coll", "col", "throttle", "thr", "thrust", "gas", "kollektiv", "collectif", "pas",
    ),
}  # fmt: skip
_SURFACES = frozenset((
    "querruder", "aileron", "ail", "alettone", "hohenruder", "hoehenruder", "elevator", "ele", "elev", "profondeur",
    "seitenruder", "rudder", "rud", "pedal", "lateral", "longitudinal",
))  # fmt: skip
"""What is moved, and so a command where nothing else is said."""
_RATES = (
    "rate", "rates", "gyro", "gyr", "angvel", "omega", "w", "rs", "angularvelocity", "drehrate", "vitesse", "gyroadc",
)  # fmt: skip
_ANGLES = ("angle", "winkel", "att", "attitude", "euler", "stabilizer", "angolo", "angulo", "grad")
_COMMANDS = (
    "cmd", "command", "controls", "control", "torque", "mixer", "servo", "stick", "rc", "rccommand", "out", "output",
    "input", "u", "ruder", "actuator", "befehl", "knuppel",
)  # fmt: skip
_FORCES = ("acc", "accel", "acceleration", "accelerometer", "beschleunigung", "a", "accsmooth", "specificforce")
_SPEEDS = ("vel", "velocity", "v", "speed", "geschwindigkeit")
_PLACES = ("pos", "position", "t", "place", "ort")
_BY_AXIS = {
    "rate": {"roll": "p", "pitch": "q", "yaw": "r"},
    "angle": {"roll": "phi", "pitch": "theta", "yaw": "psi"},
    "command": {"roll": "mixer_roll", "pitch": "mixer_pitch", "yaw": "mixer_yaw", "collective": "mixer_collective"},
}
_BY_LETTER = {
    "rate": {"x": "p", "y": "q", "z": "r", "0": "p", "1": "q", "2": "r"},
    "force": {"x": "ax", "y": "ay", "z": "az"},
    "speed": {"x": "vx", "y": "vy", "z": "vz"},
    "place": {"x": "x", "y": "y", "z": "z"},
}
_WHOLE = {
    "vbat": "voltage", "voltage": "voltage", "volt": "voltage", "spannung": "voltage", "battery": "voltage",
    "tension": "voltage", "current": "current", "curr": "current", "amperage": "current", "strom": "current",
    "rpm": "omega_rotor", "headspeed": "omega_rotor", "rotorspeed": "omega_rotor", "drehzahl": "omega_rotor",
    "airspeed": "airspeed",
}  # fmt: skip


_ENDS = frozenset((*_RATES, *_ANGLES, *_COMMANDS))


def _name_parts(name: str) -> list[str]:
    """A column's name as small words: "RollRate" and "roll_rate" are roll, rate; "gyroADC[0]" is gyro, adc, 0."""
    ascii_name = name.translate(str.maketrans("äöüÄÖÜéèêñ", "aouAOUeeen"))
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", ascii_name)
    parted = re.sub(r"(?<=[A-Za-z])(?=\d)", " ", parted)
    parts = []
    for word in re.findall(r"[a-z]+|\d+", parted.lower()):
        begin = next(
            (
                axis
                for names in _AXES.values()
                for axis in names
                if word.startswith(axis) and word[len(axis) :] in _ENDS
            ),
            "",
        )
        parts += [begin, word[len(begin) :]] if begin else [word]  # "rollrate", "nickwinkel"
    return parts


def _of_unit(unit: str) -> str:
    """What kind of quantity a unit is of; "" where it says nothing."""
    inside = units.inside_unit(unit) if unit and units.is_known(unit) else ""
    return {"rad/s": "rate", "rad": "angle", "m/s^2": "force", "m/s": "speed", "m": "place", "1": "command"}.get(
        inside, ""
    )


def _known(name: str, kind: str) -> tuple[str, str]:
    """The channel that a name stands for, and why; ("", "") where it is none."""
    small = name.strip().lower()
    if is_known(small):
        return small, "its name"
    parts = _name_parts(name)
    joined = "".join(word for word in parts if not word.isdigit())
    for part in (joined, *reversed(parts)):
        if part in _WHOLE and not (part == "rpm" and kind not in ("", "rate")):
            return _WHOLE[part], "its name"
    quaternion = re.fullmatch(r"(?:.*[^a-z])?q(?:uat(?:ernion)?)?[ _.]*([wxyz])", small)
    if quaternion:
        return f"q{quaternion[1]}", "its name"
    axis = next((axis for axis, names in _AXES.items() for word in parts if word in names), "")
    said = next(
        (
            what
            for what, names in (("rate", _RATES), ("command", _COMMANDS), ("angle", _ANGLES))
            for word in parts
            if word in names and (len(word) > 2 or axis)
        ),
        "",
    )
    if parts[-1:] and parts[-1] in ("p", "q", "r") and kind in ("", "rate") and said == "rate":
        return parts[-1], "its name"
    surface = "command" if any(word in _SURFACES for word in parts) else ""
    what = kind if kind in _BY_AXIS else said or surface
    if axis and not what:
        what = "command" if axis == "collective" else "angle"
    if axis and (name_of := _BY_AXIS.get(what, {}).get(axis)):
        return name_of, "its name" + (" and unit" if kind else "")
    return _by_letter(parts, kind)


def _by_letter(parts: Sequence[str], kind: str) -> tuple[str, str]:
    """The part of a vector: "gyro x", "ang vel z", "xyz[1]" with a rate's unit."""
    if not parts:
        return "", ""
    last, before = parts[-1], parts[:-1]
    if len(parts) == 1 and len(last) == 2 and last[1] in "xyz":  # wx, ay, vz, tx
        before, last = [last[0]], last[1]
    joined = "".join(before)
    for what, names in (("rate", (*_RATES, "angvel")), ("force", _FORCES), ("speed", _SPEEDS), ("place", _PLACES)):
        named = any(word in names for word in before) or joined in names
        if what == "speed" and "ang" in before:
            continue
        if all(any(word.startswith(begin) for word in before) for begin in ("acc", "ang")):
            return "", ""
        if (named and kind in ("", what)) or (kind == what and (before in (["xyz"], []) or named)):
            part = _BY_LETTER[what].get(last, "")
            axes = "; world axes may point elsewhere" if part and what in ("speed", "place") else ""
            return part, f"its name{axes}" if part else ""
    return "", ""


# ---- units and signs -------------------------------------------------------------------------------------------------
def _size(values: Array) -> float:
    good = values[np.isfinite(values)]
    return float(np.quantile(np.abs(good), 0.999)) if good.size else 0.0


def _unit_by_size(name: str, size: float, column: str) -> str:
    """The unit of a channel whose largest values are known, those of its sisters with them: one sensor has one unit."""
    inside = channel(name).unit
    if inside == "rad":
        return "deg" if size > _TURN else "rad"
    if inside == "rad/s":
        turns = name.startswith("omega") and (size > 600.0 or "rpm" in column.lower())
        return "rpm" if turns else "deg/s" if size > 12.0 else "rad/s"
    if inside == "m/s^2":
        return "g" if size < 4.0 else "m/s^2"
    if inside == "1":
        return "%" if 2.0 < size <= 130.0 and name.startswith("mixer") else "1"
    return "mV" if inside == "V" and size > 1000.0 else inside


def _scaled(guess: Guess, values: Array, unit: str, family: float) -> Guess:
    """A guess with its unit, and what turns or scales its cells before; `family`: the largest of all of its kind."""
    finite = values[np.isfinite(values)]
    middle, size = float(np.median(finite)) if finite.size else 0.0, _size(values)
    factor, offset = 1.0, 0.0
    why = guess.why if guess.unit else f"{guess.why}; unit by its size"
    if channel(guess.channel).unit == "1" and unit == "1" and guess.channel.startswith("mixer"):
        if middle > 700.0 and size < 2300.0:
            factor, offset, why = 0.002, -3.0, f"{why}: pulses around 1500 us"
        elif 130.0 < size <= 1024.0 or (size <= 130.0 < family <= 1024.0):
            factor, why = 1.0 / 1024.0, f"{why}: counts up to 1024"
        elif size > 1024.0:
            factor = float(f"{1.0 / size:.3g}")
    scale = float(units.to_inside(1.0, unit, expected=channel(guess.channel).unit, channel=guess.channel, where=""))
    if guess.channel == "az" and 0.5 * _GRAVITY < middle * scale < 1.5 * _GRAVITY:
        factor, why = -1.0, f"{why}; sign: it is -9.81 at rest"
    return replace(guess, unit=unit, factor=factor, offset=offset, why=why)


def guesses(table: ColumnTable) -> list[Guess]:
    """A guess for each column of a table; a channel is given to the first column that may be it."""
    named = table_columns.named_columns(table) if table.header else [("", None)] * table.width
    listed, taken, numbers = [], set[str](), dict[int, Array]()
    clock = _time(table, [name for name, _ in named])
    for index, (name, said) in enumerate(named[:_MANY]):
        unit = said or ""
        if index == clock:
            listed.append(_stamped(table, Guess(index, name, "time", unit or table_time.named_unit(name) or "")))
            continue
        try:
            numbers[index] = table.numbers(index, name=name or str(index + 1))
        except SwashError:
            listed.append(Guess(index, name, unit=unit, why="no numbers"))
            continue
        if not np.isfinite(numbers[index]).any():
            listed.append(Guess(index, name, unit=unit, why="holds nothing"))
            continue
        known, why = _known(name, _of_unit(unit)) if name else ("", "")
        other = bool(unit) and units.is_known(unit) and known and units.inside_unit(unit) != channel(known).unit
        if not known or known in taken or other:
            listed.append(Guess(index, name, unit=unit))
            continue
        taken.add(known)
        listed.append(Guess(index, name, known, unit if units.is_known(unit) else "", why=why))
    sizes: dict[str, float] = {}
    for guess in listed:
        if guess.channel not in ("", "time") and not guess.unit:
            family = channel(guess.channel).unit
            sizes[family] = max(sizes.get(family, 0.0), _size(numbers[guess.index]))
    done = []
    for guess in listed:
        if guess.channel not in ("", "time"):
            family = sizes.get(channel(guess.channel).unit, 0.0)
            unit = guess.unit or _unit_by_size(guess.channel, family, guess.name)
            guess = _scaled(guess, numbers[guess.index], unit, family)
        done.append(guess)
    return done


def _time(table: ColumnTable, names: Sequence[str]) -> int | None:
    """The column of time: by its name, else the first whose numbers rise from row to row."""
    name = table_time.time_name([name for name in names if name])
    if name is not None:
        return names.index(name)
    for index in range(min(table.width, _MANY)):
        with contextlib.suppress(SwashError):
            values = table.numbers(index, name=str(index + 1))
            steps = np.diff(values)
            if steps.size > 10 and (steps > 0.0).all() and steps.max() < 20.0 * float(np.median(steps)):
                return index
    return None


def _stamped(table: ColumnTable, guess: Guess) -> Guess:
    """The time with the unit that its numbers say; seconds where two are as likely."""
    why = "its name" if guess.name and table_time.time_name([guess.name]) else "it rises from row to row"
    if guess.unit:
        return replace(guess, why=why)
    try:
        table_time.stamps(table, table_columns.Column(guess.index, None), None)
    except SwashError:
        return replace(guess, unit="s", why=f"{why}; nothing says its unit")
    return replace(guess, why=why)


# ---- the mapping -----------------------------------------------------------------------------------------------------
def mapping_of(chosen: Sequence[Guess], *, rate: float | None = None, headed: bool = True) -> dict[str, Any]:
    """The mapping that says the same, as `read` takes it.

    Args:
        chosen: columns; those without a channel are left out.
        rate: [Hz], where the table has no time.
        headed: whether the table has a header.
    """
    several = [guess.name for guess in chosen]
    channels: dict[str, dict[str, Any]] = {}
    for guess in chosen:
        if not guess.channel:
            continue
        entry: dict[str, Any] = {
            "column": guess.name if several.count(guess.name) == 1 and guess.name else guess.index + 1
        }
        if guess.unit:
            entry["unit"] = guess.unit
        if guess.factor != 1.0:
            entry["factor"] = guess.factor
        if guess.offset:
            entry["offset"] = guess.offset
        channels[guess.channel] = entry
    head: dict[str, Any] = {} if headed else {"header": False}
    if rate is not None:
        head["rate"] = rate
    return {**head, "channels": channels}


def mapping_text(mapping: Mapping[str, Any]) -> str:
    """A mapping as the file that `--mapping` takes."""
    return tomli_w.dumps(dict(mapping))


def guessed(source: Source) -> tuple[ColumnTable, list[Guess]] | None:
    """A file's table and the guesses for its columns, without a header where it has none; None where it is no table.

    Raises:
        FlightError: where neither way makes a table of it.
    """
    with contextlib.suppress(SwashError):
        table = table_in(source, {})
        return None if table is None else (table, guesses(table))
    table = table_in(source, {"header": False})
    return None if table is None else (table, guesses(table))
