"""Arithmetic on responses: exact numbers, errors as a draw of many noisy responses has them, refusals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import IdentificationError
from swashplate.identification.responses.frequency_response import FrequencyResponse

OMEGA = np.geomspace(0.5, 40.0, 60)
PLANT = 20.0 / (1j * OMEGA * (1j * OMEGA / 15.0 + 1.0))
LAG = 1.0 / (0.1j * OMEGA + 1.0)


def made(h: np.ndarray, output: str = "p", input: str = "lateral", *, error: float = 0.02) -> FrequencyResponse:
    cells = h[:, None, None]
    one = np.ones(cells.shape)
    unit = "1" if output == input or output == "back" else "rad/s"
    return FrequencyResponse(
        OMEGA, (input,), (output,), cells, 0.9 * one, one[:, :, 0], error * one, one[:, 0], one[:, :, 0], one,
        input_units=("1",), output_units=(unit,),
    )  # fmt: skip


def h_of(found: FrequencyResponse) -> np.ndarray:
    return np.asarray(found.response[:, 0, 0])


def test_every_operation_and_its_way_back() -> None:
    a, b = made(PLANT, "p", "servo"), made(LAG, "back", "lateral")
    np.testing.assert_allclose(h_of(sp.combine("product", a, b)), PLANT * LAG, rtol=1e-12)
    np.testing.assert_allclose(h_of(sp.combine("ratio", made(PLANT * LAG), made(LAG, "servo"))), PLANT, rtol=1e-12)
    np.testing.assert_allclose(h_of(sp.combine("inverse", a)), 1.0 / PLANT, rtol=1e-12)
    negative = sp.combine("negative", a)
    np.testing.assert_allclose(h_of(negative), -PLANT, rtol=1e-12)
    assert (negative.outputs, negative.inputs) == (("p",), ("servo",))
    loop = made(PLANT, "back", "actuator")
    closed = sp.combine("closed", loop)
    np.testing.assert_allclose(h_of(closed), PLANT / (1.0 + PLANT), rtol=1e-12)
    back = sp.combine("broken", closed)
    np.testing.assert_allclose(h_of(back), PLANT, rtol=1e-9)
    np.testing.assert_allclose(back.error, loop.error, rtol=1e-9)
    np.testing.assert_allclose(back.coherence, loop.coherence, rtol=1e-9)


def test_names_and_units_follow() -> None:
    a, b = made(PLANT, "p", "servo"), made(LAG, "back", "lateral")
    product = sp.combine("product", a, b)
    assert (product.outputs, product.inputs, product.output_units) == (("p",), ("lateral",), ("rad/s",))
    ratio = sp.combine("ratio", made(PLANT, "p"), made(LAG, "servo"))
    assert (ratio.outputs, ratio.inputs) == (("p",), ("servo",))
    by_output = sp.combine("ratio", made(PLANT, "p", "a"), made(LAG, "p", "b"))
    assert (by_output.outputs, by_output.inputs) == (("b",), ("a",))
    inverse = sp.combine("inverse", a)
    assert (inverse.outputs, inverse.inputs, inverse.output_units) == (("servo",), ("p",), ("1",))


@pytest.mark.parametrize("operation", ["product", "ratio", "inverse", "closed", "broken"])
def test_errors_are_those_of_many_noisy_responses(operation: str) -> None:
    """Scatter of 4000 draws beside the error that is told, both of magnitude and phase."""
    random = np.random.default_rng(3)
    two = operation in ("product", "ratio")
    unit = "back" if not two else "p"
    first, second = made(PLANT, unit, "x", error=0.02), made(LAG, "back" if operation == "product" else "y", "x")
    found = sp.combine(operation, first, second if two else None)  # type: ignore[arg-type]
    noise = 0.02 * (random.standard_normal((2, 2, 4000, 1)) * np.array([1.0, 1j])[:, None, None]).sum(axis=1)
    a, b = PLANT * (1.0 + noise[0]), LAG * (1.0 + noise[1])
    results = {
        "product": a * b, "ratio": a / b, "inverse": 1.0 / a, "closed": a / (1.0 + a), "broken": a / (1.0 - a)
    }  # fmt: skip
    scatter = np.std(np.real(results[operation] / h_of(found)), axis=0)
    np.testing.assert_allclose(scatter, found.error[:, 0, 0], rtol=0.12)


def test_frequencies_need_not_be_the_same() -> None:
    other = np.geomspace(1.0, 30.0, 45)
    b = made(LAG, "back", "lateral")
    lag = 1.0 / (0.1j * other + 1.0)
    cells, one = lag[:, None, None], np.ones((other.size, 1, 1))
    b = replace(
        b, omega=other, response=cells, coherence=0.9 * one, error=0.02 * one, multiple=one[:, 0],
        input_power=one[:, 0], output_power=one[:, 0], input_coherence=one,
    )  # fmt: skip
    found = sp.combine("product", made(PLANT, "p", "servo"), b)
    assert found.omega[0] >= 1.0
    assert found.omega[-1] <= 30.0
    np.testing.assert_allclose(h_of(found), (PLANT * LAG)[(OMEGA >= 1.0) & (OMEGA <= 30.0)], rtol=2e-3)


def test_what_is_wrong_is_named(tmp_path: Path) -> None:
    a, b = made(PLANT), made(LAG, "back")
    for words, call in {
        "is no operation": lambda: sp.combine("product_", a, b),  # type: ignore[arg-type]
        "takes two responses": lambda: sp.combine("ratio", a),
        "takes one response": lambda: sp.combine("closed", a, b),
        "returns what goes into it": lambda: sp.combine("closed", a),
        "goes into the first": lambda: sp.combine("product", b, a),
        "share neither": lambda: sp.combine("ratio", a, made(LAG, "q", "longitudinal")),
        "one pair": lambda: sp.combine("inverse", replace(a, outputs=("p", "q"), response=np.ones((60, 2, 1)) + 0j)),
    }.items():
        with pytest.raises(IdentificationError, match=words):
            call()
    far = replace(b, omega=1e4 * OMEGA)
    with pytest.raises(IdentificationError, match="no common band"):
        sp.combine("product", a, far)
    saved = sp.combine("inverse", a).save(tmp_path / "inverse.nc")
    np.testing.assert_allclose(h_of(FrequencyResponse.load(saved)), 1.0 / PLANT)
