"""CSV exports of OptiTrack Motive (format versions 1.2x; docs.optitrack.com, "Data Export: CSV").

The first line holds pairs of key and value (format version, frame rates, rotation type, length units, coordinate
space). Then, above the data, rows for each column: type ("Rigid Body", "Marker", ...), name, ID, from 1.25 on parent,
"Rotation" or "Position", and last `Frame, Time (Seconds), X, Y, Z, W, X, Y, Z, ...`. Blank cells: not seen.

Frames: Motive is Y UP unless told otherwise at the export, right-handed. The default reads the world as "north-up-east"
(logged x is called north, y is up, z is east) and the body as "forward-up-right": its axes are the world's at the
moment the rigid body was made, so this holds where the nose then pointed along x. The file does not tell: give
`body_axes` and `world_axes` where it was otherwise. Euler angles are taken as intrinsic rotations in the order of their
name, in degrees; a quaternion export leaves nothing to assume.
"""

from __future__ import annotations

import itertools

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.flights.readers import clocked, frames, mocap, tables
from swashplate.flights.readers.options import Options, with_mocap_table
from swashplate.flights.readers.source import Source
from swashplate.flights.readers.table_layout import even_rows

NAME = "optitrack"
VERSION = "1"
WORLD_AXES = "north-up-east"
BODY_AXES = "forward-up-right"

_LENGTH_UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm", "inches": "in", "feet": "ft"}
_HEADER_ROWS = 16


def recognises(source: Source) -> bool:
    """Text whose first cell is "Format Version"."""
    text = source.text
    return text is not None and text[:32].lstrip('"').startswith("Format Version")


def _header(rows: list[list[str]], source: Source) -> tuple[dict[str, str], int]:
    """The key-value pairs of the first line, and the index of the row with the axes."""
    pairs = itertools.zip_longest(rows[0][0::2], rows[0][1::2], fillvalue="")
    meta = {key.lower(): value for key, value in pairs if key}
    for index, row in enumerate(rows[:_HEADER_ROWS]):
        if len(row) > 1 and row[0].lower() == "frame" and row[1].lower().startswith("time"):
            return meta, index
    raise FlightError(
        "there is no row 'Frame, Time (Seconds), ...' after the header.",
        where=source.name,
        hint="Export it again with header information (Motive format version 1.2x).",
    )


def _bodies(rows: list[list[str]], axes_row: int, source: Source) -> dict[str, dict[tuple[str, str], int]]:
    """Column index by ("rotation" | "position", axis) for each rigid body's name."""
    types = next((i for i, row in enumerate(rows[:axes_row]) if "Rigid Body" in row), None)
    if types is None or types + 1 >= axes_row - 1:
        raise FlightError(
            "there is no rigid body in this export.",
            where=source.name,
            hint="Tick 'Rigid Bodies' at the export; single markers carry no attitude.",
        )
    kind_row, names = rows[axes_row - 1], rows[types + 1]
    bodies: dict[str, dict[tuple[str, str], int]] = {}
    for i, (kind, name, quantity, axis) in enumerate(zip(rows[types], names, kind_row, rows[axes_row], strict=False)):
        if kind == "Rigid Body":
            bodies.setdefault(name, {}).setdefault((quantity.lower(), axis.upper()), i)
    return bodies


def read(source: Source, options: Options) -> Flight:
    """An OptiTrack Motive CSV export as a flight; see the module's text for the format and the frames.

    Args:
        source: the file.
        options: `body`, `rotation`, `body_axes`, `world_axes`, `bad_stamps`.

    Raises:
        FlightError, UnitError: naming the file, what was found and what to do.
    """
    options = with_mocap_table(options)
    where = source.name
    rows = tables.rows_of(source.text or "", where=where, delimiter=",")
    meta, axes_row = _header(rows, source)
    if meta.get("coordinate space", "Global").lower() != "global":
        raise FlightError(
            f"the coordinate space is '{meta['coordinate space']}', expected Global.",
            where=where,
            hint="Export it again in global coordinates.",
        )
    bodies = _bodies(rows, axes_row, source)
    names = list(bodies)
    name = names[mocap.choose(names, options.body, where=where)]
    columns = bodies[name]
    remarks = clocked.Remarks()
    under = range(axes_row + 2, len(rows) + 1)
    # Blank cells at a row's end may be left out: the body was not seen. More cells than heads are another layout.
    data, lines = even_rows(rows[axes_row + 1 :], under, low=2, high=len(rows[axes_row]), where=where, remarks=remarks)

    def read_columns(quantity: str, letters: str) -> Array:
        missing = [axis for axis in letters if (quantity, axis) not in columns]
        if missing:
            raise FlightError(
                f"'{name}' has no column {quantity} {missing[0]}.", where=where, hint="Export rotation and position."
            )
        places = {f"{name} {axis}": columns[quantity, axis] for axis in letters}
        return np.stack(
            [tables.column(data, at, name=title, where=where, lines=lines) for title, at in places.items()], axis=1
        )

    time = tables.column(data, 1, name="Time (Seconds)", where=where, lines=lines)
    kind = (options.rotation or meta.get("rotation type", "Quaternion")).lower()
    notes: tuple[str, ...] = ()
    if kind == "quaternion":
        quaternion = read_columns("rotation", "WXYZ")
    else:
        rotation = kind if kind.startswith("euler_") or kind == "helical" else f"euler_{kind}"
        angles = np.deg2rad(read_columns("rotation", "XYZ"))
        blank = np.asarray(np.isnan(angles).any(axis=1, keepdims=True))
        turned = frames.from_rotation(np.where(blank, 0.0, angles), rotation, where=where)
        quaternion = np.where(blank, np.nan, turned)
        notes = (f"rotation '{kind}' taken as intrinsic rotations in degrees; export quaternions to be sure",)
    unit = meta.get("length units", "")
    track = mocap.Track(
        name=name,
        time=time,
        position=read_columns("position", "XYZ"),
        length_unit=options.units.get("position", _LENGTH_UNITS.get(unit.lower(), unit)),
        quaternion=quaternion,
    )
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
