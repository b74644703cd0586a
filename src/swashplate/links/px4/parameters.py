"""PX4's parameters that a servo mapping fixes: airframe, output functions, reversals, swashplate servos, collective.

Names and meanings: PX4's parameter reference (CA_, PWM_MAIN_); actuator functions 101 on are motors, 201 on servos. A
swashplate servo goes to collective + pitch cos(angle) - roll sin(angle), a coaxial's first motor is the clockwise one
(PX4's ActuatorEffectivenessHelicopter and ActuatorEffectivenessHelicopterCoaxial).
"""

from __future__ import annotations

import math

from swashplate.errors import LinkError
from swashplate.links.ardupilot.parameters import RUN_UP
from swashplate.links.servo import CENTRE, HALF
from swashplate.links.servos import CoaxialMapping, ServoMapping, TwinMapping

HELICOPTER, COAXIAL = 11, 12
"""CA_AIRFRAME: helicopter with a tail servo, coaxial helicopter."""
NO_TWIN = "PX4 has no frame with two swashplates (its page 'Helicopters': coaxial and dual rotors are not supported)."
_MOTOR, _SERVO = 101, 201
_UNHURRIED = {"COM_DISARM_PRFLT": 60.0, "MPC_MANTHR_MIN": 0.0}
"""As PX4's own helicopters (rc.heli_defaults): else it disarms 10 s after arming, while the rotor still spools up."""
_COAXIAL_ANGLES = (270.0, 0.0)
"""CA_SP0_ANGn of a servo for roll and one for pitch [deg]."""


def parameters(mapping: ServoMapping) -> dict[str, float]:
    """By name, what PX4 must have for a mapping to mean what it says.

    Angles of the swashplate's servos stand only there where the mapping has them (type "H3" without a phase).
    """
    angles: tuple[float, ...]
    if isinstance(mapping, CoaxialMapping):
        motors, servos, plate = mapping.motors, mapping.servos, len(mapping.servos)
        angles, values = _COAXIAL_ANGLES, {"CA_AIRFRAME": float(COAXIAL)}
    else:
        if isinstance(mapping, TwinMapping):
            raise LinkError(NO_TWIN, channel="--servos")
        motors, servos, plate = (mapping.throttle,), (mapping.tail, *mapping.swash), len(mapping.swash)
        low, high = ((pulse - CENTRE) / HALF for pulse in mapping.collective_pulse)
        angles = mapping.angles
        values = {"CA_AIRFRAME": float(HELICOPTER)}
        values |= {f"CA_HELI_PITCH_C{k}": low + 0.25 * k * (high - low) for k in range(5)}
        values |= {f"CA_HELI_THR_C{k}": 1.0 for k in range(5)}  # a governor holds the rotor's speed
        values |= {"COM_SPOOLUP_TIME": float(math.ceil(mapping.spool + RUN_UP)), **_UNHURRIED}
    values["CA_SP0_COUNT"] = float(plate)
    values |= {f"CA_SP0_ANG{k}": angle for k, angle in enumerate(angles)}
    for first, outputs in ((_MOTOR, motors), (_SERVO, servos)):
        values |= {f"PWM_MAIN_FUNC{s.channel}": float(first + k) for k, s in enumerate(outputs)}
    reversals = sum(1 << s.channel - 1 for s in (*motors, *servos) if s.reversed)
    return values | {"PWM_MAIN_REV": float(reversals)}
