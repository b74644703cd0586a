"""What the fields of Rotorflight's and Betaflight's Blackbox logs are: channels, units, signs.

Both firmwares turn about forward-left-up axes: positive pitch is nose down, positive yaw is nose left, so pitch and yaw
change their sign here. Sources: Rotorflight's setpoint.c ("CW direction is positive, while gyro[YAW] is negative"),
Betaflight's SITL, which negates y and z of a forward-right-down gyro, and its pull request 15336 ("positive gyro Y =
nose down", as of its attitude, while the heading counts clockwise); accelerometers stand in the same axes and show +1 g
at rest. Units: the firmwares' blackbox.c and the presenters of their log viewers (setpoint deg/s, mixer 1/1000,
headspeed rpm, vbatLatest 0.01 V, amperageLatest 0.01 A, motor 1/1000, servo us, attitude 0.1 deg, altitude cm; gyro,
setpoint and rcCommand ten times as large with blackbox_high_resolution).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.flights.readers.blackbox_header import Header
from swashplate.flights.schema import is_known

_AXES = ("roll", "pitch", "yaw")
_SIGNS = (1.0, -1.0, -1.0)  # forward-left-up to forward-right-down
_THREE = {
    "gyroADC": ("p", "q", "r"), "gyroData": ("p", "q", "r"), "attitude": ("phi", "theta", "psi"),
    "gyroRAW": ("p_imu", "q_imu", "r_imu"), "gyroUnfilt": ("p_imu", "q_imu", "r_imu"),
    "setpoint": ("p_demand", "q_demand", "r_demand"), "accADC": ("ax", "ay", "az"), "accSmooth": ("ax", "ay", "az"),
    "mixer": ("mixer_roll", "mixer_pitch", "mixer_yaw"),
    **{f"axis{term}": tuple(f"pid_{term.lower()}_{axis}" for axis in _AXES) for term in "PIDFSBO"},
}  # fmt: skip
_SINGLE = {
    "headspeed": ("omega_rotor", "rpm", 1.0), "tailspeed": ("omega_tail", "rpm", 1.0),
    "Vbat": ("voltage", "V", 0.01), "Ibat": ("current", "A", 0.01), "amperageLatest": ("current", "A", 0.01),
    "BaroAlt": ("altitude_baro", "cm", 1.0), "baroAlt": ("altitude_baro", "cm", 1.0),
    "altitude": ("altitude_baro", "cm", 1.0),
}  # fmt: skip
_TERMS = "PIDFS"
_SKIPPED = ("loopIteration", "time")


@dataclass(frozen=True)
class _Place:
    """Where a field goes: its channel, the unit of its numbers and what they are multiplied by first."""

    channel: str
    unit: str = ""
    factor: float = 1.0
    offset: float = 0.0


class Fields:
    """How the fields of one log are read.

    Args:
        header: of the log.
        names: of its main frames' fields.
    """

    def __init__(self, header: Header, names: tuple[str, ...]) -> None:
        self.header, self.names = header, names
        values = header.values
        self.firmware = values.get("Firmware revision") or values.get("Firmware type", "")
        self.rotorflight = "rotorflight" in f"{values.get('Firmware type')} {self.firmware}".lower()
        self.fine = 0.1 if header.number("blackbox_high_resolution") > 0.0 else 1.0
        self.notes: list[str] = []

    @property
    def called(self) -> str:
        """The firmware, as the header names it."""
        known = not self.rotorflight or "rotorflight" in self.firmware.lower()
        return self.firmware if known else f"Rotorflight {self.firmware}".strip()

    def columns(self, values: Mapping[str, NDArray[Any]]) -> dict[str, tuple[Array, str]]:
        """Numbers and their unit, by channel."""
        columns: dict[str, tuple[Array, str]] = {}
        for name in self.names:
            place = self._place(name)
            if name in _SKIPPED or place.channel in columns:
                continue
            numbers = np.asarray((values[name] - place.offset) * place.factor + 0.0, dtype=np.float64)  # no -0
            columns[place.channel] = (numbers, place.unit)
        return {**columns, **self._sums(values, columns)}

    def _place(self, name: str) -> _Place:
        matched = re.fullmatch(r"(\w+)\[(\d)\]", name)
        if matched is None:
            if name == "vbatLatest":
                return self._voltage()
            return _Place(*_SINGLE[name]) if name in _SINGLE else self._as_logged(name)
        family, index = matched[1], int(matched[2])
        if index < 3 and family in _THREE:
            return self._axis(family, index)
        one, output = index + 1, self.header.values.get("motorOutput", "").split(",")
        if family == "mixer" and index == 3:
            return _Place("mixer_collective", "1", 1e-3)
        if family == "setpoint" and index == 3:
            return _Place("collective_demand" if self.rotorflight else "mixer_collective", "1", 1e-3)
        if family == "rcCommand" and index < 4:
            if index == 3 and not self.rotorflight:
                return _Place("stick_throttle", "us")
            return _Place(f"stick_{(*_AXES, 'collective')[index]}", "1", self.fine / 500.0)
        if family == "servo":
            return _Place(f"rcout_{one}", "us")
        if family == "motor":
            if self.rotorflight:
                return _Place(f"motor_{one}", "1", 1e-3)
            if len(output) == 2 and output[0].isdigit() and output[1].isdigit() and int(output[1]) > int(output[0]):
                low, high = float(output[0]), float(output[1])
                return _Place(f"motor_{one}", "1", 1.0 / (high - low), low)
        if family == "eRPM" and self.header.number("motor_poles") >= 2.0:
            return _Place(f"omega_motor_{one}", "rpm", 200.0 / self.header.number("motor_poles"))
        return self._as_logged(name)

    def _axis(self, family: str, index: int) -> _Place:
        channel, sign = _THREE[family][index], _SIGNS[index]
        if family == "attitude":
            return _Place(channel, "deg", (0.1, -0.1, 0.1)[index])  # its yaw is a heading: clockwise, 0 to 360
        if family in ("gyroADC", "gyroData", "gyroUnfilt", "gyroRAW"):
            scale = self.header.number("gyro_scale", self.header.number("gyro.scale", 1.0)) or 1.0
            # Baseflight and old Cleanflight: radians in a microsecond for each count. Later: degrees in a second.
            degrees = scale if abs(scale) > 1e-6 else math.degrees(scale) * 1e6
            return _Place(channel, "deg/s", sign * degrees * (1.0 if family == "gyroRAW" else self.fine))
        if family == "setpoint":
            return _Place(channel, "deg/s", sign * self.fine)
        if family in ("accADC", "accSmooth"):
            per_g = self.header.number("acc_1G")
            return _Place(channel, "g", sign / per_g) if per_g > 0.0 else self._as_logged(f"{family}[{index}]")
        if family == "mixer" and index == 2 and "motor[1]" in self.names:
            # "Yaw is now tail motor throttle", says Rotorflight's mixer: no sign is left
            return _Place("tail_throttle", "1", 1e-3)
        return _Place(channel, "1", sign * 1e-3)

    def _voltage(self) -> _Place:
        version = re.search(r"Betaflight (\d+)", self.firmware)
        if self.rotorflight or (version is not None and int(version[1]) >= 4):
            return _Place("voltage", "V", 0.01)
        if version is not None and int(version[1]) == 3:
            return _Place("voltage", "V", 0.1)
        return self._as_logged("vbatLatest")  # counts of a converter

    def _as_logged(self, name: str) -> _Place:
        """A field that is kept as logged, under its own name; one that the schema gives a unit to is not its own."""
        name_of_it = _own_name(name)
        return _Place(f"{name_of_it}_raw" if is_known(name_of_it) else name_of_it)

    def _sums(
        self, values: Mapping[str, NDArray[Any]], columns: Mapping[str, tuple[Array, str]]
    ) -> dict[str, tuple[Array, str]]:
        """Betaflight logs no commands to its mixer: they are the sums of the terms of its PID controller."""
        sums = {}
        for i, axis in enumerate(_AXES):
            terms = [values[f"axis{term}[{i}]"] for term in _TERMS if f"axis{term}[{i}]" in values]
            if f"mixer_{axis}" in columns or self.rotorflight or f"axisP[{i}]" not in values:
                continue
            total = np.sum(np.asarray(terms, dtype=np.float64), axis=0)
            sums[f"mixer_{axis}"] = (np.asarray(_SIGNS[i] * 1e-3 * total + 0.0), "1")
        if sums:
            self.notes.append("mixer_roll, mixer_pitch and mixer_yaw are sums of the PID terms, before their limits")
        return sums

    def remarks(self, columns: Mapping[str, tuple[Array, str]]) -> tuple[str, ...]:
        """What a user must know about the channels."""
        texts = list(self.notes)
        if not self.rotorflight and "betaflight" not in self.firmware.lower():
            whose = f"the firmware is {self.firmware[:40]!r}" if self.firmware else "the header names no firmware"
            texts.append(f"{whose}: signs and units are taken as Betaflight's")
        if "p" in columns and self.fine == 1.0:
            texts.append("gyros and set-points are whole degrees per second (noise of 0.29 deg/s from rounding alone)")
        if self.rotorflight and "mixer_collective" in columns:
            texts.append("mixer_collective is Rotorflight's, -1 to 1")
        if "tail_throttle" in columns:
            texts.append("the tail is driven by a motor: mixer[2] is its throttle (tail_throttle), not a yaw command")
        for name in ("gyro_lpf1_static_hz", "gyro_lpf2_static_hz", "gyro_lowpass_hz", "gyro_lowpass2_hz"):
            corner = self.header.number(name)
            if corner > 0.0:
                texts.append(
                    f"p q r have passed {name}, {corner:g} Hz: at least {1e3 / (2.0 * math.pi * corner):.1f} ms of any "
                    "delay found with them is the filter's"
                )
        return tuple(texts)


def gps_place(name: str) -> tuple[str, str, float]:
    """Channel, unit and factor of a field of GPS frames."""
    known = {
        "GPS_coord[0]": ("latitude", "deg", 1e-7), "GPS_coord[1]": ("longitude", "deg", 1e-7),
        "GPS_speed": ("gps_speed", "cm/s", 1.0), "GPS_ground_course": ("gps_course", "deg", 0.1),
    }  # fmt: skip
    return known.get(name, (_own_name(name), "", 1.0))


def _own_name(name: str) -> str:
    return re.sub(r"\W+", "_", name).strip("_") or "field"
