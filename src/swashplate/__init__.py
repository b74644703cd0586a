"""From a small helicopter's flight log to a validated model, in the words of the command line.

    import swashplate as sp
    flight = sp.read("a.mat").condition(rate=100, cutoff=0)
    fit = sp.identify(sp.vehicle("coax"), flight)
    validation = sp.validate(fit, sp.read("b.mat").condition(rate=100, cutoff=0))
    sp.report(fit, validation, path="report.html")

Importing this package loads nothing heavy and changes no setting of any library. The first use of a verb that computes
(`identify`, `validate`, `simulate`, `trim`, `linearize`, ...) sets JAX to float64 and turns its persistent compilation
cache on (in the user's cache folder), for the whole process: models and fits are float64.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from swashplate.control.autopilot import autopilot
    from swashplate.control.hold import hover_hold
    from swashplate.control.state_hold import state_hold
    from swashplate.errors import SwashError
    from swashplate.flights.flight import Flight
    from swashplate.flights.inspect import inspect
    from swashplate.flights.maneuvers import parse as maneuver
    from swashplate.identification.fit import Fit
    from swashplate.identification.frequency_response import FrequencyResponse
    from swashplate.identification.identify import identify
    from swashplate.identification.parameters import CHOICES
    from swashplate.identification.respond import respond
    from swashplate.identification.state_space_file import structure
    from swashplate.identification.state_space_fit import fit_state_space
    from swashplate.identification.transfer_function_fit import fit_transfer_function
    from swashplate.identification.vehicle_time_fit import fit_vehicle
    from swashplate.identification.verification import verify
    from swashplate.reporting.report import report
    from swashplate.simulation.closed_loop import simulate_closed_loop, simulate_maneuver
    from swashplate.simulation.integrate import simulate
    from swashplate.simulation.linearize import linearize
    from swashplate.simulation.sensors import Sensors, observe
    from swashplate.simulation.trim import trim
    from swashplate.validation.validate import validate
    from swashplate.validation.validation import Validation
    from swashplate.vehicles.catalogue import vehicle
    from swashplate.vehicles.vehicle import Vehicle

    __version__: str

__all__ = [
    "CHOICES",
    "Fit",
    "Flight",
    "FrequencyResponse",
    "Sensors",
    "SwashError",
    "Validation",
    "Vehicle",
    "__version__",
    "autopilot",
    "fit_state_space",
    "fit_transfer_function",
    "fit_vehicle",
    "hover_hold",
    "identify",
    "inspect",
    "linearize",
    "maneuver",
    "observe",
    "read",
    "report",
    "respond",
    "simulate",
    "simulate_closed_loop",
    "simulate_maneuver",
    "state_hold",
    "structure",
    "trim",
    "validate",
    "vehicle",
    "verify",
]

_LIGHT: Mapping[str, tuple[str, str]] = {
    "Fit": ("swashplate.identification.fit", "Fit"),
    "FrequencyResponse": ("swashplate.identification.frequency_response", "FrequencyResponse"),
    "fit_state_space": ("swashplate.identification.state_space_fit", "fit_state_space"),
    "fit_transfer_function": ("swashplate.identification.transfer_function_fit", "fit_transfer_function"),
    "respond": ("swashplate.identification.respond", "respond"),
    "structure": ("swashplate.identification.state_space_file", "structure"),
    "verify": ("swashplate.identification.verification", "verify"),
    "Flight": ("swashplate.flights.flight", "Flight"),
    "SwashError": ("swashplate.errors", "SwashError"),
    "Validation": ("swashplate.validation.validation", "Validation"),
    "Vehicle": ("swashplate.vehicles.vehicle", "Vehicle"),
    "inspect": ("swashplate.flights.inspect", "inspect"),
    "maneuver": ("swashplate.flights.maneuvers", "parse"),
    "report": ("swashplate.reporting.report", "report"),
    "vehicle": ("swashplate.vehicles.catalogue", "vehicle"),
    "CHOICES": ("swashplate.identification.parameters", "CHOICES"),
}
_COMPUTING: Mapping[str, tuple[str, str]] = {
    "Sensors": ("swashplate.simulation.sensors", "Sensors"),
    "autopilot": ("swashplate.control.autopilot", "autopilot"),
    "fit_vehicle": ("swashplate.identification.vehicle_time_fit", "fit_vehicle"),
    "hover_hold": ("swashplate.control.hold", "hover_hold"),
    "identify": ("swashplate.identification.identify", "identify"),
    "linearize": ("swashplate.simulation.linearize", "linearize"),
    "observe": ("swashplate.simulation.sensors", "observe"),
    "simulate": ("swashplate.simulation.integrate", "simulate"),
    "simulate_closed_loop": ("swashplate.simulation.closed_loop", "simulate_closed_loop"),
    "simulate_maneuver": ("swashplate.simulation.closed_loop", "simulate_maneuver"),
    "state_hold": ("swashplate.control.state_hold", "state_hold"),
    "trim": ("swashplate.simulation.trim", "trim"),
    "validate": ("swashplate.validation.validate", "validate"),
}
"""Names that set JAX up when they are first used; the others leave it alone."""


def read(path_or_name: str | os.PathLike[str], **options: Any) -> Flight:
    """Read a flight log as a `Flight` in SI units, radians, NED and FRD, at its native rates.

    Args:
        path_or_name: a file, or a file of a public data set as "coax56/flight_2011-08-01_vertical".
        options: what the file does not say itself: see `swashplate.flights.readers.read`.

    Raises:
        FlightError, UnitError: naming the file, the channel, what was found, what was expected and what to do.
        DatasetError: where a data set's file is named that is not on this machine.
    """
    from swashplate.flights import datasets, readers  # array libraries take time to load

    return readers.read(datasets.locate(os.fspath(path_or_name)), **options)


def _set_up_jax() -> None:
    from swashplate.simulation.compilation import enable_compilation_cache
    from swashplate.simulation.dynamics import enable_double_precision

    enable_double_precision()
    enable_compilation_cache()


def __getattr__(name: str) -> Any:
    """Names of `__all__` are loaded when first used (PEP 562)."""
    if name == "__version__":
        from importlib import metadata

        value: Any = metadata.version("swashplate")
    elif name in _LIGHT or name in _COMPUTING:
        if name in _COMPUTING:
            _set_up_jax()
        module, attribute = {**_LIGHT, **_COMPUTING}[name]
        value = getattr(import_module(module), attribute)
    else:
        raise AttributeError(f"module 'swashplate' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
