"""One autopilot at a time: datagrams in, answers out, and the physics in step with them. No sockets here."""

from __future__ import annotations

import math
import socket
import time
from typing import NamedTuple

from swashplate.links.ardupilot.answer import line
from swashplate.links.ardupilot.frames import QUIET, SILENT, Address, Frames, PacketAction, place
from swashplate.links.ardupilot.lockstep import Lockstep, lockstep
from swashplate.links.ardupilot.packets import Refusal, ServoPacket, parse
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant
from swashplate.links.sensing import Sensing


class LinkProgress(NamedTuple):
    """How a link is doing: exchanges since it was opened, restarts, how many of these were another sender's that took
    the link over, packets of other senders that were ignored, and the physics' time [s]."""

    exchanges: int
    restarts: int
    takeovers: int
    strays: int
    time: float


class ArduPilotSession:
    """A plant under an autopilot.

    Args:
        plant: what flies.
        sensing: its sensors.
        notices: where to say what happens.
    """

    def __init__(self, plant: Plant, sensing: Sensing, notices: Notices) -> None:
        self.plant, self._sensing, self._notices = plant, sensing, notices
        self._used = plant.mapping.channels
        self._frames = Frames()
        self._rate = 0
        self._answer = b""
        self._exchanges = self._restarts = self._takeovers = 0
        self._said_broken = False
        self._lockstep: Lockstep | None = None

    def prepare(self) -> None:
        """Make what flies ordinary frames without Python, where that can be."""
        self._lockstep = lockstep(self.plant, self._sensing, self._notices.always)

    @property
    def progress(self) -> LinkProgress:
        return LinkProgress(
            self._exchanges, self._restarts, self._takeovers, self._notices.counts["stray"], self.plant.time
        )

    def handle(self, data: bytes, sender: Address, now: float) -> bytes | None:
        """The answer to a datagram, or None where it deserves none.

        Args:
            data: the datagram, whatever it holds.
            sender: its address.
            now: a clock that never goes back [s].
        """
        packet = parse(data, self._used)
        if isinstance(packet, Refusal):
            self._notices.tell(packet.kind, packet.sentence)
            return None
        before = self._frames
        self._frames, step = place(before, sender, packet.frame_count, now)
        if step is PacketAction.RESEND:
            self._notices.tell("resend", "the autopilot repeats a frame: it is answered again, and nothing moves.")
            return self._answer
        if step is PacketAction.LATE:
            self._notices.tell("late", f"frame {packet.frame_count} came late and is ignored.")
            return None
        if step is PacketAction.DOUBTFUL:
            self._notices.tell(
                "count",
                f"frame {packet.frame_count} after {before.last} is neither the next one nor a restart's; it is "
                "ignored until it is repeated.",
            )
            return None
        if step is PacketAction.STRANGER:
            assert before.sender is not None
            self._notices.tell(
                "stray",
                f"packets of another sender, {_at(sender)}, are ignored and counted: the link belongs to "
                f"{_at(before.sender)} until that one has been silent for {SILENT:g} s ({QUIET:g} s "
                "where another one keeps asking).",
            )
            return None
        if step is PacketAction.START:
            self._start(packet, sender, before, now)
        elif step is PacketAction.SKIP:
            missed = packet.frame_count - before.last - 1
            self._notices.tell("skip", f"{missed} frames before {packet.frame_count} never came; the flight goes on.")
        return self._fly(packet)

    def carry_on(self, bound: socket.socket, until: float = math.inf) -> tuple[tuple[bytes, Address] | None, bool]:
        """Answer ordinary frames that come to a socket up to a time of the physics [s], or until something else comes.

        Returns:
            The datagram that is left to `handle`, and its sender; whether to carry on at once: an answer waits.
        """
        frames, sender, lockstep = self._frames, self._frames.sender, self._lockstep
        if lockstep is None or sender is None or self.plant.broken:
            return None, False
        answered = lockstep.fly(bound, sender, frames.last, self._rate, min(until, self.plant.due))
        if answered:
            self._frames = Frames(sender, frames.last + answered, time.monotonic())
            self._exchanges += answered
            self._answer = lockstep.answer
        return lockstep.left, lockstep.holding

    def _start(self, packet: ServoPacket, sender: Address, before: Frames, now: float) -> None:
        where = f"{_at(sender)}, {len(packet.pulses)} outputs, {packet.frame_rate} Hz"
        if before.sender is None:
            self._notices.always(f"an autopilot is here ({where}): the vehicle stands on the ground.")
        elif sender == before.sender:
            self._restarts += 1
            self._notices.always(f"the autopilot started anew ({where}): the vehicle is back on the ground.")
        else:
            self._restarts += 1
            self._takeovers += 1
            self._notices.always(
                f"another autopilot has taken the link over ({where}) after {now - before.heard:.1f} s without a "
                f"packet of {_at(before.sender)}: the vehicle is back on the ground."
            )
        self._rate, self._said_broken = packet.frame_rate, False
        self.plant.restart()
        self._sensing.restart()

    def _fly(self, packet: ServoPacket) -> bytes:
        # ArduPilot takes its next frame rate from our time stamps and cuts it to a whole number: following a change of
        # one would let the rate creep away.
        if abs(packet.frame_rate - self._rate) > 1:
            self._notices.tell("frame rate", f"the autopilot now asks for {packet.frame_rate} Hz.")
            self._rate = packet.frame_rate
        motion = self.plant.advance(packet.pulses, 1.0 / self._rate)
        if self.plant.broken and not self._said_broken:
            self._said_broken = True
            self._notices.always(
                f"the vehicle broke at {self.plant.time:.2f} s: {self.plant.broken}. It lies there until the autopilot "
                "is restarted."
            )
        self._exchanges += 1
        self._answer = line(self._sensing.read(motion))
        return self._answer


def _at(address: Address) -> str:
    return f"{address[0]}:{address[1]}"
