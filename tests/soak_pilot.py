#!/usr/bin/env python3
"""An autopilot for soaks, as a program: `soak_pilot.py PORT LEDGER SEED`.

It counts frames from zero, repeats itself every second while nobody answers, and goes on when the physics falls back
to its start, as ArduPilot does. In LEDGER stand eight bytes for every flight: the last time stamp that it was given.
A write there is not lost when it is killed.
"""

from __future__ import annotations

import json
import os
import random
import select
import socket
import struct
import sys
import time

from heli_autopilot import servo_packet

RATE = 400
PACE = float(os.environ.get("SWASHPLATE_SOAK_PACE", "5"))
"""Times real time, at most: a soak is to see many kills and not to fill the disk. 1 runs beside other work."""


def drain(wire: socket.socket) -> None:
    """Answers to frames that were repeated while nobody answered would be read in the place of the next ones."""
    while select.select([wire], [], [], 0.0)[0]:
        wire.recv(4096)


def main() -> None:
    port, ledger, seed = int(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    drawn = random.Random(seed)
    file = os.open(ledger, os.O_WRONLY | os.O_CREAT)
    wire = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    wire.connect(("127.0.0.1", port))
    wire.settimeout(1.0)
    flight, last, count, due = 0, 0.0, 0, time.monotonic()
    pulses = [1500, 1500, 1500, 1500, 1000, 1000]
    while True:
        if count % 100 == 0:
            pulses = [
                drawn.randrange(1200, 1800),
                drawn.randrange(1200, 1800),
                1500,
                1500,
                *[drawn.randrange(1000, 1350)] * 2,
            ]
        packet = servo_packet(RATE, count, pulses)
        try:
            drain(wire)
            wire.send(packet)
            told = json.loads(wire.recv(4096))["timestamp"]
        except (TimeoutError, ConnectionError):
            time.sleep(0.05)
            continue
        if told < last:  # a frame that was repeated is answered again: no flight of its own
            flight += 1
        last = told
        os.pwrite(file, struct.pack("<d", told), 8 * flight)
        count += 1
        due = max(due + 1.0 / (PACE * RATE), time.monotonic() - 0.5)
        if (ahead := due - time.monotonic()) > 0.002:
            time.sleep(ahead)


if __name__ == "__main__":
    main()
