"""`swash link`: a vehicle as the physics of a running autopilot."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import InAir, OfVehicle, linear_model, name_of, strings
from swashplate.api.languages import Aircraft, Band, Names, Paths, Texts, Values, Wind
from swashplate.api.question import Answer, argument, option, setting, verb
from swashplate.api.saying import Say, notice, silent
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from swashplate.api.acceptance import Acceptance
    from swashplate.api.check_autopilot import AutopilotCheck
    from swashplate.models.vehicle import Vehicle


class Linkable(OfVehicle[Answer]):
    """A vehicle that an autopilot flies."""

    vehicle: Aircraft = option(help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False)
    servos: str | None = option(
        default=None, metavar="NAME|FILE", help="Servo mapping; by default the one of the vehicle's name."
    )

    def whole(self) -> Vehicle:
        """The vehicle; a linear one has no ground, told before anything is assumed about its inputs."""
        if linear_model(self.vehicle) is not None:
            from swashplate.simulation.standing import no_ground

            raise no_ground(str(self.vehicle))
        return self.flying(self.vehicle)


class Linking(InAir[None], Linkable):
    """A vehicle as the physics of a SITL, until it is interrupted."""

    record: Path | None = option(default=None, help="Save the true flights while they are flown: .nc or .csv.")
    record_rate: float = setting(default=200.0, help="samples per second kept", unit="Hz", least=1.0, most=2000.0)
    idle_exit: float | None = setting(default=None, help="end after so many seconds without an autopilot", least=0.1)
    voltage: float | None = setting(
        default=None, help="battery voltage at the start.", unit="V", least=0.0, most=1000.0
    )
    sag: float = setting(default=0.0, help="fall of the voltage.", unit="V/s", least=0.0)
    altitude: float | None = setting(default=0.0, help="altitude in the standard atmosphere", unit="m")
    sensors: str | None = setting(
        default=None,
        help="gyros and accelerometers without noise and bias (clean), or with (noisy)",
        choices=("clean", "noisy"),
    )
    seed: int = setting(default=0, help="seed of the noise", least=0)

    noisy: ClassVar[bool] = False

    @property
    def noise(self) -> bool:
        """Whether its sensors are noisy."""
        return self.noisy if self.sensors is None else self.sensors == "noisy"

    def watched(self) -> tuple[tuple[str, ...], dict[str, float]]:
        """What is estimated while it flies, and the numbers that what flies has instead of the card's."""
        return (), {}

    def check_places(self, outs: tuple[Path, ...]) -> None:
        """That a recording can be kept there, before anything is compiled."""
        record = self.record
        if record is None:
            return
        if record.suffix.lower() not in (".nc", ".csv"):
            raise SwashError(f"ends in '{record.suffix}', expected .nc or .csv.", where=record, channel="--record")
        folder = record.absolute().parent
        if not folder.is_dir():
            hint = "Make it first."
            raise SwashError("the folder does not exist.", where=record.parent, channel="--record", hint=hint)
        if not os.access(folder, os.W_OK):
            raise SwashError("the folder cannot be written to.", where=record.parent, channel="--record")

    def document(self, answer: Any) -> Any:
        raise SwashError("is not for a link that runs.", channel="--json")

    def text(self, answer: Any, width: int) -> list[Any]:
        return []


class Link(Linking):
    """A vehicle linked to an autopilot in lockstep."""

    port: int = option(default=9002, help="Port to listen on.", least=0, most=65535)
    listen: str = setting(default="127.0.0.1", help="address to listen on: this machine only unless given")
    estimate: Texts = option(
        default=(),
        metavar="NAMES|EQUATION",
        help="Estimate while it flies: parameters of the model (mass), or an equation.",
    )
    truth: Values | None = setting(
        default=None, help="what flies has this number instead of the card's: for --estimate to find. Repeatable."
    )

    def watched(self) -> tuple[tuple[str, ...], dict[str, float]]:
        return strings(self.estimate), dict(self.truth or {})


class LinkArduPilot(Link):
    """Be the physics of ArduPilot's SITL (`arducopter-heli --model JSON:127.0.0.1`): lockstep over UDP.

    The vehicle stands on the ground with its rotors stopped until the autopilot starts it, and is there again when
    the autopilot is restarted. Ctrl-C ends the program.
    """

    def answer(self, say: Say = silent) -> Any:
        from swashplate.api.link import serve_ardupilot
        from swashplate.links.sockets import listen_udp

        listen_udp(self.listen, self.port).close()  # told before anything is compiled
        return serve_ardupilot(self)


class LinkPx4(Link):
    """Be the simulator of PX4's SITL (`make px4_sitl none_iris` and the like): MAVLink HIL in lockstep over TCP.

    Needs the extra `link`. The vehicle is on the ground whenever PX4 connects. Ctrl-C ends the program.
    """

    port: int = option(default=4560, help="Port to listen on.", least=0, most=65535)

    noisy: ClassVar[bool] = True

    def answer(self, say: Say = silent) -> Any:
        from swashplate.api.link import serve_px4
        from swashplate.links.sockets import listen_tcp

        listen_tcp(self.listen, self.port).close()  # told before anything is compiled
        return serve_px4(self)


class LinkBetaflight(Linking):
    """Be the physics of Betaflight's SITL: states to UDP 9003, motors from 9001. For multirotors.

    Both run on clocks of their own, without lockstep. It waits until the SITL has opened TCP 5761. The vehicle stands
    on the ground at first. Ctrl-C ends the program.
    """

    pace: float = setting(default=1.0, help="simulated seconds per second", least=0.02, most=1.0)
    wait: float = setting(default=60.0, help="seconds to wait for the SITL", least=0.1, most=3600.0)
    pilot: bool = option(default=False, help="A simulated pilot arms, takes off and hovers.")

    def answer(self, say: Say = silent) -> Any:
        from swashplate.api.link import serve_betaflight

        self._check_servos()
        return serve_betaflight(self)

    def _check_servos(self) -> None:
        if self.servos is not None:
            raise SwashError("is for ArduPilot and PX4.", channel="--servos")


class LinkRotorflight(LinkBetaflight):
    """Be the physics of a SITL of Rotorflight that sends its servos, by Betaflight's packets. For helicopters.

    Rotorflight 4.6 sends none yet: then this says so, and the helicopter stays on the ground.
    """

    swash: str = option(default="120", help="Type of the swashplate.", choices=("120", "135", "140", "thru"))

    def answer(self, say: Say = silent) -> Any:
        from swashplate.api.link import serve_betaflight

        self._check_servos()
        return serve_betaflight(self, swash=self.swash)


class WriteParameters(Linkable[Path]):
    """Write an autopilot's parameters for a vehicle in hover, gains included, to --out.

    FILE.parm is ArduPilot's; FILE.txt is Betaflight's configuration of a multirotor.
    """

    by_name: ClassVar[tuple[str, ...]] = ("vehicle.parm", "vehicle.param", "vehicle.txt")
    needs_out: ClassVar[bool] = True

    def answer(self, say: Say = silent) -> Any:
        return self.whole()

    def write(self, answer: Vehicle, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.api.link import write_ardupilot_parameters, write_betaflight_configuration
        from swashplate.simulation.trim import trim

        hover = trim(answer)
        for name in names:
            if name.endswith(".txt"):
                write_betaflight_configuration(answer, folder / name)
                continue
            write_ardupilot_parameters(
                answer, folder / name, name=name_of(self.vehicle), servos=self.servos, trim=hover, notice=notice
            )

    def text(self, answer: Any, width: int) -> list[Any]:
        return []

    def document(self, answer: Vehicle) -> Any:
        return {"vehicle": answer.name}


class CheckAutopilot(Linkable["AutopilotCheck"]):
    """Read a running autopilot's parameters and checks over MAVLink, and judge them for a vehicle.

    The physics (`swash link`) has to run at the same time. Nothing is changed in the autopilot but how often it sends
    two messages.

    Raises:
        SwashError: no answer, a port that is taken, another firmware or another kind of vehicle; a vehicle without
            servo mapping; pymavlink missing.
    """

    firmware: str = option(
        default="ardupilot", help="What is expected to run.", choices=("ardupilot", "px4"), kw_only=False
    )
    mavlink: str | None = option(
        default=None,
        metavar="ADDRESS",
        help="tcp:HOST:PORT connects, udp:HOST:PORT listens; the firmware's usual one if none.",
    )
    timeout: float = setting(default=10.0, help="seconds until an autopilot is heard.", unit="s", least=0.1, most=600.0)

    listen: float = setting(
        default=4.0, help="how long its checks and clock are heard", unit="s", least=0.1, most=600.0
    )

    def answer(self, say: Say = silent) -> AutopilotCheck:
        from swashplate.api.check_autopilot import hear_autopilot

        return hear_autopilot(self)

    def problems(self, answer: AutopilotCheck) -> Sequence[str]:
        return answer.problems


class Accept(InAir["Acceptance"], Linkable):
    """Start a SITL binary with a vehicle's files, fly it from a cold start, and compare its log with the truth.

    First the binary is started once and asked for its version, so that a wrong one is refused within seconds. Then it
    waits for the EKF, arms, hovers in STABILIZE, ALT_HOLD and LOITER, sweeps each axis in System ID mode, lands, and
    takes the log through respond and identify. Every line has a verdict; the exit code is 2 if one fails. Needs the
    extra `link`. The binary is ended in every case.

    A multirotor is tried with Betaflight's SITL: configured, armed, hovered in ANGLE mode, its sticks swept from 0.5 to
    6 Hz (roll, pitch, yaw), and its Blackbox log compared. On Linux with a C compiler it flies in lockstep; elsewhere
    at a quarter of real time or slower (speedup). Options of modes, parameter files and ports are for ArduPilot.

    Raises:
        SwashError: a binary that is missing, cannot be run, ends at once or is another program (ArduCopter 4.5 or
            later); a port that is taken; a vehicle whose frame is not known here; pymavlink missing. What goes wrong
            later is a line of the result that fails.
    """

    binary: Path = argument(
        metavar="BINARY", help="ArduCopter's SITL, e.g. build/sitl/bin/arducopter-heli, or Betaflight's."
    )
    folder: Path = option(
        flag="--out", metavar="DIR", help="New folder for the report, the log and the binary's output."
    )
    against: Aircraft | None = setting(
        default=None, metavar="MODEL", help="compare the estimates with another vehicle or card."
    )
    axes: Names = option(default=("roll", "pitch", "yaw", "heave"), help="Axes that are swept.")
    band: Band | None = setting(
        default=None, help="band of the sweeps, 0.4-8 by default, of Betaflight 0.5-6", unit="Hz"
    )
    defaults: Paths | None = setting(
        default=None, help="a parameter file, read last, or settings for Betaflight; may be repeated"
    )
    instance: int = setting(
        default=0, help="instance of SITL: adds 10 times this number to every port.", least=0, most=99
    )
    seconds: float | None = setting(
        default=None, help="seconds of each sweep, 40 by default, of Betaflight 20", unit="s", least=10.0, most=255.0
    )
    hover: float | None = setting(
        default=None, help="seconds in each mode, 10 by default, of Betaflight 5", unit="s", least=1.0, most=600.0
    )
    height: float | None = setting(
        default=None, help="height of the hover, 5 by default, of Betaflight 1.5", unit="m", least=1.0, most=50.0
    )
    ekf: float = setting(
        default=120.0, help="simulated seconds within which it must be ready to arm", unit="s", least=1.0, most=3600.0
    )
    speedup: float = setting(default=10.0, help="largest number of simulated seconds per second", least=0.1, most=100.0)
    timeout: float = setting(default=15.0, help="seconds until the binary answers", unit="s", least=0.5, most=600.0)
    altitude: float | None = setting(default=0.0, help="altitude in the standard atmosphere", unit="m")
    wind: Wind = setting(default=(0.0, 0.0, 0.0), help="wind towards north, east and down", unit="m/s")

    def answer(self, say: Say = silent) -> Acceptance:
        vehicle = self.flying(self.vehicle)
        if "motor_3" in vehicle.input_names:
            from swashplate.api.accept_betaflight import accept_multirotor as accept
        else:
            from swashplate.api.accept_autopilot import accept_helicopter as accept
        acceptance = accept(self, vehicle, say)
        say("writing the report")
        acceptance.save(self.folder)
        return acceptance

    def other(self) -> Vehicle | None:
        """What the estimates are held against instead of the vehicle itself."""
        from swashplate.models.catalogue import vehicle as find

        return find(self.against) if isinstance(self.against, str | Path) else self.against

    def problems(self, answer: Acceptance) -> Sequence[str]:
        return answer.problems

    def text(self, answer: Acceptance, width: int) -> list[Any]:
        return [repr(answer), f"\nReport: {self.folder / 'report.html'}"]


check_autopilot = verb("check_autopilot", CheckAutopilot)
accept_autopilot = verb("accept_autopilot", Accept)
