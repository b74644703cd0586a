"""Autopilot gains from identified models."""

from __future__ import annotations

from swashplate.control.analysis import ardupilot_gains
from swashplate.control.analysis.ardupilot_gains import Suggestion
from swashplate.control.analysis.gain_premises import refused_by_data
from swashplate.control.analysis.rate_gain_names import ARDUPILOT
from swashplate.errors import SwashError
from swashplate.identification.frequency.reading_accuracy import Fitted
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.validation.refutation import REFUTED
from swashplate.validation.verification import Verification


def suggest_gains(
    fit: Fitted, responses: FrequencyResponse, *, unseen: Verification | None = None
) -> tuple[Suggestion, ...]:
    """Rate-loop gains for every axis of a fit, beside those that the log flew with, with margins of both.

    In Rotorflight's or Betaflight's names and whole numbers where the log is theirs, otherwise in ArduPilot's. An axis
    whose premises do not hold gets no gains but the reason (`Suggestion.refused`): the log is of another autopilot, the
    command was not moved from outside, its sign is wrong or not known, the model does not follow the response, flights
    that it has not seen refute it, or the flown gains are unstable on it.

    Args:
        fit: of transfer functions or of a state-space model.
        responses: that it was fitted to; they remember their logs' channels and parameters.
        unseen: how the model follows flights; those that the fit has seen are told apart (`fitted_sources`).

    Raises:
        SwashError: no axis joins a rate with its mixer command.
    """
    settings, refuted = responses.settings, "" if unseen is None else _refuted(unseen)
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


def _refuted(verification: Verification) -> str:
    """That the flights that the model was flown along refute it, and which they are. "" where they do not."""
    judgement = verification.judgement
    if judgement is None or judgement.verdict != REFUTED:
        return ""
    whose = "the fit's own flight (NOT a held-out one)" if verification.fitted_sources else "the held-out flight"
    return f"{whose} refutes the model: {' '.join(judgement.reasons)} Do not use it for gains."
