"""What a vehicle is asked to fly, as three verbs share it: card, changes to it, speed, climb, turn, wind, altitude."""

from __future__ import annotations

import functools
import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.models.linear.state_space import StateSpaceModel
    from swashplate.models.vehicle import Vehicle
    from swashplate.physics.environment import Environment
    from swashplate.simulation.trim import Trim
    from swashplate.simulation.trim_curve import TrimCurve

_RANGE_POINTS = 11

Name = Annotated[str, typer.Argument(metavar="VEHICLE", help="A vehicle's name, or a card or model file.")]
Speed = Annotated[
    str, typer.Option("--speed", metavar="V", help='Speed ahead [m/s]: "5", or a range "0-15" or "0-15/2.5".')
]
Climb = Annotated[float, typer.Option("--climb", help="Climb rate [m/s], negative sinks.")]
Lateral = Annotated[float, typer.Option("--lateral", help="Speed to the right [m/s].")]
Turn = Annotated[float, typer.Option("--turn", help="Rate of turn to the right [deg/s].")]
Wind = Annotated[str, typer.Option("--wind", metavar="N,E,D", help="Wind towards north, east and down [m/s].")]
Altitude = Annotated[
    float | None,
    typer.Option(
        "--altitude", help="Altitude in the standard atmosphere [m]; without it, the card's air or sea level."
    ),
]
Mass = Annotated[float | None, typer.Option("--mass", help="Mass instead of the card's [kg].")]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Change a number of the card; may be repeated.")
]
Switch = Annotated[
    list[str] | None,
    typer.Option(
        "--option", metavar="NAME=VALUE", help="Change an option of the card, e.g. bar=true; may be repeated."
    ),
]


Posterior = Annotated[
    Path | None,
    typer.Option("--posterior", metavar="FILE", help="A fit.json of this model: models drawn from it fly beside it."),
]
Draws = Annotated[int, typer.Option("--draws", help="With --posterior: how many.", min=2, max=40)]


def checked_page(path: Path | None) -> Path | None:
    """The place for a page, if it is one."""
    if path is not None and path.suffix.lower() not in (".html", ".htm"):
        raise SwashError(f"ends in '{path.suffix}', expected .html.", where=path, channel="--plot")
    return path


_PAGE = "Also a page of plots over the range of speeds."
Page = Annotated[Path | None, typer.Option("--plot", metavar="FILE.html", help=_PAGE, callback=checked_page)]
OutPage = Annotated[
    Path | None, typer.Option("--out", "-o", "--plot", metavar="FILE.html", help=_PAGE, callback=checked_page)
]
"""Of verbs that write nothing else."""


@dataclass(frozen=True)
class Conditions:
    """A vehicle, as it was called, and what it flies: speeds [m/s] and the rest of the course, in an environment."""

    name: str
    vehicle: Vehicle
    speeds: tuple[float, ...]
    climb: float
    lateral: float
    turn: float
    environment: Environment

    def curve(self) -> TrimCurve:
        """A trim at every speed."""
        from swashplate.simulation.trim_curve import trim_curve

        return trim_curve(
            self.vehicle,
            self.speeds,
            climb=self.climb,
            lateral=self.lateral,
            turn=self.turn,
            environment=self.environment,
        )

    def trims(self) -> tuple[Trim, ...]:
        """The trims of the curve."""
        return self.curve().trims

    def tell(self, curve: TrimCurve) -> tuple[str, ...]:
        """Where the vehicle's equations or its engine do not hold; said on standard error."""
        for words in curve.remarks:
            typer.echo(f"Careful: {words}", err=True)
        return curve.remarks


def speeds(text: str) -> tuple[float, ...]:
    """One speed, or a range A-B or A-B/STEP, ascending."""
    number = r"\d+(?:\.\d*)?|\.\d+"
    if match := re.fullmatch(rf"({number})-({number})(?:/({number}))?", text.strip()):
        low, high = float(match[1]), float(match[2])
        step = float(match[3]) if match[3] else (high - low) / (_RANGE_POINTS - 1)
        if not (low < high and step > 0.0 and (high - low) / step <= 500):
            raise SwashError(f"'{text}' is no ascending range of at most 500 speeds.", channel="--speed")
        return tuple(low + i * step for i in range(int((high - low) / step + 1e-9) + 1))
    return (options.numbers(text, option="--speed", count=1)[0],)


def _switch(text: str) -> Any:
    return {"true": True, "false": False}.get(text.lower(), text)


def linear_model(name: str) -> StateSpaceModel | None:
    """The model of a state-space file or a ready structure; None for anything else."""
    from swashplate.models.catalogue import is_state_space, structure

    return structure(name).structure if is_state_space(name) else None


def _tell_assumed_ranges(made: Vehicle, model: StateSpaceModel) -> None:
    """What of a state-space model's inputs the file does not say."""
    from swashplate.models.linear.linear_vehicle import unlimited

    if usual := unlimited(model):
        ranges = dict(zip(made.input_names, made.input_limits, strict=True))
        told = ", ".join(sorted({f"{ranges[n][1]:.3g} {model.units.get(n, '')}".removesuffix(" 1") for n in usual}))
        typer.echo(f"Careful: range of {', '.join(usual)}: assumed, {told} either way; [limits] says it.", err=True)


def vehicle_of(
    name: str,
    changed: list[str] | None,
    switched: list[str] | None,
    mass: float | None = None,
    *,
    whole: bool = False,
) -> Vehicle:
    """A vehicle with other numbers and options; with `whole`, one that flies, told before its assumed ranges are."""
    from swashplate.models.catalogue import from_card
    from swashplate.models.catalogue import vehicle as find

    switches = options.assignments(switched, option="--option")
    made = find(name, **{key: _switch(value) for key, value in switches.items()})
    numbers = {
        key: options.numbers(value, option="--set", count=1)[0]
        for key, value in options.assignments(changed, option="--set").items()
    }
    if mass is not None:
        numbers["mass"] = mass
    how = {"source": "the command line", "status": "assumed"}
    if whole:
        from swashplate.simulation.trim import need_whole_body

        need_whole_body(made)
    if made.structure is not None:
        _tell_assumed_ranges(made, made.structure)
        return made.with_values(numbers, **how) if numbers else made
    return from_card(made.card.with_values(numbers, **how)) if numbers else made


def conditions(
    vehicle: Name,
    *,
    speed: Speed = "0",
    climb: Climb = 0.0,
    lateral: Lateral = 0.0,
    turn: Turn = 0.0,
    wind: Wind = "0,0,0",
    altitude: Altitude = None,
    mass: Mass = None,
    changed: Set = None,
    switched: Switch = None,
) -> Conditions:
    """The conditions that the options describe."""
    from swashplate.models.surroundings import environment_of
    from swashplate.physics.atmosphere import air_density
    from swashplate.physics.environment import Environment

    made = vehicle_of(vehicle, changed, switched, mass)
    if altitude is not None and not -500.0 <= altitude <= 11_000.0:
        raise SwashError(f"is {altitude:g} m, expected -500 to 11000.", channel="--altitude")
    north, east, down = options.numbers(wind, option="--wind", count=3)
    around = environment_of(made, Environment(north, east, down))
    if altitude is not None:
        around = around._replace(air_density=air_density(altitude))
    return Conditions(vehicle, made, speeds(speed), climb, lateral, math.radians(turn), around)


def flown(verb: Callable[..., None]) -> Callable[..., None]:
    """A verb about `Conditions` as a command: its first argument becomes the options that describe them."""
    shared = inspect.signature(conditions, eval_str=True).parameters
    own = list(inspect.signature(verb, eval_str=True).parameters.values())[1:]

    @functools.wraps(verb)
    def command(**given: Any) -> None:
        asked = conditions(**{name: given.pop(name) for name in shared})
        verb(asked, **given)

    parameters = [entry.replace(kind=inspect.Parameter.KEYWORD_ONLY) for entry in (*shared.values(), *own)]
    command.__signature__ = inspect.Signature(parameters)  # pyrefly: ignore[missing-attribute]
    command.__annotations__ = {entry.name: entry.annotation for entry in parameters}
    return command


def drawn(vehicle: Vehicle, fit: Path, *, count: int, seed: int = 1) -> tuple[Vehicle, ...]:
    """Models that a fit cannot tell from the one that it found.

    Raises:
        SwashError: where the file holds no fit, or one that found other numbers than this model has.
    """
    import swashplate as sp

    fitted = sp.load(fit, equations=vehicle)
    if not isinstance(fitted, sp.Result):
        raise SwashError("holds no fit.", where=fit, channel="--posterior", hint="Give the fit.json beside the model.")
    own = vehicle.card.values()
    for name in fitted.names:
        if not math.isclose(own.get(name, math.nan), fitted[name].value, rel_tol=1e-6, abs_tol=1e-12):
            has = f"{own[name]:.6g}" if name in own else "none"
            raise SwashError(
                f"is of another model: it found {name} = {fitted[name].value:.6g}, {vehicle.card.title} has {has}.",
                where=fit,
                channel="--posterior",
                hint="Give the model file that this fit wrote beside it.",
            )
    values = fitted.draw_values(count, seed=seed, within=vehicle)
    return tuple(vehicle.with_values({n: float(v[k]) for n, v in values.items()}) for k in range(count))
