"""Which frame a packet is: the next, a resend, late, from a restarted autopilot, or from a stranger.

ArduPilot counts frames from zero when it starts, sends the next one only after an answer, and repeats the last one
every second while it gets none. A packet that would throw a flight away (its count fell back) is believed at once only
where a restart looks like that; anything else has to be said twice, as an autopilot that waits for us will.

A link belongs to its sender. Another one gets it only when the owner has been silent for `SILENT`, or when it has asked
for it `ASKED` times while the owner was silent for `QUIET`, as an autopilot does that was restarted with another port.
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
"""s of silence after which another sender's first packet takes the link over."""
QUIET = 1.5
"""s of silence after which a sender that keeps asking takes it over: an owner that lost an answer repeats itself after
1 s, so it is not silent for so long."""
ASKED = 3
"""Packets of one other sender, all of them since the owner was last heard, that make it one that keeps asking."""


class PacketAction(Enum):
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
        claim: another sender, how often it has asked for the link since the owner was last heard, and since when.
    """

    sender: Address | None = None
    last: int = 0
    heard: float = 0.0
    doubt: tuple[Address, int, float] | None = None
    claim: tuple[Address, int, float] | None = None


def place(frames: Frames, sender: Address, count: int, now: float) -> tuple[Frames, PacketAction]:
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
        return here, PacketAction.START
    if sender != frames.sender:
        return _claimed(frames, here)
    if count == frames.last + 1:
        return here, PacketAction.NEXT
    if count == frames.last:
        return here, PacketAction.RESEND
    frames = frames._replace(heard=now, claim=None)  # whatever it says, the owner is there
    if frames.last < count <= frames.last + AHEAD:
        return here, PacketAction.SKIP
    fallen = frames.last - count
    if fallen > 0 and (count <= FIRST or (fallen > LATE and count <= FRESH)):
        return here, PacketAction.START
    if frames.doubt is not None:
        who, which, when = frames.doubt
        if (who, which) == (sender, count) and now - when >= AGAIN:
            return here, PacketAction.START if fallen > 0 else PacketAction.SKIP
        if (who, which) == (sender, count):
            return frames, PacketAction.DOUBTFUL
    delayed = 0 < fallen <= LATE
    return frames._replace(doubt=(sender, count, now)), PacketAction.LATE if delayed else PacketAction.DOUBTFUL


def _claimed(frames: Frames, here: Frames) -> tuple[Frames, PacketAction]:
    """A packet of somebody else than the owner: what is known of the two now, and who has the link."""
    assert here.sender is not None
    who, times, since = frames.claim or (here.sender, 0, here.heard)
    if who != here.sender:
        times, since = 0, here.heard
    silent, times = here.heard - frames.heard, times + 1
    if silent >= SILENT or (silent >= QUIET and times >= ASKED and here.heard - since >= AGAIN):
        return here, PacketAction.START
    return frames._replace(claim=(here.sender, times, since)), PacketAction.STRANGER
