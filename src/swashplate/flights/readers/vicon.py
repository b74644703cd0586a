"""CSV exports of Vicon Tracker and Nexus.

Blocks of: a title ("Objects", "Segments", "Trajectories", ...), the frame rate [Hz], a row of subject names, a row
`Frame, Sub Frame, RX, RY, RZ[, RW], TX, TY, TZ` (markers: X, Y, Z), a row of units, then data up to an empty line.
Tracker says in the subject's name how the rotation is written ("Global Angle (Helical) ..."); four columns are a
quaternion x y z w; for three columns without a word about it the user must say: helical (rotation vector) or Euler.

Frames: the world is z up, by default read as "north-west-up" (logged x is called north). The body axes are those that
the object had when it was made in the program; the file does not tell. The default, "forward-left-up", holds where the
model was made with its nose along the world's x axis; give `body_axes` otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError, UnitError
from swashplate.flights import units
from swashplate.flights.flight import Flight
from swashplate.flights.readers import checks, clocked, frames, mocap, tables
from swashplate.flights.readers.options import Options, with_mocap_table
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_layout import even_rows

NAME = "vicon"
VERSION = "1"
WORLD_AXES = "north-west-up"
BODY_AXES = "forward-left-up"

_POSES = ("Objects", "Segments")
_BLOCKS = (*_POSES, "Trajectories", "Devices", "Joints", "Model Outputs")
_ANGLE_LABEL = re.compile(r"^Global Angle \((?P<rotation>[^)]*)\)\s*", re.IGNORECASE)
_DATA_AFTER = 5  # title, rate, names, columns, units


def recognises(source: Source) -> bool:
    """Text whose first line is a block title, followed by a frame rate."""
    text = source.text
    return text is not None and _title(text.split("\n", 1)[0]) in _BLOCKS


def _title(line: str) -> str:
    return line.strip().strip(",;\t").strip().strip('"')


def _block(rows: list[list[str]], source: Source) -> tuple[str, int, int]:
    """Title, first row and end row of the block that is read: poses before markers."""
    titles = [i for i, row in enumerate(rows) if row and row[0] in _BLOCKS and not any(row[1:])]
    starts = [i for i in titles if i == 0 or not any(rows[i - 1])]
    by_title = {rows[i][0]: i for i in reversed(starts)}
    for title in (*_POSES, "Trajectories"):
        if title in by_title:
            start = by_title[title]
            end = next((i for i in range(start + _DATA_AFTER, len(rows)) if not any(rows[i])), len(rows))
            return title, start, end
    raise FlightError(
        f"holds {', '.join(by_title) or 'no block'}, expected Objects, Segments or Trajectories.",
        where=source.name,
        hint="Export the tracked object's pose.",
    )


def _rate(row: list[str], source: Source) -> float:
    try:
        rate = tables.number(row[0]) if row else float("nan")
    except ValueError:
        rate = float("nan")
    if not (np.isfinite(rate) and rate > 0):
        raise FlightError(
            f"the frame rate in line 2 of the block is '{row[0] if row else ''}', expected a positive number [Hz].",
            where=source.name,
            hint="Export it again with the header.",
        )
    return rate


def _bodies(names: list[str], columns: list[str], *, first: str) -> list[tuple[str, int, int]]:
    """Label, first column and end column of each body; a body starts where the column name `first` (RX or X) stands."""
    starts = [i for i, cell in enumerate(columns) if i >= 2 and cell.upper() == first]
    ends = [*starts[1:], len(columns)]
    return [(names[i] if i < len(names) else "", i, end) for i, end in zip(starts, ends, strict=False)]


def _quaternion(angles: Array, given: list[str], label: str, source: Source, options: Options) -> Array:
    """Scalar-first quaternions from three or four logged columns, shape (n, 3 or 4)."""
    if angles.shape[1] == 4:
        return angles[:, (3, 0, 1, 2)]
    said = _ANGLE_LABEL.match(label)
    rotation = options.rotation or (said["rotation"].lower().replace(" ", "_") if said else "")
    if not rotation:
        raise FlightError(
            "the file does not say whether RX RY RZ are a rotation vector or Euler angles.",
            where=source.name,
            channel="rotation",
            hint="Give rotation='helical' or rotation='euler_xyz', as chosen at the export.",
        )
    unit = given[0] or ("rad" if rotation == "helical" else "")
    if not unit or len(set(given)) > 1:
        raise UnitError(f"the angles' units are {given}.", where=source.name, channel="RX", hint="Export them again.")
    radians = units.to_inside(angles, unit, expected="rad", channel="RX RY RZ", where=source.name)
    blank = np.asarray(np.isnan(radians).any(axis=1, keepdims=True))
    turned = frames.from_rotation(np.where(blank, 0.0, radians), rotation, where=source.name)
    return np.where(blank, np.nan, turned)


def read(source: Source, options: Options) -> Flight:
    """A Vicon CSV export as a flight; see the module's text for the format and the frames.

    Args:
        source: the file.
        options: `body` (subject, or marker), `rotation`, `body_axes`, `world_axes`, `bad_stamps`.

    Raises:
        FlightError, UnitError: naming the file, what was found and what to do.
    """
    options = with_mocap_table(options)
    where = source.name
    rows = tables.rows_of(source.text or "", where=where)
    title, start, end = _block(rows, source)
    if end - start < _DATA_AFTER or len(rows) < start + _DATA_AFTER:
        raise FlightError(f"the block '{title}' ends in its header.", where=where, hint="Export it again.")
    rate = _rate(rows[start + 1], source)
    names, columns, unit_row = rows[start + 2 : start + _DATA_AFTER]
    remarks = clocked.Remarks()
    under = range(start + _DATA_AFTER + 1, end + 1)
    # Blank cells at a row's end may be left out: the body was not seen. More cells than heads are another layout.
    data, lines = even_rows(
        rows[start + _DATA_AFTER : end], under, low=1, high=len(columns), where=where, remarks=remarks
    )
    poses = title in _POSES
    bodies = _bodies(names, columns, first="RX" if poses else "X")
    labels = [label for label, _, _ in bodies]
    bare = [_ANGLE_LABEL.sub("", label).strip() for label in labels]
    label, left, right = bodies[mocap.choose(bare, options.body, where=where)]

    wanted = {name.upper(): i for i, name in reversed(list(enumerate(columns[left:right], left)))}
    place = ("TX", "TY", "TZ") if poses else ("X", "Y", "Z")
    angle = [name for name in ("RX", "RY", "RZ", "RW") if name in wanted]
    missing = [name for name in (*place, *(("RX", "RY", "RZ") if poses else ())) if name not in wanted]
    if missing:
        raise FlightError(f"the columns {', '.join(missing)} are missing.", where=where, hint="Export the full pose.")

    def read_columns(which: Sequence[str]) -> Array:
        parts = [tables.column(data, wanted[c], name=c, where=where, lines=lines) for c in which]
        return np.stack(parts, axis=1)

    def unit_of(name: str) -> str:
        return unit_row[wanted[name]] if wanted[name] < len(unit_row) else ""

    frame = tables.column(data, 0, name="Frame", where=where, lines=lines)
    checks.finite(frame, channel="Frame", where=where)
    position = read_columns(place)
    quaternion = None
    if poses:
        raw = read_columns(angle)
        raw[~np.any(raw, axis=1) & ~np.any(position, axis=1)] = np.nan  # Tracker writes zeros for a body it lost
        quaternion = _quaternion(raw, [unit_of(name) for name in angle], label, source, options)
    first = frame[0] if frame.size else 0.0
    track = mocap.Track(
        name=_ANGLE_LABEL.sub("", label).strip() or "(unnamed)",
        time=(frame - first) / rate,
        position=position,
        length_unit=options.units.get("position", unit_of(place[0]) or "mm"),
        quaternion=quaternion,
    )
    notes = (f"time starts at frame {first:.0f}, counted at {rate:g} Hz",) if frame.size else ()
    return mocap.flight(
        track,
        source,
        options,
        reader=NAME,
        version=VERSION,
        world_axes=WORLD_AXES,
        body_axes=BODY_AXES,
        notes=notes,
        remarks=remarks,
    )
