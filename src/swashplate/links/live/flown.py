"""What flies on the live page at one instant, and what the page's switches say."""

from __future__ import annotations

from dataclasses import dataclass, field

from swashplate.arrays import Array
from swashplate.links.live.axes import STICKS
from swashplate.links.live.pilots import Mode


@dataclass
class Craft:
    """One flying copy: state row, inputs on their way, controller memory, the inputs it last got."""

    x: Array
    past: Array
    memory: Array
    inputs: Array

    def copied(self) -> Craft:
        """Another one, there where this one is."""
        return Craft(self.x.copy(), self.past.copy(), self.memory.copy(), self.inputs.copy())


@dataclass(frozen=True)
class Moment:
    """What is flown at one instant; never changed, so that another thread may read it.

    Attributes:
        time: of the simulation [s].
        crafts: state and input rows by name ("own", "ghost").
        around: wind and voltage, the row of `SURROUNDINGS`.
        target: the place, height and heading that are held (x, y, z, psi).
        stick_number: number of the last stick message that is in it.
        trouble: why it stands still, "" where it flies.
        fan: state rows of the drawn models, None of one that is lost. fan_begun: when they began where it was [s].
    """

    time: float
    crafts: dict[str, tuple[Array, Array]]
    around: Array
    target: Array
    stick_number: int
    trouble: str
    fan: tuple[Array | None, ...] = ()
    fan_begun: float = 0.0


@dataclass
class Setting:
    """What the page's switches and sliders say."""

    mode: Mode = "attitude"
    decoupled: bool = True
    ghost: bool = False
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gusts: float = 0.0
    voltage: float = 0.0
    sticks: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STICKS, 0.0))
    stick_number: int = 0
