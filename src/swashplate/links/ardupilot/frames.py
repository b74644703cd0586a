"""Which frame a packet is: the next, a resend, late, from a restarted autopilot, or from a stranger.

ArduPilot counts frames from zero when it starts, sends the next one only after an answer, and repeats the last one
every second while it gets none. A packet that would throw a flight away (its count fell back) is believed at once only
where a restart looks like that; anything else has to be said twice, as an autopilot that waits for us will.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

Address = tuple[str, int]

FIRST = 1
"""Counts that are a restart even just after the start: beginning twice costs nothing there."""
FRESH = 100
"""Counts that a restarted autopilot may begin with."""
LATE = 8
"""Frames by which a packet may come late: a network's duplicate, not a restart."""
AHEAD = 10_000
"""Frames that may be missing: an autopilot that does not wait for answers."""
AGAIN = 0.5
"""s between two equal packets that make a restart believed; ArduPilot repeats itself every second."""
SILENT = 3.0
"""s after which another sender may take the link over."""


class Step(Enum):
    """What to do with a packet."""

    START = "start"
    NEXT = "next"
    SKIP = "skip"
    RESEND = "resend"
    LATE = "late"
    DOUBTFUL = "doubtful"
    STRANGER = "stranger"


class Frames(NamedTuple):
    """What is known of the sender: never changed, replaced.

    Attributes:
        sender: whose flight this is; None before the first packet.
        last: count of the last frame that was answered.
        heard: when that was [s].
        doubt: sender, count and time of a packet that fell back and was not believed.
    """

    sender: Address | None = None
    last: int = 0
    heard: float = 0.0
    doubt: tuple[Address, int, float] | None = None


def place(frames: Frames, sender: Address, count: int, now: float) -> tuple[Frames, Step]:
    """What a packet means after what came before it.

    Args:
        frames: what is known.
        sender: address of the packet.
        count: its frame count.
        now: a clock that never goes back [s].

    Returns:
        What is known now, and what to do. Only START, NEXT and SKIP move the physics.
    """
    here = Frames(sender, count, now)
    if frames.sender is None:
        return here, Step.START
    if sender != frames.sender:
        restarted = count <= FRESH and count < frames.last
        if restarted or now - frames.heard >= SILENT:
            return here, Step.START
        return frames, Step.STRANGER
    if count == frames.last:
        return here, Step.RESEND
    if count == frames.last + 1:
        return here, Step.NEXT
    if frames.last < count <= frames.last + AHEAD:
        return here, Step.SKIP
    fallen = frames.last - count
    if fallen > 0 and (count <= FIRST or (fallen > LATE and count <= FRESH)):
        return here, Step.START
    if frames.doubt is not None:
        who, which, when = frames.doubt
        if (who, which) == (sender, count) and now - when >= AGAIN:
            return here, Step.START if fallen > 0 else Step.SKIP
        if (who, which) == (sender, count):
            return frames, Step.DOUBTFUL
    late = 0 < fallen <= LATE
    return frames._replace(doubt=(sender, count, now)), Step.LATE if late else Step.DOUBTFUL
