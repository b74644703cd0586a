"""`swash control decouple`: the decoupling law of a coaxial helicopter, or the axes of any linear model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.languages import Aircraft, Fitted, Gusts, Names, Numbers, Rule, Words
from swashplate.api.question import argument, default_of, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.api.verbs.control import WritesC
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.api.decouple import DecouplingDesign
    from swashplate.api.decouple_axes import AxesDecoupling

_BOTH = ("linear", "vehicle", "changes", "precision", "paged")
_LINEAR = ("pair", "frequency", "bandwidth", "keep", "at", "speed")


class Decouple(WritesC["DecouplingDesign | AxesDecoupling"]):
    """Decouple the axes of a coaxial helicopter by its equations, or of any model by a matrix and a filter.

    A vehicle with the CoaX's equations gets a controller: height and yaw held, roll and pitch decoupled. The law
    inverts the lower rotor's equations with the model's numbers (Fankhauser et al., eqs 19 to 22). --out FILE.toml
    writes it, FILE.c one step as C99 (needs the extra 'model'), FILE.html compares the two paths (to 1.8 m/s without
    a --step).

    Any other model, and every one with --linear, gets a constant matrix, and a filter that copies its fast states: the
    table has the ratio of off-axis to on-axis response without, with the matrix, and with the filter. Exit code 2 if
    the filter would be unstable; the matrix is still printed and written. --out FILE.json writes both.

    Raises:
        ControllerError: where the loop does not stand, or a step does not get there.
        SwashError: names that the model does not have, axes that no input moves, options that contradict each other.
    """

    by_name: ClassVar[tuple[str, ...]] = ("controller.toml", "controller.c", "decoupling.json", "report.html")

    vehicle: Aircraft = argument(
        metavar="MODEL", help="A vehicle's name or file, or a state-space file.", complete="vehicle"
    )
    linear: bool = option(default=False, help="The matrix and the filter, also for a coaxial helicopter.")
    mode: str = option(
        default="manual", help="What the servos hold besides a pilot's commands.", choices=("manual", "speed", "place")
    )
    lag: Rule | None = option(
        default=None,
        metavar="RULE|DEG",
        help="Phase lag that makes the model's step straight (straight; by default in mode manual), the rotor's from "
        "the battery-compensated motor command (battery), the plain one (motor) or the hover's speed (hover), or a "
        "constant in degrees.",
    )
    step: float | None = option(
        default=None,
        help="Fly this step of the pitch command for 6 m, with and without the decoupling.",
        least=0.01,
        most=1.0,
    )
    to_speed: float | None = option(
        default=None,
        help="The same with the step that reaches this speed; the paper's is 1.8.",
        unit="m/s",
        least=0.01,
    )
    drift: float | None = option(
        default=None,
        help="Drift that a flown step with this law had, to the right after 6 m; the new law corrects it.",
        unit="m",
        least=-6.0,
        most=6.0,
    )
    fit: Fitted | None = option(default=None, help="With a step: also on models drawn from a fit.json.")
    gusts: Gusts = option(
        default="none",
        help="With a step: fly drawn models, or this one, in gusts: none, indoor, indoor=SIGMA, or a wind [m/s].",
    )
    pair: Words | None = option(
        default=None, metavar="INPUT=OUTPUT", help="The input that moves an output, for example lateral=p. Repeatable."
    )
    frequency: float = option(
        default=3.0, help="Frequency at which the matrix decouples best.", unit="rad/s", least=1e-3
    )
    bandwidth: float = option(default=10.0, help="Bandwidth of the filter's axes.", unit="rad/s", least=1e-3)
    mixing: str | None = setting(
        default=None,
        help="form of the equations to invert; the model's own by default",
        choices=("rotation", "as_printed"),
    )
    speed_terms: bool = setting(default=True, help="cancel the effect of speed across the motion")
    voltage: float | None = setting(default=None, help="battery voltage of the hover", unit="V", least=0.0, most=1000.0)
    rate: float = setting(default=100.0, help="steps of the controller per second", unit="Hz", least=1.0, most=10000.0)
    draws: int = setting(default=500, help="number of drawn models", least=2)
    seed: int = setting(default=0, help="seed of the draws", least=0)
    keep: Names | None = setting(default=None, help="states of the filter's copy; the fast ones by default")
    at: Numbers = setting(default=(1.0, 3.0, 10.0, 20.0), help="frequencies of the table", unit="rad/s")
    speed: float = setting(default=0.0, help="speed of a vehicle's steady flight", unit="m/s")
    paged: bool = setting(default=False, help="fly the paper's step where none is given")

    def check_places(self, outs: tuple[Path, ...]) -> None:
        endings = {out.suffix for out in outs}
        if ".html" in endings:
            object.__setattr__(self, "paged", True)

    def answer(self, say: Say = silent) -> DecouplingDesign | AxesDecoupling:
        vehicle = self.flying(self.vehicle)
        if self.linear or not vehicle.traits.coaxial:
            self._refuse(
                lambda name: name not in (*_LINEAR, "linear", "vehicle", "changes", "precision", "paged"), "--linear"
            )
            return self._axes(vehicle, say)
        self._refuse(lambda name: name in _LINEAR, "the equations of a coaxial helicopter; add --linear")
        return self._law(vehicle, say)

    def _refuse(self, wrong: Any, why: str) -> None:
        from swashplate.api.question import entries

        for name in entries(type(self)):
            if wrong(name) and getattr(self, name) != default_of(type(self), name):
                raise SwashError(f"is not for {why}.", channel=f"--{name.replace('_', '-')}")

    def _law(self, vehicle: Any, say: Say) -> DecouplingDesign:
        from swashplate.api.decouple import decouple_coaxial

        say("designing the controller")
        return decouple_coaxial(self, vehicle)

    def _axes(self, vehicle: Any, say: Say) -> AxesDecoupling:
        from swashplate.api.decouple_axes import decouple_axes

        if not self.at or min(self.at) <= 0.0:
            raise SwashError(f"'{','.join(f'{one:g}' for one in self.at)}' is not all positive.", channel="at")
        say("designing the decoupling")
        return decouple_axes(self, vehicle)

    def write(self, answer: Any, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.api.decouple import DecouplingDesign

        law = isinstance(answer, DecouplingDesign)
        for name in names:
            if (name.endswith((".toml", ".c")) and not law) or (name.endswith(".json") and law):
                kinds = ".toml, .c or .html" if law else ".json or .html"
                raise SwashError(f"ends in '{Path(name).suffix}', expected {kinds}.", where=name, channel="--out")
        super().write(answer, folder, names)

    def problems(self, answer: DecouplingDesign | AxesDecoupling) -> Sequence[str]:
        return answer.problems


decouple = verb("decouple", Decouple)
