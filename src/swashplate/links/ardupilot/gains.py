"""ArduPilot's gains for a vehicle behind a servo mapping: where the search starts, and what is written of its end."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from swashplate.control.analysis.cascade import COARSE, cascade_plant
from swashplate.control.analysis.cascade_gains import largest_rate
from swashplate.control.laws.ardupilot.law import RATE_OF_LOOPS, ArduPilotLaw
from swashplate.control.laws.ardupilot.mixers import SwashplateMixer
from swashplate.control.laws.ardupilot.parameters import AXES, RATE, known, renamed
from swashplate.errors import LinkError
from swashplate.files import read_text
from swashplate.links.ardupilot.mixing import mixer_of
from swashplate.links.ardupilot.parameters import Parameters
from swashplate.links.servos import ServoMapping
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.trim import Trim

ASSUMED_DELAY = 0.005
"""s: a loop at 400 Hz and an output's frame, where neither the model nor the user says how late commands are."""
_KEPT, _MARGIN = 0.1, 1.25
_FILTERS = {"FLTT": 20.0, "FLTE": 0.0, "FLTD": 20.0}
_HELICOPTER_ERRORS = 20.0
"""Hz: FLTE of roll and pitch of a single rotor, as in copter-heli.parm."""


def ardupilot_law(
    mapping: ServoMapping,
    vehicle: Vehicle,
    hover: Trim,
    *,
    given: Parameters | None = None,
    notch: tuple[float, float] | None = None,
    rate: float = RATE_OF_LOOPS,
) -> ArduPilotLaw:
    """ArduPilot's law with its base files' gains, the hover's throttle and roll, and the filters that gains get.

    Feed-forward of a single rotor's roll and pitch is one over the largest rate per command from 1 to 10 rad/s. Near
    hover their integrals leak down to ILMI: a quarter more than what the hover's cyclic asks for, at least 0.1.

    Args:
        mapping: between outputs and the vehicle.
        vehicle, hover: in free flight, its hover.
        given: parameters that replace all others: then nothing but the hover's throttle is added.
        notch: of the gyros, frequency and width [Hz]; its double is notched too.
        rate: of the loops [Hz].
    """
    frame, mixer = vehicle.traits.servo_layout, mixer_of(mapping, vehicle, hover)
    k = known(given or {}, frame=frame)
    single = isinstance(mixer, SwashplateMixer)
    throttle = "H_COL_HOVER" if single else "MOT_THST_HOVER"
    for _ in range(3):  # a coaxial's flaps are divided by the thrust
        k[throttle] = round(float(mixer.unmixed(hover.inputs, k)[3]), 4)
    if single and "ATC_HOVR_ROL_TRM" not in (given or {}):
        k["ATC_HOVR_ROL_TRM"] = round(100.0 * math.degrees(hover.states()["phi"]))
    if notch is not None:
        k |= dict(zip(("INS_HNTCH_ENABLE", "INS_HNTCH_FREQ", "INS_HNTCH_BW"), (1.0, *notch), strict=True))
    law = ArduPilotLaw(vehicle.name, vehicle.card.title, "loiter", k, mixer, len(vehicle.input_names), rate)
    if given is not None:
        return law
    still = np.zeros(len(vehicle.input_names))
    plant = cascade_plant(vehicle, hover, mixer, k, rate=rate, delays=still, omega=COARSE)
    asked = mixer.unmixed(hover.inputs, k)
    for i, axis in enumerate(AXES):
        k |= {f"ATC_RAT_{axis}_{name}": value for name, value in _FILTERS.items()}
        if single and axis != "YAW":
            k[f"ATC_RAT_{axis}_FLTE"] = _HELICOPTER_ERRORS
            k[f"ATC_RAT_{axis}_FF"] = 1.0 / largest_rate(plant, "pqr"[i], i)
            k[f"ATC_RAT_{axis}_ILMI"] = max(_KEPT, math.ceil(_MARGIN * abs(float(asked[i])) * 100.0) / 100.0)
    return law


def written_gains(law: ArduPilotLaw) -> Parameters:
    """What of a law stands in a parameter file, 4.7's names where it has others beside those of 4.6."""
    k, single = law.parameters, isinstance(law.mixer, SwashplateMixer)
    names = [f"ATC_ANG_{axis}_P" for axis in AXES]
    names += [f"ATC_RAT_{axis}_{name}" for axis in AXES for name in RATE if single or name != "ILMI"]
    names += ["PSC_POSXY_P", "PSC_VELXY_P", "PSC_VELXY_I", "PSC_VELXY_D", "PSC_POSZ_P", "PSC_VELZ_P"]
    names += ["PSC_ACCZ_P", "PSC_ACCZ_I", "H_COL_HOVER" if single else "MOT_THST_HOVER", "INS_GYRO_FILTER"]
    if k["INS_HNTCH_ENABLE"] > 0.5:
        names += [f"INS_HNTCH_{name}" for name in ("ENABLE", "FREQ", "BW", "ATT")]
    written = {name: k[name] for name in names}
    return written | renamed(written) | ({"INS_HNTCH_MODE": 0.0} if k["INS_HNTCH_ENABLE"] > 0.5 else {})


def read_parameter_file(path: str | Path) -> Parameters:
    """The numbers of a .parm file: a name and a number in a line, a comma, tab or blanks between; # begins a remark.

    Raises:
        LinkError: naming the line that is none, or that the file cannot be read.
    """
    try:
        lines = read_text(path).splitlines()
    except (OSError, ValueError) as error:
        raise LinkError(f"cannot be read ({error}).", where=path) from None
    parameters: Parameters = {}
    for number, line in enumerate(lines, 1):
        parts = line.split("#", 1)[0].replace(",", " ").split()
        if not parts:
            continue
        try:
            name, text = parts
            value = float(text)
        except ValueError:
            raise LinkError(
                f"line {number} is {line.strip()!r:.60}, expected a name and a number.", where=path
            ) from None
        if not math.isfinite(value):
            raise LinkError(f"line {number}: {name} is no finite number.", where=path)
        parameters[name] = value
    if not parameters:
        raise LinkError("holds no parameter.", where=path)
    return parameters
