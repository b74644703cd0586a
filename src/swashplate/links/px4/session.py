"""One connection of PX4: sensors out, controls in, one physics step for each answer. No sockets here."""

from __future__ import annotations

import numpy as np

from swashplate.errors import LinkError
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant
from swashplate.links.px4.messages import OUTPUTS, Mavlink, pulses
from swashplate.links.sensing import Sensing

RATE = 250.0
"""Hz of HIL_SENSOR, as PX4's own simulators send it."""
_SLOW_EVERY, _GPS_EVERY, _TRUTH_EVERY = 5, 25, 5
_FIELD_NOISE, _PRESSURE_NOISE = 5e-4, 0.01
"""Gauss and hPa. PX4 takes a sensor that never changes for a broken one, so these two always shake a little."""


class Px4Session:
    """A plant under PX4.

    Args:
        plant: what flies.
        sensing: its sensors.
        notices: where to say what happens.
        seed: of the noise of magnetometer and barometer.

    Raises:
        LinkError: where pymavlink is missing, or the servo mapping uses outputs that PX4's link has not.
    """

    def __init__(self, plant: Plant, sensing: Sensing, notices: Notices, *, seed: int = 0) -> None:
        if max(plant.mapping.channels) > OUTPUTS:
            raise LinkError(f"the servo mapping uses output {max(plant.mapping.channels)}, PX4 sends {OUTPUTS}.")
        self.plant, self._sensing, self._notices, self._seed = plant, sensing, notices, seed
        self.exchanges = self.restarts = 0
        self.connected()

    def connected(self) -> bytes:
        """A new connection: the vehicle back on the ground. Returns the first sensors to send."""
        self._mavlink = Mavlink()
        self._random = np.random.default_rng(self._seed)
        self.plant.restart()
        self._sensing.restart()
        self._frame = 0
        self._said_broken = False
        self._controls = tuple(0.0 for _ in range(OUTPUTS))
        self.lockstep = False
        return self.step()

    def hear(self, data: bytes) -> bool:
        """Take bytes of the stream; whether controls were among them."""
        controls, bad = self._mavlink.read(data)
        if bad:
            self._notices.tell("bad data", "bytes that are no MAVLink message came in; they are ignored.")
        if controls:
            self._controls = controls[-1].values
            self.lockstep = self.lockstep or controls[-1].lockstep
            self.exchanges += 1
        return bool(controls)

    def step(self) -> bytes:
        """Move by one frame under the latest controls. Returns the sensors to send."""
        duration = 1.0 / RATE
        motion = self.plant.advance(pulses(self._controls, self.plant.mapping.shares), duration)
        if self.plant.broken and not self._said_broken:
            self._said_broken = True
            self._notices.always(
                f"the vehicle broke at {self.plant.time:.2f} s: {self.plant.broken}. It lies there until PX4 connects "
                "anew."
            )
        readings = self._sensing.read(motion)
        frame, self._frame = self._frame, self._frame + 1
        noise = self._random.standard_normal(4).tolist()
        sent = self._mavlink.sensor(
            readings,
            slow=frame % _SLOW_EVERY == 0,
            field_noise=[_FIELD_NOISE * n for n in noise[:3]],
            pressure_noise=_PRESSURE_NOISE * noise[3],
        )
        if frame % _GPS_EVERY == 0:
            sent += self._mavlink.position(readings)
        if frame % _TRUTH_EVERY == 0:
            sent += self._mavlink.truth(readings) + self._mavlink.rotor(readings)
        return sent
