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
from typing import TYPE_CHECKING, Any

from swashplate import public

if TYPE_CHECKING:
    from swashplate.api.bench import evaluate_bench, simulate_bench
    from swashplate.api.check_controller import check_controller
    from swashplate.api.controllers import load_controller
    from swashplate.api.decouple import decouple
    from swashplate.api.decouple_axes import decouple_axes
    from swashplate.api.design_controller import design_controller
    from swashplate.api.excitation import excitation
    from swashplate.api.export import export_controller, export_model
    from swashplate.api.fly_maneuver import fly_maneuver
    from swashplate.api.gains import suggest_gains
    from swashplate.api.link import link_ardupilot, link_px4
    from swashplate.api.live import live, show_replay
    from swashplate.api.monte_carlo import monte_carlo
    from swashplate.api.observability import observability
    from swashplate.bench.plan import plan as plan_bench
    from swashplate.control.laws.autopilot import autopilot
    from swashplate.control.laws.hold import hover_hold
    from swashplate.control.laws.state_hold import state_hold
    from swashplate.control.lqg.observer_trial import trial as observer_trial
    from swashplate.errors import SwashError
    from swashplate.export.control_json import read_control
    from swashplate.flights.conditioning.reconstruction import reconstruct
    from swashplate.flights.conditioning.synchronise import merge, synchronise
    from swashplate.flights.datasets import listing as datasets
    from swashplate.flights.flight import Flight
    from swashplate.flights.inspect import inspect
    from swashplate.flights.maneuvers.series import parse as maneuver
    from swashplate.identification.core.result import Result
    from swashplate.identification.core.result_file import load
    from swashplate.identification.frequency.state_space_fit import fit_state_space
    from swashplate.identification.frequency.transfer_function_fit import fit_transfer_function
    from swashplate.identification.identify import identify
    from swashplate.identification.responses.frequency_response import FrequencyResponse
    from swashplate.identification.responses.respond import respond
    from swashplate.identification.time.equation_error import equation_error, stepwise
    from swashplate.identification.time.linear_frequency_fit import fit_in_frequency
    from swashplate.identification.time.linear_time_fit import fit_in_time
    from swashplate.identification.time.vehicle_time_fit import fit_vehicle
    from swashplate.links.live.replay import replay
    from swashplate.models.card import Card, Parameter
    from swashplate.models.catalogue import structure, vehicle
    from swashplate.models.coax_choices import CHOICES
    from swashplate.models.vehicle import Vehicle
    from swashplate.physics.frames import Vector
    from swashplate.reporting.report import report
    from swashplate.simulation.adaptive import simulate_adaptive
    from swashplate.simulation.closed_loop import simulate_closed_loop, simulate_maneuver
    from swashplate.simulation.derivatives_over_speed import derivatives
    from swashplate.simulation.integrate import simulate
    from swashplate.simulation.linearize import linearize
    from swashplate.simulation.lpv import schedule as speed_schedule
    from swashplate.simulation.lpv import simulate_lpv
    from swashplate.simulation.sensors import QUIET, Sensors, observe
    from swashplate.simulation.trim import trim
    from swashplate.simulation.trim_curve import trim_curve
    from swashplate.validation.validation import Validation
    from swashplate.validation.verb import validate
    from swashplate.validation.verification import verify

    __version__: str

__all__ = [
    "CHOICES",
    "QUIET",
    "Card",
    "Flight",
    "FrequencyResponse",
    "Parameter",
    "Result",
    "Sensors",
    "SwashError",
    "Validation",
    "Vector",
    "Vehicle",
    "__version__",
    "autopilot",
    "check_controller",
    "datasets",
    "decouple",
    "decouple_axes",
    "derivatives",
    "design_controller",
    "equation_error",
    "evaluate_bench",
    "excitation",
    "export_controller",
    "export_model",
    "fit_in_frequency",
    "fit_in_time",
    "fit_state_space",
    "fit_transfer_function",
    "fit_vehicle",
    "fly_maneuver",
    "hover_hold",
    "identify",
    "inspect",
    "linearize",
    "link_ardupilot",
    "link_px4",
    "live",
    "load",
    "load_controller",
    "maneuver",
    "merge",
    "monte_carlo",
    "observability",
    "observe",
    "observer_trial",
    "plan_bench",
    "read",
    "read_control",
    "reconstruct",
    "replay",
    "report",
    "respond",
    "show_replay",
    "simulate",
    "simulate_adaptive",
    "simulate_bench",
    "simulate_closed_loop",
    "simulate_lpv",
    "simulate_maneuver",
    "speed_schedule",
    "state_hold",
    "stepwise",
    "structure",
    "suggest_gains",
    "synchronise",
    "trim",
    "trim_curve",
    "validate",
    "vehicle",
    "verify",
]


def read(
    path_or_name: str | os.PathLike[str],
    *,
    units: Mapping[str, str] | None = None,
    mapping: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    body: str | None = None,
    rotation: str | None = None,
    body_axes: str | None = None,
    world_axes: str | None = None,
    bad_stamps: str = "error",
    log: int | None = None,
) -> Flight:
    """Read a flight log as a `Flight` in SI units, radians, NED and FRD, at its native rates.

    Args:
        path_or_name: a file, or a file of a public data set as "coax56/flight_2011-08-01_vertical".
        units: units by channel (CSV) or field (`.mat`, motion capture) where the file says none, or the wrong ones.
        mapping: a TOML file, or its content, that says which columns of a CSV file are which channels.
        body: the tracked body, where a motion capture file has several.
        rotation: how three logged angles are meant: "helical" or "euler_xyz".
        body_axes: where the tracked body's logged axes point, for example "forward-left-up".
        world_axes: where the room's logged axes point, for example "north-west-up".
        bad_stamps: "error", or "drop" to leave out samples whose time repeats or goes backwards.
        log: which of the logs in a Blackbox file, from 1; the longest if not given.

    Raises:
        FlightError, UnitError: naming the file, the channel, what was found, what was expected and what to do.
        DatasetError: where a data set's file is named that is not on this machine.
    """
    from swashplate.flights import datasets  # array libraries take time to load
    from swashplate.flights.readers.read import read as read_log

    return read_log(
        datasets.locate(os.fspath(path_or_name)),
        units=units,
        mapping=mapping,
        body=body,
        rotation=rotation,
        body_axes=body_axes,
        world_axes=world_axes,
        bad_stamps=bad_stamps,
        log=log,
    )


def __getattr__(name: str) -> Any:
    """Names of `__all__` are loaded when first used (PEP 562)."""
    if name == "__version__":
        from importlib import metadata

        value: Any = metadata.version("swashplate")
    elif name in public.NAMES:
        value = public.resolve(name)
    else:
        raise AttributeError(f"module 'swashplate' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
