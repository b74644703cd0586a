"""Equations as text, and those of a linear model."""

from __future__ import annotations

from pathlib import Path

import pytest

import swashplate as sp
from swashplate.errors import IdentificationError
from swashplate.identification.recursive.equation import coefficient_unit, model_equations, regression_equation


def test_an_equation_is_read() -> None:
    e = regression_equation(" u_dot = Xu*u - 9.81*theta + 2e-1*w + Xd * pitch.cmd+bias", delays={"pitch.cmd": 0.02})
    assert (e.left, e.derivative, e.bias) == ("u", True, True)
    assert e.regressors == {"Xu": "u", "Xd": "pitch.cmd"}
    assert e.known == {"theta": -9.81, "w": 0.2}
    assert e.channels == ("u", "pitch.cmd", "theta", "w")
    assert e.names == ("Xu", "Xd", "bias")
    assert regression_equation("az = Zw*w").derivative is False


@pytest.mark.parametrize(
    "text",
    [
        "", "p_dot", "= Lp*p", "p_dot =", "p_dot = Lp", "p_dot = Lp*p Lq*q", "p_dot = -Lp*p", "p_dot = Lp*p + Lp*q",
        "p_dot = 2*p", "p_dot = bias + bias", "p_dot = Lp*p + bias*q", "p_dot = Lp*p +", "1p = Lp*p", "p_dot = Lp*p*q",
    ],
)  # fmt: skip
def test_what_is_no_equation_is_refused(text: str) -> None:
    with pytest.raises(IdentificationError):
        regression_equation(text)


@pytest.mark.parametrize("delay", [-0.1, float("nan"), float("inf")])
def test_a_delay_that_is_none_is_refused(delay: float) -> None:
    with pytest.raises(IdentificationError, match="delay of p"):
        regression_equation("p_dot = Lp*p", delays={"p": delay})


def test_the_rows_of_a_model_whose_states_are_measured() -> None:
    model = sp.structure("six_dof").structure
    assert model is not None
    channels = (*model.states, *model.inputs)
    found, left_out = model_equations(model, channels)
    assert found
    by_state = {e.left: e for e in found}
    assert all(e.derivative and e.bias for e in found)
    fixed = model.with_values({}, free=True)
    assert {n for e in found for n in e.regressors} <= set(fixed.free)
    state = next(iter(by_state))
    assert not any(e.left == state for e in model_equations(model, [c for c in channels if c != state])[0])
    assert len(found) + len(left_out) == len(model.states)


def test_hidden_states_leave_their_equations_out(tmp_path: Path) -> None:
    model = sp.structure("rotor_body").structure
    assert model is not None
    found, left_out = model_equations(model, ("p", "q", "lateral", "longitudinal"))
    assert not found
    assert any("is not in the stream" in words for words in left_out)


def test_units_of_the_log_stand_where_the_schema_knows_none() -> None:
    equation = regression_equation("p_dot = La*A1 + Lx*mystery + bias")
    units = {"A1": "rad"}
    assert coefficient_unit(equation, "La", units) == "(rad/s^2)/(rad)"
    assert coefficient_unit(equation, "Lx", units) == ""
    assert coefficient_unit(equation, "bias", units) == "rad/s^2"
