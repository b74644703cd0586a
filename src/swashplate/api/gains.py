"""Autopilot gains from identified models."""

from __future__ import annotations

from swashplate.control.analysis import ardupilot_gains
from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.control.analysis.gain_premises import refused_by_data
from swashplate.control.analysis.rate_gain_names import ARDUPILOT
from swashplate.errors import SwashError
from swashplate.identification.frequency.reading_accuracy import Fitted
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.validation.refutation import REFUTED, Judgement
from swashplate.validation.verification import Verification


def suggest_gains(
    fit: Fitted, responses: FrequencyResponse, *, unseen: Verification | None = None
) -> tuple[Suggestion, ...]:
    """Rate-loop gains for every axis of a fit, beside those that the log flew with, with margins of both.

    In Rotorflight's names and whole numbers where the log is Rotorflight's, otherwise in ArduPilot's. An axis whose
    premises do not hold gets no gains but the reason (`Suggestion.refused`): the log is of another autopilot, the
    command was not moved from outside, its sign is wrong or not known, the model does not follow the response, flights
    that it has not seen refute it, or the flown gains are unstable on it.

    Args:
        fit: of transfer functions or of a state-space model.
        responses: that it was fitted to; they remember their logs' channels and parameters.
        unseen: how the model follows flights that it was not fitted to.

    Raises:
        SwashError: no axis joins a rate with its mixer command.
    """
    settings, refuted = responses.settings, "" if unseen is None else _refuted(unseen.judgement)
    suggestions = ardupilot_gains.suggest_gains(
        fit,
        autopilot=settings.get("autopilot"),
        sources=settings.get("channels"),
        premise=lambda rate, command: refused_by_data(fit, responses, rate, command) or refuted,
    )
    if not suggestions:
        pairs = ", ".join(f"{rate} with {command}" for rate, command in ARDUPILOT.values())
        raise SwashError(
            f"the model joins no rate with its mixer command ({pairs}).",
            channel="--gains",
            hint="Name the log's own channels in `swash respond`, for example --inputs mixer_yaw --outputs r.",
        )
    return suggestions


def _refuted(judgement: Judgement | None) -> str:
    """That flights which the model was not fitted to refute it. "" where they do not, or were not asked."""
    if judgement is None or judgement.verdict != REFUTED:
        return ""
    return f"the held-out flight refutes the model: {' '.join(judgement.reasons)} Do not use it for gains."
