"""`swash link`: a vehicle as the physics of a running autopilot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from swashplate.api.asking import InAir, OfVehicle, linear_model, strings
from swashplate.api.languages import Aircraft, Band, Names, Paths, Texts, Values, Wind
from swashplate.api.question import Answer, argument, option, setting
from swashplate.api.saying import Say, notice, notice_unless_quiet, silent
from swashplate.errors import SwashError

_PACE = 0.25
"""Simulated seconds a second of Betaflight's trial, where nothing slower is asked for: it has no lockstep."""
if TYPE_CHECKING:
    from swashplate.api.acceptance import Acceptance
    from swashplate.api.check_autopilot import AutopilotCheck
    from swashplate.models.vehicle import Vehicle


class Linkable(OfVehicle[Answer]):
    """A vehicle that an autopilot flies."""

    vehicle: Aircraft = option(help="A vehicle's name, or a card or model file.", complete="vehicle", kw_only=False)
    servos: str | None = option(
        default=None, metavar="NAME|FILE", help="Servo mapping; by default the one of the vehicle's name."
    )

    def name(self) -> str | None:
        """As the vehicle was called."""
        return str(self.vehicle) if isinstance(self.vehicle, str | Path) else None

    def whole(self) -> Vehicle:
        """The vehicle; a linear one has no ground, told before anything is assumed about its inputs."""
        if linear_model(self.vehicle) is not None:
            from swashplate.simulation.standing import no_ground

            raise no_ground(str(self.vehicle))
        return self.flying(self.vehicle)


class Link(InAir[None], Linkable):
    """A vehicle linked to a SITL."""

    port: int = option(default=9002, help="Port to listen on.", least=0, most=65535)
    record: Path | None = option(default=None, help="Save the true flights while they are flown: .nc or .csv.")
    idle_exit: float | None = setting(default=None, help="end after so many seconds without an autopilot", least=0.1)
    estimate: Texts = option(
        default=(),
        metavar="NAMES|EQUATION",
        help="Estimate while it flies: parameters of the model (mass), or an equation.",
    )
    truth: Values | None = setting(
        default=None, help="what flies has this number instead of the card's: for --estimate to find. Repeatable."
    )
    listen: str = setting(default="127.0.0.1", help="address to listen on: this machine only unless given")
    voltage: float | None = setting(default=None, help="battery voltage at the start.", unit="V")
    sag: float = setting(default=0.0, help="fall of the voltage.", unit="V/s", least=0.0)
    altitude: float | None = setting(default=0.0, help="altitude in the standard atmosphere", unit="m")
    sensors: str | None = setting(
        default=None,
        help="gyros and accelerometers without noise and bias (clean), or with (noisy)",
        choices=("clean", "noisy"),
    )
    seed: int = setting(default=0, help="seed of the noise", least=0)
    record_rate: float = setting(default=200.0, help="samples per second kept", unit="Hz", least=1.0, most=2000.0)

    noisy: ClassVar[bool] = False

    def serve(self, verb: Any, listen: Any) -> None:
        """Listen, and be the physics until it is interrupted."""
        from swashplate.api import link

        link.check_record(self.record)
        listen(self.listen, self.port).close()  # told before anything is compiled
        vehicle = self.whole()
        verb(
            vehicle,
            name=self.name(),
            servos=self.servos,
            port=self.port,
            listen=self.listen,
            environment=self.around(vehicle),
            voltage=self.voltage,
            sag=self.sag,
            noisy=self.noisy if self.sensors is None else self.sensors == "noisy",
            seed=self.seed,
            record=self.record,
            record_rate=self.record_rate,
            idle_exit=self.idle_exit,
            estimate=strings(self.estimate),
            truth=dict(self.truth or {}),
            notice=notice,
            say=notice_unless_quiet,
        )

    def document(self, answer: Any) -> Any:
        raise SwashError("is not for a link that runs.", channel="--json")

    def text(self, answer: Any, width: int) -> list[Any]:
        return []


class LinkArduPilot(Link):
    """Be the physics of ArduPilot's SITL (`arducopter-heli --model JSON:127.0.0.1`): lockstep over UDP.

    The vehicle stands on the ground with its rotors stopped until the autopilot starts it, and is there again when
    the autopilot is restarted. Ctrl-C ends the program.
    """

    def answer(self, say: Say = silent) -> None:
        from swashplate.api.link import link_ardupilot
        from swashplate.links.sockets import listen_udp

        self.serve(link_ardupilot, listen_udp)


class LinkPx4(Link):
    """Be the simulator of PX4's SITL (`make px4_sitl none_iris` and the like): MAVLink HIL in lockstep over TCP.

    Needs the extra `link`. The vehicle is on the ground whenever PX4 connects. Ctrl-C ends the program.
    """

    port: int = option(default=4560, help="Port to listen on.", least=0, most=65535)

    noisy: ClassVar[bool] = True

    def answer(self, say: Say = silent) -> None:
        from swashplate.api.link import link_px4
        from swashplate.links.sockets import listen_tcp

        self.serve(link_px4, listen_tcp)


class LinkBetaflight(InAir[None], Linkable):
    """Be the physics of Betaflight's SITL: states to UDP 9003, motors from 9001. For multirotors.

    Both run on clocks of their own, without lockstep. It waits until the SITL has opened TCP 5761. The vehicle stands
    on the ground at first. Ctrl-C ends the program.
    """

    pace: float = setting(default=1.0, help="simulated seconds per second", least=0.02, most=1.0)
    record: Path | None = option(default=None, help="Save the true flights while they are flown: .nc or .csv.")
    idle_exit: float | None = setting(default=None, help="end after so many seconds without motors", least=0.1)
    wait: float = setting(default=60.0, help="seconds to wait for the SITL", least=0.1, most=3600.0)
    pilot: bool = option(default=False, help="A simulated pilot arms, takes off and hovers.")
    record_rate: float = setting(default=200.0, help="samples per second kept", unit="Hz", least=1.0, most=2000.0)
    altitude: float | None = setting(default=0.0, help="altitude in the standard atmosphere", unit="m")

    def answer(self, say: Say = silent) -> None:
        self.serve(pilot=self.pilot)

    def serve(self, **more: Any) -> None:
        """Be the physics until it is interrupted."""
        from swashplate.api.link import check_record
        from swashplate.api.link_betaflight import link_betaflight

        if self.servos is not None:
            raise SwashError("is for ArduPilot and PX4.", channel="--servos")
        check_record(self.record)
        vehicle = self.whole()
        link_betaflight(
            vehicle,
            environment=self.around(vehicle),
            record=self.record,
            record_rate=self.record_rate,
            idle_exit=self.idle_exit,
            pace=self.pace,
            wait=self.wait,
            notice=notice,
            say=notice_unless_quiet,
            **more,
        )

    def document(self, answer: Any) -> Any:
        raise SwashError("is not for a link that runs.", channel="--json")

    def text(self, answer: Any, width: int) -> list[Any]:
        return []


class LinkRotorflight(LinkBetaflight):
    """Be the physics of a SITL of Rotorflight that sends its servos, by Betaflight's packets. For helicopters.

    Rotorflight 4.6 sends none yet: then this says so, and the helicopter stays on the ground.
    """

    swash: str = option(default="120", help="Type of the swashplate.", choices=("120", "135", "140", "thru"))

    def answer(self, say: Say = silent) -> None:
        self.serve(swash=self.swash, pilot=self.pilot)


class WriteParameters(Linkable[Path]):
    """Write an autopilot's parameters for a vehicle in hover, gains included, to --out.

    FILE.parm is ArduPilot's; FILE.txt is Betaflight's configuration of a multirotor.
    """

    by_name: ClassVar[tuple[str, ...]] = ("vehicle.parm", "vehicle.param", "vehicle.txt")
    needs_out: ClassVar[bool] = True

    def answer(self, say: Say = silent) -> Any:
        return self.whole()

    def write(self, answer: Vehicle, folder: Path, names: tuple[str, ...]) -> None:
        from swashplate.api.link import write_ardupilot_parameters
        from swashplate.api.link_betaflight import write_betaflight_configuration
        from swashplate.simulation.trim import trim

        hover = trim(answer)
        for name in names:
            if name.endswith(".txt"):
                write_betaflight_configuration(answer, folder / name)
                continue
            write_ardupilot_parameters(
                answer, folder / name, name=self.name(), servos=self.servos, trim=hover, notice=notice
            )

    def text(self, answer: Any, width: int) -> list[Any]:
        return []

    def document(self, answer: Vehicle) -> Any:
        return {"vehicle": answer.name}


class CheckAutopilot(Linkable["AutopilotCheck"]):
    """Read a running autopilot's parameters and checks over MAVLink, and judge them for a vehicle."""

    firmware: str = option(default="ardupilot", help="What is expected to run.", choices=("ardupilot", "px4"))
    mavlink: str | None = option(
        default=None,
        metavar="ADDRESS",
        help="tcp:HOST:PORT connects, udp:HOST:PORT listens; the firmware's usual one if none.",
    )
    timeout: float = setting(default=10.0, help="seconds until an autopilot is heard.", unit="s", least=0.1, most=600.0)

    def answer(self, say: Say = silent) -> AutopilotCheck:
        from swashplate.api.check_autopilot import check_autopilot

        return check_autopilot(
            self.flying(self.vehicle),
            self.firmware,  # pyrefly: ignore[bad-argument-type]
            name=self.name(),
            servos=self.servos,
            mavlink=self.mavlink,
            timeout=self.timeout,
        )


class Accept(InAir["Acceptance"], Linkable):
    """Start a SITL binary with a vehicle's files, fly it from a cold start, and compare its log with the truth.

    First the binary is started once and asked for its version, so that a wrong one is refused within seconds. Then it
    waits for the EKF, arms, hovers in STABILIZE, ALT_HOLD and LOITER, sweeps each axis in System ID mode, lands, and
    takes the log through respond and identify. Every line has a verdict; the exit code is 2 if one fails. Needs the
    extra `link`. The binary is ended in every case.

    A multirotor is tried with Betaflight's SITL: configured, armed, hovered in ANGLE mode, its sticks swept from 0.5 to
    6 Hz (roll, pitch, yaw), and its Blackbox log compared. There is no lockstep, so it flies at a quarter of real time
    or slower (speedup). Options of modes, parameter files and ports are for ArduPilot.
    """

    binary: Path = argument(
        metavar="BINARY", help="ArduCopter's SITL, e.g. build/sitl/bin/arducopter-heli, or Betaflight's.", kw_only=True
    )
    folder: Path = option(
        flag="--out", metavar="DIR", help="New folder for the report, the log and the binary's output."
    )
    against: Aircraft | None = setting(
        default=None, metavar="MODEL", help="compare the estimates with another vehicle or card."
    )
    axes: Names = option(default=("roll", "pitch", "yaw", "heave"), help="Axes that are swept.")
    band: Band = setting(default=(0.4, 8.0), help="band of the sweeps [Hz]")
    defaults: Paths | None = setting(default=None, help="an additional parameter file, read last; may be repeated")
    instance: int = setting(
        default=0, help="instance of SITL: adds 10 times this number to every port.", least=0, most=99
    )
    seconds: float = setting(default=40.0, help="seconds of each sweep", unit="s", least=10.0, most=255.0)
    hover: float = setting(default=10.0, help="seconds in each mode", unit="s", least=1.0, most=600.0)
    height: float = setting(default=5.0, help="height of the hover", unit="m", least=1.0, most=50.0)
    ekf: float = setting(
        default=120.0, help="simulated seconds within which it must be ready to arm", unit="s", least=1.0, most=3600.0
    )
    speedup: float = setting(default=10.0, help="largest number of simulated seconds per second", least=0.1, most=100.0)
    timeout: float = setting(default=15.0, help="seconds until the binary answers", unit="s", least=0.5, most=600.0)
    altitude: float | None = setting(default=0.0, help="altitude in the standard atmosphere", unit="m")
    wind: Wind = setting(default=(0.0, 0.0, 0.0), help="wind towards north, east and down", unit="m/s")

    def answer(self, say: Say = silent) -> Acceptance:
        from swashplate.api.accept_autopilot import accept_autopilot
        from swashplate.models.catalogue import vehicle as find

        vehicle = self.flying(self.vehicle)
        if "motor_3" in vehicle.input_names:
            return self._multirotor(vehicle, say)
        acceptance = accept_autopilot(
            vehicle,
            self.binary,
            out=self.folder,
            name=self.name(),
            servos=self.servos,
            truth=find(self.against) if isinstance(self.against, str | Path) else self.against,
            axes=strings(self.axes),
            band=self.band,
            seconds=self.seconds,
            hover=self.hover,
            height=self.height,
            ekf=self.ekf,
            defaults=tuple(self.defaults or ()),  # pyrefly: ignore[bad-argument-type]
            environment=self.around(vehicle),
            instance=self.instance,
            speedup=self.speedup,
            timeout=self.timeout,
            say=say,
        )
        say("writing the report")
        acceptance.save(self.folder)
        return acceptance

    def _multirotor(self, vehicle: Vehicle, say: Say) -> Acceptance:
        from swashplate.api.accept_betaflight import accept_betaflight
        from swashplate.models.catalogue import vehicle as find

        trial = accept_betaflight(
            vehicle,
            self.binary,
            out=self.folder,
            name=self.name(),
            truth=find(self.against) if isinstance(self.against, str | Path) else self.against,
            axes=tuple(axis for axis in strings(self.axes) if axis != "heave"),
            environment=self.around(vehicle),
            pace=min(self.speedup, _PACE),
            timeout=self.timeout,
            say=say,
        )
        trial.save(self.folder)
        return trial

    def text(self, answer: Acceptance, width: int) -> list[Any]:
        return [repr(answer), f"\nReport: {self.folder / 'report.html'}"]
