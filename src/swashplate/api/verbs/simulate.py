"""`swash simulate` and `swash control monte-carlo`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import OfVehicle
from swashplate.api.languages import Aircraft, Battery, FlightLimits, Gusts, Wind, Words
from swashplate.api.question import option, setting
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.api.fly_maneuver import SimulatedFlight
    from swashplate.api.monte_carlo import MonteCarlo

_WIND = ("wind_north", "wind_east", "wind_down")
_COMPILING = "(compiling takes longest the first time)"


class Simulate(OfVehicle["SimulatedFlight"]):
    """Fly a maneuver from hover or steady flight under a controller, and save the flight.

    --out FILE.nc (complete) or FILE.csv has the flight, --out FILE.html a page of plots over time.
    """

    files: ClassVar[tuple[str, ...]] = ("flight.nc", "report.html")
    by_name: ClassVar[tuple[str, ...]] = ("flight.csv",)
    needs_out: ClassVar[bool] = True

    vehicle: Aircraft = option(help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False)
    maneuver: str = option(
        metavar="SPEC",
        help='For example "sweep:pitch,0.5-8Hz,60s" or "doublet:roll,0.5s,0.2".',
        kw_only=False,
    )
    controller: Path | None = option(
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
        from swashplate.api.fly_maneuver import fly_maneuver

        aircraft = self.flying(self.vehicle)
        say(f"simulating {_COMPILING}")
        return fly_maneuver(
            aircraft,
            self.maneuver,
            controller=self.controller,
            pilot=self.pilot,
            sensors=self.sensors,  # pyrefly: ignore[bad-argument-type]
            voltage=self.voltage,
            sag=self.sag,
            speed=self.speed,
            rate=self.rate,
            wind=dict(zip(_WIND, self.wind, strict=True)),
            seed=self.seed,
        )

    def document(self, answer: SimulatedFlight) -> Any:
        return answer.to_document() | {"vehicle": _called(self.vehicle)}


class FlyMany(OfVehicle["MonteCarlo"]):
    """Fly a controller on many aircraft in many gusts, with sensor noise, and keep the worst flight.

    --out FILE.nc or FILE.csv has the worst flight, --out FILE.html the distribution and the worst flight.
    """

    files: ClassVar[tuple[str, ...]] = ("worst.nc", "report.html")
    by_name: ClassVar[tuple[str, ...]] = ("worst.csv",)

    vehicle: Aircraft = option(help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False)
    controller: Path = option(
        help="A controller's file, of `swash control design` or `swash control decouple`.", kw_only=False
    )
    maneuver: str = option(metavar="SPEC", help='For example "hold:10s" or "doublet:roll,0.5s,0.2".', kw_only=False)
    count: int = option(default=100, help="Number of flights.", least=2)
    fit: Path | None = option(default=None, help="Models drawn from this fit.json.")
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
        from swashplate.api.monte_carlo import monte_carlo

        for text in (self.vary or {}).values():
            numbers(str(text).removesuffix("%"), "--vary", count=1)
        aircraft = self.flying(self.vehicle)
        say(f"simulating {self.count} flights {_COMPILING}")
        return monte_carlo(
            aircraft,
            self.controller,
            maneuver=self.maneuver,
            count=self.count,
            fit=self.fit,
            gusts=turbulence(self.gusts),
            battery=self.battery,
            tolerances=self.tolerances,
            vary=dict(self.vary or {}),
            payload=self.payload,
            delay=self.delay,
            bits=self.command_bits,
            limits=flight_limits(self.limit),
            voltage=self.voltage,
            sag=self.sag,
            seed=self.seed,
        )

    def document(self, answer: MonteCarlo) -> Any:
        return answer.to_document() | {"vehicle": _called(self.vehicle)}

    def remarks(self, answer: MonteCarlo) -> list[str]:
        return [f"late: {answer.late}", *super().remarks(answer)]

    def text(self, answer: MonteCarlo, width: int) -> list[Any]:
        return [repr(answer.spread)]


def _called(vehicle: Any) -> str:
    return str(vehicle) if isinstance(vehicle, str | Path) else vehicle.name


def turbulence(gusts: Any) -> Any:
    """What `gusts` asks for: none, indoor, indoor=SIGMA, a mean wind [m/s], or gusts as they are."""
    from swashplate.api.languages import numbers
    from swashplate.simulation.wind import INDOOR, indoor, outdoor

    if gusts is None or gusts == "none":
        return None
    if not isinstance(gusts, str | int | float):
        return gusts
    if gusts == "indoor":
        return INDOOR
    kind, told, sigma = str(gusts).partition("=")
    try:
        if told and kind.strip() == "indoor":
            return indoor(numbers(sigma, "--gusts", count=1)[0])
        return outdoor(numbers(str(gusts), "--gusts", count=1)[0])
    except SwashError as error:
        raise SwashError(
            f"is '{gusts}', expected none, indoor, indoor=0.3 (m/s), or a mean wind in m/s ({error.problem}).",
            channel="--gusts",
        ) from None


def flight_limits(given: Any) -> Any:
    """`lean=30deg` and so on as what is judged by; those that are not given keep their defaults."""
    from dataclasses import replace

    from swashplate.api.languages import numbers
    from swashplate.control.draws.spread import SHOWN, Limits

    chosen = Limits()
    if isinstance(given, Limits):
        return given
    for name, text in (given or {}).items():
        if name not in SHOWN:
            raise SwashError(f"'{name}' is no limit; expected {', '.join(SHOWN)}.", channel="--limit")
        unit, factor = SHOWN[name]
        if str(text).strip() == "none":
            chosen = replace(chosen, **{name: math.inf})
            continue
        value = numbers(str(text).strip().removesuffix(unit).strip(), "--limit", count=1)[0]
        if not value > 0.0:
            raise SwashError(f"{name} is {text}, expected more than 0 {unit}.", channel="--limit")
        chosen = replace(chosen, **{name: value / factor})
    return chosen
