"""`swash link`: a vehicle as the physics of a running autopilot."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swashplate.cli import conditions as given
from swashplate.cli import options
from swashplate.errors import SwashError

if TYPE_CHECKING:
    from swashplate.links.plant import Plant
    from swashplate.links.sensing import Sensing
    from swashplate.links.servos import ServoMapping
    from swashplate.vehicles.vehicle import Vehicle

app = typer.Typer(help="Fly a vehicle under a running autopilot.", no_args_is_help=True, rich_markup_mode=None)


class SensorSet(StrEnum):
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
    SensorSet, typer.Option("--sensors", help="Gyros and accelerometers without or with noise and bias.")
]
Seed = Annotated[int, typer.Option("--seed", help="Of the noise.", min=0)]
Record = Annotated[
    Path | None, typer.Option("--record", metavar="FILE", help="Keep the true flight: .nc (nothing lost) or .csv.")
]
RecordRate = Annotated[float, typer.Option("--record-rate", help="Samples per second kept.", min=1.0, max=2000.0)]
IdleExit = Annotated[
    float | None, typer.Option("--idle-exit", help="End after so many seconds without an autopilot.", min=0.1)
]


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
    sensors: SensorsOption = SensorSet.CLEAN,
    seed: Seed = 0,
    record: Record = None,
    record_rate: RecordRate = 200.0,
    idle_exit: IdleExit = None,
    write_parameters: Annotated[
        Path | None,
        typer.Option(
            "--write-parameters", metavar="FILE", help="Write ArduPilot's parameters for this vehicle and end."
        ),
    ] = None,
    quiet: options.Quiet = False,
) -> None:
    """Be the physics of ArduPilot's SITL (`arducopter-heli --model JSON:127.0.0.1`): lockstep over UDP.

    The vehicle stands on the ground with its rotors stopped until the autopilot starts it, and stands there again when
    the autopilot is restarted. Ctrl-C ends.
    """
    _check_record(record)
    _own_process()
    from swashplate.links.ardupilot.runner import serve
    from swashplate.links.ardupilot.session import Session
    from swashplate.links.notices import Notices
    from swashplate.links.sockets import listen_udp

    if write_parameters is None:
        listen_udp(listen, port).close()  # told before anything is compiled
    _refuse_linear(vehicle)
    where = given.conditions(vehicle, speed="0", wind=wind, altitude=altitude, changed=changed, switched=switched)
    if write_parameters is not None:
        _write_parameters(write_parameters, vehicle, where, servos, quiet=quiet)
        return
    plant = _plant(vehicle, where, servos, suffix="", voltage=voltage, sag=sag, rate=record_rate if record else 0)
    sensing = _sensing(plant, sensors, seed)
    notices = Notices(_say)
    with listen_udp(listen, port) as bound:
        _tell_where("UDP", bound.getsockname(), listen, plant, quiet=quiet)
        session = Session(plant, sensing, notices)
        try:
            serve(bound, session, idle_exit=idle_exit)
        except KeyboardInterrupt:
            pass
        finally:
            _finish(plant, record, session.progress.exchanges, notices.summary(), quiet=quiet)


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
    sensors: SensorsOption = SensorSet.NOISY,
    seed: Seed = 0,
    record: Record = None,
    record_rate: RecordRate = 200.0,
    idle_exit: IdleExit = None,
    quiet: options.Quiet = False,
) -> None:
    """Be the simulator of PX4's SITL (`make px4_sitl none_iris` and the like): MAVLink HIL in lockstep over TCP.

    Needs the extra `link`. The vehicle stands on the ground whenever PX4 connects. Ctrl-C ends.
    """
    _check_record(record)
    _own_process()
    from swashplate.links.notices import Notices
    from swashplate.links.px4.runner import serve
    from swashplate.links.px4.session import Session
    from swashplate.links.sockets import listen_tcp

    listen_tcp(listen, port).close()  # told before anything is compiled
    _refuse_linear(vehicle)
    where = given.conditions(vehicle, speed="0", wind=wind, altitude=altitude, changed=changed, switched=switched)
    plant = _plant(vehicle, where, servos, suffix="_px4", voltage=voltage, sag=sag, rate=record_rate if record else 0)
    sensing = _sensing(plant, sensors, seed)
    notices = Notices(_say)
    session = Session(plant, sensing, notices, seed=seed)
    with listen_tcp(listen, port) as listening:
        _tell_where("TCP", listening.getsockname(), listen, plant, quiet=quiet)
        try:
            serve(listening, session, notices, idle_exit=idle_exit)
        except KeyboardInterrupt:
            pass
        finally:
            _finish(plant, record, session.exchanges, notices.summary(), quiet=quiet)


def _write_parameters(file: Path, name: str, where: given.Conditions, servos: str | None, *, quiet: bool) -> None:
    from swashplate.atomic import write_text
    from swashplate.links.ardupilot.parameters import parameter_file, parameters

    if not file.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=file.parent, channel="--write-parameters")
    found = parameters(_mapping(name, servos, "", where.vehicle), where.vehicle, where.trims()[0])
    write_text(file, parameter_file(found, title=where.vehicle.card.title))
    if not quiet:
        _say(f"written: {file}")


def _refuse_linear(name: str) -> None:
    """Told before anything is assumed about its inputs; `standing` tells it of a linear vehicle's card."""
    if given.linear_model(name) is not None:
        from swashplate.simulation.standing import no_ground

        raise no_ground(name)


def _say(words: str) -> None:
    typer.echo(words, err=True)


def _check_record(record: Path | None) -> None:
    if record is None:
        return
    if record.suffix.lower() not in (".nc", ".csv"):
        raise SwashError(f"ends in '{record.suffix}', expected .nc or .csv.", where=record, channel="--record")
    if not record.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=record.parent, channel="--record", hint="Make it first.")


def _mapping(name: str, servos: str | None, suffix: str, vehicle: Vehicle) -> ServoMapping:
    from swashplate.links.servos import packaged, servo_mapping

    if servos is None:
        own = name if vehicle.name == "conventional" else vehicle.name
        servos = f"{own}{suffix}"
        if servos not in packaged():
            raise SwashError(
                f"there is no servo mapping '{servos}'; those that there are: {', '.join(packaged())}.",
                where=name,
                channel="--servos",
                hint="Give one of them, or a file of your own.",
            )
    return servo_mapping(servos, vehicle)


def _own_process() -> None:
    import signal

    from swashplate.simulation.compilation import dispatch_in_line

    signal.signal(signal.SIGINT, signal.default_int_handler)  # started in a shell's background it would be ignored
    dispatch_in_line()


def _plant(
    name: str,
    where: given.Conditions,
    servos: str | None,
    *,
    suffix: str,
    voltage: float | None,
    sag: float,
    rate: float,
) -> Plant:
    from swashplate.links.plant import Plant, Surroundings
    from swashplate.simulation.standing import standing

    environment = where.environment
    if voltage is not None:
        if not 0.0 < voltage < 1000.0:
            raise SwashError(f"is {voltage:g} V, expected 0 to 1000.", channel="--voltage")
        environment = environment._replace(voltage=voltage)
    aircraft = standing(where.vehicle)
    mapping = _mapping(name, servos, suffix, aircraft)
    plant = Plant(aircraft, mapping, Surroundings(environment, sag), record_rate=rate)
    plant.prepare()
    return plant


def _sensing(plant: Plant, sensors: SensorSet, seed: int) -> Sensing:
    from swashplate.links.sensing import Sensing
    from swashplate.simulation.sensors import InertialUnit

    return Sensing(plant, unit=InertialUnit() if sensors is SensorSet.NOISY else None, seed=seed)


def _tell_where(kind: str, at: tuple[str, int], listen: str, plant: Plant, *, quiet: bool) -> None:
    from swashplate.links.sockets import is_loopback

    if not is_loopback(listen):
        _say(f"Listening beyond this machine, on {listen}: anyone who reaches it can fly this vehicle.")
    if not quiet:
        _say(f"{plant.vehicle.card.title}: waiting for an autopilot on {kind} {at[0]}:{at[1]}. Ctrl-C ends.")


def _finish(plant: Plant, record: Path | None, exchanges: int, counts: str, *, quiet: bool) -> None:
    flight = plant.flight() if record is not None else None
    if record is not None and flight is not None:
        if record.suffix.lower() == ".nc":
            flight.save(record)
        else:
            from swashplate.flights.csv_export import write_csv

            write_csv(flight, record)
    if quiet:
        return
    _say(f"{exchanges} exchanges; {plant.time:.1f} s since the vehicle was last put on the ground.")
    if counts:
        _say(f"Noted: {counts}.")
    if record is not None:
        _say(f"written: {record}" if flight is not None else "nothing was flown, nothing is written.")
