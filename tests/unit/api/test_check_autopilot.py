"""`sp.check_autopilot` against a stand-in over real sockets: faults are named, silence is an error."""

from __future__ import annotations

import socket
from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("pymavlink")
from pymavlink.dialects.v20 import common

import swashplate as sp
from mavlink_autopilot import StandIn
from swashplate.links.ardupilot.parameters import as_written, parameters
from swashplate.links.mavlink import parameter_reading
from swashplate.links.mavlink.comparison import compared
from swashplate.links.mavlink.parameter_reading import ParameterReading
from swashplate.links.px4.parameters import parameters as px4_parameters
from swashplate.links.servos import servo_mapping

COAX, RAPTOR = sp.vehicle("coax"), sp.vehicle("raptor50")
PX4 = {"autopilot": common.MAV_AUTOPILOT_PX4}


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parameter_reading, "_SILENCE", 0.1)


@pytest.fixture(scope="module")
def right() -> dict[str, float]:
    others = {f"OTHER_{k}": 0.1 * k for k in range(120)} | {"SCHED_LOOP_RATE": 400.0, "INS_GYRO_RATE": 0.0}
    return others | as_written(parameters(servo_mapping("coax", COAX), COAX, sp.trim(COAX)))


def check(stand_in: StandIn, *, listen: float = 0.3, **more: Any) -> Any:
    if stand_in.type == common.MAV_TYPE_HELICOPTER:  # nothing else was asked for: what flies a coaxial
        stand_in.type = common.MAV_TYPE_COAXIAL
    with stand_in as there:
        return sp.check_autopilot(COAX, "ardupilot", mavlink=there.address, timeout=5.0, listen=listen, **more)


def test_a_right_autopilot_passes(right: dict[str, float]) -> None:
    found = check(StandIn(right))
    assert found.passed
    assert found.real_time is None  # heard for less than a second
    assert found.problems == ()
    assert found.ready is True
    assert found.rates == {"SCHED_LOOP_RATE": 400.0, "INS_GYRO_RATE": 0.0}
    assert all(p.verdict == "right" for p in found.parameters)
    assert "pass" in repr(found)
    assert found.to_document()["passed"] is True


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("FRAME_CLASS", 8.0, "FRAME_CLASS is 8, expected 9."),
        ("SERVO5_FUNCTION", 33.0, "SERVO5_FUNCTION is 33, expected 37."),
        ("SERVO1_REVERSED", 1.0, "SERVO1_REVERSED is 1, expected 0."),
        ("SERVO2_MAX", 1900.0, "SERVO2_MAX is 1900, expected 2000."),
        ("SCHED_LOOP_RATE", 2000.0, "below the loop rate SCHED_LOOP_RATE of 2000"),
    ],
)
def test_each_fault_is_named(right: dict[str, float], name: str, value: float, words: str) -> None:
    found = check(StandIn(right | {name: value}))
    assert not found.passed
    assert len(found.problems) == 1
    assert words in found.problems[0]
    assert "FAIL" in repr(found)


def test_lost_packets_are_asked_for_again(right: dict[str, float]) -> None:
    lossy = StandIn(right, lost=3)
    found = check(lossy)
    assert found.passed
    assert lossy.asked_again >= len(right) / 3


def test_what_never_comes_is_not_taken_for_right(right: dict[str, float], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parameter_reading, "ROUNDS", 2)
    found = check(StandIn(right, never=frozenset({"FRAME_CLASS"})))
    assert found.problems[0] == "FRAME_CLASS was not read."
    assert f"1 of {len(right)} parameters never came" in found.problems[1]


def test_a_parameter_that_there_is_not(right: dict[str, float]) -> None:
    fewer = {k: v for k, v in right.items() if k != "FRAME_CLASS"}
    assert "the autopilot has no parameter FRAME_CLASS (expected 9)." in check(StandIn(fewer)).problems


def test_a_parameter_that_is_sent_by_name_only(right: dict[str, float]) -> None:
    assert check(StandIn(right, unlisted=frozenset({"FRAME_CLASS"}))).passed


def test_tuned_gains_are_told_and_are_no_fault() -> None:
    expected = {"ATC_RAT_RLL_P": 0.045, "H_SW_TYPE": 3.0}
    tuned = compared(expected, ParameterReading({"ATC_RAT_RLL_P": 0.3, "H_SW_TYPE": 3.0}, 2, {0, 1}))
    assert [(p.verdict, p.problem) for p in tuned] == [("yours", ""), ("right", "")]
    wrong = compared(expected, ParameterReading({"ATC_RAT_RLL_P": 0.045, "H_SW_TYPE": 1.0}, 2, {0, 1}))
    assert [p.problem for p in wrong] == ["", "H_SW_TYPE is 1, expected 3."]


def test_the_build_for_other_frames_is_named_by_its_type(right: dict[str, float]) -> None:
    found = check(StandIn({k: v for k, v in right.items() if k.startswith("OTHER_")}, type=2))
    assert not any("MAVLink" in text for text in found.problems)
    with StandIn({"OTHER": 1.0}, type=common.MAV_TYPE_QUADROTOR) as there:
        found = sp.check_autopilot("raptor50", "ardupilot", mavlink=there.address, listen=0.3)
    assert found.problems[0] == (
        "MAVLink's type 2: this is the build for multicopters and coaxials with two motors (arducopter), expected the "
        "one for helicopters (arducopter-heli)."
    )
    assert not any("parameter H_" in text for text in found.problems), "what follows from it is not told too"


@pytest.mark.proof
def test_a_helicopter() -> None:
    right = as_written(parameters(servo_mapping("raptor50", RAPTOR), RAPTOR, sp.trim(RAPTOR)))
    with StandIn(right | {"ATC_HOVR_ROL_TRM": 300.0}) as there:
        found = sp.check_autopilot("raptor50", "ardupilot", mavlink=there.address, listen=0.3)
    assert found.passed
    assert [p.name for p in found.parameters if p.verdict == "yours"] == ["ATC_HOVR_ROL_TRM"]


def test_why_arming_is_refused(right: dict[str, float]) -> None:
    long = "PreArm: " + "a reason that is longer than one text of fifty bytes, " * 2 + "ends"
    found = check(StandIn(right, refusals=("PreArm: GPS 1: Bad fix", long)))
    assert found.refusals == ("PreArm: GPS 1: Bad fix", long)
    assert found.ready is False
    assert "arming is refused: PreArm: GPS 1: Bad fix" in found.problems[0]
    sick = check(StandIn(right, sick=common.MAV_SYS_STATUS_AHRS))
    assert sick.problems == ("arming is refused: it calls unhealthy: attitude estimate (EKF).",)
    mute = check(StandIn(right, tells=False))
    assert "not known" in mute.problems[0]


def test_the_real_time_factor(right: dict[str, float]) -> None:
    factor, bound = check(StandIn(right, speed=3.0), listen=1.3).real_time
    assert abs(factor - 3.0) <= bound
    assert bound < 1.0
    assert "stands still" in check(StandIn(right, speed=0.0), listen=1.3).problems[0]


def test_a_restart_is_told(right: dict[str, float]) -> None:
    assert "restarted" in check(StandIn(right, boots=0.5), listen=1.0).problems[0]


def test_px4_over_udp_with_integers_in_bytes() -> None:
    right = as_written(px4_parameters(servo_mapping("coax_px4", COAX)))
    assert right["CA_AIRFRAME"] == 12.0
    whole = frozenset(name for name in right if not name.startswith("CA_SP0_ANG"))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    there = StandIn(right, integers=whole, udp=port, **PX4)
    with there:
        assert sp.check_autopilot(COAX, "px4", mavlink=there.address, listen=0.3).passed
    with replace(there, parameters=right | {"PWM_MAIN_REV": 4.0}) as there:
        found = sp.check_autopilot(COAX, "px4", mavlink=there.address, listen=0.3)
    assert found.problems == ("PWM_MAIN_REV is 4, expected 0.",)


@pytest.mark.parametrize("name", ["raptor50_px4", "helion_px4", "xcell60_px4"])
def test_px4_of_a_helicopter(name: str) -> None:
    found = px4_parameters(servo_mapping(name, RAPTOR))
    assert {k: found[k] for k in ("CA_AIRFRAME", "CA_SP0_COUNT", "CA_SP0_ANG1", "PWM_MAIN_FUNC2")} == {
        "CA_AIRFRAME": 11.0,
        "CA_SP0_COUNT": 3.0,
        "CA_SP0_ANG1": 140.0,
        "PWM_MAIN_FUNC2": 201.0,
    }
    assert [found[f"CA_HELI_PITCH_C{k}"] for k in range(5)] == pytest.approx([-0.05, 0.075, 0.2, 0.325, 0.45])
    assert [found[f"CA_HELI_THR_C{k}"] for k in range(5)] == [1.0] * 5
    # It must not disarm itself while the rotor spools up.
    assert found["COM_DISARM_PRFLT"] > found["COM_SPOOLUP_TIME"] > servo_mapping(name, RAPTOR).spool


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (PX4, "PX4 answers, expected ArduPilot"),
        ({"type": common.MAV_TYPE_FIXED_WING}, "MAVLink's type 1 answers"),
        ({"silent": True}, "no autopilot was heard within 0.4 s"),
    ],
)
def test_who_is_not_the_vehicle(right: dict[str, float], other: dict[str, Any], words: str) -> None:
    with StandIn(right, **other) as there, pytest.raises(sp.SwashError, match=words):
        sp.check_autopilot(COAX, "ardupilot", mavlink=there.address, timeout=0.4, listen=0.3)


def test_addresses() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with pytest.raises(sp.SwashError, match=f"port {port} on 127.0.0.1 is in use"):
            sp.check_autopilot(COAX, "px4", mavlink=f"udp:127.0.0.1:{port}")
    with pytest.raises(sp.SwashError, match="nobody answers"):
        sp.check_autopilot(COAX, "ardupilot", mavlink=f"tcp:127.0.0.1:{port}", timeout=0.5)
    with pytest.raises(sp.SwashError, match="is no address"):
        sp.check_autopilot(COAX, "ardupilot", mavlink="serial:/dev/ttyACM0")
