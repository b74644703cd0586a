"""The ArduPilot link: lockstep exchanges per second over UDP on this machine, the link in a process of its own.

python -m benchmarks.link [--short]
"""

from __future__ import annotations

import argparse
import re
import socket
import struct
import subprocess
import sys
import time

from benchmarks.timing import Result

TARGET = 10_000.0
"""Exchanges per second."""
_RATE = 1200
_RUNNING = (1460, 1460, 1460, 1500, 0, 0, 0, 1660, 0, 0, 0, 0, 0, 0, 0, 0)
"""us: rotor turning, lowest collective."""


def exchanges(name: str, *, count: int, repeats: int) -> Result:
    """The best of several runs of `count` exchanges at 1200 frames per second of flight."""
    command = [sys.executable, "-m", "swashplate", "link", "ardupilot", "--vehicle", name, "--port", "0"]
    with subprocess.Popen([*command, "--idle-exit", "20"], stderr=subprocess.PIPE, text=True) as link:
        try:
            port = _port(link)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:  # a link belongs to its sender
                client.settimeout(10.0)
                client.connect(("127.0.0.1", port))
                rates = [_run(client, range(k * count, (k + 1) * count)) for k in range(repeats)]
        finally:
            link.terminate()
            link.communicate()
    rate = max(rates)
    return Result(f"ArduPilot link, {name}", rate, TARGET, f"{rate / _RATE:.1f} times real time at {_RATE} Hz")


def _port(link: subprocess.Popen[str]) -> int:
    assert link.stderr is not None
    for line in link.stderr:
        if found := re.search(r"UDP 127\.0\.0\.1:(\d+)", line):
            return int(found[1])
    raise RuntimeError("the link did not start")


def _run(client: socket.socket, frames: range) -> float:
    packets = [struct.pack("<HHI16H", 18458, _RATE, frame, *_RUNNING) for frame in frames]
    begin = time.perf_counter()
    for packet in packets:
        client.send(packet)
        client.recv(4096)
    return len(frames) / (time.perf_counter() - begin)


def measure(*, short: bool) -> list[Result]:
    """Both kinds of vehicle."""
    count, repeats = (1_500, 2) if short else (10_000, 5)
    return [exchanges(name, count=count, repeats=repeats) for name in ("raptor50", "coax")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="fewer exchanges and repeats")
    for result in measure(short=parser.parse_args().short):
        verdict = "met" if result.met else "MISSED"
        print(f"{result.name}: {result.rate:,.0f} per second, promised {TARGET:,.0f}: {verdict}; {result.note}")


if __name__ == "__main__":
    main()
