"""A helicopter behind Rotorflight's outputs in Betaflight's packets: one motor, three swashplate servos, a tail servo.

Rotorflight's SITL (4.6) sends no servos yet; this reads what its mixer would send with the settings that a new one has
(mixer.c, servos.c): a centre of 1500 us, 500 us of travel, and input rates of 250. A command of one is 12 degrees of
the main blades and 24 of the tail's, as in the rebuilt law.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from swashplate.control.laws.rotorflight.law import rotorflight_law
from swashplate.control.laws.rotorflight.mixers import SWASHPLATES, commands_of
from swashplate.errors import LinkError
from swashplate.links.servo import CENTRE, HALF, Servo
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

RATE = 0.25
"""Of a command, what its servos move."""
_WHOLE = tuple(name for name, rows in SWASHPLATES.items() if np.any(rows[:, 2]))
_SPOOL = 8.0
"""s that an engine takes from rest to its whole power."""


class SwashServoMapping:
    """Outputs to a helicopter's inputs. Attributes as of `HelicopterMapping`; `motors` are those of the packet.

    Args:
        vehicle, hover: in free flight, its hover.
        swash: type of the swashplate, of `SWASHPLATES` those that move the collective too.

    Raises:
        ControllerError: for a vehicle that is no helicopter with one rotor and a tail.
        LinkError: for another swashplate.
    """

    motors = 1
    engine = None

    def __init__(self, vehicle: Vehicle, hover: Trim, *, swash: str = "120") -> None:
        if swash not in _WHOLE:
            raise LinkError(f"is '{swash}', expected {', '.join(_WHOLE)}.", channel="--swash")
        self._rigging, self._swash = rotorflight_law(vehicle, hover).rigging, swash
        self._throttle = Servo(1)
        self.channels, self.shares = (1, 2, 3, 4, 5), (1,)
        self.restart()

    def restart(self) -> None:
        """Engine off."""
        self._running = 0.0

    def inputs(self, pulses: Sequence[float], duration: float) -> list[float]:
        """theta0, B1, A1, theta0T [rad] and throttle for pulses [us] by output, held for `duration` [s]."""
        travel = [(pulse - CENTRE) / HALF for pulse in pulses[1:5]]
        roll, pitch, collective = (commands_of(self._swash, np.array(travel[:3])) / RATE).tolist()
        rig, turn = self._rigging, travel[3] / RATE
        self._running = min(self._throttle.share(pulses[0]), self._running + duration / _SPOOL)
        return [
            rig.pitch * collective,
            rig.pitch * pitch,
            rig.pitch * roll,
            rig.centre + rig.tail * turn,
            self._running,
        ]
