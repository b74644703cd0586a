"""What a linear model may lack, beside the same model with it; fits say so where the errors show it."""

from __future__ import annotations

import numpy as np
import pytest

import lacking
from swashplate.identification.core.result import Result
from swashplate.identification.identify import identify
from swashplate.identification.time import linear_likelihood
from swashplate.identification.time.linear_filter import FilterErrors
from swashplate.identification.time.linear_likelihood import LinearErrors
from swashplate.identification.time.linear_problem import linear_records
from swashplate.models.linear.state_space_file import structure

CROSSED = ("Ba", "Ab", "Blon", "Alat")
MODEL = structure("rotor_body").with_values(lacking.TRUTH).with_values(dict.fromkeys(CROSSED, 0.0), free=False)
SEED = 19
"""Its cross controls are 2.8 %."""


def likelihood(kind: type[LinearErrors], **changed: float) -> LinearErrors:
    model = MODEL.with_values(changed, free=False)
    flown = lacking.flights([1], "mixer_roll", gust=0.0, lacking=False, seconds=12.0)
    pieces, delays = linear_records(model, flown, model.outputs, biases=())
    return kind(model, model.outputs, pieces, True, (), delays=delays, gain=kind is FilterErrors)


@pytest.mark.parametrize("kind", [LinearErrors, FilterErrors])
def test_a_cross_control_moves_the_errors_as_the_model_with_it(kind: type[LinearErrors]) -> None:
    base, step = likelihood(kind), 1e-3
    row = base.row.starts()
    parts = base.missing_parts(row)
    assert parts is not None
    place = parts.names.index("mixer_roll acting on a")
    before, after = (one.errors_of(row)[0] for one in (base, likelihood(kind, Alat=step)))
    size = 0.1 * lacking.TRUTH["Alon"] * np.std(base.records[0].inputs[:, 1]) / np.std(base.records[0].inputs[:, 0])
    expected = before.whitened(after.errors - before.errors) * size / step
    settled = slice(200, None)  # the trim that a part takes along is the records' own
    actual = parts.slopes[0][place][settled]
    level = np.stack([np.ones(len(actual)), *base.records[0].inputs[settled].T * 0.0], axis=1)[:, :1]
    expected, actual = (x - level * x.mean(axis=0) for x in (expected[settled], actual))
    np.testing.assert_allclose(actual, expected, atol=0.02 * np.abs(expected).max())


def test_a_lag_in_a_delay_moves_the_errors_as_an_actuator_of_second_order_does() -> None:
    """In every line of the spectrum: the answer times the lag's response without its delay, less one."""
    base = likelihood(LinearErrors)
    row, dt = base.row.starts(), base.records[0].dt
    parts = base.missing_parts(row)
    assert parts is not None
    change = parts.slopes[0][parts.names.index("a lag in the delay of mixer_roll")][:, 0]
    errors = base.errors_of(row)[0]
    answer = errors.whitened(base.records[0].outputs - errors.errors)[:, 0]
    w = 2.0 * np.pi * np.fft.rfftfreq(len(change), dt)
    delay = lacking.TRUTH["tau_roll"] / 3.0
    s = 1j * w * delay
    lag = np.exp(s) / (1.0 + s + (s / 1.4) ** 2) - 1.0 - (0.5 - 1.4**-2) * s**2  # that term would be nothing at 0.71
    band = (w > 12.0) & (w < 35.0)
    window = np.hanning(len(change))
    seen = np.fft.rfft(window * change)[band]
    expected = -np.fft.rfft(window * answer)[band] * lag[band]
    assert np.linalg.norm(seen - expected) < 0.15 * np.linalg.norm(expected)


def fitted(method: str, lacks: bool, **how: object) -> Result:
    flown = [lacking.flights([SEED], axis, gust=0.5, lacking=lacks)[0] for axis in lacking.INPUTS]
    return identify(MODEL, flown, method=method, **how)


@pytest.mark.parametrize(("method", "how"), [("output-error", {}), ("filter-error", {"gusts": "lasting"})])
def test_a_fit_says_what_it_lacks_and_its_bounds_hold_it(
    method: str, how: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = fitted(method, True, **how)
    words = [text for text in fit.warnings if "what the model lacks" in text]
    assert len(words) == 1
    assert "mixer_roll acting on a" in words[0] or "mixer_pitch acting on b" in words[0]
    assert fit["Blat"].bound == "what the model may lack"
    assert "what the model may lack" in repr(fit)
    monkeypatch.setattr(linear_likelihood, "cross_controls", lambda b, spread: [])
    blind = fitted(method, True, **how)
    assert blind["Blat"].value == fit["Blat"].value
    assert blind["Blat"].best_sigma < fit["Blat"].best_sigma
    assert not any("acting on" in text for text in blind.warnings)


def test_a_model_that_lacks_nothing_has_the_bounds_of_its_errors() -> None:
    fit = fitted("output-error", False)
    assert not any("what the model lacks" in text for text in fit.warnings)
    assert {e.bound for e in fit.estimates if e.free} <= {"coloured errors", "errors by octaves", "white errors"}
