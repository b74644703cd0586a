"""Servo mappings: swashplates forth and back, ends and signs, and files that are wrong."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from swashplate.errors import LinkError
from swashplate.links import swashplates
from swashplate.links.px4.messages import pulses as pulses_of_px4
from swashplate.links.servo import Servo
from swashplate.links.servos import packaged, servo_mapping
from swashplate.models.catalogue import vehicle
from swashplate.simulation.standing import standing

RAPTOR, COAX = standing(vehicle("raptor50")), standing(vehicle("coax"))
OWN = {"raptor50": RAPTOR, "coax": COAX}


def ardupilot_outputs(kind: str, roll: float, pitch: float, collective: float) -> list[float]:
    """Servo outputs -1 to 1 by the factors of ArduPilot's parameter reference (H_SW_TYPE), collective 0 to 1."""
    factors = {
        "H3-120": [(0.866025, 0.5, 1.0), (-0.866025, 0.5, 1.0), (0.0, -1.0, 1.0)],
        "H3-140": [(1.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (0.0, -1.0, 1.0)],
        "H4-90": [(1.0, 0.0, 1.0), (-1.0, 0.0, 1.0), (0.0, -1.0, 1.0), (0.0, 1.0, 1.0)],
        "H1": [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)],
    }[kind]
    offset = {"H1": (0.5, 0.5, 0.0)}.get(kind, (0.0,) * 4)
    return [
        2.0 * ((r * roll + p * pitch) * 0.45 + c * collective + o) - 1.0
        for (r, p, c), o in zip(factors, offset, strict=False)
    ]


@pytest.mark.parametrize("kind", ["H1", "H3-120", "H3-140", "H4-90"])
def test_what_ardupilot_mixes_is_unmixed(kind: str) -> None:
    inverse = swashplates.unmixed(swashplates.shares(kind, where="here"))
    found = inverse @ ardupilot_outputs(kind, 0.3, -0.2, 0.6)
    np.testing.assert_allclose(found, [0.2, 0.9 * 0.3, 0.9 * -0.2], atol=1e-6)


def test_h3_by_angles_is_h3_120_and_the_phase_turns_it() -> None:
    plain = swashplates.shares("H3-120", where="here")
    np.testing.assert_allclose(swashplates.shares("H3", angles=(-60, 60, 180), where="here"), plain, atol=1e-12)
    turned = swashplates.shares("H3-120", phase=20.0, where="here")
    collective, roll, pitch = swashplates.unmixed(plain) @ (turned @ [0.0, 1.0, 0.0])
    np.testing.assert_allclose([collective, math.hypot(roll, pitch)], [0.0, 1.0], atol=1e-12)
    assert math.degrees(math.atan2(pitch, roll)) == pytest.approx(20.0)


def test_custom_matrix_and_one_that_cannot_be_turned_round() -> None:
    rows = [[1.0, 0.5, 0.0], [1.0, -0.5, 0.0], [1.0, 0.0, 0.7], [1.0, 0.0, -0.7]]
    made = swashplates.shares("custom", matrix=rows, where="here")
    np.testing.assert_allclose(swashplates.unmixed(made) @ made, np.eye(3), atol=1e-12)
    with pytest.raises(LinkError, match="apart"):
        swashplates.shares("custom", matrix=[[1.0, 0.0, 0.0]] * 3, where="here")
    with pytest.raises(LinkError, match="expected one of H1"):
        swashplates.shares("H5", where="here")


def test_a_servo_has_ends_a_centre_and_a_direction() -> None:
    servo = Servo(1, low=1100.0, centre=1450.0, high=1900.0)
    assert [servo.travel(p) for p in (1100, 1450, 1900)] == [-1.0, 0.0, 1.0]
    assert [servo.share(p) for p in (900, 1100, 1500, 1900, 2100)] == [0.0, 0.0, 0.5, 1.0, 1.0]
    turned = Servo(1, low=1100.0, centre=1450.0, high=1900.0, reversed=True)
    assert turned.travel(1900) == -1.0
    assert turned.share(1100) == 1.0
    assert (servo.travel(0), servo.share(0), turned.share(0)) == (0.0, 0.0, 0.0)


def test_swashplate_servos_are_thrown_as_ardupilot_throws_them(tmp_path: Path) -> None:
    """Trim and 500 us either way, whatever the ends are: they only cut. A reversed one mirrors at its trim."""
    text = (Path(swashplates.__file__).parent / "mappings" / "raptor50.toml").read_text(encoding="utf-8")
    own = "[servos.1]\nlow = 1100\ncentre = 1520\nhigh = 1900\nreversed = true\n[servos.2]\nlow = 900\nhigh = 2100\n"
    (tmp_path / "own.toml").write_text(f"{text}\n{own}", encoding="utf-8")
    plain, other = servo_mapping("raptor50", RAPTOR), servo_mapping(tmp_path / "own.toml", RAPTOR)
    for roll, pitch, collective in ((0.0, 0.0, 0.0), (0.1, -0.2, 0.5), (-0.2, 0.1, 1.0)):
        pulses = pulses_of(roll, pitch, collective)
        moved = [1500.0 - pulses[0] + 1520.0, *pulses[1:]]  # set_output_pwm_trimmed
        assert 1100.0 <= moved[0] <= 1900.0
        np.testing.assert_allclose(other.inputs(moved, 0.01), plain.inputs(pulses, 0.01), atol=1e-12)


def pulses_of(roll: float, pitch: float, collective: float, *, tail: int = 1500, throttle: int = 1000) -> list[float]:
    share = 0.46 + 0.28 * collective
    swash = [1500.0 + 500.0 * n for n in ardupilot_outputs("H3-120", roll, pitch, share)]
    return [*swash, tail, 0, 0, 0, throttle] + [0] * 8


def test_raptor50_follows_ardupilots_helicopter() -> None:
    mapping = servo_mapping("raptor50", RAPTOR)
    theta0, B1, A1, tail, throttle = mapping.inputs(pulses_of(0.0, 0.0, 0.5), 0.01)
    np.testing.assert_allclose(np.degrees([theta0, B1, A1, tail]), [5.0, 0.0, 0.0, 10.0], atol=1e-4)
    assert throttle == 0.0
    theta0, B1, A1, *_ = mapping.inputs(pulses_of(0.2, 0.1, 0.0), 0.01)
    np.testing.assert_allclose(np.degrees([theta0, A1, B1]), [-2.0, 8.0 * 0.18, -8.0 * 0.09], atol=1e-4)
    assert mapping.inputs(pulses_of(0, 0, 0, tail=2000), 0.01)[3] == pytest.approx(math.radians(30.0))


def test_the_engine_comes_up_slowly_and_goes_off_at_once() -> None:
    mapping = servo_mapping("raptor50", RAPTOR)
    running = pulses_of(0, 0, 0, throttle=1660)
    values = [mapping.inputs(running, 0.5)[4] for _ in range(20)]
    np.testing.assert_allclose(values[:15], np.arange(1, 16) / 16.0)
    assert values[-1] == 1.0
    assert mapping.inputs(pulses_of(0, 0, 0), 0.01)[4] == 0.0
    mapping.inputs(running, 0.5)
    mapping.restart()
    assert mapping.inputs(running, 0.5)[4] == pytest.approx(1.0 / 16.0)


def test_coax_signs() -> None:
    mapping = servo_mapping("coax", COAX)
    pulses = [1750, 1750, 0, 0, 1600, 1500] + [0] * 10
    lower, upper, roll, pitch = mapping.inputs(pulses, 0.01)
    assert (lower, upper) == (0.5, 0.6)
    assert (roll, pitch) == (0.5, -0.5)  # the CoaX counts nose down as positive
    lower, upper, *_ = mapping.inputs([1500] * 4 + [1000] * 12, 0.01)
    numbers = COAX.card.values()
    assert numbers["k_drive_lower"] * lower + numbers["o_drive_lower"] == pytest.approx(0.0)


@pytest.mark.parametrize("name", packaged())
def test_every_packaged_mapping_loads(name: str) -> None:
    own = name.removesuffix("_px4")
    mapping = servo_mapping(name, OWN.get(own) or standing(vehicle(own)))
    assert np.isfinite(mapping.inputs([0.0] * 32, 0.01)).all()


@pytest.mark.parametrize("name", ["raptor50", "helion", "xcell60"])
def test_px4s_helicopter_outputs_come_back(name: str) -> None:
    """PX4's servo k gets collective + cos(angle) pitch - sin(angle) roll (ActuatorEffectivenessHelicopter, arms of 1),
    the motor stands first, the tail second; each command alone moves its own input alone, into the right direction."""
    mapping = servo_mapping(f"{name}_px4", standing(vehicle(name)))
    low, high = -0.05, 0.45  # CA_HELI_PITCH_C0 and C4

    def flown(collective: float, roll: float, pitch: float, yaw: float) -> list[float]:
        plate = [collective + math.cos(a) * pitch - math.sin(a) * roll for a in np.radians((0, 140, 220))]
        controls = [1.0, yaw, *plate]
        return mapping.inputs(pulses_of_px4(controls, mapping.shares), 100.0)

    still = flown(low, 0.0, 0.0, 0.0)
    assert still == pytest.approx([math.radians(-2.0), 0.0, 0.0, math.radians(10.0), 1.0], abs=1e-12)
    assert flown(high, 0.0, 0.0, 0.0)[0] == pytest.approx(math.radians(12.0))
    rolled, pitched = flown(0.1, 0.2, 0.0, 0.0), flown(0.1, 0.0, 0.2, 0.0)
    assert rolled[1:3] == pytest.approx([0.0, 0.2 * math.radians(8.0)], abs=1e-12)
    assert pitched[1:3] == pytest.approx([-0.2 * math.radians(8.0), 0.0], abs=1e-12)
    assert flown(low, 0.0, 0.0, 1.0)[3] == pytest.approx(math.radians(30.0))


GOOD = """kind = "servo-mapping"
schema = 1
vehicle = "coax"
title = "mine"
[motors]
upper = 5
lower = 6
[cyclic]
roll = 1
pitch = 2
[servos.1]
low = 1100
centre = 1520
high = 1900
reversed = true
"""


@pytest.mark.parametrize(
    ("old", "new", "channel"),
    [
        ("schema = 1", "schema = 2", "kind"),
        ('"coax"', '"conventional"', "vehicle"),
        ("upper = 5", "upper = 0", "motors.channel"),
        ("upper = 5", "upper = 33", "motors.channel"),
        ("upper = 5", 'upper = "five"', "motors.upper"),
        ("upper = 5", "uper = 5", "motors.upper"),
        ("low = 1100", "low = 1600", "servos.1.low"),
        ("low = 1100", "low = nan", "servos.1.low"),
        ("[servos.1]", "[servos.3]", "servos.3"),
        ("reversed = true", "revrsed = true", "servos.1.revrsed"),
        ("[motors]", "[engines]", "motors"),
    ],
)
def test_files_that_are_wrong_say_where(tmp_path: Path, old: str, new: str, channel: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(GOOD)
    assert servo_mapping(file, COAX).inputs([1900] * 16, 0.01)[2] == -1.0
    file.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(LinkError) as told:
        servo_mapping(file, COAX)
    assert told.value.channel == channel
    assert "mine.toml" in str(told.value)


def test_neither_name_nor_file() -> None:
    with pytest.raises(LinkError, match="coax, coax_px4"):
        servo_mapping("nowhere.toml", COAX)
