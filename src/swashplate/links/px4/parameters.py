"""PX4's parameters that a servo mapping fixes: airframe, output functions, reversals, swashplate servos, collective.

Names and meanings: PX4's parameter reference (CA_, PWM_MAIN_); actuator functions 101 on are motors, 201 on servos.
"""

from __future__ import annotations

from swashplate.links.servo import CENTRE, HALF
from swashplate.links.servos import CoaxialMapping, ServoMapping

HELICOPTER, COAXIAL = 11, 12
"""CA_AIRFRAME: helicopter with a tail servo, coaxial helicopter."""
_MOTOR, _SERVO = 101, 201
_COAXIAL_ANGLES = (270.0, 0.0)
"""CA_SP0_ANGn of a servo for roll and one for pitch [deg]."""


def parameters(mapping: ServoMapping) -> dict[str, float]:
    """By name, what PX4 must have for a mapping to mean what it says.

    Angles of the swashplate's servos stand only there where the mapping has them (type "H3" without a phase).
    """
    angles: tuple[float, ...]
    if isinstance(mapping, CoaxialMapping):
        motors, servos, plate = mapping.motors, mapping.servos, len(mapping.servos)
        angles, found = _COAXIAL_ANGLES, {"CA_AIRFRAME": float(COAXIAL)}
    else:
        motors, servos, plate = (mapping.throttle,), (mapping.tail, *mapping.swash), len(mapping.swash)
        low, high = ((pulse - CENTRE) / HALF for pulse in mapping.collective_pulse)
        angles = mapping.angles
        found = {"CA_AIRFRAME": float(HELICOPTER), "CA_HELI_PITCH_C0": low, "CA_HELI_PITCH_C4": high}
    found["CA_SP0_COUNT"] = float(plate)
    found |= {f"CA_SP0_ANG{k}": angle for k, angle in enumerate(angles)}
    for first, outputs in ((_MOTOR, motors), (_SERVO, servos)):
        found |= {f"PWM_MAIN_FUNC{s.channel}": float(first + k) for k, s in enumerate(outputs)}
    reversals = sum(1 << s.channel - 1 for s in (*motors, *servos) if s.reversed)
    return found | {"PWM_MAIN_REV": float(reversals)}
