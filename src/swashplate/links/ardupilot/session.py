"""One autopilot at a time: datagrams in, answers out, and the physics in step with them. No sockets here."""

from __future__ import annotations

from typing import NamedTuple

from swashplate.links.ardupilot.answer import line
from swashplate.links.ardupilot.frames import Address, Frames, Step, place
from swashplate.links.ardupilot.packets import Refusal, ServoPacket, parse
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant
from swashplate.links.sensing import Sensing


class Progress(NamedTuple):
    """How a link is doing: exchanges since it was opened, restarts, and the physics' time [s]."""

    exchanges: int
    restarts: int
    time: float


class Session:
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
        self._exchanges = self._restarts = 0
        self._said_broken = False

    @property
    def progress(self) -> Progress:
        return Progress(self._exchanges, self._restarts, self.plant.time)

    def handle(self, data: bytes, sender: Address, now: float) -> bytes | None:
        """The answer to a datagram, or None where it deserves none.

        Args:
            data: the datagram, whatever it holds.
            sender: its address.
            now: a clock that never goes back [s].
        """
        packet = parse(data, self._used)
        if isinstance(packet, Refusal):
            self._notices.tell(packet.kind, packet.words)
            return None
        before = self._frames
        self._frames, step = place(before, sender, packet.frame_count, now)
        if step is Step.RESEND:
            self._notices.tell("resend", "the autopilot repeats a frame: it is answered again, and nothing moves.")
            return self._answer
        if step is Step.LATE:
            self._notices.tell("late", f"frame {packet.frame_count} came late and is ignored.")
            return None
        if step is Step.DOUBTFUL:
            self._notices.tell(
                "count",
                f"frame {packet.frame_count} after {before.last} is neither the next one nor a restart's; it is "
                "ignored until it is repeated.",
            )
            return None
        if step is Step.STRANGER:
            self._notices.tell(
                "sender", f"another autopilot at {sender[0]}:{sender[1]} is ignored while the first one speaks."
            )
            return None
        if step is Step.START:
            self._start(packet, sender, again=before.sender is not None)
        elif step is Step.SKIP:
            missed = packet.frame_count - before.last - 1
            self._notices.tell("skip", f"{missed} frames before {packet.frame_count} never came; the flight goes on.")
        return self._fly(packet)

    def _start(self, packet: ServoPacket, sender: Address, *, again: bool) -> None:
        where = f"{sender[0]}:{sender[1]}, {len(packet.pulses)} outputs, {packet.frame_rate} Hz"
        if again:
            self._restarts += 1
            self._notices.always(f"the autopilot started anew ({where}): the vehicle is back on the ground.")
        else:
            self._notices.always(f"an autopilot is here ({where}): the vehicle stands on the ground.")
        self._rate, self._said_broken = packet.frame_rate, False
        self.plant.restart()
        self._sensing.restart()

    def _fly(self, packet: ServoPacket) -> bytes:
        # ArduPilot takes its next frame rate from our time stamps and cuts it to a whole number: following a change of
        # one would let the rate creep away.
        if abs(packet.frame_rate - self._rate) > 1:
            self._notices.tell("frame rate", f"the autopilot now asks for {packet.frame_rate} Hz.")
            self._rate = packet.frame_rate
        moved = self.plant.advance(packet.pulses, 1.0 / self._rate)
        if self.plant.broken and not self._said_broken:
            self._said_broken = True
            self._notices.always(
                f"the vehicle broke at {self.plant.time:.2f} s: {self.plant.broken}. It lies there until the autopilot "
                "is restarted."
            )
        self._exchanges += 1
        self._answer = line(self._sensing.read(moved))
        return self._answer
