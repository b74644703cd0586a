"""What a trial under SITL needs beside the vehicle's own parameters: a radio, calibrated sensors, modes, the sweeps.

Names: ArduPilot's parameter reference of Copter 4.5. The file stands before the vehicle's, whose values count.
"""

from __future__ import annotations

from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.links.ardupilot.parameters import DUAL, SINGLE_ROTOR, Parameters

_CHANNELS = range(1, 9)
_MAGNETOMETERS = {"": (5.0, 13.0, -18.0), "2": (5.0, 13.0, -18.0), "3": (5.0, 13.0, -18.0)}
"""Offsets that SITL's magnetometers have by themselves (SIM_MAG1_OFS): other ones are no calibration."""
_FILTERS = {"RLL": (20.0, 20.0, 0.4), "PIT": (20.0, 20.0, 0.4), "YAW": (20.0, 0.0, 1.0)}
"""Hz of target and error, and the integral's most, of a helicopter's rate loops."""


def trial_parameters(vehicle: Parameters, chirp: Chirp) -> Parameters:
    """By name, what goes into the first parameter file.

    Args:
        vehicle: its own parameters, from `parameters`.
        chirp: any of the sweeps; SID_ parameters are hidden until SID_AXIS is set.
    """
    values: Parameters = {f"FLTMODE{n}": 0.0 for n in range(1, 7)}  # modes come over MAVLink, whatever channel 5 says
    for n in _CHANNELS:
        values |= {f"RC{n}_MIN": 1000.0, f"RC{n}_TRIM": 1000.0 if n == 3 else 1500.0, f"RC{n}_MAX": 2000.0}
    values |= {"RC1_DZ": 0.0, "RC2_DZ": 0.0}  # the pilot here makes small corrections
    for name, offsets in _MAGNETOMETERS.items():
        values |= {f"COMPASS_OFS{name}_{axis}": value for axis, value in zip("XYZ", offsets, strict=True)}
    for unit in ("", "2"):  # not exactly those of a sensor that was never calibrated
        for axis in "XYZ":
            values |= {f"INS_ACC{unit}OFFS_{axis}": 0.001, f"INS_ACC{unit}SCAL_{axis}": 1.001}
    values |= {"BATT_MONITOR": 4.0}
    if vehicle["FRAME_CLASS"] in (SINGLE_ROTOR, DUAL):
        for axis, (target, error, most) in _FILTERS.items():
            name = f"ATC_RAT_{axis}"
            values |= {f"{name}_FLTT": target, f"{name}_FLTE": error, f"{name}_FLTD": 0.0, f"{name}_IMAX": most}
    return values | chirp.parameters()
