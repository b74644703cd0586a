"""Aircraft of the live page flown by their sticks: what every one of them has to do."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flown_here import World
from swashplate.links.live.axes import STICKS
from swashplate.links.live.recording import LiveRecording, SavedRecording

X, Y, Z, U, V, PHI, PSI = 0, 1, 2, 3, 4, 6, 8
RAISED = {"roll": (Y, 1.0), "pitch": (X, 1.0), "yaw": (PSI, 1.0), "heave": (Z, -1.0)}
"""What each stick moves, and which way: right, ahead (north at first), nose right, up."""


def fly(world: World, seconds: float, **sticks: float) -> np.ndarray:
    """States after some seconds with the sticks held."""
    world.setting.sticks = {axis: sticks.get(axis, 0.0) for axis in STICKS}
    for _ in range(round(seconds / world.period)):
        world.step()
    return world.moment().crafts["own"][0]


def flown_rows(world: World, seconds: float, **sticks: float) -> list[np.ndarray]:
    """What a recording gets of some seconds with the sticks held: states, inputs and surroundings of every period."""
    rows = []
    for _ in range(round(seconds / world.period)):
        fly(world, world.period, **sticks)
        rows.append(world.latest)
    return rows


def recorded(world: World, rows: list[np.ndarray], folder: Path) -> SavedRecording:
    """Rows as a recording on disk."""
    going = LiveRecording(world.vehicle, period=world.period, folder=folder)
    for row in rows:
        going.add(row)
    assert not going.trouble
    return going.finish()


def fresh(world: World, mode: str, *, ghost: bool = False) -> World:
    """The same world in hover, in calm air, with free sticks."""
    world.setting.decoupled, world.setting.gusts, world.setting.wind = True, 0.0, (0.0, 0.0, 0.0)
    world.set_ghost(ghost)
    world.set_mode(mode)  # type: ignore[arg-type]
    world.setting.sticks = dict.fromkeys(STICKS, 0.0)
    world.reset()
    return world


def moves_its_way(world: World, mode: str, axis: str) -> None:
    """A stick moves the aircraft where it points."""
    fresh(world, mode)
    start = fly(world, 0.1).copy()
    moved = fly(world, 1.2, **{axis: 0.25})
    state, sense = RAISED[axis]
    assert not world.trouble
    assert sense * (moved[state] - start[state]) > 0.02


def holds_what_is_held(world: World, mode: str) -> None:
    """After the sticks are let go, height, heading and standstill stay."""
    fresh(world, mode)
    fly(world, 1.5, pitch=0.6, heave=0.5, yaw=0.4)
    settled = fly(world, 12.0).copy()
    after = fly(world, 3.0)
    assert np.max(np.abs(after[[Z, PSI]] - settled[[Z, PSI]])) < 0.05
    assert np.hypot(after[U], after[V]) < 0.1
    assert settled[Z] < world.trim.state[Z] - 0.1
