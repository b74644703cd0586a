#!/usr/bin/env python3
"""A stand-in for ArduCopter's SITL binary, of a helicopter or coaxial: `sitl_standin.py --model JSON:127.0.0.1`.

From the documents of the other side: the command line and ports of SITL_cmdline.cpp, servo packets of SIM_JSON.cpp, 16
pulses of a radio on UDP 5501, MAVLink on TCP 5760 (which it waits for), ArduCopter's modes and texts, a DataFlash log
in logs/. It flies with `HeliAutopilot`'s loops, in ArduPilot's structure and with the gains of its parameter files.

SWASH_STANDIN says how it misbehaves, words separated by commas: see `Firmware.faults`.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import socket
import struct
import sys
import time
from pathlib import Path

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as common

from heli_autopilot import Gains, HeliAutopilot
from made_autopilot_logs import Row, dataflash
from swashplate.flights.maneuvers.ardupilot_chirp import START_DELAY, Chirp

COAXIAL = 9
DENSER = 1.225 / 1.2
"""Air at sea level over the CoaX's: what the firmware multiplies commands to motors by."""
SPIN_ARM, SPIN_MIN, SPIN_MAX, EXPO, HEADROOM = 0.1, 0.15, 0.95, 0.65, 0.2
"""MOT_ parameters of a multicopter, with their defaults."""
STABILIZE, ALT_HOLD, LOITER, LAND, SYSTEM_ID = 0, 2, 5, 9, 25
SLOW, FAST, CRAWL = 100, 200, 50
"""Frames per second on the ground with a rotor that turns, in the air, and before arming (real SITL: 1200)."""
HEALTHY = common.MAV_SYS_STATUS_SENSOR_3D_GYRO | common.MAV_SYS_STATUS_AHRS
PREARM = common.MAV_SYS_STATUS_PREARM_CHECK


def parameters_of(files: list[str]) -> dict[str, float]:
    """NAME,value or NAME value a line, the last file counts."""
    found = {"SCHED_LOOP_RATE": float(FAST), "ANGLE_MAX": 3000.0, "FRAME_CLASS": 6.0}
    for file in files:
        for line in Path(file).read_text(encoding="utf-8").splitlines():
            words = line.partition("#")[0].replace(",", " ").split()
            if words:
                found[words[0]] = float(words[1])
    return found


class Firmware(HeliAutopilot):
    """ArduCopter as far as a trial meets it.

    Attributes:
        faults: "never-ekf"; "nowhere" (its checks pass, the EKF has no place); "warm" (ready after 12 s);
            "reboot" (in the sweep); "crash" (a floating point exception at lift-off); "frozen" (stops sending at
            lift-off); "sweepless" (System ID is refused); "frame" (FRAME_CLASS 8 whatever the file says); "old"
            (version 4.1); "plane"; "copter" (the multicopters' build); "mute" (no MAVLink); "backwards" (yaw of a
            coaxial); "stubborn" (ignores SIGTERM).
    """

    def boot(self, parameters: dict[str, float], ports: tuple[int, int, int], faults: set[str]) -> None:
        self.parameters, self.faults = parameters, faults
        mavlink, radio, physics = ports
        if "frame" in faults:
            parameters["FRAME_CLASS"] = 8.0
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.connect(("127.0.0.1", physics))
        self.udp.settimeout(1.0)
        self.radio = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.radio.bind(("0.0.0.0", radio))
        self.radio.setblocking(False)
        door = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        door.bind(("0.0.0.0", mavlink))
        door.listen(1)
        print(f"bind port {mavlink} for SERIAL0\nWaiting for connection ....", flush=True)
        self.wire, _ = door.accept()
        print("Connection on serial port", mavlink, flush=True)
        self.wire.setblocking(False)
        self.mav = common.MAVLink(None, srcSystem=1, srcComponent=1)
        self.ears = common.MAVLink(None)
        self.ears.robust_parsing = True
        framed = {COAXIAL: common.MAV_TYPE_COAXIAL}  # a multicopter's binary calls itself by the frame that it is given
        own = common.MAV_TYPE_GENERIC if "copter" in faults else common.MAV_TYPE_HELICOPTER
        self.kind = framed.get(parameters["FRAME_CLASS"], own)
        self.mode, self.rows, self.pwm = STABILIZE, [], [1500] * 16
        self.running_since, self.interlocked, self.landed_since = math.inf, False, math.inf
        self.chirp: Chirp | None = None
        self.lift_off = False
        self.ekf.begun = -30.0 if "warm" in faults else 0.0
        Path("pid").write_text(str(os.getpid()))
        self.send, self.rate = self.over_udp, CRAWL
        g = parameters
        self.gains = Gains(
            tuple(g.get(f"ATC_ANG_{a}_P", 4.5) for a in ("RLL", "PIT", "YAW")),
            *(tuple(g.get(f"ATC_RAT_{a}_{k}", 0.0) for a in ("RLL", "PIT", "YAW")) for k in ("FF", "P", "I")),
            tuple(g.get(f"ATC_RAT_{a}_ILMI", 1.0) for a in ("RLL", "PIT")),  # 1: a multicopter's do not leak
            tuple(g.get(f"ATC_RAT_{a}_D", 0.0) for a in ("RLL", "PIT", "YAW")),
        )
        self.coaxial = g["FRAME_CLASS"] == COAXIAL
        self.scaled = (0, 1, 2, 3) if self.coaxial else (3, 7)
        self.keep = (0.04, 0.08) if not self.coaxial else (
            g["PSC_POSXY_P"] * g["PSC_VELXY_P"] / 9.81, g["PSC_VELXY_P"] / 9.81
        )  # fmt: skip
        self.lifting = (0.06, 0.08) if not self.coaxial else (0.1, 0.15)

    def over_udp(self, packet: bytes) -> bytes | None:
        if "frozen" in self.faults and self.lift_off:
            time.sleep(3600.0)
        if "mute" in self.faults:  # all that it does is keep someone waiting
            time.sleep(1.0 / CRAWL)
        self.udp.send(packet)
        try:
            return self.udp.recv(4096)
        except (TimeoutError, ConnectionError):
            print("No JSON sensor message received, resending servos", flush=True)
            if os.getppid() != PARENT:
                print("Parent process died - exiting", flush=True)
                sys.exit(1)
            return None

    # ---- MAVLink -------------------------------------------------------------------------------------------------
    def tell(self, name: str, *values: object) -> None:
        if "mute" in self.faults:
            return
        data = getattr(self.mav, f"{name}_encode")(*values).pack(self.mav)
        with contextlib.suppress(BlockingIOError, ConnectionError):
            self.wire.sendall(data)

    def text(self, words: str) -> None:
        print(words, flush=True)
        for place in range(0, len(words), 50):
            number = 1 if len(words) > 50 else 0
            self.tell("statustext", 6, words[place : place + 50].encode(), number, place // 50)

    def beat(self) -> None:
        kind = common.MAV_TYPE_FIXED_WING if "plane" in self.faults else self.kind
        self.tell("heartbeat", kind, 3, 81 | (128 if self.armed else 0), self.mode, 3)

    def refusal(self) -> str:
        return "Need Position Estimate" if "never-ekf" in self.faults else self.ekf.refusal

    def status(self) -> None:
        healthy = HEALTHY | (0 if self.refusal() else PREARM)
        self.tell("sys_status", HEALTHY | PREARM, HEALTHY | PREARM, healthy, *(0,) * 10)
        if self.now > 2.0:  # silent until the estimator has begun
            placed = 16 if not self.refusal() and "nowhere" not in self.faults else 128
            self.tell("ekf_status_report", 7 | placed, 0.1, 0.1, 0.1, 0.1, 0.1)
        self.tell("system_time", 0, round(1e3 * self.now))

    def listen(self) -> None:
        try:
            data = self.wire.recv(65_536)
        except (BlockingIOError, ConnectionError):
            return
        for message in self.ears.parse_buffer(data) or ():
            self.heed(message)

    def heed(self, message) -> None:
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            for name in self.parameters:
                self.parameter(name)
        elif kind == "PARAM_REQUEST_READ":
            names = list(self.parameters)
            name = message.param_id if message.param_index < 0 else names[message.param_index]
            if name in self.parameters:
                self.parameter(name)
        elif kind == "PARAM_SET" and message.param_id in self.parameters:
            self.parameters[message.param_id] = message.param_value
            self.parameter(message.param_id)
        elif kind == "COMMAND_LONG":
            self.command(message)

    def parameter(self, name: str) -> None:
        names = list(self.parameters)
        self.tell("param_value", name.encode(), self.parameters[name], 9, len(names), names.index(name))

    def command(self, message) -> None:
        number, result = message.command, 0
        if number == common.MAV_CMD_RUN_PREARM_CHECKS and self.refusal():
            self.text(f"PreArm: {self.refusal()}")
        elif number == common.MAV_CMD_REQUEST_MESSAGE:
            version = (4 << 24) | ((1 if "old" in self.faults else 5) << 16) | (7 << 8) | 255
            self.tell("autopilot_version", 0, version, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)
        elif number == common.MAV_CMD_DO_SET_MODE:
            result = 0 if self.enter(int(message.param2)) else 4
        elif number == common.MAV_CMD_COMPONENT_ARM_DISARM and message.param1 == 1.0:
            why = self.refusal() or ("Motor Interlock Enabled" if self.pwm[7] > 1800 else "")
            why = why or ("Throttle too high" if self.pwm[2] > 1050 else "")
            if why:
                self.text(f"Arm: {why}")
                result = 4
            elif not self.armed:
                self.armed, self.rate = True, SLOW
                self.text("Arming motors")
                self.log_row("EV", 10)
                self.log_row("MODE", self.mode, self.mode, 2)
        self.tell("command_ack", number, result)

    def enter(self, mode: int) -> bool:
        if mode == self.mode:
            return True
        if mode == SYSTEM_ID:
            if "sweepless" in self.faults or self.mode != STABILIZE:
                self.text("Mode change to SYSTEMID failed: requires manual throttle")
                return False
            p = self.parameters
            self.chirp = Chirp.planned(
                int(p["SID_AXIS"]), p["SID_MAGNITUDE"], (p["SID_F_START_HZ"], p["SID_F_STOP_HZ"]),
                record=p["SID_T_REC"], fade=p["SID_T_FADE_IN"],
            )  # fmt: skip
            self.text(f"SystemID Starting: axis={self.chirp.axis}")
            self.begin_sweep(self.chirp.axis - 10, lambda t: float(self.chirp.signal(np.array([t - START_DELAY]))[0]))
            c = self.chirp
            sids = (c.axis, c.magnitude, c.start_hz, c.stop_hz, c.fade_in, c.dwell, c.record, c.fade_out)
        else:
            self.sweep = self.chirp = None
        if mode in (ALT_HOLD, LOITER, LAND):
            self.height = max(0.05, -self.state["position"][2])
            self._lift = self.collective
            self.place = tuple(self.state["position"][:2])
        self.mode = mode
        self.log_row("MODE", mode, mode, 2)
        if mode == SYSTEM_ID:
            self.log_row("SIDS", *sids)
        return True

    # ---- flying --------------------------------------------------------------------------------------------------
    def _lean(self, state):
        if self.mode in (LOITER, LAND):
            return super()._lean(state)
        most = math.radians(self.parameters["ANGLE_MAX"] / 100.0)
        return most * (self.pwm[0] - 1500) / 500.0, most * (self.pwm[1] - 1500) / 500.0

    def _climb(self, state) -> float:
        if self.mode in (STABILIZE, SYSTEM_ID):
            return min(1.0, max(0.0, (self.pwm[2] - 1000) / 1000.0))
        return super()._climb(state)

    def _mixed(self, mixer, collective: float) -> list[int]:
        """A helicopter's, or from AP_MotorsCoax: flaps 1 to 4 over the thrust, motors 5 and 6 by thrust and yaw."""
        if not self.coaxial:
            return super()._mixed(mixer, collective)
        roll, pitch, yaw = (DENSER * float(each) for each in mixer)
        collective = DENSER * collective
        yaw = -yaw if "backwards" in self.faults else yaw
        if not self.lift_off:
            idle = SPIN_ARM if self.armed else 0.0
            flaps, motors = (roll, pitch), (idle, idle)
        else:
            hover = self.parameters.get("MOT_THST_HOVER", 0.35)
            largest = max(abs(roll), abs(pitch))
            scale = 1.0 if largest == 0.0 else min(1.0, max(0.0, (1.0 - min(abs(yaw), 0.5 * HEADROOM)) / largest))
            allowed = 2.0 * (1.0 - scale * largest)
            yaw = min(allowed, max(-allowed, yaw))
            average = max(collective, 0.5 * collective + 0.5 * hover)  # throttle and hover are mixed half and half
            thrust = max(collective, min(max(scale * largest, abs(yaw)), average))
            yaw = min(thrust, max(-thrust, yaw))
            over = min(1.0, max(0.5, 0.5 * hover, thrust))
            flaps = tuple(min(1.0, max(-1.0, each / over)) for each in (roll, pitch))
            motors = tuple(self._motor(thrust + half * yaw) for half in (0.5, -0.5))
        right, up = (500.0 * flap for flap in flaps)
        servos = [1500 + int(x) for x in (right, up, -right, -up)]  # cut off towards the trim
        return [*servos, *(round(1000.0 + 1000.0 * motor) for motor in motors), 0, 0]

    @staticmethod
    def _motor(thrust: float) -> float:
        thrust = min(1.0, max(0.0, thrust))
        curve = (EXPO - 1.0 + math.sqrt((1.0 - EXPO) ** 2 + 4.0 * EXPO * thrust)) / (2.0 * EXPO)
        return SPIN_MIN + (SPIN_MAX - SPIN_MIN) * curve

    def log_row(self, name: str, *values) -> None:
        if self.armed or name == "EV":
            self.rows.append((name, (round(1e6 * self.now), *values)))

    @property
    def now(self) -> float:
        return self.answers[-1]["timestamp"][0] if self.answers else 0.0

    def step(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                self.pwm = list(struct.unpack("<16H", self.radio.recv(32)))
        self.interlock = self.armed and (self.coaxial or self.pwm[7] > 1800)  # motors need none
        if not self.interlock:
            self.running_since = self.now
        up = self.now - self.running_since >= self.parameters.get("H_RSC_RUNUP_TIME", 0.0)
        wanted = self.mode not in (STABILIZE, SYSTEM_ID) or self.pwm[2] > 1050
        if self.armed and self.interlock and up and wanted:
            if self.mode not in (ALT_HOLD, LOITER, LAND):
                self.height = 1.0  # only says that it flies
            if not self.lift_off:
                self.lift_off, self.rate = True, FAST
                self.landed_since = math.inf
                if "crash" in self.faults:
                    print("ERROR: Floating point exception - aborting", flush=True)
                    os.kill(os.getpid(), signal.SIGFPE)
        elif not self.lift_off:
            self.height = 0.0
        if self.mode == LAND and self.armed:
            self.height = max(0.001, self.height - 0.5 / self.rate)
            if -self.state["position"][2] < 0.06 and self.height < 0.01:
                self.landed_since = min(self.landed_since, self.now)
                if self.now - self.landed_since > 1.0:
                    self.log_row("EV", 11)
                    self.armed, self.height, self.lift_off, self.rate = False, 0.0, False, SLOW
                    self.text("Disarming motors")
                    self.save()
        self.state = self.exchange()
        if "reboot" in self.faults and self.sweep is not None and self.now - self._since > 5.0:
            self.count = 0
            self.faults.discard("reboot")
        self.write()

    def write(self) -> None:
        if not self.armed or not self.log:
            return
        now, p, q, r, roll, pitch, yaw, collective, swept, *slow = self.log[-1]
        if self.sweep is None and self.count % 20:
            return
        at, (pf, qf, rf) = round(1e6 * now), np.degrees(slow)
        self.rows.append(("RATE", (at, 0.0, pf, roll, 0.0, qf, pitch, 0.0, rf, yaw, 0.0, 0.0, collective)))
        if self.chirp is not None:
            turned = np.degrees((p, q, r)).tolist()
            frequency = float(self.chirp.frequency(np.array([now - self._since - START_DELAY]))[0])
            felt = self.state["accel_body"]
            self.rows.append(("SIDD", (at, now - self._since, swept, frequency, *turned, *felt)))
            if now - self._since > START_DELAY + self.chirp.record + self.chirp.fade_in + self.chirp.fade_out:
                self.text("SystemID Finished")
        if self.count % 20 == 0:
            self.rows.append(("RPM", (at, 0, self.state["rpm_1"][0])))

    def save(self) -> None:
        Path("logs").mkdir(exist_ok=True)
        rows: list[Row] = [("MSG", (0, "ArduCopter V4.5.7 (stand-in)")), *self.rows]
        Path("logs/00000001.BIN").write_bytes(dataflash(rows))


def main() -> None:
    given = dict(zip(sys.argv[1::2], sys.argv[2::2], strict=False))
    unknown = set(given) - {"--model", "--defaults", "-I", "--home", "--speedup"}
    if unknown or given.get("--model") != "JSON:127.0.0.1":
        print("You must specify a vehicle model" if not unknown else f"unrecognized option '{unknown.pop()}'")
        sys.exit(1)
    faults = {word for word in os.environ.get("SWASH_STANDIN", "").split(",") if word}
    if "stubborn" in faults:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    shift = 10 * int(given["-I"])
    firmware = Firmware(lambda data: None)
    firmware.boot(
        parameters_of(given["--defaults"].split(",") if "--defaults" in given else []),
        (5760 + shift, 5501 + shift, 9002 + shift),
        faults,
    )
    firmware.state = firmware.exchange()
    beaten = told = -1.0
    while True:
        firmware.step()
        if firmware.count % 10 == 0:
            firmware.listen()
        if firmware.now - beaten >= 1.0 or firmware.now < beaten:
            beaten = firmware.now
            firmware.beat()
        if firmware.now - told >= 0.5 or firmware.now < told:
            told = firmware.now
            firmware.status()


PARENT = os.getppid()
if __name__ == "__main__":
    main()
