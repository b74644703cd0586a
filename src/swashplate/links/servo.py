"""One output of an autopilot: pulses, and what they mean at a servo, a motor or a throttle."""

from __future__ import annotations

from dataclasses import dataclass

from swashplate.physics.backend import Backend, FloatBackend, Scalar

CENTRE, HALF = 1500.0, 500.0
"""us: a mapping speaks of pulses; an output of -1 to 1 is one of 1000 to 2000."""
NO_PULSE = 0
"""What an autopilot says for an output that it does not drive."""
PULSES = (500, 2500)
"""us: no servo output lies outside."""
FLOATS = FloatBackend()
CHANNELS = 32
"""Outputs at most."""


@dataclass(frozen=True)
class Servo:
    """One output: its number (from 1) and the pulses [us] at its ends and centre."""

    channel: int
    low: float = 1000.0
    centre: float = 1500.0
    high: float = 2000.0
    reversed: bool = False

    def travel(self, pulse: Scalar, xp: Backend = FLOATS) -> Scalar:
        """-1 to 1 from one end to the other, a little beyond where the pulse is; the centre without a pulse."""
        side = xp.where(pulse > self.centre, self.high - self.centre, self.centre - self.low)
        return self._way(pulse, side, xp)

    def throw(self, pulse: Scalar, xp: Backend = FLOATS) -> Scalar:
        """The way from the centre in units of `HALF`, whatever the ends are; 0 without a pulse.

        This is how ArduPilot writes swashplate servos: trim and 500 us either way, cut at the ends
        (`set_output_pwm_trimmed`), so that servos with other ends still tilt the plate alike.
        """
        return self._way(pulse, HALF, xp)

    def _way(self, pulse: Scalar, side: Scalar, xp: Backend) -> Scalar:
        at = (pulse - self.centre) / side
        return xp.where(pulse == NO_PULSE, 0.0, -at if self.reversed else at)

    def share(self, pulse: Scalar, xp: Backend = FLOATS) -> Scalar:
        """0 to 1 from the low to the high end, for motors and throttles; 0 without a pulse."""
        at = xp.minimum(1.0, xp.maximum(0.0, (pulse - self.low) / (self.high - self.low)))
        return xp.where(pulse == NO_PULSE, 0.0, 1.0 - at if self.reversed else at)
