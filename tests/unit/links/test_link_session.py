"""ArduPilot's link without sockets: lockstep, resends, restarts, rubbish, and physics that agree with themselves."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from heli_autopilot import Gains, HeliAutopilot, read_line, servo_packet
from link_bench import QUICK, Bench, bench
from swashplate.errors import SwashError
from swashplate.links.estimating import Estimating
from swashplate.models.catalogue import vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.sensors import InertialUnit
from swashplate.simulation.standing import standing
from swashplate.simulation.stepping import MakeEngine

IDLE = [1460, 1460, 1460, 1500, 0, 0, 0, 1000]
RUNNING = [1460, 1460, 1460, 1500, 0, 0, 0, 1660]
COAX_IDLE = [1500, 1500, 1500, 1500, 1000, 1000]


@pytest.fixture(scope="module")
def line() -> Bench:
    """One bench for tests that leave it as they like: every one begins with a restart."""
    return bench("raptor50", engine=QUICK)


def restarted(line: Bench) -> Bench:
    line.sender = ("127.0.0.1", line.sender[1] + 1)
    line.now += 10.0
    line.said.clear()
    line.session._notices.counts.clear()
    return line


def state(line: Bench) -> tuple[tuple[float, ...], float]:
    return tuple(line.plant._held.states), line.plant.time


@pytest.mark.parametrize(
    ("name", "idle", "engine"),
    [
        ("raptor50", IDLE, QUICK),
        ("coax", COAX_IDLE, QUICK),
        pytest.param("coax", COAX_IDLE, None, marks=pytest.mark.proof),  # by XLA, as where there is no compiler
    ],
)
def test_at_rest_on_the_ground(name: str, idle: list[int], engine: MakeEngine | None) -> None:
    at = bench(name, engine=engine)
    for count in range(400):
        answer = at.send(servo_packet(400, count, idle))
    assert answer is not None
    told = read_line(answer)
    np.testing.assert_allclose(told["accel_body"], [0.0, 0.0, -9.81], atol=1e-6)
    for key in ("gyro", "position", "attitude", "velocity"):
        np.testing.assert_allclose(told[key], 0.0, atol=1e-6)
    assert told["timestamp"] == [1.0]
    assert told["rpm_1"][0] == pytest.approx(0.0, abs=1e-6)


def test_the_answer_is_one_json_object_without_blanks(line: Bench) -> None:
    restarted(line)
    answer = line.send(servo_packet(1200, 0, IDLE))
    assert answer is not None
    assert answer.startswith(b"\n{")
    assert answer.endswith(b"}\n")
    assert b" " not in answer
    told = json.loads(answer)
    assert list(told)[:5] == ["timestamp", "imu", "position", "attitude", "velocity"]
    assert list(told).index("velocity") < list(told).index("velocity_wind")
    assert told["timestamp"] == pytest.approx(1.0 / 1200.0, abs=1e-9)


def test_resend_skip_late_and_second_autopilot(line: Bench) -> None:
    restarted(line)
    for count in range(20):
        last = line.send(servo_packet(400, count, RUNNING))
    before = state(line)
    assert line.send(servo_packet(400, 19, RUNNING)) == last  # a resend: the same answer
    assert line.send(servo_packet(400, 18, RUNNING)) is None  # a network's duplicate
    here, line.sender = line.sender, ("127.0.0.1", 40_000)
    assert line.send(servo_packet(400, 900, RUNNING)) is None  # a second autopilot
    line.sender = here
    assert state(line) == before
    assert line.send(servo_packet(400, 25, RUNNING)) is not None  # five frames were lost
    assert line.plant.time == pytest.approx(21.0 / 400.0)
    assert len(line.said) == 5


@pytest.mark.parametrize("rate", [50, 400, 1200, 2000])
def test_the_frame_rate_is_the_step(line: Bench, rate: int) -> None:
    restarted(line)
    stamps = [json.loads(line.send(servo_packet(rate, k, IDLE)) or b"")["timestamp"] for k in range(50)]
    np.testing.assert_allclose(np.diff(stamps), 1.0 / rate, atol=2e-9)


def test_the_rate_does_not_creep_away(line: Bench) -> None:
    """ArduPilot cuts 1/step to a whole number and asks for that next: the step must not follow."""
    restarted(line)
    rate, last = 1200, 0.0
    for count in range(2000):
        stamp = json.loads(line.send(servo_packet(rate, count, IDLE)) or b"")["timestamp"]
        rate, last = int(np.float32(1.0 / (stamp - last))), stamp
    assert rate in (1199, 1200, 1201)
    assert line.plant.time == pytest.approx(2000 / 1200, rel=1e-3)


@pytest.mark.parametrize(("wanted", "least", "most"), [(800.0, 800.0, 1180.0), (2000.0, 1198.0, 1202.0)])
def test_sim_rate_is_followed_slowly_down_and_not_up(line: Bench, wanted: float, least: float, most: float) -> None:
    """SIM_JSON starts at 1200 Hz and moves by one a frame from the step it got towards SIM_RATE_HZ."""
    restarted(line)
    rate, last = 1200.0, 0.0
    for count in range(900):
        stamp = json.loads(line.send(servo_packet(int(rate), count, IDLE)) or b"")["timestamp"]
        got, last = float(np.float32(1.0 / (stamp - last))), stamp
        rate = min(max(wanted, got - 1.0), got + 1.0)
    assert least <= got <= most


def test_restart_in_mid_flight(line: Bench) -> None:
    restarted(line)
    first = [line.send(servo_packet(400, k, RUNNING)) for k in range(1500)]
    assert read_line(first[-1] or b"")["rpm_1"][0] > 500.0
    again = [line.send(servo_packet(400, k, RUNNING)) for k in range(1500)]  # the count fell back: restarted
    assert again == first
    line.sender = ("127.0.0.1", 40_001)  # restarted with another port: it asks until the old one has been silent
    before = line.session.progress
    for _ in range(2):
        assert line.send(servo_packet(400, 0, RUNNING)) is None
        line.now += 1.0
    assert [line.send(servo_packet(400, k, RUNNING)) for k in range(100)] == first[:100]
    after = line.session.progress
    assert (after.restarts, after.takeovers) == (before.restarts + 1, before.takeovers + 1)
    assert after.strays == before.strays + 2
    assert "taken the link over (127.0.0.1:40001, 16 outputs, 400 Hz) after 2.0 s" in line.said[-1]


def test_thirty_two_outputs(line: Bench) -> None:
    restarted(line)
    short = [line.send(servo_packet(400, k, RUNNING)) for k in range(50)]
    restarted(line)
    assert [line.send(servo_packet(400, k, RUNNING, outputs=32)) for k in range(50)] == short


@pytest.mark.parametrize("packets", [10_000, pytest.param(100_000, marks=pytest.mark.proof)])
def test_rubbish_changes_nothing_and_is_told_once_a_kind(line: Bench, packets: int) -> None:
    """Random bytes, and packets with bits, bytes, length or order changed, beside a flight that goes on."""
    restarted(line)
    for count in range(1000, 1400):
        line.send(servo_packet(400, count, RUNNING))
    line.said.clear()
    line.session._notices.counts.clear()
    before, random = state(line), np.random.default_rng(0)
    good = servo_packet(400, 1400, RUNNING)
    refused = 0
    for k in range(packets):
        data = bytearray(good)
        if k % 4 == 0:
            data = bytearray(random.bytes(int(random.integers(0, 120))))
        elif k % 4 == 1:
            for bit in random.integers(0, 8 * len(data), random.integers(1, 6)):
                data[bit // 8] ^= 1 << (bit % 8)
        elif k % 4 == 2:
            data = data[: random.integers(0, len(data))] + random.bytes(int(random.integers(0, 3)))
        else:
            random.shuffle(data)  # type: ignore[arg-type]
        if is_a_good_frame(bytes(data), count=1399):
            continue
        line.now += 1e-6
        assert line.session.handle(bytes(data), line.sender, line.now) is None, data.hex()
        refused += 1
    assert refused > 0.8 * packets
    assert state(line) == before
    assert len(line.said) == len(line.session._notices.counts) <= 7
    assert line.session._notices.counts["magic"] > 0.2 * packets
    assert line.send(good) is not None  # and the flight goes on


def is_a_good_frame(data: bytes, *, count: int) -> bool:
    """By the document alone: nothing in such a packet shows that it was changed on its way.

    Bits that flip in a pulse within a servo's range, in the rate, or in the count of a frame that may come next.
    """
    if len(data) != 40 or data[:2] != b"\x1a\x48":
        return False
    rate, which = int.from_bytes(data[2:4], "little"), int.from_bytes(data[4:8], "little")
    pulses = [int.from_bytes(data[8 + 2 * k : 10 + 2 * k], "little") for k in (0, 1, 2, 3, 7)]
    possible = count <= which <= count + 10_000 or which <= 100
    return 11 <= rate <= 20_000 and possible and all(p == 0 or 500 <= p <= 2500 for p in pulses)


FRAMES = 200
"""Per second of the flights below."""
SHIPPED = Gains((4.0, 6.0, 5.8), (0.21, 0.19, 0.0), (0.06, 0.024, 0.247), (0.105, 0.095, 0.0245))
"""ArduPilot's own helicopter defaults (copter-heli.parm)."""


def hovering(at: Bench, *, seconds: float = 6.0, gains: Gains | None = None) -> HeliAutopilot:
    pilot = HeliAutopilot(at.send, rate=FRAMES, gains=gains or Gains())
    pilot.fly(0.5)
    pilot.armed = pilot.interlock = True
    pilot.fly(9.0)
    pilot.height, pilot._lift = 2.0, 0.5
    pilot.fly(seconds)
    return pilot


@pytest.fixture(scope="module")
def flown() -> HeliAutopilot:
    """A take-off, a hover with lean, and a landing."""
    pilot = hovering(bench("raptor50", engine=QUICK))
    pilot.place = (3.0, -2.0)
    pilot.fly(4.0)
    pilot.height = 0.01
    pilot.fly(4.0)
    pilot.height = 0.0  # back to the lowest collective
    pilot.fly(1.0)
    return pilot


def test_take_off_hover_and_landing(flown: HeliAutopilot) -> None:
    down = np.array([a["position"][2] for a in flown.answers])
    assert np.abs(down[: 9 * FRAMES]).max() < 0.01
    assert down.min() == pytest.approx(-2.0, abs=0.3)
    last = flown.answers[-1]
    np.testing.assert_allclose(last["position"][2], 0.0, atol=0.02)
    np.testing.assert_allclose(last["accel_body"], [0.0, 0.0, -9.81], atol=0.3)
    assert max(abs(a) for answer in flown.answers for a in answer["attitude"][:2]) < 0.4


@pytest.mark.proof
def test_it_hovers_with_ardupilots_own_gains_and_noise() -> None:
    # With an ILMI of 0.1 a roll error holds a third of the hover's cyclic, so that it comes back slowly.
    pilot = hovering(bench("raptor50", engine=QUICK, unit=InertialUnit()), gains=SHIPPED, seconds=9.0)
    last = np.array([[*a["attitude"], *a["position"]] for a in pilot.answers[-FRAMES:]])
    assert np.ptp(last[:, :3], axis=0).max() < 0.05
    np.testing.assert_allclose(last[-1, 3:], [0.0, 0.0, -2.0], atol=2.5)
    assert last[-1, 5] < -1.5


def test_energy_and_attitude_agree(flown: HeliAutopilot) -> None:
    """Position is the integral of velocity, attitude of the rates, and energy of the specific force's power."""
    before_landing = flown.answers[: round(19.5 * FRAMES)]  # skids that hit the ground push for less than a frame
    columns = {key: np.array([a[key] for a in before_landing]) for key in before_landing[0]}
    dt, (phi, theta, _) = 1.0 / FRAMES, columns["attitude"].T
    p, q, r = columns["gyro"].T
    v = columns["velocity"]
    middle = 0.5 * (v[1:] + v[:-1])
    travelled = np.cumsum(middle * dt, axis=0)
    np.testing.assert_allclose(columns["position"][1:] - columns["position"][0], travelled, atol=1e-4)

    turning = q * np.sin(phi) + r * np.cos(phi)
    rates = np.stack([p + turning * np.tan(theta), q * np.cos(phi) - r * np.sin(phi), turning / np.cos(theta)], axis=1)
    moved = np.cumsum(0.5 * (rates[1:] + rates[:-1]) * dt, axis=0)
    attitude = np.unwrap(columns["attitude"], axis=0)
    np.testing.assert_allclose(attitude[1:] - attitude[0], moved, atol=3e-4)

    from scipy.spatial.transform import Rotation

    turned = Rotation.from_euler("ZYX", columns["attitude"][:, ::-1]).apply(columns["accel_body"])
    energy = 0.5 * np.sum(v**2, axis=1) - 9.81 * columns["position"][:, 2]  # per mass; down is negative height
    power = np.sum(turned * v, axis=1)
    # Inputs are held over a frame, so that forces step at its start: the end's force stands for the whole frame.
    done = np.cumsum(np.sum(turned[1:] * middle, axis=1) * dt)
    np.testing.assert_allclose(energy[1:] - energy[0], done, atol=0.002 * np.abs(energy).max())
    assert np.abs(power).max() > 1.0


def test_a_vehicle_that_goes_over_lies_still_until_the_autopilot_restarts() -> None:
    at = bench("raptor50", engine=QUICK)
    pilot = HeliAutopilot(at.send, rate=FRAMES, armed=True, interlock=True)
    pilot.fly(8.0)
    packets = [servo_packet(FRAMES, pilot.count + k, [2000, 1200, 1700, 1500, 0, 0, 0, 1660]) for k in range(800)]
    answers = [read_line(at.send(packet) or b"") for packet in packets]  # full roll and collective: it rolls over
    assert at.plant.broken
    last = answers[-1]
    assert last["velocity"] == [0.0, 0.0, 0.0]
    assert last["gyro"] == [0.0, 0.0, 0.0]
    assert np.linalg.norm(last["accel_body"]) == pytest.approx(9.81, abs=1e-6)
    assert answers[-2]["timestamp"] < last["timestamp"]
    assert sum("broke" in words for words in at.said) == 1
    fresh = read_line(at.send(servo_packet(400, 0, IDLE)) or b"")
    np.testing.assert_allclose(fresh["accel_body"], [0.0, 0.0, -9.81], atol=1e-6)
    assert not at.plant.broken


def test_wind_battery_and_noise_are_told() -> None:
    windy = bench("coax", environment=Environment(3.0, 0.0, 0.0, voltage=12.0), sag=0.5, engine=QUICK)
    told = json.loads(windy.send(servo_packet(400, 0, COAX_IDLE)) or b"")
    assert told["velocity_wind"] == [3.0, 0.0, 0.0]
    assert told["windvane"]["speed"] == pytest.approx(3.0, abs=0.01)
    assert abs(told["windvane"]["direction"]) == pytest.approx(math.pi, abs=0.01)  # from behind
    for count in range(1, 400):
        told = json.loads(windy.send(servo_packet(400, count, [*COAX_IDLE[:4], 1400, 1400])) or b"")
    assert told["battery"]["voltage"] == pytest.approx(11.5, abs=0.01)
    assert 0.05 < told["battery"]["current"] < 5.0
    assert told["rpm"]["rpm_1"] > 1000.0
    assert told["rpm"]["rpm_2"] > 1000.0

    def noisy(seed: int) -> np.ndarray:
        at = bench("raptor50", engine=QUICK, unit=InertialUnit(), seed=seed)
        rows = [json.loads(at.send(servo_packet(400, k, IDLE)) or b"")["imu"] for k in range(300)]
        return np.array([[*row["gyro"], *row["accel_body"]] for row in rows])

    one, same, other = noisy(1), noisy(1), noisy(2)
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)
    unit = InertialUnit()
    np.testing.assert_allclose(one.std(axis=0)[:3], unit.rate_noise, rtol=0.2)
    np.testing.assert_allclose(one.std(axis=0)[3:], unit.force_noise, rtol=0.2)


def test_the_coax_lifts_off_and_lands() -> None:
    """Motors by a height loop, through the outputs of ArduPilot's coaxial frame; its own damping does the rest.

    What is estimated beside it counts in the air only, and finds the mass from a model that is a tenth too light.
    """
    estimating = Estimating(vehicle("coax").with_values({"mass": 0.272}), ["mass"], rate=100.0)
    at = bench("coax", estimating=estimating, engine=QUICK)
    before = estimating.known
    lift, heights = 0.0, []
    for count in range(400 * 6):
        told = json.loads(at.send(servo_packet(400, count, pulses_of(lift))) or b"")
        height, climb, turn = -told["position"][2], -told["velocity"][2], told["imu"]["gyro"][2]
        heights.append(height)
        if at.plant.time < 0.5:
            assert estimating.known is before
        wanted = 0.3 if count < 400 * 4 else -0.2
        lift = min(0.9, max(0.0, 0.545 + 0.25 * (wanted - height) - 0.25 * climb)) if count > 200 else 0.0
        if count >= 400 * 5 and height < 0.02:
            lift = 0.0
        at_yaw = 0.05 * turn
        pulses_of.yaw = at_yaw  # type: ignore[attr-defined]
    assert max(heights) > 0.15
    assert abs(heights[-1]) < 0.01
    (mass,) = estimating.known
    assert mass.value is not None
    assert mass.sigma is not None
    assert abs(mass.value - 0.302) < 3.0 * mass.sigma < 0.03
    assert not at.plant.broken


def pulses_of(lift: float) -> list[int]:
    yaw = getattr(pulses_of, "yaw", 0.0)
    if lift == 0.0:
        return COAX_IDLE
    return [1500, 1500, 1500, 1500, int(1000 + 1000 * (lift - yaw)), int(1000 + 1000 * (lift + yaw))]


def test_only_bodies_can_stand() -> None:
    from dataclasses import replace

    bodiless = replace(vehicle("coax"), state_names=("a",) * 18)
    with pytest.raises(SwashError, match="no position"):
        standing(bodiless)
