"""`swash vehicle trim`, `linearize` and `derivatives`: steady flight and the motions about it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import SONIC, InAir, name_of, one_or_more
from swashplate.api.languages import Air, Aircraft, Speeds, Wind
from swashplate.api.question import argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.api.verbs.simulate import careful
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.models.vehicle import Vehicle
    from swashplate.simulation.linearize import LinearModel
    from swashplate.simulation.trim import Trim
    from swashplate.simulation.trim_curve import TrimCurve


@dataclass(frozen=True, repr=False)
class Flown:
    """What was computed about steady flight.

    Attributes:
        curve: the trims. result: what was asked besides. remarks: where equations or the engine do not hold.
    """

    name: str
    curve: TrimCurve
    result: Any
    remarks: tuple[str, ...]


class Steadily(InAir[Flown]):
    """A verb about a vehicle in steady flight; --out FILE.html writes a page of plots over the range of speeds."""

    vehicle: Aircraft = argument(
        metavar="VEHICLE", help="A vehicle's name, or a card or model file.", complete="vehicle"
    )
    speed: Speeds = option(
        default=(0.0,), help='Speed ahead: "5", or a range "0-15" or "0-15/2.5".', unit="m/s", least=-SONIC, most=SONIC
    )
    wind: Wind = setting(default=(0.0, 0.0, 0.0), help="wind towards north, east and down", unit="m/s")
    altitude: float | None = setting(
        default=None, help="altitude in the standard atmosphere; else the card's air", unit="m"
    )
    climb: float = setting(default=0.0, help="climb rate, negative sinks.", unit="m/s", least=-SONIC, most=SONIC)
    lateral: float = setting(default=0.0, help="speed to the right", unit="m/s", least=-SONIC, most=SONIC)
    turn: float = setting(default=0.0, help="rate of turn to the right", unit="deg/s", least=-1e3, most=1e3)
    heading: float = setting(default=0.0, help="direction of flight, from north to east", unit="deg")
    height: float | None = setting(default=None, help="height above the ground; clear of it if not given", unit="m")
    voltage: float | None = setting(
        default=None, help="battery voltage; the card's if not given", unit="V", least=0.0, most=1000.0
    )
    environment: Air | None = setting(default=None, help="air_density and gravity, where the card's are not meant")

    def begun(self) -> Vehicle:
        """The vehicle, with its changes."""
        return self.flying(self.vehicle)

    def speeds(self) -> tuple[float, ...]:
        """All that are asked for [m/s]."""
        return one_or_more(self.speed)

    def curve(self, vehicle: Vehicle) -> TrimCurve:
        """A trim at every speed."""
        from swashplate.physics.environment import Environment
        from swashplate.simulation.trim_curve import trim_curve

        usual, given = Environment(), self.environment or Environment()
        said = {name: value for name, value in given._asdict().items() if value != getattr(usual, name)}
        return trim_curve(
            vehicle,
            self.speeds(),
            climb=self.climb,
            lateral=self.lateral,
            turn=math.radians(self.turn),
            heading=math.radians(self.heading),
            height=self.height,
            voltage=self.voltage,
            environment=self.around(vehicle)._replace(**said),
        )

    def flown(self, vehicle: Vehicle, curve: TrimCurve, result: Any) -> Flown:
        """The result, with its remarks."""
        return Flown(name_of(self.vehicle) or vehicle.name, curve, result, tuple(curve.remarks))

    def remarks(self, answer: Flown) -> list[str]:
        return careful(answer.remarks)


class TrimVehicle(Steadily):
    """Find the steady flight of a vehicle: attitude and controls, at one speed or over a range.

    --out FILE.html writes a page of plots over the range of speeds. In Python it is a `Trim`, or a `TrimCurve` of them.

    Raises:
        TrimError: no steady flight at a speed, with the input whose limit prevents it or the state that does not rest.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html",)

    climb: float = option(default=0.0, help="Climb rate, negative sinks.", unit="m/s", least=-SONIC, most=SONIC)

    def answer(self, say: Say = silent) -> Flown:
        vehicle = self.begun()
        return self.flown(vehicle, self.curve(vehicle), None)

    def write(self, answer: Flown, folder: Path, names: tuple[str, ...]) -> None:
        _report(answer.curve, folder, names)

    def document(self, answer: Flown) -> Any:
        return {"vehicle": answer.name, **answer.curve.to_document()}

    def text(self, answer: Flown, width: int) -> list[Any]:
        from swashplate.text_table import text_columns

        curve = answer.curve
        if len(curve.trims) == 1:
            return [repr(curve.trims[0]).splitlines()[0], _one(curve)]
        columns = {"speed [m/s]": [f"{at.speed:g}" for at in curve.trims]}
        columns |= {head: [f"{v:.3f}" for v in values] for head, values in list(curve.columns().items())[1:]}
        if "power [W]" in columns:
            columns["power [W]"] = [f"{v:.1f}" for v in curve.columns()["power [W]"]]
        return [text_columns(list(columns), list(zip(*columns.values(), strict=True)), left=0)]


def _steady_flight(answer: Flown) -> Trim | TrimCurve:
    """The trim at one speed, or the curve over several."""
    return answer.curve if len(answer.curve.trims) > 1 else answer.curve.trims[0]


trim = verb("trim", TrimVehicle, value=_steady_flight)


def _report(made: Any, folder: Path, names: tuple[str, ...]) -> None:
    from swashplate.reporting.report import report

    for name in names:
        if name.endswith(".html"):
            report(made, path=folder / name)


def _one(curve: TrimCurve) -> Any:
    """Every input and state of a trim with its unit, angles also in degrees."""
    from swashplate.text_table import text_columns

    at = curve.trims[0]
    values, rows = {**at.commands(), **at.states()}, []
    if (power := curve.power(at)) is not None:
        rows.append(("shaft power", f"{power:.1f}", "W", ""))
    for name, unit in curve.units().items():
        degrees = f"{round(math.degrees(values[name]), 3) + 0.0:.3f}" if unit == "rad" else ""
        rows.append((name, f"{round(values[name], 5) + 0.0:.5f}", unit, degrees))
    return text_columns(("", "value", "unit", "in degrees"), rows, left=1)


class LinearizeVehicle(Steadily):
    """Linear models about steady flight: modes with their states, matrices with --json.

    --out DIR writes at-SPEED.toml, a model file for every speed with its trim; --out FILE.html a page with the root
    locus over the range of speeds.
    """

    files: ClassVar[tuple[str, ...]] = ("at-0.toml",)
    by_name: ClassVar[tuple[str, ...]] = ("report.html",)

    form: str = option(
        default="full",
        metavar="NAME",
        help="full; paper (8 states), printed (the paper's terms only), longitudinal, lateral (3 degrees of freedom); "
        "flapping (10 states), bar-and-gyro (13).",
    )

    def ours(self, out: Path) -> tuple[str, ...]:
        return tuple(file.name for file in out.glob("at-*.toml"))

    def check_places(self, outs: tuple[Path, ...]) -> None:
        pages = [out for out in outs if out.suffix.lower() == ".html"]
        if self.form != "full" and pages:
            raise SwashError(
                "is of the full model.", where=pages[0], channel="--out", hint="Leave out --form or the page."
            )

    def answer(self, say: Say = silent) -> Flown:
        from swashplate.simulation.linearize import linearize
        from swashplate.simulation.reduction import in_form

        vehicle = self.begun()
        curve = self.curve(vehicle)
        return self.flown(vehicle, curve, [in_form(linearize(vehicle, at), self.form) for at in curve.trims])

    def write(self, answer: Flown, folder: Path, names: tuple[str, ...]) -> None:
        _report(answer.curve, folder, names)
        toml = [name for name in names if name.endswith(".toml")]
        if toml == list(self.files):
            for model in answer.result:
                model.save(folder / f"at-{model.trim.speed:g}.toml")
        elif toml:
            answer.result[0].save(folder / toml[0])

    def document(self, answer: Flown) -> Any:
        return {"vehicle": answer.name, "models": [_matrices(m) for m in answer.result], "remarks": answer.remarks}

    def text(self, answer: Flown, width: int) -> list[Any]:
        return [f"At {m.trim.speed:g} m/s\n{m!r}\n" for m in answer.result]


def _matrices(model: LinearModel) -> dict[str, Any]:
    modes = [
        {"real": m.eigenvalue.real, "imag": m.eigenvalue.imag, "damping": m.damping, "states": dict(m.states)}
        for m in model.modes()
    ]
    return {
        "speed": model.trim.speed,
        "states": list(model.states),
        "inputs": list(model.inputs),
        "A": model.A,
        "B": model.B,
        "modes": modes,
    }


class FindDerivatives(Steadily):
    """Stability and control derivatives: force per mass and moment per inertia, split by what contributes to them.

    --out FILE.html writes a page of plots over the range of speeds.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html",)

    imperial: bool = setting(default=False, help="in feet, as in Bhandari et al.")
    primed: bool = option(
        default=False, help="Roll and yaw rows mixed by the product of inertia, as most published tables."
    )
    published: Path | None = option(
        default=None, metavar="FILE.csv", help="Compare with a report: name,value[,unit], or A and B as a matrix."
    )
    uncertainty: bool = option(
        default=False, help="Also 5 % and 95 % bounds from the tolerances on the card and what such models miss."
    )
    draws: int = setting(default=200, help="with uncertainty: samples of the card", least=10, most=100_000)
    seed: int = setting(default=0, help="seed of the samples.", least=0)
    left_out: bool = option(
        default=False, help="Show instead what changes when each one is left out, the least important first."
    )

    def check_places(self, outs: tuple[Path, ...]) -> None:
        if self.published is not None and (self.uncertainty or outs or self.imperial or len(self.speeds()) > 1):
            raise SwashError(
                "takes one speed, and no --uncertainty, --out or --imperial.",
                channel="--published",
                hint="Units are in the file.",
            )
        if self.left_out and (self.uncertainty or self.primed or self.imperial or outs or self.published):
            raise SwashError("goes with --json and the conditions only.", channel="--left-out")

    def answer(self, say: Say = silent) -> Flown:
        from swashplate.simulation.derivatives_over_speed import derivatives
        from swashplate.simulation.published import compare_derivatives
        from swashplate.simulation.reduction import omit_derivatives

        vehicle = self.begun()
        curve = self.curve(vehicle)
        result: Any
        if self.published is not None:
            result = compare_derivatives(vehicle, curve.trims[0], self.published, primed=self.primed)
        elif self.left_out:
            result = omit_derivatives(vehicle, curve.trims)
        else:
            result = derivatives(
                vehicle,
                curve.trims,
                primed=self.primed,
                imperial=self.imperial,
                uncertainty=self.uncertainty,
                draws=self.draws,
                seed=self.seed,
            )
        return self.flown(vehicle, curve, result)

    def write(self, answer: Flown, folder: Path, names: tuple[str, ...]) -> None:
        _report(answer.result, folder, names)

    def document(self, answer: Flown) -> Any:
        result = answer.result.to_document()
        if self.published is not None:
            return {"vehicle": answer.name, "speed": self.speeds()[0], "published": str(self.published)} | result
        if self.left_out:
            return {"vehicle": answer.name, "studies": result, "remarks": answer.remarks}
        return {"vehicle": answer.name, **result, "remarks": answer.remarks}

    def text(self, answer: Flown, width: int) -> list[Any]:
        from swashplate.text_table import text_columns as table

        result: Any = answer.result
        if self.published is not None:
            small = "(small: below 2 % of the largest of its kind)"
            return [
                f"At {self.speeds()[0]:g} m/s, published in {self.published} {small}",
                table(*result.rows(), left=2),
                "\nMean difference (each at most 100 %), and derivatives within 10 %:",
                table(*result.step_rows()),
            ]
        parts: list[Any] = []
        if self.left_out:
            for place, speed in enumerate(result.speeds):
                parts += [
                    f"At {speed:g} m/s: largest relative change of a mode, and of q/B1, p/A1, r/theta0T, w/theta0",
                    table(*result.rows(place)),
                ]
            return parts
        for at, one in zip(result.trims, result.tables, strict=True):
            parts += [
                f"At {at.speed:g} m/s (flapping follows the motion without delay)",
                table(*result.rows(one), left=2),
            ]
        if result.bounds is not None:
            parts += [f"\n{result.bounds.words}", table(*_modes(result.bounds.modes()))]
        return parts


def _modes(modes: Sequence[Any]) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
    rows = []
    for mode in modes:
        real, imag = mode["real"], mode["imag"]
        shown = f"{real['value']:+.3f}" + (f" +/- {imag['value']:.3f}j" if imag["value"] else "")
        bounds = (f"{real['5 %']:+.3f} .. {real['95 %']:+.3f}", f"{imag['5 %']:.3f} .. {imag['95 %']:.3f}")
        rows.append((shown, *bounds))
    return ("mode [1/s]", "real part", "imaginary part"), rows
