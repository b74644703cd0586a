"""From a log to a controller that flies: many late, quantised, gusty aircraft drawn from a fit with delays."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from made_results import result
from proof_page import leave
from swashplate.api.monte_carlo import MonteCarlo
from swashplate.api.verbs.data import Demo
from swashplate.api.verbs.simulate import Simulate
from swashplate.control.draws.spread import Limits
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.wind import indoor

LIMITS = Limits(lean=math.radians(20.0), place=0.25, height=0.25, heading=math.radians(10.0))
SENSORS = "imu@100,mocap@100+10ms"
BITS = 8


def late(vehicle: Vehicle) -> Vehicle:
    """The card with delays as a fit leaves them."""
    return vehicle.with_card(replace(vehicle.card, observer={"nuisance": {"delay_servo": 0.034, "delay_motor": 0.062}}))


@pytest.mark.proof
def test_a_design_that_knows_its_delays_flies_and_one_that_does_not_is_lost() -> None:
    """The short form: few aircraft, few seconds; the second controller is the mutation."""
    coax = sp.vehicle("coax")
    aircraft = late(coax)
    values = {"tau_f_upper": 1.6, "linkage_lower": 0.1355}
    fit = result(coax, values, np.diag([0.1, 0.005]) ** 2)
    lost = {}
    # Without its delays even the law that is told the true states loses all of them.
    for name, model, method in (("knows", aircraft, "lqg"), ("ignores", coax, "lqr")):
        made = sp.design_controller(model, method=method, sensors=SENSORS)  # type: ignore[arg-type]
        flown = sp.monte_carlo(
            aircraft,
            made.controller,
            maneuver="hover:3s",
            count=6,
            fit=fit,
            gusts=indoor(0.1),
            battery=(12.5, 11.5),
            command_bits=BITS,
            limit=LIMITS,
        )
        lost[name] = flown.lost
        assert flown.flights["x"].shape[1] == 6
        # The last command that acts is a whole number of steps of 8 bits.
        steps = flown.flights.rows[-1, 0] * (2**BITS - 1)
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert lost == {"knows": 0, "ignores": 6}


@pytest.mark.proof
def test_the_coax_from_its_real_log_to_a_hundred_aircraft(shared_data: Path) -> None:
    """The August flight: what the fit found of delays is flown, in still air and in gusts of 0.3 m/s."""
    found = Demo().answer()
    model = found.model
    made = sp.design_controller(model, sensors=SENSORS)
    assert "identified" in made.late
    check = sp.check_controller(model, made.controller, gusts=indoor(0.3))
    assert check.problems == ()
    flights = {}
    for air, gusts in (("still", None), ("0.3 m/s", indoor(0.3))):
        flights[air] = sp.monte_carlo(
            model,
            made.controller,
            maneuver="hover:20s",
            count=100,
            fit=found,
            gusts=gusts,
            battery=(12.5, 10.5),
            command_bits=BITS,
            limit=LIMITS,
        )
    _left("log_to_flight_coax", "The CoaX from its August log to 100 aircraft", made.late, flights)
    assert {air: flown.lost for air, flown in flights.items()} == {"still": 0, "0.3 m/s": 0}


@pytest.mark.proof
def test_the_raptor_from_its_log_to_a_hundred_aircraft(tmp_path: Path) -> None:
    """Servos and 30 ms between logged command and motion: the fit finds the delay; hover, then to 10 m/s."""
    card = sp.vehicle("raptor50", servos=True)
    truth = card.with_values({"hub_stiffness": 30.0, "wake_distortion": 1.2, "blade_inertia": 0.0215})
    log = Simulate(truth, "multisine:roll+pitch,0.6-5Hz,9s,0.02", sensors="clean", seed=1).answer().flight
    for name in truth.input_names:  # logged 30 ms before they act
        values, late_by = log.values(name), round(0.03 * log.rate(name))
        log = log.with_channel(name, np.concatenate([values[late_by:], np.repeat(values[-1:], late_by)]), like=name)
    free = ("hub_stiffness", "blade_inertia", "wake_distortion")
    fit = sp.identify(card, log.condition(rate=100.0, cutoff=0.0), free=free, method="output-error")
    model = fit.model
    assert list(input_delays(model).values()) == pytest.approx([0.03] * 4, abs=0.001)
    sensors = "gyro@100,mocap@100+10ms"
    hovers = sp.design_controller(model, sensors=sensors)
    ahead = sp.design_controller(model, sensors=sensors, holding="speed", speed=(0.0, 2.5, 5.0, 7.5, 10.0))
    flights = {}
    for air, gusts in (("still", None), ("0.3 m/s", indoor(0.3))):
        for what, made, maneuver in (("hover", hovers, "hover:20s"), ("to 10 m/s", ahead, "step:ahead,16s,10")):
            flights[f"{what}, {air}"] = sp.monte_carlo(
                model,
                made.controller,
                maneuver=maneuver,
                count=100,
                fit=fit,
                gusts=gusts,
                command_bits=10,
                limit=LIMITS,
            )
    _left("log_to_flight_raptor", "The Raptor 50 from a log to 100 aircraft", hovers.late, flights)
    for flown in flights.values():
        assert flown.lost == 0
        assert flown.remarks in ((), ("a speed is asked for: the place is not judged.",))


def _left(name: str, title: str, late: str, flights: dict[str, MonteCarlo]) -> None:
    """The table of docs/proof.md."""
    head = ["air", "lost", "place, largest [m]", "height, largest [m]", "heading, largest [deg]", "lean, largest [deg]"]
    rows = [
        [air, flown.lost, *(flown.spread.figures[f"{column.split(' [')[0]} [{column.split('[')[1]}"][-1]
                            for column in head[2:])]
        for air, flown in flights.items()
    ]  # fmt: skip
    count = next(iter(flights.values())).spread.flights
    text = f"{count} aircraft drawn from the fit. Commands are late by {late}. Limits: {LIMITS.summary_text()}."
    leave(name, {"title": title, "text": text, "columns": head, "rows": rows, "passed": not any(r[1] for r in rows)})
