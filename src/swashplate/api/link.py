"""A vehicle as the physics of a running autopilot: ArduPilot's SITL over UDP, PX4's over TCP."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from swashplate.atomic import write_text
from swashplate.control.analysis.cascade_gains import cascade_gains
from swashplate.errors import ControllerError, SwashError
from swashplate.links.ardupilot.gains import ASSUMED_DELAY, ardupilot_law, written_gains
from swashplate.links.ardupilot.parameters import Parameters, parameter_file, parameters
from swashplate.links.betaflight.motors import MotorMapping
from swashplate.links.betaflight.servo_outputs import SwashServoMapping
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.recorder import Recorder, recover
from swashplate.links.sensing import Sensing
from swashplate.links.servos import ServoMapping, packaged, servo_mapping
from swashplate.links.sockets import is_loopback, listen_tcp, listen_udp
from swashplate.models.surroundings import complete_delays, environment_of, input_delays
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import Environment
from swashplate.simulation.record import monitored, unflown
from swashplate.simulation.sensors import InertialUnit
from swashplate.simulation.standing import standing
from swashplate.simulation.stepping import MakeEngine, SteppingEngine, VirtualEngine
from swashplate.simulation.trim import Trim

if TYPE_CHECKING:
    from swashplate.links.estimating import KnownNow

Say = Callable[[str], None]
_ESTIMATED = 100.0
"""Samples a second of what estimates in flight [Hz]."""


def _silent(_: str) -> None:
    """Says nothing."""


@dataclass(frozen=True)
class Linked:
    """What a link did until it ended.

    Attributes:
        exchanges: messages that were answered.
        time: seconds since the vehicle was last put on the ground.
        noted: what was odd about the autopilot's messages, with counts.
        saved: recordings.
        estimates: what was asked to be estimated, as it was known at the end.
    """

    exchanges: int
    time: float
    noted: str
    saved: tuple[Path, ...]
    estimates: tuple[KnownNow, ...] = ()

    def __repr__(self) -> str:
        told = f"{self.exchanges} exchanges; {self.time:.1f} s since the vehicle was last put on the ground."
        if self.estimates:
            told += f"\nEstimated in flight: {'; '.join(map(str, self.estimates))}."
        return f"{told}\nNoted: {self.noted}." if self.noted else told


def check_record(record: Path | None) -> None:
    """That a recording can be kept there, before anything is compiled.

    Raises:
        SwashError: naming what is wrong with the place.
    """
    if record is None:
        return
    if record.suffix.lower() not in (".nc", ".csv"):
        raise SwashError(f"ends in '{record.suffix}', expected .nc or .csv.", where=record, channel="--record")
    if not record.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=record.parent, channel="--record", hint="Make it first.")
    if not os.access(record.absolute().parent, os.W_OK):
        raise SwashError("the folder cannot be written to.", where=record.parent, channel="--record")


def mapping_of(vehicle: Vehicle, servos: str | Path | None, *, name: str | None, suffix: str) -> ServoMapping:
    """The servo mapping that was asked for, or the packaged one of the vehicle's name and a firmware's suffix.

    Raises:
        SwashError: where there is none, or it is for another vehicle.
    """
    if servos is None and not vehicle.traits.no_link:
        servos = f"{vehicle.traits.servos or name or vehicle.name}{suffix}"
        if servos not in packaged():
            raise SwashError(
                f"there is no servo mapping '{servos}'; those that there are: {', '.join(packaged())}.",
                where=name or vehicle.name,
                channel="--servos",
                hint="Give one of them, or a file of your own.",
            )
    return servo_mapping(servos or "", vehicle)


def _own_process() -> None:
    if threading.current_thread() is threading.main_thread():  # started in a shell's background it would be ignored
        signal.signal(signal.SIGINT, signal.default_int_handler)


def link_ardupilot(
    vehicle: Vehicle,
    *,
    name: str | None = None,
    servos: str | Path | None = None,
    port: int = 9002,
    listen: str = "127.0.0.1",
    environment: Environment | None = None,
    voltage: float | None = None,
    sag: float = 0.0,
    noisy: bool = False,
    seed: int = 0,
    record: str | Path | None = None,
    record_rate: float = 200.0,
    idle_exit: float | None = None,
    estimate: Sequence[str] = (),
    truth: Mapping[str, float] | None = None,
    notice: Say = print,
    say: Say = _silent,
) -> Linked:
    """Be the physics of ArduPilot's SITL (`arducopter-heli --model JSON:127.0.0.1`), in lockstep over UDP.

    The vehicle stands on the ground with its rotors stopped until the autopilot starts it, and stands there again when
    the autopilot is restarted. An interrupt (Ctrl-C) ends.

    Args:
        vehicle: what flies.
        name: as the vehicle is called; of that name a packaged servo mapping is looked for (None: the vehicle's own).
        servos: another packaged servo mapping, or a file.
        port, listen: where to wait; addresses beyond this machine let others fly.
        environment: wind and air.
        voltage: of the battery at the start [V]. sag: its fall [V/s].
        noisy: gyros and accelerometers with noise and bias. seed: of it.
        record: keep the true flights on disk while they are flown (.nc or .csv). record_rate: samples per second kept.
        idle_exit: end after so many seconds without an autopilot.
        estimate: parameters and equations that recursive estimators follow while it is in the air
            (`links.estimating`); `notice` is told every few seconds.
        truth: numbers of the card that what flies has instead, which the estimators have to find.
        notice: told what the user must know. say: told what is going on.

    Raises:
        SwashError: where the vehicle has no ground or no servo mapping, or the address cannot be had.
    """
    from swashplate.links.ardupilot.runner import serve
    from swashplate.links.ardupilot.session import ArduPilotSession

    made = LinkAsked(vehicle, servos, environment, name, voltage, sag, record, record_rate, estimate, truth, seed)
    plant, recorder = linked_plant(made, "", notice)
    notices = Notices(notice)
    with listen_udp(listen, port) as bound:
        _tell_where("UDP", bound.getsockname(), listen, plant, notice=notice, say=say)
        session = ArduPilotSession(plant, linked_sensing(plant, noisy=noisy, seed=seed), notices)
        saved: tuple[Path, ...] = ()
        try:
            serve(bound, session, idle_exit=idle_exit)
        except KeyboardInterrupt:
            pass
        finally:
            saved = finish_link(plant, recorder, session.progress.exchanges, notices.summary(), say)
    return Linked(session.progress.exchanges, plant.time, notices.summary(), saved, _known(plant))


def link_px4(
    vehicle: Vehicle,
    *,
    name: str | None = None,
    servos: str | Path | None = None,
    port: int = 4560,
    listen: str = "127.0.0.1",
    environment: Environment | None = None,
    voltage: float | None = None,
    sag: float = 0.0,
    noisy: bool = True,
    seed: int = 0,
    record: str | Path | None = None,
    record_rate: float = 200.0,
    idle_exit: float | None = None,
    estimate: Sequence[str] = (),
    truth: Mapping[str, float] | None = None,
    notice: Say = print,
    say: Say = _silent,
) -> Linked:
    """Be the simulator of PX4's SITL (`make px4_sitl none_iris` and the like): MAVLink HIL in lockstep over TCP.

    The vehicle stands on the ground whenever PX4 connects. An interrupt (Ctrl-C) ends. Arguments and errors are those
    of `link_ardupilot`; it also needs the extra `link`.
    """
    from swashplate.links.px4.runner import serve
    from swashplate.links.px4.session import Px4Session

    made = LinkAsked(vehicle, servos, environment, name, voltage, sag, record, record_rate, estimate, truth, seed)
    plant, recorder = linked_plant(made, "_px4", notice)
    notices = Notices(notice)
    session = Px4Session(plant, linked_sensing(plant, noisy=noisy, seed=seed), notices, seed=seed)
    with listen_tcp(listen, port) as listening:
        _tell_where("TCP", listening.getsockname(), listen, plant, notice=notice, say=say)
        saved: tuple[Path, ...] = ()
        try:
            serve(listening, session, notices, idle_exit=idle_exit)
        except KeyboardInterrupt:
            pass
        finally:
            saved = finish_link(plant, recorder, session.exchanges, notices.summary(), say)
    return Linked(session.exchanges, plant.time, notices.summary(), saved, _known(plant))


def write_ardupilot_parameters(
    vehicle: Vehicle,
    path: str | Path,
    *,
    trim: Trim,
    name: str | None = None,
    servos: str | Path | None = None,
    notice: Say = print,
) -> Path:
    """Write ArduPilot's parameters for a vehicle in hover, gains of all loops included; returns the file.

    The gains are those of `autopilot_gains`. Where none hold their margins the file has none, and `notice` is told.

    Args:
        vehicle: what ArduPilot will fly.
        path: of the file.
        trim: its hover.
        name, servos, notice: as of `link_ardupilot`.

    Raises:
        SwashError: where the folder is missing or there is no servo mapping.
    """
    file = Path(path)
    if not file.absolute().parent.is_dir():
        raise SwashError("the folder does not exist.", where=file.parent, channel="--out")
    mapping = mapping_of(vehicle, servos, name=name, suffix="")
    settings = parameters(mapping, vehicle, trim) | gains_to_write(mapping, vehicle, trim, notice=notice)
    return write_text(file, parameter_file(settings, title=vehicle.card.title))


def gains_to_write(mapping: ServoMapping, vehicle: Vehicle, trim: Trim, *, notice: Say) -> Parameters:
    """ArduPilot's gains of all loops by `autopilot_gains`; none, and `notice` is told, where none hold margins."""
    late = complete_delays(vehicle, input_delays(vehicle) or ASSUMED_DELAY)
    try:
        return written_gains(cascade_gains(vehicle, trim, ardupilot_law(mapping, vehicle, trim), delays=late).law)
    except ControllerError as error:
        notice(f"The file has no gains, ArduPilot's own would fly: {error.problem}")
        return {}


@dataclass(frozen=True)
class LinkAsked:
    """What both links are asked for alike; see `link_ardupilot`."""

    vehicle: Vehicle
    servos: str | Path | None
    environment: Environment | None
    name: str | None
    voltage: float | None
    sag: float
    record: str | Path | None
    rate: float
    estimate: Sequence[str]
    truth: Mapping[str, float] | None
    seed: int


def linked_plant(
    asked: LinkAsked, suffix: Literal["", "_px4"], notice: Say, motors: MotorMapping | SwashServoMapping | None = None
) -> tuple[Plant, Recorder | None]:
    file = None if asked.record is None else Path(asked.record)
    check_record(file)
    _own_process()
    around = environment_of(asked.vehicle, asked.environment)
    if asked.voltage is not None:
        if not 0.0 < asked.voltage < 1000.0:
            raise SwashError(f"is {asked.voltage:g} V, expected 0 to 1000.", channel="voltage")
        around = around._replace(voltage=asked.voltage)
    aircraft = standing(asked.vehicle.with_values(asked.truth) if asked.truth else asked.vehicle)
    mapping = motors or mapping_of(aircraft, asked.servos, name=asked.name, suffix=suffix)
    recorder = None
    if file is not None:
        recover(file, notice)
        recorder = Recorder(
            file,
            like=unflown(aircraft, details={"link": True, "rate": asked.rate}),
            say=notice,
            judge=partial(monitored, vehicle=aircraft),
        )
    estimating = None
    if asked.estimate:
        from swashplate.links.estimating import Estimating

        estimating = Estimating(asked.vehicle, asked.estimate, rate=_ESTIMATED, seed=asked.seed, say=notice)
    plant = Plant(
        aircraft,
        mapping,
        Surroundings(around, asked.sag),
        recorder=recorder,
        record_rate=asked.rate,
        engine=link_engine(notice),
        estimating=estimating,
    )
    plant.prepare()
    return plant, recorder


def link_engine(notice: Say) -> MakeEngine:
    """The vehicle's own C where this machine can compile it, which is quicker; the virtual machine elsewhere."""
    from swashplate.compiled import can_compile
    from swashplate.export.stepping_c import CompiledEngine

    def make(moved: Vehicle, environment: Environment) -> SteppingEngine:
        if can_compile():
            try:
                return CompiledEngine(moved, environment)
            except (SwashError, OSError) as error:  # a compiler without headers, a folder that nothing runs from
                notice(f"The vehicle's C cannot be used here, a slower virtual machine steps instead: {error}")
        return VirtualEngine(moved, environment)

    return make


def linked_sensing(plant: Plant, *, noisy: bool, seed: int) -> Sensing:
    return Sensing(plant, unit=InertialUnit() if noisy else None, seed=seed)


def _tell_where(kind: str, at: tuple[str, int], listen: str, plant: Plant, *, notice: Say, say: Say) -> None:
    if not is_loopback(listen):
        notice(f"Listening beyond this machine, on {listen}: anyone who reaches it can fly this vehicle.")
    say(f"{plant.vehicle.card.title}: waiting for an autopilot on {kind} {at[0]}:{at[1]}. Ctrl-C ends.")


def _known(plant: Plant) -> tuple[KnownNow, ...]:
    return () if plant.estimating is None else plant.estimating.known


def finish_link(plant: Plant, recorder: Recorder | None, exchanges: int, counts: str, say: Say) -> tuple[Path, ...]:
    say(repr(Linked(exchanges, plant.time, counts, (), _known(plant))))
    saved = () if recorder is None else recorder.finish()
    if recorder is not None:
        say(f"written: {', '.join(map(str, saved))}" if saved else "nothing was flown, nothing is written.")
    return saved
