"""Errors of what is read off fitted models, against draws of their parameters; which input is an axis's own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_transfer_function import exact

from swashplate.identification.frequency.handling import Handling, ReadNumber, ResponseMargins, delay_words, margins
from swashplate.identification.frequency.handling_readings import handling_lines, margin_lines, own_input
from swashplate.identification.frequency.reading_accuracy import answers
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.transfer_function_fit import TransferFunctionFit, fit_transfer_function
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.state_space_file import structure
from swashplate.models.linear.transfer_function import Form, TransferFunction

TRUTH = {
    "Lb": 3000.0, "Ma": 800.0, "tau_f": 0.07, "Ba": 0.5, "Ab": -0.5, "Blat": 0.2, "Blon": -0.05, "Alat": 0.05,
    "Alon": 0.25, "tau_roll": 0.05, "tau_pitch": 0.05,
}  # fmt: skip


@pytest.fixture(scope="module")
def lag() -> tuple[FrequencyResponse, TransferFunctionFit]:
    """An integrator behind a lag and a delay, and its fit."""
    truth = TransferFunction(Form(0, 1, 1), {"K": 60.0, "pole": 9.0, "tau": 0.02}, "p", "stick")
    found = exact(truth, coherence=0.9)
    return found, fit_transfer_function(found, "0/1+1s", input="stick")


def drawn(fit: TransferFunctionFit, number: int) -> list[TransferFunction]:
    """Models from the covariance of the bounds, a tenth of it: straight lines are asked of it."""
    free = [p for p in fit.estimates if not p.fixed]
    bounds = np.array([p.sigma for p in free])
    chosen = np.random.default_rng(5).multivariate_normal(
        [p.value for p in free], 0.01 * fit.correlation * np.outer(bounds, bounds), size=number
    )
    (model,) = fit.solution
    return [
        replace(model, values={**model.values, **dict(zip((p.name for p in free), map(float, row), strict=True))})
        for row in chosen
    ]


def test_bounds_of_margins_are_those_of_drawn_models(lag: tuple[FrequencyResponse, TransferFunctionFit]) -> None:
    found, fit = lag
    line = next(a for a in margin_lines(found, fit, fit.targets) if a.source == "model")
    assert isinstance(line.read, ResponseMargins)
    omega = np.geomspace(0.3, 300.0, 800)
    others = [margins(omega, model.response(omega)) for model in drawn(fit, 300)]
    for name in ("crossover", "phase_margin", "gain_margin", "omega_180", "delay_margin"):
        read: ReadNumber = getattr(line.read, name)
        scatter = 10.0 * np.std([getattr(m, name).value for m in others])
        assert read.sigma == pytest.approx(scatter, rel=0.15), name
    omega = np.geomspace(1.0, 50.0, 9)
    band = answers(fit, "p", "stick", omega)
    logs = np.array([np.log(m.response(omega) / band.response) for m in drawn(fit, 300)])
    assert band.gain == pytest.approx(10.0 * logs.real.std(axis=0), rel=0.15)
    assert band.phase == pytest.approx(10.0 * logs.imag.std(axis=0), rel=0.15)


def test_numbers_that_are_hardly_seen_do_not_break_the_errors(
    lag: tuple[FrequencyResponse, TransferFunctionFit],
) -> None:
    """A bound beyond all size left no positive covariance, and the fit ended in an error of linear algebra."""
    found, fit = lag
    vague = replace(fit, covariance=1e24 * fit.covariance)
    (_, line), (_, usual) = (margin_lines(found, one, fit.targets) for one in (vague, fit))
    assert isinstance(line.read, ResponseMargins)
    assert isinstance(usual.read, ResponseMargins)
    assert line.read.crossover.sigma == pytest.approx(usual.read.crossover.sigma, rel=0.5)


def test_errors_of_margins_are_those_of_drawn_responses() -> None:
    omega = np.geomspace(0.5, 50.0, 2000)
    loop = 40.0 / (1j * omega * ((1j * omega) ** 2 + 6j * omega + 10.0))
    error = 0.01
    found = margins(omega, loop, error=np.full(omega.size, error))
    random = np.random.default_rng(2).standard_normal((400, 2)) * error
    others = [margins(omega, loop * (1.0 + a + 1j * b)) for a, b in random]
    for name in ("crossover", "phase_margin", "gain_margin", "omega_180", "delay_margin"):
        scatter = np.std([getattr(m, name).value for m in others])
        assert getattr(found, name).sigma == pytest.approx(scatter, rel=0.12), name


def test_the_least_margin_counts_where_a_loop_crosses_often() -> None:
    """A mode above the crossover brings the gain back over one, with a phase that no first crossing shows."""
    s = 1j * (omega := np.geomspace(0.1, 300.0, 20000))
    loop = 3.0 / s * 60.0**2 / (s**2 + 2 * 0.02 * 60.0 * s + 60.0**2)
    found = margins(omega, loop)
    assert found.crossover.value == pytest.approx(60.0, rel=0.06)
    assert abs(found.phase_margin.value) < 45.0
    assert found.gain_margin.value == pytest.approx(20 * np.log10(60.0 * 0.04 / 3.0), abs=0.1)  # it has none
    assert repr(margins(omega, 0.001 * loop).phase_margin) == "none"


def test_a_good_phase_margin_at_a_high_crossover_is_called_out_by_the_delay_margin() -> None:
    """An integrator has 90 degrees at every gain; what it stands of delay is a quarter of a period of its crossover."""
    omega = np.geomspace(0.1, 300.0, 3000)
    slow, fast = (margins(omega, gain / (1j * omega)) for gain in (2.0, 200.0))
    assert slow.phase_margin.value == pytest.approx(90.0, abs=0.1)
    assert fast.phase_margin.value == pytest.approx(90.0, abs=0.1)
    assert slow.delay_margin.value == pytest.approx(np.pi / 4.0, rel=1e-3)
    assert fast.delay_margin.value == pytest.approx(np.pi / 400.0, rel=1e-3)
    # With that delay it is at its limit, with a little more it stands none, and with a little less a little.
    late = {
        share: margins(omega, 200.0 * np.exp(-1j * omega * share * np.pi / 400.0) / (1j * omega))
        for share in (0.9, 1.1)
    }
    assert late[0.9].delay_margin.value == pytest.approx(0.1 * np.pi / 400.0, rel=0.02)
    assert late[1.1].delay_margin.value == 0.0


def test_the_delay_margin_is_that_of_the_crossing_with_the_least_and_not_of_the_least_phase() -> None:
    """A slow crossing of 49 degrees and a resonance at 60 rad/s with more phase in hand: the second stands less."""
    s = 1j * (omega := np.geomspace(0.1, 1000.0, 20000))
    slow = 3.0 / s / (1.0 + s / 3.0)
    loop = slow + 5.0 * s / (s**2 + s + 60.0**2)
    found, alone = margins(omega, loop), margins(omega, slow)
    assert found.crossover.value == pytest.approx(alone.crossover.value, rel=0.02)
    assert found.phase_margin.value == pytest.approx(alone.phase_margin.value, abs=2.0)
    assert found.delay_margin.value < 0.2 * alone.delay_margin.value


@pytest.mark.parametrize(("gain", "stands"), [(3.0, True), (0.01, True), (9.0, False)])
def test_a_loop_that_is_unstable_already_stands_no_delay(gain: float, stands: bool) -> None:
    """By the roots of the closed loop of gain / (s (s + 1) (s + 4)) times three: Routh's limit is 20."""
    omega = np.geomspace(1e-3, 300.0, 3000)
    s = 1j * omega
    found = margins(omega, 3.0 * gain / (s * (s + 1.0) * (s + 4.0)))
    assert (np.roots([1.0, 5.0, 4.0, 3.0 * gain]).real.max() < 0.0) == stands
    assert (found.delay_margin.value > 0.0) == stands


def test_the_phase_margin_of_an_unstable_loop_never_reads_as_a_good_one() -> None:
    """5 / s behind 0.8 s of delay turns by -319 degrees at its crossover: wrapped, that was +131 degrees of margin."""
    omega = np.geomspace(0.1, 50.0, 800)
    found = margins(omega, 5.0 / (1j * omega) * np.exp(-0.8j * omega))
    assert found.delay_margin.value == 0.0
    assert found.phase_margin.value == pytest.approx(90.0 - np.degrees(4.0), abs=0.2)


def test_every_axis_is_judged_by_its_own_input() -> None:
    model = structure("rotor_body").with_values(TRUTH)
    omega = np.geomspace(0.6, 80.0, 120)
    h = model.response(omega)
    good = np.full(h.shape, 0.98)
    good[-10:, :, 1] = 0.5  # pitch was swept less far
    powers = np.full((omega.size, 2), 1e-3)
    found = FrequencyResponse(
        omega=omega,
        inputs=model.inputs,
        outputs=model.outputs,
        response=h,
        coherence=good,
        multiple=np.ones((omega.size, 2)),
        error=np.full(h.shape, 0.02),
        input_power=powers,
        output_power=(np.abs(h) ** 2 @ powers[:, :, None])[..., 0],
        input_coherence=np.zeros((omega.size, 2, 2)),
    )
    assert [own_input(found, o) for o in found.outputs] == ["mixer_roll", "mixer_pitch"]
    assert own_input(found.select(("q",), ("mixer_roll",)), "q") is None
    free = replace(found, input_power=powers * np.nan, output_power=powers * np.nan)  # of a control.FRD
    assert [own_input(free, o) for o in found.outputs] == ["mixer_roll", "mixer_pitch"]
    fit = fit_state_space(model, found, starts=1)
    # The same bounds by moving each parameter of the state-space model along its covariance's directions.
    band, steps = answers(fit, "q", "mixer_roll", omega), []
    bounds = np.array([fit[name].sigma for name in fit.names])
    for row in np.random.default_rng(6).multivariate_normal(np.zeros(bounds.size), fit.correlation, size=300):
        moved = {n: fit[n].value + 0.1 * b * float(x) for n, b, x in zip(fit.names, bounds, row, strict=True)}
        steps.append(np.log(fit.solution.with_values(moved).response(omega)[:, 1, 0] / band.response))
    # Where the form is right they are those; narrower where errors, which no cost weighs by, tell more.
    for found_sigma, scatter in ((band.gain, np.real(steps)), (band.phase, np.imag(steps))):
        ratio = found_sigma / (10.0 * np.std(scatter, axis=0))
        assert 0.75 < np.median(ratio) < 1.05
        assert ratio.max() < 1.2
    lines = handling_lines(found, (fit,))
    assert [(a.response, a.source) for a in lines] == [
        ("phi / mixer_roll", "flight"), ("phi / mixer_roll", "model"),
        ("theta / mixer_pitch", "flight"), ("theta / mixer_pitch", "model"),
    ]  # fmt: skip
    flown, modelled = lines[0].read, lines[1].read
    assert isinstance(flown, Handling)
    assert isinstance(modelled, Handling)
    assert modelled.bandwidth.value == pytest.approx(flown.bandwidth.value, rel=0.02)
    assert 0.0 < modelled.bandwidth.sigma < 0.2 * modelled.bandwidth.value
    assert lines[1].to_document()["bandwidth"] == [modelled.bandwidth.value, modelled.bandwidth.sigma]
    assert not any(line.problem for line in lines)
    # The other way round the numbers are the same, and it is told.
    turned = handling_lines(replace(found, response=-found.response))
    assert [repr(line.read) for line in turned] == [repr(line.read) for line in lines if line.source == "flight"]
    assert "a positive mixer_roll makes phi negative" in repr(turned[0])
    assert "a positive mixer_pitch makes theta negative" in turned[1].to_document()["problem"]


def test_a_delay_of_a_second_and_more_is_told_in_seconds() -> None:
    assert delay_words(4.48, 0.11, digits=4) == "4.48 +- 0.11 s"
    assert delay_words(0.0603) == "60.3 ms"
    assert delay_words(float("inf")) == "any amount"
    assert delay_words(float("nan")) == "none"
