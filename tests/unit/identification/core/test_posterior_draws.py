"""What draws of a posterior tell, when they are refused, and their file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import report_samples
import swashplate as sp
from swashplate.errors import IdentificationError
from swashplate.identification.core.parameters import bounds_of
from swashplate.identification.core.posterior_draws import Posterior, adjusted

NAMES = ("a", "b", "delay[0]")


def made(**changed: object) -> Posterior:
    draws = np.random.default_rng(1).standard_normal((2, 500, 3)) * [1.0, 3.0, 0.1]
    stats = {name: np.zeros((2, 500)) for name in ("lp", "diverging", "energy")}
    good = Posterior(
        "nuts", NAMES, 2, ("1", "s"), draws, np.array([1.001, 1.002, 1.0]), np.array([800.0, 450.0, 90.0]), stats,
        np.array([0.5, 0.6]),
    )  # fmt: skip
    return replace(good, **changed)  # type: ignore[arg-type]


def test_good_draws_are_taken() -> None:
    made().check(where="here")
    assert made().values.shape == (1000, 2)
    assert "split-R-hat" in repr(made())
    assert "!" not in repr(made())


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"rhat": np.array([1.0, 1.004, 1.02])}, r"split-R-hat is to be below 1\.01, found delay\[0\] 1\.020"),
        ({"rhat": np.array([np.nan, 1.0, 1.0])}, r"found a nan"),
        ({"ess": np.array([800.0, 399.0, 500.0])}, "400 effective draws are needed, found b 399"),
        ({"stats": {"diverging": np.tile([1.0, 0.0], (2, 250))}}, r"50\.0 % of the trajectories ran away"),
    ],
)
def test_draws_that_may_be_wrong_are_refused(changed: dict[str, object], words: str) -> None:
    with pytest.raises(IdentificationError, match=words) as refused:
        made(**changed).check(where="the fit of x")
    assert "did not converge" in str(refused.value)
    assert "!" in repr(made(**changed))


def test_the_file_is_arvizs_layout(tmp_path: Path) -> None:
    one = made()
    with xr.open_datatree(one.save(tmp_path / "posterior.nc"), engine="h5netcdf") as tree:
        assert set(tree.children) == {"posterior", "sample_stats", "diagnostics"}
        assert tree["posterior"]["b"].dims == ("chain", "draw")
        assert tree["posterior"]["b"].attrs["units"] == "s"
        np.testing.assert_array_equal(tree["posterior"]["b"], one.draws[:, :, 1])
        np.testing.assert_array_equal(tree["posterior"]["constants"].sel(constant="delay[0]"), one.draws[:, :, 2])
        assert tree["sample_stats"]["diverging"].dtype == bool
        np.testing.assert_array_equal(tree["sample_stats"]["step_size"], one.step)


def test_adjusted_draws_have_the_corrected_spread() -> None:
    random = np.random.default_rng(2)
    plain, corrected = (m @ m.T for m in random.standard_normal((2, 3, 3)))
    draws = random.standard_normal((200_000, 3)) @ np.linalg.cholesky(plain).T + 7.0
    wider = adjusted(draws, plain, corrected)
    np.testing.assert_allclose(np.cov(wider.T), corrected, atol=0.03 * np.max(corrected))
    np.testing.assert_allclose(wider.mean(axis=0), draws.mean(axis=0), atol=1e-9)
    np.testing.assert_allclose(adjusted(draws, plain, plain), draws, atol=1e-9)


def with_posterior(*, beyond: bool = False, **changed: object) -> sp.Result:
    """A sample fit whose posterior is half as wide as its bounds, or lies where physics ends."""
    fit = report_samples.fit()
    k, sigma = len(fit.names), np.sqrt(np.diag(fit.covariance))
    mean = np.array([fit[name].value for name in fit.names])
    draws = mean + 0.5 * sigma * np.random.default_rng(3).standard_normal((2, 400, k))
    draws = draws + 1e6 if beyond else np.clip(draws, *bounds_of(fit.solution, fit.names))
    units = tuple(fit[name].unit for name in fit.names)
    drawn = Posterior("nuts", fit.names, k, units, draws, np.ones(k), np.full(k, 500.0))
    return replace(fit, posterior=replace(drawn, **changed))  # type: ignore[arg-type]


def test_a_result_draws_from_its_posterior(tmp_path: Path) -> None:
    fit = with_posterior()
    assert fit.posterior is not None
    name, values = fit.names[0], fit.posterior.values[:, 0]
    every = fit.draw_values(values.size, seed=1, corrected=False)[name]
    np.testing.assert_array_equal(np.sort(every), np.sort(values))  # each once as long as there are enough
    drawn = fit.draw_values(200, seed=1, corrected=False)[name]
    again = sp.load(fit.save(tmp_path / "fit.json"))
    np.testing.assert_array_equal(again.draw_values(200, seed=1, corrected=False)[name], drawn)


def test_a_posterior_that_did_not_converge_is_not_drawn_from() -> None:
    fit = with_posterior(rhat=np.full(len(report_samples.fit().names), 1.2))
    with pytest.raises(IdentificationError, match="did not converge"):
        fit.draw(3, seed=1)


def test_a_posterior_mostly_beyond_physics_is_not_drawn_from() -> None:
    fit = with_posterior(beyond=True)
    with pytest.raises(IdentificationError, match="draws lie within the bounds of physics"):
        fit.draw_values(3, seed=1)
