"""Equation error and stepwise regression against published answers (SIDPAC's example; Jategaonkar 2015, Table 9.1)."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy import io
from scipy.interpolate import CubicSpline

from swashplate.errors import IdentificationError
from swashplate.identification.time.equation_error import equation_error, stepwise


def test_stepwise_regression_chooses_and_finds_what_sidpac_does(shared_data: Path) -> None:
    data = io.loadmat(shared_data / "sidpac" / "swr_example.mat")
    found = stepwise(data["z"].ravel(), data["x"], ["x1", "x2", "x3", "x4"])
    assert set(found.names) == {"x1", "x2", "x4", "bias"}  # x3 is a decoy
    theirs = data["p"].ravel()
    for place, name in ((0, "x1"), (1, "x2"), (3, "x4"), (4, "bias")):
        assert found[name] == pytest.approx(theirs[place], abs=1e-5)
    errors = dict(zip(found.names, found.sigmas, strict=True))
    for name, sigma in zip(("x1", "x2", "x4", "bias"), data["serr"].ravel(), strict=True):
        assert errors[name] == pytest.approx(sigma, rel=0.01)


@pytest.fixture
def unstable(shared_data: Path) -> dict[str, np.ndarray]:
    numbers = np.array((shared_data / "fvsysid" / "unStabAC_sim.asc").read_text(encoding="utf-8").split(), dtype=float)
    names = ("time", "pilot", "w", "q", "elevator", "az")
    return dict(zip(names, numbers.reshape(251, 6).T, strict=True))


def published(folder: Path) -> dict[str, dict[str, float]]:
    text = (folder / "fvsysid" / "unstable_aircraft_table9_1.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {row["method"]: {k: float(row[k]) for k in ("Zw", "Mw", "Mq")} for row in rows}


def test_unstable_aircraft_by_least_squares_is_the_books(shared_data: Path, unstable: dict[str, np.ndarray]) -> None:
    book = published(shared_data)["LS"]
    x = np.column_stack([unstable["w"], unstable["q"], unstable["elevator"]])
    lift = equation_error(unstable["az"], x, ["Zw", "Zq", "Zde"])
    assert lift["Zw"] == pytest.approx(book["Zw"], abs=5e-5)
    qdot = CubicSpline(unstable["time"], unstable["q"])(unstable["time"], 1)
    moment = equation_error(qdot, x, ["Mw", "Mq", "Mde"], bias=False)
    assert moment["Mw"] == pytest.approx(book["Mw"], rel=2e-4)
    assert moment["Mq"] == pytest.approx(book["Mq"], rel=2e-4)
    # Over a band of frequencies the same equation gives the truth as well as in time.
    truth = published(shared_data)["true"]
    banded = equation_error(qdot, x, ["Mw", "Mq", "Mde"], dt=0.05, band=(0.1, 2.0))
    assert banded["Mw"] == pytest.approx(truth["Mw"], rel=0.02)
    assert banded["Mq"] == pytest.approx(truth["Mq"], rel=0.02)


def test_twin_otter_answers_are_sidpacs(shared_data: Path) -> None:
    """SIDPAC's Twin Otter, on the record that its answers belong to: the one inside its file of results.

    (236 ft/s, 401 samples at 50 Hz. The record in totter_lon_data.mat is another flight, at 153 ft/s; its lift by pitch
    rate is 35 % lower.) In SIDPAC's columns 4 is the angle of attack, 14 the elevator [deg], 72 the pitch rate without
    dimension, 63 and 65 the force and moment coefficients.
    """
    answers = io.loadmat(shared_data / "sidpac" / "totter_results.mat")
    record = next(part for part in answers["cc"].ravel() if np.shape(part) == (401, 90)).astype(float)
    x = np.column_stack([np.radians(record[:, 3]), record[:, 71], np.radians(record[:, 13])])
    names, pm, pz = ("alpha", "q", "de"), answers["pm"].ravel(), answers["pZ"].ravel()
    lift, moment = record[:, 62], record[:, 64]
    pitching = equation_error(moment, x, names)
    np.testing.assert_allclose([pitching[n] for n in names], pm[:3], rtol=1e-6)
    lifting = equation_error(lift, x, names)
    np.testing.assert_allclose([lifting[n] for n in names], pz[:3], rtol=1.5e-3)
    chosen = stepwise(moment, np.column_stack([x, x[:, 0] ** 3]), (*names, "alpha^3"))
    assert set(names) <= set(chosen.names)
    # Over a band of frequencies within his bounds, which allow for coloured residuals.
    banded = equation_error(moment, x, names, dt=0.02, band=(0.1, 1.5))
    for name, value, sigma in zip(names, pm, answers["serrm"].ravel(), strict=False):
        assert banded[name] == pytest.approx(value, abs=3.0 * sigma), name


def test_regressors_that_are_one_are_refused() -> None:
    x = np.random.default_rng(1).standard_normal((100, 1))
    with pytest.raises(IdentificationError, match="do not tell a, b, bias apart"):
        equation_error(x[:, 0], np.hstack([x, 2 * x]), ["a", "b"])
