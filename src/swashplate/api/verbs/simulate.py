"""`swash simulate` and `swash control monte-carlo`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import OfVehicle, name_of
from swashplate.api.languages import Aircraft, Battery, Fitted, FlightLimits, Gusts, Motion, Pilot, Wind, Words
from swashplate.api.question import option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.api.fly_maneuver import SimulatedFlight
    from swashplate.api.monte_carlo import MonteCarlo

_COMPILING = "(compiling takes longest the first time)"


class Simulate(OfVehicle["SimulatedFlight"]):
    """Fly a maneuver from hover or steady flight under a controller, and save the flight.

    --out FILE.nc (complete) or FILE.csv has the flight, --out FILE.html a page of plots over time.
    """

    files: ClassVar[tuple[str, ...]] = ("flight.nc", "report.html")
    by_name: ClassVar[tuple[str, ...]] = ("flight.csv",)
    needs_out: ClassVar[bool] = True

    vehicle: Aircraft = option(help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False)
    maneuver: Motion = option(
        help='For example "sweep:pitch,0.5-8Hz,60s" or "doublet:roll,0.5s,0.2".',
        kw_only=False,
    )
    controller: Pilot | None = option(
        default=None, help="A controller's file, of `swash control design` or `swash control decouple`."
    )
    pilot: bool = option(default=False, help="Roll and pitch of the maneuver are a pilot's commands to the controller.")
    sensors: str = option(
        default="none",
        help="The true states, motion capture with noise only, or with gaps and outliers.",
        choices=("none", "clean", "real"),
    )
    seed: int = option(default=0, help="Seed of all random numbers.", least=0)
    speed: float = option(default=0.0, help="Forward speed at the start of the maneuver.", unit="m/s")
    wind: Wind = option(default=(0.0, 0.0, 0.0), help="Wind towards north, east and down.", unit="m/s")
    sag: float = option(default=0.0, help="Fall of the battery's voltage.", unit="V/s")
    rate: float = option(default=100.0, help="Rate of the flight.", unit="Hz", least=1.0, most=2000.0)
    voltage: float | None = setting(default=None, help="battery voltage at the start", unit="V")

    def check_places(self, outs: tuple[Path, ...]) -> None:
        from swashplate.flights.maneuvers.series import parse

        if isinstance(self.maneuver, str):
            parse(self.maneuver)  # says what is wrong with it before anything else is looked at

    def answer(self, say: Say = silent) -> SimulatedFlight:
        from swashplate.api.fly_maneuver import fly

        if self.pilot and self.controller is None:
            raise SwashError("is for a --controller; the hover hold takes no commands.", channel="--pilot")
        aircraft = self.flying(self.vehicle)
        say(f"simulating {_COMPILING}")
        return fly(self, aircraft)

    def remarks(self, answer: SimulatedFlight) -> Sequence[str]:
        return careful(answer.remarks)

    def document(self, answer: SimulatedFlight) -> Any:
        return answer.to_document() | {"vehicle": name_of(self.vehicle) or self.vehicle.name}


class FlyMany(OfVehicle["MonteCarlo"]):
    """Fly a controller on many aircraft in many gusts, with sensor noise, and keep the worst flight.

    --out FILE.nc or FILE.csv has the worst flight, --out FILE.html the distribution and the worst flight.

    Raises:
        SwashError: what the model has no equation for, a maneuver that the controller cannot be told.
        ControllerError: a controller for another vehicle, a file that is none, a number that the card does not have.
    """

    files: ClassVar[tuple[str, ...]] = ("worst.nc", "report.html")
    by_name: ClassVar[tuple[str, ...]] = ("worst.csv",)

    vehicle: Aircraft = option(help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False)
    controller: Pilot = option(
        help="A controller's file, of `swash control design` or `swash control decouple`.", kw_only=False
    )
    maneuver: Motion = option(
        help='Roll and pitch are a pilot\'s commands; x, y, z, psi, ahead or right is asked of every one: "hold:10s".',
        kw_only=False,
    )
    count: int = option(default=100, help="Number of flights.", least=1)
    fit: Fitted | None = option(default=None, help="Models drawn from this fit.json.")
    gusts: Gusts = option(default="none", help="none, indoor, indoor=SIGMA, or a mean wind outdoors [m/s].")
    battery: Battery | None = option(default=None, help="Voltage at start and end, 12.5-10.5.")
    tolerances: bool = setting(default=False, help="the card's numbers drawn from their sigmas.")
    vary: Words | None = option(
        default=None, metavar="NAME=SIGMA", help="A number of the card, also NAME=5%; repeatable."
    )
    payload: float = option(default=0.0, help="Largest added mass.", unit="kg", least=0.0)
    delay: float = option(default=0.0, help="Largest added delay of commands.", unit="s", least=0.0, most=1.0)
    limit: FlightLimits | None = option(
        default=None,
        help="Limit beyond which a flight counts as lost: lean=45deg, rate=360deg/s, place=2m, height=1m, "
        "heading=45deg, or NAME=none; repeatable.",
    )
    seed: int = option(default=0, help="Seed of all random numbers.", least=0)
    command_bits: int | None = setting(default=None, help="number of bits of each command", least=4, most=24)
    voltage: float | None = setting(default=None, help="battery voltage at the start", unit="V")
    sag: float = setting(default=0.0, help="fall of the battery's voltage", unit="V/s")

    def check_places(self, outs: tuple[Path, ...]) -> None:
        if self.battery is not None and (self.voltage is not None or self.sag):
            raise SwashError("says what voltage and sag say.", channel="--battery", hint="Give one of them.")

    def answer(self, say: Say = silent) -> MonteCarlo:
        from swashplate.api.languages import numbers
        from swashplate.api.monte_carlo import fly_many

        for text in (self.vary or {}).values():
            numbers(str(text).removesuffix("%"), "--vary", count=1)
        aircraft = self.flying(self.vehicle)
        say(f"simulating {self.count} flights {_COMPILING}")
        return fly_many(self, aircraft)

    def document(self, answer: MonteCarlo) -> Any:
        return answer.to_document() | {"vehicle": name_of(self.vehicle) or self.vehicle.name}

    def remarks(self, answer: MonteCarlo) -> list[str]:
        return [f"late: {answer.late}", *careful(answer.remarks)]

    def text(self, answer: MonteCarlo, width: int) -> list[Any]:
        return [repr(answer.spread)]


def careful(remarks: Sequence[str]) -> list[str]:
    """Remarks as they are said."""
    return [f"Careful: {words}" for words in remarks]


monte_carlo = verb("monte_carlo", FlyMany)
