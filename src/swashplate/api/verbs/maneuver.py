"""`swash maneuver check`, `design` and `need`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.languages import Aircraft, Band, Judged, Limits, Names, Noises, Pilot
from swashplate.api.question import VerbQuestion, argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.api.designed_maneuver import DesignedManeuver
    from swashplate.api.needed_excitation import NeededExcitation
    from swashplate.flights.maneuvers.planned import PlannedManeuver


class CheckManeuver(VerbQuestion["PlannedManeuver"]):
    """Check an excitation against the design rules, and write the series for an autopilot to fly.

    --out FILE.csv writes the series (with --ardupilot also FILE.param with the SID_ parameters).
    """

    files: ClassVar[tuple[str, ...]] = ("maneuver.csv",)

    spec: str = argument(metavar="SPEC", help='For example "sweep:pitch,0.5-8Hz,60s,0.1" or "doublet:roll,0.5s,0.2".')
    rate: float = option(default=100.0, help="Rate of the series and of the log.", unit="Hz", least=1.0, most=10000.0)
    noise: float | None = option(default=None, help="Standard deviation of the output's noise, in its unit.", least=0.0)
    gain: float | None = option(default=None, help="Smallest ratio of output to input in the band.", least=0.0)
    coherence: float = setting(default=0.8, help="required coherence in the whole band.")
    bandwidth: float | None = option(
        default=None, help="Bandwidth of the response, or frequency of the mode of interest.", unit="Hz"
    )
    f180: float | None = option(default=None, help="Frequency at which the response's phase is -180 deg.", unit="Hz")
    ardupilot: bool = option(default=False, help="A sweep on ArduPilot's schedule, and its SID_ parameters.")
    sid_axis: int | None = setting(
        default=None, help="ArduPilot's SID_AXIS; by default the mixer, after the rate controller"
    )

    def answer(self, say: Say = silent) -> PlannedManeuver:
        from swashplate.flights.maneuvers.planned import plan_maneuver

        if self.sid_axis is not None and not self.ardupilot:
            raise SwashError("is given without --ardupilot.", channel="sid_axis", hint="Add --ardupilot.")
        return plan_maneuver(
            self.spec,
            rate=self.rate,
            noise=self.noise,
            gain=self.gain,
            coherence=self.coherence,
            bandwidth=self.bandwidth,
            f180=self.f180,
            ardupilot=self.ardupilot,
            sid_axis=self.sid_axis,
        )

    def text(self, answer: PlannedManeuver, width: int) -> list[Any]:
        from swashplate.text_table import text_columns

        chirp = [] if answer.chirp is None else ["\n" + answer.chirp.parameter_file().rstrip()]
        return [text_columns(*answer.rows(), left=4), *chirp]


class DesignManeuver(VerbQuestion["DesignedManeuver"]):
    """Design a multisine for unknown parameters, in the closed loop, and compare it with a sweep and a 3-2-1-1.

    Prints the expected bounds of each, how they improve with each second, and a flight card. The bounds are for the
    noise that the model's own identification found, or else for that of usual indoor flights. If no maneuver within
    the limits determines all parameters, the exit code is 2, and the reason is printed. --out FILE.csv writes the
    series, and the flight card beside it as .txt; --out FILE.lua a script with which ArduPilot flies it as angles.

    Raises:
        ManeuverError: where nothing feasible tells all that is unknown, with what stands in the way.
        IdentificationError: an unknown parameter, or a vehicle whose pose is not tracked.
    """

    files: ClassVar[tuple[str, ...]] = ("maneuver.csv",)
    by_name: ClassVar[tuple[str, ...]] = ("maneuver.lua", "report.html")

    vehicle: Aircraft = option(help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False)
    unknown: Names = option(help="Parameters to determine, separated by commas.", kw_only=False)
    limits: Limits | None = option(
        default=None,
        help="Some of amplitude [1], attitude [deg], rate [deg/s], place [m], battery [s], seconds; by default "
        "attitude=20,rate=120,place=3,seconds=30.",
    )
    band: Band = option(default=(0.3, 8.0), help="Frequencies [Hz].")
    axes: Names | None = option(default=None, help="Of roll, pitch, yaw, heave, by commas; all that the vehicle has.")
    controller: Pilot | None = option(default=None, help="Controller that flies (.toml); else a hold of hover.")
    criterion: str = setting(
        default="D",
        help="D (minimum volume of the error ellipsoid) or A (minimum sum of squared relative errors)",
        choices=("D", "A"),
    )
    robust: str = setting(
        default="average",
        help="optimise for the average over draws of the prior, or for the worst of them",
        choices=("average", "worst"),
    )
    noise: Noises | None = setting(
        default=None,
        help="of air and sensors, by name; the model's own identification's, else that of usual indoor flights",
    )
    spread: float = setting(default=0.3, help="possible relative error of the unknown parameters", least=0.0, most=0.9)
    draws: int = setting(default=5, help="number of draws of the prior", least=1, most=100)
    rate: float = setting(default=100.0, help="rate of the series and of the log", unit="Hz", least=20.0)
    seed: int = setting(default=0, help="seed of the draws")

    def answer(self, say: Say = silent) -> DesignedManeuver:
        from swashplate.api.design_maneuver import design_for

        return design_for(self, say)

    def write(self, answer: DesignedManeuver, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.api.maneuver_script import maneuver_script
        from swashplate.atomic import write_text

        lua = [name for name in names if name.endswith(".lua")]
        super().write(answer, folder, tuple(name for name in names if name not in lua))
        for name in lua:
            write_text(folder / name, maneuver_script(answer))

    def text(self, answer: DesignedManeuver, width: int) -> list[Any]:
        from swashplate.text_table import text_columns as table

        return [
            table(*answer.rows(), left=1),
            "\nWhat each second buys",
            table(*answer.seconds_rows()),
            "\n" + answer.card(),
        ]


class NeedManeuver(VerbQuestion["NeededExcitation"]):
    """Say what the next flight must have for a model to show what it can.

    The error of a prediction hardly changes from flight to flight, so each channel must move by that error over the
    share that may be missed. Axes whose command only answered the motion need an excitation of their own.
    """

    validation: Judged = argument(
        metavar="FILE",
        help="Of flights that the fit had not seen: validation.json of `identify --hold-out` or `validate`.",
    )
    fit: float = option(default=70.0, help="Prediction fit that the flight is to show.", unit="%")
    ahead: float = option(default=1.0, help="Seconds ahead, one of those that were validated.", unit="s")

    def answer(self, say: Say = silent) -> NeededExcitation:
        from swashplate.api.needed_excitation import needed_for

        return needed_for(self)


design_maneuver = verb("design_maneuver", DesignManeuver)
needed_excitation = verb("needed_excitation", NeedManeuver)
