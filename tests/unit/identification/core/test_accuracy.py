"""Bounds of estimates: against brute force, closed forms for coloured residuals and scatter over many experiments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from swashplate.errors import IdentificationError
from swashplate.identification.core import accuracy
from swashplate.identification.core.parameter_row import Entry, Row
from swashplate.identification.core.result import Estimate


def _row(count: int, *, sigma: float = np.inf) -> Row:
    return Row(tuple(Entry(f"a{i}", "parameter", 0.0, 1.0, sigma=sigma) for i in range(count)))


def _first_order(rng: np.random.Generator, shape: tuple[int, int], rho: float) -> np.ndarray:
    """AR(1) columns of unit variance."""
    noise = np.sqrt(1.0 - rho**2) * rng.standard_normal(shape)
    noise[0] /= np.sqrt(1.0 - rho**2)
    return np.asarray(lfilter([1.0], [1.0, -rho], noise, axis=0))


@pytest.mark.parametrize("n", [7, 24, 61])
def test_the_corrected_bound_is_the_double_sum(n: int) -> None:
    """Morelli and Klein's formula written out, sample by sample, where the fit has taken nothing out of the errors.

    A tiny bound says so: then the residuals are the errors.
    """
    rng = np.random.default_rng(n)
    p, m, lags = 4, 3, 10
    v, S = _first_order(rng, (n, m), 0.7) @ rng.standard_normal((m, m)), rng.standard_normal((p, n, m))
    prior, plain = rng.uniform(0.0, 1.0, p), 1e-9 * (np.eye(p) + 0.1)
    middle = np.diag(prior)
    for i in range(n):
        for j in range(max(0, i - lags), min(n, i + lags + 1)):
            lag = abs(j - i)
            R = v[: n - lag].T @ v[lag:] / n * (1.0 - lag / (lags + 1.0))
            middle += S[:, i] @ (R if j >= i else R.T) @ S[:, j].T
    found = accuracy.corrected_covariance(plain, np.diag(prior), [v], [S], lags=lags)
    np.testing.assert_allclose(found, plain @ middle @ plain, rtol=1e-6)
    assert np.linalg.eigvalsh(found).min() > 0.0


def test_records_that_know_nothing_of_each_other_add_up() -> None:
    """Twice the same record is twice the information; an entry that a record does not know gets nothing from it."""
    rng = np.random.default_rng(12)
    v, S = _first_order(rng, (300, 2), 0.8), rng.standard_normal((3, 300, 2))
    S[2] = 0.0
    plain, rest = 1e-9 * np.eye(3), np.zeros((3, 3))
    one = accuracy.corrected_covariance(plain, rest, [v], [S], lags=30)
    two = accuracy.corrected_covariance(plain, rest, [v, v], [S, S], lags=30)
    np.testing.assert_allclose(two, 2.0 * one, rtol=1e-6)
    assert not one[2].any()


def test_white_residuals_leave_the_bound_alone() -> None:
    rng = np.random.default_rng(2)
    n, p, m = 40_000, 3, 2
    S = rng.standard_normal((p, n, m))
    plain = np.linalg.inv(S.reshape(p, -1) @ S.reshape(p, -1).T)
    found = accuracy.corrected_covariance(plain, np.zeros((p, p)), [rng.standard_normal((n, m))], [S], lags=20)
    np.testing.assert_allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(plain)), rtol=0.05)


@pytest.mark.parametrize("rho", [0.5, 0.9])
def test_coloured_residuals_widen_the_bound_of_a_mean_by_their_spectrum(rho: float) -> None:
    """For a constant sensitivity only the spectrum at zero frequency matters: (1 + rho) / (1 - rho) in variance.

    The linear taper over lags L takes a known part of it: sum over lags of (1 - |l| / (L + 1)) rho^|l|.
    """
    n, lags = 400_000, 100
    S = np.ones((1, n, 1))
    plain = np.array([[1.0 / n]])
    residual = _first_order(np.random.default_rng(5), (n, 1), rho)
    found = accuracy.corrected_covariance(plain, np.zeros((1, 1)), [residual], [S], lags=lags)
    lag = np.arange(1, lags + 1)
    tapered = 1.0 + 2.0 * np.sum((1.0 - lag / (lags + 1.0)) * rho**lag)
    assert found[0, 0] / plain[0, 0] == pytest.approx(tapered, rel=0.05)
    assert tapered == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.11)


def test_the_corrected_bound_is_the_scatter_of_a_regression() -> None:
    """300 experiments, slow regressors, coloured noise: the plain bound is far too narrow, the other one fits."""
    rng = np.random.default_rng(11)
    time = np.arange(600) / 50.0
    S = np.stack([np.sin(0.8 * time), np.cos(0.5 * time)])[:, :, None]
    flat = S.reshape(2, -1)
    plain = np.linalg.inv(flat @ flat.T)
    found, promised = [], []
    for _ in range(300):
        noise = _first_order(rng, (600, 1), 0.9)
        estimate = plain @ flat @ noise.ravel()
        found.append(estimate)
        left = noise - (flat.T @ estimate)[:, None]
        promised.append(np.diag(accuracy.corrected_covariance(plain, np.zeros((2, 2)), [left], [S], lags=50)))
    ratio = np.std(found, axis=0) / np.sqrt(np.mean(promised, axis=0))
    assert np.all(np.abs(ratio - 1.0) < 0.2), ratio
    assert np.all(np.std(found, axis=0) > 2.5 * np.sqrt(np.diag(plain)))


def test_priors_add_to_the_information_and_bad_scales_do_no_harm() -> None:
    scales = np.array([1e-6, 1.0, 1e7])
    information = np.outer(1.0 / scales, 1.0 / scales) * np.array([[2.0, 0.5, 0.1], [0.5, 1.0, 0.2], [0.1, 0.2, 3.0]])
    prior = np.diag(1.0 / scales**2)
    exact = np.linalg.inv((information + prior) * np.outer(scales, scales)) * np.outer(scales, scales)
    found = accuracy.covariance(_row(3), information, prior)
    np.testing.assert_allclose(found / np.outer(scales, scales), exact / np.outer(scales, scales), rtol=1e-10)


def test_marginal_information_is_the_inverse_of_the_block_of_the_inverse() -> None:
    rng = np.random.default_rng(3)
    root = rng.standard_normal((6, 9))
    information, prior = root @ root.T, np.diag([0.0, 0.0, 0.0, 0.5, 2.0, 0.0])
    places = np.array([0, 1, 2])
    found = accuracy.marginal_information(information, prior, places)
    block = np.linalg.inv(information + prior)[:3, :3]
    np.testing.assert_allclose(np.linalg.inv(found), block, rtol=1e-9)
    np.testing.assert_allclose(accuracy.marginal_information(information, prior, np.arange(6)), information)


def test_a_nuisance_that_nobody_sees_blinds_nothing_else() -> None:
    information = np.zeros((3, 3))
    information[:2, :2] = [[4.0, 1.0], [1.0, 4.0]]
    found = accuracy.marginal_information(information, np.zeros((3, 3)), np.array([0, 1]))
    np.testing.assert_allclose(found, information[:2, :2])


def test_blind_directions_are_named_in_words() -> None:
    """Thrust and mass that only act together: up with up cannot be seen, up with down can."""
    along = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    across, third = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0), np.array([0.0, 0.0, 1.0])
    names = ("k_thrust", "mass", "damping")
    information = 100.0 * np.outer(across, across) + 0.04 * np.outer(third, third) + 0.0 * np.outer(along, along)
    worst, weak = accuracy.blind_directions(names, information)
    assert worst.words == "mass up with k_thrust up can move without limit before the data object" or (
        worst.words == "k_thrust up with mass up can move without limit before the data object"
    )
    assert worst.weights["damping"] == pytest.approx(0.0, abs=1e-12)
    assert weak.words == "damping can move by 5 times the usual size before the data object"
    assert weak.sigma == pytest.approx(5.0)
    opposed = accuracy.blind_directions(names[:2], 100.0 * np.outer([0.6, 0.8], [0.6, 0.8]))
    assert opposed[0].words == "k_thrust up with mass down can move without limit before the data object"
    assert accuracy.blind_directions(names, 100.0 * np.eye(3)) == ()


def test_a_parameter_without_a_trace_is_refused_and_one_with_a_prior_is_not() -> None:
    information = np.diag([1.0, 0.0])
    with pytest.raises(IdentificationError, match=r"a\.mat: a1: the flight carries no information about it"):
        accuracy.refuse_unseen(_row(2), information, where="a.mat")
    accuracy.refuse_unseen(_row(2, sigma=1.0), information, where="a.mat")


def test_numbers_within_two_standard_deviations_of_zero_are_named_and_no_others() -> None:
    """A slow derivative of the wrong sign (+0.025 for -0.04) with its honest bound; a delay that is told; held ones."""
    estimates = [
        Estimate("Xu", "1/s", -0.05, 0.025, sigma=0.04),
        Estimate("Zw", "1/s", -0.5, -0.61, sigma=0.5, sigma_corrected=0.05),
        Estimate("tau", "s", 0.03, 0.03, sigma=0.001),
        Estimate("U0", "m/s", 0.0, 0.0, fixed=True),
        Estimate("Lv", "1", 0.0, 0.1, sigma=float("inf")),
    ]
    assert accuracy.sign_words(estimates) == [
        "the data do not tell the sign of Xu 0.025 ± 0.08 (two standard deviations): do not use these numbers."
    ]
    assert accuracy.sign_words([e for e in estimates if e.name != "Xu"]) == []
    many = [replace(estimates[0], name=f"X{k}") for k in range(8)]
    assert "X5" in accuracy.sign_words(many)[0]
    assert "and 2 more" in accuracy.sign_words(many)[0]


def test_errors_that_hold_over_half_an_octave_are_covered() -> None:
    """A regression whose errors follow the regressor band by band: the estimate scatters as the bound by octaves says.

    The autocorrelation cannot tell them: they are as white in sum as sensor noise is.
    """
    rng = np.random.default_rng(3)
    n, errors, bounds, white = 1024, [], [], []
    frequency = np.fft.rfftfreq(n)
    band = np.floor(2.0 * np.log2(np.maximum(frequency, 1.0 / n))).astype(int)
    for _ in range(150):
        spectrum = np.exp(2j * np.pi * rng.random(frequency.size)) / np.sqrt(np.maximum(frequency, 1.0 / n))
        spectrum[0] = 0.0  # a sweep has as much in every octave
        regressor = np.fft.irfft(spectrum, n)
        off = dict(zip(np.unique(band), 0.3 * rng.standard_normal(np.unique(band).size), strict=True))
        lacking = np.fft.irfft(spectrum * np.array([off[b] for b in band]), n)
        noise = 0.1 * regressor.std() * rng.standard_normal(n)
        errors.append(float(regressor @ (lacking + noise) / (regressor @ regressor)))
        left = (lacking + noise - errors[-1] * regressor) / (lacking + noise).std()
        S = (regressor / (lacking + noise).std())[None, :, None]
        plain = np.linalg.inv(np.einsum("pnm,qnm->pq", S, S))
        found = accuracy.covariance_by_octaves(plain, np.zeros((1, 1)), [left[:, None]], [S])
        bounds.append(float(np.sqrt(found[0, 0])))
        white.append(float(np.sqrt(plain[0, 0])))
    assert 0.8 < np.std(errors) / np.sqrt(np.mean(np.square(bounds))) < 1.3
    assert np.std(errors) > 2.0 * np.sqrt(np.mean(np.square(white)))


def test_white_errors_have_the_plain_bound_by_octaves_too() -> None:
    rng = np.random.default_rng(4)
    S = rng.standard_normal((2, 4096, 2))
    plain = np.linalg.inv(np.einsum("pnm,qnm->pq", S, S))
    ratios = [
        np.diag(accuracy.covariance_by_octaves(plain, np.zeros((2, 2)), [rng.standard_normal((4096, 2))], [S]))
        / np.diag(plain)
        for _ in range(200)
    ]
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.15)


def test_what_covers_has_the_largest_variances_and_the_first_correlations() -> None:
    first, other = np.array([[4.0, 1.0], [1.0, 9.0]]), np.diag([16.0, 1.0])
    np.testing.assert_allclose(accuracy.covering(first, other), [[16.0, 2.0], [2.0, 9.0]])
