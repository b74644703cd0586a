#!/usr/bin/env python3
"""What Betaflight's SITL says and opens, without flying: for what goes wrong before a flight. It never arms.

SWASH_STANDIN says how it misbehaves, words separated by commas: "silent" (no motors), "order" (big-endian pulses),
"few" (two motors), "clock" (three times too fast), "refuses" (a line of the configuration), "dies" (at a state).
"""

from __future__ import annotations

import os
import socket
import struct
import sys
import time


def main() -> None:
    faults = set(os.environ.get("SWASH_STANDIN", "").split(","))
    if "--config" in sys.argv:
        if "refuses" in faults:
            print("mixer CUSTOM\n###ERROR IN mixer: INVALID ARGUMENT###", flush=True)
        print("[CONFIG] Config file processed, EEPROM saved", flush=True)
        return
    door = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    door.bind(("0.0.0.0", 5761))
    door.listen(1)
    states = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    states.bind(("0.0.0.0", 9003))
    states.settimeout(1.0)
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    print("bind port 5761 for UART1", flush=True)
    began, told, pace, before = time.monotonic(), 0.0, 1.0, None
    while True:
        try:
            data = states.recv(256)
        except TimeoutError:
            continue
        if "dies" in faults:
            print("Segmentation fault", flush=True)
            os.abort()
        now, stamp = time.monotonic(), struct.unpack_from("<d", data)[0]
        if before is not None and 0.0 < stamp - before[0] < 0.02:
            pace = (stamp - before[0]) / (now - before[1])
        before = stamp, now
        if "silent" not in faults:
            count = 2 if "few" in faults else 4
            form = ">H2x16f" if "order" in faults else "<H2x16f"
            out.sendto(struct.pack(form, count, *(1000.0,) * 4, *(0.0,) * 12), ("127.0.0.1", 9001))
        if now - told >= 0.2:
            told = now
            rate = 3.0 if "clock" in faults else 1.0
            clock = 1e3 * rate * pace * (now - began)
            print(f"[SITL] t={clock:.0f}ms Arming disabled: THROTTLE CLI", flush=True)
            print(f"[SITL] t={clock:.0f}ms  spd=0.00m/s", flush=True)


if __name__ == "__main__":
    main()
