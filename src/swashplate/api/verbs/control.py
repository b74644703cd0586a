"""`swash control gains`, `design` and `check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import SONIC, OfVehicle
from swashplate.api.languages import Aircraft, Delays, GainsFile, Gusts, Numbers, Pilot, Speeds, Values
from swashplate.api.question import Answer, argument, option, setting, verb
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.api.autopilot_gains import AutopilotGains
    from swashplate.api.check_controller import ControllerCheck
    from swashplate.api.design_controller import ControllerDesign

MODEL = "A vehicle's name or file, or a state-space file of `swash identify --structure`."
DELAY = "From command to action [ms]: one number, or NAME=MS by input; the model's identified ones if not given."
USUAL_SENSORS = "imu@100,mocap@100+10ms"
SENSORS = "KIND@RATE+DELAYms, separated by commas: imu, gyro, mocap, sonar, pressure, flow (optical), compass."


class FindGains(OfVehicle["AutopilotGains"]):
    """Gains of rate, attitude, height and place loops for a vehicle under ArduPilot, PX4 or Rotorflight.

    Every loop keeps 6 dB, 45 degrees and a sensitivity below two with all others closed, with rotors, bar, delays
    and filters. Then a copy of the autopilot's law flies STABILIZE, ALT_HOLD and LOITER on the nonlinear model;
    Rotorflight's flies ANGLE, and a hover with a simulated pilot. Exit code 2 if no gains keep the margins, or if those
    of --parameters do not. --out FILE.parm (PX4: .params, Rotorflight: .txt) writes the parameters, --out FILE.toml the
    law as a controller that `swash` flies.

    Raises:
        ControllerError: naming the loop for which nothing holds the margins, the command that the vehicle turns
            against, or the axis that was fitted although no flight moved it.
        SwashError: where there is no servo mapping.
    """

    by_name: ClassVar[tuple[str, ...]] = ("gains.parm", "gains.params", "gains.txt", "law.toml", "report.html")

    vehicle: Aircraft = argument(metavar="MODEL", help=MODEL, complete="vehicle")
    autopilot: str = option(
        default="ardupilot",
        help="Autopilot whose law and parameter names are used.",
        choices=("ardupilot", "px4", "rotorflight"),
    )
    parameters: GainsFile | None = option(
        default=None,
        help="Judge these gains instead: ArduPilot's .parm file; in Python also by name, and Rotorflight's.",
    )
    servos: str | None = option(
        default=None, metavar="NAME|FILE", help="Servo mapping; by default the one of the vehicle's name."
    )
    delay: Delays | None = setting(default=None, help=DELAY)
    fly: bool = setting(default=True, help="also fly the modes on the nonlinear model.")
    notch: Numbers | None = setting(
        default=None, help="notch filter of the gyros, [HZ, WIDTH], and of twice its frequency (ArduPilot)"
    )
    rate: float | None = setting(
        default=None,
        help="rate of the loops; 400 by default, 250 for PX4, 1000 for Rotorflight",
        unit="Hz",
        least=50.0,
        most=32000.0,
    )
    voltage: float | None = setting(default=None, help="battery voltage of the trims", unit="V", least=0.0, most=1000.0)

    def check_places(self, outs: tuple[Path, ...]) -> None:
        own = {"ardupilot": ".parm", "px4": ".params"}.get(self.autopilot, ".txt")
        for out in outs:
            if out.suffix in {".parm", ".params", ".txt"} - {own}:
                raise SwashError(f"ends in '{out.suffix}', expected {own}.", where=out, channel="--out")

    def answer(self, say: Say = silent) -> AutopilotGains:
        from swashplate.api.autopilot_gains import find_gains

        say("searching gains")
        return find_gains(self)

    def problems(self, answer: AutopilotGains) -> Sequence[str]:
        return answer.problems


class WritesC(OfVehicle[Answer]):
    """A design of which one step becomes C."""

    precision: str = setting(default="double", help="number type of C.", choices=("double", "float"))

    written: ClassVar[Any] = None

    def write(self, answer: Any, folder: Path, names: tuple[str, ...]) -> None:
        """A controller's file, its page, and its C, whose cost `text` tells."""
        super().write(answer, folder, tuple(name for name in names if not name.endswith(".c")))
        for name in (name for name in names if name.endswith(".c")):
            code = answer.code(precision=self.precision)
            code.save(folder / name)
            object.__setattr__(self, "written", code)

    def text(self, answer: Any, width: int) -> list[Any]:
        if self.written is None:
            return [repr(answer)]
        code, kept = self.written, ""
        if code.memory_bytes:
            kept = f", {code.memory_bytes} bytes between steps"
        told = f"{code.operations} operations, {code.work_bytes} bytes of temporaries{kept}"
        return [repr(answer), f"\nC of one step: {told}"]


class DesignController(WritesC["ControllerDesign"]):
    """Design a linear-quadratic controller with integral action from a model's own trims and linear models.

    Where no effort is given the loops stay slower than delays, sampling and computation allow: they cross below
    1 / (3 total delay), or just above a mode that must be held. With --holding speed and a range of --speed the gains
    are scheduled over the speed that the observer estimates. --out FILE.toml writes the controller, FILE.c one step of
    it as C99 (needs the extra 'model').

    Raises:
        ControllerError: what cannot be seen, held or reached, with the direction.
        TrimError: for a speed that cannot be flown.
    """

    files: ClassVar[tuple[str, ...]] = ("controller.toml", "report.html")
    by_name: ClassVar[tuple[str, ...]] = ("controller.c",)

    vehicle: Aircraft = argument(metavar="MODEL", help=MODEL, complete="vehicle")
    method: str = option(
        default="lqg", help="With an observer on sensors (lqg), or with the true states (lqr).", choices=("lqg", "lqr")
    )
    sensors: str = option(default=USUAL_SENSORS, metavar="TEXT", help=SENSORS)
    holding: str = option(
        default="place",
        help="A place, or a speed ahead and to the right; always height and heading.",
        choices=("place", "speed"),
    )
    speed: Speeds = option(
        default=(0.0,), help='Speed ahead: "5", or a range "0-15" or "0-15/2.5".', unit="m/s", least=-SONIC, most=SONIC
    )
    rate: float = option(default=100.0, help="Steps of the controller per second.", unit="Hz", least=1.0, most=10000.0)
    delay: Delays | None = option(default=None, help=DELAY)
    allow: Values | None = setting(
        default=None, help="deviation of a state that weighs as much as the effort, by name. Repeatable."
    )
    effort: Values | None = setting(default=None, help="share of an input's range that weighs the same. Repeatable.")
    gain: str = option(
        default="flying",
        help="Gain of the observer: computed in flight, or constant (for a small processor).",
        choices=("flying", "steady"),
    )
    computation: float | None = setting(
        default=None,
        help="time from a reading to its command; one sample by default",
        unit="ms",
        least=0.0,
        most=1000.0,
    )
    state_weights: Numbers | None = setting(default=None, help="weights of all states instead of `allow`")
    input_weights: Numbers | None = setting(default=None, help="weights of all inputs instead of `effort`")
    voltage: float | None = setting(default=None, help="battery voltage of the trims", unit="V", least=0.0, most=1000.0)

    def answer(self, say: Say = silent) -> ControllerDesign:
        from swashplate.api.design_controller import design_lq_controller

        say("designing the controller")
        return design_lq_controller(self)


class CheckController(OfVehicle["ControllerCheck"]):
    """Judge a controller on a model: margins, disturbance rejection, handling qualities, steps, coupling, gusts.

    Exit code 2 if the loop is unstable; everything that could be computed is written and marked.

    Raises:
        ControllerError: where the controller is for another vehicle, or its file is not one.
        TrimError: where the speed cannot be flown.
    """

    files: ClassVar[tuple[str, ...]] = ("report.html", "check.json")

    vehicle: Aircraft = argument(metavar="MODEL", help="A model file, or a vehicle's name.", complete="vehicle")
    controller: Pilot = option(help="The controller's file.", kw_only=False)
    task: str = option(
        default="other",
        help="Which boundaries of ADS-33E: target tracking, or all other tasks.",
        choices=("other", "tracking"),
    )
    speed: float = option(default=0.0, help="Speed ahead of the steady flight.", unit="m/s")
    delay: Delays | None = setting(default=None, help=DELAY)
    gusts: Gusts = option(
        default="indoor", help="Turbulence: none, indoor, indoor=SIGMA, or a mean wind outdoors [m/s]."
    )
    scale: float | None = option(
        default=None, help="Ratio of the size of a full-size helicopter to the vehicle's; 1 for no scaling."
    )
    response: str = setting(
        default="auto",
        help="type of the response to a steady command: rate counts the lower bandwidth, attitude that by phase",
        choices=("auto", "rate", "attitude"),
    )
    computation: float | None = setting(default=None, help="time from a reading to its command", unit="ms", least=0.0)
    delay_margin: float | None = setting(
        default=None,
        help="additional delay that the loops must tolerate; by default a sample and the computation",
        unit="ms",
        least=0.0,
    )
    duration: float = setting(default=20.0, help="duration of each step", unit="s", least=5.0, most=300.0)
    voltage: float | None = setting(default=None, help="battery voltage", unit="V", least=0.0, most=1000.0)

    def answer(self, say: Say = silent) -> ControllerCheck:
        from swashplate.api.check_controller import judge_controller

        if self.scale is not None and not self.scale > 0.0:
            hint = "Full size is 1."
            raise SwashError(f"is {self.scale:g}, expected a positive number.", channel="--scale", hint=hint)
        say("checking the controller")
        return judge_controller(self)

    def problems(self, answer: ControllerCheck) -> Sequence[str]:
        return answer.problems


autopilot_gains = verb("autopilot_gains", FindGains)
design_controller = verb("design_controller", DesignController)
check_controller = verb("check_controller", CheckController)
