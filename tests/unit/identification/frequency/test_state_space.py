"""State-space models: files, responses, derivatives, fits, reduction, start values and the flight along a record."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import swashplate as sp
from swashplate.arrays import Array
from swashplate.errors import CardError, FlightError, IdentificationError
from swashplate.flights.flight import Flight, stream
from swashplate.identification.core.result import Estimate, percent
from swashplate.identification.frequency.start_values import at_flown_trim, from_linear_model, from_models
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.identification.frequency.state_space_result import fit_warnings
from swashplate.identification.frequency.transfer_function_fit import as_state_space, fit_transfer_function
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.time.linearised_model import model_of
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse, structure, structure_names, to_toml
from swashplate.simulation.discretisation import first_order_hold
from swashplate.validation import structure_reduction
from swashplate.validation.structure_reduction import moved_modes, reduce
from swashplate.validation.verify import verify

OMEGA = 2 * np.pi * np.geomspace(0.1, 12.0, 80)

ROTOR = {
    "Lb": 3588.6, "Ma": 617.5, "tau_f": 0.0682, "Ba": 1.2963, "Ab": -1.3402, "Blat": 0.2449, "Blon": -0.0849,
    "Alat": 0.0729, "Alon": 0.2696, "tau_roll": 0.05, "tau_pitch": 0.05,
}  # fmt: skip


def exact(model: StateSpaceModel, *, noise: float = 0.0, coherence: float = 0.9, seed: int = 0) -> FrequencyResponse:
    h = model.response(OMEGA)
    random = np.random.default_rng(seed)
    h = h * np.exp(noise * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)))
    n_f, n_out, n_in = h.shape
    return FrequencyResponse(
        omega=OMEGA,
        inputs=model.inputs,
        outputs=model.outputs,
        response=h,
        coherence=np.full(h.shape, coherence),
        multiple=np.full((n_f, n_out), coherence),
        error=np.full(h.shape, 0.02),
        input_power=np.ones((n_f, n_in)),
        output_power=np.ones((n_f, n_out)),
        input_coherence=np.ones((n_f, n_in, n_in)),
    )


def rotor() -> StateSpaceModel:
    return structure("rotor_body").with_values(ROTOR)


@pytest.mark.parametrize("name", structure_names())
def test_ready_structures_are_whole_and_round_trip(name: str) -> None:
    model = structure(name)
    again = parse(to_toml(model))
    assert again.numbers() == model.numbers()
    np.testing.assert_array_equal(again.response(OMEGA[:5]), model.response(OMEGA[:5]))
    assert model.trust
    assert np.all(np.isfinite(model.response(OMEGA)))


def test_response_is_that_of_python_control() -> None:
    model = rotor()
    expected = np.moveaxis(model.to_control(pade=0)(1j * OMEGA), -1, 0) * np.exp(-1j * OMEGA * 0.05)[:, None, None]
    np.testing.assert_allclose(model.response(OMEGA), expected, rtol=1e-9)


def test_derivatives_are_exact() -> None:
    """Every matrix, ties, delays and a sensor away from the centre of gravity, against central differences."""
    text = to_toml(structure("thirteen_state")).replace(
        'specific_force = "y"', 'specific_force = "y"\nat = ["xs", 0, "zs"]'
    )
    text += "\n[parameters.xs]\nvalue = 0.3\n[parameters.zs]\nvalue = -0.1\n"
    model = parse(text)
    pairs = [(o, i, OMEGA[::20]) for o in range(len(model.outputs)) for i in range(len(model.inputs))]
    free = model.free
    numbers = np.array([model.parameters[n].value or 0.1 for n in free])
    _, slopes = model.sensitivities(free, numbers, pairs)
    for k in range(len(free)):
        step = 1e-4 * abs(numbers[k])
        change = step * (np.arange(len(free)) == k)
        moved = (model.with_values(dict(zip(free, numbers + sign * change, strict=True))) for sign in (1, -1))
        up, down = (one.sensitivities((), np.zeros(0), pairs)[0] for one in moved)
        for slope, high, low in zip(slopes, up, down, strict=True):
            expected = (high - low) / (2 * step)
            size = 2e-6 * (np.abs(expected).max() + np.abs(high).max() / abs(numbers[k]))
            np.testing.assert_allclose(slope[:, k], expected, atol=size)


def test_an_output_without_a_unit_has_its_states_or_the_schemas() -> None:
    """Without one an angle would be judged in radians, and hardly any model would be bad."""
    text = """
    kind = "state-space"
    name = "short period"
    [states]
    alpha = "rad"
    [inputs]
    elevator = "rad"
    [equations]
    alpha = {alpha = "-1", elevator = "1"}
    [outputs.alpha]
    of = {alpha = "1"}
    [outputs.az]
    of = {alpha = "-60"}
    [outputs.load]
    of = {alpha = "6"}
    [parameters]
    """
    model = parse(text)
    assert {name: model.units[name] for name in model.outputs} == {"alpha": "rad", "az": "m/s^2", "load": ""}


def test_accelerometer_away_from_the_centre_of_gravity() -> None:
    """ay = vdot - g phi + x_s rdot - z_s pdot (hover)."""
    plain = structure("six_dof")
    text = to_toml(plain).replace('specific_force = "y"', 'specific_force = "y"\nat = ["0.3", 0, "-0.2"]')
    moved = parse(text)
    a, _, c, _ = moved.explicit()
    p, r = (moved.states.index(n) for n in "pr")
    row = moved.outputs.index("ay")
    np.testing.assert_allclose(c[row] - plain.explicit()[2][row], 0.3 * a[r] + 0.2 * a[p], atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('w = "Zw"', 'w = "Zww"', r"equations.w.w: uses 'Zww', which is no parameter of this model. Did you mean 'Zw'"),
        ('w = "Zw"', 'w = "Zw.__class__"', "is not an expression"),
        ('w = "Zw"', 'ww = "Zw"', r"'ww' is no state or input of this model. Did you mean 'w'"),
        ('w = "Zw"', 'w = "Zw / (Zcol - Zcol)"', "divides by zero"),
        ('specific_force = "z"', 'specific_force = "down"', "expected 'x', 'y' or 'z'"),
        ('mixer_collective = "tau_collective"', 'stick = "tau_collective"', "is no input"),
        ("kind", "knid", "kind is None"),
        ("[parameters]", "[parameters]\nZx = {value = 1.0}", "Zx: stands in no equation"),
        ("value = -1.0", "value = 'one'", "value is 'one', expected a number"),
        ("value = -1.0", "tie = 'Zcol * Zw'", "ties run in a circle"),
        ('w = "m/s"', 'w = "m/s', "is not TOML"),
    ],
)  # fmt: skip
def test_bad_files_are_named(old: str, new: str, words: str) -> None:
    text = to_toml(structure("heave"))
    text = (
        text.replace("[parameters.", "[parameters.")
        if old != "[parameters]"
        else text + "\n[parameters.Zx]\nvalue = 1.0\n"
    )
    source = text if old == "[parameters]" else _heave().replace(old, new, 1)
    with pytest.raises(CardError, match=words):
        parse(source, path="heave.toml")


def _heave() -> str:
    from importlib import resources

    return (resources.files("swashplate.models.linear") / "structures" / "heave.toml").read_text(encoding="utf-8")


def test_fit_finds_the_truth_and_comes_back_from_its_file(tmp_path: Path) -> None:
    fit = fit_state_space(structure("rotor_body"), exact(rotor()))
    assert fit.cost < 0.05  # the points are interpolated between lines
    for name, value in ROTOR.items():
        assert fit.solution.parameters[name].value == pytest.approx(value, rel=0.02), name
    assert not fit.problems
    assert all(p.sigma >= p.insensitivity > 0.0 for p in fit.estimates)
    assert "J_ave" in repr(fit)
    again = sp.load(fit.save(tmp_path / "fit.json"))
    assert repr(again) == repr(fit)
    assert again.costs == fit.costs
    assert to_toml(again.solution) == to_toml(fit.solution)
    np.testing.assert_array_equal(again.comparisons[0].residuals, fit.comparisons[0].residuals)
    assert again.details.modes == fit.details.modes
    page = sp.report(again, exact(rotor()), path=tmp_path / "report.html").read_text(encoding="utf-8")
    assert "J_ave" in page
    drawn = again.draw_values(500, seed=1)
    assert np.std(drawn["tau_f"]) == pytest.approx(fit["tau_f"].sigma, rel=0.15)
    one_kind = again.draw_values(500, seed=1, corrected=False)
    np.testing.assert_array_equal(one_kind["tau_f"], drawn["tau_f"])
    assert not fit.failed
    assert fit.model.structure == fit.solution
    same = sp.identify(structure("rotor_body"), exact(rotor()))
    assert [e.value for e in same.estimates] == [e.value for e in fit.estimates]


def test_a_model_that_follows_no_response_has_failed() -> None:
    """A wrong sign of the only input, held: J stays far above all use."""
    true = structure("heave").with_values({"Zw": -2.0, "Zcol": -27.0, "tau_collective": 0.05})
    wrong = true.with_values({"Zcol": 27.0}, free=False)
    fit = fit_state_space(wrong, _at_points(true, noise=0.0, seed=1), starts=1)
    assert fit.failed
    assert "follows no response" in fit.problems[-1]
    with pytest.raises(IdentificationError, match="has failed"):
        fit.draw_values(3, seed=1)


@pytest.mark.parametrize("noise", [0.02, 0.03, 0.09])
def test_the_bound_is_what_noise_scatters_however_large_it_is(noise: float) -> None:
    """White errors on points of their own; the responses say 0.03, and what a fit leaves says what they are."""
    true = structure("heave").with_values({"Zw": -2.0, "Zcol": -27.0, "tau_collective": 0.05})
    found, bounds = [], []
    for seed in range(60):
        fit = fit_state_space(true, _at_points(true, noise=noise, seed=seed), starts=1)
        found.append([fit.solution.parameters[n].value for n in fit.names])
        bounds.append([fit.solution.parameters[n].cramer_rao for n in fit.names])
    ratio = np.std(found, axis=0) / np.mean(bounds, axis=0)
    assert np.all((ratio > 0.75) & (ratio < 1.3)), ratio


def _at_points(model: StateSpaceModel, *, noise: float, seed: int) -> FrequencyResponse:
    """Responses at just the 20 lines that the cost uses: no interpolation smooths the noise."""
    omega = np.geomspace(OMEGA[0], OMEGA[-1], 20)
    random = np.random.default_rng(seed)
    h = model.response(omega)
    h = h * np.exp(noise * (random.standard_normal(h.shape) + 1j * random.standard_normal(h.shape)))
    one = np.ones(h.shape)
    return FrequencyResponse(
        omega,
        model.inputs,
        model.outputs,
        h,
        one,
        one[:, :, 0],
        0.03 * one,
        one[:, 0],
        one[:, :, 0],
        one[:, :, :1] * one,
    )


def with_dampings() -> StateSpaceModel:
    """The rotor-body model with two parameters that the truth lacks."""
    text = to_toml(rotor())
    text = text.replace('b = "Lb"', 'b = "Lb"\np = "Lp"').replace('a = "Ma"', 'a = "Ma"\nq = "Mq"')
    return parse(text + "\n[parameters.Lp]\nvalue = -0.5\n[parameters.Mq]\nvalue = -0.3\n")


def test_reduction_takes_out_what_is_not_there_and_keeps_what_is() -> None:
    fit = fit_state_space(with_dampings(), exact(rotor(), noise=0.02))
    smaller = reduce(fit)
    dropped = {step.dropped for step in smaller.details.reduction if step.kept}
    assert {"Lp", "Mq"} <= dropped
    assert not dropped & {"Lb", "Ma", "tau_f", "tau_roll"}
    assert smaller.solution.parameters["Lp"].value == 0.0
    assert smaller.cost < fit.cost * 1.05 + 0.5 + 0.5
    assert any("without a hold-out" in text for text in smaller.warnings)
    done = reduce(replace(smaller, details=replace(smaller.details, reduction=())))
    assert "nothing to take out" in repr(done)
    assert "nothing to take out" not in repr(smaller)


@pytest.mark.parametrize(
    ("cost", "verdict", "veto"),
    [(1.04, "not refuted", ""), (1.06, "not refuted", "J_rms grows"), (1.0, "refuted", "refutes it")],
)
def test_a_hold_out_vetoes_what_it_does_not_bear(
    monkeypatch: pytest.MonkeyPatch, cost: float, verdict: str, veto: str
) -> None:
    fit = fit_state_space(with_dampings(), exact(rotor(), noise=0.02))
    told = iter([SimpleNamespace(cost=1.0, verdict="not refuted")])
    later = SimpleNamespace(cost=cost, verdict=verdict)
    monkeypatch.setattr(structure_reduction, "verify", lambda *_, **__: next(told, later))
    found = reduce(fit, hold_out=[Flight({})])
    assert any(step.kept for step in found.details.reduction) == (not veto)
    assert all(veto in step.veto for step in found.details.reduction if not step.kept and step.veto)
    assert not veto or any(veto in step.veto for step in found.details.reduction)


def test_the_cap_on_the_cost_is_for_all_steps_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two drops that each pass alone, and together do not."""
    fit = fit_state_space(with_dampings(), exact(rotor(), noise=0.02))
    monkeypatch.setattr(structure_reduction, "GROWTH", 0.0)
    monkeypatch.setattr(structure_reduction, "LEAST_GROWTH", 1e9)
    monkeypatch.setattr(structure_reduction, "moved_modes", lambda *_: ("", False))
    free = [step for step in reduce(fit).details.reduction if step.kept]
    assert len(free) >= 2
    first, second = (step.after - fit.cost for step in free[:2])
    assert 0.0 < first < second
    cap = max(0.5 * (first + second), second - 0.5 * first)
    monkeypatch.setattr(structure_reduction, "LEAST_GROWTH", cap)
    capped = reduce(fit)
    kept = [step.dropped for step in capped.details.reduction if step.kept]
    assert kept[0] == free[0].dropped
    assert free[1].dropped not in kept
    assert capped.cost <= fit.cost + cap


def test_a_mode_that_goes_or_moves_beyond_its_bounds_vetoes_a_drop() -> None:
    fit = fit_state_space(rotor(), exact(rotor(), noise=0.02))
    values = fit.solution.eigenvalues()
    assert not moved_modes(fit.details.modes, values)[1]
    first = min(fit.details.modes, key=lambda mode: mode.frequency)
    apart = 4.0 * np.hypot(first.frequency_bound, first.frequency * first.damping_bound) / first.frequency
    words, lost = moved_modes(fit.details.modes, values * (1.0 + apart))
    assert lost
    assert "beyond its bounds" in words
    assert moved_modes(fit.details.modes, values[:2])[1]


def test_a_mode_that_is_hardly_told_may_still_not_go_elsewhere() -> None:
    fit = fit_state_space(rotor(), exact(rotor(), noise=0.02))
    vague = [replace(mode, frequency_bound=0.25 * mode.frequency) for mode in fit.details.modes]
    values = fit.solution.eigenvalues()
    words, lost = moved_modes(vague, values)
    assert (words, lost) == (f"modes: {len(vague)} within 1 %", False)
    assert not moved_modes(vague, 1.2 * values)[1], "within its bounds"
    assert moved_modes(vague, 1.5 * values)[1], "two bounds, and half its frequency"


def test_a_reduction_drops_nothing_to_a_value_outside_its_bounds_and_sums_up() -> None:
    """A lead-lag that is not there: its rate cannot be zero, its gain can."""
    model = structure("compose:heave+lead").with_values({"Zlag": 0.0, "Zw": -0.8, "Zcol": -12.0})
    started = model.with_values({"Zlag": 0.5, "rate_lag": 3.0})
    fit = reduce(fit_state_space(started, exact(model, noise=0.01), starts=1))
    dropped = {step.dropped: step for step in fit.details.reduction if step.kept}
    assert "Zlag" in dropped
    assert fit.solution.parameters["rate_lag"].value >= 0.1
    assert not any(s.dropped == "rate_lag" and s.reason.endswith("%") and s.kept for s in fit.details.reduction)
    (total,) = (line for line in repr(fit).splitlines() if "taken out in all" in line)
    assert "Zlag" in total


def test_a_structure_that_answers_nothing_where_the_flight_does_is_named() -> None:
    cyclic = structure("compose:cyclic+flap").with_values({"Ab": -0.4, "Ba": 0.3})
    with pytest.raises(IdentificationError, match="answers nothing at all at p / longitudinal, q / lateral"):
        fit_state_space(structure("compose:cyclic+flap_decoupled"), exact(cyclic))


def test_what_no_response_sees_is_held_and_named() -> None:
    model = structure("rotor_body").with_values(ROTOR)
    responses = exact(model).select(("p", "q"), ("mixer_roll",))
    fit = fit_state_space(model, responses)
    assert any("tau_pitch" in text and "held" in text for text in fit.warnings)
    assert fit["tau_pitch"].fixed


def test_unusable_questions_are_refused() -> None:
    model = rotor()
    with pytest.raises(IdentificationError, match="share nothing to fit"):
        fit_state_space(structure("heave"), exact(model))
    with pytest.raises(IdentificationError, match="no response keeps a coherence"):
        fit_state_space(model, exact(model, coherence=0.3))
    wrong = model.with_values({"tau_f": 0.02})
    flipped = replace(
        wrong, parameters={**wrong.parameters, "Lb": replace(wrong.parameters["Lb"], value=-3000.0, lower=-1e9)}
    )
    assert any(
        "is unstable" in text for text in fit_state_space(flipped, exact(model), starts=1, iterations=3).problems
    )
    with pytest.raises(CardError, match="is no parameter"):
        model.with_values({"Lbb": 1.0})


def test_start_values_from_models() -> None:
    true = structure("heave").with_values({"Zw": -2.0, "Zcol": -27.0, "tau_collective": 0.05})
    responses = exact(true)
    fit = fit_transfer_function(responses, "0/1-1s", input="mixer_collective")
    start = from_models(structure("heave"), [as_state_space(fit)], responses)
    for name in ("Zw", "Zcol", "tau_collective"):
        assert start.parameters[name].value == pytest.approx(true.parameters[name].value, rel=0.02)


def test_start_values_from_the_coax() -> None:

    linear = sp.linearize(sp.vehicle("coax"))
    model = from_linear_model(structure("coaxial"), linear)
    a, b, _, _ = model.explicit()
    keep = [linear.states.index(s) for s in model.states]
    cols = [linear.inputs.index(i) for i in model.inputs]
    np.testing.assert_allclose(a, linear.A[np.ix_(keep, keep)], atol=1e-3 * np.abs(linear.A).max())
    np.testing.assert_allclose(b, linear.B[np.ix_(keep, cols)], atol=1e-9 * np.abs(linear.B).max())
    # The vehicle as a model of its own: python-control answers alike, without place and heading.
    whole, omega = model_of(linear, name="coax"), np.array([0.5, 5.0, 20.0])
    theirs = linear.to_control()(1j * omega)[[linear.states.index(s) for s in whole.outputs]]
    np.testing.assert_allclose(whole.response(omega).transpose(1, 2, 0), theirs, rtol=1e-6, atol=1e-9)
    assert {"x", "y", "z", "psi"}.isdisjoint(whole.states)


def test_first_order_hold_is_exact_for_a_ramp() -> None:
    phi, q0, q1 = first_order_hold(np.array([[-2.0]]), np.array([[3.0]]), 0.1)
    # xdot = -2 x + 3 t from rest: x = 3 (t/2 - 1/4 + e^(-2t)/4)
    x = phi @ [0.0] + q0 @ [0.0] + q1 @ [0.1]
    assert x[0] == pytest.approx(3 * (0.05 - 0.25 + np.exp(-0.2) / 4), rel=1e-9)


def test_verification_solves_for_biases_and_judges_the_rest() -> None:
    model, random = rotor(), np.random.default_rng(1)
    dt, n = 0.005, 4_000
    u = np.cumsum(random.standard_normal((n, 2)), axis=0)
    u = 0.05 * (u - u.mean(axis=0)) / u.std(axis=0)
    a, b, c, _ = model.explicit()
    phi, q0, q1 = first_order_hold(a, b, dt)
    late = np.vstack([np.repeat(u[:1], 10, axis=0), u[:-10]])  # 50 ms
    x, y = np.zeros((n, 4)), np.zeros((n, 2))
    for k in range(1, n):
        x[k] = phi @ x[k - 1] + q0 @ late[k - 1] + q1 @ (late[k] - late[k - 1])
    y = x @ c.T + np.array([0.2, -0.1])
    columns = {"mixer_roll": u[:, 0] + 0.3, "mixer_pitch": u[:, 1], "p": y[:, 0], "q": y[:, 1]}
    flight = Flight({"uniform": stream(np.arange(n) * dt, columns)})
    found = verify(model, flight)
    assert found.cost < 1e-3
    assert found.good
    worse = verify(model.with_values({"Ma": 900.0}), flight)
    assert worse["q"].theil > 0.02 > 10.0 * found["q"].theil
    assert "J_rms" in repr(worse)
    with pytest.raises(FlightError, match="share no output"):
        verify(structure("heave"), flight)


def test_parameters_that_are_told_only_together_are_named() -> None:
    def one(name: str, bound: float) -> Estimate:
        return Estimate(name, "", 1.0, 1.0, sigma=bound, insensitivity=0.02)

    correlation = np.array([[1.0, 0.2, 0.999], [0.2, 1.0, 0.2], [0.999, 0.2, 1.0]])
    found = fit_warnings(
        [], [], [one("Nrfb", 30.0), one("Nr", 0.1), one("Kr", 30.0)], correlation, at_bound=(), converged=True
    )
    assert any("told only together" in text and "Nrfb and Kr. Hold one" in text for text in found), found
    told = fit_warnings(
        [], [], [one("Nrfb", 0.1), one("Nr", 0.1), one("Kr", 0.1)], correlation, at_bound=(), converged=True
    )
    assert told == []
    assert percent(29120.5) == "   >9999"


def test_accelerometer_in_forward_flight_is_that_of_the_full_equations() -> None:
    """a = dV/dt + omega x V - R'g with all products, differenced about a trim of small angles."""
    trim = {"u": 15.0, "v": -0.7, "w": 1.2, "phi": 0.02, "theta": -0.03}
    names = {"u": "U0", "v": "V0", "w": "W0", "phi": "phi0", "theta": "theta0"}
    base = structure("six_dof_coupled").with_values({names[s]: v for s, v in trim.items()})
    random = np.random.default_rng(2)
    model = base.with_values({n: float(random.uniform(-1.0, 1.0)) for n in base.free if not n.startswith("tau")})
    a, b, c, d = model.explicit()
    at = {name: model.states.index(name) for name in model.states}
    start = np.zeros(len(model.states))
    for name, value in trim.items():
        start[at[name]] = value
    gravity = model.parameters["g"].value

    def felt(deviation: Array, inputs: Array) -> Array:
        x = start + deviation
        speed, turn = x[[at["u"], at["v"], at["w"]]], x[[at["p"], at["q"], at["r"]]]
        phi, theta = x[at["phi"]], x[at["theta"]]
        down = np.array([-np.sin(theta), np.sin(phi) * np.cos(theta), np.cos(phi) * np.cos(theta)])
        return (a @ deviation + b @ inputs)[[at["u"], at["v"], at["w"]]] + np.cross(turn, speed) - gravity * down

    rows = [model.outputs.index(name) for name in ("ax", "ay", "az")]
    step, none = 1e-6, np.zeros(4)
    for k in range(len(model.states)):
        change = step * np.eye(len(model.states))[k]
        slope = (felt(change, none) - felt(-change, none)) / (2.0 * step)
        np.testing.assert_allclose(c[rows, k], slope, atol=2.0 * gravity * 0.03**2, rtol=1e-7)
    np.testing.assert_allclose(d[rows], b[[at["u"], at["v"], at["w"]]])


def test_the_trim_comes_from_the_flights_unless_it_is_given() -> None:
    model = structure("hybrid")
    responses = replace(exact(model), settings={"means": {"u": 14.0, "theta": -0.05, "p": 0.1}})
    found = at_flown_trim(model, responses)
    assert {n: found.parameters[n].value for n in ("U0", "theta0", "W0")} == {"U0": 14.0, "theta0": -0.05, "W0": 0.0}
    given = at_flown_trim(model.with_values({"U0": 10.0}), responses)
    assert given.parameters["U0"].value == 10.0
    with pytest.raises(CardError, match=r"trim\.gamma"):
        parse(to_toml(model).replace("[trim]", '[trim]\ngamma = "U0"'))
