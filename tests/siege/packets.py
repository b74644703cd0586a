"""Mutated packets and messages for everything that listens: refused and counted, and the flight goes on unmoved."""

from __future__ import annotations

import asyncio
import json
import random
import struct
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import common

from heli_autopilot import servo_packet
from link_bench import QUICK, bench
from swashplate.links.live.messages import SCHEMA, MessageError, parse
from swashplate.links.live.session import LiveSession
from swashplate.links.mavlink.parameter_reading import ParameterReading
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.px4.messages import OUTPUTS
from swashplate.links.px4.session import Px4Session
from swashplate.links.sensing import Sensing
from swashplate.links.servos import servo_mapping
from swashplate.models.catalogue import vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.standing import standing

from .damage import ODD_NUMBERS, damaged
from .found import Found, progress

_RUNNING = [1460, 1460, 1460, 1500, 0, 0, 0, 1660]
_EVERY = 500
"""Packets between looks at whether the link still flies as it should."""


@dataclass
class _Link:
    """A listener under siege: takes one packet, and says what is wrong with it afterwards ("": nothing)."""

    take: Callable[[bytes, random.Random], None]
    whole: tuple[bytes, ...]
    look: Callable[[], str]
    close: Callable[[], None] = lambda: None


def _mutant(link: _Link, chance: random.Random) -> bytes:
    if chance.random() < 0.05:
        return chance.randbytes(chance.choice((0, 1, 7, 40, 72, 100, 1500)))
    return damaged(chance.choice(link.whole), chance, others=link.whole)


def _ardupilot() -> _Link:
    """A flight with strangers' damaged packets between its own, beside one that nobody disturbs."""
    besieged, calm = (bench("raptor50", engine=QUICK) for _ in range(2))
    count, stranger = [0], ("127.0.0.1", 40_000)
    for at in (besieged, calm):
        at.session.handle(servo_packet(400, 0, _RUNNING), at.sender, 0.0)

    def take(data: bytes, chance: random.Random) -> None:
        besieged.now += 1e-4
        answer = besieged.session.handle(data, stranger, besieged.now)
        assert answer is None, "a stranger was answered"

    def look() -> str:
        for _ in range(5):
            count[0] += 1
            packet = servo_packet(400, count[0], _RUNNING)
            answers = [at.session.handle(packet, at.sender, at.now) for at in (besieged, calm)]
            if answers[0] != answers[1] or answers[0] is None:
                return "the flight is not the one that nobody disturbed"
        return ""

    whole = tuple(servo_packet(400, n, _RUNNING, outputs=o) for n in (0, 1, 5, 1000) for o in (16, 32))
    return _Link(take, whole, look)


def _second_autopilot() -> _Link:
    """Whole packets of other autopilots between the owner's: on another port and another machine, with its own counts,
    the ones before and behind, and those of a start. The owner pauses and starts anew now and then; it is never silent
    for longer than 1.4 s: from `QUIET` (1.5 s) on, another one that keeps asking is to have the link."""
    besieged, calm = (bench("raptor50", engine=QUICK) for _ in range(2))
    others = (("127.0.0.1", besieged.sender[1] + 1), ("10.0.0.9", besieged.sender[1]))
    count, heard, wrong = [-1], [0.0], [""]

    def own(chance: random.Random) -> None:
        count[0] = 0 if chance.random() < 0.002 else count[0] + 1
        pulses = [pulse and pulse + chance.randrange(-5, 6) for pulse in _RUNNING]
        packet, heard[0] = servo_packet(400, count[0], pulses), besieged.now
        answers = [at.session.handle(packet, at.sender, besieged.now) for at in (besieged, calm)]
        if answers[0] != answers[1] or answers[0] is None:
            wrong[0] = "the flight is not the one that nobody disturbed"

    def take(data: bytes, chance: random.Random) -> None:
        later = 1.3 if chance.random() < 0.001 else chance.choice((1e-4, 1e-3, 2.5e-3, 0.02))
        if count[0] >= 0 and besieged.now + later - heard[0] > 1.4:
            own(chance)
        besieged.now += later
        if count[0] < 0 or chance.random() < 0.5:
            own(chance)
            return
        number = chance.choice((count[0], count[0] + 1, max(count[0] - 1, 0), 0, 1, 100, 2**32 - 1))
        packet = servo_packet(400, number, _RUNNING, outputs=chance.choice((16, 32)))
        if besieged.session.handle(packet, chance.choice(others), besieged.now) is not None:
            wrong[0] = "another autopilot was answered"
        if chance.random() < 0.001:
            own(chance)

    return _Link(take, (servo_packet(400, 0, _RUNNING),), lambda: wrong[0])


def _own_ardupilot() -> _Link:
    """Damaged packets of the autopilot itself: what is accepted may fly, and the numbers stay numbers."""
    at = bench("raptor50", engine=QUICK)
    count = [0]

    def take(data: bytes, chance: random.Random) -> None:
        if len(data) >= 8 and chance.random() < 0.5:  # one that would be the next frame
            data = data[:4] + struct.pack("<I", count[0] + 1) + data[8:]
        at.now += 1e-3
        if at.session.handle(data, at.sender, at.now) is not None:
            count[0] = struct.unpack("<I", data[4:8])[0]

    def look() -> str:
        at.now += 10.0
        for k in range(3):
            answer = at.session.handle(servo_packet(400, k, _RUNNING), at.sender, at.now)
            count[0] = k
        if answer is None or not np.all(np.isfinite(at.plant._held.states)):
            return "a restarted autopilot is not answered with numbers"
        json.loads(answer)
        return ""

    return _Link(take, tuple(servo_packet(400, n, _RUNNING) for n in (0, 1, 2)), look)


def _px4() -> _Link:
    made = standing(vehicle("coax"))
    plant = Plant(made, servo_mapping("coax_px4", made), Surroundings(Environment()), engine=QUICK)
    session = Px4Session(plant, Sensing(plant), Notices(lambda _: None))
    client = common.MAVLink(None)
    kinds = [
        client.hil_actuator_controls_encode(1000, [0.1] * OUTPUTS, 128, 1),
        client.hil_actuator_controls_encode(2**60, [float("nan")] * OUTPUTS, 0, 0),
        client.heartbeat_encode(2, 12, 0, 0, 0),
        client.command_long_encode(1, 1, 511, 0, 1e30, 0, 0, 0, 0, 0, 0),
        client.param_value_encode(b"A" * 16, 1e30, 9, 65535, 65535),
    ]
    whole = tuple(message.pack(client) for message in kinds)

    def take(data: bytes, chance: random.Random) -> None:
        session.hear(data)
        if chance.random() < 0.05:
            session.step()

    def look() -> str:
        session.connected()
        if not session.hear(kinds[0].pack(client)):
            return "whole controls are not heard after a new connection"
        session.step()
        return "" if np.all(np.isfinite(plant._held.states)) else "the states are no numbers"

    return _Link(take, whole, look)


def _parameters() -> _Link:
    """What `--check` hears of an autopilot: parameters that come over MAVLink."""
    client = common.MAVLink(None)
    reader = [common.MAVLink(None)]
    reader[0].robust_parsing = True
    found = [ParameterReading()]
    kinds = [
        client.param_value_encode(b"SERVO1_MIN", 1000.0, 9, 900, 3),
        client.param_value_encode(b"\xff\xfe" * 8, float("inf"), 200, 65535, 65535),
        client.heartbeat_encode(2, 3, 81, 0, 4),
    ]

    def take(data: bytes, chance: random.Random) -> None:
        for message in reader[0].parse_buffer(bytearray(data)) or []:
            if message.get_type() == "PARAM_VALUE":
                found[0].take(message, packed=chance.random() < 0.5)

    def look() -> str:
        reader[0] = common.MAVLink(None)
        reader[0].robust_parsing = True
        found[0] = ParameterReading()
        take(kinds[0].pack(client), random.Random(0))
        return "" if found[0].values else "a whole parameter is not heard"

    return _Link(take, tuple(message.pack(client) for message in kinds), look)


def _page() -> _Link:
    """Messages of the live page: understood or refused in a word."""
    whole = [json.dumps({"type": "record", "value": True})]
    whole += [json.dumps({"type": kind, **dict.fromkeys(fields, 1)}) for kind, fields in SCHEMA.items()]

    def take(data: bytes, chance: random.Random) -> None:
        with suppress(MessageError):
            found = parse(data.decode("utf-8", errors="surrogateescape"))
            assert found.keys() == {"type", *SCHEMA[found["type"]]}

    def look() -> str:
        return "" if parse(whole[0])["value"] is True else "a whole message is not understood"

    return _Link(take, tuple(text.encode() for text in whole), look)


def _flown() -> _Link:
    """What the page says that it has flown, while it is recorded and estimated."""
    kept = ExitStack()
    folder = Path(kept.enter_context(tempfile.TemporaryDirectory()))
    session = LiveSession(vehicle("coax"), controller=None, folder=folder, estimate=["tau_f_upper", "p_dot=Lp*p"])
    kept.callback(session.close)
    asyncio.run(session.obey({"type": "record", "value": True}))
    flies = session.world.vehicle
    n, m = len(flies.state_names), len(flies.input_names)
    surroundings = [0.0, 0.0, 0.0, 11.0]

    def row(tick: int) -> bytes:
        return struct.pack(f"<{6 + n + m}d", session.version, tick, *[0.01] * n, *[0.1] * m, *surroundings)

    def take(data: bytes, chance: random.Random) -> None:
        with suppress(MessageError), np.errstate(all="ignore"):
            session.fly(data)
        json.dumps(session.report(), allow_nan=False)

    def look() -> str:
        going = session.recording
        session.fly(row(session._tick + 1))
        return "" if going is not None and going.path.stat().st_size else "nothing is recorded"

    return _Link(take, tuple(b"".join(row(k + j) for j in range(8)) for k in (0, 1, 49)), look, kept.close)


LINKS: dict[str, Callable[[], _Link]] = {
    "ArduPilot, strangers": _ardupilot,
    "ArduPilot, a second autopilot": _second_autopilot,
    "ArduPilot, the owner": _own_ardupilot,
    "PX4": _px4,
    "parameters over MAVLink": _parameters,
    "messages of the live page": _page,
    "what the live page has flown": _flown,
}


def _problem(call: Callable[[], str | None]) -> str:
    """What is wrong after a call, or which exception ended it."""
    try:
        return call() or ""
    except Exception as error:
        return f"{type(error).__name__}: {error}"[:200]


def besiege(*, packets: int, seconds: float, seed: int = 0) -> Found:
    """So many mutated packets for each link; where the time is too short, each link gets its part of what is left."""
    rows, bad, until = [], [], time.monotonic() + seconds
    for k, (name, make) in enumerate(LINKS.items()):
        share = (until - time.monotonic()) / (len(LINKS) - k)
        link, chance, begin, wrong, sent = make(), random.Random(f"{name} {seed}"), time.monotonic(), 0, 0
        while sent < packets and time.monotonic() - begin < share:
            data, began, sent = _mutant(link, chance), time.monotonic(), sent + 1
            problems = [_problem(partial(link.take, data, chance))]
            problems += [_problem(link.look)] if sent % _EVERY == 0 else []
            problems += ["took more than 10 s"] if time.monotonic() - began > 10.0 else []
            for problem in filter(None, problems):
                wrong += 1
                bad.append(f"{name}, packet {sent} {data[:40].hex()}: {problem}")
            progress(f"{name}: {sent} packets, {wrong} bad")
        link.close()
        rows.append([name, sent, round(sent / max(time.monotonic() - begin, 1e-9)), wrong])
    total = sum(row[1] for row in rows)
    text = (
        f"{total:,} packets: cut, doubled, bits turned, counts, rates, lengths and numbers odd ({len(ODD_NUMBERS)} of "
        f"them), pieces of other packets, and noise. Every {_EVERY} packets the link has to fly on: under strangers to "
        "the bit as a link that nobody disturbs (so also beside other autopilots whose packets are whole), otherwise "
        "from a restart, in finite numbers."
    )
    return Found("Siege: packets and messages", text, ["link", "packets", "a second", "wrong"], rows, bad)
