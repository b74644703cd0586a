"""PX4's gains for a vehicle behind a servo mapping, through the law that PX4's cascade has in common with ArduPilot's.

Names and meanings: PX4's parameter reference (MC_, MPC_, IMU_). Rates: torque = P e + I int e - D d(rate)/dt + FF
demand. Angles: demand = P e. Speeds: acceleration = P e + I int e - D a, thrust = hover (1 + acceleration / g).
"""

from __future__ import annotations

import math

import numpy as np

from swashplate.control.analysis.cascade import COARSE, cascade_plant
from swashplate.control.analysis.cascade_gains import largest_rate
from swashplate.control.laws.ardupilot.law import GRAVITY, ArduPilotLaw
from swashplate.control.laws.ardupilot.mixers import CoaxialMixer, Mixer, SwashplateMixer
from swashplate.control.laws.ardupilot.parameters import AXES, known
from swashplate.errors import LinkError
from swashplate.links.ardupilot.mixing import CYCLIC, mixer_of
from swashplate.links.px4.parameters import NO_TWIN
from swashplate.links.servos import ServoMapping, TwinMapping
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

RATE = 250.0
"""Hz: the lockstep of its simulators (HIL_SENSOR); aboard its rate loop runs faster."""
_AXES = ("ROLL", "PITCH", "YAW")
_GYRO, _SLOPE, _SPEED_SLOPE = 40.0, 30.0, 5.0
"""Hz: IMU_GYRO_CUTOFF, IMU_DGYRO_CUTOFF, MPC_VELD_LP."""
_SUMS = 0.3
"""MC_RR_INT_LIM, MC_PR_INT_LIM, MC_YR_INT_LIM."""
_FULL = 4500.0 * math.sqrt(2.0)


def px4_law(mapping: ServoMapping, vehicle: Vehicle, hover: Trim, *, rate: float = RATE) -> ArduPilotLaw:
    """PX4's cascade with its filters, as numbers of the common law: no shaped demands, no leak, no throttle filter.

    Args:
        mapping: between outputs and the vehicle.
        vehicle, hover: in free flight, its hover.
        rate: of the loops [Hz].
    """
    if isinstance(mapping, TwinMapping):
        raise LinkError(NO_TWIN, channel="--servos")
    frame, mixer = vehicle.traits.servo_layout, _mixer(mapping, vehicle, hover)
    k = known({}, frame=frame)
    single = frame == "swashplate"
    for axis in AXES:
        k |= {f"ATC_RAT_{axis}_{name}": 0.0 for name in ("FF", "FLTT", "FLTE")}
        k |= {f"ATC_RAT_{axis}_FLTD": _SLOPE, f"ATC_RAT_{axis}_IMAX": _SUMS, f"ATC_RAT_{axis}_ILMI": 1.0}
    k |= {"ATC_RATE_FF_ENAB": 0.0, "INS_GYRO_FILTER": _GYRO, "INS_ACCEL_FILTER": _SPEED_SLOPE, "H_CYC_MAX": _FULL}
    k |= {"PSC_VELXY_FLTE": 0.0, "PSC_VELXY_FLTD": _SPEED_SLOPE, "PSC_VELZ_FLTE": 0.0, "PSC_ACCZ_FLTE": 0.0}
    k |= {"PSC_ACCZ_I": 0.0, "POSCONTROL_THROTTLE_CUTOFF_FREQ_HZ": 0.0, "ATC_HOVR_ROL_TRM": 0.0}
    k |= {"MOT_THST_EXPO": 0.0, "MOT_SPIN_MIN": 0.0, "MOT_SPIN_MAX": 1.0}
    k["H_COL_HOVER" if single else "MOT_THST_HOVER"] = round(float(mixer.unmixed(hover.inputs, k)[3]), 4)
    if single:
        still = np.zeros(len(vehicle.input_names))
        plant = cascade_plant(vehicle, hover, mixer, k, rate=rate, delays=still, omega=COARSE)
        k |= {f"ATC_RAT_{axis}_FF": 1.0 / largest_rate(plant, "pq"[i], i) for i, axis in enumerate(AXES[:2])}
    return ArduPilotLaw(vehicle.name, vehicle.card.title, "loiter", k, mixer, len(vehicle.input_names), rate, "px4")


def px4_gains(law: ArduPilotLaw) -> dict[str, float]:
    """A law's numbers by PX4's names."""
    k = law.parameters
    gains: dict[str, float] = {}
    for axis, name in zip(AXES, _AXES, strict=True):
        gains[f"MC_{name}_P"] = k[f"ATC_ANG_{axis}_P"]
        gains |= {f"MC_{name}RATE_{end}": k[f"ATC_RAT_{axis}_{end}"] for end in ("P", "I", "D", "FF")}
        gains[f"MC_{name[0]}R_INT_LIM"] = k[f"ATC_RAT_{axis}_IMAX"]
    gains["MPC_XY_P"] = k["PSC_POSXY_P"]
    gains |= {f"MPC_XY_VEL_{end}_ACC": k[f"PSC_VELXY_{end}"] for end in "PID"}
    lift = 0.1 * k["PSC_ACCZ_P"] * GRAVITY / law.hover
    gains |= {"MPC_Z_P": k["PSC_POSZ_P"], "MPC_Z_VEL_P_ACC": lift * k["PSC_VELZ_P"]}
    gains |= {"MPC_Z_VEL_I_ACC": lift * k["PSC_VELZ_I"], "MPC_Z_VEL_D_ACC": lift, "MPC_THR_HOVER": law.hover}
    return gains | {"IMU_GYRO_CUTOFF": k["INS_GYRO_FILTER"], "IMU_DGYRO_CUTOFF": k["ATC_RAT_RLL_FLTD"]}


def px4_file(values: dict[str, float], *, title: str) -> str:
    """The text of a .params file, as QGroundControl loads it: vehicle, component, name, value, type (9: a float)."""
    head = f"# {' '.join(title.split())}: outputs and gains, written by swash control gains\n"
    head += "# Vehicle-Id Component-Id Name Value Type\n"
    int32 = ("CA_AIRFRAME", "CA_SP0_COUNT", "PWM_MAIN_FUNC", "PWM_MAIN_REV")
    lines = (
        f"1\t1\t{name}\t{round(value)}\t6\n" if name.startswith(int32) else f"1\t1\t{name}\t{round(value, 6):.9g}\t9\n"
        for name, value in values.items()
    )
    return head + "".join(lines)


def _mixer(mapping: ServoMapping, vehicle: Vehicle, hover: Trim) -> Mixer:
    """Full commands tilt by the servos' whole travel; motors get thrust and yaw as they are, flaps are not divided."""
    mixer = mixer_of(mapping, vehicle, hover)
    if isinstance(mixer, SwashplateMixer):
        return mixer._replace(side=mixer.side / CYCLIC, ahead=mixer.ahead / CYCLIC)
    assert isinstance(mixer, CoaxialMixer)
    return mixer._replace(yaw=1.0, divided=0.0)
