"""PX4's link against a client that speaks MAVLink as PX4's simulator module does."""

from __future__ import annotations

import math
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from link_bench import QUICK
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.px4 import place, runner
from swashplate.links.px4.messages import Mavlink, pulses
from swashplate.links.px4.runner import serve
from swashplate.links.px4.session import RATE, Px4Session
from swashplate.links.sensing import Sensing
from swashplate.links.servos import servo_mapping
from swashplate.links.sockets import listen_tcp
from swashplate.models.catalogue import vehicle
from swashplate.physics.environment import Environment
from swashplate.physics.frames import Vector
from swashplate.simulation.standing import standing

pytest.importorskip("pymavlink")
from pymavlink.dialects.v20 import common

said: list[str] = []


@pytest.fixture(scope="module")
def session() -> Px4Session:
    made = standing(vehicle("coax"))
    plant = Plant(made, servo_mapping("coax_px4", made), Surroundings(Environment()), engine=QUICK)
    plant.prepare()
    return Px4Session(plant, Sensing(plant), Notices(said.append))


@contextmanager
def served(session: Px4Session) -> Iterator[int]:
    running = True
    with listen_tcp("127.0.0.1", 0) as listening:
        thread = threading.Thread(
            target=serve, args=(listening, session, Notices(said.append)), kwargs={"go_on": lambda: running}
        )
        thread.start()
        try:
            yield listening.getsockname()[1]
        finally:
            running = False
            thread.join()


class Px4:
    """A PX4 that answers every HIL_SENSOR with what it is told to command."""

    def __init__(self, port: int) -> None:
        self.line = socket.create_connection(("127.0.0.1", port), timeout=5.0)
        self.mavlink = common.MAVLink(None)
        self.latest: dict[str, Any] = {}
        self.waiting: list[Any] = []

    def __enter__(self) -> Px4:
        return self

    def __exit__(self, *_: object) -> None:
        self.line.close()

    def sensor(self) -> Any:
        """The next HIL_SENSOR; what comes beside it is kept by name."""
        while True:
            while self.waiting:
                message = self.waiting.pop(0)
                self.latest[message.get_type()] = message
                if message.get_type() == "HIL_SENSOR":
                    return message
            data = self.line.recv(4096)
            assert data, "the link closed"
            self.waiting += self.mavlink.parse_buffer(data) or []

    def command(self, *controls: float, flags: int = 1) -> None:
        row = [*controls, *([0.0] * (16 - len(controls)))]
        message = self.mavlink.hil_actuator_controls_encode(0, row, 128, flags)
        self.line.sendall(message.pack(self.mavlink))


def test_at_rest_in_lockstep(session: Px4Session) -> None:
    with served(session) as port, Px4(port) as px4:
        stamps = []
        for _ in range(100):
            seen = px4.sensor()
            stamps.append(seen.time_usec)
            px4.command(0.0, 0.0, 0.0, 0.0)
        assert set(np.diff(stamps)) == {round(1e6 / RATE)}
        np.testing.assert_allclose([seen.xacc, seen.yacc, seen.zacc], [0.0, 0.0, -9.81], atol=1e-5)
        np.testing.assert_allclose([seen.xgyro, seen.ygyro, seen.zgyro], 0.0, atol=1e-5)
        np.testing.assert_allclose([seen.xmag, seen.ymag, seen.zmag], place.FIELD, atol=5e-3)
        assert seen.pressure_alt == pytest.approx(488.0, abs=1.0)
        assert seen.abs_pressure == pytest.approx(956.0, abs=1.0)  # ISA at 488 m
        fix, truth = px4.latest["HIL_GPS"], px4.latest["HIL_STATE_QUATERNION"]
        assert (fix.lat, fix.lon, fix.alt) == (473977420, 85455940, 488000)
        assert fix.fix_type == 3
        np.testing.assert_allclose(truth.attitude_quaternion, [1.0, 0.0, 0.0, 0.0], atol=1e-6)
        assert truth.zacc == round(-1000 * 9.81 / 9.80665)


def test_it_lifts_off_waits_for_answers_and_starts_anew(session: Px4Session) -> None:
    with served(session) as port:
        with Px4(port) as px4:
            for k in range(500):
                seen = px4.sensor()
                lift = 0.60 if k < 350 else float("nan")  # a motor that PX4 does not drive
                px4.command(lift, lift, 0.0, 0.0)
                if k == 340:
                    rotor, lower = px4.latest["RAW_RPM"], session.plant.rotor_speeds(session.plant.motion)[0]
            truth = px4.latest["HIL_STATE_QUATERNION"]
            assert truth.alt > 488_100
            assert rotor.index == 0
            assert rotor.frequency == pytest.approx(lower * 30.0 / np.pi, rel=0.01)
            assert seen.zacc > -9.0  # falling with the motors off
            px4.sensor()
            before = session.exchanges
            px4.line.sendall(b"\xfd" + bytes(range(200)) * 20)  # rubbish moves nothing
            px4.line.settimeout(0.3)
            with pytest.raises(TimeoutError):
                px4.sensor()
            px4.line.settimeout(5.0)
            assert session.exchanges == before
            px4.command(0.0, 0.0, 0.0, 0.0)
        with Px4(port) as again:
            first = again.sensor()
            assert first.time_usec == round(1e6 / RATE)
            assert again.sensor().time_usec > first.time_usec  # no controls yet: real time
            assert again.latest["HIL_GPS"].alt == 488_000
    assert sum("PX4 is here" in words for words in said) >= 2
    assert sum("no MAVLink message" in words for words in said) <= 1


def test_controls_as_pulses() -> None:
    controls = [0.25, 2.0, -1.0, 0.5, float("nan"), float("inf")]
    assert pulses(controls, shares=(1, 2)) == [1250.0, 2000.0, 1000.0, 1750.0, 0.0, 0.0]


@pytest.mark.parametrize("attitude", [(0.0, 0.0, 0.0), (0.3, -0.4, 2.5), (-1.2, 1.4, -3.0)])
def test_quaternion_and_field(attitude: tuple[float, float, float]) -> None:
    from scipy.spatial.transform import Rotation

    w, x, y, z = place.quaternion(attitude)
    turned = Rotation.from_euler("ZYX", attitude[::-1])
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), turned.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(place.field_seen(attitude), turned.inv().apply(place.FIELD), atol=1e-12)


def test_coordinates_are_those_of_a_sphere() -> None:
    latitude, longitude, altitude = place.coordinates(Vector(1000.0, -500.0, -20.0))
    assert (latitude - place.LATITUDE) * math.pi / 180.0 * place.EARTH == pytest.approx(1000.0)
    around = place.EARTH * math.cos(math.radians(place.LATITUDE))
    assert (longitude - place.LONGITUDE) * math.pi / 180.0 * around == pytest.approx(-500.0)
    assert altitude == pytest.approx(508.0)


def test_rubbish_in_the_stream_commands_nothing() -> None:
    """Random bytes and damaged messages; a checksum of 16 bits lets one in 65,536 through."""
    writer, reader = common.MAVLink(None), Mavlink()
    good = bytes(writer.hil_actuator_controls_encode(1, [0.5] * 16, 128, 1).pack(writer))
    random, taken = np.random.default_rng(0), 0
    for k in range(6_000):
        data = bytearray(good)
        if k % 3 == 0:
            data = bytearray(random.bytes(int(random.integers(0, 200))))
        elif k % 3 == 1:
            for bit in random.choice(8 * len(data), random.integers(1, 5), replace=False):
                data[bit // 8] ^= 1 << (bit % 8)
        else:
            data = data[: random.integers(0, len(data))]
        found, _ = reader.read(bytes(data))
        taken += len(found)
    assert taken <= 1
    for _ in range(3):  # a piece of rubbish may still wait for its end
        found, _ = reader.read(good)
        taken += len(found)
    assert taken >= 1


def test_a_second_connection_waits_until_the_first_has_gone(session: Px4Session) -> None:
    said.clear()
    with served(session) as port, Px4(port) as px4:
        before = session.restarts
        px4.sensor()
        px4.command(0.0, 0.0, 0.0, 0.0)
        others = [socket.create_connection(("127.0.0.1", port), timeout=5.0) for _ in range(3)]
        stamps = []
        begun = time.monotonic()
        while time.monotonic() - begun < 0.7:
            stamps.append(px4.sensor().time_usec)
            px4.command(0.0, 0.0, 0.0, 0.0)
        assert set(np.diff(stamps)) == {round(1e6 / RATE)}
        assert session.restarts == before
        others[0].settimeout(0.1)
        with pytest.raises(TimeoutError):
            others[0].recv(1)  # it waits
        for other in others[1:]:
            assert other.recv(1) == b"", "one may wait"
        assert sum("waits and is counted" in words for words in said) == 1
        px4.line.close()
        others[0].settimeout(5.0)
        assert others[0].recv(10), "its turn"
        for other in others:
            other.close()


def test_a_connection_that_hangs_loses_the_link_to_one_that_waits(
    session: Px4Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "SILENT", 0.6)
    said.clear()
    with served(session) as port, Px4(port) as hanging:
        hanging.sensor()
        hanging.command(0.0, 0.0, 0.0, 0.0)  # and never again
        begun = time.monotonic()
        with Px4(port) as px4:
            assert px4.sensor().time_usec == round(1e6 / RATE)
            assert time.monotonic() - begun >= 0.4
    assert any("silent for 0.6 s; another PX4 takes the link over" in words for words in said)
