"""Controllers from their files, and for a vehicle."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from swashplate.control.kinds import kind_of, load_controller
from swashplate.errors import ControllerError
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.controller import Controller
from swashplate.simulation.trim import Trim


def from_file(path: str | Path, *, seed: int = 0) -> Callable[[Vehicle, Trim], Controller]:
    """What makes the controller of a file for a vehicle and its trim, as `simulate_maneuver` takes it.

    Args:
        path: the file.
        seed: of the noise that a controller with sensors of its own sees.

    Raises:
        ControllerError: as `load_controller`; later, where it is for another vehicle.
    """
    saved = load_controller(path)

    def make(vehicle: Vehicle, trim: Trim) -> Controller:
        try:
            made: Controller = kind_of(saved).about(saved, vehicle, trim, seed=seed)
        except ControllerError as error:
            raise ControllerError(error.problem, where=path, channel=error.channel, hint=error.hint) from None
        return made

    return make


def flown_by(
    controller: Controller | str | Path, vehicle: Vehicle, trim: Trim, *, seed: int = 0
) -> tuple[Controller, str]:
    """A controller or its file, for a vehicle at a trim, and what it is called.

    Raises:
        ControllerError: as `from_file`.
    """
    if isinstance(controller, str | Path):
        return from_file(controller, seed=seed)(vehicle, trim), Path(controller).name
    made: Controller = kind_of(controller).about(controller, vehicle, trim, seed=seed)
    return made, controller.type or type(controller).__name__
