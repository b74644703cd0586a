"""The channels that every part of swashplate agrees on: name, unit inside, unit on screens, frame and meaning.

SI and radians inside; body axes forward-right-down (FRD), local axes north-east-down (NED), Euler angles ZYX,
quaternions scalar first, from body to local. Readers convert to this and nothing else does.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Channel:
    """One named quantity of a flight.

    Attributes:
        name: the field's standard name.
        unit: unit inside (SI, radians; "1" for a normalised command).
        description: what it is, with its sign.
        frame: "NED", "FRD", "NED->FRD" or "" where a frame makes no sense.
        screen_unit: the unit that a pilot expects on plots and in tables.
        largest: magnitude [unit] beyond which no aircraft, sensor or command of this kind goes: a number beyond it has
            another unit or is damaged. Wide on purpose; it says nothing about what is usual.
    """

    name: str
    unit: str
    description: str
    frame: str = ""
    screen_unit: str = ""
    largest: float = np.inf

    @property
    def shown_unit(self) -> str:
        return self.screen_unit or self.unit

    @property
    def shown_factor(self) -> float:
        """What an inside value is multiplied by to be shown."""
        if self.shown_unit.startswith("deg"):
            return 180.0 / np.pi
        return 1e6 if (self.unit, self.shown_unit) == ("s", "us") else 1.0


_LARGEST = {
    "place": 2.1e7,  # m: half way round the Earth
    "height": 1e5,  # m: the edge of space
    "speed": 340.0,  # m/s: sound; rotors end far below it
    "angle": 1e3,  # rad: 159 turns of a heading that is counted on
    "turning": 100.0,  # rad/s: 5,700 deg/s; the widest range of an aircraft's gyroscope is 4,000 deg/s
    "force": 1e3,  # m/s^2: 100 g; the accelerometers of autopilots end at 16 to 32 g
    "rotor": 2e4,  # rad/s: 190,000 rpm, above the fastest model motors
    "unit": 2.0,  # of a part of a quaternion, whose norm is 1
    "command": 10.0,  # ten times full deflection
    "voltage": 1e3,  # V
    "current": 1e4,  # A
    "pulse": 0.05,  # s: servos are sent 20 ms at most
    "frequency": 1e3,  # Hz
}
"""Magnitudes that nothing of a kind exceeds, in units inside."""
_KINDS = (
    ("x y z", "place"), ("vx vy vz u v w airspeed wind_north wind_east wind_down", "speed"),
    ("phi theta psi alpha_lower beta_lower eta_bar zeta_bar", "angle"), ("qw qx qy qz", "unit"), ("p q r", "turning"),
    ("ax ay az", "force"), ("omega_lower omega_upper omega_rotor", "rotor"), ("voltage", "voltage"),
    ("current", "current"),
    ("motor_lower motor_upper servo_roll servo_pitch mixer_roll mixer_pitch mixer_yaw mixer_collective", "command"),
)  # fmt: skip
_LIMITS = {name: _LARGEST[kind] for names, kind in _KINDS for name in names.split()}

_CHANNELS = (
    Channel("x", "m", "position north", "NED"),
    Channel("y", "m", "position east", "NED"),
    Channel("z", "m", "position down (negative above the origin)", "NED"),
    Channel("vx", "m/s", "velocity north", "NED"),
    Channel("vy", "m/s", "velocity east", "NED"),
    Channel("vz", "m/s", "velocity down", "NED"),
    Channel("u", "m/s", "body velocity forward", "FRD"),
    Channel("v", "m/s", "body velocity right", "FRD"),
    Channel("w", "m/s", "body velocity down", "FRD"),
    Channel("phi", "rad", "roll angle, right side down positive", "NED->FRD", "deg"),
    Channel("theta", "rad", "pitch angle, nose up positive", "NED->FRD", "deg"),
    Channel("psi", "rad", "yaw angle, nose right positive", "NED->FRD", "deg"),
    Channel("qw", "1", "attitude quaternion, scalar part", "NED->FRD"),
    Channel("qx", "1", "attitude quaternion, x", "NED->FRD"),
    Channel("qy", "1", "attitude quaternion, y", "NED->FRD"),
    Channel("qz", "1", "attitude quaternion, z", "NED->FRD"),
    Channel("p", "rad/s", "roll rate", "FRD", "deg/s"),
    Channel("q", "rad/s", "pitch rate", "FRD", "deg/s"),
    Channel("r", "rad/s", "yaw rate", "FRD", "deg/s"),
    Channel("ax", "m/s^2", "specific force forward", "FRD"),
    Channel("ay", "m/s^2", "specific force right", "FRD"),
    Channel("az", "m/s^2", "specific force down (-9.81 at rest)", "FRD"),
    Channel("alpha_lower", "rad", "lower tip-path plane tilt about body x", "FRD", "deg"),
    Channel("beta_lower", "rad", "lower tip-path plane tilt about body y", "FRD", "deg"),
    Channel("eta_bar", "rad", "stabilizer bar roll angle against the local level", "NED->FRD", "deg"),
    Channel("zeta_bar", "rad", "stabilizer bar pitch angle against the local level", "NED->FRD", "deg"),
    Channel("omega_lower", "rad/s", "lower rotor speed (clockwise from above)", ""),
    Channel("omega_upper", "rad/s", "upper rotor speed (counter-clockwise from above)", ""),
    Channel("motor_lower", "1", "lower motor command, 0 to 1"),
    Channel("motor_upper", "1", "upper motor command, 0 to 1"),
    Channel("servo_roll", "1", "roll servo command, -1 to 1, positive rolls right"),
    Channel("servo_pitch", "1", "pitch servo command, -1 to 1, positive pitches nose down"),
    Channel("mixer_roll", "1", "roll command into the mixer, -1 to 1, positive rolls right"),
    Channel("mixer_pitch", "1", "pitch command into the mixer, -1 to 1, positive pitches nose up"),
    Channel("mixer_yaw", "1", "yaw command into the mixer, -1 to 1, positive turns the nose right"),
    Channel(
        "mixer_collective",
        "1",
        "collective (or thrust) command, 0 to 1 (Rotorflight -1 to 1), positive climbs",
    ),
    Channel("omega_rotor", "rad/s", "main rotor speed"),
    Channel("airspeed", "m/s", "true airspeed"),
    Channel("voltage", "V", "battery voltage"),
    Channel("current", "A", "battery current"),
    Channel("wind_north", "m/s", "wind towards north", "NED"),
    Channel("wind_east", "m/s", "wind towards east", "NED"),
    Channel("wind_down", "m/s", "wind downwards", "NED"),
)

CHANNELS: dict[str, Channel] = {c.name: replace(c, largest=_LIMITS[c.name]) for c in _CHANNELS}
POSITION = ("x", "y", "z")
ATTITUDE = ("phi", "theta", "psi")
VELOCITY = ("u", "v", "w")
RATES = ("p", "q", "r")
LOGGED_UNIT = "logged_unit"
"""Attribute of a channel: the unit that its file was read with, where a reader keeps it."""
QUATERNION = ("qw", "qx", "qy", "qz")


# Second opinions on a channel, as an autopilot logs them: the same quantity in the same unit.
VARIANTS = {
    "demand": "as demanded by the autopilot",
    "slow": "from the slower of two messages",
    "imu": "from the first inertial sensor",
    "imu2": "from the second inertial sensor",
    "imu3": "from the third inertial sensor",
    "sid": "from the system-identification message",
    "raw": "from the first inertial sensor, before its filters",
}
_VARIED = (*ATTITUDE, *RATES, "ax", "ay", "az", "vx", "vy", "vz")
_PULSES = {"rcin": "pulse width received from the pilot", "rcout": "pulse width sent to a servo or motor"}
_LOGGED = {
    entry.name: entry
    for entry in (
        Channel("sid_target", "", "what ArduPilot's System ID mode adds, in the unit of its axis"),
        Channel("sid_frequency", "Hz", "frequency of ArduPilot's chirp", largest=_LARGEST["frequency"]),
        Channel("altitude_baro", "m", "barometric altitude above the start, up positive", largest=_LARGEST["height"]),
        Channel("latitude", "rad", "geographic latitude, north positive", "", "deg", np.pi / 2),
        Channel("longitude", "rad", "geographic longitude, east positive", "", "deg", np.pi),
        Channel("gps_speed", "m/s", "speed over ground, of the GPS", largest=_LARGEST["speed"]),
        Channel("gps_status", "1", "kind of the GPS's fix: 3 and more in three dimensions"),
        Channel("gps_satellites", "1", "satellites that the GPS uses"),
        Channel("gps_hdop", "1", "the GPS's horizontal dilution of precision"),
        Channel("vibe_x", "m/s^2", "vibration of the accelerometer along x, as ArduPilot tells it"),
        Channel("vibe_y", "m/s^2", "vibration of the accelerometer along y, as ArduPilot tells it"),
        Channel("vibe_z", "m/s^2", "vibration of the accelerometer along z, as ArduPilot tells it"),
        Channel("clips", "1", "samples of an accelerometer at the end of its range, counted"),
        Channel("clips_2", "1", "the same of the second accelerometer"),
        Channel("clips_3", "1", "the same of the third accelerometer"),
        Channel("voltage_board", "V", "supply of the flight controller", largest=_LARGEST["voltage"]),
    )
}
_NUMBERED = re.compile(r"(rcin|rcout)_\d{1,2}")
_ROTORS = {
    "motor": Channel("motor", "1", "motor command of a multirotor, 0 to 1", largest=_LARGEST["command"]),
    "omega": Channel("omega", "rad/s", "rotor speed of a multirotor", largest=_LARGEST["rotor"]),
    "omega_motor": Channel(
        "omega_motor", "rad/s", "speed of a motor, as its speed controller (ESC) tells it", largest=_LARGEST["rotor"]
    ),
}
_ROTOR = re.compile(r"(motor|omega|omega_motor)_\d{1,2}")


def _family(name: str) -> Channel | None:
    """The entry of a name that stands for a family: `p_imu2`, `phi_demand`, `rcin_3`, `motor_4`."""
    if _NUMBERED.fullmatch(name):
        return Channel(name, "s", _PULSES[name.partition("_")[0]], "", "us", _LARGEST["pulse"])
    if _ROTOR.fullmatch(name):
        return replace(_ROTORS[name.rpartition("_")[0]], name=name)
    if name in _LOGGED:
        return _LOGGED[name]
    base, _, variant = name.partition("_")
    if base in _VARIED and variant in VARIANTS:
        entry = CHANNELS[base]
        return replace(entry, name=name, description=f"{entry.description}, {VARIANTS[variant]}")
    return None


def is_known(name: str) -> bool:
    """Whether the schema says what `name` is."""
    return name in CHANNELS or _family(name) is not None


def axis_of(name: str) -> str:
    """The axis that a command of the schema, or a stick, moves: "roll", "pitch", "yaw", "collective"; "" for others."""
    last = {"throttle": "collective"}.get(word := name.rpartition("_")[2], word)
    command = name in CHANNELS or name.startswith("stick_")
    return last if command and last in ("roll", "pitch", "yaw", "collective") else ""


def channel(name: str) -> Channel:
    """The schema's entry for `name`; an unknown name becomes a channel without a promise about its frame."""
    return CHANNELS.get(name) or _family(name) or Channel(name, "", "not in the schema")
