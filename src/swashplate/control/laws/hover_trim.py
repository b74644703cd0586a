"""The manual trim of the paper, done by the machine: what the integrals of a hover have found becomes the trim."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swashplate.control.laws.autopilot import Autopilot
from swashplate.errors import FlightError
from swashplate.flights.flight import Flight
from swashplate.models.vehicle import Vehicle
from swashplate.physics.drive_train import steady_speed

_AT_REST = 0.05
"""m/s of speed in any direction (root mean square) that still counts as hovering."""


@dataclass(frozen=True)
class HoverTrim:
    """The commands that held a hover.

    Attributes:
        commands: mean commands by input.
        scatter: their standard deviations.
        voltage: mean battery voltage [V].
        omega_lower: rotor speed that the lower motor's command holds (eq. 22) [rad/s].
        lag: phase lag of the lower rotor at that speed (eq. 21) [rad]; a payload that no card knows is in it.
        mass: what the two rotors carried [kg].
    """

    commands: dict[str, float]
    scatter: dict[str, float]
    voltage: float
    omega_lower: float
    lag: float
    mass: float

    def applied(self, controller: Autopilot) -> Autopilot:
        """The controller with these servo trims."""
        c = self.commands
        return controller.with_gains(trim_roll=c["servo_roll"], trim_pitch=c["servo_pitch"])


def hover_trim(vehicle: Vehicle, flight: Flight, *, window: float = 10.0, gravity: float = 9.81) -> HoverTrim:
    """The trim from the last seconds of a hover with the integrals at work ("place" mode), simulated or logged.

    Args:
        vehicle: whose drive trains and rotors turn commands into speed, lag and lift.
        flight: with the four commands as sent, u, v, w and voltage.
        window: how much of its end is averaged [s].
        gravity: [m/s^2].

    Raises:
        FlightError: where the flight is shorter, or the aircraft was not at rest.
    """
    if flight.duration < window:
        raise FlightError(f"lasts {flight.duration:.1f} s, expected at least the window of {window:g} s.")
    end = flight.between(flight.duration - window, flight.duration)
    for name in ("u", "v", "w"):
        speed = float(np.sqrt(np.mean(end.values(name) ** 2)))
        if not speed < _AT_REST:
            raise FlightError(
                f"is {speed:.2f} m/s in the last {window:g} s, expected less than {_AT_REST:g} for a trim.",
                channel=name,
                hint="Hover longer, in calm air.",
            )
    commands = {name: float(np.mean(end.values(name))) for name in vehicle.input_names}
    scatter = {name: float(np.std(end.values(name))) for name in vehicle.input_names}
    voltage, card = float(np.mean(end.values("voltage"))), vehicle.card.values()
    omega = {
        rotor: steady_speed(
            commands[f"motor_{rotor}"],
            voltage,
            k=card[f"k_drive_{rotor}"],
            o=card[f"o_drive_{rotor}"],
            k_voltage=card["k_drive_voltage"],
            nominal=card["voltage_nominal"],
        )
        for rotor in ("lower", "upper")
    }
    lift = sum(card[f"k_thrust_{rotor}"] * speed**2 for rotor, speed in omega.items())
    lag = card["k_zeta_lower"] * omega["lower"] + card["o_zeta_lower"]
    return HoverTrim(commands, scatter, voltage, omega["lower"], lag, lift / gravity)
