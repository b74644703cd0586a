"""How errors of responses go together: against the taper itself, and against errors of many simulated records."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.respond import respond
from swashplate.identification.responses.shared_errors import (
    ErrorParts,
    SharedErrors,
    correlation_of_errors,
    line_correlation,
)

RATE, SECONDS, SEEDS = 20.0, 100.0, 60


def test_lines_go_together_as_the_squared_taper_says() -> None:
    """Percival and Walden: the squared transform of the squared taper, summed here sample by sample."""
    t = (np.arange(2000) + 0.5) / 2000
    taper = np.sin(np.pi * t) ** 2
    apart = np.linspace(0.0, 2.5, 26)
    summed = np.abs(np.exp(-2j * np.pi * np.outer(apart, t)) @ taper**2 / np.sum(taper**2)) ** 2
    window = 8.0
    found = line_correlation(2.0 * np.pi * apart / window, np.full(apart.size, window))[0]
    np.testing.assert_allclose(found, summed, atol=0.02)


def test_windows_that_change_leave_a_correlation_positive() -> None:
    omega, window = np.geomspace(0.3, 40.0, 60), np.geomspace(60.0, 3.0, 60)
    both = line_correlation(omega, window)
    np.testing.assert_allclose(np.diag(both), 1.0)
    assert np.linalg.eigvalsh(both)[0] > -1e-9


def test_a_response_of_which_nothing_is_known_errs_alone() -> None:
    omega = [np.array([1.0, 1.1]), np.array([1.0, 1.1])]
    parts = ErrorParts(np.ones((2, 1)) + 0j, np.ones((2, 1)) + 0j, np.full(2, 10.0))
    both = correlation_of_errors(omega, [parts, None])
    assert both[0, 1].real > 0.9
    np.testing.assert_array_equal(both[2:, :], np.eye(4)[2:])
    assert correlation_of_errors(omega, [parts, parts])[0, 2] == pytest.approx(1.0)


def test_a_part_is_that_of_the_whole() -> None:
    found = _responses(0)
    assert found.shared is not None
    part = found.select(("q",), ("b",)).shared
    assert part is not None
    np.testing.assert_array_equal(part.noise[:, 0, 0], 1.0)
    turned = found.select(("q", "p"), ("b", "a")).shared
    assert turned is not None
    np.testing.assert_array_equal(turned.noise[:, 0, 1], found.shared.noise[:, 1, 0])


def test_the_file_brings_it_back(tmp_path: Path) -> None:
    found = _responses(0)
    again = FrequencyResponse.load(found.save(tmp_path / "responses.nc")).shared
    assert found.shared is not None
    assert again is not None
    for name in ("noise", "inverse", "window"):
        np.testing.assert_array_equal(getattr(again, name), getattr(found.shared, name))


def _record(seed: int) -> Flight:
    """Two inputs that move together a little; p' = a - p and q = b, both shaken by one gust, q a quarter turn later."""
    random = np.random.default_rng(seed)
    count, dt = round(SECONDS * RATE), 1.0 / RATE
    inputs = random.standard_normal((2, count))
    inputs[1] += 0.7 * inputs[0]
    a, b = lfilter([1.0, 1.0], [2.0], inputs, axis=1)
    gust = lfilter([1.0], [1.0, -0.8], random.standard_normal(count))
    keep = np.exp(-dt)
    p = lfilter([0.0, 1.0 - keep], [1.0, -keep], a + 1.5 * gust)
    turned = lfilter([0.0, 1.0 - keep], [1.0, -keep], gust)
    q = b + 2.0 * gust + 0.2 * random.standard_normal(count) - 1.5 * turned
    channels = {"p": p, "q": q, "a": a, "b": b}
    units = {"p": "rad/s", "q": "rad/s", "a": "1", "b": "1"}
    return Flight({"uniform": stream(np.arange(count) * dt, channels, units)}, Provenance(source=f"record {seed}"))


def _responses(seed: int) -> FrequencyResponse:
    return respond(_record(seed), inputs=["a", "b"], outputs=["p", "q"], band=(0.3, 5.0), direct=True, lines=20)


@cache
def _scattered() -> tuple[list[FrequencyResponse], np.ndarray]:
    """Responses of many records and their errors over their random errors, (seeds, n_f, n_out, n_in)."""
    found = [_responses(seed) for seed in range(SEEDS)]
    h = np.array([one.response for one in found])
    return found, (h - h.mean(axis=0)) / (np.array([one.error for one in found]) * np.abs(h))


@pytest.mark.parametrize(
    ("first", "second"),
    [((0, 0), (1, 0)), ((0, 1), (1, 1)), ((0, 0), (0, 1)), ((1, 0), (1, 1)), ((0, 0), (1, 1))],
)
def test_errors_of_two_responses_go_together_as_told(first: tuple[int, int], second: tuple[int, int]) -> None:
    """Size and phase: outputs by the gust that moves both, inputs by what they have in common."""
    found, errors = _scattered()
    one, other = errors[:, :, *first], errors[:, :, *second]
    seen = np.mean(one * other.conj(), axis=0) / np.sqrt(
        np.mean(np.abs(one) ** 2, axis=0) * np.mean(np.abs(other) ** 2, axis=0)
    )
    told = np.mean([_told(each, first, second) for each in found], axis=0)
    assert np.mean(np.abs(told)) > 0.3, "a correlation of nothing would prove nothing"
    # Each line is told by 60 records, so to 0.13; their mean over the band much better.
    assert np.mean(np.abs(seen - told)) < 0.15
    assert np.abs(np.mean((seen - told) * np.exp(-1j * np.angle(told)))) < 0.08


def _told(found: FrequencyResponse, first: tuple[int, int], second: tuple[int, int]) -> np.ndarray:
    assert isinstance(found.shared, SharedErrors)
    parts = [found.shared.at(found.omega, found.omega, *pair) for pair in (first, second)]
    n = found.omega.size
    return np.diag(correlation_of_errors([found.omega] * 2, parts)[:n, n:])
