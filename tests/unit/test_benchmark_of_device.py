"""The batch on whatever JAX computes on, measured: here a processor, with few vehicles; a card has not been at hand."""

from __future__ import annotations

from dataclasses import replace

import jax
import pytest
from benchmarks import device

import swashplate as sp


def test_a_batch_is_measured_on_the_device_that_is_there() -> None:
    found = device.measure(sp.vehicle("crazyflie"), vehicles=4, repeats=1, peaks=(1e12, 1e11))
    assert (found.device, found.vehicles, found.steps) == (jax.devices()[0].device_kind, 4, 100)
    assert found.rate > 0.0
    assert found.close
    assert found.away > 1e-9, "float32 is not float64"
    assert not replace(found, away=2e-4).close
    # A step of a quadrotor is some hundred to some ten thousand operations, on at least its own states.
    assert 1e2 < found.flops < 1e5
    assert found.bytes > 2 * 4 * len(sp.vehicle("crazyflie").state_names)
    assert found.flops_share == pytest.approx(found.rate * found.flops / 1e12)
    assert found.bytes_share == pytest.approx(found.rate * found.bytes / 1e11)


def test_what_is_not_installed_is_said() -> None:
    assert device.crazyflow(vehicles=2, steps=1) == "crazyflow is not installed: not compared"
