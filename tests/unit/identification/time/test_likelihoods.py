"""Both likelihoods on one short simulated flight: gradients and information against differences, and what they find.

The flight is the one of the end-to-end test: the same shapes, so that output error compiles nothing of its own here.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import swashplate as sp
from simulated_flights import FREE, TIE, ten_seconds
from swashplate.errors import IdentificationError
from swashplate.filtering.disturbed_model import FilterGain, FilterState
from swashplate.filtering.nuisance import Nuisance
from swashplate.identification.core import accuracy
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import Record, records
from swashplate.identification.core.scoring import Solver, minimise
from swashplate.identification.time.calibration import first_part
from swashplate.identification.time.filter_error import FilterError
from swashplate.identification.time.output_error import WINDOW, OutputError
from swashplate.physics.backend import ArrayBackend


@lru_cache(maxsize=1)
def _record() -> Record:
    (record,) = records(ten_seconds().condition(rate=100.0, cutoff=0.0), sp.vehicle("coax"))
    return record


def _start() -> Record:
    """The first five seconds: enough for slopes and bounds, and half the time."""
    return first_part(_record(), 5.0)


@lru_cache(maxsize=1)
def _output_error() -> OutputError:
    return OutputError(parameterize(sp.vehicle("coax"), FREE, ties=[TIE]), [_record()])


@lru_cache(maxsize=1)
def _filter_error() -> FilterError:
    return FilterError(parameterize(sp.vehicle("coax"), FREE, ties=[TIE]), [_start()])


@pytest.fixture(params=["output error", "filter error"])
def likelihood(request: pytest.FixtureRequest) -> OutputError | FilterError:
    return _output_error() if request.param == "output error" else _filter_error()


def _somewhere(likelihood: OutputError | FilterError, seed: int = 1) -> np.ndarray:
    """A row near the start, away from every symmetry, with its weights taken."""
    rng = np.random.default_rng(seed)
    row = likelihood.row.starts() + 0.05 * rng.standard_normal(len(likelihood.row))
    likelihood.refresh(row)
    return np.asarray(row)


def _picked(likelihood: OutputError | FilterError) -> np.ndarray:
    """Some entries of every group."""
    groups = sorted({entry.group for entry in likelihood.row.entries})
    return np.concatenate([likelihood.row.places(group)[:: 1 if group == "parameter" else 6] for group in groups])


def test_the_gradient_is_the_slope_of_the_cost(likelihood: OutputError | FilterError) -> None:
    row = _somewhere(likelihood)
    cost, gradient, information = likelihood.scores(row)
    assert cost == pytest.approx(likelihood.cost(row), rel=1e-12)
    size = np.sqrt(np.diag(information))
    for place in _picked(likelihood):
        step = np.zeros(row.size)
        step[place] = 1e-4 / max(size[place], 1e-2)  # a ten-thousandth of its standard deviation
        slope = (likelihood.cost(row + step) - likelihood.cost(row - step)) / (2.0 * step[place])
        assert gradient[place] == pytest.approx(slope, rel=1e-3, abs=1e-3 * size[place]), likelihood.row.names[place]


def test_a_heading_that_only_turns_the_innovations_tells_nothing() -> None:
    """What is expected at another heading turns the innovation that is there; no flight is more likely for that."""
    likelihood = _filter_error()
    model, names = likelihood.model, likelihood.model.output_names
    x = likelihood.runs(_somewhere(likelihood))[0].states.x[100]
    none = np.zeros((model.n_gusts, model.n_outputs))
    gain = FilterGain(np.zeros((x.size, model.n_outputs)), none, none, none)
    readings = np.asarray(model.measure(x, Nuisance(), ArrayBackend())) + 1e-3 * np.arange(1.0, 7.0)

    def innovation(turn: float) -> np.ndarray:
        state = FilterState(x + turn * (np.arange(x.size) == model.vehicle.index("psi")), none[:, 0], none[:, 0])
        return np.asarray(model.correct(state, readings, gain, Nuisance(), ArrayBackend())[1])[None]

    moved = (innovation(1e-5) - innovation(-1e-5)) / 2e-5
    assert np.abs(moved[0, [names.index("x"), names.index("y")]]).min() > 5e-4
    every, heading = np.tile(moved, (len(likelihood.row), 1, 1)), np.array(names) == "psi"
    # With the innovation turns what is expected of it, which is not as large ahead as to the side.
    spread = np.diag(np.arange(1.0, 7.0))
    across = np.zeros_like(spread)
    across[names.index("x"), names.index("y")], across[names.index("y"), names.index("x")] = 1.0, -1.0
    with_it = np.tile(across @ spread + spread @ across.T, (len(every), 1, 1))
    told, nothing = likelihood._foreseen(every, innovation(0.0), with_it, spread, 0)
    np.testing.assert_allclose(told[0, 0], -1.0 * heading, atol=1e-7)
    np.testing.assert_allclose(nothing[0, 0], 0.0, atol=1e-9)
    assert likelihood._foreseen(every, innovation(0.0), 0.0 * with_it, spread, 0)[1][0, 0] > 0.1


def test_records_beside_others_are_run_alike() -> None:
    """Two records in one likelihood cost what each costs alone."""
    whole = _filter_error()
    row = _somewhere(whole)
    both = FilterError(whole.table, [_start(), _start()])
    assert both.cost(row) == pytest.approx(2.0 * whole.cost(row), rel=1e-12)


def test_the_information_is_the_curvature_where_the_model_is_true(likelihood: OutputError | FilterError) -> None:
    """The Fisher information is the mean of the Hessian: along a few directions they agree as well as noise lets them.

    At the best row, where the residuals are noise; the Hessian by differences of the gradient. The heading of the
    tracked body is among them: it turns the innovations, and that must not count (it did, by 40 % in a flight of 31 s).
    """
    best = _best(likelihood).row
    likelihood.refresh(best)
    _, _, information = likelihood.scores(best)
    headings = [place for place, name in enumerate(likelihood.row.names) if name == "level_psi[0]"]
    for place in [*likelihood.row.places("parameter"), *headings]:
        step = np.zeros(best.size)
        step[place] = 1e-2 / np.sqrt(information[place, place])
        high, low = (likelihood.scores(best + side * step)[1] for side in (1.0, -1.0))
        curvature = (high - low)[place] / (2.0 * step[place])
        assert information[place, place] == pytest.approx(curvature, rel=0.1), likelihood.row.names[place]


_FOUND: dict[int, object] = {}


def _best(likelihood: OutputError | FilterError):  # type: ignore[no-untyped-def]
    if id(likelihood) not in _FOUND:
        few = 40 if isinstance(likelihood, OutputError) else 15  # what is left to do is noise that shrinks to nothing
        _FOUND[id(likelihood)] = minimise(likelihood, Solver(iterations=few))
    return _FOUND[id(likelihood)]


def test_both_find_the_truth_within_their_bounds(likelihood: OutputError | FilterError) -> None:
    found = _best(likelihood)
    row = likelihood.row
    plain = accuracy.covariance(row, found.information, row.prior(found.row)[2])
    truth = sp.vehicle("coax").card.values()
    for place in row.places("parameter"):
        sigma = np.sqrt(plain[place, place]) * row.scale[place]
        value = found.row[place] * row.scale[place]
        assert abs(value - truth[row.names[place]]) < 4.0 * sigma, row.names[place]
        assert sigma < 0.15 * truth[row.names[place]]


def test_innovations_at_the_truth_are_as_large_as_promised() -> None:
    """One-step errors over their own covariance: one on average, channel by channel."""
    likelihood = _filter_error()
    white, sensitivities, _ = likelihood.whitened(_best(likelihood).row)
    assert len(white) == 1
    counted = int(likelihood.counted[0].sum())
    assert white[0].shape == (counted, 6)
    assert sensitivities[0].shape == (len(likelihood.row), counted, 6)
    np.testing.assert_allclose(np.mean(white[0] ** 2, axis=0), 1.0, atol=0.25)


def test_output_errors_are_as_large_as_their_covariance_says() -> None:
    likelihood = _output_error()
    best = _best(likelihood).row
    likelihood.refresh(best)
    residual = np.asarray(likelihood.residuals(best)[0]).reshape(-1, 6)
    np.testing.assert_allclose(np.sqrt(np.diag(likelihood.covariance)), np.std(residual, axis=0), rtol=0.1)
    white, _, _ = likelihood.whitened(best)
    np.testing.assert_allclose(np.mean(np.concatenate(white) ** 2, axis=0), 1.0, atol=0.2)


def test_an_outlier_costs_its_distance_and_not_its_square() -> None:
    likelihood = _output_error()
    row = _somewhere(likelihood)
    first, *others = likelihood.errors_of(row)
    push = np.zeros_like(first.errors)
    push[50, 2] = 1000.0 * np.sqrt(likelihood.covariance[2, 2])
    costs = [likelihood.cost_of([replace(first, errors=first.errors + size * push), *others]) for size in (0, 1, 2)]
    assert costs[2] - costs[1] == pytest.approx(costs[1] - costs[0], rel=0.05)


def test_a_model_that_leaves_the_finite_numbers_costs_infinitely_much() -> None:
    for likelihood in (_output_error(), _filter_error()):
        row = _somewhere(likelihood)
        row[likelihood.row.places("parameter")[0]] = -1e-4  # a negative time constant: it explodes at once
        assert likelihood.cost(row) == np.inf


def test_windows_start_where_they_should_and_share_nothing_but_the_record() -> None:
    likelihood = _output_error()
    length = round(WINDOW * 100.0)
    assert likelihood.places() == [(0, first) for first in range(0, 1001 - length, length)]
    last = len(likelihood.places()) - 1
    names = likelihood.row.names
    assert names[:2] == ("tau_f_upper", "linkage_lower")
    assert f"x at window {last}" in names
    assert last > 0
    _, sensitivities, _ = likelihood.whitened(_somewhere(likelihood))
    for window, sensitivity in enumerate(sensitivities):
        seen = {names[i] for i in np.flatnonzero(sensitivity.any(axis=(1, 2)))}
        assert {name for name in seen if " at window " in name} <= {n for n in names if n.endswith(f"window {window}")}


def test_a_record_shorter_than_a_window_is_refused() -> None:
    with pytest.raises(IdentificationError, match=r"longest record has 10\.0 s, expected more than one"):
        OutputError(parameterize(sp.vehicle("coax"), FREE, ties=[TIE]), [_record()], window=20.0)


def test_the_first_seconds_of_a_filter_are_not_counted() -> None:
    counted = _filter_error().counted[0]
    assert not counted[:150].any()
    assert counted.shape == (501,)
    assert counted[150:].all()


def test_innovations_turn_back_into_the_room() -> None:
    """Their horizontal part is in heading axes; a nose to the east makes forward east."""
    likelihood, record = _filter_error(), _start()
    outputs = record.outputs.copy()
    outputs[:, 5] = np.pi / 2.0
    east = Record(record.name, record.time, record.inputs, outputs, record.voltage, record.output_names, True)
    ahead = np.tile([1.0, 0.0, 0.3, 0.1, 0.2, 0.3], (record.time.size, 1))
    np.testing.assert_allclose(
        likelihood.unturned(ahead, east), np.tile([0.0, 1.0, 0.3, 0.1, 0.2, 0.3], (record.time.size, 1)), atol=1e-15
    )


def test_what_is_left_out_passes_the_filter_and_counts_for_nothing() -> None:
    """The same run; cost, information and whitened innovations are those of the samples that are left."""
    whole = _filter_error()
    row, piece = _somewhere(whole), whole.records[0]
    first, last = piece.time[0] + 2.0, piece.time[0] + 3.0
    parts = [
        FilterError(whole.table, [replace(piece, left_out=out)])
        for out in (((first, last),), ((-1.0, first - 0.005), (last + 0.005, 99.0)))
    ]
    for told, halves in zip(whole.scores(row), zip(*(part.scores(row) for part in parts), strict=True), strict=True):
        np.testing.assert_allclose(sum(halves), told, rtol=1e-9, atol=1e-6 * np.abs(told).max())
    white = parts[0].whitened(row)[0][0]
    assert len(white) == len(whole.whitened(row)[0][0]) - int(np.sum((piece.time >= first) & (piece.time <= last)))
