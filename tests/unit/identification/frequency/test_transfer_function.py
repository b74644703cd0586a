"""Transfer functions, their fits, the envelopes, and what is read off a response."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import IdentificationError
from swashplate.flights.flight import Flight, stream
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.frequency.handling import attitude_of, handling_qualities, margins
from swashplate.identification.frequency.response_cost import ResponseCost, cost_of, target
from swashplate.identification.frequency.transfer_function_fit import as_state_space, fit_transfer_function
from swashplate.identification.frequency.transfer_function_forms import BAND, suggest
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.models.linear.transfer_function import Form, TransferFunction
from swashplate.validation.verify import verify

OMEGA = 2 * np.pi * np.geomspace(0.1, 10.0, 90)


def exact(*models: TransferFunction, coherence: float = 0.9, noise: float = 0.0, seed: int = 0) -> FrequencyResponse:
    random = np.random.default_rng(seed)
    h = np.stack([m.response(OMEGA) for m in models], axis=1)[:, :, None]
    h = h * np.exp(noise * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)))
    shape = h.shape
    return FrequencyResponse(
        omega=OMEGA,
        inputs=("stick",),
        outputs=tuple(m.output for m in models),
        response=h,
        coherence=np.full(shape, coherence),
        multiple=np.full(shape[:2], coherence),
        error=np.full(shape, 0.02),
        input_power=np.ones((OMEGA.size, 1)),
        output_power=np.ones(shape[:2]),
        input_coherence=np.ones((OMEGA.size, 1, 1)),
    )


SECOND = TransferFunction(
    Form(1, 2), {"K": -4.0, "zero": 2.0, "zeta_pole": 0.3, "omega_pole": 12.0, "tau": 0.04}, "rate", "stick"
)


def test_response_is_that_of_python_control() -> None:
    s = 1j * OMEGA
    np.testing.assert_allclose(SECOND.response(OMEGA), SECOND.to_control(pade=0)(s) * np.exp(-0.04 * s), rtol=1e-12)


def test_slopes_are_the_derivatives() -> None:
    model = TransferFunction(
        Form(2, 3, 1),
        {"K": 2.0, "zeta_zero": 0.4, "omega_zero": 5.0, "pole": 3.0, "zeta_pole": 1.2, "omega_pole": 9.0, "tau": 0.1},
    )
    _, slopes = model.with_slopes(OMEGA)
    for name, value in model.values.items():
        step = 1e-6 * max(abs(value), 1e-3)
        up, down = (
            TransferFunction(model.form, {**model.values, name: value + d}).response(OMEGA) for d in (step, -step)
        )
        np.testing.assert_allclose(slopes[name], np.log(up / down) / (2 * step), rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize("form", ["0/0", "1/2", "2/4", "0/1+1s", "1/2-1s", "0/2 no delay", "2/1", "11/12"])
def test_form_text_round_trip(form: str) -> None:
    assert Form.parse(form).text == form


def test_form_refuses() -> None:
    with pytest.raises(IdentificationError, match="Examples"):
        Form.parse("second order")
    with pytest.raises(IdentificationError, match="order above 12"):
        Form.parse("3/14")


def test_cost_by_hand() -> None:
    wanted = target(exact(SECOND, coherence=1.0), "rate", "stick")
    assert wanted is not None
    assert wanted.omega.size == 20
    assert cost_of(wanted.measured, wanted) == pytest.approx(0.0, abs=1e-20)
    # 1 dB everywhere: 20/20 * 20 * W * 1 with W = (1.58 (1 - 1/e))^2 = 0.9975; 1 degree: 0.01745 of that.
    w = (1.58 * (1 - np.exp(-1))) ** 2
    assert cost_of(wanted.measured * 10**0.05, wanted) == pytest.approx(20 * w)
    assert cost_of(wanted.measured * np.exp(1j * np.pi / 180), wanted) == pytest.approx(20 * w * 0.01745)
    assert cost_of(wanted.measured * np.exp(2j * np.pi), wanted) == pytest.approx(0.0, abs=1e-9)


def test_fit_finds_the_truth_and_shares_poles() -> None:
    other = TransferFunction(SECOND.form, {**SECOND.values, "K": 3.0, "zero": 20.0, "tau": 0.06}, "angle", "stick")
    fit = fit_transfer_function(exact(SECOND, other), "1/2", input="stick")
    assert fit.cost < 1e-2  # the points are interpolated between lines
    for found, true in zip(fit.solution, (SECOND, other), strict=True):
        for name, value in true.values.items():
            assert found.values[name] == pytest.approx(value, rel=2e-3)
    assert sum(p.name == "omega_pole" for p in fit.estimates) == 1
    assert all(p.sigma >= p.insensitivity for p in fit.estimates)


def test_fixed_stays_and_unknown_is_refused() -> None:
    fit = fit_transfer_function(exact(SECOND), "1/2", input="stick", fixed={"tau": 0.03})
    assert fit.solution[0].values["tau"] == 0.03
    with pytest.raises(IdentificationError, match="is no parameter of the form 1/2"):
        fit_transfer_function(exact(SECOND), "1/2", input="stick", fixed={"tua": 0.03})
    with pytest.raises(IdentificationError, match="nowhere over a quarter of an octave"):
        fit_transfer_function(exact(SECOND, coherence=0.5), "1/2", input="stick")
    with pytest.raises(IdentificationError, match="nothing to fit"):
        fit_transfer_function(exact(SECOND), "0/0", input="stick", fixed={"K": 1.0, "tau": 0.1})


def test_suggestion_is_the_true_structure() -> None:
    best, trials = suggest(
        exact(SECOND, noise=0.05), input="stick", forms=[Form(0, 0), Form(0, 1), Form(0, 2), Form(1, 2), Form(2, 3)]
    )
    assert best.form == Form(1, 2)
    assert trials[0].parameters == 2
    assert trials[0].cost > 100.0


def test_no_form_is_suggested_whose_parameters_are_not_told() -> None:
    """A first-order lag: a pole and a zero that cancel fit it too, and are told by nothing."""
    lag = TransferFunction(Form(0, 1), {"K": 6.0, "tau": 0.03, "pole": 3.0}, "rate", "stick")
    responses = exact(lag, noise=0.02)
    best, trials = suggest(responses, input="stick", forms=[Form(0, 0), Form(1, 2), Form(2, 3)])
    assert best.form == Form(0, 0), "the two others cost a hundredth of it"
    assert best.cost > 100.0
    why = {trial.form.text: trial.unsound for trial in trials}
    assert why["0/0"] == ""
    assert "is not told (standard deviation" in why["1/2"]
    assert "an unstable mode" in why["2/3"]
    assert not any("no form that was tried" in text for text in best.fit.warnings)
    only, _ = suggest(responses, input="stick", forms=[Form(2, 3)])
    assert any("no form that was tried has all its parameters told" in text for text in only.fit.warnings)


UNSTABLE = TransferFunction(Form(0, 1), {"K": 20.0, "tau": 0.03, "pole": -3.0}, "rate", "stick")
STABLE = TransferFunction(Form(0, 1), {"K": 20.0, "tau": 0.03, "pole": 6.0}, "rate", "stick")


def test_an_unstable_form_is_suggested_only_where_the_data_demand_it() -> None:
    """A recorded reference rules a loop's answer out: what is left is the aircraft, and it is said."""
    forms = [Form(0, 0), Form(0, 1), Form(0, 2), Form(1, 2)]
    joint = replace(exact(UNSTABLE, noise=0.01), method="joint")
    best, trials = suggest(joint, input="stick", forms=forms)
    assert best.unstable == pytest.approx(3.0, rel=0.05)
    assert any("the data demand an unstable model" in text for text in best.fit.warnings)
    assert min(t.cost for t in trials if not t.unstable) > 100.0
    stable, trials = suggest(exact(STABLE, noise=0.01), input="stick", forms=forms)
    assert stable.unstable == 0.0
    assert not any("unstable" in text for text in stable.fit.warnings)
    assert BAND not in stable.fit.settings


def test_what_a_loop_makes_of_gusts_below_a_sweep_is_no_unstable_aircraft() -> None:
    """Below 0.7 Hz gusts rule, and the response is minus the inverse of the controller 0.1 + 0.2/s, as a real X8's."""
    s = 1j * OMEGA
    swept = 1.0 / (1.0 + (2.0 * np.pi * 0.7 / OMEGA) ** 8)
    true = STABLE.response(OMEGA)
    mixed = swept * true - (1.0 - swept) / (0.1 + 0.2 / s)
    seen = replace(exact(STABLE), response=mixed[:, None, None])
    best, trials = suggest(seen, input="stick")
    whole = min((t for t in trials if not t.unsound), key=lambda t: t.cost)
    assert whole.unstable > 1.0, "over the whole band the best form is unstable"
    assert best.unstable == 0.0
    assert 0.4 < best.fit.settings[BAND][0] < 2.0
    values = best.fit.solution[0].response(OMEGA[OMEGA > 12.0])
    assert np.abs(values / true[OMEGA > 12.0] - 1.0).max() < 0.1, "above, it is the aircraft"
    assert any("what a loop makes of gusts" in text for text in best.fit.warnings)
    study = sp.fit_tf(seen, input="stick")
    assert study.fit is not None
    assert study.fit.targets[0].omega[0] == pytest.approx(2.0 * np.pi * best.fit.settings[BAND][0], rel=0.03)


def test_a_delay_that_is_zero_is_left_out_of_a_form() -> None:
    at_once = TransferFunction(Form(1, 2), {**SECOND.values, "tau": 0.0}, "rate", "stick")
    best, _ = suggest(exact(at_once, noise=0.005), input="stick", forms=[Form(0, 1), Form(1, 2)])
    assert best.form == Form(1, 2, delay=False)
    assert best.unsound == ""


@pytest.mark.parametrize("text", ["2/1", "1/1", "3/4"])
def test_zeros_and_lead_lags_of_any_order(text: str) -> None:
    form = Form.parse(text)
    values = {"K": 2.0, "tau": 0.03, "zeta_zero": 0.4, "omega_zero": 5.0, "zero": 12.0, "pole": 1.5}
    values |= {"zeta_pole1": 0.3, "omega_pole1": 9.0, "zeta_pole2": 1.3, "omega_pole2": 4.0}
    true = TransferFunction(form, {name: values[name] for name in form.names}, "rate", "stick")
    fit = fit_transfer_function(exact(true, noise=0.002), form, input="stick")
    assert fit.cost < 0.1
    found, known = np.sort_complex(fit.solution[0].zeros), np.sort_complex(true.zeros)
    np.testing.assert_allclose(found, known, rtol=0.1)
    if text == "2/1":
        with pytest.raises(IdentificationError, match="cannot be flown"):
            as_state_space(fit)


def test_gain_and_delay_of_the_paper() -> None:
    """Bhandari et al. (2005), eq. 15: Q/B1 = 17 e^(-0.0020 s)."""
    true = TransferFunction(Form(0, 0), {"K": 17.0, "tau": 0.002}, "rate", "stick")
    fit = fit_transfer_function(exact(true), "0/0", input="stick")
    assert fit.solution[0].values["K"] == pytest.approx(17.0, rel=1e-6)
    assert fit.solution[0].values["tau"] == pytest.approx(0.002, rel=1e-3)


def test_bias_of_the_gain_and_delay_is_solved_for_in_time() -> None:
    """The third number of Bhandari et al.'s Tables 3 and 4: what the gain and delay leave over is a constant."""
    fit = fit_transfer_function(
        exact(TransferFunction(Form(0, 0), {"K": 17.0, "tau": 0.02}, "rate", "stick")), "0/0", input="stick"
    )
    stick = 0.01 * np.cumsum(np.random.default_rng(0).standard_normal(500))
    rate = 17.0 * np.concatenate([stick[:1], stick[:1], stick[:-2]]) + 0.5
    columns = {"stick": stick, "rate": rate}
    found = verify(as_state_space(fit), Flight({"uniform": stream(np.arange(500) * 0.01, columns)}))
    assert found["rate"].fit > 99.0
    # The model moves with the stick's deviations from its mean.
    assert found.traces[0].biases["rate"] == pytest.approx(0.5 + 17.0 * stick.mean(), abs=0.02)


def test_cost_is_the_one_the_optimizer_minimises() -> None:
    wanted = target(exact(SECOND), "rate", "stick")
    assert wanted is not None

    def evaluate(numbers: np.ndarray) -> tuple[list, list]:
        model = TransferFunction(SECOND.form, {**SECOND.values, "K": float(numbers[0])})
        h, slopes = model.with_slopes(wanted.omega)
        return [h], [slopes["K"][:, None]]

    cost = ResponseCost(Row((Entry("K", "parameter", -5.0, 2.0),)), [wanted], evaluate)
    row = np.array([-2.5])
    value, gradient, _ = cost.scores(row)
    assert value == pytest.approx(cost.cost(row))
    step = 1e-5
    assert gradient[0] == pytest.approx((cost.cost(row + step) - cost.cost(row - step)) / (2 * step), rel=1e-6)


def test_phase_delay_of_an_integrator_with_delay_is_half_the_delay() -> None:
    tau = 0.08
    omega = np.geomspace(0.5, 200.0, 2000)
    found = handling_qualities(omega, 3.0 * np.exp(-1j * omega * tau) / (1j * omega))
    assert found.phase_delay.value == pytest.approx(tau / 2, rel=2e-3)
    assert found.phase_delay_line.value == pytest.approx(tau / 2, rel=2e-3)
    assert found.omega_180.value == pytest.approx(np.pi / 2 / tau, rel=1e-3)
    assert found.bandwidth_phase.value == pytest.approx(np.pi / 4 / tau, rel=1e-3)
    assert found.bandwidth_gain.value == pytest.approx(np.pi / 2 / tau / 10**0.3, rel=1e-3)
    assert found.bandwidth.value == min(found.bandwidth_phase.value, found.bandwidth_gain.value)


def test_margins_are_those_of_python_control() -> None:
    import control

    loop = control.tf([40.0], [1.0, 6.0, 10.0, 0.0])
    gm, pm, w180, cross = control.margin(loop)
    omega = np.geomspace(0.1, 50.0, 3000)
    found = margins(omega, loop(1j * omega), error=np.full(omega.size, 0.05))
    assert found.gain_margin.value == pytest.approx(20 * np.log10(gm), abs=0.01)
    assert found.phase_margin.value == pytest.approx(pm, abs=0.05)
    assert found.omega_180.value == pytest.approx(w180, rel=1e-3)
    assert found.crossover.value == pytest.approx(cross, rel=1e-3)
    assert found.phase_margin.sigma > np.degrees(0.05)  # the crossing moves too: see test_readings.py


def test_reading_refuses_what_is_not_there() -> None:
    responses = exact(SECOND)
    omega, attitude, error, coherence = attitude_of(responses, "rate", "stick")
    found = handling_qualities(omega, -attitude, error=error, coherence=coherence)
    assert found.bandwidth.sigma > 0.0
    with pytest.raises(IdentificationError, match="does not fall through -180"):
        handling_qualities(omega[:20], -attitude[:20])


def test_transfer_functions_are_reported_validated_and_come_back_from_their_file(tmp_path: Path) -> None:
    fit = fit_transfer_function(exact(SECOND, noise=0.05), "1/2", input="stick", fixed={"tau": 0.04})
    page = sp.report(fit, path=tmp_path / "report.html").read_text(encoding="utf-8")
    assert "omega_pole" in page
    again = sp.load(fit.save(tmp_path / "fit.json"))
    assert repr(again) == repr(fit)
    assert again.solution == fit.solution
    assert again["tau"].fixed
    random = np.random.default_rng(1)
    stick = np.repeat(random.standard_normal(100), 10)
    time = np.arange(stick.size) * 0.02
    flown = Flight({"uniform": stream(time, {"stick": stick, "rate": 0.0 * stick}, {"stick": "1", "rate": "rad/s"})})
    poor = sp.validate(fit, flown)
    assert not poor.good
    trace = poor.traces[0]
    flown = Flight(
        {"uniform": stream(trace.time, {"stick": stick, "rate": trace.model[:, 0]}, {"stick": "1", "rate": "rad/s"})}
    )
    assert sp.validate(again, flown)["rate"].theil < 1e-3
