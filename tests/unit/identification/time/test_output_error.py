"""Output error: simulated windows, their slopes, and the same numbers with and without a compiler."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import swashplate as sp
from swashplate.arrays import Array
from swashplate.compiled import can_compile
from swashplate.filtering.filter_library import VirtualFilter
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import POSE, Record
from swashplate.identification.time import output_error, shooting
from swashplate.identification.time import record_filter as record_filters
from swashplate.identification.time.output_error import OutputError
from swashplate.identification.time.record_filter import record_filter
from swashplate.models.vehicle import Vehicle

needs_c = pytest.mark.skipif(not can_compile(), reason="there is no C compiler, or the extra 'model' is missing")

_FREE = {"coax": ["linkage_lower", "tau_f_upper", "inertia_zz"], "xcell60": ["mass", "bar_gain"], "x8": ["mass"]}


def _record(vehicle: Vehicle, n: int, seed: int) -> Record:
    """What something shows that wanders and turns about, under commands that wander about the middle."""
    rng, time = np.random.default_rng(seed), np.arange(n) * 0.01
    outputs = np.cumsum(rng.standard_normal((n, 6)) * [0.003, 0.003, 0.003, 0.004, 0.004, 0.06], axis=0)
    middle = np.array([0.5 * (low + high) for low, high in vehicle.input_limits])
    inputs = middle + 0.01 * np.cumsum(rng.standard_normal((n, len(middle))), axis=0)
    return Record(f"flight {seed}", time, inputs, outputs, 12.0 + 0.1 * np.sin(time), POSE, voltage_known=True)


def _made(name: str) -> OutputError:
    """Four windows of two flights of different lengths, each with delays and trims of its own."""
    vehicle = sp.vehicle(name)
    pieces = [_record(vehicle, 130, 3), _record(vehicle, 150, 5)]
    return OutputError(parameterize(vehicle, _FREE[name]), pieces, window=0.6)


_likelihood = lru_cache(maxsize=3)(_made)


def _somewhere(likelihood: OutputError) -> Array:
    return likelihood.row.starts() + 0.3 * np.random.default_rng(1).standard_normal(len(likelihood.row))


@needs_c
@pytest.mark.parametrize("name", ["coax", "xcell60", "x8"])
def test_slopes_in_c_are_those_of_its_own_windows(name: str) -> None:
    likelihood = _likelihood(name)
    assert likelihood.compiled_by == "C"
    assert len(likelihood.places()) == 4
    row = _somewhere(likelihood)
    white, sensitivities, _ = likelihood.whitened(row)
    rng = np.random.default_rng(2)
    for _ in range(3):
        way = rng.standard_normal(len(row)) * (rng.random(len(row)) < 0.2)  # a few entries at a time
        step = 1e-4 * way
        around = [likelihood.whitened(row + factor * step)[0] for factor in (1.0, -1.0, 2.0, -2.0)]
        for place, found in enumerate(sensitivities):
            one, back, two, far_back = (each[place] for each in around)
            slope = (8.0 * (one - back) - (two - far_back)) / 12e-4
            expected = np.tensordot(way, found, 1)
            np.testing.assert_allclose(expected, slope, atol=1e-7 * max(1.0, np.abs(slope).max()))
    assert all(np.isfinite(part).all() for part in white)


@needs_c
def test_cost_and_gradient_are_those_of_the_scores() -> None:
    likelihood = _likelihood("coax")
    row = _somewhere(likelihood)
    cost, gradient, _ = likelihood.scores(row)
    found, slope = likelihood.slope(row)
    assert found == cost == pytest.approx(likelihood.cost(row), rel=1e-14)
    np.testing.assert_array_equal(slope, gradient)


@pytest.mark.parametrize("name", ["coax", "xcell60"])
def test_a_row_with_which_it_diverges_costs_without_end_and_says_nothing(name: str) -> None:
    """Warnings are errors here."""
    likelihood = _likelihood(name)
    far = likelihood.row.starts() + 1e4 * np.random.default_rng(1).standard_normal(len(likelihood.row))
    cost, gradient, information = likelihood.scores(far)
    assert cost == likelihood.cost(far) == np.inf
    assert not np.any(gradient)
    assert not np.any(information)


@needs_c
@pytest.mark.parametrize("name", ["coax", pytest.param("xcell60", marks=pytest.mark.proof), "x8"])
def test_without_a_compiler_the_windows_are_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    likelihood = _likelihood(name)
    row = _somewhere(likelihood)
    monkeypatch.setattr(shooting, "record_filter", record_filter.__wrapped__)
    monkeypatch.setattr(output_error, "record_filter", record_filter.__wrapped__)
    monkeypatch.setattr(record_filters, "filter_code", VirtualFilter)
    by_numpy = _made(name)
    assert by_numpy.compiled_by == "NumPy"
    for mine, other in zip(likelihood.residuals(row), by_numpy.residuals(row), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-12 * np.abs(other).max())
    for mine, other in zip(likelihood.scores(row), by_numpy.scores(row), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-11 * np.max(np.abs(other)))
    for mine, other in zip(likelihood.whitened(row)[1], by_numpy.whitened(row)[1], strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-10 * np.max(np.abs(other)))
