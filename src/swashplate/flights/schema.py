"""The channels that every part of swashplate agrees on: name, unit inside, unit on screens, frame and meaning.

SI and radians inside; body axes forward-right-down (FRD), local axes north-east-down (NED), Euler angles ZYX,
quaternions scalar first, from body to local. Readers convert to this and nothing else does.
"""

from __future__ import annotations

from dataclasses import dataclass

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
    """

    name: str
    unit: str
    description: str
    frame: str = ""
    screen_unit: str = ""

    @property
    def shown_unit(self) -> str:
        return self.screen_unit or self.unit

    @property
    def shown_factor(self) -> float:
        """What an inside value is multiplied by to be shown."""
        return 180.0 / np.pi if self.shown_unit.startswith("deg") else 1.0


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
    Channel("voltage", "V", "battery voltage"),
    Channel("wind_north", "m/s", "wind towards north", "NED"),
    Channel("wind_east", "m/s", "wind towards east", "NED"),
    Channel("wind_down", "m/s", "wind downwards", "NED"),
)

CHANNELS: dict[str, Channel] = {channel.name: channel for channel in _CHANNELS}
POSITION = ("x", "y", "z")
ATTITUDE = ("phi", "theta", "psi")
VELOCITY = ("u", "v", "w")
RATES = ("p", "q", "r")
QUATERNION = ("qw", "qx", "qy", "qz")


def channel(name: str) -> Channel:
    """The schema's entry for `name`; an unknown name becomes a channel without a promise about its frame."""
    return CHANNELS.get(name, Channel(name, "", "not in the schema"))
