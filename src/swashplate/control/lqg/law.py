"""The feedback of a linear-quadratic controller on estimates or measured states, scheduled over speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from swashplate.engine.symbols import Operand
from swashplate.filtering.matrix_operations import Matrices
from swashplate.physics.backend import Backend

INTEGRALS = 4
LAW_MEMORY = INTEGRALS + 2
"""Integrals of the errors ahead, right, down and of heading; the speed asked for now; the speed it started at."""


class Feedback(NamedTuple):
    """Numbers of the law, S trims over speed.

    Attributes:
        speeds: ahead, of the trims [m/s], ascending, S.
        states, inputs: the trims, (S, n) and (S, m).
        gains: of the deviations of states, of late commands and of the integrals, (S, m, n + late + 4).
        battery: command per volt below the trims' voltage that keeps what the battery takes, m.
        voltage: of the trims [V].
        low, high: limits of the inputs, m.
        reach, reach_down: errors of place and of height beyond these are cut [m].
        pace: the asked speed changes no faster [m/s^2].
        place: 1 holds a place, 0 a speed.
    """

    speeds: Operand
    states: Operand
    inputs: Operand
    gains: Operand
    battery: Operand
    voltage: Operand
    low: Operand
    high: Operand
    reach: Operand
    reach_down: Operand
    pace: Operand
    place: Operand


def _limited(value: Operand, low: Operand, high: Operand, xp: Backend) -> Operand:
    return xp.minimum(xp.maximum(value, low), high)


def _shares(speed: Operand, speeds: Sequence[Operand], xp: Backend) -> list[Operand]:
    """Weights of the trims at a speed: straight lines between neighbours, the ends beyond."""
    if len(speeds) == 1:
        return [1.0]
    shares = []
    at = _limited(speed, speeds[0], speeds[-1], xp)
    for i, here in enumerate(speeds):
        rise: Operand = 1.0
        if i > 0:
            rise = xp.minimum(rise, (at - speeds[i - 1]) / (here - speeds[i - 1]))
        if i + 1 < len(speeds):
            rise = xp.minimum(rise, (speeds[i + 1] - at) / (speeds[i + 1] - here))
        shares.append(xp.maximum(rise, 0.0))
    return shares


def _mixed(shares: Sequence[Operand], rows: Sequence[Sequence[Operand]]) -> list[Operand]:
    """Weighted sum of the trims' rows, number by number."""
    total = [shares[0] * value for value in rows[0]]
    for share, row in zip(shares[1:], rows[1:], strict=True):
        total = [value + share * more for value, more in zip(total, row, strict=True)]
    return total


def lqr_law(
    memory: Sequence[Operand],
    x: Sequence[Operand],
    delayed: Sequence[Operand],
    voltage: Operand,
    reference: Sequence[Operand],
    *,
    names: tuple[str, ...],
    late_of: Sequence[int],
    feedback: Feedback,
    dt: float,
    M: Matrices,
) -> tuple[list[Operand], list[Operand]]:
    """Commands within their limits for a state row.

    Args:
        memory: `LAW_MEMORY` numbers.
        x: estimated or measured states.
        delayed: commands that were given and have not acted yet.
        voltage: the battery's [V].
        reference: the row of `REFERENCES`; speeds are counted from the speed it started at.
        names: of the states, beginning with the rigid body's.
        late_of: the input of each delayed command.
        feedback: the numbers.
        dt: sample time [s].
        M: the operations.

    Returns:
        New memory and commands.
    """
    f, xp = feedback, M.xp
    here = dict(zip(names, x, strict=True))
    *sums, asked, cruise = memory
    north, east, z, heading, ahead, right = reference[:6]
    asked = asked + _limited(cruise + ahead - asked, -f.pace * dt, f.pace * dt, xp)
    speeds = [f.speeds[i] for i in range(f.speeds.shape[0])]
    now, wanted = _shares(here["u"], speeds, xp), _shares(asked, speeds, xp)
    trim_x, trim_u = (
        _mixed(wanted, [[row[j] for j in range(table.shape[1])] for row in table]) for table in (f.states, f.inputs)
    )
    beyond = asked - _limited(asked, speeds[0], speeds[-1], xp)

    c, s = xp.cos(here["psi"]), xp.sin(here["psi"])
    along, across = here["x"] - north, here["y"] - east
    turned = xp.atan2(xp.sin(here["psi"] - heading), xp.cos(here["psi"] - heading))
    away = {name: here[name] - trim_x[i] for i, name in enumerate(names)}
    away["x"] = f.place * _limited(c * along + s * across, -f.reach, f.reach, xp)
    away["y"] = f.place * _limited(c * across - s * along, -f.reach, f.reach, xp)
    away["z"] = _limited(here["z"] - z, -f.reach_down, f.reach_down, xp)
    away["psi"] = turned
    away["u"] = away["u"] - beyond
    away["v"] = away["v"] - (1.0 - f.place) * right
    errors = [
        f.place * away["x"] + (1.0 - f.place) * away["u"],
        f.place * away["y"] + (1.0 - f.place) * away["v"],
        away["z"],
        turned,
    ]
    held = [delayed[i] - trim_u[j] for i, j in enumerate(late_of)]
    deviation = M.column([*(away[name] for name in names), *held, *sums])
    pushed = _mixed(now, [M.scalars(gain @ deviation) for gain in f.gains])
    commands, fits = [], 1.0
    for j, push in enumerate(pushed):
        command = trim_u[j] - push + f.battery[j] * (f.voltage - voltage)
        fitted = _limited(command, f.low[j], f.high[j], xp)
        fits = xp.where(xp.abs(command - fitted) > 0.0, 0.0, fits)
        commands.append(fitted)
    # Integrals rest while a command is at its limit: they do not wind up.
    return [*(total + fits * dt * error for total, error in zip(sums, errors, strict=True)), asked, cruise], commands
