"""ArduPilot's link over real sockets on this machine: losses, duplicates, restarts of either side, ports."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

import swashplate as sp
from heli_autopilot import servo_packet
from link_bench import QUICK, Bench, bench
from swashplate.errors import LinkError
from swashplate.links.ardupilot import frames
from swashplate.links.ardupilot.runner import serve
from swashplate.links.sockets import is_loopback, listen_tcp, listen_udp

IDLE = [1500, 1500, 1500, 1500, 1000, 1000]


@pytest.fixture(scope="module")
def coax() -> Bench:
    made = bench("coax", engine=QUICK)
    made.plant.prepare()
    return made


def forgotten(at: Bench, *, prepared: bool = True) -> Bench:
    """The link as if it had just been opened: nobody owns it."""
    at.session.__init__(at.plant, at.session._sensing, at.session._notices)  # type: ignore[misc]
    if prepared:
        at.session.prepare()
    at.said.clear()
    at.session._notices.counts.clear()
    return at


@contextmanager
def served(at: Bench, port: int = 0) -> Iterator[int]:
    """A running link; its port."""
    running = True
    with listen_udp("127.0.0.1", port) as bound:
        thread = threading.Thread(target=serve, args=(bound, at.session), kwargs={"go_on": lambda: running})
        thread.start()
        try:
            yield bound.getsockname()[1]
        finally:
            running = False
            thread.join()


class Client:
    """Sends and waits, as an autopilot does."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(30.0)
        self.port = port

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def tell(self, data: bytes) -> None:
        self.socket.sendto(data, ("127.0.0.1", self.port))

    def answer(self, data: bytes) -> bytes:
        self.tell(data)
        return self.socket.recv(4096)

    def ask(self, data: bytes) -> dict[str, object]:
        return dict(json.loads(self.answer(data)))


def test_lockstep_with_losses_and_duplicates(coax: Bench) -> None:
    with served(forgotten(coax)) as port, Client(port) as client:
        stamps = []
        for count in range(200):
            packet = servo_packet(400, count, IDLE)
            told = client.ask(packet)
            if count % 7 == 3:  # the answer was lost: the autopilot repeats itself
                assert client.ask(packet) == told
            if count % 11 == 5:  # rubbish on the line, and a late duplicate
                client.tell(b"rubbish")
                client.tell(servo_packet(400, count - 1, IDLE))
            stamps.append(told["timestamp"])
        assert stamps == pytest.approx([(k + 1) / 400.0 for k in range(200)])
        client.socket.settimeout(0.05)
        with pytest.raises(TimeoutError):
            client.socket.recv(100)  # nothing more than one answer a question was sent


@pytest.mark.skipif(QUICK is None, reason="C is compared with Python")
def test_c_answers_as_python_does(tmp_path: Path) -> None:
    """To the byte, ordinary packets and others, in flight, over a wreck and in what is recorded."""
    at, told = bench("raptor50", record=tmp_path / "flight.nc", engine=QUICK), []
    for name, value in (("z", -3.0), ("phi", 3.0), ("p", 2.0)):  # aloft, turning onto its back: it falls
        at.plant._rest[at.plant.vehicle.index(name)] = value
    for prepared in (False, True):
        forgotten(at, prepared=prepared)
        answers = []
        with served(at) as port, Client(port) as client:
            for count in range(400):
                if count in (40, 90):
                    client.tell(servo_packet(400, count, [9000] * 16))  # no servo's pulse
                    client.tell(servo_packet(400, count - 8, [1500] * 16))  # late
                skipped = 2 if count > 160 else 0
                rate = 405 if count > 180 else 400
                pulses = [1460 + count % 50, 1460, 1460 - count % 30, 1500, 0, 0, 0, 1660]
                answers.append(client.answer(servo_packet(rate, count + skipped, pulses)))
        assert (at.session._lockstep is not None) is prepared
        assert at.plant.broken
        assert sum("the vehicle broke" in words for words in at.said) == 1
        told.append((answers, at.said[-5:]))
    assert told[0] == told[1]
    assert at.recorder is not None
    first, second = (sp.read(file).values("phi") for file in at.recorder.finish())
    assert first.tobytes() == second.tobytes()


def test_restarts_of_either_side(coax: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frames, "SILENT", 60.0)  # only asking again and again is left
    with served(forgotten(coax)) as port, Client(port) as client:
        for count in range(50):
            client.ask(servo_packet(400, count, IDLE))
    with served(forgotten(coax), port), Client(port) as client:  # the physics anew: it joins an autopilot that waits
        assert client.ask(servo_packet(400, 50, IDLE))["timestamp"] == pytest.approx(1 / 400)
        assert client.ask(servo_packet(400, 51, IDLE))["timestamp"] == pytest.approx(2 / 400)
        with Client(port) as other:  # the autopilot anew, from another port: it repeats itself until it is answered
            other.socket.settimeout(0.3)
            begun, told = time.monotonic(), None
            while told is None and time.monotonic() - begun < 30.0:
                with suppress(TimeoutError):
                    told = other.ask(servo_packet(400, 0, IDLE))
            assert told is not None
            assert time.monotonic() - begun >= 1.5
            assert told["timestamp"] == pytest.approx(1 / 400)
            assert other.ask(servo_packet(400, 1, IDLE))["timestamp"] == pytest.approx(2 / 400)


def test_a_second_autopilot_takes_nothing_from_the_first(coax: Bench) -> None:
    """Every packet of the first is answered in its own time, none of the second, whatever its counts."""
    with served(forgotten(coax)) as port, Client(port) as first, Client(port) as second:
        stamps = []
        for count in range(300):
            stamps.append(first.ask(servo_packet(400, 5000 + count, IDLE))["timestamp"])
            second.tell(servo_packet(400, count % 101, IDLE))
        assert stamps == pytest.approx([(k + 1) / 400.0 for k in range(300)])
        second.socket.settimeout(0.2)
        with pytest.raises(TimeoutError):
            second.socket.recv(100)
    progress = coax.session.progress
    assert (progress.restarts, progress.takeovers, progress.strays) == (0, 0, 300)
    assert sum("are ignored and counted" in words for words in coax.said) == 1


def test_nothing_is_sent_before_the_first_packet_and_the_wait_can_end(coax: Bench) -> None:
    with listen_udp("127.0.0.1", 0) as bound, Client(bound.getsockname()[1]) as client:
        client.tell(b"no packet")
        serve(bound, coax.session, idle_exit=0.3)
        client.socket.settimeout(0.05)
        with pytest.raises(TimeoutError):
            client.socket.recv(100)


@pytest.mark.parametrize("listen", [listen_udp, listen_tcp])
def test_a_port_in_use_is_told(listen: object) -> None:
    with listen("127.0.0.1", 0) as bound:  # type: ignore[operator]
        with pytest.raises(LinkError, match="in use by another program") as told:
            listen("127.0.0.1", bound.getsockname()[1])  # type: ignore[operator]
        assert told.value.channel == "--port"


def test_addresses() -> None:
    assert is_loopback("127.0.0.1")
    assert is_loopback("127.3.2.1")
    assert not is_loopback("0.0.0.0")
    with pytest.raises(LinkError, match="no IPv4 address"):
        is_loopback("localhost")
    with pytest.raises(LinkError, match="cannot be opened"):
        listen_udp("192.0.2.1", 0)
