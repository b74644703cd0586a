"""HFB-320, a business jet in turbulence: Jategaonkar's published filter error estimates, by several routes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from hfb320 import (
    AIR,
    AREA,
    ARM,
    CHORD,
    FIRST,
    MASS,
    OUTPUTS,
    PUBLISHED,
    PUBLISHED_GUSTS,
    PUBLISHED_VARIANCES,
    START,
    TILT,
    TURN,
    V0,
    Inputs,
    State,
    flight,
    hfb320,
)
from swashplate.identification.core.parameters import parameterize
from swashplate.identification.core.records import records
from swashplate.identification.core.result import Result
from swashplate.identification.identify import identify
from swashplate.identification.time.equation_error import equation_error
from swashplate.identification.time.vehicle_problem import VehicleErrors
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import parse
from swashplate.physics.backend import FloatBackend


@pytest.fixture
def hfb(shared_data: Path) -> dict[str, np.ndarray]:
    rows = np.loadtxt(shared_data / "fvsysid" / "hfb320_1_10.asc")
    names = ("elevator", "pressure", "thrust", "V", "alpha", "theta", "q", "qdot", "ax", "az")
    return dict(zip(names, rows[:, 1:11].T, strict=True))


def coefficients(hfb: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Drag, lift and pitching moment from accelerations, thrust and pressure (constants: the data's columns.md)."""
    force = 0.5 * AIR.air_density * hfb["V"] ** 2 * AREA
    cx = (hfb["ax"] - hfb["thrust"] * np.cos(TILT) / MASS) / force
    cz = (hfb["az"] + hfb["thrust"] * np.sin(TILT) / MASS) / force
    s, c = np.sin(hfb["alpha"]), np.cos(hfb["alpha"])
    moment = (hfb["qdot"] - ARM * hfb["thrust"]) / (0.5 * AIR.air_density * hfb["V"] ** 2 * TURN)
    return -cx * c - cz * s, cx * s - cz * c, moment


def test_hfb_320_by_regression_is_near_the_published(hfb: dict[str, np.ndarray]) -> None:
    """The equations as they are, no linearisation. Turbulence in the regressors: Cmq is 21 % off, Cmde 5 %."""
    x = np.column_stack([hfb["V"] / V0, hfb["alpha"], hfb["q"] * CHORD / V0, hfb["elevator"]])
    drag, lift, moment = coefficients(hfb)
    for measured, letter, count in ((drag, "CD", 2), (lift, "CL", 2), (moment, "Cm", 4)):
        names = [f"{letter}{n}" for n in ("V", "a", "q", "de")[:count]]
        found = equation_error(measured, x[:, :count], names)
        banded = equation_error(measured, x[:, :count], names, dt=0.1, band=(0.03, 1.0))
        for name in names:
            if name not in ("CmV", "Cmq", "Cmde"):
                miss = found[name] - PUBLISHED[name]
                assert abs(miss) < max(3.0 * found.sigmas[names.index(name)], 0.02 * abs(PUBLISHED[name])), name
                miss = banded[name] - PUBLISHED[name]
                assert abs(miss) < 3.0 * banded.sigmas[names.index(name)], name
        assert letter != "CD" or found["bias"] == pytest.approx(PUBLISHED["CD0"], rel=0.02)
        assert letter != "Cm" or found["Cmde"] == pytest.approx(PUBLISHED["Cmde"], rel=0.06)


def hfb_model(hfb: dict[str, np.ndarray]) -> StateSpaceModel:
    """The equations of motion linearised about the record's means, in dimensionless derivatives."""
    rho, g = AIR.air_density, AIR.gravity
    V, alpha, thrust = (float(hfb[n].mean()) for n in ("V", "alpha", "thrust"))
    climb, pressure = alpha - float(hfb["theta"].mean()), 0.5 * rho * V**2
    cd, cl, cm = (float(c.mean()) for c in coefficients(hfb))
    s, c, down, ahead = np.sin(alpha), np.cos(alpha), g * np.cos(climb), g * np.sin(climb)
    t_s, t_c = thrust * np.sin(alpha + TILT) / MASS, thrust * np.cos(alpha + TILT) / MASS

    def linear(constant: float, **by: float) -> str:
        return " + ".join([f"({constant:.9e})", *(f"({value:.9e}) * {name}" for name, value in by.items())])

    def table(**entries: str) -> str:
        return "{" + ", ".join(f'{name} = "{text}"' for name, text in entries.items()) + "}"

    k = AREA * pressure
    equations = [
        "V = " + table(
            V=linear(-AREA * rho * V * cd, CDV=-k / V0), alpha=linear(down - t_s, CDa=-k), theta=linear(-down),
            thrust=linear(t_c / thrust),
        ),
        "alpha = " + table(
            V=linear(-0.5 * AREA * rho * cl + (t_s - down) / V**2, CLV=-k / V / V0),
            alpha=linear(-(t_c + ahead) / V, CLa=-k / V), theta=linear(ahead / V), q="1",
            thrust=linear(-t_s / thrust / V),
        ),
        "theta = " + table(q="1"),
        "q = " + table(
            V=linear(TURN * rho * V * cm, CmV=TURN * pressure / V0), alpha=linear(0.0, Cma=TURN * pressure),
            q=linear(0.0, Cmq=TURN * pressure * CHORD / V0), elevator=linear(0.0, Cmde=TURN * pressure),
            thrust=linear(ARM),
        ),
    ]  # fmt: skip
    cx, cz = cl * s - cd * c, -cl * c - cd * s
    ax = table(
        V=linear(AREA * rho * V * cx, CLV=k * s / V0, CDV=-k * c / V0),
        alpha=linear(-k * cz, CLa=k * s, CDa=-k * c),
        thrust=linear(np.cos(TILT) / MASS),
    )
    az = table(
        V=linear(AREA * rho * V * cz, CLV=-k * c / V0, CDV=-k * s / V0),
        alpha=linear(k * cx, CLa=-k * c, CDa=-k * s),
        thrust=linear(-np.sin(TILT) / MASS),
    )
    seen = "".join(f'[outputs.{n}]\nof = {{{n} = "1"}}\n' for n in ("V", "alpha", "theta", "q"))
    outputs = f'{seen}[outputs.qdot]\nrates = {{q = "1"}}\n[outputs.ax]\nof = {ax}\n[outputs.az]\nof = {az}'
    numbers = "\n".join(f"{name} = {{value = {value}}}" for name, value in START.items() if name[2] != "0")
    return parse(
        'kind = "state-space"\nname = "hfb"\n[states]\nV = "m/s"\nalpha = "rad"\ntheta = "rad"\nq = "rad/s"\n'
        '[inputs]\nelevator = "rad"\nthrust = "N"\n[equations]\n' + "\n".join(equations) + f"\n{outputs}\n"
        f"[parameters]\n{numbers}"
    )


def off(fit: Result[Any, Any], name: str) -> float:
    """How far an estimate is from the published one, in its own bounds."""
    return float((fit[name].value - PUBLISHED[name]) / fit[name].sigma)


def test_published_numbers_give_the_published_innovations(hfb: dict[str, np.ndarray]) -> None:
    """Data, equations and filter are his: at his estimates the innovations have the variances that he found."""
    aeroplane, start, inputs = hfb320(PUBLISHED), np.array(FIRST), [float(hfb[n][0]) for n in Inputs._fields]

    def seen(x: np.ndarray) -> list[float]:
        args = (State(*x), Inputs(*inputs), aeroplane.values(), AIR, FloatBackend())
        force = aeroplane.specific_force(*args)
        return [*x, aeroplane.derivatives(*args).q, force.x, force.z]

    def slopes(function: Callable[[np.ndarray], Any]) -> np.ndarray:
        ends = [np.subtract(function(start + d), function(start - d)) for d in 1e-4 * np.eye(4)]
        return np.column_stack(ends) / 2e-4

    A = slopes(lambda x: aeroplane.rates(x, inputs, aeroplane.values(), AIR, FloatBackend()))
    C, R = slopes(seen), np.diag(PUBLISHED_VARIANCES)
    # His eqs 5.17 and 5.48: the Riccati equation of continuous time, the innovations' variances for the sensors'.
    K = solve_continuous_are(A.T, C.T, np.diag(PUBLISHED_GUSTS) ** 2, 0.1 * R) @ C.T @ np.linalg.inv(R)
    table = parameterize(aeroplane, list(PUBLISHED))
    own = records(flight({n: hfb[n] for n in (*Inputs._fields, *OUTPUTS)}), aeroplane, outputs=OUTPUTS)
    likelihood = VehicleErrors(table, own, gain="free", environment=AIR, shifts=False, biases=())
    likelihood.refresh(np.array([*PUBLISHED.values(), *FIRST, *K.ravel()]) / likelihood.row.scale)
    np.testing.assert_allclose(np.diag(likelihood.covariance), PUBLISHED_VARIANCES, rtol=0.005)  # worst: 0.3 %


@pytest.mark.proof
def test_hfb_320_by_filter_error_is_the_published(hfb: dict[str, np.ndarray]) -> None:
    """His equations and noise model from his start values: all eleven estimates within their bounds, or nearly.

    Cma and Cmde are 1.3 and 1.0 bounds off. His Riccati equation is that of continuous time, and his constraint that no
    gain may pass one is active.
    """
    columns = {n: hfb[n] for n in (*Inputs._fields, *OUTPUTS)}
    fit = identify(hfb320(), flight(columns), free=list(START), outputs=OUTPUTS, environment=AIR)
    assert fit.converged
    for name in PUBLISHED:
        assert abs(off(fit, name)) < (1.4 if name in ("Cma", "Cmde") else 0.6), fit
    assert fit["Cmq"].value == pytest.approx(PUBLISHED["Cmq"], rel=0.02)
    assert fit["CDa"].value == pytest.approx(PUBLISHED["CDa"], rel=0.01)
    assert fit.model.card.parameters["Cmq"].status == "identified"
    assert fit.model.card.parameters["Cmq"].sigma == fit["Cmq"].sigma


@pytest.mark.proof
def test_hfb_320_linearised_is_near_the_published(hfb: dict[str, np.ndarray]) -> None:
    """Linearised with the thrust as an input: 0.2, 1.0, 0.3, 0.4, 1.1, 0.9, 2.3 and 1.9 bounds off.

    Without the thrust the drag is 4.5 and 2.8 bounds off. Output error, which knows no turbulence, is 25 % off on the
    lift slope.
    """
    aircraft = hfb_model(hfb)
    columns = {n: hfb[n] - hfb[n].mean() for n in (*aircraft.inputs, *aircraft.outputs)}
    fit = identify(aircraft, flight(columns), biases=["ax", "az"], method="filter-error")
    assert fit.converged
    for name in START:
        if name[2] != "0":
            assert abs(off(fit, name)) < (2.5 if name in ("Cmq", "Cmde") else 1.3), fit
    assert fit["CLa"].value == pytest.approx(PUBLISHED["CLa"], rel=0.01)
    assert fit["Cmq"].value == pytest.approx(PUBLISHED["Cmq"], rel=0.06)
    assert fit["CDa"].value == pytest.approx(PUBLISHED["CDa"], rel=0.03)
    naive = identify(aircraft, flight(columns), biases=["ax", "az"], iterations=25)
    assert abs(naive["CLa"].value / PUBLISHED["CLa"] - 1.0) > 0.2
