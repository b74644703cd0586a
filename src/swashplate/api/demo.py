"""The main job on the real flights where they are found, otherwise on simulated ones."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from swashplate.api.saying import Say
from swashplate.api.verbs.identify import FitVehicle
from swashplate.control.laws.hold import hover_hold
from swashplate.flights import datasets
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.series import parse
from swashplate.flights.readers.read import read
from swashplate.identification.core.result import Result
from swashplate.models.catalogue import vehicle
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.sensors import observe
from swashplate.simulation.trim import trim

if TYPE_CHECKING:
    from swashplate.api.verbs.data import Demo

FITTED = "flight_2011-08-01_vertical.mat"
HELD_OUT = "flight_2011-07-25_hover_crash.mat"

_MANEUVERS = ("multisine:roll+pitch+yaw+heave,0.2-6Hz,40s,1", "multisine:roll+pitch+yaw+heave,0.2-6Hz,20s,1")
_AMPLITUDES = {"roll": 0.1, "pitch": 0.1, "yaw": 0.004, "heave": 0.01}
_LEAD = 3.0  # s of hover before and after
_TRUTH = {"tau_f_upper": 1.3, "linkage_lower": 0.11, "hub_stiffness_upper": 0.09}
"""What the simulated aircraft has instead of the card's numbers, for the identification to find."""


def run_demo(asked: Demo, say: Say) -> Result[object, object]:
    """The demo that was asked for; its `data` and the report's first line say which flights it took.

    The numbers of the simulated aircraft are its `truth`, and stand in the tables beside the published and the
    identified ones.
    """
    seed = asked.seed
    coax = vehicle("coax")
    files = [] if asked.simulated else [path for f in (FITTED, HELD_OUT) if (path := datasets.find("coax56", f))]
    if len(files) == 2:
        say("reading the real flights")
        fitted, held_out = (read(path) for path in files)
    else:
        say("simulating two flights")
        fitted, held_out = (simulated_log(coax, maneuver, seed=seed + i) for i, maneuver in enumerate(_MANEUVERS))
    made = FitVehicle(
        coax, fitted.condition(rate=100.0, cutoff=0.0), hold_out=held_out.condition(rate=100.0, cutoff=0.0)
    ).answer(say)
    if len(files) == 2:
        return made
    true = _aircraft(coax).card.values()
    known = {e.name: true[e.name] for e in made.estimates if e.name in true}
    return replace(made, truth=known)


def _aircraft(vehicle: Vehicle) -> Vehicle:
    """What flies in a simulated log."""
    return vehicle.with_values(_TRUTH, status="assumed", source="the demo's simulated aircraft")


def simulated_log(vehicle: Vehicle, maneuver: str, *, seed: int, rate: float = 100.0) -> Flight:
    """What motion capture and an on-board computer log of a simulated flight: noise, gaps, outliers, battery.

    Args:
        vehicle: whose card the simulated aircraft departs from.
        maneuver: of unit amplitude; every axis gets its own.
        seed: of the noise.
        rate: of the simulation [Hz].
    """
    aircraft = _aircraft(vehicle)
    excitation = parse(maneuver)
    duration = excitation.duration + 2 * _LEAD
    time = np.arange(round(duration * rate) + 1) / rate
    added = {name: np.zeros_like(time) for name in aircraft.input_names}
    for axis, signal in excitation.signals(time - _LEAD).items():
        for name, share in aircraft.stick_axes[axis].items():
            added[name] += share * _AMPLITUDES[axis] * signal
    start = trim(aircraft, voltage=aircraft.card.values()["voltage_nominal"] + 0.3)
    flight = simulate_closed_loop(
        aircraft,
        hover_hold(aircraft, start),
        duration=duration,
        excitation=added,
        voltage=float(start.environment.voltage) - 0.01 * time,
        start=start,
        rate=rate,
    )
    return observe(flight, aircraft, seed=seed)
