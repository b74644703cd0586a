"""The batch on whatever JAX computes on, measured: here a processor, with few vehicles; a card has not been at hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import pytest
from benchmarks import device

import swashplate as sp


def _turning(equations: Any, keep: int) -> Any:
    """In place of a vehicle: states that turn, compiled in no time."""
    del equations

    def program(x0: Any, rows: Any, p: Any, dt: Any) -> Any:
        del rows, p
        return jax.lax.fori_loop(0, keep, lambda _, x: x + dt * jnp.sin(x), x0)[None]

    return jax.jit(program)


def test_a_batch_is_measured_on_the_device_that_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "batch_program", _turning)
    vehicle = sp.vehicle("coax")
    found = device.measure(vehicle, vehicles=4, repeats=1, peaks=(1e12, 1e11))
    assert (found.device, found.vehicles, found.steps) == (jax.devices()[0].device_kind, 4, 100)
    assert found.rate > 0.0
    assert found.close
    assert found.away > 1e-9, "float32 is not float64"
    assert not replace(found, away=2e-4).close
    states = len(vehicle.state_names)
    assert 2 * states <= found.flops < 4 * states, "a product and a sum of each, XLA counts sines apart"
    assert 2 * 4 * states <= found.bytes < 16 * 4 * states, "each state is read and written at least once"
    assert found.flops_share == pytest.approx(found.rate * found.flops / 1e12)
    assert found.bytes_share == pytest.approx(found.rate * found.bytes / 1e11)


@pytest.mark.proof
def test_a_coax_in_float32_stays_with_float64_for_a_second() -> None:
    found = device.measure(sp.vehicle("coax"), vehicles=64, repeats=1)
    assert found.close
    # What `research/speed.md` reckons with.
    assert found.flops == pytest.approx(12_477, rel=0.1)
    assert found.bytes == pytest.approx(10_908, rel=0.3)


def test_crazyflow_computes_before_jax_is_switched_to_double_precision(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    found = device.Measured("a card", 4, 100, 2e9, 1e-5, 1.0, 1.0)
    monkeypatch.setattr(device, "measure", lambda *_, **__: (told.append("ours"), found)[1])
    monkeypatch.setattr(device, "crazyflow", lambda **asked: (told.append(f"theirs {asked['steps']}"), 3.0)[1])
    monkeypatch.setattr("sys.argv", ["device", "--crazyflow", "--seconds", "2"])
    device.main()
    assert told == ["theirs 200", "ours"]


def test_what_is_not_installed_is_said() -> None:
    assert device.crazyflow(vehicles=2, steps=1) == "crazyflow is not installed: not compared"
