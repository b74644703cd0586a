"""`swash simulate` and `swash control monte-carlo`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import OfVehicle, name_of
from swashplate.api.languages import (
    Air,
    Aircraft,
    Battery,
    Delays,
    Fitted,
    FlightLimits,
    Gusts,
    Motion,
    Pilot,
    Start,
    Wind,
    Words,
)
from swashplate.api.question import default_of, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.api.fly_maneuver import SimulatedFlight
    from swashplate.api.monte_carlo import MonteCarlo
    from swashplate.flights.flight import Flight
    from swashplate.flights.maneuvers.series import Maneuver

_COMPILING = "(compiling takes longest the first time)"


class Simulate(OfVehicle["SimulatedFlight"]):
    """Fly a maneuver from hover or steady flight under a controller, and save the flight.

    --out FILE.nc (complete) or FILE.csv has the flight, --out FILE.html a page of plots over time.
    In Python `maneuver` may also be inputs, which are flown as they are, without a controller: a flight, series or
    numbers by name at `rate`, or an array (n, n_inputs). The answer is the flight.

    Raises:
        DivergenceError: with the time, the state that went first and the flight up to there.
        FlightError: where an input is missing or not finite.
        ControllerError: where the controller is for another vehicle.
        SwashError: what suits a maneuver or inputs only; steps too long for the vehicle's fastest mode.
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
    voltage: float | None = setting(default=None, help="battery voltage at the start", unit="V", least=0.0, most=1000.0)
    lead: float = setting(default=3.0, help="hover before the maneuver", unit="s", least=0.0)
    tail: float = setting(default=3.0, help="hover after the maneuver", unit="s", least=0.0)
    environment: Air | None = setting(default=None, help="air_density and gravity, where the card's are not meant")
    start: Start | None = setting(default=None, help="of inputs: states by name, or a trim; hover if not given")
    substeps: int = setting(default=1, help="of inputs: Runge-Kutta steps per sample", least=1)
    interpolation: str = setting(default="held", help="of inputs between samples", choices=("held", "linear"))
    delays: Delays | None = setting(
        default=None, help="of inputs: from command to action, one or by name; the card's", unit="ms"
    )

    _OF_MANEUVERS: ClassVar = ("controller", "pilot", "speed", "wind", "sag", "voltage", "lead", "tail")
    _OF_INPUTS: ClassVar = ("start", "substeps", "interpolation", "delays")

    def described(self) -> Maneuver | None:
        """The maneuver; None where inputs are given.

        Raises:
            SwashError: what is no maneuver, or what is given for the other kind of flight.
        """
        from swashplate.flights.maneuvers.series import Maneuver, parse

        made = parse(self.maneuver) if isinstance(self.maneuver, str) else self.maneuver
        maneuver = made if isinstance(made, Maneuver) else None
        for name in self._OF_INPUTS if maneuver else self._OF_MANEUVERS:
            given, usual = getattr(self, name), default_of(type(self), name)
            if given is not usual and (name == "wind" or given != usual):  # which may hold series
                told = "inputs; here a maneuver is flown." if maneuver else "a maneuver; here inputs are flown."
                raise SwashError(f"is for {told}", channel=name)
        return maneuver

    def check_places(self, outs: tuple[Path, ...]) -> None:
        self.described()  # says what is wrong before anything else is looked at

    def answer(self, say: Say = silent) -> SimulatedFlight:
        from swashplate.api.fly_maneuver import fly

        self.described()
        if self.pilot and self.controller is None:
            raise SwashError("is for a --controller; the hover hold takes no commands.", channel="--pilot")
        aircraft = self.flying(self.vehicle)
        say(f"simulating {_COMPILING}")
        return fly(self, aircraft)

    def remarks(self, answer: SimulatedFlight) -> Sequence[str]:
        return careful(answer.remarks)

    def document(self, answer: SimulatedFlight) -> Any:
        return answer.to_document() | {"vehicle": name_of(self.vehicle) or self.vehicle.name}


def _flight(answer: SimulatedFlight) -> Flight:
    """What was flown, as sensors saw it."""
    return answer.flight


simulate = verb("simulate", Simulate, value=_flight)


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
    voltage: float | None = setting(default=None, help="battery voltage at the start", unit="V", least=0.0, most=1000.0)
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
