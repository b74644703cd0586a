"""The decoupling law on estimated velocity: as straight as on the true one, without motion capture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swashplate.control.controller_file import read_controller, save_controller
from swashplate.control.laws.autopilot import autopilot
from swashplate.control.laws.observed_autopilot import ObservedAutopilot
from swashplate.control.lqg.design import design
from swashplate.errors import ControllerError
from swashplate.filtering.sensor_suite import suite
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.trim import trim


def made_for(coax: Vehicle) -> ObservedAutopilot:
    observer = design(coax, sensors=suite("imu@100,flow@25+40ms,sonar,compass"), rate=100.0)
    return ObservedAutopilot(autopilot(coax, trim(coax), mode="manual"), observer)


def test_its_file_and_an_observer_that_does_not_go_with_it(tmp_path: Path) -> None:
    coax = vehicle("coax")
    made, law = made_for(coax), autopilot(coax, trim(coax), mode="manual")
    save_controller(made, tmp_path / "o.toml")
    again = read_controller(tmp_path / "o.toml")
    assert isinstance(again, ObservedAutopilot)
    np.testing.assert_array_equal(again.memory_of_law(), made.memory_of_law())
    with pytest.raises(ControllerError, match="an observer with sensors at its own rate"):
        ObservedAutopilot(law, design(coax, sensors=suite("gyro@50,mocap@50"), rate=50.0))


@pytest.mark.proof
def test_figure_10_on_estimates() -> None:
    coax = vehicle("coax")
    flight = simulate_closed_loop(coax, made_for(coax), duration=4.6, reference={"pitch": 0.2}, rate=500.0)
    assert flight.values("u").max() == pytest.approx(1.77, abs=0.03)
    assert flight.values("y")[-1] == pytest.approx(0.65, abs=0.1)  # 0.65 m on the true velocity, -0.74 m without law
