"""Models as python-control has them: the delays are there as Padé polynomials, or somebody said that they are not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import SwashError
from swashplate.models.linear.python_control import state_space
from swashplate.models.linear.transfer_function import Form, TransferFunction

OMEGA = np.geomspace(0.2, 8.0, 20)
ONE = (np.array([[-2.0]]), np.array([[1.0, 0.5]]), np.array([[1.0], [3.0]]), np.zeros((2, 2)))


def _made(delays: dict[str, float], *, pade: int | None) -> Any:
    return state_space(ONE, states=["x"], inputs=["a", "b"], outputs=["p", "q"], delays=delays, pade=pade, name="it")


@pytest.mark.parametrize("delays", [{"a": 0.1}, {"a": 0.1, "b": 0.03}, {"p/a": 0.1, "q/a": 0.02, "b": 0.05}])
def test_a_delay_is_in_the_response_of_every_pair(delays: dict[str, float]) -> None:
    plain, late = _made({}, pade=None), _made(delays, pade=4)
    assert late.input_labels == ["a", "b"]
    assert late.output_labels == ["p", "q"]
    for o, output in enumerate(("p", "q")):
        for i, name in enumerate(("a", "b")):
            lag = delays.get(f"{output}/{name}", delays.get(name, 0.0))
            expected = plain(1j * OMEGA)[o, i] * np.exp(-1j * OMEGA * lag)
            np.testing.assert_allclose(late(1j * OMEGA)[o, i], expected, rtol=1e-6)


def test_a_delay_that_nobody_asked_to_drop_is_warned_of() -> None:
    with pytest.warns(UserWarning, match=r"delays of it are left out \(a 100 ms\): give to_control\(pade=3\)"):
        _made({"a": 0.1}, pade=None)
    assert _made({"a": 0.1}, pade=0).nstates == 1
    assert _made({"a": 0.0}, pade=None).nstates == 1
    with pytest.raises(SwashError, match="expected 0 "):
        _made({"a": 0.1}, pade=-1)


def test_a_transfer_function_keeps_its_delay() -> None:
    form = Form.parse("0/1")
    found = TransferFunction(form, {"K": 4.0, "pole": 3.0, "tau": 0.08}, "p", "roll")
    np.testing.assert_allclose(found.to_control(pade=4)(1j * OMEGA), found.response(OMEGA), rtol=1e-6)
    with pytest.warns(UserWarning, match="delays of p/roll"):
        found.to_control()


def test_a_linearised_vehicle_has_the_delays_of_its_card() -> None:
    coax = sp.vehicle("coax")
    card = replace(coax.card, observer={**coax.card.observer, "input_delays": dict.fromkeys(coax.input_names, 0.05)})
    found = replace(sp.linearize(coax), delays=sp.linearize(replace(coax, card=card)).delays)
    assert found.delays == dict.fromkeys(coax.input_names, 0.05)
    late, plain = found.to_control(pade=3), found.to_control(pade=0)
    np.testing.assert_allclose(late(2j), plain(2j) * np.exp(-0.1j), rtol=1e-7, atol=1e-12)


def test_a_vehicle_is_its_structure_or_its_hover() -> None:
    linear = sp.vehicle("thirteen_state")
    assert linear.structure is not None
    made, own = linear.to_control(pade=2), linear.structure.to_control(pade=2)
    np.testing.assert_array_equal(made.A, own.A)
    assert made.input_labels == list(linear.input_names)
    nonlinear = sp.vehicle("coax")
    np.testing.assert_array_equal(nonlinear.to_control(pade=0).A, sp.linearize(nonlinear).A)
