"""What must hold before gains are suggested: one gate for fits, vehicles, the page and Python.

Gains are refused, with the reason, where
* the autopilot that flew the log is none whose gains have names here,
* the input was not moved from outside: what relates it to the motion may be the controller,
* the response does not say that a positive command turns the aircraft positively,
* the fit has failed or does not follow this response,
* the gains that the log flew are unstable on the model: the flight itself refutes it,
* a gain would have another sign than flown ones have,
* a vehicle's axis turns against its command, or was fitted although nothing moved it from outside.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from swashplate.arrays import Array, Complex
from swashplate.control.analysis.rate_gain_names import gain_text, untuned
from swashplate.errors import ControllerError
from swashplate.flights.excitation import FLY, OUTSIDE
from swashplate.flights.motion_signs import SIGNED, sign_of
from swashplate.identification.frequency.handling import ResponseMargins
from swashplate.identification.frequency.reading_accuracy import Fitted
from swashplate.identification.frequency.response_cost import ACCEPTABLE
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.signs import response_sign
from swashplate.models.card import Card
from swashplate.models.linear.state_space import UNMOVED

_SEEN = (12.0, 120.0)
"""rad/s: where the sense of a vehicle's answer is read off."""


def refused_by_data(fit: Fitted, responses: FrequencyResponse, rate: str, command: str) -> str:
    """Why the data carry no gains for an axis, in words; "" where they do.

    Args:
        fit: of the responses. responses: with what moved each input.
        rate, command: of the axis, by the fit's names.
    """
    settings = responses.settings
    if other := untuned(str(settings.get("firmware", "")), settings.get("autopilot", {})):
        return other
    fitted = {(t.output, t.input) for t in fit.targets if not t.ceiling}
    if (rate, command) not in fitted or rate not in responses.outputs or command not in responses.inputs:
        return f"the model was not fitted to {rate} / {command}: nothing says that it holds there."
    return (
        _not_moved(responses, command) or _wrong_way(fit, responses, rate, command) or _not_followed(fit, rate, command)
    )


def _not_moved(responses: FrequencyResponse, command: str) -> str:
    excitation = responses.settings.get("excitation", {})
    name = next((n for n in (command, responses.settings.get("channels", {}).get(command)) if n in excitation), None)
    if name is None:
        return f"nothing tells what moved '{command}': it may be the controller's answer to the motion. {FLY}"
    if excitation[name]["kind"] in OUTSIDE:
        return ""
    evidence = excitation[name]["words"]
    return (
        f"'{command}' was not moved from outside, as far as the log tells ({excitation[name]['kind']}): {evidence}"
        f"{'' if FLY in evidence else f' {FLY}'}"
    )


def _wrong_way(fit: Fitted, responses: FrequencyResponse, rate: str, command: str) -> str:
    fitted = next(t.omega for t in fit.targets if (t.output, t.input) == (rate, command))
    band = (float(fitted[0]), float(fitted[-1]))
    sign = response_sign(responses, rate, command, expected=1, integrations=1, band=band)
    if sign.wrong:
        return (
            f"a positive {command} turns {rate} negative ({sign.facts}): one of the two counts the other way. See the "
            "problems of the responses for the remedy."
        )
    return "" if sign.sense else f"the sign from {command} to {rate} is not known: {sign.facts}. Fly a wider sweep."


def _not_followed(fit: Fitted, rate: str, command: str) -> str:
    if fit.failed:
        return f"the fit has failed: {' '.join(fit.problems) or 'do not use its numbers.'}"
    poor = [
        cost
        for target, cost in zip(fit.targets, fit.costs, strict=True)
        if (target.output, target.input) == (rate, command) and not cost <= ACCEPTABLE
    ]
    if poor:
        return f"the model does not follow {rate} / {command}: J = {poor[0]:.0f}, expected {ACCEPTABLE:g} or less."
    return ""


def refused_by_flight(logged: Mapping[str, float], margins: ResponseMargins) -> str:
    """That the flight refutes the model: the gains that it flew with are unstable on it. "" where they are not.

    Args:
        logged: gains of the log, by the firmware's names.
        margins: of these gains on the model, filters and delay included.
    """
    if margins.delay_margin.value != 0.0:
        return ""
    listed = ", ".join(f"{name} {gain_text(name, value)}" for name, value in logged.items() if value)
    return (
        f"the model is refuted: with the gains that this log flew ({listed}) its loop is unstable, and the aircraft "
        "flew. Do not use the model for gains: look at the sign, at the delay, and at what moved the command."
    )


def refused_by_sign(gains: Mapping[str, float]) -> str:
    """That a gain would be negative, and none that flies is. "" where none is.

    Args:
        gains: by their short names (P, I, D, FF).
    """
    turned = [name for name in ("FF", "P", "I", "D") if gains.get(name, 0.0) < 0.0]
    if not turned:
        return ""
    return (
        f"on this model {', '.join(turned)} would be negative: it turns against its command. Look at the signs of the "
        "command and the rate."
    )


# ---- of a vehicle ----------------------------------------------------------------------------------------------------
_TURNS = (("roll", "p", 1), ("pitch", "q", 1), ("yaw", "r", 1), ("throttle", "down", -1))
"""Commands of an autopilot with the rate or speed that a positive one makes, and its sign."""


def refuse_turned_commands(
    omega: Array, response: Complex, *, commands: Sequence[str], outputs: Sequence[str], where: str
) -> None:
    """Refuses a vehicle behind a servo mapping that turns, or climbs, against an autopilot's command.

    Args:
        omega: frequencies [rad/s], shape (n,). response: from commands to outputs, shape (n, outputs, commands).
        commands, outputs: names. where: the vehicle's name.

    Raises:
        ControllerError: naming the command.
    """
    band = (omega >= _SEEN[0]) & (omega <= _SEEN[1])
    for command, output, sense in _TURNS:
        h = response[band, outputs.index(output), commands.index(command)]
        sign, _, misfit = sign_of(omega[band], h, integrations=1)
        if sign == -sense:
            raise ControllerError(
                f"a positive {command} command makes {output} {SIGNED[sign]}, expected {SIGNED[sense]} (with the "
                f"sign turned it is {misfit[0]:.2f} rad off, as it is {misfit[1]:.2f}): no gains are given.",
                where=where,
                channel=command,
                hint="Look at the sign of its travel in the servo mapping, and at the model's sign of this input.",
            )


def refused_by_card(card: Card) -> str:
    """Why an identified vehicle carries no gains, in words; "" where it does, or was not identified."""
    unmoved = card.observer.get(UNMOVED, {})
    if not unmoved:
        return ""
    return (
        f"{', '.join(unmoved)}: fitted although no flight moved it from outside. The model may be the controller that "
        "flew. Fly a sweep of it, or leave it out of the fit."
    )
