"""Where flights in C are not to be had. That they are XLA's flights is asked where XLA flies the same: with sensors in
`filtering/test_batched_matrices`, with late commands in `control/analysis/test_late_commands`."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import swashplate as sp
from swashplate.arrays import Array
from swashplate.control.laws.hold import hover_hold
from swashplate.control.lqg.design import design
from swashplate.export import closed_loop_c
from swashplate.export.closed_loop_c import loop_in_c
from swashplate.simulation.closed_loop import simulate_closed_loop


def test_a_law_without_c_and_a_machine_without_a_compiler_leave_it_to_xla(monkeypatch: pytest.MonkeyPatch) -> None:
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    assert loop_in_c(coax, hover_hold(coax, hover), hover) is None
    monkeypatch.setattr(closed_loop_c, "can_compile", lambda: False)
    assert loop_in_c(coax, design(coax, sensors=()), hover) is None


def test_flights_in_two_threads_are_those_of_one() -> None:
    """The library is one, and ctypes lets other threads run: nothing of a flight may lie in it."""
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    controller = design(coax, sensors=())
    fly = loop_in_c(coax, controller, hover)
    assert fly is not None

    def flown(place: float) -> Array:
        height = {"z": -place}
        flight = simulate_closed_loop(
            coax, controller, duration=5.0, start=hover, reference=height, rate=500.0, fly=fly
        )
        return flight.array(("z", "u", "omega_upper"))

    places = [0.02 * (k + 1) for k in range(12)]
    alone = [flown(place) for place in places]
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(flown, places))
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one, other)
