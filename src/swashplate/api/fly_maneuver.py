"""A maneuver flown by a vehicle, as a flight like any other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from swashplate.api.controllers import flown_by
from swashplate.api.languages import in_seconds
from swashplate.control.kinds import kind_of
from swashplate.control.laws.hold import hover_hold
from swashplate.control.laws.state_hold import state_hold
from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.flights.tabular import write_csv
from swashplate.models.surroundings import input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.flight_page import compose_flight
from swashplate.reporting.structure import Report
from swashplate.shown import Shown
from swashplate.simulation.closed_loop import simulate_maneuver
from swashplate.simulation.controller import Controller
from swashplate.simulation.integrate import simulate_open_loop
from swashplate.simulation.sensors import QUIET, Sensors, observe
from swashplate.simulation.trim import Trim

if TYPE_CHECKING:
    from swashplate.api.verbs.simulate import Simulate

_HELD = 0.02  # share of a flight that an input may stand at a limit before that is said
_WIND = ("wind_north", "wind_east", "wind_down")


@dataclass(frozen=True, repr=False)
class SimulatedFlight(Shown):
    """A maneuver that was flown.

    Attributes:
        vehicle, maneuver: what flew what.
        truth: states and inputs as they were.
        flight: as sensors saw it; the truth where there were none.
        remarks: where it may not be believed.
    """

    vehicle: Vehicle
    maneuver: str
    truth: Flight
    flight: Flight
    remarks: tuple[str, ...] = ()

    def to_document(self) -> dict[str, object]:
        """Every state and input at the start, at the end, and how far it went [SI units]."""
        channels = (*self.vehicle.state_names, *self.vehicle.input_names)
        units = (*self.vehicle.state_units, *self.vehicle.input_units)
        columns = {channel: self.truth.values(channel) for channel in channels}
        return {
            "vehicle": self.vehicle.name,
            "maneuver": self.maneuver,
            "duration": self.truth.duration,
            "rate": round(self.truth.rate(channels[0]), 9),
            "channels": {
                channel: {
                    "unit": unit,
                    "start": columns[channel][0],
                    "end": columns[channel][-1],
                    "least": columns[channel].min(),
                    "greatest": columns[channel].max(),
                }
                for channel, unit in zip(channels, units, strict=True)
            },
            "remarks": list(self.remarks),
        }

    def save(self, path: str | Path) -> tuple[Path, ...]:
        """Write the flight: .nc (nothing lost) or .csv."""
        return save_flight(self.flight, path)

    def page(self, *, title: str | None = None) -> Report:
        """What `sp.report` writes."""
        return compose_flight(self.vehicle, self.truth, remarks=self.remarks, title=title)

    def __repr__(self) -> str:
        return repr(self.flight)


def save_flight(flight: Flight, path: str | Path) -> tuple[Path, ...]:
    """Write a flight by its suffix.

    Raises:
        SwashError: for another suffix than .nc or .csv, or a place that cannot be written to.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".nc":
        return (flight.save(path),)
    if suffix == ".csv":
        return write_csv(flight, Path(path))
    raise SwashError(f"ends in '{Path(path).suffix}', expected .nc or .csv.", where=path)


def fly(asked: Simulate, vehicle: Vehicle) -> SimulatedFlight:
    """The flight that was asked for, of a vehicle with its changes.

    Raises:
        ControllerError: where the controller is for another vehicle.
        DivergenceError: where the flight was lost, with the flight up to there.
    """
    remarks = []
    maneuver = asked.described()
    if maneuver is None:
        truth = simulate_open_loop(
            vehicle,
            asked.maneuver,
            start=asked.start,
            rate=asked.rate,
            substeps=asked.substeps,
            interpolation="linear" if asked.interpolation == "linear" else "held",
            environment=asked.environment,
            delays=in_seconds(asked.delays),
        )
    else:
        if asked.controller is None and vehicle.traits.coaxial and any(input_delays(vehicle).values()):
            remarks.append("The hover hold acts at once; identified delays are left out.")
        truth = simulate_maneuver(
            vehicle,
            maneuver,
            controller=holding(asked.controller, seed=asked.seed),
            lead=asked.lead,
            tail=asked.tail,
            pilot=asked.pilot,
            speed=asked.speed,
            voltage=asked.voltage,
            sag=asked.sag,
            rate=asked.rate,
            wind=dict(zip(_WIND, asked.wind, strict=True)),
            environment=asked.environment,
        )
    remarks += [f"{words}." for words in truth.provenance.notes] + _at_limits(vehicle, truth)
    seen = truth
    if asked.sensors != "none":
        seen = observe(truth, vehicle, sensors=QUIET if asked.sensors == "clean" else Sensors(), seed=asked.seed)
    return SimulatedFlight(vehicle, str(asked.maneuver) if maneuver else "inputs", truth, seen, tuple(remarks))


def holding(
    controller: Controller | Callable[[Vehicle, Trim], Controller] | str | Path | None = None, *, seed: int = 0
) -> Callable[[Vehicle, Trim], Controller]:
    """What makes the controller of a maneuver: that itself, one, its file, or the hold of the vehicle's kind."""

    def make(vehicle: Vehicle, trim: Trim) -> Controller:
        if callable(controller):
            made = controller(vehicle, trim)
            kind_of(made)  # says what is no controller
            return made
        if controller is not None:
            return flown_by(controller, vehicle, trim, seed=seed)[0]
        return hover_hold(vehicle, trim) if vehicle.traits.coaxial else state_hold(vehicle, trim)

    return make


def _at_limits(vehicle: Vehicle, flight: Flight) -> list[str]:
    """Inputs that stood at a limit: what they were told beyond it was not flown."""
    told = []
    for name, (low, high) in zip(vehicle.input_names, vehicle.input_limits, strict=True):
        if name in dict(vehicle.trim_held) or name not in flight:
            continue
        values = flight.values(name)
        share = float(((values <= low) | (values >= high)).mean())
        if share > _HELD:
            told.append(f"{name} stands at its limit for {100.0 * share:.0f} % of the time; fly a smaller amplitude.")
    return told
