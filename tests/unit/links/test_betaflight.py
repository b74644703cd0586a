"""Betaflight's packets, its mixer's lines and gains: against what the firmware itself sent, and what it would do."""

from __future__ import annotations

import math
import os
import socket
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from link_bench import QUICK
from swashplate.api.accept_betaflight import phase_limit
from swashplate.api.truth_beside import PHASE
from swashplate.compiler import compiler
from swashplate.control.analysis.cascade import FREQUENCIES
from swashplate.control.laws.rotorflight.mixers import SWASHPLATES
from swashplate.errors import LinkError
from swashplate.links.betaflight.configuration import configuration, read_settings
from swashplate.links.betaflight.gains import AXES, axis_response, betaflight_gains
from swashplate.links.betaflight.log_clock import log_clock
from swashplate.links.betaflight.motors import MotorMapping
from swashplate.links.betaflight.packets import (
    STATE_SIZE,
    PulseRefusal,
    Pulses,
    pulses_of,
    state_packet,
    sticks_packet,
)
from swashplate.links.betaflight.servo_outputs import SwashServoMapping
from swashplate.links.betaflight.session import BetaflightSession
from swashplate.links.betaflight.stepped_clock import LOOP, stepped_clock
from swashplate.links.betaflight.trial import StickSweep
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.sensing import Readings, Sensing
from swashplate.models.surroundings import environment_of
from swashplate.physics.frames import Vector
from swashplate.simulation.linearize import LinearModel
from swashplate.simulation.standing import standing

SENT = {
    "disarmed": ("04000000" + "00007a44" * 4 + "00000000" * 12, (1000.0,) * 4),
    "armed": ("04000000" + "00e08344" * 4 + "00000000" * 12, (1055.0,) * 4),
    "flying": ("04000000" + "f0d5c244" * 4 + "00000000" * 12, (1558.6855,) * 4),
}
"""Packets of port 9001 that an unmodified SITL of 2026.12-alpha sent, in hexadecimal, and their pulses [us]."""


ANSWERED = {
    "roll": ((1.326, 27.19, -111.8), (1.931, 22.54, -117.9), (2.33, 20.12, -127.6), (3.394, 15.98, -141.2)),
    "pitch": ((0.954, 30.31, -99.1), (1.39, 26.53, -109.4), (2.024, 22.15, -121.3), (3.558, 15.22, -141.0)),
    "yaw": (
        (0.625, 10.66, -63.3),
        (1.099, 7.97, -58.4),
        (1.931, 5.66, -58.8),
        (3.394, 2.79, -66.5),
        (4.096, 1.5, -70.2),
    ),
}
"""From a Blackbox log of that firmware under `x8` (a sweep of each stick, a quarter of real time, no lockstep, a busy
machine): frequency [Hz], gain [dB] and phase [deg] from the mixer's command to the gyro, by `respond`."""
CLOSE = {"roll": (1.2, 6.0), "pitch": (1.0, 6.0), "yaw": (0.4, 2.5)}
"""dB and degrees; roll and pitch have random errors of 2 to 8 %, yaw of 0.5 %."""


def readings(attitude: tuple[float, float, float]) -> Readings:
    zero = Vector(0.0, 0.0, 0.0)
    return Readings(
        2.0, Vector(0.1, 0.2, 0.3), Vector(0.0, 0.0, -9.8), Vector(10.0, 20.0, -3.0), Vector(1.0, 2.0, -0.5),
        attitude, 3.0, 0.0, zero, (0.0, 0.0), (0.0, 0.0), None, None,
    )  # fmt: skip


@pytest.mark.parametrize("case", SENT)
def test_pulses_of_the_firmware(case: str) -> None:
    told = pulses_of(bytes.fromhex(SENT[case][0]))
    assert isinstance(told, Pulses)
    assert told.motors == 4
    assert told.values[:4] == pytest.approx(SENT[case][1])


def test_what_is_no_packet_of_its() -> None:
    right = struct.pack("<H2x16f", 4, *(1500.0,) * 16)
    assert isinstance(pulses_of(right), Pulses)
    for data, kind in (
        (right[:-4], "size"),
        (struct.pack(">H2x16f", 4, *(1500.0,) * 16), "byte order"),
        (struct.pack("<H2x16f", 4, *(math.nan,) * 16), "pulses"),
        (struct.pack("<H2x16f", 300, *(1500.0,) * 16), "pulses"),
        (b"", "size"),
    ):
        told = pulses_of(data)
        assert isinstance(told, PulseRefusal), kind
        assert told.kind == kind


def rotation(q: tuple[float, ...]) -> np.ndarray:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@pytest.mark.parametrize("attitude", [(0.0, 0.0, 0.0), (0.3, -0.2, 1.0), (-0.5, 0.4, -2.5)])
def test_the_attitude_comes_out_of_the_firmwares_own_bridge(attitude: tuple[float, float, float]) -> None:
    """sitl.c undoes the plugin: q = Rz(90 deg) Rx(180 deg) q_plugin Rx(180 deg), from forward-left-up to NWU."""
    told = struct.unpack("<18d", state_packet(0.5, readings(attitude)))
    plugin = rotation(told[7:11])
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    flip = np.diag([1.0, -1.0, -1.0])
    firmwares = turn @ flip @ plugin @ flip
    cf, sf, ct, st, cp, sp_ = (f(a) for a in attitude for f in (math.cos, math.sin))
    ours = np.array(
        [
            [ct * cp, sf * st * cp - cf * sp_, cf * st * cp + sf * sp_],
            [ct * sp_, sf * st * sp_ + cf * cp, cf * st * sp_ - sf * cp],
            [-st, sf * ct, cf * ct],
        ]
    )
    np.testing.assert_allclose(firmwares, flip @ ours @ flip, atol=1e-12)
    assert told[0] == 0.5
    assert told[1:7] == (0.1, 0.2, 0.3, 0.0, 0.0, -9.8)
    assert told[11:14] == (2.0, 1.0, 0.5), "east, north, up"
    assert told[16] == 3.0
    assert told[17] == pytest.approx(101_325.0 - 12.0 * 3.0, abs=5.0)


def test_sticks() -> None:
    time, *pulses = struct.unpack("<d16H", sticks_packet(1.5, [1500.4, 1600.0, 1000.0, 1400.0, 2000.0, 2000.0]))
    assert time == 1.5
    assert pulses[:6] == [1500, 1600, 1000, 1400, 2000, 2000]
    assert set(pulses[6:]) == {1000}


@pytest.fixture(scope="module", params=["crazyflie", "x8"])
def craft(request: pytest.FixtureRequest) -> tuple[MotorMapping, LinearModel]:
    vehicle = sp.vehicle(request.param)
    return MotorMapping(vehicle), sp.linearize(vehicle, sp.trim(vehicle))


def test_a_mixer_command_turns_its_own_axis_the_right_way(craft: tuple[MotorMapping, LinearModel]) -> None:
    mapping, model = craft
    quick = np.array([20.0])
    for axis, name in enumerate(AXES):
        assert (1j * axis_response(model, mapping, axis, quick)[0]).real > 0.0, name
    columns = np.array(mapping.mixer)
    np.testing.assert_allclose(columns.sum(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(columns.T @ columns, np.diag(np.diag(columns.T @ columns)), atol=1e-9)


def test_gains_keep_their_margins(craft: tuple[MotorMapping, LinearModel]) -> None:
    mapping, model = craft
    found = betaflight_gains(model, mapping)
    for loop in found.loops:
        assert loop.holds, loop
        assert loop.crossover < FREQUENCIES[-1], "a crossover that nobody has seen has no margin"
    assert all(value == round(value) for value in found.settings.values())
    text = configuration(mapping, found.settings)
    assert text.count("mmix ") == len(mapping.channels) + 1
    assert f"set p_roll = {found.settings['p_roll']:g}\n" in text
    assert text.endswith("save\n")


def test_motors_stand_still_at_their_low_end() -> None:
    vehicle = sp.vehicle("crazyflie")
    mapping = MotorMapping(vehicle)
    idle, whole = mapping.inputs([1000.0] * 4, 0.01), mapping.inputs([2000.0] * 4, 0.01)
    numbers = vehicle.card.values()
    assert idle[0] == pytest.approx(max(0.0, -numbers["o_drive"] / numbers["k_drive"]))
    assert whole == [1.0] * 4


def test_a_sweep_goes_from_one_end_to_the_other() -> None:
    sweep = StickSweep("roll", 0.5, 6.0, 20.0)
    time = np.arange(0.0, 20.0, 0.001)
    values = np.array([sweep(t) for t in time])
    crossings = time[:-1][np.signbit(values[:-1]) != np.signbit(values[1:])]
    assert sweep(-1.0) == sweep(21.0) == 0.0
    wide = np.array([StickSweep("roll", 0.5, 24.0, 20.0)(t) for t in time])
    assert np.abs(wide).max() == pytest.approx(np.abs(values).max(), rel=1e-3)
    assert np.abs(wide[time > 18.0]).max() < 0.4 * np.abs(values).max()  # 16 Hz and more
    assert 0.5 / np.diff(crossings)[0] == pytest.approx(0.5, rel=0.2)
    assert 0.5 / np.diff(crossings)[-2] == pytest.approx(6.0, rel=0.1)


@pytest.mark.parametrize("ratio", [0.97, 1.0, 1.03])
def test_the_clock_of_a_log_is_found_by_its_stick(ratio: float) -> None:
    sweep, random = StickSweep("roll", 0.5, 6.0, 20.0), np.random.default_rng(1)
    time = np.arange(0.0, 40.0, 0.002)  # the log's, in which the sweep began at 9 s

    def sent(t: np.ndarray) -> np.ndarray:
        return np.array([sweep(float(each)) for each in t])

    stick = -0.9 * sent((time - 9.0) * ratio) + 0.02 * random.standard_normal(time.size)
    clock = log_clock(time, stick, sent, 20.0, 9.4, channel="stick_roll")
    assert clock.ratio == pytest.approx(ratio, abs=2e-4)
    assert clock.start == pytest.approx(9.0, abs=0.01)
    with pytest.raises(sp.SwashError, match="stick_roll: is not the stick that was sent"):
        log_clock(time, random.standard_normal(time.size), sent, 20.0, 9.4, channel="stick_roll")


def test_commands_come_back_from_what_motors_got(craft: tuple[MotorMapping, LinearModel]) -> None:
    mapping, _ = craft
    asked = np.array([[0.1, -0.2, 0.05], [0.0, 0.3, 0.1], [-0.04, 0.0, 0.02]])
    motors = 0.45 + np.array(mapping.mixer) @ asked
    np.testing.assert_allclose(mapping.commands(motors), asked, atol=1e-12)


def off(model: LinearModel, mapping: MotorMapping, axis: str) -> tuple[float, float]:
    """How far a model is off what the firmware's log answered at most [dB], [deg]."""
    hertz, gain, phase = np.array(ANSWERED[axis]).T
    h = axis_response(model, mapping, AXES.index(axis), 2.0 * np.pi * hertz)
    apart = np.exp(1j * (np.angle(h) - np.radians(phase)))
    return float(np.abs(20.0 * np.log10(np.abs(h)) - gain).max()), float(np.degrees(np.abs(np.angle(apart))).max())


@pytest.mark.parametrize("axis", AXES)
def test_the_firmwares_log_answers_as_the_vehicle_does(axis: str) -> None:
    vehicle = sp.vehicle("x8")
    mapping = MotorMapping(vehicle)
    gain, phase = off(sp.linearize(vehicle, sp.trim(vehicle)), mapping, axis)
    assert gain < CLOSE[axis][0]
    assert phase < CLOSE[axis][1]
    numbers = vehicle.card.values()
    inertia = {"roll": "inertia_xx", "pitch": "inertia_yy", "yaw": "inertia_zz"}[axis]
    other = vehicle.with_values({inertia: 1.3 * numbers[inertia]})
    gain, phase = off(sp.linearize(other, sp.trim(other)), mapping, axis)
    assert gain > CLOSE[axis][0] or phase > CLOSE[axis][1], "another vehicle is seen"


@pytest.mark.parametrize("swash", ["120", "135", "140", "thru"])
def test_servos_of_rotorflights_mixer_move_the_blades(swash: str) -> None:
    vehicle = sp.vehicle("raptor50")
    mapping = SwashServoMapping(vehicle, sp.trim(vehicle), swash=swash)
    roll, pitch, collective, yaw = 0.3, -0.2, 0.45, -0.4
    servos = SWASHPLATES[swash] @ (0.25 * np.array([roll, pitch, collective]))
    pulses = [1600.0, *(1500.0 + 500.0 * servos), 1500.0 + 500.0 * 0.25 * yaw]
    theta0, b1, a1, tail, throttle = mapping.inputs(pulses, 100.0)
    np.testing.assert_allclose(np.degrees([theta0, b1, a1]), 12.0 * np.array([collective, pitch, roll]), atol=1e-5)
    assert np.degrees(tail) == pytest.approx(24.0 * 0.4), "nose right against a clockwise rotor's torque"
    assert throttle == pytest.approx(0.6)
    mapping.restart()
    assert mapping.inputs(pulses, 0.8)[4] == pytest.approx(0.1), "an engine is started slowly"
    with pytest.raises(sp.SwashError, match="expected 120, 135, 140, thru"):
        SwashServoMapping(vehicle, sp.trim(vehicle), swash="90L")


def test_a_firmware_without_servos_is_told() -> None:
    vehicle = sp.vehicle("raptor50")
    said: list[str] = []
    mapping = SwashServoMapping(vehicle, sp.trim(vehicle))
    plant = Plant(standing(vehicle), mapping, Surroundings(environment_of(vehicle, None)))
    session = BetaflightSession(plant, mapping, Sensing(plant), Notices(said.append), doubles=17)
    session.take(struct.pack("<H2x16f", 1, 1000.0, *(0.0,) * 15))
    session.take(struct.pack("<H2x16f", 4, *(1000.0,) * 16))
    assert len(said) == 2
    assert "sends no servos" in said[0]
    assert "drives 4 motors, the vehicle has 1" in said[1]
    assert session.exchanged.motors == 0
    assert len(session.begun(0.0)) == 17 * 8


WAITS = """
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <pthread.h>
#include <stdio.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>
static int bound;
static volatile int taken;
static void *take(void *none) {
  char data[256];
  fd_set in;
  for (;; ++taken) {
    FD_ZERO(&in);
    FD_SET(bound, &in);
    select(bound + 1, &in, 0, 0, 0);
    recvfrom(bound, data, sizeof data, 0, 0, 0);
  }
  return none;
}
static double now(void) {
  struct timespec at;
  clock_gettime(CLOCK_MONOTONIC, &at);
  return at.tv_sec + 1e-9 * at.tv_nsec;
}
int main(void) {
  struct sockaddr_in at = {.sin_family = AF_INET};
  socklen_t room = sizeof at;
  struct timespec nap = {0, 50000}, busy = {0, 50000000};
  pthread_t other;
  double began;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  bound = socket(AF_INET, SOCK_DGRAM, 0);
  bind(bound, (struct sockaddr *)&at, sizeof at);
  getsockname(bound, (struct sockaddr *)&at, &room);
  pthread_create(&other, 0, take, 0);
  began = now();
  syscall(SYS_nanosleep, &busy, 0);
  puts(now() < began + 0.001 ? "no time passed" : "late");
  printf("%d\\n", ntohs(at.sin_port));
  fflush(stdout);
  while (!taken) nanosleep(&nap, 0);
  for (began = now(); now() < began + 0.020;) nanosleep(&nap, 0);
  puts("over");
  return 0;
}
"""
"""Two threads, as the firmware has: one takes states, the other finds the machine busy, then waits for 20 loops."""


@pytest.mark.skipif(sys.platform != "linux" or QUICK is None, reason="the clock is put before a system's own")
def test_the_clock_of_a_program_waits_for_states(tmp_path: Path) -> None:
    library, source, waiting = stepped_clock(STATE_SIZE, tmp_path), tmp_path / "waits.c", tmp_path / "waits"
    source.write_text(WAITS)
    subprocess.run([*(compiler() or ()), str(source), "-o", str(waiting), "-pthread"], check=True)
    loading = {**os.environ, "LD_PRELOAD": str(library)}
    with subprocess.Popen([str(waiting)], stdout=subprocess.PIPE, text=True, env=loading) as program:
        try:
            assert program.stdout is not None
            assert program.stdout.readline() == "no time passed\n"
            port = int(program.stdout.readline())
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
                for _ in range(15):
                    out.sendto(bytes(STATE_SIZE), ("127.0.0.1", port))
                    out.sendto(bytes(40), ("127.0.0.1", port))  # what is no state gives no time
                with pytest.raises(subprocess.TimeoutExpired):
                    program.wait(1.0)
                for _ in range(10):
                    out.sendto(bytes(STATE_SIZE), ("127.0.0.1", port))
                assert program.stdout.readline() == "over\n"
        finally:
            program.kill()


def test_settings_are_read_from_lines_of_the_command_line(tmp_path: Path) -> None:
    dump = tmp_path / "gains.txt"
    dump.write_text("# of x8\nset p_roll = 199\nset  d_roll=241 # and d_max\n\nsave\n", encoding="utf-8")
    assert read_settings(dump) == {"p_roll": 199.0, "d_roll": 241.0}
    dump.write_text("set mixer = CUSTOM\n", encoding="utf-8")
    with pytest.raises(LinkError, match="the line 'set mixer = CUSTOM', expected 'set NAME = NUMBER'"):
        read_settings(dump)


def test_a_response_a_loop_late_is_right_and_one_a_record_late_is_not() -> None:
    """Beside records of 200 Hz 5 ms passed for nothing: frames hold command and rate of one time."""
    omega = 2.0 * np.pi * np.geomspace(0.6, 4.5, 20)
    limit = phase_limit(omega, LOOP)
    assert np.all(np.degrees(omega * LOOP) <= limit + 1e-12)
    assert np.all(np.degrees(omega * 0.005) > limit)
    assert phase_limit(omega, 1.0).max() == PHASE
