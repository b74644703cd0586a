"""Aerofoil tables from plain files, checked and laid out for the blades' quadrature.

    # source: wind tunnel of ..., or XFOIL 6.99, Ncrit 7
    mach,reynolds,alpha_deg,cl,cd,cm
    0.0,100000,-10,-0.72,0.045,0.002
    ...

One row an angle, one block for each pair of a Mach and a Reynolds number, every Mach number at every Reynolds number.
`cm` (about the quarter chord, nose up) may be left out. Beyond a block's angles a flat plate goes on (Hoerner 1965, ch.
III: normal force coefficient 2 across the flow).
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from swashplate.arrays import Array
from swashplate.errors import CardError
from swashplate.files import is_file, read_text
from swashplate.models.card import Card
from swashplate.physics.tabled_blades import AerofoilTable
from swashplate.registry import nearest

_LARGEST_FILE = 20_000_000
_LIMITS: Mapping[str, tuple[float, float]] = {
    "mach": (0.0, 1.5),
    "reynolds": (100.0, 1e9),
    "alpha_deg": (-180.0, 180.0),
    "cl": (-5.0, 5.0),
    "cd": (0.0, 5.0),
    "cm": (-3.0, 3.0),
}
_OPTIONAL = "cm"
_KNOTS = 24
"""Mach or Reynolds numbers at most."""
_ANGLES = 5
"""In a block, at least."""
_ABOUT_ZERO = 5.0
"""deg either way that a block holds at least."""
_ONWARD = 10.0
"""deg beyond a block's last angle at which a flat plate has taken over."""
_PLATE = 5.0
_FINE = 30.0
_STEPS = (0.25, 0.5, 1.0)
_SUFFIX = ".csv"


def packaged_aerofoils() -> tuple[str, ...]:
    """Names of the tables that come with swashplate."""
    folder = resources.files("swashplate.models") / "data" / "aerofoils"
    return tuple(sorted(f.name.removesuffix(_SUFFIX) for f in folder.iterdir() if f.name.endswith(_SUFFIX)))


def aerofoil_of(name_or_file: str, card: Card) -> tuple[AerofoilTable, str]:
    """The table that a card names, and what to write on a card that is saved elsewhere: a name, or a whole path.

    Args:
        name_or_file: a packaged table, or a file beside the card or in the current folder.
        card: that names it.

    Raises:
        CardError: where there is no such table, or naming file, line, column, what was found and what was expected.
    """
    if name_or_file in packaged_aerofoils():
        file = resources.files("swashplate.models") / "data" / "aerofoils" / f"{name_or_file}{_SUFFIX}"
        return parse_aerofoil(file.read_text(encoding="utf-8"), name_or_file), name_or_file
    beside = Path(card.path).parent / name_or_file
    for path in (beside, Path(name_or_file)):
        if is_file(path):
            return parse_aerofoil(_text(path), str(path)), str(path.resolve())
    raise CardError(
        f"is '{name_or_file}', neither a packaged table ({', '.join(packaged_aerofoils())}) nor a file beside the card "
        "or in the current folder.",
        where=card.where,
        channel="aerofoil",
        hint=nearest(name_or_file, packaged_aerofoils()) or None,
    )


def _text(path: Path) -> str:
    try:
        return read_text(path, most=_LARGEST_FILE)
    except (OSError, ValueError) as fault:
        raise CardError(f"cannot be read as text ({fault}).", where=path, hint="A table is a CSV file.") from fault


@lru_cache(maxsize=8)
def parse_aerofoil(text: str, where: str) -> AerofoilTable:
    """A table from the text of its file.

    Args:
        text: comments from "#" on, of which "# source: ..." is kept; a line of column names; numbers.
        where: its name or file, for messages.

    Raises:
        CardError: naming file, line, column, what was found and what was expected.
    """
    blocks = _blocks(text, where)
    machs, reynolds = (sorted({key[i] for key in blocks}) for i in (0, 1))
    for what, knots in (("mach", machs), ("reynolds", reynolds)):
        if len(knots) > _KNOTS:
            raise CardError(f"has {len(knots)} values, expected at most {_KNOTS}.", where=where, channel=what)
    for key in ((m, r) for m in machs for r in reynolds):
        if key not in blocks:
            raise CardError(
                f"has no block at Mach {key[0]:g} and Reynolds number {key[1]:g}; every Mach number is expected at "
                "every Reynolds number.",
                where=where,
                channel="mach, reynolds",
            )
    spacing = min(float(np.min(np.diff(b[:, 0][np.abs(b[:, 0]) <= _FINE], prepend=-99.0))) for b in blocks.values())
    step = max((s for s in _STEPS if s <= spacing), default=_STEPS[0])
    # A quantity that one value was given for stays as it is: two knots with the same block.
    rows = [_twice([_laid_out(blocks[m, r], step) for r in reynolds]) for m in machs]
    rows = _twice(rows)
    nodes = np.array([[points for points, _ in row] for row in rows])
    stall = np.array([[angles for _, angles in row] for row in rows])
    numbers = np.concatenate([blocks[key].ravel() for key in sorted(blocks)])
    digest = hashlib.sha256(numbers.tobytes() + repr(sorted(blocks)).encode()).hexdigest()
    said = [line[1:].partition(":") for line in text.splitlines() if line.startswith("#")]
    source = next((value.strip() for key, _, value in said if key.strip().lower() == "source"), "not said")
    edges = [(b[0, 0], b[-1, 0]) for b in blocks.values()]
    return AerofoilTable(
        digest=digest,
        name=where,
        source=source,
        mach=tuple(_knots(machs)),
        log_reynolds=tuple(_knots([math.log(r) for r in reynolds])),
        fine=_FINE,
        step=step,
        nodes=nodes.reshape(-1, nodes.shape[-1]),
        stall=stall.reshape(-1, 2),
        measured=(math.radians(max(e[0] for e in edges)), math.radians(min(e[1] for e in edges))),
        span=((machs[0], machs[-1]), (reynolds[0], reynolds[-1])),
    )


def _twice(knots: list[Any]) -> list[Any]:
    return knots if len(knots) > 1 else knots * 2


def _knots(values: Sequence[float]) -> list[float]:
    return [*values] if len(values) > 1 else [values[0], values[0] + 1.0]


def _blocks(text: str, where: str) -> dict[tuple[float, float], Array]:
    """Angle [deg], lift, drag and moment by Mach and Reynolds number, rows of rising angle."""
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise CardError(f"is empty, expected a line {','.join(_LIMITS)} and rows of numbers.", where=where)
    names = [name.strip() for name in lines[0][1].split(",")]
    missing = [name for name in _LIMITS if name not in names and name != _OPTIONAL]
    unknown = [name for name in names if name not in _LIMITS]
    if missing or unknown or len(set(names)) != len(names):
        told = [f"lacks {', '.join(missing)}"] * bool(missing) + [f"has {', '.join(unknown)}"] * bool(unknown)
        raise CardError(
            f"{' and '.join(told) or 'names a column twice'}; expected are {', '.join(_LIMITS)} (cm may be left out).",
            where=where,
            channel=f"line {lines[0][0]}",
            hint="Angles are in degrees, and their column says so.",
        )
    blocks: dict[tuple[float, float], list[list[float]]] = {}
    for line, row in _numbers(lines[1:], names, where):
        block = blocks.setdefault((row["mach"], row["reynolds"]), [])
        if block and not row["alpha_deg"] > block[-1][0]:
            raise CardError(
                f"is {row['alpha_deg']:g} after {block[-1][0]:g} at Mach {row['mach']:g} and Reynolds number "
                f"{row['reynolds']:g}; angles are expected to rise within a block.",
                where=where,
                channel=f"line {line}, alpha_deg",
            )
        block.append([row["alpha_deg"], row["cl"], row["cd"], row.get("cm", 0.0)])
    if not blocks:
        raise CardError("has column names and no numbers.", where=where)
    for (mach, reynolds), block in blocks.items():
        if len(block) < _ANGLES or block[0][0] > -_ABOUT_ZERO or block[-1][0] < _ABOUT_ZERO:
            raise CardError(
                f"at Mach {mach:g} and Reynolds number {reynolds:g} has {len(block)} angles from {block[0][0]:g} to "
                f"{block[-1][0]:g} deg; expected at least {_ANGLES}, from -{_ABOUT_ZERO:g} or less to {_ABOUT_ZERO:g} "
                "or more.",
                where=where,
                channel="alpha_deg",
                hint="A symmetric profile's table has negative angles too.",
            )
    return {key: np.array(block) for key, block in blocks.items()}


def _numbers(
    lines: Sequence[tuple[int, str]], names: Sequence[str], where: str
) -> Iterator[tuple[int, dict[str, float]]]:
    for line, text in lines:
        cells = text.split(",")
        if len(cells) != len(names):
            raise CardError(
                f"has {len(cells)} entries, expected {len(names)} ({', '.join(names)}).",
                where=where,
                channel=f"line {line}",
            )
        row = {}
        for name, cell in zip(names, cells, strict=True):
            low, high = _LIMITS[name]
            try:
                row[name] = float(cell)
            except ValueError:
                row[name] = math.nan
            if not low <= row[name] <= high:
                raise CardError(
                    f"is '{cell.strip()[:40]}', expected a number from {low:g} to {high:g}.",
                    where=where,
                    channel=f"line {line}, {name}",
                )
        yield line, row


def _laid_out(block: Array, step: float) -> tuple[Array, Array]:
    """Values and slopes of a block at the table's angles, and the angles [rad] of largest and smallest lift about zero.

    Monotone cubics of the block's own points (Fritsch and Butland 1984) go through them without overshoot.
    """
    from scipy.interpolate import PchipInterpolator  # a tenth of a second that a vehicle without tables need not wait

    whole = _with_plate(block)
    layout = AerofoilTable(
        "", "", "", (), (), _FINE, step, np.empty(0), np.empty(0), (0.0, 0.0), ((0.0, 0.0), (0.0, 0.0))
    )
    nodes = layout.angles()
    curves = [PchipInterpolator(whole[:, 0], whole[:, column]) for column in (1, 2, 3)]
    columns = [values for curve in curves for values in (curve(nodes), curve.derivative()(nodes))]
    lift = columns[0]
    middle = int(np.argmin(np.abs(nodes)))
    up, down = middle, middle
    while up + 1 < nodes.size and lift[up + 1] > lift[up]:
        up += 1
    while down > 0 and lift[down - 1] < lift[down]:
        down -= 1
    return np.stack(columns, axis=1), np.radians([nodes[up], nodes[down]])


def _with_plate(block: Array) -> Array:
    """A block to 180 deg either way, by a flat plate where it ends before."""
    least = float(block[:, 2].min())
    before = np.arange(-180.0, block[0, 0] - _ONWARD + 1e-9, _PLATE)
    after = -np.arange(-180.0, -block[-1, 0] - _ONWARD + 1e-9, _PLATE)[::-1]

    def plate(degrees: Array) -> Array:
        a = np.radians(degrees)
        # The force across the plate, 2 sin a, moves back from the quarter chord evenly with the angle.
        moment = -np.sin(a) * np.abs(a) / np.pi * bool(np.any(block[:, 3]))
        return np.stack([degrees, np.sin(2.0 * a), least + 2.0 * np.sin(a) ** 2, moment], axis=1)

    whole = np.concatenate([plate(before), block, plate(after)])
    if whole[0, 0] > -180.0 or whole[-1, 0] < 180.0:  # a block that ends just before: its own last values
        first, last = whole[:1].copy(), whole[-1:].copy()
        first[0, 0], last[0, 0] = -180.0, 180.0
        whole = np.concatenate([first, whole] if whole[0, 0] > -180.0 else [whole])
        whole = np.concatenate([whole, last] if whole[-1, 0] < 180.0 else [whole])
    return whole
