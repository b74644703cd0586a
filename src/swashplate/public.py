"""The public names, and the one place where a lower layer reaches a higher one: by name, when it is used.

`Flight.condition`, `.plot` and the like are verbs of layers above `Flight`. Importing those would make a circle, so
such a method calls `resolve("condition")`, and the verb's module is loaded then. Rules for them:

* the method has the verb's own signature, written out (`tests/unit/test_public.py` compares the two);
* it does nothing but call the verb;
* the name stands in one of the tables below.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

from swashplate.errors import MissingLibraryError
from swashplate.extras import EXTRA_OF, missing
from swashplate.meant import taking_names

_VERBS: Mapping[str, str] = {
    "CHOICES": "swashplate.models.coax_choices:CHOICES",
    "Card": "swashplate.models.card:Card",
    "DaskScheduler": "swashplate.api.campaigns.scheduler:DaskScheduler",
    "Environment": "swashplate.physics.environment:Environment",
    "Flight": "swashplate.flights.flight:Flight",
    "FrequencyResponse": "swashplate.identification.responses.frequency_response:FrequencyResponse",
    "Parameter": "swashplate.models.card:Parameter",
    "Result": "swashplate.identification.core.result:Result",
    "SwashError": "swashplate.errors:SwashError",
    "Validation": "swashplate.validation.validation:Validation",
    "Vector": "swashplate.physics.frames:Vector",
    "Vehicle": "swashplate.models.vehicle:Vehicle",
    "campaign": "swashplate.api.campaigns.verbs:campaign",
    "campaign_results": "swashplate.api.campaigns.results:campaign_results",
    "plan_campaign": "swashplate.api.campaigns.plan:plan_campaign",
    "replay_campaign": "swashplate.api.campaigns.verbs:replay_campaign",
    "resume_campaign": "swashplate.api.campaigns.verbs:resume_campaign",
    "datasets": "swashplate.flights.datasets:listing",
    "equation_error": "swashplate.identification.time.equation_error:equation_error",
    "combine": "swashplate.identification.responses.arithmetic:combine",
    "evaluate_bench": "swashplate.api.bench:evaluate_bench",
    "export_controller": "swashplate.api.export:export_controller",
    "fetch_dataset": "swashplate.flights.datasets:fetch",
    "fit_state_space": "swashplate.identification.frequency.state_space_fit:fit_state_space",
    "fit_tf": "swashplate.api.fit_tf:fit_tf",
    "fit_transfer_function": "swashplate.identification.frequency.transfer_function_fit:fit_transfer_function",
    "handling_qualities": "swashplate.identification.frequency.handling_readings:handling_lines",
    "harmonics": "swashplate.flights.spectrum:harmonics",
    "inspect": "swashplate.flights.inspect:inspect",
    "load": "swashplate.api.load:load",
    "maneuver": "swashplate.flights.maneuvers.series:parse",
    "merge": "swashplate.flights.conditioning.synchronise:merge",
    "new_card": "swashplate.models.conventional.new_card:new_card",
    "plan_maneuver": "swashplate.flights.maneuvers.planned:plan_maneuver",
    "rate_loop_steps": "swashplate.control.analysis.rate_loop_steps:rate_loop_steps",
    "read": "swashplate.flights.readers.read:read",
    "needed_excitation": "swashplate.api.needed_excitation:needed_excitation",
    "open_logs": "swashplate.api.open_logs:open_logs",
    "plot_logs": "swashplate.api.plot_logs:plot_logs",
    "read_control": "swashplate.export.control_json:read_control",
    "reconstruct": "swashplate.flights.conditioning.reconstruction:reconstruct",
    "report": "swashplate.reporting.report:report",
    "respond": "swashplate.identification.responses.respond:respond",
    "spectrogram": "swashplate.flights.spectrum:spectrogram",
    "spectrum": "swashplate.flights.spectrum:spectrum",
    "review": "swashplate.flights.review.review:review",
    "rotor_speed": "swashplate.flights.rotor_speed:rotor_speed",
    "stepwise": "swashplate.identification.time.equation_error:stepwise",
    "show_structure": "swashplate.api.structures:show_structure",
    "structure": "swashplate.models.catalogue:structure",
    "structures": "swashplate.api.structures:structures",
    "suggest_gains": "swashplate.api.gains:suggest_gains",
    "synchronise": "swashplate.flights.conditioning.synchronise:synchronise",
    "uniform_records": "swashplate.flights.conditioning.uniform_records:uniform_records",
    "vehicle": "swashplate.models.catalogue:vehicle",
    "vehicles": "swashplate.models.catalogue:cards_by_name",
    "verify": "swashplate.validation.verify:verify",
    "fit_ss": "swashplate.api.fit_ss:fit_ss",
    "validate_linear": "swashplate.api.validate_linear:validate_linear",
    "QUIET": "swashplate.simulation.sensors:QUIET",
    "Sensors": "swashplate.simulation.sensors:Sensors",
    "accept_autopilot": "swashplate.api.accept_autopilot:accept_autopilot",
    "autopilot_gains": "swashplate.api.autopilot_gains:autopilot_gains",
    "autopilot": "swashplate.control.laws.autopilot:autopilot",
    "check_autopilot": "swashplate.api.check_autopilot:check_autopilot",
    "check_controller": "swashplate.api.check_controller:check_controller",
    "compare_derivatives": "swashplate.simulation.published:compare_derivatives",
    "compare": "swashplate.api.compare:compare",
    "coupling": "swashplate.control.laws.linear_decoupling:coupling",
    "decouple": "swashplate.api.decouple:decouple",
    "decouple_axes": "swashplate.api.decouple_axes:decouple_axes",
    "demo": "swashplate.api.demo:demo",
    "derivatives": "swashplate.simulation.derivatives_over_speed:derivatives",
    "design_controller": "swashplate.api.design_controller:design_controller",
    "design_maneuver": "swashplate.api.design_maneuver:design_maneuver",
    "dynamic_decoupling": "swashplate.control.laws.linear_decoupling:dynamic_decoupling",
    "excitation": "swashplate.api.excitation:excitation",
    "export_model": "swashplate.api.export:export_model",
    "fit_time": "swashplate.api.fit_time:fit_time",
    "fly_maneuver": "swashplate.api.fly_maneuver:fly_maneuver",
    "hover_hold": "swashplate.control.laws.hold:hover_hold",
    "identify": "swashplate.identification.identify:identify",
    "identify_and_validate": "swashplate.api.identification:identify_and_validate",
    "in_form": "swashplate.simulation.reduction:in_form",
    "linearize": "swashplate.simulation.linearize:linearize",
    "link_ardupilot": "swashplate.api.link:link_ardupilot",
    "link_px4": "swashplate.api.link:link_px4",
    "live": "swashplate.api.live:live",
    "load_controller": "swashplate.api.controllers:load_controller",
    "loop_margins": "swashplate.control.analysis.stability:loop_margins",
    "loop_modes": "swashplate.control.analysis.stability:loop_modes",
    "monte_carlo": "swashplate.api.monte_carlo:monte_carlo",
    "observe": "swashplate.simulation.sensors:observe",
    "omit_derivatives": "swashplate.simulation.reduction:omit_derivatives",
    "plan_bench": "swashplate.bench.plan:plan",
    "posterior": "swashplate.identification.posterior:posterior",
    "recursive_estimator": "swashplate.api.track:recursive_estimator",
    "residuals": "swashplate.validation.residuals:residuals",
    "replay": "swashplate.links.live.replay:replay",
    "show_replay": "swashplate.api.live:show_replay",
    "simulate": "swashplate.simulation.integrate:simulate",
    "simulate_batch": "swashplate.api.simulate_batch:simulate_batch",
    "simulate_bench": "swashplate.api.bench:simulate_bench",
    "simulate_closed_loop": "swashplate.simulation.closed_loop:simulate_closed_loop",
    "simulate_lpv": "swashplate.simulation.lpv:simulate_lpv",
    "simulate_maneuver": "swashplate.simulation.closed_loop:simulate_maneuver",
    "speed_schedule": "swashplate.simulation.lpv:schedule",
    "state_hold": "swashplate.control.laws.state_hold:state_hold",
    "static_decoupling": "swashplate.control.laws.linear_decoupling:static_decoupling",
    "stitch": "swashplate.api.stitch:stitch",
    "track": "swashplate.api.track:track",
    "trim": "swashplate.simulation.trim:trim",
    "trim_curve": "swashplate.simulation.trim_curve:trim_curve",
    "validate": "swashplate.validation.verb:validate",
    "write_ardupilot_parameters": "swashplate.api.link:write_ardupilot_parameters",
}
"""What `swashplate` offers by name, the version besides."""

_BEHIND_METHODS: Mapping[str, str] = {
    "condition": "swashplate.flights.conditioning.condition:condition",
    "flight_from_arrays": "swashplate.flights.tabular:from_arrays",
    "flight_from_dataframe": "swashplate.flights.tabular:from_dataframe",
    "flight_to_dataframe": "swashplate.flights.tabular:to_dataframe",
    "encode": "swashplate.identification.core.document_codec:encode",
    "explore": "swashplate.reporting.figures.views:explore",
    "explore_derivatives": "swashplate.reporting.figures.views:explore_derivatives",
    "explore_flight": "swashplate.reporting.figures.views:explore_flight",
    "compose_speeds": "swashplate.reporting.speed_page:compose_speeds",
    "explore_responses": "swashplate.reporting.figures.views:explore_responses",
    "figure_names": "swashplate.reporting.figures.views:figure_names",
    "html_of": "swashplate.reporting.figures.notebook:html_of",
    "plot": "swashplate.reporting.figures.views:plot",
    "plot_derivatives": "swashplate.reporting.figures.views:plot_derivatives",
    "plot_flight": "swashplate.reporting.figures.views:plot_flight",
    "plot_responses": "swashplate.reporting.figures.views:plot_responses",
    "result_from_document": "swashplate.identification.core.result_file:from_document",
    "result_to_document": "swashplate.identification.core.result_file:to_document",
    "vehicle_of_result": "swashplate.identification.frequency.transfer_function_fit:vehicle_of",
    "save_result": "swashplate.identification.core.result_file:save",
}
"""Verbs that are reached as methods (`flight.condition(...)`) and have no name in `swashplate`."""

NAMES = tuple(sorted(_VERBS))


def place(name: str) -> str:
    """Where a name of the tables is defined, as "package.module:name".

    Raises:
        KeyError: where no table has the name.
    """
    return {**_BEHIND_METHODS, **_VERBS}[name]


def _load(where: str) -> Any:
    module, _, attribute = where.partition(":")
    return getattr(import_module(module), attribute)


@cache
def _taking_names(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """A public function that takes a vehicle's name, a file or one channel's name for what is meant by it."""
    loads = {place(kind): partial(_loaded, verb) for kind, verb in _LOADED_BY.items()}
    made = taking_names(function, loads)
    if name in NAMES:  # where pickle finds it again
        made.__module__, made.__qualname__ = __package__ or "swashplate", name
    return made


def _loaded(verb: str, given: str | Path) -> Any:
    return _load(place(verb))(given)


_LOADED_BY: Mapping[str, str] = {"Vehicle": "vehicle", "Flight": "read", "FrequencyResponse": "load", "Result": "load"}
"""What makes an object of a name or a file, where a function takes the object."""


def resolve(name: str) -> Any:
    """What a name of the tables stands for; its module is loaded now.

    Raises:
        KeyError: where no table has the name.
        MissingLibraryError: where it computes with a library that is not installed, with the command.
    """
    try:
        named = _load(place(name))
        return _taking_names(name, named) if inspect.isfunction(named) else named
    except ModuleNotFoundError as error:
        if isinstance(error, MissingLibraryError) or (error.name or "").partition(".")[0] not in EXTRA_OF:
            raise
        raise missing(str(error.name), what=f"'{name}'") from None
