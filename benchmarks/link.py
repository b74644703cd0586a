"""The ArduPilot link: lockstep exchanges per second over UDP on this machine, the link in a process of its own.

Beside the clock stands the link's own processor time (Linux): what it needs, whatever else the machine does. The
autopilot's own, here that of a sender without any, comes on top.

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
from pathlib import Path

from benchmarks.timing import Result

TARGET = 10_000.0
"""Exchanges per second."""
_RATE = 1200
_RUNNING = (1460, 1460, 1460, 1500, 0, 0, 0, 1660, 0, 0, 0, 0, 0, 0, 0, 0)
"""us: rotor turning, lowest collective."""


def exchanges(name: str, *, count: int, repeats: int) -> list[Result]:
    """The best of several runs of `count` exchanges at 1200 frames per second of flight: by the clock and, where the
    system tells it, by the link's own processor time."""
    command = [sys.executable, "-m", "swashplate", "link", "ardupilot", "--vehicle", name, "--port", "0"]
    with subprocess.Popen([*command, "--settings", "idle_exit=20"], stderr=subprocess.PIPE, text=True) as link:
        try:
            port = _port(link)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:  # a link belongs to its sender
                client.settimeout(10.0)
                client.connect(("127.0.0.1", port))
                runs = [_run(client, range(k * count, (k + 1) * count), link.pid) for k in range(repeats)]
        finally:
            link.terminate()
            link.communicate()
    rate, sender = count / min(clock for clock, _, _ in runs), min(own for _, own, _ in runs)
    results = [Result(f"ArduPilot link, {name}", rate, TARGET, f"{rate / _RATE:.1f} times real time at {_RATE} Hz")]
    if spent := [link_time for _, _, link_time in runs if link_time is not None]:
        each, others = (1e6 * min(spent) / count, 1e6 * sender / count)
        note = f"{each:.0f} us of the link's processor time; the sender's own {others:.0f}"
        results.append(Result(f"ArduPilot link, {name}, a second of its processor", count / min(spent), TARGET, note))
    return results


def _port(link: subprocess.Popen[str]) -> int:
    assert link.stderr is not None
    for line in link.stderr:
        if match := re.search(r"UDP 127\.0\.0\.1:(\d+)", line):
            return int(match[1])
    raise RuntimeError("the link did not start")


def _processor(pid: int) -> float | None:
    """Time that a process has had a processor [s]; None where the system has no word on it."""
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_text(encoding="ascii").split()[0]) / 1e9
    except (OSError, ValueError, IndexError):
        return None


def _run(client: socket.socket, frames: range, link: int) -> tuple[float, float, float | None]:
    """Seconds by the clock, of this process's processor, and of the link's."""
    packets = [struct.pack("<HHI16H", 18458, _RATE, frame, *_RUNNING) for frame in frames]
    had, begin, own = _processor(link), time.perf_counter(), time.process_time()
    for packet in packets:
        client.send(packet)
        client.recv(4096)
    clock, own, has = time.perf_counter() - begin, time.process_time() - own, _processor(link)
    return clock, own, has - had if has is not None and had is not None else None


def measure(*, short: bool) -> list[Result]:
    """Both kinds of vehicle; the short form takes one."""
    if short:
        return list(exchanges("coax", count=500, repeats=1))
    return [row for name in ("raptor50", "coax") for row in exchanges(name, count=10_000, repeats=5)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="fewer exchanges and repeats")
    for result in measure(short=parser.parse_args().short):
        verdict = "met" if result.met else "MISSED"
        print(f"{result.name}: {result.rate:,.0f} per second, promised {TARGET:,.0f}: {verdict}; {result.note}")


if __name__ == "__main__":
    main()
