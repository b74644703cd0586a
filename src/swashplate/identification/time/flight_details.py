"""What only an identification from flights under a controller has: whether each axis was moved independently."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class AxisExcitation:
    """Whether a record moves an axis independently of what the aircraft did.

    Attributes:
        record: the record's name.
        axis: "roll", "pitch", "yaw" or "heave".
        command: the input that drives it.
        explained: part of the command's variance that past motion explains (1: a controller's answer to the motion;
            NaN where the command stands still or the record is too short to tell).
        coherence: largest coherence between command and motion in the band.
        phase: phase of motion over command there [rad] (NaN where the command stands still).
        power: standard deviation of the command in the band [1].
        identifiable: False where there is no independent excitation.
        words: the finding, and what to fly instead.
        explained_later: part of the command's variance that the motion after it explains.
    """

    record: str
    axis: str
    command: str
    explained: float
    coherence: float
    phase: float
    power: float
    identifiable: bool
    words: str
    explained_later: float = float("nan")


@dataclass(frozen=True)
class FlightDetails:
    """What `identify` adds to a result.

    Attributes:
        excitation: per record and axis.
    """

    kind: ClassVar[str] = "flight"
    excitation: tuple[AxisExcitation, ...] = ()
