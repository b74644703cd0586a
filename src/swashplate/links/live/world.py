"""What flies on the live page as it begins: hover, the pilot's law, how late inputs act."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from swashplate.arrays import Array
from swashplate.links.live.picture import picture
from swashplate.links.live.pilots import Mode, Pilot, pilot
from swashplate.links.live.sensors import TrackedSensors, sensors_of
from swashplate.links.live.steadiness import holds
from swashplate.models.surroundings import environment_of, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Controller
from swashplate.simulation.linearize import linearize
from swashplate.simulation.stepping import LONGEST_STEP
from swashplate.simulation.trim import Trim
from swashplate.simulation.trim import trim as find_trim
from swashplate.simulation.wind import GustFilter, Gusts, filters_of_gusts

PHYSICS_RATE = 500.0
"""Runge-Kutta steps per second [Hz], in the air."""
MOST_DRAWS = 20
"""Drawn models that the code has a place for, and an exported page at most."""
FAN_SECONDS = 2.0
"""How long drawn models fly on their own."""
OPENS: Mode = "attitude"
"""The mode in which a page opens, where the law flies it."""
HELD: tuple[Mode, ...] = ("attitude", "velocity", "position")
"""The modes in which the pilot holds the hover by itself."""
NOT_HELD = "does not hold the hover with the identified {cause}, a controller made for them would"
REMEMBERED = 0.3
"""Seconds of commands that the code keeps at least, so that a fit's delays need no code of their own."""
_GUST_LENGTH, _GUST_SPEED = 5.0, 2.0


class World:
    """What flies, at its start; the page flies it (`page/flight.js`).

    Args:
        vehicle: what flies.
        controller: a designed controller, or None for the default ones.
        believed: what the pilot's law is made for; the vehicle where None.
        draws: models that a fit cannot tell from this one. They fly beside it under the same law and sticks, and begin
            anew where it is every `FAN_SECONDS`.
        at_once: leave out the delays that the card knows, or that the controller was made for.

    Attributes:
        environment: of its hover. nominal_voltage: of its battery [V], None without.
        start_height: of its hover [m]. trim: the hover. pilot: the law. mode: in which it begins.
        substeps: of physics in one period of the law. period: of the law [s].
        delays: from command to actuator [s], by input.
        steps_back: how many periods ago the input was given that acts in a step, shape (1 + drawn models, substeps,
            n_inputs).
        sensors: what the pilot reads, of it and of each drawn model.
        depth: how many commands the code keeps.
        not_held: why the page's own pilot does not hold the hover, in words; "" where it does.

    Raises:
        SwashError: where it has no hover, or the controller is for another vehicle.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        *,
        controller: Controller | None = None,
        believed: Vehicle | None = None,
        draws: Sequence[Vehicle] = (),
        at_once: bool = False,
    ) -> None:
        self.vehicle, self.draws, self._controller = vehicle, tuple(draws), controller
        self.nominal_voltage = vehicle.card.values().get("voltage_nominal")
        self.environment = environment_of(vehicle)
        self.start_height = max(2.0, 8.0 * picture(vehicle)["size"])
        self.trim: Trim = find_trim(vehicle, height=self.start_height, environment=self.environment)
        self.pilot: Pilot = self.law_for(believed or vehicle)
        self.mode = OPENS if OPENS in self.pilot.modes else self.pilot.modes[-1]
        # Skids and stopped rotors need the step that links take.
        rate = 1.0 / LONGEST_STEP if vehicle.card.options.get("ground") else PHYSICS_RATE
        self.substeps = round(rate / self.pilot.rate)
        self.period = self.substeps / rate
        flying = (vehicle, *draws)
        delays = [np.zeros(len(vehicle.input_names)) if at_once else self._delays_of(one) for one in flying]
        self.delays = delays[0]
        self.steps_back = np.stack([steps_back(one, self.substeps, rate) for one in delays])
        self.sensors = [sensors_of(one) if self.pilot.reads else TrackedSensors() for one in flying]
        self.depth = 1 + max(int(np.max(self.steps_back)), round(REMEMBERED / self.period))
        self.not_held = self._not_held() if controller is None else ""
        if self.not_held:
            self.pilot = replace(self.pilot, title=f"{self.pilot.title}: {self.not_held}")

    def _delays_of(self, vehicle: Vehicle) -> Array:
        if self.pilot.delays is not None:
            return self.pilot.delays
        known = input_delays(vehicle)
        return np.array([known.get(name, 0.0) for name in vehicle.input_names])

    def _not_held(self) -> str:
        """Why the pilot does not hold the hover, in words: the delays alone, the sensors alone, or both."""
        back, read = self.steps_back[0], self.sensors[0]
        if not (back.any() or any(read.placed)):
            return ""
        model, modes = linearize(self.vehicle, self.trim), set(HELD) & set(self.pilot.modes)
        for cause, delays, shown in (
            ("delays", back, TrackedSensors()),
            ("sensors", 0 * back, read),
            ("delays and sensors", back, read),
        ):
            if not all(holds(self.pilot, mode, model, delays, shown) for mode in modes):
                return NOT_HELD.format(cause=cause)
        return ""

    def law_for(self, vehicle: Vehicle) -> Pilot:
        """The pilot's law, made for the numbers of some vehicle of the same kind.

        Raises:
            SwashError: where it has no hover, or the controller is for another vehicle.
        """
        about = find_trim(vehicle, height=self.start_height, environment=self.environment)
        return pilot(vehicle, about, controller=self._controller)


def gust_filters(*, rate: float) -> list[GustFilter]:
    """White noise to the page's turbulence with a standard deviation of 1 m/s, at so many samples a second."""
    return filters_of_gusts(page_gusts(1.0), rate)


def page_gusts(sigma: float) -> Gusts:
    """The page's turbulence of a standard deviation [m/s]."""
    return Gusts((sigma, sigma, 0.6 * sigma), (_GUST_LENGTH,) * 3, _GUST_SPEED)


def steps_back(delays: Array, substeps: int, rate: float) -> NDArray[np.int_]:
    """How many controller steps ago the input was given that acts in a substep, shape (substeps, n_inputs)."""
    waits = np.round(delays * rate).astype(np.int_)
    return np.asarray(np.maximum(0, -((np.arange(substeps)[:, None] - waits) // substeps)))
