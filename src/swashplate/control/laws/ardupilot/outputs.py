"""When what a loop has computed leaves for each actuator, by firmware and frame, and how late its log says it is.

ArduPilot (sources of Copter 4.7-dev): `Copter::motors_output` first sends what stands in the channels (`calc_pwm`,
`output_ch_all`), then lets the motor class write. `rc_write` sets the pulse itself, which goes out with this loop: the
swashplates (AP_MotorsHeli_Swash) and a coaxial's motors (AP_MotorsCoax). `rc_write_angle` and the rotor speed control
set a scaled value, which becomes a pulse with the next loop's `calc_pwm`: the tail (AP_MotorsHeli_Single) and a
coaxial's flaps. Measured on its logs at 400 Hz: a tail is 2.4 ms later than its swashplate.

PX4 (MixingOutput): all outputs of a module leave together.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from swashplate.arrays import Array

LawFirmware = Literal["ardupilot", "px4"]
WIDEST = 5
"""Inputs of the frame with the most."""
_TOGETHER = (0.0,) * WIDEST
LOOPS_LATER: Mapping[LawFirmware, Mapping[str, tuple[float, ...]]] = {
    "ardupilot": {
        "swashplate": (0.0, 0.0, 0.0, 1.0, 1.0),  # collective, longitudinal and lateral cyclic; tail, engine
        "two swashplates": (0.0, 0.0, 0.0, 0.0, 1.0),  # yaw is their difference in collective; engine
        "two motors": (0.0, 0.0, 1.0, 1.0, 0.0),  # motors; flaps or cyclic servos
    },
    "px4": dict.fromkeys(("swashplate", "two swashplates", "two motors"), _TOGETHER),
}
"""Loops between the computing and the output, by the vehicle's inputs, by `Traits.servo_layout`."""
CUT_AT_TRIM: Mapping[str, tuple[str, ...]] = {"swashplate": ("yaw",), "two motors": ("roll", "pitch")}
"""Axes by frame whose pulses ArduPilot cuts off towards their trim (`SRV_Channel::pwm_from_angle`), near which they
hover: a tail, and a coaxial's flaps. Those of `rc_write` are cut off downwards, which leaves a sine as large."""
HELD = 0.5
"""Loops by which a command is late because it stands until the next one."""
LOGGED = 0.5
"""Loops by which the rates of ArduPilot's SIDD message are late: they are the mean of the last loop, the gyro's change
of angle over its time (mode_systemid.cpp)."""


def density_gain(frame: str, density: float) -> float:
    """By what ArduPilot multiplies every command to motors in air of a density [kg/m^3]: 1.225 over it
    (`Thrust_Linearization::get_compensation_gain`); a helicopter's it leaves."""
    return 1.225 / density if frame == "two motors" else 1.0


def output_delays(firmware: LawFirmware, frame: str, inputs: int, rate: float) -> Array:
    """From the end of a loop to the output [s], shape (inputs,), of loops at `rate` [Hz]."""
    return np.array(LOOPS_LATER[firmware][frame][:inputs]) / rate
