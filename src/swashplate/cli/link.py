"""`swash link`: a vehicle as the physics of a running autopilot."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.cli.link_accept import accept

if TYPE_CHECKING:
    from swashplate.models.vehicle import Vehicle

app = typer.Typer(help="Fly a vehicle under a running autopilot.", no_args_is_help=True, rich_markup_mode=None)


class InertialSensors(StrEnum):
    CLEAN = "clean"
    NOISY = "noisy"


Servos = Annotated[
    str | None,
    typer.Option("--servos", metavar="NAME|FILE", help="Servo mapping; by default the one of the vehicle's name."),
]
Listen = Annotated[
    str,
    typer.Option("--listen", metavar="ADDRESS", help="Address to listen on: this machine only unless given."),
]
Voltage = Annotated[float | None, typer.Option("--voltage", help="Battery voltage at the start [V].")]
Sag = Annotated[float, typer.Option("--sag", help="Fall of the voltage [V/s].", min=0.0)]
SensorsOption = Annotated[
    InertialSensors, typer.Option("--sensors", help="Gyros and accelerometers without or with noise and bias.")
]
Seed = Annotated[int, typer.Option("--seed", help="Seed of the noise.", min=0)]
Record = Annotated[
    Path | None,
    typer.Option("--record", metavar="FILE", help="Save the true flights while they are flown: .nc or .csv."),
]
RecordRate = Annotated[float, typer.Option("--record-rate", help="Samples per second kept.", min=1.0, max=2000.0)]
IdleExit = Annotated[
    float | None, typer.Option("--idle-exit", help="End after so many seconds without an autopilot.", min=0.1)
]
Check = Annotated[
    bool,
    typer.Option("--check", help="Instead: read a running autopilot's parameters and checks over MAVLink, and judge."),
]
MavlinkAddress = Annotated[
    str | None,
    typer.Option("--mavlink", metavar="ADDRESS", help="Of --check: tcp:HOST:PORT connects, udp:HOST:PORT listens."),
]
Timeout = Annotated[
    float, typer.Option("--timeout", help="Of --check: seconds until an autopilot is heard.", min=0.1, max=600.0)
]
CheckJson = Annotated[bool, typer.Option("--json", help="Of --check: print the result as JSON.")]


@app.command("ardupilot")
def ardupilot(
    vehicle: options.VehicleName,
    servos: Servos = None,
    port: Annotated[int, typer.Option("--port", help="UDP port to listen on.", min=0, max=65535)] = 9002,
    listen: Listen = "127.0.0.1",
    wind: given.Wind = "0,0,0",
    altitude: given.Altitude = 0.0,
    voltage: Voltage = None,
    sag: Sag = 0.0,
    changed: given.Set = None,
    switched: given.Switch = None,
    sensors: SensorsOption = InertialSensors.CLEAN,
    seed: Seed = 0,
    record: Record = None,
    record_rate: RecordRate = 200.0,
    idle_exit: IdleExit = None,
    estimate: options.Estimate = None,
    truth: options.Truth = None,
    write_parameters: Annotated[
        Path | None,
        typer.Option(
            "--write-parameters",
            metavar="FILE",
            help="Write ArduPilot's parameters and gains for this vehicle, and end.",
        ),
    ] = None,
    check: Check = False,
    mavlink: MavlinkAddress = None,
    timeout: Timeout = 10.0,
    json: CheckJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Be the physics of ArduPilot's SITL (`arducopter-heli --model JSON:127.0.0.1`): lockstep over UDP.

    The vehicle stands on the ground with its rotors stopped until the autopilot starts it, and is there again when
    the autopilot is restarted. Ctrl-C ends the program.
    """
    if check:
        where = given.conditions(vehicle, speed="0", wind=wind, altitude=altitude, changed=changed, switched=switched)
        _check(where.vehicle, "ardupilot", vehicle, servos, mavlink, timeout, json=json, quiet=quiet)
        return
    from swashplate.api import link as verbs
    from swashplate.links.sockets import listen_udp

    verbs.check_record(record)
    if write_parameters is None:
        listen_udp(listen, port).close()  # told before anything is compiled
    _refuse_linear(vehicle)
    where = given.conditions(vehicle, speed="0", wind=wind, altitude=altitude, changed=changed, switched=switched)
    if write_parameters is not None:
        verbs.write_ardupilot_parameters(
            where.vehicle, write_parameters, name=vehicle, servos=servos, trim=where.trims()[0], notice=_say
        )
        if not quiet:
            _say(f"written: {write_parameters}")
        return
    verbs.link_ardupilot(
        where.vehicle,
        name=vehicle,
        servos=servos,
        port=port,
        listen=listen,
        environment=where.environment,
        voltage=voltage,
        sag=sag,
        noisy=sensors is InertialSensors.NOISY,
        seed=seed,
        record=record,
        record_rate=record_rate,
        idle_exit=idle_exit,
        estimate=estimate or (),
        truth=options.numbers_by_name(truth, option="--truth"),
        notice=_say,
        say=_silent if quiet else _say,
    )


@app.command("px4")
def px4(
    vehicle: options.VehicleName,
    servos: Servos = None,
    port: Annotated[int, typer.Option("--port", help="TCP port to listen on.", min=0, max=65535)] = 4560,
    listen: Listen = "127.0.0.1",
    wind: given.Wind = "0,0,0",
    altitude: given.Altitude = 0.0,
    voltage: Voltage = None,
    sag: Sag = 0.0,
    changed: given.Set = None,
    switched: given.Switch = None,
    sensors: SensorsOption = InertialSensors.NOISY,
    seed: Seed = 0,
    record: Record = None,
    record_rate: RecordRate = 200.0,
    idle_exit: IdleExit = None,
    estimate: options.Estimate = None,
    truth: options.Truth = None,
    check: Check = False,
    mavlink: MavlinkAddress = None,
    timeout: Timeout = 10.0,
    json: CheckJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Be the simulator of PX4's SITL (`make px4_sitl none_iris` and the like): MAVLink HIL in lockstep over TCP.

    Needs the extra `link`. The vehicle is on the ground whenever PX4 connects. Ctrl-C ends the program.
    """
    if check:
        where = given.conditions(vehicle, speed="0", wind=wind, altitude=altitude, changed=changed, switched=switched)
        _check(where.vehicle, "px4", vehicle, servos, mavlink, timeout, json=json, quiet=quiet)
        return
    from swashplate.api import link as verbs
    from swashplate.links.sockets import listen_tcp

    verbs.check_record(record)
    listen_tcp(listen, port).close()  # told before anything is compiled
    _refuse_linear(vehicle)
    where = given.conditions(vehicle, speed="0", wind=wind, altitude=altitude, changed=changed, switched=switched)
    verbs.link_px4(
        where.vehicle,
        name=vehicle,
        servos=servos,
        port=port,
        listen=listen,
        environment=where.environment,
        voltage=voltage,
        sag=sag,
        noisy=sensors is InertialSensors.NOISY,
        seed=seed,
        record=record,
        record_rate=record_rate,
        idle_exit=idle_exit,
        estimate=estimate or (),
        truth=options.numbers_by_name(truth, option="--truth"),
        notice=_say,
        say=_silent if quiet else _say,
    )


app.command("accept")(accept)


def _check(
    made: Vehicle,
    firmware: Literal["ardupilot", "px4"],
    name: str,
    servos: str | None,
    mavlink: str | None,
    timeout: float,
    *,
    json: bool,
    quiet: bool,
) -> None:
    import swashplate as sp
    from swashplate.cli.flying import end_with
    from swashplate.json_text import as_json

    check = sp.check_autopilot(made, firmware, name=name, servos=servos, mavlink=mavlink, timeout=timeout)
    if json:
        typer.echo(as_json(check.to_document()))
    elif not quiet:
        typer.echo(repr(check))
    end_with(check.problems)


def _refuse_linear(name: str) -> None:
    """Told before anything is assumed about its inputs; `standing` tells it of a linear vehicle's card."""
    if given.linear_model(name) is not None:
        from swashplate.simulation.standing import no_ground

        raise no_ground(name)


def _say(words: str) -> None:
    typer.echo(words, err=True)


def _silent(_: str) -> None:
    """Nothing is said with --quiet."""
