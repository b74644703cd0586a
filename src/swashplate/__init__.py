"""From a small helicopter's flight log to a validated model, in the words of the command line.

    import swashplate as sp
    flight = sp.read("a.mat").condition(rate=100, cutoff=0)
    fit = sp.identify(sp.vehicle("coax"), flight)
    validation = sp.validate(fit, sp.read("b.mat").condition(rate=100, cutoff=0))
    sp.report(fit, validation, path="report.html")

Importing this package loads nothing heavy and changes no setting of any library.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # for those who check types it is True; `typing` takes a third of the time until `swash` begins
if TYPE_CHECKING:
    from typing import Any

    from swashplate.api.accept_autopilot import accept_autopilot
    from swashplate.api.autopilot_gains import autopilot_gains
    from swashplate.api.bench import evaluate_bench, simulate_bench
    from swashplate.api.campaigns.plan import plan_campaign
    from swashplate.api.campaigns.results import campaign_results
    from swashplate.api.campaigns.scheduler import DaskScheduler
    from swashplate.api.campaigns.verbs import campaign, replay_campaign, resume_campaign
    from swashplate.api.check_autopilot import check_autopilot
    from swashplate.api.check_controller import check_controller
    from swashplate.api.compare import compare
    from swashplate.api.controllers import load_controller
    from swashplate.api.decouple import decouple
    from swashplate.api.decouple_axes import decouple_axes
    from swashplate.api.demo import demo
    from swashplate.api.design_controller import design_controller
    from swashplate.api.design_maneuver import design_maneuver
    from swashplate.api.excitation import excitation
    from swashplate.api.export import export_controller, export_model
    from swashplate.api.fit_ss import fit_ss
    from swashplate.api.fit_tf import fit_tf
    from swashplate.api.fit_time import fit_time
    from swashplate.api.fly_maneuver import fly_maneuver
    from swashplate.api.gains import suggest_gains
    from swashplate.api.identification import identify_and_validate
    from swashplate.api.link import link_ardupilot, link_px4, write_ardupilot_parameters
    from swashplate.api.live import live, show_replay
    from swashplate.api.load import load
    from swashplate.api.monte_carlo import monte_carlo
    from swashplate.api.needed_excitation import needed_excitation
    from swashplate.api.open_logs import open_logs
    from swashplate.api.plot_logs import plot_logs
    from swashplate.api.simulate_batch import simulate_batch
    from swashplate.api.stitch import stitch
    from swashplate.api.structures import show_structure, structures
    from swashplate.api.track import recursive_estimator, track
    from swashplate.api.validate_linear import validate_linear
    from swashplate.bench.plan import plan as plan_bench
    from swashplate.control.analysis.rate_loop_steps import rate_loop_steps
    from swashplate.control.analysis.stability import loop_margins, loop_modes
    from swashplate.control.laws.autopilot import autopilot
    from swashplate.control.laws.hold import hover_hold
    from swashplate.control.laws.linear_decoupling import coupling, dynamic_decoupling, static_decoupling
    from swashplate.control.laws.state_hold import state_hold
    from swashplate.errors import SwashError
    from swashplate.export.control_json import read_control
    from swashplate.flights.conditioning.reconstruction import reconstruct
    from swashplate.flights.conditioning.synchronise import merge, synchronise
    from swashplate.flights.conditioning.uniform_records import uniform_records
    from swashplate.flights.datasets import fetch as fetch_dataset
    from swashplate.flights.datasets import listing as datasets
    from swashplate.flights.flight import Flight
    from swashplate.flights.inspect import inspect
    from swashplate.flights.maneuvers.planned import plan_maneuver
    from swashplate.flights.maneuvers.series import parse as maneuver
    from swashplate.flights.readers.read import read
    from swashplate.flights.review.review import review
    from swashplate.flights.rotor_speed import rotor_speed
    from swashplate.flights.spectrum import harmonics, spectrogram, spectrum
    from swashplate.identification.core.result import Result
    from swashplate.identification.frequency.handling_readings import handling_lines as handling_qualities
    from swashplate.identification.frequency.state_space_fit import fit_state_space
    from swashplate.identification.frequency.transfer_function_fit import fit_transfer_function
    from swashplate.identification.identify import identify
    from swashplate.identification.posterior import posterior
    from swashplate.identification.responses.arithmetic import combine
    from swashplate.identification.responses.frequency_response import FrequencyResponse
    from swashplate.identification.responses.respond import respond
    from swashplate.identification.time.equation_error import equation_error, stepwise
    from swashplate.links.live.replay import replay
    from swashplate.models.card import Card, Parameter
    from swashplate.models.catalogue import cards_by_name as vehicles
    from swashplate.models.catalogue import structure, vehicle
    from swashplate.models.coax_choices import CHOICES
    from swashplate.models.conventional.new_card import new_card
    from swashplate.models.vehicle import Vehicle
    from swashplate.physics.environment import Environment
    from swashplate.physics.frames import Vector
    from swashplate.reporting.report import report
    from swashplate.simulation.closed_loop import simulate_closed_loop, simulate_maneuver
    from swashplate.simulation.derivatives_over_speed import derivatives
    from swashplate.simulation.integrate import simulate
    from swashplate.simulation.linearize import linearize
    from swashplate.simulation.lpv import schedule as speed_schedule
    from swashplate.simulation.lpv import simulate_lpv
    from swashplate.simulation.published import compare_derivatives
    from swashplate.simulation.reduction import in_form, omit_derivatives
    from swashplate.simulation.sensors import QUIET, Sensors, observe
    from swashplate.simulation.trim import trim
    from swashplate.simulation.trim_curve import trim_curve
    from swashplate.validation.residuals import residuals
    from swashplate.validation.validation import Validation
    from swashplate.validation.verb import validate
    from swashplate.validation.verify import verify

    __version__: str

__all__ = [
    "CHOICES",
    "QUIET",
    "Card",
    "DaskScheduler",
    "Environment",
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
    "accept_autopilot",
    "autopilot",
    "autopilot_gains",
    "campaign",
    "campaign_results",
    "check_autopilot",
    "check_controller",
    "combine",
    "compare",
    "compare_derivatives",
    "coupling",
    "datasets",
    "decouple",
    "decouple_axes",
    "demo",
    "derivatives",
    "design_controller",
    "design_maneuver",
    "dynamic_decoupling",
    "equation_error",
    "evaluate_bench",
    "excitation",
    "export_controller",
    "export_model",
    "fetch_dataset",
    "fit_ss",
    "fit_state_space",
    "fit_tf",
    "fit_time",
    "fit_transfer_function",
    "fly_maneuver",
    "handling_qualities",
    "harmonics",
    "hover_hold",
    "identify",
    "identify_and_validate",
    "in_form",
    "inspect",
    "linearize",
    "link_ardupilot",
    "link_px4",
    "live",
    "load",
    "load_controller",
    "loop_margins",
    "loop_modes",
    "maneuver",
    "merge",
    "monte_carlo",
    "needed_excitation",
    "new_card",
    "observe",
    "omit_derivatives",
    "open_logs",
    "plan_bench",
    "plan_campaign",
    "plan_maneuver",
    "plot_logs",
    "posterior",
    "rate_loop_steps",
    "read",
    "read_control",
    "reconstruct",
    "recursive_estimator",
    "replay",
    "replay_campaign",
    "report",
    "residuals",
    "respond",
    "resume_campaign",
    "review",
    "rotor_speed",
    "show_replay",
    "show_structure",
    "simulate",
    "simulate_batch",
    "simulate_bench",
    "simulate_closed_loop",
    "simulate_lpv",
    "simulate_maneuver",
    "spectrogram",
    "spectrum",
    "speed_schedule",
    "state_hold",
    "static_decoupling",
    "stepwise",
    "stitch",
    "structure",
    "structures",
    "suggest_gains",
    "synchronise",
    "track",
    "trim",
    "trim_curve",
    "uniform_records",
    "validate",
    "validate_linear",
    "vehicle",
    "vehicles",
    "verify",
    "write_ardupilot_parameters",
]


def __getattr__(name: str) -> Any:
    """Names of `__all__` are loaded when first used (PEP 562)."""
    if name == "__version__":
        value: Any = import_module("importlib.metadata").version("swashplate")
    elif name in __all__:
        value = import_module("swashplate.public").resolve(name)
    else:
        raise AttributeError(f"module 'swashplate' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
