"""Derivatives as reports print them: a list of names and values, or the matrices A and B, from a CSV file."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path

from swashplate.errors import CardError, SwashError
from swashplate.files import read_text
from swashplate.models.conventional.derivative_table import COLUMNS, MOTIONS, ROWS, split_name, unit

_ROWS = {**{row.lower(): row for row in ROWS}, "u": "X", "v": "Y", "w": "Z", "p": "L", "q": "M", "r": "N"}
_CONTROLS = {
    **dict.fromkeys(("theta0", "th0", "t0"), "theta0"),
    **dict.fromkeys(("theta0t", "th0t", "theta0tr", "th0tr", "thetat", "tht"), "theta0T"),
    "b1": "B1",
    "a1": "A1",
    **dict.fromkeys(("theta1s", "th1s", "t1s"), "-B1"),
    **dict.fromkeys(("theta1c", "th1c", "t1c"), "-A1"),
}
_ANGLES = ("theta", "phi", "psi", "th", "ph", "ps")
_KINEMATIC = {
    "Xq": ("w", 1.0),
    "Xr": ("v", -1.0),
    "Yp": ("w", -1.0),
    "Yr": ("u", 1.0),
    "Zp": ("v", 1.0),
    "Zq": ("u", -1.0),
}
"""What A has beside these derivatives: q w - r v in -X and so on (rigid body in body axes); added, it is gone."""


def read_published(
    path: str | Path, *, sense: float = 1.0, flight: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Published derivatives by the names of `DerivativeTable`, in SI and with its signs of the controls.

    Either a list with the head `name,value` and, if wanted, `unit` (X_u, Xu; SI, or with ft, or per deg), or a matrix:
    a head of states and controls (`,u,w,q,theta,v,p,phi,r,theta0,theta1s,theta1c,theta0T`) and rows that begin with the
    state (or X Z M Y L N), in SI and radians, such as A and B side by side. Columns and rows of angles are passed over.

    Args:
        path: the file; lines that begin with # are comments.
        sense: +1 for a rotor that turns counter-clockwise from above, -1 clockwise: theta_1s = -B1, and theta_1c is
            -A1 or A1.
        flight: u, v, w of the steady flight [m/s], to be taken out of a matrix's force rows; without it they stay.

    Raises:
        SwashError: for a file that cannot be read, or a name, number or unit in it.
    """
    try:
        lines = read_text(path).splitlines()
    except (OSError, ValueError) as error:
        raise SwashError("cannot be read as a text file.", where=path) from error
    rows = [[cell.strip() for cell in row] for row in csv.reader(line for line in lines if not line.startswith("#"))]
    rows = [row for row in rows if any(row)]
    if len(rows) < 2:
        raise SwashError("has no rows under its head.", where=path, hint="Columns are name,value or the states.")
    head = [cell.lower() for cell in rows[0]]
    if "name" in head and "value" in head:
        derivatives = _listed(head, rows[1:], path, sense)
    else:
        derivatives = _matrix(rows, path, sense)
        for name, (speed, sign) in _KINEMATIC.items():
            if name in derivatives and flight is not None:
                derivatives[name] += sign * flight[speed]
    if not derivatives:
        raise SwashError("has no derivative in it.", where=path, hint="Columns are name,value or the states.")
    return derivatives


def _listed(head: list[str], rows: list[list[str]], path: str | Path, sense: float) -> dict[str, float]:
    derivatives: dict[str, float] = {}
    for row in rows:
        cells = dict(zip(head, row, strict=False))
        text = cells.get("name", "")
        name, sign = _name(text if text[:1].upper() in ROWS else "", path, sense, shown=text)
        factor = _factor(name, cells.get("unit", ""), path)
        if (value := _number(cells.get("value", ""), path, name)) is not None:
            if name in derivatives:
                raise SwashError("is there twice.", where=path, channel=name)
            derivatives[name] = sign * factor * value
    return derivatives


def _matrix(rows: list[list[str]], path: str | Path, sense: float) -> dict[str, float]:
    derivatives: dict[str, float] = {}
    for row in rows[1:]:
        label = _bare_symbol(row[0]).removesuffix("dot")
        if label in _ANGLES:
            continue
        for column, cell in zip(rows[0][1:], row[1:], strict=False):
            if _bare_symbol(column) not in _ANGLES:
                name, sign = _name(label + column if len(label) == 1 else "", path, sense, shown=row[0])
                if (value := _number(cell, path, name)) is not None:
                    derivatives[name] = sign * value
    return derivatives


def _bare_symbol(text: str) -> str:
    for mark in "_'{}\\ ":
        text = text.replace(mark, "")
    return text.replace("\N{GREEK SMALL LETTER THETA}", "theta").lower()


def _name(text: str, path: str | Path, sense: float, *, shown: str) -> tuple[str, float]:
    """Our name of a derivative, and the sign that its control has for us."""
    row, column = _ROWS.get(_bare_symbol(text)[:1], ""), _bare_symbol(text)[1:]
    known = column if column in MOTIONS else _CONTROLS.get(column, "")
    if not row or not known:
        raise SwashError(
            "is no derivative that is known here.",
            where=path,
            channel=shown or "name",
            hint=f"Names are one of {', '.join(ROWS)} and of {', '.join(COLUMNS)}, theta1s or theta1c: X_u, Mtheta1s.",
        )
    sign = -1.0 if known.startswith("-") else 1.0
    return row + known.removeprefix("-"), sign * (sense if known == "-A1" else 1.0)


def _number(text: str, path: str | Path, name: str) -> float | None:
    if not text or text.lower() in ("nan", "-"):
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SwashError(f"is '{text}', expected a number.", where=path, channel=name)
    return value


def _factor(name: str, given: str, path: str | Path) -> float:
    """What a value in the unit that a file gives is multiplied by for SI and radians."""
    row, column = split_name(name)
    feet = 0.3048 ** ((row < 3) - (column < 3))
    known = {unit(name): 1.0, unit(name, imperial=True): feet}
    if column >= len(MOTIONS):
        known |= {text.replace("/rad", "/deg"): factor * 180.0 / math.pi for text, factor in known.items()}
    known[""] = 1.0
    for text, factor in known.items():
        if given.replace(" ", "").lower() == text.replace(" ", "").lower():
            return factor
    raise CardError(
        f"has the unit '{given}', expected one of {', '.join(filter(None, known))}.",
        where=path,
        channel=name,
        hint="Values per inch or per cent of stick: divide them by the radians at the blades that it gives.",
    )
