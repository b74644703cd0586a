"""The parameters that the law reads, by the names and in the units of Copter 4.6, with ArduPilot's values.

Where 4.7 calls one otherwise the new name is taken too (`PSC_NE_`, `PSC_D_`, `ATC_ACC_`); accelerations on the throttle
changed their unit there, from thousandths per cm/s^2 to shares per m/s^2.
"""

from __future__ import annotations

from collections.abc import Mapping

from swashplate.errors import ControllerError

AXES = ("RLL", "PIT", "YAW")
RATE = ("FF", "P", "I", "D", "FLTT", "FLTE", "FLTD", "IMAX", "ILMI")


def _rates(axis: str, *values: float) -> dict[str, float]:
    return {f"ATC_RAT_{axis}_{name}": value for name, value in zip(RATE, values, strict=True)}


DEFAULTS: Mapping[str, float] = {
    **_rates("RLL", 0.0, 0.135, 0.135, 0.0036, 20.0, 0.0, 20.0, 0.5, 0.0),
    **_rates("PIT", 0.0, 0.135, 0.135, 0.0036, 20.0, 0.0, 20.0, 0.5, 0.0),
    **_rates("YAW", 0.0, 0.18, 0.018, 0.0, 20.0, 2.5, 20.0, 0.5, 0.0),
    **{f"ATC_ANG_{axis}_P": 4.5 for axis in AXES},
    "ATC_RATE_FF_ENAB": 1.0,
    "ATC_INPUT_TC": 0.15,
    "ATC_ACCEL_R_MAX": 110000.0,
    "ATC_ACCEL_P_MAX": 110000.0,
    "ATC_ACCEL_Y_MAX": 27000.0,
    "ATC_HOVR_ROL_TRM": 0.0,
    "ANGLE_MAX": 3000.0,
    "PSC_POSXY_P": 1.0,
    "PSC_VELXY_P": 2.0,
    "PSC_VELXY_I": 1.0,
    "PSC_VELXY_D": 0.5,
    "PSC_VELXY_FLTE": 5.0,
    "PSC_VELXY_FLTD": 5.0,
    "PSC_VELXY_IMAX": 1000.0,
    "PSC_POSZ_P": 1.0,
    "PSC_VELZ_P": 5.0,
    "PSC_VELZ_I": 0.0,
    "PSC_VELZ_FLTE": 5.0,
    "PSC_VELZ_IMAX": 1000.0,
    "PSC_ACCZ_P": 0.5,
    "PSC_ACCZ_I": 1.0,
    "PSC_ACCZ_FLTE": 20.0,
    "PSC_ACCZ_IMAX": 800.0,
    "POSCONTROL_THROTTLE_CUTOFF_FREQ_HZ": 2.0,
    "INS_GYRO_FILTER": 20.0,
    "INS_ACCEL_FILTER": 20.0,
    "INS_HNTCH_ENABLE": 0.0,
    "INS_HNTCH_FREQ": 80.0,
    "INS_HNTCH_BW": 40.0,
    "INS_HNTCH_ATT": 40.0,
    "H_COL_HOVER": 0.5,
    "H_CYC_MAX": 2500.0,
    "MOT_THST_HOVER": 0.35,
    "MOT_THST_EXPO": 0.65,
    "MOT_SPIN_MIN": 0.15,
    "MOT_SPIN_MAX": 0.95,
    "MOT_YAW_HEADROOM": 200.0,
}
"""Of a multicopter's firmware; the throttle's cutoff is a constant of its source."""
BASE: Mapping[str, Mapping[str, float]] = {
    "swashplate": {
        **_rates("RLL", 0.21, 0.06, 0.105, 0.0001, 20.0, 20.0, 0.0, 0.4, 0.1),
        **_rates("PIT", 0.19, 0.024, 0.095, 0.002, 20.0, 20.0, 0.0, 0.4, 0.1),
        **_rates("YAW", 0.0, 0.24685, 0.0245, 0.0039, 20.0, 0.0, 0.0, 1.0, 0.0),
        "ATC_ANG_RLL_P": 4.0,
        "ATC_ANG_PIT_P": 6.0,
        "ATC_ANG_YAW_P": 5.8,
        "ATC_INPUT_TC": 0.2,
        "ATC_ACCEL_R_MAX": 60000.0,
        "ATC_ACCEL_P_MAX": 60000.0,
        "ATC_ACCEL_Y_MAX": 60000.0,
        "ATC_HOVR_ROL_TRM": 320.0,
        "PSC_VELXY_P": 1.0,
        "PSC_VELXY_I": 0.5,
        "PSC_ACCZ_P": 0.28,
    },
    "two swashplates": {
        **_rates("RLL", 0.21, 0.06, 0.105, 0.0001, 20.0, 20.0, 0.0, 0.4, 0.1),
        **_rates("PIT", 0.44, 0.15, 0.095, 0.005, 20.0, 20.0, 0.0, 0.4, 0.1),
        **_rates("YAW", 0.0, 0.14685, 0.0245, 0.0015, 20.0, 0.0, 0.0, 1.0, 0.0),
        "ATC_ANG_RLL_P": 4.0,
        "ATC_ANG_PIT_P": 4.5,
        "ATC_ANG_YAW_P": 4.5,
        "ATC_INPUT_TC": 0.2,
        "ATC_ACCEL_R_MAX": 60000.0,
        "ATC_ACCEL_P_MAX": 60000.0,
        "ATC_ACCEL_Y_MAX": 60000.0,
        "PSC_VELXY_P": 1.0,
        "PSC_VELXY_I": 0.5,
        "PSC_ACCZ_P": 0.28,
    },
    "two motors": {
        **_rates("RLL", 0.0, 2.0, 2.0, 0.2, 20.0, 0.0, 20.0, 1.0, 0.0),
        **_rates("PIT", 0.0, 2.0, 2.0, 0.2, 20.0, 0.0, 20.0, 1.0, 0.0),
        **_rates("YAW", 0.0, 1.397085, 0.139709, 0.0, 20.0, 2.5, 20.0, 0.222, 0.0),
    },
}
"""What a frame's own file changes (copter-heli.parm with the helicopter firmware's defaults, with
copter-heli-dual.parm over it, copter-coax.parm), by
`Traits.servo_layout`."""
RENAMED: Mapping[str, tuple[str, float]] = {
    **{f"PSC_NE_POS_{n}": (f"PSC_POSXY_{n}", 1.0) for n in ("P",)},
    **{f"PSC_NE_VEL_{n}": (f"PSC_VELXY_{n}", 1.0) for n in ("P", "I", "D", "FLTE", "FLTD")},
    "PSC_NE_VEL_IMAX": ("PSC_VELXY_IMAX", 100.0),
    "PSC_D_POS_P": ("PSC_POSZ_P", 1.0),
    **{f"PSC_D_VEL_{n}": (f"PSC_VELZ_{n}", 1.0) for n in ("P", "I", "FLTE")},
    "PSC_D_VEL_IMAX": ("PSC_VELZ_IMAX", 100.0),
    "PSC_D_ACC_P": ("PSC_ACCZ_P", 10.0),
    "PSC_D_ACC_I": ("PSC_ACCZ_I", 10.0),
    "PSC_D_ACC_FLTE": ("PSC_ACCZ_FLTE", 1.0),
    "PSC_D_ACC_IMAX": ("PSC_ACCZ_IMAX", 1000.0),
    **{f"ATC_ACC_{n}_MAX": (f"ATC_ACCEL_{n}_MAX", 100.0) for n in "RPY"},
    "ATC_ANGLE_MAX": ("ANGLE_MAX", 100.0),
}
"""4.7's names, with the 4.6 name and what a value is to be multiplied by."""
_REFUSED = ("SMAX", "PDMX", "D_FF", "NTF", "NEF")
"""Ends of names of parts of the rate controller that the law has not."""


def known(given: Mapping[str, float], *, frame: str) -> dict[str, float]:
    """All parameters of the law: ArduPilot's, the frame's base file over them, and what is given over both.

    Names that the law does not read are passed over.

    Raises:
        ControllerError: for a part of the rate controller that the law has not, where it is switched on.
    """
    values = {**DEFAULTS, **BASE[frame]}
    for name, value in given.items():
        if name.startswith(("ATC_RAT_", "PSC_")) and name.endswith(_REFUSED) and value != 0.0:
            raise ControllerError(f"is {value:g}; the rebuilt law has no such part, expected 0.", channel=name)
        law_name, factor = RENAMED.get(name, (name, 1.0))
        if law_name in values:
            values[law_name] = factor * float(value)
    return values


def renamed(parameters: Mapping[str, float]) -> dict[str, float]:
    """The same parameters by 4.7's names, of those that it calls otherwise."""
    return {new: parameters[old] / factor for new, (old, factor) in RENAMED.items() if old in parameters}
