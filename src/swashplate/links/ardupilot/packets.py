"""The servo packets of ArduPilot's SITL "JSON" back end: bytes to a packet, or the reason why they are none.

Little endian: uint16 magic, uint16 frame rate [Hz], uint32 frame count, then one uint16 pulse [us] for each output
(ArduPilot, libraries/SITL/examples/JSON/readme.md).
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import NamedTuple

from swashplate.links.servo import NO_PULSE, PULSES

FORMS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
"""Layout by magic number: 16 outputs, or 32 (SERVO_32_ENABLE)."""
_MAGIC = struct.Struct("<H")
LONGEST = max(form.size for form in FORMS.values())

RATES = (11, 20_000)
"""Hz: ArduPilot lets time pass only for steps below 0.1 s."""


class ServoPacket(NamedTuple):
    """One frame of outputs.

    Attributes:
        frame_rate: steps per second that the autopilot asks for [Hz].
        frame_count: number of the frame since the autopilot started.
        pulses: of the 16 or 32 outputs [us]; 0 where there is none.
    """

    frame_rate: int
    frame_count: int
    pulses: tuple[int, ...]


class Refusal(NamedTuple):
    """Why bytes are no packet: a kind (one word) and a sentence."""

    kind: str
    sentence: str


def parse(data: bytes, used: Iterable[int] = ()) -> ServoPacket | Refusal:
    """A packet from the bytes of a datagram.

    Args:
        data: the datagram.
        used: outputs (from 1) whose pulses must be a servo's, or none.
    """
    if len(data) < _MAGIC.size:
        return Refusal("length", f"a datagram of {len(data)} bytes is no servo packet; it is ignored.")
    (magic,) = _MAGIC.unpack_from(data)
    form = FORMS.get(magic)
    if form is None:
        known = " or ".join(map(str, FORMS))
        return Refusal("magic", f"a datagram begins with {magic}, expected {known}; it is ignored.")
    if len(data) != form.size:
        return Refusal(
            "length", f"a servo packet with magic {magic} has {len(data)} bytes, expected {form.size}; it is ignored."
        )
    fields = form.unpack(data)
    rate, count, pulses = fields[1], fields[2], fields[3:]
    if not RATES[0] <= rate <= RATES[1]:
        return Refusal(
            "rate", f"a servo packet asks for {rate} Hz, expected {RATES[0]} to {RATES[1]}; set SIM_RATE_HZ. Ignored."
        )
    least, most = PULSES
    for number in used:
        if number > len(pulses):
            return Refusal(
                "outputs",
                f"a servo packet has {len(pulses)} outputs, the servo mapping uses number {number}: set "
                "SERVO_32_ENABLE 1 or change the mapping. Ignored.",
            )
        pulse = pulses[number - 1]
        if not least <= pulse <= most and pulse != NO_PULSE:
            return Refusal(
                "pulse",
                f"a servo packet has a pulse of {pulse} us on output {number}, expected {PULSES[0]} to {PULSES[1]}; "
                "it is ignored.",
            )
    return ServoPacket(rate, count, pulses)
