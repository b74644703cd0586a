"""The filter: the equations' own steps, slopes of its own runs, and the same numbers with and without a compiler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import own_package
import pytest

import swashplate as sp
from swashplate.arrays import Array
from swashplate.compiled import can_compile
from swashplate.errors import ExportError
from swashplate.filtering import filter_library as libraries
from swashplate.filtering.disturbances import Noise
from swashplate.filtering.disturbed_model import StochasticModel, stochastic_model
from swashplate.filtering.filter_code import driving_rows
from swashplate.identification.core.multi_step import Ahead
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import POSE, Record
from swashplate.identification.time.beginning import FilterNumbers
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.innovations import Filtered
from swashplate.identification.time.record_filter import record_filter
from swashplate.models.surroundings import environment_of
from swashplate.models.vehicle import Vehicle
from swashplate.physics.backend import FloatBackend

pytestmark = pytest.mark.skipif(not can_compile(), reason="there is no C compiler, or the extra 'model' is missing")

_FREE = {
    "coax": ["linkage_lower", "tau_f_upper", "inertia_zz"],
    "ducted_fan": ["k_vane", "drag", "fan_time"],
    "xcell60": ["mass", "bar_gain"],
    "x8": ["mass"],
}
_EVERYTHING = Noise(wind=0.5)


def _record(vehicle: Vehicle, n: int = 250) -> Record:
    """What something that wanders about shows, under commands that wander about the middle."""
    rng, time = np.random.default_rng(3), np.arange(n) * 0.01
    outputs = np.cumsum(rng.standard_normal((n, 6)) * [0.003, 0.003, 0.003, 0.004, 0.004, 0.006], axis=0)
    middle = np.array([0.5 * (low + high) for low, high in vehicle.input_limits])
    inputs = middle + 0.01 * np.cumsum(rng.standard_normal((n, len(middle))), axis=0)
    return Record("wandering", time, inputs, outputs, 12.0 + 0.1 * np.sin(time), POSE, voltage_known=True)


@lru_cache(maxsize=8)
def _vehicle(name: str) -> Vehicle:
    """A ready one, or the example of a user's own equations, which are short and so soon compiled."""
    if name != "ducted_fan":
        return sp.vehicle(name)
    with TemporaryDirectory() as folder, own_package.installed(name, Path(folder)):
        return sp.vehicle(name)


@lru_cache(maxsize=8)
def _likelihood(name: str, noise: Noise | None = None) -> FilterError:
    vehicle = _vehicle(name)
    return FilterError(parameterize(vehicle, _FREE[name]), [_record(vehicle)], noise=noise)


def _somewhere(likelihood: FilterError) -> Array:
    return likelihood.row.starts() + 0.02 * np.random.default_rng(1).standard_normal(len(likelihood.row))


def _stepped(rates: Callable[[Array, Array], Array], x: Array, u: Array, dt: float = 0.01) -> Array:
    k1 = rates(x, u)
    k2 = rates(x + 0.5 * dt * k1, u)
    k3 = rates(x + 0.5 * dt * k2, u)
    k4 = rates(x + dt * k3, u)
    return np.asarray(x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))


@pytest.mark.parametrize("name", ["coax", "xcell60", "x8"])
def test_steps_are_those_of_the_equations(name: str) -> None:
    vehicle = sp.vehicle(name)
    model = stochastic_model(vehicle, POSE, 0.01, noise=Noise(wind=0.3))
    likelihood = _likelihood(name)
    run = likelihood.runs(_somewhere(likelihood))[0]
    gust = np.array([0.3, -0.2, 0.1, 1.0, -2.0, 0.5, 0.4, -0.3])
    states = run.states._replace(gust=np.tile(gust, (len(run.states.x), 1)))
    commands, voltage = run.commands, likelihood.records[0].voltage
    noise = np.array(Noise(wind=0.3), dtype=np.float64)
    numbers = FilterNumbers(run.numbers.parameters, noise, run.numbers.nuisance, run.numbers.inputs)
    starts, driving = np.array([100, 170]), driving_rows(commands, voltage)
    found = record_filter(model).ahead_of(states.at(starts), numbers, driving, starts, 2)
    parameters, push = vehicle.parameters(*run.numbers.parameters.tolist()), np.zeros(len(vehicle.state_names))
    around = environment_of(vehicle, parameters=parameters)
    for start, predicted in zip((100, 170), found, strict=True):
        x, faded = states.x[start], gust
        for k in range(2):
            acting = faded + np.concatenate([states.drift[start], [0.0, 0.0]])
            push[model.disturbed] = acting[:6]
            here = around._replace(wind_north=acting[6], wind_east=acting[7], wind_down=0.0, voltage=voltage[start + k])

            def rates(x: Array, u: Array, here: object = here, push: Array = push) -> Array:
                return np.array(vehicle.rates(x, u, parameters, here, FloatBackend())) + push

            x = _stepped(rates, x, commands[start + k])
            faded = faded * np.asarray(model.fade(Noise(wind=0.3)))
            np.testing.assert_allclose(predicted[k], x, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize(("name", "noise"), [("coax", _EVERYTHING), ("xcell60", None), ("x8", None)])
def test_slopes_in_c_are_those_of_its_own_runs(name: str, noise: Noise | None) -> None:
    likelihood = _likelihood(name, noise)
    row = _somewhere(likelihood)
    _, found, _ = likelihood.scores(row)
    way = np.random.default_rng(2).standard_normal(len(row))
    step = 1e-5 * way
    costs = [likelihood.cost(row + factor * step) for factor in (1.0, -1.0, 2.0, -2.0)]
    slope = (8.0 * (costs[0] - costs[1]) - (costs[2] - costs[3])) / 12e-5
    assert found @ way == pytest.approx(slope, rel=1e-6)
    assert likelihood.compiled_by == "C"


AHEAD = Ahead(((160, 170, 200),), (5, 10, 30))


def test_slopes_of_errors_ahead_are_those_of_the_errors() -> None:
    likelihood = _likelihood("coax")
    row, places = _somewhere(likelihood), np.flatnonzero([e.group != "noise" for e in likelihood.row.entries])
    (errors,), (slopes,) = likelihood.errors_ahead_moved(row, AHEAD, places)
    np.testing.assert_allclose(errors, likelihood.errors_ahead(row, AHEAD)[0], rtol=0.0, atol=1e-13)  # of another loop
    assert errors.dtype == slopes.dtype == np.float64
    for place, found in zip(places, slopes, strict=True):
        step = 1e-4 * np.eye(len(row))[place]
        around = [likelihood.errors_ahead(row + factor * step, AHEAD)[0] for factor in (1.0, -1.0, 2.0, -2.0)]
        slope = (8.0 * (around[0] - around[1]) - (around[2] - around[3])) / 12e-4
        np.testing.assert_allclose(found, slope, atol=1e-7 * max(1.0, np.abs(slope).max()))


@pytest.mark.parametrize(
    ("name", "noise"),
    [
        ("ducted_fan", None),
        ("coax", None),
        ("coax", _EVERYTHING),
        pytest.param("xcell60", None, marks=pytest.mark.proof),
    ],
)
def test_without_a_compiler_the_numbers_are_the_same(
    name: str, noise: Noise | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_c = _likelihood(name, noise)
    assert in_c.compiled_by == "C"
    row = _somewhere(in_c)
    places = np.arange(len(_FREE[name]) + 2)
    ours, (run,), ahead = in_c.scores(row), in_c.runs(row), in_c.errors_ahead_moved(row, AHEAD, places)
    kicked = _kicked(in_c, run)
    monkeypatch.setattr(libraries, "can_compile", lambda: False)
    _forget()
    try:
        by_numpy = FilterError(in_c.table, in_c.records, noise=in_c.noise)
        theirs, (other,) = by_numpy.scores(row), by_numpy.runs(row)
        further = by_numpy.errors_ahead_moved(row, AHEAD, places)
        np.testing.assert_allclose(kicked, _kicked(by_numpy, run), rtol=1e-10, atol=1e-10)
        assert by_numpy.compiled_by == "NumPy"
    finally:
        _forget()
    np.testing.assert_allclose(run.innovations, other.innovations, atol=1e-11 * np.abs(other.innovations).max())
    for mine, exact in zip((*ours, *ahead[0], *ahead[1]), (*theirs, *further[0], *further[1]), strict=True):
        np.testing.assert_allclose(mine, exact, rtol=1e-10, atol=1e-11 * np.max(np.abs(exact)))


def _kicked(likelihood: FilterError, run: Filtered) -> Array:
    """Predictions whose joined states are kicked at every sample."""
    starts, driving = np.array([100, 170]), driving_rows(run.commands, likelihood.records[0].voltage)
    joined = sum(part.shape[1] for part in run.states)
    kicks = 0.01 * np.random.default_rng(4).standard_normal((2, 20, joined))
    of = record_filter(likelihood.model)
    predicted = of.ahead_of(run.states.at(starts), run.numbers, driving, starts, 20, kicks)
    assert np.abs(predicted - of.ahead_of(run.states.at(starts), run.numbers, driving, starts, 20)).max() > 0.01
    return predicted


def _forget() -> None:
    libraries.filter_code.cache_clear()
    record_filter.cache_clear()


def test_equations_that_cannot_be_traced_are_refused() -> None:
    vehicle = sp.vehicle("coax")
    rates = vehicle.derivatives

    def own(state: object, inputs: object, parameters: object, environment: object, xp: FloatBackend) -> object:
        xp.arrays.ones(3)  # arrays are nothing that CasADi traces
        return rates(state, inputs, parameters, environment, xp)

    model: StochasticModel = stochastic_model(replace(vehicle, derivatives=own), POSE, 0.01)
    with pytest.raises(ExportError, match=r"trace the equations in line \d+ of test_record_filter\.py, `xp\.arrays"):
        libraries.filter_code(model)
