"""Servo packets and frame counts of ArduPilot's SITL link: what is believed, and what is not."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from heli_autopilot import servo_packet
from swashplate.links.ardupilot.frames import Frames, PacketAction, place
from swashplate.links.ardupilot.packets import Refusal, ServoPacket, parse

HERE, THERE = ("127.0.0.1", 5501), ("127.0.0.1", 5777)
PULSES = [1500 + k for k in range(16)]


@pytest.mark.parametrize("outputs", [16, 32])
def test_both_sizes(outputs: int) -> None:
    packet = parse(servo_packet(1200, 70_000, PULSES, outputs=outputs))
    assert packet == ServoPacket(1200, 70_000, tuple(PULSES + [0] * (outputs - 16)))


def test_the_bytes_are_those_of_the_document() -> None:
    # uint16 magic 18458, uint16 400 Hz, uint32 frame 1, 16 times 1500 us, little endian.
    written = bytes.fromhex("1a48" + "9001" + "01000000") + bytes.fromhex("dc05") * 16
    assert len(written) == 40
    assert parse(written) == ServoPacket(400, 1, (1500,) * 16)


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"", "length"),
        (b"\x1a", "length"),
        (servo_packet(400, 1, PULSES)[:-1], "length"),
        (servo_packet(400, 1, PULSES) + b"\0", "length"),
        (struct.pack("<HHI32H", 18458, 400, 1, *([1500] * 32)), "length"),
        (struct.pack("<HHI16H", 18459, 400, 1, *([1500] * 16)), "magic"),
        (struct.pack(">HHI16H", 18458, 400, 1, *([1500] * 16)), "magic"),
        (servo_packet(0, 1, PULSES), "rate"),
        (servo_packet(10, 1, PULSES), "rate"),
        (servo_packet(400, 1, [100, *PULSES[1:]]), "pulse"),
        (servo_packet(400, 1, [65535, *PULSES[1:]]), "pulse"),
    ],
)
def test_refusals_say_their_kind(data: bytes, kind: str) -> None:
    refused = parse(data, used=(1, 2))
    assert isinstance(refused, Refusal)
    assert refused.kind == kind


def test_only_outputs_in_use_are_looked_at() -> None:
    assert isinstance(parse(servo_packet(400, 1, [1500, 1500, 3]), used=(1, 2)), ServoPacket)
    refused = parse(servo_packet(400, 1, PULSES), used=(17,))
    assert isinstance(refused, Refusal)
    assert "SERVO_32_ENABLE" in refused.sentence


def steps(*packets: tuple[tuple[str, int], int, float]) -> list[str]:
    frames, done = Frames(), []
    for sender, count, now in packets:
        frames, step = place(frames, sender, count, now)
        done.append(step.value)
    return done


def test_counting() -> None:
    assert steps((HERE, 0, 0.0), (HERE, 1, 0.1), (HERE, 2, 0.2)) == ["start", "next", "next"]
    assert steps((HERE, 7, 0.0), (HERE, 7, 1.0), (HERE, 8, 1.1)) == ["start", "resend", "next"]
    assert steps((HERE, 7, 0.0), (HERE, 9, 0.1), (HERE, 10, 0.2)) == ["start", "skip", "next"]


def test_this_program_joins_an_autopilot_that_waits() -> None:
    assert steps((HERE, 123_456, 0.0), (HERE, 123_457, 0.1)) == ["start", "next"]


def test_a_count_that_fell_back_is_a_restart() -> None:
    assert steps((HERE, 5000, 0.0), (HERE, 5001, 0.1), (HERE, 0, 0.2), (HERE, 1, 0.3))[2:] == ["start", "next"]


def test_a_late_duplicate_is_no_restart() -> None:
    assert steps((HERE, 50, 0.0), (HERE, 51, 0.1), (HERE, 50, 0.1), (HERE, 52, 0.2))[2:] == ["late", "next"]
    assert steps((HERE, 7, 0.0), (HERE, 8, 0.1), (HERE, 2, 0.1), (HERE, 9, 0.2))[2:] == ["late", "next"]


def test_the_first_frame_is_a_restart_at_any_time() -> None:
    assert steps((HERE, 0, 0.0), (HERE, 1, 0.1), (HERE, 2, 0.1), (HERE, 0, 0.2), (HERE, 1, 0.3))[3:] == [
        "start",
        "next",
    ]


def test_a_restart_that_looks_late_is_believed_when_it_is_repeated() -> None:
    assert steps((HERE, 4, 0.0), (HERE, 5, 0.1), (HERE, 3, 2.0), (HERE, 3, 3.0))[2:] == ["late", "start"]


def test_odd_counts_are_believed_only_when_repeated_as_a_waiting_autopilot_does() -> None:
    odd = (HERE, 4000, 0.2)
    assert steps((HERE, 9000, 0.0), odd, (HERE, 4000, 0.3), (HERE, 9001, 0.4))[1:] == ["doubtful", "doubtful", "next"]
    assert steps((HERE, 9000, 0.0), odd, (HERE, 4000, 1.2), (HERE, 4001, 1.3))[1:] == ["doubtful", "start", "next"]
    assert steps((HERE, 9000, 0.0), (HERE, 2**31, 0.2), (HERE, 9001, 0.3))[1:] == ["doubtful", "next"]
    # Ahead is never a restart, only a hole.
    assert steps((HERE, 9000, 0.0), (HERE, 90_000, 0.2), (HERE, 90_000, 1.2))[1:] == ["doubtful", "skip"]
    # A good packet in between clears the doubt.
    assert steps((HERE, 9000, 0.0), odd, (HERE, 9001, 1.0), (HERE, 4000, 2.0))[3] == "doubtful"


def test_a_second_autopilot_waits_until_the_first_is_silent() -> None:
    assert steps((HERE, 500, 0.0), (THERE, 700, 1.0), (HERE, 501, 1.1), (THERE, 700, 2.0))[1:] == [
        "stranger",
        "next",
        "stranger",
    ]
    assert steps((HERE, 500, 0.0), (THERE, 700, 3.5), (THERE, 701, 3.6))[1:] == ["start", "next"]


@pytest.mark.parametrize("count", [0, 1, 50, 100, 501, 70_000])
def test_nobody_takes_a_link_from_an_owner_that_speaks(count: int) -> None:
    """Whatever its count: the owner flies at 50 Hz, the other one asks at 100 Hz."""
    packets = []
    for k in range(400):
        packets += [(HERE, 500 + k, 0.02 * k), (THERE, count, 0.02 * k + 0.005), (THERE, count + k, 0.02 * k + 0.015)]
    told = steps(*packets)
    assert told[0::3] == ["start", *["next"] * 399]
    assert set(told[1::3]) | set(told[2::3]) == {"stranger"}


def test_an_owner_whose_answer_was_lost_keeps_its_link() -> None:
    """It repeats itself after a second; the other one asks all the time."""
    asked = [(THERE, 0, 0.1 * k) for k in range(1, 10)]
    told = steps((HERE, 500, 0.0), *asked, (HERE, 500, 1.0), *((w, c, t + 1.0) for w, c, t in asked), (HERE, 501, 2.0))
    assert set(told) == {"start", "stranger", "resend", "next"}
    assert told.count("start") == 1


def test_even_a_doubtful_packet_shows_that_the_owner_is_there() -> None:
    assert steps((HERE, 9000, 0.0), (HERE, 4000, 2.0), (THERE, 0, 3.5))[1:] == ["doubtful", "stranger"]


def test_an_autopilot_that_was_restarted_with_another_port_gets_the_link_by_asking() -> None:
    asking = [(THERE, 0, 5.0 + 1.0 * k) for k in range(3)]  # it repeats itself every second
    assert steps((HERE, 5000, 4.9), *asking, (THERE, 1, 7.1))[1:] == ["stranger", "stranger", "start", "next"]
    quick = [(THERE, 0, 5.0 + 0.1 * k) for k in range(16)]
    assert steps((HERE, 5000, 4.9), *quick)[1:] == [*["stranger"] * 14, "start", "resend"]


def test_one_stray_packet_after_a_short_silence_takes_nothing() -> None:
    assert steps((HERE, 500, 0.0), (THERE, 0, 2.9), (HERE, 501, 3.5))[1:] == ["stranger", "next"]
    third = ("10.0.0.9", 1)
    asked = [(THERE, 0, 1.6), (third, 0, 2.2), (THERE, 0, 2.8)]  # nobody has asked three times
    assert steps((HERE, 500, 0.0), *asked)[1:] == ["stranger"] * 3


def test_random_counts_move_the_flight_by_the_next_frame_only() -> None:
    random = np.random.default_rng(1)
    frames, _ = place(Frames(), HERE, 20_000, 0.0)
    for k in range(20_000):
        count = int(random.integers(0, 2**32))
        if -9 <= count - 20_000 <= 10_000 or count <= 100:
            continue
        after, step = place(frames, HERE, count, 1e-4 * k)
        assert step is PacketAction.DOUBTFUL
        assert after[:2] == frames[:2]
        frames = after
